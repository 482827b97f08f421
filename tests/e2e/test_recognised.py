"""An image is opened and recognised: the field, the area and the rotation are its own; nothing is chosen beforehand."""

import re
from itertools import count

import cv2
import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS, Operator
from tests.support.auto_scenes import SceneSpec, scene_of
from tests.support.held_requests import holding
from tests.support.manual_pictures import manual_picture
from tests.support.tiers import long
from tests.support.waiting import until
from tests.support.words import t

WHOLE = SceneSpec(
    3, "ssl-div-b", "full", "mild", (816, 682), 5500.0, 12.0, 0.0, 3.0, 0.7, 2.0, 0.1, 4, 0
)
HALF = SceneSpec(
    3, "ssl-2008", "half", "half", (816, 682), 5500.0, 12.0, 0.0, -17.0, 0.7, 2.0, 0.1, 6, 0
)
NUMBERS = count()
PHONE = pytest.mark.browser_context_args(viewport={"width": 390, "height": 844}, has_touch=True)


def drawn(spec):
    return lambda _: cv2.imencode(".png", scene_of(spec).pixels)[1].tobytes()


def of_2008(real_data) -> bytes:
    return real_data("fields/ssl_2008/ssl-field-2008.jpg").read_bytes()


@pytest.fixture
def hall(server, real_data):
    """A new camera of which nobody has said what it covers, and which shows the given picture."""
    added = []

    def showing(picture_of) -> str:
        (server.data / "shown").mkdir(exist_ok=True)
        (server.data / "shown" / "hall.png").write_bytes(picture_of(real_data))
        added.append(f"hall-{next(NUMBERS)}")
        server.api(
            "POST",
            "/cameras",
            json={"id": added[0], "name": "Hall", "source": "picture://hall.png"},
        )
        return added[0]

    yield showing
    server.api("DELETE", f"/cameras/{added[0]}")


def opened(operator, camera: str):
    """The camera's picture, taken at its place; nothing is said of it yet."""
    operator.page.get_by_test_id(f"camera-{camera}").click()
    operator.is_at("field")
    operator.wait_for_picture()
    return operator.page


def active(server, camera: str) -> dict:
    active = server.api("GET", f"/cameras/{camera}").json()["active_calibration"]
    return server.api("GET", f"/calibrations/{active}").json()


@pytest.mark.usefixtures("server")
@pytest.mark.parametrize(
    "press",
    [
        pytest.param(lambda button: button.tap(), marks=PHONE, id="finger"),
        pytest.param(lambda button: button.click(), id="mouse"),
    ],
)
@pytest.mark.parametrize(
    ("picture_of", "level"),
    [
        pytest.param(drawn(HALF), "good", id="drawn"),
        # its touch lines are painted 35 mm beside those of the rules, and the page warns
        long(of_2008, "poor"),
    ],
)
def test_half_of_a_field_is_active_after_two_presses(
    new_context, server, hall, picture_of, level, press, tmp_path
):
    operator = Operator(new_context().new_page(), server)
    camera = hall(picture_of)
    page = opened(operator.visit(detect=True), camera)
    go = page.get_by_test_id("next")
    expect(go).to_have_attribute("aria-disabled", "true")
    assert page.get_by_test_id("field").input_value() == "" and operator.draft()["field"] is None
    choice = page.get_by_test_id("choice-ssl-2008-half-right")
    expect(choice).to_be_visible(timeout=LONG_MS)
    expect(page.get_by_test_id("field-choices").get_by_role("button")).to_have_count(2)
    expect(go).to_have_text(t("shell.next.choose-field"))
    expect(go).to_have_attribute("aria-disabled", "true")
    assert operator.draft()["observations"] == []
    page.screenshot(path=tmp_path / "1-choices.png")
    press(choice)
    operator.is_at("verify")
    key = "common.activate-version" if level == "good" else "verify.activate-version-anyway"
    expect(go).to_have_text(t(key, version="1"), timeout=LONG_MS)
    page.screenshot(path=tmp_path / "2-verify.png")
    press(go)
    if level != "good":
        press(page.get_by_test_id("activate-anyway"))
    operator.is_active()
    made = active(server, camera)
    assert (made["field"], made["region"]) == ("ssl-2008", "half-right")
    assert made["report"]["verdict"]["level"] == level


