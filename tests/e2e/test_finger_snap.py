"""A finger is thicker than a pointer: its points are drawn to lines from further away, as they are with the mouse."""

import re

import cv2
import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import Operator
from tests.support.waiting import until
from tests.support.words import like, t

LINE_X = 80.0  # of the drawn frame's left side
BESIDE_STAGE_PX = 17  # beyond a mouse's reach of 12 on the screen, within a finger's 22


def test_a_tap_beside_a_line_lands_on_its_middle_where_a_click_would_stay(
    browser, server, straight_picture
):
    context = browser.new_context(viewport={"width": 1024, "height": 768}, has_touch=True)
    page = context.new_page()
    # as every lens makes it: a hard edge is known to half a pixel
    soft = str(straight_picture.with_name("soft.png"))
    cv2.imwrite(soft, cv2.GaussianBlur(cv2.imread(str(straight_picture)), (0, 0), 0.8))
    operator = Operator(page, server).visit(snap=True).open(soft, "table", "full")
    on_line, y = operator.spot(LINE_X, 220)
    page.touchscreen.tap(on_line + BESIDE_STAGE_PX, y)
    snapped = like("calibrate.snapping.snapped").pattern
    expect(page.get_by_test_id("snap-said")).to_have_text(
        re.compile("^" + snapped.replace(".*?", r"\d+\.\d") + "$")
    )
    until(
        lambda: operator.points("left"),
        lambda points: points == [[pytest.approx(LINE_X, abs=0.1), pytest.approx(220, abs=1)]],
    )

    page.mouse.click(on_line + BESIDE_STAGE_PX, operator.spot(LINE_X, 300)[1])
    expect(page.get_by_test_id("border-left")).to_contain_text(t("common.points", count=2))
    expect(page.get_by_test_id("snap-said")).not_to_have_text(re.compile(f"^({snapped}.*)?$"))
    assert operator.points("left")[1][0] > LINE_X + 8
    context.close()
