"""Numbers and names as a sentence prints them: no machine's exponents, true minus, a capital at the start."""

import math
import re

SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
MIN_PLAIN = 1e-6  # below it noughts are no longer counted: 3.1 × 10⁻⁸
MAX_PLAIN = 1e6
MIN_SIGMA = 1e-300  # a σ below it is none


def format_number(value: float, digits: int = 2) -> str:
    """With that many significant digits, whole parts in full: 0.26, 1.5, 124, −0.000064, 3.1 × 10⁻⁸."""
    if not math.isfinite(value):
        return "unknown"
    rounded = float(f"{value:.{digits - 1}e}")
    power = _power(rounded)
    if rounded != 0 and not MIN_PLAIN <= abs(rounded) < MAX_PLAIN:
        mantissa = f"{rounded:.{digits - 1}e}".partition("e")[0].replace("-", "−")  # 10⁻³²⁴ is no number to divide by
        return f"{mantissa} × 10{str(power).translate(SUPERSCRIPT)}"
    if power >= digits:
        return _fixed(value, 0)  # 124, not 120: whole parts in full
    text = _fixed(rounded, max(0, digits - 1 - power))
    return text.rstrip("0").rstrip(".") if "." in text else text


def format_with_sigma(value: float, sigma: float) -> str:
    """A value and how well it is known, to two digits of its σ: −0.000064 ± 0.00008, (−6.4 ± 8) × 10⁻⁸."""
    if not (math.isfinite(value) and math.isfinite(sigma) and sigma > MIN_SIGMA):
        return format_number(value)
    power = _power(sigma)
    if not MIN_PLAIN <= sigma < MAX_PLAIN:
        both = f"({_fixed(value / 10.0**power, 1)} ± {format_number(sigma / 10.0**power)})"
        return f"{both} × 10{str(power).translate(SUPERSCRIPT)}"
    return f"{_fixed(value, max(0, 1 - power))} ± {format_number(sigma)}"


def format_mm(value: float) -> str:
    """Millimetres, to a tenth below 10."""
    return f"{value:.1f} mm" if value < 10 else f"{value:.0f} mm"


def _power(value: float) -> int:
    """Of ten, of the first digit."""
    return int(f"{value:e}".partition("e")[2])


def _fixed(value: float, decimals: int) -> str:
    text = f"{value:.{decimals}f}"
    return text.replace("-", "−" if float(text) else "", 1)


def sentence(text: str) -> str:
    """A sentence that may begin with a name we gave, "image 3" or "view 3"; a file's name stays as it is written."""
    return re.sub(r"\A(?:image|picture|view)(?= \d)", lambda name: name[0].capitalize(), text)