def test_a_recognised_field_is_drawn_with_its_expected_error_and_used_by_one_press(
    arriving, server, hall
):
    camera = hall(drawn(WHOLE))
    page = opened(arriving.visit(detect=True), camera)
    go, told = page.get_by_test_id("next"), page.get_by_test_id("sentence")
    expect(go).to_have_text(t("shell.next.use-it"), timeout=LONG_MS)
    expect(go).to_have_attribute("aria-disabled", "false", timeout=LONG_MS)
    expect(told).to_have_text(
        re.compile(r"Division B, .*full field, rotated by 0°\. Expected error: \d\.\d mm\.")
    )
    expect(page.get_by_test_id("field-lines").locator("path").first).to_be_attached()
    draft = arriving.draft()
    assert (draft["field"], draft["region"], len(draft["observations"]) > 6) == (
        "ssl-div-b",
        "full",
        True,
    )
    manual_picture(page, "field-recognised")
    before = arriving.snapshot
    go.click()
    arriving.is_at("verify")
    arriving.activate(warned=False)
    # What its version covers, the camera's next image is opened with.
    page.goto(f"{server.url}/#/cameras/{camera}/live")
    page.get_by_test_id("next").click()
    expect(page).not_to_have_url(re.compile(before), timeout=LONG_MS)
    arriving.is_at("points")
    assert arriving.snapshot != before and arriving.draft()["field"] == "ssl-div-b"


def test_what_is_recognised_is_one_undo_away_and_not_looked_for_again(arriving, hall):
    page = opened(arriving.visit(detect=True), hall(drawn(WHOLE)))
    expect(page.get_by_test_id("next")).to_have_text(t("shell.next.use-it"), timeout=LONG_MS)
    page.keyboard.press("Control+z")
    draft = arriving.draft()
    assert (draft["field"], draft["region"], draft["observations"]) == (None, None, [])
    expect(page.get_by_test_id("next")).to_have_text(t("shell.next.choose-field"))
    expect(page.get_by_test_id("finding-lines")).to_have_count(0)


@pytest.mark.parametrize("does", ["choose", "click"])
def test_who_chooses_the_field_or_clicks_meanwhile_ends_the_search(arriving, server, hall, does):
    page = arriving.visit(detect=True).page
    asked = []
    page.on(
        "request",
        lambda request: (
            asked.append(request) if request.url.endswith("/calibrations/auto") else None
        ),
    )
    with holding(page, "**/calibrations/auto", "POST"):
        opened(arriving, hall(drawn(WHOLE)))
        expect(page.get_by_test_id("finding-lines")).to_be_visible(timeout=LONG_MS)
        if does == "choose":
            page.get_by_test_id("field").select_option("table")
        else:
            page.get_by_test_id("step-points").click()
            arriving.click("left", [(100.0, 300.0)])
        chosen = arriving.draft()
    expect(page.get_by_test_id("finding-lines")).to_have_count(0)
    jobs = until(
        lambda: [
            job for job in server.api("GET", "/jobs").json()["items"] if job["kind"] == "auto"
        ][:1],
        lambda found: found and found[0]["state"] not in ("queued", "running"),
    )
    assert jobs[0]["state"] == "cancelled" and len(asked) == 1
    assert arriving.draft() == chosen
    assert (chosen["field"], len(chosen["observations"])) == (
        ("table", 0) if does == "choose" else (None, 1)
    )


def test_nothing_is_looked_for_where_that_is_switched_off(arriving, hall):
    page = opened(arriving.visit(), hall(drawn(WHOLE)))
    expect(page.get_by_test_id("do-auto-detect")).to_have_attribute("aria-pressed", "false")
    expect(page.get_by_test_id("next")).to_have_text(t("shell.next.choose-field"))
    expect(page.get_by_test_id("finding-lines")).to_have_count(0)
    page.get_by_test_id("do-find-lines").click()  # asked for, it is
    expect(page.get_by_test_id("next")).to_have_text(t("shell.next.use-it"), timeout=LONG_MS)
