"""A field that nobody has described, proposed from the lines of one picture and a length that was measured."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from touchline.core.errors import BadInput, FitFailed
from touchline.core.field import LINE_SIGMA_MM, FieldJson
from touchline.core.jobs import Progress, no_progress
from touchline.core.sentences import DETECTING_LINES
from touchline.core.statements import Stated, say, stated
from touchline.fitting.field_lines.proposed_field import propose_field
from touchline.workflows.automatic import detect_lines

NAME, TITLE = "new-field", "New field"
SIGMA_SHARE = 0.002  # of the length: what is read from a picture is no more exact


class ProposedFieldJson(Stated):
    """The field. corners: of its borders, raw px, null beyond the lens. sentence: how far its size is known."""

    field: FieldJson
    is_ratio_known: bool
    corners: list[list[float | None]]
    sentence: str


def proposed_field(pixels: NDArray[np.uint8], length_mm: float | None, width_mm: float | None,
                   progress: Progress = no_progress) -> ProposedFieldJson:
    """Return the field that the lines form, of that length between the goal lines or that width, or of both.

    BadInput where neither is given, or a width that is more than the length; FitFailed where no four lines are borders.
    """
    if not (length_mm or width_mm):
        raise BadInput(say("field.no-length", "A field's size needs a length."),
                       say("field.no-length.fix", "Give length_mm, width_mm, or both."), reason="no-length")
    if length_mm and width_mm and width_mm > length_mm:
        raise BadInput(say("field.width-over-length", "The width is more than the length."), say(
            "field.width-over-length.fix", "Give the longer side as length_mm."), reason="bad-size")
    progress(0.0, DETECTING_LINES)
    lines = detect_lines(pixels)
    progress(0.6, say("progress.finding-borders", "Finding the borders"))
    found = propose_field(lines.seen, lines.chains, length_mm, width_mm)
    if found is None:
        raise FitFailed(say("field.no-borders", "No four lines in the image form the borders of a field."), say(
            "field.no-borders.fix", "Take an image that shows all four borders, or add a field in the editor."),
            reason="no-borders")
    size = {"length": found.field.length_mm / 1000, "width": found.field.width_mm / 1000}
    sentence = (say("field.proposed", "The lines form a field of {length:.2f} × {width:.2f} m.", **size)
                if found.is_ratio_known else
                say("field.proposed-roughly", "The lines form a field of about {length:.2f} × {width:.2f} m. No centre "
                    "circle was measured: its width may be several per cent off.", **size))
    sigma_mm = max(LINE_SIGMA_MM, float(round(SIGMA_SHARE * found.field.length_mm)))
    return stated(ProposedFieldJson(
        field=replace(found.field, name=NAME, title=TITLE, line_sigma_mm=sigma_mm).to_json(),
        is_ratio_known=found.is_ratio_known, corners=found.corners.round(1).tolist(), sentence=sentence))
