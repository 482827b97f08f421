"""One button finds the field's lines: they stand in the draft, beside the clicks, and one undo takes them back."""

import cv2
import numpy as np
import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.auto_scenes import SceneSpec, scene_of

SPEC = SceneSpec(3, "ssl-div-b", "full", "mild", (816, 682), 5500.0, 12.0, 0.0, 3.0, 0.7, 2.0, 0.1, 4, 0)


@pytest.fixture(scope="module")
def picture(tmp_path_factory):
    path = tmp_path_factory.mktemp("seen") / "field.png"
    cv2.imwrite(str(path), scene_of(SPEC).pixels)
    return path


def test_found_lines_stand_in_the_draft_beside_the_clicks_and_one_undo_takes_them_back(operator, picture):
    operator.open(picture, "ssl-div-b", "full").click("left", [(100.0, 300.0)])
    page = operator.page
    clicked = operator.points("left")
    page.get_by_test_id("do-find-lines").click()
    expect(page.get_by_test_id("lines-found")).to_be_visible(timeout=LONG_MS)
    expect(page.get_by_test_id("lines-found")).to_contain_text("of the lines that should be in the picture were found")
    found = {o["feature"]: len(o["points"]) for o in operator.draft()["observations"]}
    assert found["right"] > 5 and found["centre-circle"] > 5 and operator.points("left") == clicked
    page.keyboard.press("Control+z")
    assert [o["feature"] for o in operator.draft()["observations"]] == ["left"]
    assert operator.snapshot not in {
        c["snapshot"] for c in operator.server.api("GET", "/calibrations").json()["items"]}


@pytest.mark.long
def test_where_nobody_has_clicked_the_lens_that_fits_is_good_and_all_of_it_is_one_undo_away(operator, picture):
    operator.open(picture, "ssl-div-b", "full")
    page, before = operator.page, operator.draft()["model"]
    page.get_by_test_id("do-find-lines").click()
    expect(page.get_by_test_id("lines-found")).to_be_visible(timeout=LONG_MS)
    assert operator.draft()["model"] is before is None  # it is chosen by the server
    expect(page.get_by_test_id("verdict")).to_contain_text("Good", timeout=LONG_MS)
    page.keyboard.press("Control+z")
    assert (operator.draft()["observations"], operator.draft()["model"]) == ([], before)


def test_a_picture_without_lines_is_declined_in_words_and_changes_nothing(operator, tmp_path):
    path = tmp_path / "blank.png"
    cv2.imwrite(str(path), np.full((480, 640, 3), 90, np.uint8))
    operator.open(path, "table", "full")
    operator.page.get_by_test_id("do-find-lines").click()
    told = operator.page.get_by_test_id("lines-found")
    expect(told).to_contain_text("No points were added. No line could be seen in the picture.", timeout=LONG_MS)
    assert operator.draft()["observations"] == []
