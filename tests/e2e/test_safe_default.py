"""The primary button alone leads from the start page to an active calibration that is right; detection comes first."""

import re
from dataclasses import replace

import cv2
import numpy as np
import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS, Operator
from tests.support.auto_scenes import SceneSpec, scene_of
from tests.support.demo_cameras import CAMERAS
from tests.support.manual_pictures import manual_picture
from tests.support.tiers import long
from tests.support.words import t
from touchline.core.field_json import field_from_json
from touchline.core.geometry import with_z
from touchline.models import field_from_raw, model_from_json
from touchline.sources import SourceContext, source_from_url

MOST_PRESSES = 6
TRUE_MM = 5.0


def true_mm(server, made: dict) -> tuple[float, float]:
    """How far a calibration of a demo's camera is from the simulator: rms on the carpet and at robot height."""
    settings = next(camera for camera in CAMERAS if camera["id"] == made["camera"])
    field = field_from_json(server.api("GET", f"/fields/{made['field']}").json())
    camera = source_from_url(settings["source"], SourceContext(fields={field.name: field})).camera
    region = field.region(made["region"])
    x, y = np.meshgrid(np.linspace(*region.x_mm, 21), np.linspace(*region.y_mm, 15))
    places = np.stack([x.ravel(), y.ravel()], axis=1)
    model = model_from_json(made["model"]["name"], made["model"]["parameters"])
    found = []
    for z_mm in (0.0, field.hat_height_mm):
        raw = camera.raw_from_field(with_z(places, z_mm))
        seen = camera.sees(raw)
        there = field_from_raw(model, raw[seen]) if z_mm == 0 else model.unproject(raw[seen], z_mm)
        found.append(float(np.sqrt(np.mean(np.sum((there - places[seen]) ** 2, axis=1)))))
    return found[0], found[1]


def by_mouse(page, button):
    button.click()


def by_finger(page, button):
    button.tap()


def by_keyboard(page, button):
    for _ in range(60):
        if button.evaluate("button => button === document.activeElement"):
            break
        page.keyboard.press("Tab")
    expect(button).to_be_focused()
    page.keyboard.press("Enter")


def picture_of_the_readme(page):
    """The page at the step of verifying, as wide as on a desk; the manual has it as well."""
    narrow = page.viewport_size
    page.set_viewport_size({"width": 1440, "height": 900})
    expect(page.get_by_test_id("corrected")).to_be_visible(timeout=LONG_MS)
    manual_picture(page, "calibrating")
    page.set_viewport_size(narrow)


PHONE = pytest.mark.browser_context_args(viewport={"width": 390, "height": 844}, has_touch=True)


@pytest.mark.usefixtures("server")  # which the others share
@pytest.mark.parametrize(
    "press", [pytest.param(by_finger, marks=PHONE), long(by_mouse), long(by_keyboard)]
)
def test_from_the_first_page_by_the_primary_button_alone_to_an_active_calibration_that_is_right(
    new_context, own_server, tmp_path, press
):
    arriving = Operator(new_context().new_page(), own_server)
    page = arriving.visit(detect=True).page
    refused = []
    page.on(
        "response",
        lambda answer: answer.status >= 400 and refused.append((answer.status, answer.url)),
    )
    before = {c["id"] for c in own_server.api("GET", "/calibrations").json()["items"]}
    go, presses = page.get_by_test_id("next"), 0
    while not any(
        c["active"] for c in own_server.api("GET", "/calibrations?brief=true").json()["items"]
    ):
        assert presses < MOST_PRESSES
        expect(go).to_have_attribute("aria-disabled", "false", timeout=LONG_MS)
        name = go.inner_text()
        press(page, go)
        presses += 1
        expect(go).not_to_have_text(name, timeout=LONG_MS)
        page.screenshot(path=tmp_path / f"{presses}.png")
        if name == t("shell.next.continue"):
            expect(page.get_by_test_id("checklist")).not_to_contain_text(
                t("verify.checking"), timeout=LONG_MS
            )
            page.screenshot(path=tmp_path / "verify.png")
            picture_of_the_readme(page)
    made = next(
        c for c in own_server.api("GET", "/calibrations").json()["items"] if c["id"] not in before
    )
    carpet_mm, hat_mm = true_mm(own_server, made)
    # of a height that nobody has measured: 5 to 7
    told_mm = made["report"]["sigma_mm"]["hat"]["rms"]
    assert carpet_mm < TRUE_MM and hat_mm < 2 * told_mm < 4 * TRUE_MM, (carpet_mm, hat_mm, told_mm)
    # the next one without an active version
    calibrate_next = t("common.calibrate-camera", camera=CAMERAS[1]["name"])
    expect(go).to_have_text(calibrate_next)
    press(page, go)
    arriving.is_at("points")
    assert own_server.api("GET", f"/snapshots/{arriving.snapshot}").json()["camera"] == "east"
    assert refused == []


