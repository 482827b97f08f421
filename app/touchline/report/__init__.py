"""A calibration as one page to print or keep, and as the same in JSON.

contents.py   all of the report as plain JSON: the page and report.json are both made of it
drawing.py    the pictures: as it was taken, corrected, and maps of expected error
page.py       the page, from templates/report.html; whatever goes into it is escaped

    data = contents(calibration, ReportPicture(frame))
    html = page(data, draw(calibration, ReportPicture(frame), data))
"""
