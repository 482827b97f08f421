"""Headers of a file that is sent: its name, and its approximation error."""

import re
from typing import Literal
from unicodedata import combining, normalize
from urllib.parse import quote

from app.evaluate.fit.approximation import ApproximationError

# What ends a header or a path, is no letter anywhere, or turns the reading direction and so hides a name's ending.
UNSAFE = re.compile(r'[\x00-\x1f\x7f-\x9f/\\:*?"<>|\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]')
MAX_LENGTH = 80  # characters: of four bytes each, with %-signs, still no header that a proxy would refuse
END_LENGTH = 30


def attachment(name: str) -> str:
    """Return the Content-Disposition of a file to be saved under that name, as far as systems can."""
    return disposition("attachment", name)


def disposition(kind: Literal["attachment", "inline"], name: str) -> str:
    """Return RFC 6266: a name of ASCII letters for everybody, and the true one in filename* where it differs."""
    name = UNSAFE.sub("_", name).strip("-. ") or "file"
    if len(name) > MAX_LENGTH:  # its end says version and format
        name = f"{name[:MAX_LENGTH - END_LENGTH - 1]}_{name[-END_LENGTH:]}"
    letters = "".join(letter for letter in normalize("NFKD", name) if not combining(letter))  # é is e and an accent
    plain = re.sub(r"[^A-Za-z0-9._-]", "_", letters)
    more = "" if plain == name else f"; filename*=UTF-8''{quote(name, safe='', errors='replace')}"
    return f'{kind}; filename="{plain}"{more}'


def error_header(loss: ApproximationError | None) -> dict[str, str]:
    """Return the worst error over the region, mm, and other measures: 12.310;rms=3.200;hat=14.050;hat-rms=3.900."""
    if loss is None:
        return {}
    parts = [f"{loss.worst_mm:.3f}", f"rms={loss.rms_mm:.3f}"]
    if loss.hat_worst_mm is not None:
        parts += [f"hat={loss.hat_worst_mm:.3f}", f"hat-rms={loss.hat_rms_mm:.3f}"]
    return {"X-Approximation-Error-Mm": ";".join(parts)}
