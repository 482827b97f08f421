"""Raw against corrected on a still: side by side under one view, blinking, under a grid of field millimetres."""

import re

import numpy as np
import pytest
from playwright.sync_api import expect

from tests.support.waiting import until
from tests.support.words import like, t

KNOWN_HEIGHT = {"value": 3000.0, "sigma": 30.0}


@pytest.fixture
def compared(saved):
    """The compare step of a saved version, its pictures in sight."""
    operator = saved("brown-conrady", height_mm=KNOWN_HEIGHT)
    for picture in ("picture", "corrected"):  # one that is not there yet has the size of its words
        expect(operator.page.get_by_test_id(picture)).not_to_have_js_property("naturalWidth", 0)
        operator.page.get_by_test_id(picture).evaluate("picture => picture.decode()")
    expect(operator.page.get_by_test_id("wipe")).to_be_visible()
    return operator


def boxes(page):
    return [page.get_by_test_id(name).bounding_box() for name in ("picture", "corrected")]


def middle(box):
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


@pytest.mark.long
def test_side_by_side_both_pictures_go_together_when_zoomed_and_panned(compared, tmp_path):
    page = compared.page
    page.keyboard.press("s")
    expect(page.get_by_test_id("side-names")).to_be_visible()
    stage = page.get_by_test_id("stage").bounding_box()
    half = stage["width"] / 2
    raw, corrected = boxes(page)
    assert raw["x"] + raw["width"] <= stage["x"] + half  # each in its own half
    assert corrected["x"] >= stage["x"] + half
    page.screenshot(path=tmp_path / "side.png")

    apart = [b - a for a, b in zip(middle(raw), middle(corrected), strict=True)]
    # Over the corrected one; a wheel's event knows whole pixels only.
    spot = round(stage["x"] + half + 0.3 * half), round(stage["y"] + 0.4 * stage["height"])
    share = (
        (spot[0] - corrected["x"]) / corrected["width"],
        (spot[1] - corrected["y"]) / corrected["height"],
    )
    page.mouse.move(*spot)
    page.mouse.wheel(0, -600)
    zoomed_raw, zoomed = until(
        lambda: boxes(page), lambda now: now[1]["width"] > 1.5 * corrected["width"]
    )
    assert zoomed_raw["width"] / raw["width"] == pytest.approx(
        zoomed["width"] / corrected["width"], rel=1e-3
    )
    there = zoomed["x"] + share[0] * zoomed["width"], zoomed["y"] + share[1] * zoomed["height"]
    assert there == pytest.approx(spot, abs=0.5)  # what was under the pointer still is

    page.mouse.down()
    page.mouse.move(spot[0] + 60, spot[1] + 25, steps=4)
    page.mouse.up()

    def moved():
        return [
            (after["x"] - before["x"], after["y"] - before["y"])
            for before, after in zip((zoomed_raw, zoomed), boxes(page), strict=True)
        ]

    until(moved, lambda ways: all(way == pytest.approx((60, 25), abs=0.5) for way in ways))
    page.keyboard.press("0")

    def apart_now():
        return [b - a for a, b in zip(*map(middle, boxes(page)), strict=True)]

    until(apart_now, lambda now: now == pytest.approx(apart, abs=0.5))


def test_a_place_is_found_again_in_the_other_picture_by_pointer_by_key_by_grid_and_at_the_worst_one(
    compared, server, tmp_path
):
    marked_side_by_side(compared, server)
    held_key_or_button(compared.page)
    compared.page.keyboard.press("w")
    under_a_grid(compared, server, tmp_path)
    at_the_worst_place(compared, tmp_path)


def marked_side_by_side(compared, server):
    """The pointer's place is marked in the other picture."""
    page = compared.page
    page.keyboard.press("s")
    expect(page.get_by_test_id("side-names")).to_be_visible()
    saved = compared.saved()
    place = saved["report"]["sigma_mm"]["worst_place"]
    seen = {
        to: server.api(
            "POST",
            f"/calibrations/{saved['id']}/transform",
            json={"from": "field", "to": to, "points": [place]},
        ).json()["points"][0]
        for to in ("image", "corrected")
    }
    corrected = boxes(page)[1]
    width, height = saved["corrected_size"]
    on_raw = compared.spot(*seen["image"])
    on_corrected = (
        corrected["x"] + (seen["corrected"][0] + 40.5) / (width + 80) * corrected["width"],
        corrected["y"] + (seen["corrected"][1] + 40.5) / (height + 80) * corrected["height"],
    )
    for pointed, marked, name in (
        (on_raw, on_corrected, "corrected"),
        (on_corrected, on_raw, "image"),
    ):
        page.mouse.move(*pointed)
        mark = page.get_by_test_id(f"counterpart-{name}")
        expect(page.get_by_test_id("read-out")).to_contain_text(t("canvas.stage.field"))
        expect(mark).to_be_visible()
        # On its way the pointer was elsewhere, and that is answered first.
        wanted = pytest.approx(marked, abs=1.5)
        until(mark.bounding_box, lambda box, wanted=wanted: box and middle(box) == wanted)