def test_saving_can_be_stopped(clicked):
    operator = clicked("brown-conrady", change=lambda draft: draft.update(model=None))
    page, held = operator.page, []
    go = page.get_by_test_id("next")
    expect(go).to_have_attribute("aria-disabled", "false", timeout=LONG_MS)
    page.route("**/api/v1/calibrations", lambda route: held.append(route))
    go.click()
    expect(go).to_have_text(t("versions.saving"))
    page.get_by_test_id("do-stop-saving").click()
    expect(go).to_have_text(t("shell.next.continue"), timeout=LONG_MS)
    operator.is_at("points")
    expect(page.get_by_test_id("do-stop-saving")).to_have_count(0)
    listed = operator.server.api("GET", "/calibrations?brief=true").json()["items"]
    assert operator.snapshot not in {version["snapshot"] for version in listed}
    page.unroute("**/api/v1/calibrations")
    operator.next("verify")


SPEC = SceneSpec(
    3, "ssl-div-b", "full", "mild", (816, 682), 5500.0, 12.0, 0.0, 3.0, 0.7, 2.0, 0.1, 4, 0
)


def hidden(pixels):
    """The same with most of the inside covered: found, and not surely."""
    covered = pixels.copy()
    height, width = pixels.shape[:2]
    noise = np.random.default_rng(0).integers(
        0, 255, (height // 8 + 1, width // 8 + 1, 3), np.uint8
    )
    patch = cv2.resize(noise, (width, height), interpolation=cv2.INTER_NEAREST)
    covered[height // 4 : -height // 4, width // 3 :] = patch[
        height // 4 : -height // 4, width // 3 :
    ]
    return covered


def test_lines_that_the_detection_is_not_sure_of_are_offered_and_taken_one_by_one_or_all_and_undone(
    arriving, tmp_path
):
    path = tmp_path / "covered.png"
    cv2.imwrite(str(path), hidden(scene_of(SPEC).pixels))
    operator = arriving.visit(detect=True).open(path, "ssl-div-b", "full")
    page = operator.page
    offer = page.get_by_test_id("proposal")
    expect(offer).to_be_visible(timeout=LONG_MS)
    expect(page.get_by_test_id("lines-found")).to_contain_text(
        t("calibrate.find-lines-panel.not-sure")
    )
    assert operator.draft()["observations"] == []
    page.screenshot(path=tmp_path / "offered.png")
    count = offer.locator("li").count()
    assert count > 3
    offer.locator("li button").first.click()
    expect(offer.locator("li")).to_have_count(count - 1)
    assert len(operator.draft()["observations"]) == 1
    page.get_by_test_id("do-propose").click()
    expect(offer).to_have_count(0)
    assert len(operator.draft()["observations"]) == count
    expect(page.get_by_test_id("lines-found")).to_have_count(0)
    for left in (1, 0):
        page.keyboard.press("Control+z")
        assert len(operator.draft()["observations"]) == left
    expect(offer.locator("li")).to_have_count(count)  # as it was, and so is the message
    expect(page.get_by_test_id("lines-found")).to_contain_text(
        t("calibrate.find-lines-panel.not-sure")
    )


@pytest.mark.long
def test_a_point_placed_while_lines_are_detected_stays_and_nothing_is_detected_over_an_operators_points(
    arriving, server, border_draft
):
    snapshot, draft = border_draft("brown-conrady")
    arriving.prefer("detect", "on")
    operator = arriving.go_on(snapshot, draft, "points")
    operator.page.wait_for_timeout(2000)  # in which it would begin
    assert operator.page.get_by_test_id("finding-lines").count() == 0
    assert operator.draft()["observations"] == [{**o, "z_mm": 0} for o in draft["observations"]]


def test_from_straight_above_the_camera_height_is_asked_for_and_nothing_else_is_missing(
    arriving, tmp_path
):
    path = tmp_path / "above.png"
    cv2.imwrite(str(path), scene_of(replace(SPEC, tilt_deg=0.0)).pixels)
    operator = arriving.visit(detect=True).open(path, "ssl-div-b", "full")
    page = operator.page
    expect(page.get_by_test_id("camera-height")).to_be_visible(timeout=LONG_MS)
    expect(page.get_by_test_id("robot-tops")).to_have_text("?")
    page.screenshot(path=tmp_path / "asked.png")
    page.get_by_test_id("enter-height").click()
    height = page.get_by_test_id("option-height_mm")
    expect(height).to_be_focused()
    assert page.get_by_test_id("fold-lens").get_attribute("open") is None
    height.fill(f"{SPEC.height_mm:.0f}")
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("robot-tops")).to_have_text(
        re.compile(r"^\d+(\.\d)? mm$"), timeout=LONG_MS
    )
    expect(height).to_have_value(f"{SPEC.height_mm:.0f}")  # it stays in sight
    page.screenshot(path=tmp_path / "given.png")
    operator.next("verify")
    # From straight above no point can contradict the height that was entered.
    for check, state in (
        ("lines", "ok"),
        ("accuracy", "ok"),
        ("model", "ok"),
        ("height", "unknown"),
    ):
        expect(page.get_by_test_id(f"check-{check}")).to_have_attribute(
            "data-state", state, timeout=LONG_MS
        )
