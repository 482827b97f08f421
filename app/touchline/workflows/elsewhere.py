"""Which lines of a field are painted elsewhere than its file has them, by a camera that its other lines give."""

from collections.abc import Collection, Sequence

from typing_extensions import TypedDict

from touchline.core.errors import ProblemJson
from touchline.core.field import Field, Region
from touchline.core.geometry import Pixels
from touchline.core.sentences import marking_name
from touchline.core.statements import Sentence, say, stated
from touchline.evaluate.field_lines.measurement import line_deviations, measure_single_markings
from touchline.evaluate.verification import MISSING_SHOWN
from touchline.models import CameraModel

SURELY = 0.6  # of a marking, seen in one course
FAR, MIN_OFF_MM = 3.0, 5.0  # times the field's own σ of a line; what is nearer is paint
OF_OTHER_PAINT = {"lines-missing", "lines-unexplained"}  # doubts that such lines give


class LineElsewhere(TypedDict):
    """A marking, and how far beside its place it is painted, mm."""

    feature: str
    mm: float


def lines_elsewhere(model: CameraModel, gray: Pixels, field: Field, region: Region, missing: Collection[str],
                    ) -> list[LineElsewhere]:
    """Return which of the missing lines are further off, the farthest first. gray (h, w): with its lines bright."""
    least_mm = max(FAR * field.line_sigma_mm, MIN_OFF_MM)
    found: list[LineElsewhere] = [
        {"feature": line["feature"], "mm": abs(line["mean_mm"])}
        for line in line_deviations(measure_single_markings(model, gray, field, region, missing))
        if line["mean_mm"] is not None and abs(line["mean_mm"]) > least_mm
        and line["found_share"] >= SURELY]
    return sorted(found, key=lambda line: -line["mm"])


def elsewhere_sentence(lines: Sequence[LineElsewhere]) -> Sentence:
    named = [say("lines.elsewhere.one", "{line} by {mm:.0f} mm", line=marking_name(line["feature"]), mm=line["mm"])
             for line in lines[:MISSING_SHOWN]]
    return say("lines.elsewhere", "Lines of this field are painted elsewhere: {lines}.", lines=named)


def told_by(doubts: Sequence[ProblemJson], lines: Sequence[LineElsewhere]) -> list[ProblemJson]:
    """Return the doubts; in place of those that come of lines painted elsewhere, these lines."""
    others = [doubt for doubt in doubts if doubt["reason"] not in OF_OTHER_PAINT]
    if not lines or len(others) == len(doubts):
        return list(doubts)
    return [stated(ProblemJson(reason="painted-elsewhere", what=elsewhere_sentence(lines), fix=say(
        "lines.elsewhere.fix", "Edit a copy of this field with these distances, then detect again."))), *others]
