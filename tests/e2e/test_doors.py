"""Every way in: a hostile file, a finger, the keyboard alone; and the help beside it."""

import base64

import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS, Operator
from tests.support.tiers import long
from tests.support.waiting import until
from tests.support.words import t

BORDERS = ("left", "right", "top", "bottom")
PASTE = """async ([data, type]) => {
  const bytes = Uint8Array.from(atob(data), (c) => c.charCodeAt(0)), files = new DataTransfer();
  files.items.add(new File([bytes], "pasted.png", { type }));
  dispatchEvent(new ClipboardEvent("paste", { clipboardData: files }));
}"""
DROP = """async ([data, type]) => {
  const bytes = Uint8Array.from(atob(data), (c) => c.charCodeAt(0)), files = new DataTransfer();
  files.items.add(new File([bytes], "dropped.png", { type }));
  dispatchEvent(new DragEvent("drop", { dataTransfer: files, bubbles: true, cancelable: true }));
}"""


NO_PICTURES = [
    b"",
    b"GIF89a not a picture",
    b"\x89PNG\r\n\x1a\n" + b"\x00" * 40,
    b"<svg onload='alert(1)'/>",
]


@pytest.mark.parametrize(
    "content", [NO_PICTURES[0], *(long(content) for content in NO_PICTURES[1:])]
)
def test_a_file_that_is_no_picture_is_refused_with_its_fix(operator, content):
    file = {"name": "holiday.png", "mimeType": "image/png", "buffer": content}
    operator.page.get_by_test_id("file").set_input_files(file)
    notice = operator.page.get_by_test_id("notice")
    expect(notice).to_be_visible()
    assert len(notice.inner_text().split(".")) > 2, "what is wrong, and what to do"
    expect(operator.page.get_by_test_id("drop")).to_be_enabled()
    notice.get_by_role("button", name=t("shell.notices.dismiss.label")).click()
    expect(notice).to_have_count(0)


def test_a_picture_can_be_pasted_and_dropped(operator, straight_picture):
    page, given = (
        operator.page,
        [base64.b64encode(straight_picture.read_bytes()).decode(), "image/png"],
    )
    for way in (PASTE, DROP):
        page.evaluate(way, given)
        expect(page.get_by_test_id("step-field")).to_have_attribute("aria-current", "step")
        expect(page.get_by_test_id("picture")).to_be_visible()
        page.goto(f"{operator.server.url}/#/cameras")
        expect(page.get_by_test_id("picture")).to_have_count(0)


def test_a_finger_places_a_point_under_a_loupe_and_two_fingers_zoom(
    browser, server, straight_picture
):
    context = browser.new_context(viewport={"width": 1024, "height": 768}, has_touch=True)
    page = context.new_page()
    operator = Operator(page, server).visit().open(straight_picture, "table", "full")
    fingers = context.new_cdp_session(page)

    def touch(kind, *spots):
        fingers.send(
            "Input.dispatchTouchEvent",
            {
                "type": kind,
                "touchPoints": [{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(spots)],
            },
        )

    touch("touchStart", operator.spot(90, 220))
    expect(page.get_by_test_id("loupe")).to_be_visible()
    loupe, spot = page.get_by_test_id("loupe").bounding_box(), operator.spot(90, 220)
    assert loupe["y"] + loupe["height"] < spot[1], "the loupe stands clear of the finger"
    assert abs(loupe["x"] + loupe["width"] / 2 - spot[0]) < 100, "and near it"
    for x in (88, 85, 80):
        touch("touchMove", operator.spot(x, 220))
    touch("touchEnd")
    # Nobody waits until the page has felt a touch.
    until(
        lambda: operator.points("left"),
        lambda points: points == [[pytest.approx(80, abs=0.6), pytest.approx(220, abs=0.6)]],
    )

    def width():
        return page.get_by_test_id("picture").bounding_box()["width"]

    before = width()
    touch("touchStart", (400, 400))
    touch("touchStart", (400, 400), (500, 400))
    for step in range(10, 60, 10):
        touch("touchMove", (400 - step, 400), (500 + step, 400))
    touch("touchEnd")
    until(width, lambda now: now == pytest.approx(2 * before, rel=0.05))
    one = t("common.points", count=1)
    # the first of two fingers places nothing
    expect(page.get_by_test_id("border-left")).to_contain_text(one)
    assert len(operator.points("left")) == 1
    context.close()


def test_the_keyboard_alone_goes_from_the_camera_to_a_saved_version(operator):
    page = operator.page
    page.get_by_test_id("camera-overhead").focus()
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
        for pressed in ("Escape", "0", key, *[towards] * 5, *["a", "Escape", along] * 5):
            page.keyboard.press(pressed)
    expect(page.get_by_test_id("next")).to_have_text(t("shell.next.continue"))
    expect(page.get_by_test_id("next")).to_have_attribute("aria-disabled", "false", timeout=LONG_MS)
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("step-verify")).to_have_attribute(
        "aria-current", "step", timeout=LONG_MS
    )
    page.get_by_test_id("wipe").focus()
    page.keyboard.press("ArrowRight")
    expect(page.get_by_test_id("wipe")).to_have_attribute("aria-valuenow", "52")


