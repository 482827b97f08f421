"""What speaks against a field that was adjusted to a tape: moves that no painter makes, or that nothing confirms."""

from collections.abc import Mapping, Sequence

from touchline.core.records import Warning
from touchline.core.sentences import marking_name
from touchline.core.statements import say

FAR_SIGMAS = 6.0  # of the field's own σ: 18 mm where it says 3
NOTICED_SIGMAS = 2.0  # of it as well: a smaller move may be as uncertain as it likes
UNSURE_SHARE = 0.5  # of a move, its σ: whether the line moved at all, or another one, is not known
RESIDUAL_SIGMAS = 3.0  # of the distance's own σ

Offsets = Mapping[str, tuple[float, float | None]]


def move_warnings(offsets_mm: Offsets, usual_mm: float) -> list[Warning]:
    """Warn of lines and arcs that were moved far, or by no more than is known of it, mm and σ, the furthest first."""
    warnings = []
    for name, (mm, sigma) in sorted(offsets_mm.items(), key=lambda item: -abs(item[1][0])):
        if sigma is not None and abs(mm) > NOTICED_SIGMAS * usual_mm and sigma > UNSURE_SHARE * abs(mm):
            warnings.append(Warning("uncertain-move", say(
                "warning.uncertain-move", "The measurements do not determine where the {line} is: moved by {mm:.0f} ± "
                "{sigma_mm:.0f} mm.", line=marking_name(name), mm=mm, sigma_mm=sigma), say(
                "warning.uncertain-move.fix", "Measure more distances to this line, from both of its ends."), name))
        elif abs(mm) > FAR_SIGMAS * usual_mm:
            warnings.append(Warning("large-move", say(
                "warning.large-move", "The {line} was moved by {mm:.0f} mm.", line=marking_name(name), mm=mm), say(
                "warning.large-move.fix", "Check the field type, and measure the distances to this line again."), name))
    return warnings


def residual_warnings(distances: Sequence[tuple[str, str, float]], residuals_mm: Sequence[float]) -> list[Warning]:
    """Warn of distances that contradict the others. distances: from, to and σ mm; residuals_mm: of each."""
    return [Warning("distance-contradicted", say(
        "warning.distance-contradicted", "The distance from {start} to {end} differs by {mm:.0f} mm from the others.",
        start=marking_name(start), end=marking_name(end), mm=mm), say(
        "warning.distance-contradicted.fix", "Measure this distance again, or check how it was entered."), index=number)
        for number, ((start, end, sigma), mm) in enumerate(zip(distances, residuals_mm, strict=True))
        if abs(mm) > RESIDUAL_SIGMAS * sigma]
