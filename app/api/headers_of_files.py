"""Headers of a file that is sent: its name, and what it is off by."""

import re

from app.evaluate.stand_in import Loss


def attachment(name: str) -> str:
    """Content-Disposition, with a name that every system can keep."""
    return f'attachment; filename="{re.sub(r"[^A-Za-z0-9._-]", "_", name)}"'


def error_header(loss: Loss | None) -> dict[str, str]:
    """The worst error over the region, mm, and what else is known: 12.310;rms=3.200;hat=14.050;hat-rms=3.900."""
    if loss is None:
        return {}
    parts = [f"{loss.worst_mm:.3f}", f"rms={loss.rms_mm:.3f}"]
    if loss.hat_worst_mm is not None:
        parts += [f"hat={loss.hat_worst_mm:.3f}", f"hat-rms={loss.hat_rms_mm:.3f}"]
    return {"X-Approximation-Error-Mm": ";".join(parts)}
