"""The whole way to an active calibration: by mouse on a real picture, by keyboard alone, by finger on a telephone."""

import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS, SOON_MS, Operator
from tests.support.tiers import long
from tests.support.words import like, t
from touchline.core.field import BORDERS

REAL = "fields/ssl_2008/ssl-field-2008.jpg"


@pytest.fixture(autouse=True)
def patience():
    """What a person waits for: a loaded machine may need a while."""
    expect.set_options(timeout=LONG_MS)
    yield
    expect.set_options(timeout=SOON_MS)


@pytest.mark.long
def test_by_mouse_on_a_real_picture_until_the_version_is_active(
    operator, server, clicks, real_data, tmp_path
):
    picture, given, page = real_data(REAL), clicks("ssl_2008_half"), operator.page
    shown = server.data / "shown"
    shown.mkdir(exist_ok=True)
    (shown / "hall.jpg").write_bytes(picture.read_bytes())
    server.api(
        "POST",
        "/cameras",
        json={
            "id": "hall",
            "name": "Hall",
            "source": "picture://hall.jpg",
            "field": given["field"],
            "region": given["region"],
        },
    )
    page.reload()
    operator.take("hall").click_all(given["observations"])
    assert operator.draft()["observations"] == [{**o, "z_mm": 0} for o in given["observations"]]
    page.screenshot(path=tmp_path / "1-borders.png")
    expect(page.get_by_test_id("next")).to_have_attribute("aria-disabled", "false")
    operator.next("verify")
    expect(page.get_by_test_id("corrected")).to_be_visible(timeout=LONG_MS)
    page.screenshot(path=tmp_path / "2-compare.png")
    kept = operator.next("verify").saved()
    operator.activate(warned=True)
    page.screenshot(path=tmp_path / "3-active.png")
    assert server.api("GET", "/cameras/hall").json()["active_calibration"] == kept["id"]
    page.goto(f"{server.url}/#/cameras/hall/live")
    page.reload()
    expect(page.get_by_test_id("look-corrected")).to_be_enabled(timeout=LONG_MS)
    page.get_by_test_id("look-corrected").click()
    expect(page.get_by_test_id("look-corrected")).to_have_attribute("aria-pressed", "true")
    page.wait_for_timeout(1500)  # for a frame to look at
    page.screenshot(path=tmp_path / "4-live.png")
    server.api("DELETE", "/cameras/hall")


@pytest.mark.long
def test_by_keyboard_alone_from_the_camera_to_an_active_version_and_back_to_the_one_before(
    operator, server, tmp_path
):
    page, made = operator.page, []
    for turn in (1, 2):
        page.keyboard.press("Escape")
        page.get_by_test_id("camera-east").focus()
        page.keyboard.press("Enter")
        operator.is_at("points")
        operator.wait_for_picture()
        page.get_by_test_id("stage").focus()
        # A point lands in the middle of the stage: pan to a border, then along it.
        for key, towards, along in (
            ("1", "ArrowLeft", "ArrowDown"),
            ("2", "ArrowRight", "ArrowDown"),
            ("3", "ArrowUp", "ArrowRight"),
            ("4", "ArrowDown", "ArrowRight"),
        ):
            for pressed in (
                "Escape",
                "0",
                key,
                *[towards] * 5,
                *["a", "Escape", along] * (4 + turn),
            ):
                page.keyboard.press(pressed)
        expect(page.get_by_test_id("next")).to_have_text(t("shell.next.continue"))
        expect(page.get_by_test_id("next")).to_have_attribute("aria-disabled", "false")
        page.keyboard.press("Enter")
        expect(page.get_by_test_id("step-verify")).to_have_attribute("aria-current", "step")
        expect(page.get_by_test_id("next")).to_contain_text(like("verify.activate-version-anyway"))
        made.append(operator.saved()["version"])
        expect(page.get_by_test_id("next")).to_have_text(
            t("verify.activate-version-anyway", version=made[-1])
        )
        page.get_by_test_id("stage").focus()
        page.keyboard.press("Enter")  # of the page, not of the button
        expect(page.get_by_test_id("activation-warning")).to_have_count(0)
        page.get_by_test_id("next").focus()
        page.keyboard.press("Enter")
        expect(page.get_by_test_id("activate-cancel")).to_be_focused()
        page.keyboard.press("Tab")
        page.keyboard.press("Enter")
        expect(page.get_by_test_id("notice").last).to_contain_text(
            like("versions.activated", version=made[-1])
        )
        operator.is_active()
        page.screenshot(path=tmp_path / f"active-{turn}.png")
        expect(page.get_by_test_id("camera-east")).to_be_visible()
    page.get_by_test_id("look-at-east").focus()
    page.keyboard.press("Enter")
    page.get_by_test_id("tab-versions").focus()
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("tab-versions")).to_have_attribute("aria-current", "page")
    expect(page.get_by_test_id("do-roll-back")).to_have_text(  # of no other camera
        t("versions.roll-back.go-back", version=made[0])
    )
    page.get_by_test_id("do-roll-back").focus()
    page.keyboard.press("Enter")
    before = page.locator(f"[data-testid=shelf-version][data-version='{made[0]}']")
    expect(before).to_have_attribute("data-active", "true")
    assert made[0] < made[1]
    page.screenshot(path=tmp_path / "rolled-back.png")


@pytest.mark.parametrize(
    "size", [pytest.param((390, 844), id="telephone"), long((820, 1180), id="tablet")]
)
def test_by_finger_on_a_small_screen(
    browser, server, straight_picture, frame_points, tmp_path, size
):
    context = browser.new_context(
        viewport={"width": size[0], "height": size[1]}, has_touch=True, color_scheme="dark"
    )
    page = context.new_page()
    operator = Operator(page, server).visit()
    page.get_by_test_id("file").set_input_files(straight_picture)
    page.get_by_test_id("field").select_option("table")
    page.get_by_test_id("region").select_option("full")
    page.get_by_test_id("next").tap()
    expect(page.get_by_test_id("step-points")).to_have_attribute("aria-current", "step")
    operator.wait_for_picture()
    # a finger near a corner takes hold of its point
    taps = {border: frame_points[border][:5] for border in BORDERS}
    for border in BORDERS:
        page.get_by_test_id(f"border-{border}").tap()
        for x, y in taps[border]:
            page.get_by_test_id("stage").scroll_into_view_if_needed()
            page.touchscreen.tap(*operator.spot(x, y))
        expect(page.get_by_test_id(f"border-{border}")).to_contain_text(t("common.points", count=5))
    page.screenshot(path=tmp_path / "borders.png")
    for border in BORDERS:
        assert operator.points(border) == [pytest.approx(point, abs=1.0) for point in taps[border]]
    expect(page.get_by_test_id("next")).to_have_attribute("aria-disabled", "false")
    page.get_by_test_id("next").tap()
    operator.is_at("verify")
    expect(page.get_by_test_id("corrected")).to_be_visible()
    operator.wait_for_picture()
    page.screenshot(path=tmp_path / "verify.png")
    assert operator.saved()["report"]["verdict"]["mm"] is not None
    wide = page.evaluate(
        "[...document.querySelectorAll('body, aside')].filter(e => e.scrollWidth > innerWidth + 1)"
        ".map(e => e.tagName)"
    )
    assert wide == []
    for name, address in (
        ("settings", "system/server"),
        ("jobs", "system/jobs"),
        ("versions", "library/versions"),
    ):
        page.goto(f"{server.url}/#/{address}")
        expect(page.get_by_test_id(f"{name}-page")).to_be_visible()
        page.screenshot(path=tmp_path / f"{name}.png")
    context.close()
