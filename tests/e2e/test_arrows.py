"""Residual arrows over the picture: where the server says, as long as wished, strays in the warning's colour."""

import re

import numpy as np
import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS, shift_one
from tests.support.demo_cameras import CAMERAS, WIDTH
from tests.support.waiting import until
from tests.support.words import like, t
from touchline.core.field_json import field_from_json
from touchline.sources import SourceContext, source_from_url

FACTORS = [1, 2, 5, 10, 20, 50, 100, 200]
# How many pixels near a place of the stage are drawn in light, warm and any colour.
DRAWN_NEAR = """(canvas, [x, y, reach]) => {
  const ratio = canvas.width / canvas.clientWidth, side = Math.ceil(2 * reach * ratio);
  const [left, top] = [x, y].map((middle) => Math.round((middle - reach) * ratio));
  const { data } = canvas.getContext("2d").getImageData(left, top, side, side);
  let light = 0, warm = 0, any = 0;
  for (let i = 0; i < data.length; i += 4) {
    const [r, g, b, a] = data.slice(i, i + 4);
    if (a > 40) any++;
    if (a > 200 && Math.min(r, g, b) > 200) light++;
    if (a > 200 && r > 180 && b < 130 && r - b > 90) warm++;
  }
  return { light, warm, any };
}"""


@pytest.fixture
def astray(clicked):
    """Division model on the demo's camera, clicked by a hand, with a stray click; at a step."""
    return lambda: clicked("division", shift_one)


def show(page):
    # the fit is there
    expect(page.get_by_test_id("do-arrows").first).to_be_enabled(timeout=LONG_MS)
    page.keyboard.press("v")
    expect(page.get_by_test_id("arrow-legend")).to_be_visible(timeout=LONG_MS)


def says(page, times):
    """All of it: "×1" is not "×10"."""
    expect(page.get_by_test_id("arrow-legend").locator("h2")).to_have_text(
        t("compare.arrows.heading", factor=times)
    )


def factor(page) -> int:
    heading = like("compare.arrows.heading").pattern.replace(".*?", r"(\d+)")
    return int(re.search(heading, page.get_by_test_id("arrow-legend").inner_text())[1])


def previewed(operator) -> list[dict]:
    draft = operator.draft()
    body = {key: draft[key] for key in ("field", "region", "model", "options", "observations")}
    report = operator.server.api(
        "POST", "/fit/preview", json={**body, "snapshot": operator.snapshot}
    ).json()["report"]
    return [{**r, "feature": f["feature"]} for f in report["per_feature"] for r in f["residuals"]]


def tip(operator, arrow, times, image="picture"):
    """Where an arrow's end must be on the stage, when it is drawn `times` longer."""
    stage = operator.page.get_by_test_id("stage").bounding_box()
    point, foot = np.array(arrow["point"]), np.array(arrow["foot"])
    box = operator.page.get_by_test_id(image).bounding_box()
    width = operator.page.get_by_test_id(image).evaluate("i => i.naturalWidth")
    corner = [box["x"] - stage["x"], box["y"] - stage["y"]]
    x, y = (point + times * (foot - point) + 0.5) * box["width"] / width + corner
    return float(x), float(y)


def drawn(operator, place, image="image", reach=3):
    return operator.page.get_by_test_id(f"arrows-{image}").evaluate(DRAWN_NEAR, [*place, reach])


def is_drawn(operator, arrow, times, holds, image="picture", name="image"):
    """Its end, on the canvas: which is drawn a moment after the legend stands."""
    until(lambda: drawn(operator, tip(operator, arrow, times, image), name), holds)


def test_arrows_end_where_the_server_says_and_the_stray_is_in_the_warnings_colour(astray, tmp_path):
    operator = astray()
    page = operator.page
    show(page)
    page.screenshot(path=tmp_path / "arrows.png")
    arrows = previewed(operator)
    fine = sorted((a for a in arrows if not a["outlier"]), key=lambda a: -a["px"])
    (stray,) = (a for a in arrows if a["outlier"])
    times = factor(page)
    scale = operator.page.get_by_test_id("picture").bounding_box()["width"] / WIDTH
    # long enough to read, and not across the picture
    assert 15 <= times * fine[0]["px"] * scale <= 120
    for arrow in fine[:6]:
        is_drawn(operator, arrow, times, lambda seen: seen["light"] > 3 and seen["warm"] == 0)
    expect(page.get_by_test_id("arrow-figures")).to_contain_text(f"{fine[0]['px']:.2f} px")
    expect(page.get_by_test_id("arrow-figures")).to_contain_text(
        t(
            "compare.arrows.strays",
            count=1,
            strays=t("common.strays", count=1),
            px=f"{stray['px']:.1f}",
        )
    )
    is_drawn(operator, stray, 1, lambda seen: seen["warm"] > 3)

    page.keyboard.press("v")
    expect(page.get_by_test_id("arrows-image")).to_have_count(0)
    expect(page.get_by_test_id("arrow-legend")).to_have_count(0)


