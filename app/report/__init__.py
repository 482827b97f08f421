"""A calibration as one page to print or keep, and as the same in JSON.

    contents.py   everything the report says, as plain JSON: the page and report.json are both made of it
    figures.py    the numbers that head it, each with its unit and how to read it in half a sentence
    reading.py    values out of a record that a stranger may have written
    drawing.py    the pictures: as it was taken, corrected, and maps of expected error
    page.py       the page; markup.py escapes whatever goes into it, style.py dresses it

    said = contents(calibration, Shown(frame))
    html = page(said, draw(calibration, Shown(frame), said))
"""

from app.report.contents import Shown, contents, shown_of
from app.report.drawing import draw
from app.report.page import page

__all__ = ["Shown", "contents", "draw", "page", "shown_of"]
