"""Maps over the picture: expected error of a version, and the difference between two, as REST tells them."""

import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.manual_pictures import manual_picture
from tests.support.waiting import until
from tests.support.words import like, t

COLOUR_AT = """(canvas, [u, v]) => [...canvas.getContext("2d").getImageData(
  Math.round(u * (canvas.width - 1)), Math.round(v * (canvas.height - 1)), 1, 1).data]"""


def test_the_expected_error_is_laid_over_the_picture_with_its_scale(clicked, server, tmp_path):
    operator = clicked("brown-conrady", height_mm={"value": 3000.0, "sigma": 30.0})
    page = operator.page
    expect(page.get_by_test_id("do-heat")).to_be_disabled()  # nothing is saved yet
    operator.next("verify")
    page.keyboard.press("e")
    on_carpet = server.api("GET", f"/calibrations/{operator.saved()['id']}/uncertainty.json").json()
    expect(page.get_by_test_id("heat-figures")).to_contain_text(
        like("compare.heat.figures.carpet", worst=mm(on_carpet["max"])), timeout=LONG_MS
    )
    expect(page.get_by_test_id("worst-corrected")).to_contain_text(f"{mm(on_carpet['max'])} mm")
    # it is checked
    expect(page.get_by_test_id("next")).to_have_attribute("aria-disabled", "false", timeout=LONG_MS)
    manual_picture(page, "accuracy")

    places, sigma = on_carpet["grid"]["places"], on_carpet["grid"]["sigma_mm"]
    flat = [
        (s, p)
        for row, line in zip(sigma, places, strict=True)
        for s, p in zip(row, line, strict=True)
    ]
    shares = _shares(operator, [min(flat)[1], max(flat)[1]])
    lowest, highest = until(  # the canvas is there before it is drawn
        lambda: [
            page.get_by_test_id("heat-corrected").evaluate(COLOUR_AT, share) for share in shares
        ],
        lambda colours: all(opacity == 255 for *_, opacity in colours),
    )
    assert _brightness(highest) > _brightness(lowest)

    hat_mm = operator.saved()["field_definition"]["hat_height_mm"]
    page.get_by_test_id("height-hats").click()
    at_hats = server.api(
        "GET", f"/calibrations/{operator.saved()['id']}/uncertainty.json?z_mm={hat_mm}"
    ).json()
    expect(page.get_by_test_id("heat-figures")).to_contain_text(
        like("compare.heat.figures.hats", height=f"{hat_mm:g}", worst=mm(at_hats["max"])),
        timeout=LONG_MS,
    )
    page.screenshot(path=tmp_path / "hat.png")

    page.get_by_test_id("step-points").click()  # the saved version is still what the document says
    expect(page.get_by_test_id("heat-image")).to_be_visible()
    page.screenshot(path=tmp_path / "model.png")
    page.get_by_test_id("step-verify").click()
    page.get_by_test_id("do-heat").first.click()
    expect(page.get_by_test_id("heat-corrected")).to_have_count(0)


@pytest.mark.long
def test_under_the_pointer_stands_the_error_that_the_map_shows_there(saved, server):
    operator = saved("division")
    page = operator.page
    page.keyboard.press("e")
    page.keyboard.press("r")
    expect(page.get_by_test_id("heat-image")).to_be_visible(timeout=LONG_MS)
    found = server.api("GET", f"/calibrations/{operator.saved()['id']}/uncertainty.json").json()[
        "grid"
    ]
    row, column = 9, 12  # the middle of the field
    place = found["places"][row][column]
    pixel = server.api(
        "POST",
        f"/calibrations/{operator.saved()['id']}/transform",
        json={"from": "field", "to": "image", "points": [place]},
    ).json()["points"][0]
    page.mouse.move(*operator.spot(*pixel))
    there = mm(found["sigma_mm"][row][column])
    expect(page.get_by_test_id("read-out")).to_contain_text(
        f"{t('canvas.stage.expected-error')} {there} mm"
    )


@pytest.mark.long
def test_a_model_that_knows_no_expected_error_says_why(clicked):
    operator = clicked("polynomial").next("verify")
    operator.page.get_by_test_id("do-heat").first.click()
    expect(operator.page.get_by_test_id("no-map")).to_contain_text(
        "there is no covariance", timeout=LONG_MS
    )
    expect(operator.page.get_by_test_id("heat-corrected")).to_have_count(0)


@pytest.mark.long
def test_the_difference_between_two_versions_is_a_map_with_its_figures(clicked, server, tmp_path):
    operator = clicked("division").next("verify")
    page, first = operator.page, operator.saved()["id"]
    page.get_by_test_id("step-points").click()
    operator.use_model("homography")
    operator.next("verify")
    second = operator.saved()["id"]
    operator.unfold("map")
    page.get_by_test_id("other").select_option(first)
    apart = server.api("GET", f"/calibrations/{second}/difference/{first}.json").json()
    figures = page.get_by_test_id("heat-figures")
    told = like(
        "compare.heat.figures.difference",
        median=mm(apart["median_mm"]),
        worst=mm(apart["max_mm"]),
        max=f"{apart['max_px']:.2f}",
    )
    expect(figures).to_contain_text(told, timeout=LONG_MS)
    expect(page.get_by_test_id("worst-corrected")).to_contain_text(f"{mm(apart['max_mm'])} mm")
    page.screenshot(path=tmp_path / "difference.png")
    page.keyboard.press("d")
    expect(page.get_by_test_id("heat-corrected")).to_have_count(0)


def mm(value):
    """As the page prints millimetres."""
    return f"{value:.0f}" if value >= 10 else f"{value:.1f}"


def _shares(operator, places):
    """Field mm to where they lie on the corrected picture, as shares of its canvas."""
    saved = operator.saved()
    points = operator.server.api(
        "POST",
        f"/calibrations/{saved['id']}/transform",
        json={"from": "field", "to": "corrected", "points": places},
    ).json()["points"]
    width, height = saved["corrected_size"]
    return [[(x + 40.5) / (width + 80), (y + 40.5) / (height + 80)] for x, y in points]


def _brightness(colour):
    return sum(colour[:3])
