"""Whole stories, by real mouse clicks: from a picture to a calibration, and the same numbers at every door."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.demo_cameras import CAMERAS
from tests.support.held_requests import holding
from tests.support.manual_pictures import manual_picture
from tests.support.sim_clicks import border_clicks
from tests.support.tiers import long
from tests.support.waiting import until
from tests.support.words import like, t
from touchline.core.field import BORDERS
from touchline.core.field_json import field_from_json
from touchline.sources import SourceContext, source_from_url

STRAIGHT_PX = 1.0  # how straight a border must be in the corrected picture
REAL = {
    "ssl_2008_half": "fields/ssl_2008/ssl-field-2008.jpg",
    "unball_full": "fields/unball/unball_path1.png",
}


def test_the_demo_camera_from_opening_to_an_active_calibration(operator, server, tmp_path):
    camera, region = _truth(server, CAMERAS[0])
    operator.take()
    for feature, points in border_clicks(camera, region, 9).items():
        operator.click(feature, points[1:-1])  # a corner belongs to two borders
    expect(operator.page.get_by_test_id("verdict")).to_have_attribute("data-level", "poor")
    manual_picture(operator.page, "points")
    operator.next("verify")
    expect(operator.page.get_by_test_id("corrected")).to_be_visible(timeout=LONG_MS)
    operator.page.screenshot(path=tmp_path / "compare.png")
    made = operator.next("verify").saved()
    operator.activate(warned=True)  # by its borders alone nobody knows how high the camera is
    assert server.api("GET", f"/calibrations/{made['id']}").json()["active"]
    assert server.api("GET", "/cameras/overhead").json()["active_calibration"] == made["id"]


@pytest.mark.long
def test_models_are_ranked_and_a_warning_leads_to_its_cure(operator, server):
    """From straight above nothing but a tape tells how high a camera hangs."""
    straight_down = {
        "id": "straight-down",
        "name": "Straight down",
        "field": "vsss-3v3",
        "region": "full",
        "source": "sim://vsss-3v3?lens=strong",
    }
    assert server.api("POST", "/cameras", json=straight_down).status_code == 201
    camera, region = _truth(server, straight_down)
    operator.page.reload()
    page = operator.take("straight-down").page
    for feature, points in border_clicks(camera, region, 9).items():
        operator.click(feature, points[1:-1])
    operator.open_lens()
    recommended = page.get_by_test_id("models").get_by_text(t("calibrate.model-table.recommended"))
    expect(recommended).to_be_visible(timeout=LONG_MS)
    page.get_by_test_id("model-brown-conrady").click()
    page.get_by_test_id("enter-height").click()
    expect(page.get_by_test_id("option-height_mm")).to_be_focused()
    page.get_by_test_id("option-height_mm").fill(f"{camera.position_mm[2]:.0f}")
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("enter-height")).to_have_count(0, timeout=LONG_MS)
    assert operator.draft()["options"]["height_mm"]["value"] == pytest.approx(
        camera.position_mm[2], abs=0.5
    )
    expect(page.get_by_test_id("verdict")).to_have_attribute("data-level", "good")
    expect(page.get_by_test_id("next-click")).to_contain_text(like("canvas.overlay.next-click"))
    server.api("DELETE", "/cameras/straight-down")


@pytest.mark.parametrize("name", ["ssl_2008_half", long("unball_full")])
def test_real_clicks_through_the_page_give_the_numbers_of_rest_and_shell(
    operator, server, clicks, real_data, tmp_path, name
):
    picture, given = real_data(REAL[name]), clicks(name)
    operator.open(picture, given["field"], given["region"]).click_all(
        given["observations"]
    ).use_model("polynomial")
    assert operator.draft()["observations"] == [{**o, "z_mm": 0} for o in given["observations"]]
    operator.page.screenshot(path=tmp_path / "borders.png")
    operator.next("verify")
    page = operator.saved()

    rest = server.api("POST", "/calibrations", json={**given, "model": "polynomial"}).json()
    assert rest["model"]["parameters"] == page["model"]["parameters"]
    assert rest["report"] == page["report"]

    shell = _calibrated_by_shell(picture, given, tmp_path)
    assert shell["model"]["parameters"] == page["model"]["parameters"]
    assert shell["report"]["rms_px"] == pytest.approx(page["report"]["rms_px"], abs=1e-12)

    for feature, axis, at in (
        ("left", 0, 0),
        ("top", 1, 0),
        ("right", 0, None),
        ("bottom", 1, None),
    ):
        raw = next(o["points"] for o in given["observations"] if o["feature"] == feature)
        answer = server.api(
            "POST",
            f"/calibrations/{page['id']}/transform",
            json={"from": "image", "to": "corrected", "points": raw},
        ).json()
        across = np.array(answer["points"])[:, axis]
        wanted = page["corrected_size"][axis] - 1 if at is None else at
        assert np.abs(across - wanted).max() <= STRAIGHT_PX
    expect(operator.page.get_by_test_id("corrected")).to_be_visible(timeout=LONG_MS)
    operator.page.screenshot(path=tmp_path / "compare.png")


@pytest.mark.long
def test_saving_the_same_clicks_again_makes_no_new_version(
    operator, straight_picture, frame_points
):
    operator.open(straight_picture, "table", "full")
    for feature in BORDERS:
        operator.click(feature, frame_points[feature])
    operator.next("verify")
    first = operator.saved()["id"]
    operator.page.get_by_test_id("step-points").click()
    operator.next("verify")
    assert operator.saved()["id"] == first


@pytest.mark.long
def test_a_version_that_is_asked_for_twice_is_saved_once(
    operator, server, straight_picture, frame_points
):
    """By a hand that is quicker than the server."""
    page, held = operator.page, []
    operator.open(straight_picture, "table", "full")
    for feature in BORDERS:
        operator.click(feature, frame_points[feature])
    operator.open_lens()
    expect(page.get_by_test_id("next")).to_have_attribute("aria-disabled", "false", timeout=LONG_MS)
    page.route("**/api/v1/calibrations", lambda route: held.append(route))
    until(lambda: page.keyboard.press("Control+s") or page.wait_for_timeout(500) or held, bool)
    expect(page.get_by_test_id("next")).to_have_text(t("versions.saving"))
    page.keyboard.press("Control+s")
    page.wait_for_timeout(300)  # for a second request
    for route in held:
        route.continue_()
    operator.is_at("verify")
    assert len(held) == 1


@pytest.mark.long
def test_every_download_is_the_saved_version(operator, straight_picture, frame_points):
    operator.open(straight_picture, "table", "full")
    for feature in BORDERS:
        operator.click(feature, frame_points[feature])
    operator.next("verify").unfold("export")
    files = {}
    for form in ("json", "npz", "png"):
        with operator.page.expect_download() as download:
            operator.page.get_by_test_id(f"download-{form}").click()
        files[form] = Path(download.value.path()).read_bytes()
    assert json.loads(files["json"])["id"] == operator.saved()["id"]
    assert files["npz"].startswith(b"PK")
    assert files["png"].startswith(b"\x89PNG")


@pytest.mark.long
def test_a_stray_click_is_named_and_can_be_removed(operator, straight_picture, frame_points):
    operator.open(straight_picture, "table", "full")
    for feature in BORDERS:
        operator.click(feature, frame_points[feature])
    operator.click("left", [[110, 240]])
    page = operator.page
    expect(page.locator("[data-point='left:6'].stray")).to_be_visible()
    removal = page.get_by_test_id("remove-stray").first
    with holding(page, "**/fit/attempt*", "POST"):
        operator.click("right", [[560, 320]])
        # it speaks of the points of before
        expect(removal).to_have_attribute("aria-disabled", "true")
    removal.click()
    expect(page.locator(".point.stray")).to_have_count(0)
    assert operator.points("left") == frame_points["left"]


def _truth(server, settings):
    """A simulated camera itself, and the region it looks at."""
    field = field_from_json(server.api("GET", f"/fields/{settings['field']}").json())
    source = source_from_url(settings["source"], SourceContext(fields={field.name: field}))
    return source.camera, field.region(settings["region"])


def _calibrated_by_shell(picture, given, tmp_path):
    points, out = tmp_path / "points.json", tmp_path / "calibration.json"
    points.write_text(json.dumps(given))
    command = [
        str(Path(sys.executable).parent / "touchline"),
        "calibrate",
        str(picture),
        "--field",
        given["field"],
        "--region",
        given["region"],
        "--points",
        str(points),
        "-o",
        str(out),
    ]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(out.read_text())
