"""The point editor on painted lines: snapping, the ghost of the field, points along a line, and all of it undone."""

import re

import numpy as np
import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.tiers import long
from tests.support.waiting import until
from tests.support.words import like, t, titled

MIDDLE = 80.0  # x of the drawn frame's left side
SNAPPED = "^" + like("calibrate.snapping.snapped").pattern  # of one point


@pytest.fixture
def snapping(operator, straight_picture):
    """Before a drawn frame, its left border next, clicks drawn to lines."""
    return operator.visit(snap=True).open(straight_picture, "table", "full")


@pytest.fixture
def fitted(arriving, server, straight_picture, frame_points):
    """Before that frame, its four borders clicked, so that there is a fit."""
    kept = server.api("POST", "/snapshots", files={"file": straight_picture.read_bytes()}).json()
    arriving.prefer("snap", "on")
    arriving.go_on(
        kept["id"],
        {
            "field": "table",
            "region": "full",
            "model": "polynomial",
            "observations": [
                {"feature": border, "kind": "line", "points": points}
                for border, points in frame_points.items()
            ],
        },
        "points",
    )
    fit_is_there(arriving.page)
    return arriving


def fit_is_there(page):
    """The whole fit of the clicks as they stand."""
    verdict = page.get_by_test_id("verdict")
    expect(verdict).not_to_have_class(re.compile("stale"), timeout=LONG_MS)
    expect(verdict.locator(".big")).not_to_contain_text("–", timeout=LONG_MS)


def left(operator, *expected, within=0.5, feature="left"):
    """The feature's points, once they are as expected: what is drawn and saved follows a moment later."""

    def is_so(points):
        return len(points) == len(expected) and (
            not points or np.abs(np.array(points) - expected).max() < within
        )

    return until(lambda: operator.points(feature), is_so)


def said(page, text):
    """What became of the last points: the page forgets what it said of those before as soon as it asks."""
    expect(page.get_by_test_id("snap-said")).to_have_text(text)


@pytest.mark.long
def test_a_point_snaps_though_the_next_one_is_pressed_already_when_the_answer_comes(snapping):
    """A quick hand on a slow network."""
    page, held = snapping.page, []

    # about the point that was put, to a hundredth; looks ahead are about where the pointer is
    def is_asked(request):
        return request.url.endswith("/snap") and request.post_data_json["points"] == [[83, 150]]

    page.route(
        "**/snap",
        lambda route: held.append(route) if is_asked(route.request) else route.continue_(),
    )
    with page.expect_request(is_asked):
        page.mouse.click(*snapping.spot(83.004, 150.004))
    page.mouse.move(*snapping.spot(83, 300))
    page.mouse.down()
    with page.expect_response(lambda answer: is_asked(answer.request)) as answer:
        held[0].continue_()
    answer.value.finished()
    # it has been read
    page.evaluate("new Promise((done) => requestAnimationFrame(() => setTimeout(done)))")
    page.mouse.up()
    left(snapping, (MIDDLE, 150), (MIDDLE, 300))


@pytest.mark.long
def test_undo_takes_a_snapped_point_back_to_where_it_was_put(snapping):
    page = snapping.page
    page.mouse.click(*snapping.spot(83, 200))
    said(page, re.compile(SNAPPED))
    page.keyboard.press("Control+z")
    left(snapping, (83, 200))
    page.keyboard.press("Control+z")
    left(snapping)
    page.keyboard.press("Control+y")
    left(snapping, (83, 200))
    page.keyboard.press("Control+y")
    [[x, _]] = left(snapping, (MIDDLE, 200))
    assert abs(x - MIDDLE) < 0.1


@pytest.mark.long
def test_with_alt_a_point_stays_where_it_is_put(snapping):
    page = snapping.page
    page.keyboard.down("Alt")
    page.mouse.click(*snapping.spot(84, 200))
    page.keyboard.up("Alt")
    page.wait_for_timeout(400)
    left(snapping, (84, 200))


