"""One button finds the field's lines: they stand in the draft, beside the clicks, and one undo takes them back."""

import cv2
import numpy as np
import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.auto_scenes import SceneSpec, scene_of
from tests.support.held_requests import holding
from tests.support.manual_pictures import manual_picture
from tests.support.tiers import long
from tests.support.waiting import until
from tests.support.words import like, t

HALF = SceneSpec(
    3, "ssl-2008", "half", "half", (816, 682), 5500.0, 12.0, 0.0, -17.0, 0.7, 2.0, 0.1, 6, 0
)
SPEC = SceneSpec(
    3, "ssl-div-b", "full", "mild", (816, 682), 5500.0, 12.0, 0.0, 3.0, 0.7, 2.0, 0.1, 4, 0
)


@pytest.fixture(scope="module")
def picture(tmp_path_factory):
    path = tmp_path_factory.mktemp("seen") / "field.png"
    cv2.imwrite(str(path), scene_of(SPEC).pixels)
    return path


def test_found_lines_stand_in_the_draft_beside_the_clicks_and_one_undo_takes_them_back(
    operator, picture
):
    operator.open(picture, "ssl-div-b", "full").click("left", [(100.0, 300.0)])
    page = operator.page
    clicked = operator.points("left")
    page.get_by_test_id("do-find-lines").click()
    expect(page.get_by_test_id("lines-found")).to_be_visible(timeout=LONG_MS)
    expect(page.get_by_test_id("lines-found")).to_contain_text(
        like("calibrate.find-lines-panel.detected")
    )
    found = {o["feature"]: len(o["points"]) for o in operator.draft()["observations"]}
    assert found["right"] > 5 and found["centre-circle"] > 5 and operator.points("left") == clicked
    page.keyboard.press("Control+z")
    assert [o["feature"] for o in operator.draft()["observations"]] == ["left"]
    assert operator.snapshot not in {
        c["snapshot"] for c in operator.server.api("GET", "/calibrations").json()["items"]
    }


@pytest.mark.long
def test_where_nobody_has_clicked_the_lens_that_fits_is_good_and_all_of_it_is_one_undo_away(
    operator, picture
):
    operator.open(picture, "ssl-div-b", "full")
    page, before = operator.page, operator.draft()["model"]
    page.get_by_test_id("do-find-lines").click()
    expect(page.get_by_test_id("lines-found")).to_be_visible(timeout=LONG_MS)
    assert operator.draft()["model"] is before is None  # it is chosen by the server
    expect(page.get_by_test_id("verdict")).to_contain_text(t("common.level.good"), timeout=LONG_MS)
    page.keyboard.press("Control+z")
    assert (operator.draft()["observations"], operator.draft()["model"]) == ([], before)


def test_nothing_lies_over_the_picture_and_no_name_over_its_line(arriving, picture, tmp_path):
    page = arriving.visit(detect=True).page
    with holding(page, "**/fit/attempt*", "POST"):
        arriving.open(picture, "ssl-div-b", "full")
        expect(page.get_by_test_id("lines-found")).to_be_visible(timeout=LONG_MS)
        expect(page.get_by_test_id("verdict")).to_contain_text(t("shell.sentence.computing"))
    expect(page.get_by_test_id("verdict")).to_have_attribute("data-level", "good", timeout=LONG_MS)
    page.mouse.move(*arriving.spot(400, 300))
    stage = page.get_by_test_id("stage").bounding_box()
    for part in (
        page.get_by_test_id("loupe"),
        page.get_by_role("toolbar"),
        page.get_by_test_id("read-out"),
    ):
        assert apart(part.bounding_box(), stage), part
    manual_picture(page, "automatic-detection")
    page.get_by_role("toolbar").get_by_test_id("do-arrows").click()
    legend = page.get_by_test_id("arrow-legend")
    expect(legend).to_be_visible(timeout=LONG_MS)
    stage = until(
        lambda: page.get_by_test_id("stage").bounding_box(),
        lambda box: apart(legend.bounding_box(), box),
    )  # the stage has made room
    page.screenshot(path=tmp_path / "free.png")
    names = page.locator(".points:has(.name)")
    assert names.count() >= 4
    for line in names.all():
        x0, y0, x1, y1 = line.locator(".name").evaluate(
            "name => { const r = name.getBoundingClientRect(); return [r.left, r.top, r.right, r.bottom]; }"
        )
        assert x0 >= stage["x"] and x1 <= stage["x"] + stage["width"]
        assert y0 >= stage["y"] and y1 <= stage["y"] + stage["height"]
        marks = line.locator(".mark").evaluate_all(
            "marks => marks.map((m) => m.getBoundingClientRect()).map((r) => [r.x + r.width / 2, r.y + r.height / 2])"
        )
        assert [p for p in marks if x0 < p[0] < x1 and y0 < p[1] < y1] == []


def apart(one, other):
    """Whether two boxes have nothing in common."""
    return (
        one["x"] >= other["x"] + other["width"] - 1
        or other["x"] >= one["x"] + one["width"] - 1
        or one["y"] >= other["y"] + other["height"] - 1
        or other["y"] >= one["y"] + one["height"] - 1
    )


def half_field(real_data) -> bytes:
    return cv2.imencode(".png", scene_of(HALF).pixels)[1].tobytes()


def half_field_of_2008(real_data) -> bytes:
    return real_data("fields/ssl_2008/ssl-field-2008.jpg").read_bytes()


@pytest.mark.parametrize("picture_of", [half_field, long(half_field_of_2008)])
def test_half_of_a_field_opened_as_the_full_one_is_active_after_five_presses(
    arriving, server, real_data, picture_of, tmp_path
):
    shown, page = server.data / "shown", arriving.page
    shown.mkdir(exist_ok=True)
    (shown / "hall.png").write_bytes(picture_of(real_data))
    server.api(
        "POST",
        "/cameras",
        json={
            "id": "hall",
            "name": "Hall",
            "source": "picture://hall.png",
            "field": "ssl-2008",
            "region": "full",
        },
    )
    arriving.visit(detect=True).take("hall")
    told = page.get_by_test_id("lines-found")
    expect(told).to_contain_text("The image shows only a part of the covered area", timeout=LONG_MS)
    expect(page.get_by_test_id("next")).to_have_attribute("aria-disabled", "true")
    assert arriving.draft()["observations"] == []
    page.screenshot(path=tmp_path / "1-other-area.png")
    page.get_by_test_id("cure-area-half-right").click()
    expect(told).to_contain_text(like("calibrate.find-lines-panel.detected"), timeout=LONG_MS)
    assert (arriving.draft()["region"], len(arriving.draft()["observations"]) > 4) == (
        "half-right",
        True,
    )
    page.screenshot(path=tmp_path / "2-detected.png")
    arriving.next("verify")
    arriving.activate(warned=True)  # the camera's settings name the full field
    active = server.api("GET", "/cameras/hall").json()["active_calibration"]
    assert server.api("GET", f"/calibrations/{active}").json()["region"] == "half-right"
    server.api("DELETE", "/cameras/hall")


def test_a_picture_without_lines_is_declined_in_words_and_changes_nothing(operator, tmp_path):
    path = tmp_path / "blank.png"
    cv2.imwrite(str(path), np.full((480, 640, 3), 90, np.uint8))
    operator.open(path, "table", "full")
    operator.page.get_by_test_id("do-find-lines").click()
    told = operator.page.get_by_test_id("lines-found")
    expect(told).to_contain_text(
        f"{t('calibrate.find-lines-panel.nothing-added')} No line detected in the image.",
        timeout=LONG_MS,
    )
    assert operator.draft()["observations"] == []
