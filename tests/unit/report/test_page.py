"""The page of a report, from the contents and the pictures of it."""

import re
from dataclasses import replace

from tests.support.exported import example
from touchline.report.contents import ReportPicture, contents
from touchline.report.page import Photograph, Stroke, draw, page


def test_strokes_over_a_tall_picture_are_cut_where_it_ends():
    """It is shown 205 mm high at most, and its drawing as wide as the picture then is."""
    record = example("brown-conrady", 0)
    it = contents(record, ReportPicture(None, "none"))
    tall = Photograph(
        "Tall", 300, 900, "data:image/jpeg;base64,", (Stroke("M0 0L900 0", "#ffffff", 1.0),)
    )
    html = page(it, replace(draw(record, ReportPicture(None), it), before=tall))
    (drawing,) = re.findall(r"<svg [^>]*>", html)
    assert 'viewBox="-0.5 -0.5 300 900"' in drawing and "max-width: 68.3mm" in drawing
