"""Editing points: every change can be undone, moved finely, and is drawn at once."""

import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import WHERE
from tests.support.waiting import until
from tests.support.words import t, titled

# Marks when a move of the pointer was heard, when the curve was redrawn, and when the next frame began.
WATCH = """() => {
  window.marks = { moves: [], drawn: [] };  // moves: [when it was heard, when the next frame began], ms
  addEventListener("pointermove", () => {
    const heard = performance.mark("move").startTime;
    requestAnimationFrame(() => marks.moves.push([heard, performance.mark("frame").startTime]));
  }, { capture: true });
  new MutationObserver(() => marks.drawn.push(performance.mark("drawn").startTime))
    .observe(document.querySelector("[data-testid=curve-left]"), { attributes: true, attributeFilter: ["d"] });
}"""


@pytest.fixture
def editing(arriving, server, straight_picture, frame_points):
    """Six points on the left border, the last of them clicked."""
    kept = server.api("POST", "/snapshots", files={"file": straight_picture.read_bytes()}).json()
    draft = {
        "field": "table",
        "region": "full",
        "model": None,
        "options": {},
        "observations": [{"feature": "left", "kind": "line", "points": frame_points["left"][:5]}],
    }
    arriving.go_on(kept["id"], draft, "points").click("left", frame_points["left"][5:])
    assert arriving.points("left") == frame_points["left"]
    return arriving


def test_points_are_edited_by_keyboard_and_mouse_and_every_change_can_be_undone(
    editing, frame_points
):
    by_keyboard(editing, frame_points["left"])
    by_mouse(editing, frame_points["left"])
    zoomed_and_panned(editing)
    assert editing.points("left") == frame_points["left"]


def by_keyboard(editing, left):
    """Arrows move by a tenth of a pixel, with shift by one; Tab goes from point to point, then leaves the picture."""
    page, (x, y) = editing.page, left[5]
    for key in ("ArrowRight", "ArrowRight", "Shift+ArrowUp"):
        page.keyboard.press(key)
    assert editing.points("left")[5] == [pytest.approx(x + 0.2, abs=1e-9), y - 1]
    for _ in range(3):
        page.keyboard.press("Control+z")
    assert editing.points("left") == left
    page.keyboard.press("Delete")
    assert len(editing.points("left")) == 5
    page.keyboard.press("Control+z")
    page.keyboard.press("Control+z")  # the click
    assert editing.points("left") == left[:5]
    page.keyboard.press("Control+Shift+Z")
    assert editing.points("left") == left
    page.get_by_test_id("stage").focus()
    page.keyboard.press("Escape")
    for index in range(6):
        page.keyboard.press("Tab")
        expect(page.locator(f"[data-point='left:{index}'].picked")).to_be_visible()
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.dataset.testid") != "stage"


def by_mouse(editing, left):
    """A drag is one change; a box selects what lies in it."""
    page = editing.page
    page.mouse.move(*editing.spot(80, 210))
    page.mouse.down()
    for x in range(80, 100, 2):
        page.mouse.move(*editing.spot(x, 212))
    expect(page.get_by_test_id("loupe")).to_be_visible()
    page.mouse.up()
    assert editing.points("left")[2] == [pytest.approx(98, abs=0.02), pytest.approx(212, abs=0.02)]
    page.keyboard.press("Control+z")
    assert editing.points("left") == left
    page.keyboard.down("Shift")
    page.mouse.move(*editing.spot(40, 100))
    page.mouse.down()
    page.mouse.move(*editing.spot(120, 300), steps=4)
    page.mouse.up()
    page.keyboard.up("Shift")
    expect(page.locator(".point.picked")).to_have_count(3)
    page.keyboard.press("Delete")
    assert len(editing.points("left")) == 3
    page.keyboard.press("Control+z")