@pytest.mark.long
def test_a_stage_that_is_higher_than_wide_has_the_two_one_above_the_other(compared, tmp_path):
    page = compared.page
    page.set_viewport_size({"width": 1000, "height": 1250})
    page.keyboard.press("s")
    expect(page.get_by_test_id("side-names")).to_have_class(re.compile("stacked"))
    raw, corrected = until(
        lambda: boxes(page), lambda now: now[1]["y"] > now[0]["y"] + 0.8 * now[0]["height"]
    )
    assert corrected["x"] < raw["x"] + raw["width"]
    page.screenshot(path=tmp_path / "stacked.png")


def showing(page):
    return page.get_by_test_id("blink-legend").get_attribute("data-showing")


def changes(page, for_ms):
    """How often another picture was shown, and in how many seconds: at least for_ms, on a busy machine more."""
    return page.get_by_test_id("blink-legend").evaluate(
        """(e, ms) => new Promise((done) => {
      let count = 0;
      const watch = new MutationObserver(() => count++), begun = performance.now();
      watch.observe(e, { attributeFilter: ["data-showing"] });
      setTimeout(() => { watch.disconnect(); done([count, (performance.now() - begun) / 1000]); }, ms);
    })""",
        for_ms,
    )


@pytest.mark.long
def test_blinking_swaps_by_itself_at_two_a_second_at_most_and_pauses(compared, tmp_path):
    page = compared.page
    page.keyboard.press("k")
    expect(page.get_by_test_id("blink-legend")).to_be_visible()
    page.get_by_test_id("blink-2").click()
    first = showing(page)
    expect(page.get_by_test_id("blink-legend")).not_to_have_attribute("data-showing", first)
    count, seconds = changes(page, 2000)
    assert count <= 2 * seconds + 1  # one for the edge
    page.keyboard.press("u")
    expect(page.get_by_test_id("blink-pause")).to_have_attribute("aria-pressed", "true")
    assert changes(page, 1500)[0] == 0
    stopped = showing(page)
    page.keyboard.press("j")
    expect(page.get_by_test_id("blink-legend")).not_to_have_attribute("data-showing", stopped)
    page.screenshot(path=tmp_path / "blink.png")


@pytest.mark.long
def test_who_asks_for_less_motion_swaps_by_hand(compared):
    page = compared.page
    page.emulate_media(reduced_motion="reduce")
    page.keyboard.press("k")
    expect(page.get_by_test_id("calm")).to_be_visible()
    before = showing(page)
    assert changes(page, 2500)[0] == 0
    page.get_by_test_id("blink-swap").click()
    expect(page.get_by_test_id("blink-legend")).not_to_have_attribute("data-showing", before)


def held_key_or_button(page):
    """It shows the other picture until it is let go."""
    page.keyboard.press("r")
    expect(page.get_by_test_id("corrected-half")).to_be_hidden()
    page.keyboard.down("f")
    expect(page.get_by_test_id("corrected-half")).to_be_visible()
    expect(page.get_by_test_id("picture")).to_be_hidden()
    page.keyboard.up("f")
    expect(page.get_by_test_id("picture")).to_be_visible()
    page.keyboard.press("k")
    page.keyboard.press("u")
    before = showing(page)
    page.get_by_test_id("blink-hold").hover()
    page.mouse.down()
    expect(page.get_by_test_id("blink-legend")).not_to_have_attribute("data-showing", before)
    page.mouse.up()
    expect(page.get_by_test_id("blink-legend")).to_have_attribute("data-showing", before)


def drawn(page, picture, line):
    """A grid line's corners on the screen."""
    found = (
        page.get_by_test_id(f"grid-{picture}")
        .locator(f'path[data-line="{line}"]')
        .evaluate("""path => {
      const matrix = path.getScreenCTM();
      return path.getAttribute("d").slice(1).split("L").map((pair) => {
        const [x, y] = pair.split(" ").map(Number), at = new DOMPoint(x, y).matrixTransform(matrix);
        return [at.x, at.y];
      });
    }""")
    )
    return np.array(found)


