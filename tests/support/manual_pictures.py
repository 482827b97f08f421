"""Pictures of the manual: browser tests take them, and compare those that stand in the manual with the page of now.

TOUCHLINE_MANUAL_PICTURES=1 writes them anew instead.
"""

import os

import cv2
import numpy as np
from playwright.sync_api import Locator, Page

from tests.support.paths import ROOT
from tests.support.waiting import until

PICTURES = ROOT / "static" / "help" / "img"
WRITES = bool(os.environ.get("TOUCHLINE_MANUAL_PICTURES"))
QUALITY = 65  # of WebP: small text is readable, and a picture of the whole page takes 50 kB
# what a live picture shows disappears at this size, the layout of a page does not
COARSE = (48, 30)
# of the same page: 0.97, in another font 0.7 to 0.98; of most pages moved by 60 px: below 0.6
MIN_LIKENESS = 0.65


def manual_picture(shown: Page | Locator, name: str) -> None:
    """Take the picture `name` of the manual, or fail where the one in the manual shows another page than this.

    What comes late, as a corrected image does on a busy machine, is waited for.
    """
    path = PICTURES / f"{name}.webp"
    if WRITES:
        path.write_bytes(
            cv2.imencode(".webp", _taken(shown), [cv2.IMWRITE_WEBP_QUALITY, QUALITY])[1].tobytes()
        )
    kept = cv2.imread(str(path))
    assert kept is not None, (
        f"there is no {path.name}: take it with TOUCHLINE_MANUAL_PICTURES=1, and check it"
    )
    until(
        lambda: (
            f"likeness of {path.name}",
            likeness(kept, _taken(shown)),
            "if the page has changed, take it again with TOUCHLINE_MANUAL_PICTURES=1, and check it",
        ),
        lambda found: found[1] >= MIN_LIKENESS,
    )


def _taken(shown: Page | Locator) -> np.ndarray:
    """What is to be seen; of a page without its status bar, which tells of other tests on the same server."""
    taken = cv2.imdecode(np.frombuffer(shown.screenshot(), np.uint8), cv2.IMREAD_COLOR)
    assert taken is not None
    if (
        isinstance(shown, Page)
        and (bar := shown.locator("footer:has([data-testid=status])")).count()
    ):
        box = bar.bounding_box()
        assert box is not None
        taken = taken[: round(box["y"])]
    return taken


def likeness(first: np.ndarray, second: np.ndarray) -> float:
    """Return the correlation of two pictures' brightness at a coarse size: 1 is the same."""
    a, b = (
        cv2.resize(
            cv2.cvtColor(it, cv2.COLOR_BGR2GRAY), COARSE, interpolation=cv2.INTER_AREA
        ).ravel()
        for it in (first, second)
    )
    return float(np.corrcoef(a, b)[0, 1])