@pytest.mark.long
def test_away_from_lines_a_point_stays_and_the_reason_is_said(snapping):
    snapping.page.mouse.click(*snapping.spot(300, 250))
    said(snapping.page, t("calibrate.snapping.not-snapped", why="no line within reach"))
    left(snapping, (300, 250))


@pytest.mark.long
def test_a_drag_shows_the_free_point_and_snaps_when_it_is_let_go(snapping):
    page = snapping.page
    page.mouse.click(*snapping.spot(82, 200))
    said(page, re.compile(SNAPPED))
    page.mouse.move(*snapping.spot(80, 200))
    page.mouse.down()
    page.mouse.move(*snapping.spot(88, 240), steps=5)
    point, stage = (
        page.locator("[data-point='left:0']"),
        page.get_by_test_id("stage").bounding_box()["x"],
    )
    until(
        lambda: (
            stage + float(re.search(r"translate\(([\d.]+)", point.get_attribute("transform"))[1])
        ),
        lambda x: x == pytest.approx(snapping.spot(88, 240)[0], abs=1.5),
    )
    page.mouse.move(*snapping.spot(83, 240))
    page.mouse.up()
    said(page, re.compile(SNAPPED))
    [[x, _]] = left(snapping, (MIDDLE, 240))
    assert abs(x - MIDDLE) < 0.1


@pytest.mark.long
def test_points_that_were_placed_freely_snap_by_a_key_and_come_back_by_undo(snapping):
    page = snapping.page
    page.keyboard.press("s")
    expect(page.get_by_test_id("do-snap")).to_have_attribute("aria-pressed", "false")
    for y in (120, 200, 280):
        page.mouse.click(*snapping.spot(82.5, y))
    placed = left(snapping, (82.5, 120), (82.5, 200), (82.5, 280), within=0.6)
    page.keyboard.press("Control+a")
    page.keyboard.press("q")
    three = like("calibrate.snapping.snapped-several", snapped=3, asked=3).pattern
    said(page, re.compile("^" + three.replace(".*?", r"2\.\d") + "$"))
    snapped = left(snapping, (MIDDLE, 120), (MIDDLE, 200), (MIDDLE, 280), within=0.6)
    assert np.abs(np.array(snapped)[:, 0] - MIDDLE).max() < 0.1
    page.keyboard.press("Control+z")
    left(snapping, *placed, within=0.01)


@pytest.mark.long
def test_the_keyboard_alone_puts_a_point_on_the_line(snapping):
    page = snapping.page
    page.mouse.move(*snapping.spot(82, 150))
    page.keyboard.press("a")
    said(page, re.compile(SNAPPED))
    [[x, _]] = left(snapping, (MIDDLE, 150))
    assert abs(x - MIDDLE) < 0.1


@pytest.mark.long
def test_a_line_that_the_fit_sees_is_chosen_by_clicking_it(fitted, tmp_path):
    page = fitted.page
    page.get_by_test_id("border-left").click()
    ghost = page.locator("[data-ghost='halfway-line']")
    expect(ghost).to_be_attached()
    middle = ghost.evaluate(
        "g => { const p = g.getPointAtLength(g.getTotalLength() * 0.3); return [p.x, p.y]; }"
    )
    page.mouse.move(*fitted.spot(middle[0] + 1, middle[1]))
    expect(page.get_by_test_id("ghost-over")).to_have_text(titled("markings.halfway-line"))
    page.screenshot(path=tmp_path / "ghost.png")
    page.mouse.click(*fitted.spot(middle[0] + 1, middle[1]))
    left(fitted, middle, within=2, feature="halfway-line")
    expect(page.get_by_test_id("inside-halfway-line")).to_have_attribute("aria-pressed", "true")
    fitted.unfold("field")
    expect(page.get_by_test_id("field-halfway-line")).to_have_class(re.compile("clicked"))