def zoomed_and_panned(editing):
    """The wheel zooms about the pointer, and space pans."""
    page = editing.page
    left, top, across, down = page.get_by_test_id("picture").evaluate(WHERE)
    before = tuple(map(round, editing.spot(80, 210)))  # a browser tells whole pixels of a wheel
    there = (before[0] - left) / across - 0.5, (before[1] - top) / down - 0.5
    page.mouse.move(*before)
    zoom = page.locator("[data-testid=read-out] .zoom")
    fitted = zoom.inner_text()
    page.mouse.wheel(0, -600)  # nobody waits until the page has heard it
    expect(zoom).not_to_have_text(fitted)
    assert editing.spot(*there) == (
        pytest.approx(before[0], abs=0.5),
        pytest.approx(before[1], abs=0.5),
    )
    page.keyboard.down(" ")
    page.mouse.down()
    page.mouse.move(before[0] + 50, before[1] + 30)
    page.mouse.up()
    page.keyboard.up(" ")
    assert editing.spot(*there) == (
        pytest.approx(before[0] + 50, abs=0.5),
        pytest.approx(before[1] + 30, abs=0.5),
    )


@pytest.mark.long
def test_undo_takes_back_another_field_and_its_region(editing):
    page = editing.page
    before = editing.draft()
    page.get_by_test_id("step-field").click()
    page.get_by_test_id("field").select_option("ssl-div-b")
    page.get_by_test_id("region").select_option("half-right")
    page.get_by_test_id("do-turn").click()
    after = editing.draft()
    assert (after["field"], after["region"], after["rotate"]) == ("ssl-div-b", "half-right", 90)
    assert after["observations"] == before["observations"]
    page.get_by_test_id("stage").focus()
    for _ in range(3):
        page.keyboard.press("Control+z")
    assert {**editing.draft(), "updated_at": None} == {**before, "updated_at": None}


@pytest.mark.long
def test_the_curve_is_redrawn_in_the_frame_of_the_move(operator, straight_picture, frame_points):
    page = operator.page
    # A parabola through three points follows each; among many, one far off would be a stray and bend nothing.
    operator.open(straight_picture, "table", "full").use_model("polynomial").click(
        "left", frame_points["left"][:3]
    )
    page.get_by_test_id("degree").select_option("2")
    found = t("calibrate.borders.degree-found", border=titled("markings.left"), degree=2)
    expect(page.get_by_test_id("degree-reason")).to_contain_text(found)
    page.mouse.move(*operator.spot(80, 140))
    page.mouse.down()
    page.evaluate(WATCH)
    for i in range(12):
        page.mouse.move(*operator.spot(84 + 2 * i, 140))
    moves = until(lambda: page.evaluate("marks.moves"), lambda moves: len(moves) >= 10)
    page.mouse.up()
    drawn = page.evaluate("marks.drawn")
    late = [heard for heard, frame in moves if not any(heard <= d <= frame for d in drawn)]
    assert not late, f"{len(late)} of {len(moves)} moves missed their frame"


@pytest.mark.long
def test_an_answer_about_clicks_that_have_gone_is_not_shown(editing):
    page, held = editing.page, []
    expect(page.get_by_test_id("missing")).to_be_visible()  # one border is no fit
    page.route("**/fit/attempt?*", lambda route: held.append(route))
    with page.expect_request("**/fit/attempt?*"):
        editing.click("left", [[80, 240]])
    page.keyboard.press("Control+a")
    page.keyboard.press("Delete")
    expect(page.get_by_test_id("verdict")).to_contain_text(t("calibrate.verdict.click-borders"))
    with page.expect_response("**/fit/attempt?*") as answer:
        held[0].continue_()
    answer.value.finished()
    # it has been read
    page.evaluate("new Promise((done) => requestAnimationFrame(() => setTimeout(done)))")
    expect(page.get_by_test_id("verdict")).to_contain_text(t("calibrate.verdict.click-borders"))
    expect(page.get_by_test_id("missing")).to_have_count(0)