@pytest.mark.long
def test_the_magnification_is_set_by_keys_and_slider_and_the_ruler_goes_with_it(astray):
    operator = astray()
    page = operator.page
    show(page)
    by_itself = factor(page)
    expect(page.get_by_test_id("magnify-auto")).to_have_attribute("aria-pressed", "true")
    page.keyboard.press(",")
    smaller = FACTORS[FACTORS.index(by_itself) - 1]
    says(page, smaller)
    page.get_by_test_id("magnification").focus()
    page.keyboard.press("Home")
    says(page, 1)
    ruler = page.get_by_test_id("ruler")
    drawn_px = ruler.locator("i").bounding_box()["width"]
    true_px = float(ruler.get_attribute("data-px"))
    scale = page.get_by_test_id("picture").bounding_box()["width"] / WIDTH
    # at ×1 a ruler of so many pixels is as long as they
    assert drawn_px == pytest.approx(true_px * scale, abs=1.5)
    assert "mm" in ruler.inner_text()
    page.keyboard.press("End")
    says(page, 200)
    expect(page.get_by_test_id("arrow-figures")).to_contain_text(like("compare.arrows.cut-short"))
    page.get_by_test_id("magnify-auto").click()
    says(page, by_itself)


@pytest.mark.long
def test_raw_and_corrected_pictures_both_have_their_arrows(astray, server, tmp_path):
    operator = astray().next("verify")
    page = operator.page
    show(page)
    expect(page.get_by_test_id("arrows-corrected")).to_be_visible(timeout=LONG_MS)
    page.screenshot(path=tmp_path / "wipe.png")
    saved = operator.saved()["id"]
    times = factor(page)
    for key, frame, image, margin in (
        ("r", "raw", "picture", 0),
        ("c", "corrected", "corrected", 40),
    ):
        page.keyboard.press(key)
        name = "image" if frame == "raw" else "corrected"
        expect(page.get_by_test_id(f"arrows-{name}")).to_be_visible()
        page.get_by_test_id(image).evaluate("image => image.decode()")
        asked = f"/calibrations/{saved}/residuals.json?frame={frame}&margin_px={margin}"
        told = server.api("GET", asked).json()["arrows"]
        stage = page.get_by_test_id("stage").bounding_box()
        fine = sorted((a for a in told if not a["outlier"]), key=lambda a: -a["px"])
        ends = [tip(operator, a, times, image) for a in fine]
        shown = [
            a
            for a, (x, y) in zip(fine, ends, strict=True)
            if 5 < x < stage["width"] - 5 and 5 < y < stage["height"] - 5
        ]
        assert len(shown) > 4
        for arrow in shown[:4]:
            is_drawn(operator, arrow, times, lambda seen: seen["light"] > 3, image, name)
    page.screenshot(path=tmp_path / "corrected.png")


# a minute, most of it a fit of two thousand points: pytest -m long tests/e2e/test_arrows.py
@pytest.mark.long
def test_two_thousand_arrows_are_drawn_and_keep_up_with_zooming(operator, server, tmp_path):
    settings = CAMERAS[0]
    field = field_from_json(server.api("GET", f"/fields/{settings['field']}").json())
    camera = source_from_url(settings["source"], SourceContext(fields={field.name: field})).camera
    region, rng = field.region(settings["region"]), np.random.default_rng(0)
    observations = []
    for name in ("left", "right", "top", "bottom"):
        clicks = camera.raw_from_field(region.border(name).sample(520)[10:-10])
        clicks += rng.normal(0, 0.4, clicks.shape)
        observations.append(
            {"feature": name, "kind": "line", "points": clicks[camera.sees(clicks)].tolist()}
        )
    snapshot = server.api("POST", "/snapshots", json={"camera": settings["id"]}).json()["id"]
    saved = server.api(
        "POST",
        "/calibrations",
        json={
            "field": field.name,
            "region": region.name,
            "snapshot": snapshot,
            "model": "homography",
            "observations": observations,
        },
    )
    assert saved.status_code == 201, saved.text
    told = server.api("GET", f"/calibrations/{saved.json()['id']}/residuals.json").json()["arrows"]
    assert len(told) > 1900
    # The clicks themselves are no longer in the draft: what is drawn comes from the version alone.
    operator.go_on(
        snapshot,
        {
            "field": field.name,
            "region": region.name,
            "model": "homography",
            "options": {},
            "observations": [],
        },
        "verify",
    )
    page = operator.page
    page.keyboard.press("r")
    show(page)
    for key in "+++----":
        page.keyboard.press(key)
    times = factor(page)
    stage = page.get_by_test_id("stage").bounding_box()
    on_stage = [
        p
        for p in (tip(operator, a, times) for a in told if not a["outlier"])
        if 10 < p[0] < stage["width"] - 10 and 10 < p[1] < stage["height"] - 10
    ]
    assert on_stage
    for end in on_stage[::20]:
        until(lambda end=end: drawn(operator, end), lambda seen: seen["any"] > 3)
    page.screenshot(path=tmp_path / "many.png")