def test_a_click_lands_on_the_middle_of_its_line_and_points_along_it_are_proposed_and_added(
    fitted, tmp_path
):
    page = fitted.page
    page.get_by_test_id("border-left").click()
    page.keyboard.press("Control+a")
    page.keyboard.press("Delete")
    with page.expect_response(re.compile("/snap$")):  # the look ahead
        page.mouse.move(*fitted.spot(83, 200))
    expect(page.get_by_test_id("loupe")).to_be_visible()
    page.screenshot(path=tmp_path / "ahead.png")
    page.mouse.click(*fitted.spot(83, 200))
    said(page, re.compile(SNAPPED.replace(".*?", r"[23]\.\d") + "$"))
    page.screenshot(path=tmp_path / "snapped.png")
    [[x, _]] = left(fitted, (MIDDLE, 200))
    assert x == pytest.approx(MIDDLE, abs=0.1)
    for _ in range(3):  # the way to the line, the click, and what was deleted
        page.keyboard.press("Control+z")
    expect(page.locator("[data-point^='left:']")).to_have_count(6)
    page.get_by_test_id("border-top").click()
    page.keyboard.press("Control+a")
    page.keyboard.press("Delete")
    for x in (100, 330, 550):
        page.mouse.click(*fitted.spot(x, 61))
        said(page, re.compile(SNAPPED))
    fit_is_there(page)
    expect(page.get_by_test_id("do-propose")).to_be_enabled()
    page.keyboard.press("f")
    expect(page.locator("[data-proposed]").first).to_be_visible()
    page.screenshot(path=tmp_path / "proposed.png")
    expect(page.locator("[data-point^='top:']")).to_have_count(3)
    count = page.locator("[data-proposed]").count()
    assert count >= 5
    page.keyboard.press("f")
    said(page, t("calibrate.line-suggestions.added", count=count))
    expect(page.locator("[data-point^='top:']")).to_have_count(3 + count)
    added = fitted.points("top")
    assert len(added) == 3 + count
    assert np.abs(np.array(added)[:, 1] - 60).max() < 0.15
    page.keyboard.press("Control+z")
    expect(page.locator("[data-point^='top:']")).to_have_count(3)


@pytest.mark.long
def test_proposals_are_discarded_by_escape(fitted):
    page = fitted.page
    page.get_by_test_id("border-left").click()
    expect(page.get_by_test_id("do-propose")).to_be_enabled()
    page.keyboard.press("f")
    expect(page.get_by_test_id("proposal")).to_be_visible()
    before = fitted.points("left")
    page.keyboard.press("Escape")
    expect(page.get_by_test_id("proposal")).to_have_count(0)
    assert fitted.points("left") == before


@pytest.mark.parametrize(
    "model", ["brown-conrady", *(long(model) for model in ("polynomial", "division"))]
)
def test_the_fit_follows_a_point_while_it_is_dragged(clicked, model):
    operator = clicked(model)
    page = operator.page
    verdict = page.get_by_test_id("rms-px")
    fit_is_there(page)
    expect(verdict).to_have_text(re.compile(r"\d px"))
    x, y = operator.spot(
        *next(o["points"][4] for o in operator.draft()["observations"] if o["feature"] == "left")
    )
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 4, y, steps=2)
    for step in range(5, 8):  # the figures of a stray stay: that it is fitted at all is what counts
        with page.expect_response(re.compile(r"/fit/attempt\?.*quick=")) as answer:
            page.mouse.move(x + step, y)
        assert answer.value.status == 200, answer.value.text()
    expect(verdict).to_have_text(re.compile(r"\d px"))
    with page.expect_response(re.compile(r"/fit/attempt\?series=\d+$")) as answer:
        page.mouse.up()
    assert answer.value.status == 200


@pytest.mark.long
def test_the_little_field_says_what_has_been_done(fitted):
    page = fitted.unfold("field").page
    used = t("calibrate.field-drawing.points", count=6) + t("calibrate.field-drawing.used")
    expect(page.get_by_test_id("field-left")).to_have_attribute(
        "aria-label", re.compile(re.escape(used))
    )
    expect(page.get_by_test_id("field-halfway-line")).to_have_attribute(
        "aria-label", t("calibrate.click", feature=t("markings.halfway-line"))
    )
    page.get_by_test_id("field-centre").click(force=True)
    expect(page.get_by_test_id("inside-centre")).to_have_attribute("aria-pressed", "true")