def bend(points):
    """How far the corners lie from the straight line between the ends, in parts of its length."""
    chord = points[-1] - points[0]
    (dx, dy), off = chord / np.linalg.norm(chord), points - points[0]
    across = np.abs(off[:, 0] * dy - off[:, 1] * dx)
    return across.max() / np.linalg.norm(chord)


def under_a_grid(compared, server, tmp_path):
    """Of field millimetres: it is straight when corrected, and bent in the raw picture."""
    page = compared.page
    page.keyboard.press("g")
    expect(page.get_by_test_id("grid-legend")).to_contain_text(
        t("compare.grid.heading", spacing=500)
    )
    expect(page.get_by_test_id("grid-corrected")).to_be_visible()
    page.keyboard.press("l")
    page.screenshot(path=tmp_path / "grid.png")
    saved = compared.saved()
    region = saved["field_definition"]["regions"][saved["region"]]
    for line in ("x 500", "y 2500"):
        axis, at = line.split()
        raw, corrected = drawn(page, "raw", line), drawn(page, "corrected", line)
        assert bend(corrected) < 1e-3, line
        assert bend(raw) > 5e-3, line
        ends = [
            [float(at), y] if axis == "x" else [y, float(at)]
            for y in region["y" if axis == "x" else "x"]
        ]
        told = server.api(
            "POST",
            f"/calibrations/{saved['id']}/transform",
            json={"from": "field", "to": "image", "points": ends},
        ).json()["points"]
        on_screen = [compared.spot(*pixel) for pixel in told]
        assert np.abs(raw[[0, -1]] - on_screen).max() < 0.5, line

    page.get_by_test_id("grid-spacing").select_option("1000")
    expect(page.get_by_test_id("grid-legend")).to_contain_text(
        t("compare.grid.heading", spacing="1\u202f000")
    )
    expect(page.get_by_test_id("grid-raw").locator('path[data-line="x 500"]')).to_have_count(0)
    page.get_by_test_id("stage").focus()
    page.keyboard.press("g")
    expect(page.get_by_test_id("grid-corrected")).to_have_count(0)


def at_the_worst_place(compared, tmp_path):
    """It says what to do there, and the button goes to do it."""
    page = compared.page
    page.keyboard.press("e")
    cure = page.get_by_test_id("worst-cure")
    expect(cure).to_contain_text(like("calibrate.warning-fixes.one-more-click-hats"))
    page.keyboard.press("c")
    page.get_by_test_id("do-worst-place").click()
    stage = page.get_by_test_id("stage").bounding_box()
    worst = page.get_by_test_id("worst-corrected").locator("circle").first
    until(
        lambda: worst.bounding_box(),
        lambda box: box and middle(box) == pytest.approx(middle(stage), abs=2),
    )
    page.screenshot(path=tmp_path / "worst.png")
    next_click = compared.saved()["report"]["next_click"]
    cure.get_by_test_id("cure-next-click").click()
    expect(page.get_by_test_id("step-points")).to_have_attribute("aria-current", "step")
    compared.wait_for_picture()
    until(
        lambda: compared.spot(*next_click["point"]),
        lambda at: at == pytest.approx(middle(stage), abs=2),
    )


@pytest.mark.long
def test_two_fingers_zoom_both_pictures(compared):
    page = compared.page
    page.keyboard.press("s")
    expect(page.get_by_test_id("side-names")).to_be_visible()
    before = boxes(page)
    client = page.context.new_cdp_session(page)
    stage = page.get_by_test_id("stage").bounding_box()
    x, y = stage["x"] + 0.25 * stage["width"], stage["y"] + 0.5 * stage["height"]

    def touch(kind, *spread):
        client.send(
            "Input.dispatchTouchEvent",
            {
                "type": kind,
                "touchPoints": [
                    {"x": x + s * d, "y": y, "id": i} for d in spread for i, s in enumerate((-1, 1))
                ],
            },
        )

    touch("touchStart", 30)
    for spread in (40, 50, 60):
        touch("touchMove", spread)
    touch("touchEnd")
    wide = pytest.approx(2 * before[0]["width"], rel=0.05)
    after = until(lambda: boxes(page), lambda now: now[0]["width"] == wide)
    assert after[1]["width"] / before[1]["width"] == pytest.approx(
        after[0]["width"] / before[0]["width"], rel=1e-3
    )
