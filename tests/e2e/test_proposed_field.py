"""An image of a field in no rule book: it is proposed from the lines, named, saved, and then recognised."""

import re
from itertools import count

import cv2
import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.foreign_field import LENGTH_MM, WIDTH_MM, foreign_scene
from tests.support.manual_pictures import manual_picture
from tests.support.words import t

NUMBERS = count()


@pytest.fixture
def hall(server):
    """A new camera of which nobody has said what it covers, above that field."""
    (server.data / "shown").mkdir(exist_ok=True)
    cv2.imwrite(str(server.data / "shown" / "foreign.png"), foreign_scene().pixels)
    camera = f"foreign-{next(NUMBERS)}"
    server.api(
        "POST", "/cameras", json={"id": camera, "name": "Hall", "source": "picture://foreign.png"}
    )
    yield camera
    server.api("DELETE", f"/cameras/{camera}")
    if any(field["name"] == "our-hall" for field in server.api("GET", "/fields").json()["items"]):
        server.api("DELETE", "/fields/our-hall")


def test_a_field_that_nobody_described_is_proposed_saved_and_recognised(arriving, server, hall):
    page = arriving.visit(detect=True).page
    page.get_by_test_id(f"camera-{hall}").click()
    arriving.is_at("field")
    propose, length = page.get_by_test_id("propose"), page.get_by_test_id("propose-length")
    expect(propose).to_be_disabled(timeout=LONG_MS)  # until a length is typed
    length.fill("five")
    expect(propose).to_be_disabled()
    length.fill(f"{LENGTH_MM:.0f}")
    manual_picture(page, "field-proposed")
    length.press("Enter")
    title = page.get_by_test_id("entry-title")
    expect(title).to_be_visible(timeout=LONG_MS)
    assert (
        title.input_value() == ""
        and page.get_by_test_id("entry-length_mm").input_value() == f"{LENGTH_MM:.0f}"
    )
    assert (
        abs(float(page.get_by_test_id("entry-width_mm").input_value()) - WIDTH_MM)
        < 0.005 * WIDTH_MM
    )
    page.reload()  # what was proposed is not lost
    expect(page.get_by_test_id("entry-length_mm")).to_have_value(
        f"{LENGTH_MM:.0f}", timeout=LONG_MS
    )
    title.fill("Our hall")
    title.press("Enter")
    page.keyboard.press("Control+s")
    expect(page).to_have_url(re.compile("our-hall"), timeout=LONG_MS)
    page.go_back()
    arriving.is_at("field")
    expect(page.get_by_test_id("next")).to_have_text(t("shell.next.use-it"), timeout=LONG_MS)
    expect(page.get_by_test_id("sentence")).to_have_text(re.compile("Our hall"))
    assert server.api("GET", "/fields/our-hall").json()["line_sigma_mm"] == round(0.002 * LENGTH_MM)


def test_after_saving_one_press_leads_back_to_the_image(arriving, hall):
    page = arriving.visit(detect=True).page
    page.get_by_test_id(f"camera-{hall}").click()
    arriving.is_at("field")
    page.get_by_test_id("propose-length").fill(f"{LENGTH_MM:.0f}", timeout=LONG_MS)
    page.get_by_test_id("propose").click()
    title = page.get_by_test_id("entry-title")
    title.fill("Our hall", timeout=LONG_MS)
    title.press("Enter")
    page.get_by_test_id("do-save-field").click()
    back = page.get_by_role("button", name=t("field-editor.saved.back"))
    back.click()
    arriving.is_at("field")
    expect(back).to_have_count(0)
    expect(page.get_by_test_id("next")).to_have_text(t("shell.next.use-it"), timeout=LONG_MS)


def test_an_image_without_one_of_the_borders_is_refused_with_what_to_do(arriving, server):
    page = arriving.visit(detect=True).page
    pixels = foreign_scene().pixels.copy()
    pixels[:, int(0.74 * pixels.shape[1]) :] = pixels[0, 0]  # one end of it is not there
    png = cv2.imencode(".png", pixels)[1].tobytes()
    image = server.api("POST", "/snapshots", files={"file": png}).json()["id"]
    page.goto(f"{server.url}/#/calibrate/{image}/field")
    page.get_by_test_id("propose-length").fill("8000", timeout=LONG_MS)
    page.get_by_test_id("propose").click()
    expect(page.get_by_test_id("not-proposed")).to_contain_text("No four lines", timeout=LONG_MS)
    arriving.is_at("field")