def test_a_button_whose_work_was_refused_keeps_the_focus_and_the_next_key_is_its_own(operator):
    """It cannot be used meanwhile. Without the focus, Enter would take a picture with the first camera."""
    page, asked = operator.page, []

    def refuse(route):
        asked.append(route.request.post_data_json["camera"])
        route.fulfill(
            status=503,
            content_type="application/problem+json",
            json={
                "type": "/problems/camera-silent",
                "title": "Unavailable",
                "status": 503,
                "detail": "This camera has not delivered a frame yet.",
                "fix": "Try again in a moment.",
            },
        )

    page.route("**/api/v1/snapshots", refuse)
    button = page.get_by_test_id("camera-east")
    button.focus()
    for count in (1, 2):
        page.keyboard.press("Enter")
        until(
            lambda count=count: page.evaluate("() => 0") or len(asked),
            lambda seen, count=count: seen == count,
        )
        expect(button).to_be_enabled()
        expect(button).to_be_focused()
    assert asked == ["east", "east"]


def test_help_lists_the_keys_switches_those_of_one_letter_off_and_opens_the_manual(operator):
    page = operator.page
    page.keyboard.press("?")
    expect(page.get_by_test_id("keys")).to_contain_text(t("common.undo"))
    expect(page.get_by_test_id("keys")).to_contain_text("Ctrl Z")
    page.get_by_test_id("letters").uncheck()
    page.keyboard.press("Escape")
    page.reload()
    expect(page.get_by_test_id("camera-overhead")).to_be_visible()
    page.keyboard.press("?")
    page.keyboard.press("i")
    page.keyboard.press("F1")  # heard after those
    expect(page.get_by_test_id("manual")).to_be_visible()
    assert page.url.endswith("#/cameras")
    page.get_by_role("tab", name=t("help.tab.keys")).click()
    page.get_by_test_id("letters").check()
    page.get_by_role("tab", name=t("help.tab.manual")).click()
    page.get_by_test_id("manual").get_by_role("link", name="Marking points").click()
    expect(page.get_by_test_id("manual")).to_contain_text("middle of the painted line")
    page.keyboard.press("Escape")
    expect(page.get_by_test_id("help-panel")).to_have_count(0)
    page.get_by_test_id("stage").focus()
    page.keyboard.press("i")
    expect(page.get_by_test_id("jobs-page")).to_be_visible()


def test_the_page_asks_nobody_but_its_own_server(page, server):
    own, elsewhere = (server.url, "data:", "blob:"), []
    page.on(
        "request",
        lambda request: None if request.url.startswith(own) else elsewhere.append(request.url),
    )
    page.goto(server.url)
    expect(page.get_by_test_id("camera-overhead")).to_be_visible()
    page.goto(server.url + "/docs")
    expect(page.locator(".swagger-ui .info")).to_be_visible()
    assert elsewhere == []


@pytest.mark.parametrize(
    "size", [pytest.param((1280, 800), id="laptop"), pytest.param((1024, 768), id="tablet")]
)
@pytest.mark.parametrize("scheme", ["dark", "light"])
@pytest.mark.long
def test_nothing_is_cut_off(
    browser, server, straight_picture, frame_points, tmp_path, size, scheme
):
    context = browser.new_context(
        viewport={"width": size[0], "height": size[1]}, color_scheme=scheme
    )
    operator = Operator(context.new_page(), server).visit().open(straight_picture, "table", "full")
    for border in BORDERS:
        operator.click(border, frame_points[border])
    operator.open_lens()
    operator.page.screenshot(path=tmp_path / "model.png")
    for shown in ("next", "saved", "help", "step-verify", "do-lines", "verdict"):
        box = operator.page.get_by_test_id(shown).bounding_box()
        assert box["x"] >= 0 and box["x"] + box["width"] <= size[0] + 0.5, shown
    wide = operator.page.evaluate("document.documentElement.scrollWidth")
    assert wide <= size[0]
    overflowing = operator.page.evaluate(
        "[...document.querySelectorAll('aside, .verdict, footer')]"
        ".filter(e => e.scrollWidth > e.clientWidth + 1)"
        ".map(e => e.className || e.tagName)"
    )
    assert overflowing == []
    context.close()
