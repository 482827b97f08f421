"""A report as a file on a machine without a network: everything is in it, nothing is asked for, and it prints on A4."""

import re
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from tests.e2e.conftest import LONG_MS
from tests.support.manual_pictures import manual_picture
from tests.support.operator import FIELD, REGION, SIZE, reference_camera
from tests.support.pictures import encoded
from tests.support.sim_clicks import border_observations
from touchline.sources.sim.render import Rendering

FRIENDLY_PAGES = 6  # an operator's calibration; ours has four borders and their parameters


@pytest.fixture(scope="module")
def calibration(server) -> dict:
    """A lens model of the reference camera, with a stray click and a note."""
    body = {**FIELD.to_json(), "name": "reported"}
    assert server.api("PUT", "/fields/reported", json=body).ok
    camera = reference_camera("strong", 8)
    picture = encoded("png", Rendering.of(camera, FIELD, REGION).frame(0))
    snapshot = server.api("POST", "/snapshots", files={"file": picture}).json()
    observations = [
        o.to_json() for o in border_observations(camera, REGION, 12, 0.3, np.random.default_rng(3))
    ]
    observations[1]["points"][4][0] += 30
    answer = server.api(
        "POST",
        "/calibrations",
        json={
            "field": "reported",
            "region": "full",
            "model": "brown-conrady",
            "snapshot": snapshot["id"],
            "observations": observations,
            "note": "before the semi-final",
        },
    )
    assert answer.ok, answer.text
    return answer.json()


@pytest.mark.long
def test_the_file_opens_and_prints_without_a_network(page: Page, server, calibration, tmp_path):
    mischief = {"note": "<script>document.title = 'hacked'</script>"}
    assert server.api("PATCH", f"/calibrations/{calibration['id']}", json=mischief).ok
    html = server.api("GET", f"/calibrations/{calibration['id']}/report.html")
    file = tmp_path / "report.html"
    file.write_bytes(html.content)
    asked, complaints = [], []
    page.on("request", lambda request: asked.append(request.url))
    page.on("console", lambda message: complaints.append(message.text))
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.context.set_offline(True)
    page.goto(file.as_uri())
    page.emulate_media(media="print", color_scheme="light")
    expect(page.get_by_role("heading", level=1)).to_contain_text(
        f"version {calibration['version']}"
    )
    assert page.title().startswith("Calibration of")
    assert [url for url in asked if not url.startswith("data:")] == [
        file.as_uri()
    ] and complaints == []
    for image in page.locator("img").all():
        assert image.evaluate("image => image.complete && image.naturalWidth > 300")
    expect(page.locator("svg.photograph image")).to_have_count(2)
    box = page.locator("svg.photograph image").first.bounding_box()
    assert box["width"] / box["height"] == pytest.approx(SIZE.width / SIZE.height, rel=0.01)
    page.screenshot(path=tmp_path / "report.png", full_page=True)
    printed = page.pdf(
        path=tmp_path / "report.pdf", prefer_css_page_size=True, print_background=True
    )
    sheets = re.findall(rb"/MediaBox\s*\[\s*0 0 ([\d.]+) ([\d.]+)\s*\]", printed)
    assert 2 <= len(sheets) <= FRIENDLY_PAGES
    assert all(
        float(w) == pytest.approx(595, abs=2) and float(h) == pytest.approx(842, abs=2)
        for w, h in sheets
    )


def test_the_page_opens_the_report_of_the_saved_version_and_nothing_in_it_is_wider_than_a_sheet(
    operator, calibration
):
    draft = {
        name: calibration[name] for name in ("field", "region", "rotate", "options", "observations")
    }
    operator.go_on(calibration["snapshot"], {**draft, "model": "brown-conrady"}, "verify")
    with operator.page.context.expect_page() as opened:
        operator.page.get_by_test_id("report").click()
    report = opened.value
    expect(report.get_by_role("heading", level=1)).to_contain_text(
        "Calibration of", timeout=LONG_MS
    )
    assert Path(report.url).name == "report.html" and calibration["id"] in report.url
    manual_picture(report, "reports")
    # 184 mm at 96 dots an inch, with little to spare
    report.set_viewport_size({"width": 690, "height": 900})
    assert report.evaluate(
        "() => document.documentElement.scrollWidth <= document.documentElement.clientWidth"
    )
