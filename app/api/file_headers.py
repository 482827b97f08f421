"""Headers of a file that is sent: its name, and what it is off by."""

import re
from typing import Literal
from unicodedata import combining, normalize
from urllib.parse import quote

from app.evaluate.fit.approximation import ApproximationError

# What ends a header or a path, is no letter anywhere, or turns the reading direction and so hides a name's ending.
UNKEPT = re.compile(r'[\x00-\x1f\x7f-\x9f/\\:*?"<>|\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]')
LONGEST = 80  # characters: of four bytes each, with %-signs, still no header that a proxy would refuse
END = 30


def attachment(name: str) -> str:
    """Content-Disposition of a file that is to be kept under that name, as far as systems can keep it."""
    return disposition("attachment", name)


def disposition(kind: Literal["attachment", "inline"], name: str) -> str:
    """RFC 6266: a name of plain letters for everybody, and where that is another one the true one in filename*."""
    kept = UNKEPT.sub("_", name).strip("-. ") or "file"
    if len(kept) > LONGEST:  # its end says version and format
        kept = f"{kept[:LONGEST - END - 1]}_{kept[-END:]}"
    letters = "".join(letter for letter in normalize("NFKD", kept) if not combining(letter))  # é is e and an accent
    plain = re.sub(r"[^A-Za-z0-9._-]", "_", letters)
    more = "" if plain == kept else f"; filename*=UTF-8''{quote(kept, safe='', errors='replace')}"
    return f'{kind}; filename="{plain}"{more}'


def error_header(loss: ApproximationError | None) -> dict[str, str]:
    """The worst error over the region, mm, and what else is known: 12.310;rms=3.200;hat=14.050;hat-rms=3.900."""
    if loss is None:
        return {}
    parts = [f"{loss.worst_mm:.3f}", f"rms={loss.rms_mm:.3f}"]
    if loss.hat_worst_mm is not None:
        parts += [f"hat={loss.hat_worst_mm:.3f}", f"hat-rms={loss.hat_rms_mm:.3f}"]
    return {"X-Approximation-Error-Mm": ";".join(parts)}
