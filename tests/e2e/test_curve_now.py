"""While a point is dragged, its curve is drawn by the page itself: the picture never waits for the server."""

import re

import numpy as np
from playwright.sync_api import expect

from tests.support.waiting import until


def drawn(page, border: str) -> np.ndarray:
    """The curve on the screen, (n, 2) in picture pixels."""
    numbers = re.findall(r"-?[\d.]+", page.get_by_test_id(f"curve-{border}").get_attribute("d"))
    return np.array(numbers, float).reshape(-1, 2)


def test_a_dragged_points_curve_is_drawn_while_the_server_is_silent_and_is_what_it_would_say(
    operator, server, straight_picture, frame_points
):
    # a degree that is worth keeping
    bent = [[x + 8 * ((y - 210) / 140) ** 2, y] for x, y in frame_points["left"]]
    operator.open(straight_picture, "table", "full").click("left", bent)
    page, clicked = operator.page, operator.points("left")
    question = {"axis": "x_of_y", "image_size": [640, 480]}

    def told(points, degree) -> dict:
        return server.api(
            "POST", "/fit/border", json={**question, "points": points, "degree": degree}
        ).json()

    at_rest = told(clicked, "auto")
    assert at_rest["degree"] >= 2
    until(lambda: np.abs(drawn(page, "left") - at_rest["curve"]).max(), lambda px: px < 0.01)

    page.route("**/api/v1/fit/border", lambda route: None)  # asked, and never answered
    x, y = clicked[2]
    page.mouse.move(*operator.spot(x, y))
    page.mouse.down()
    page.mouse.move(*operator.spot(x + 9, y), steps=3)  # far enough to be a drag
    page.mouse.move(*operator.spot(x + 1.2, y), steps=3)  # and no stray
    until(lambda: np.abs(drawn(page, "left") - at_rest["curve"]).max(), lambda px: px > 0.2)
    shown = drawn(page, "left")
    page.mouse.up()

    points = operator.points("left")
    expected = told(points, at_rest["degree"])
    assert not expected["outliers"] and abs(points[2][0] - x - 1.2) < 0.5
    assert np.abs(shown - expected["curve"]).max() < 0.01
    page.unroute_all(behavior="ignoreErrors")
    expect(page.get_by_test_id("saved")).to_have_attribute("data-state", "saved")
