"""A ball before a live camera, by the page: tracks and numbers as it rolls, left out, kept over a reload, fitted."""

import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.manual_pictures import manual_picture
from tests.support.waiting import until
from tests.support.words import like, t

SOURCE = "sim://table?robots=0&ball=true&lens=division&k=-0.3&size=640x480&fps=25"
AGREEING = "[data-testid=roll]:not([data-level=left-out])"


@pytest.fixture(scope="module")
def camera(server):
    """One before which a ball rolls; it is gone when these tests are done."""
    made = server.api(
        "POST",
        "/cameras",
        json={
            "id": "rolling",
            "name": "Rolling",
            "source": SOURCE,
            "field": "table",
            "region": "full",
        },
    )
    assert made.status_code == 201, made.text
    yield
    assert server.api("DELETE", "/cameras/rolling").status_code == 204


@pytest.fixture
def rolling(operator, server, camera):
    """At that camera's page, with three rolls or more."""
    page = operator.page
    page.goto(f"{server.url}/#/cameras/rolling/live")
    page.reload()
    page.get_by_test_id("do-watch-rolls").click()
    expect(page.get_by_test_id("roll").nth(2)).to_be_visible(timeout=LONG_MS)
    return page


def kept(server):
    return {item["id"] for item in server.api("GET", "/cameras/rolling/rolls").json()["items"]}


def test_each_roll_has_its_number_and_a_reload_loses_none(rolling, server):
    page = rolling
    expect(page.get_by_test_id("rolls-pct")).to_contain_text("±", timeout=LONG_MS)
    expect(page.get_by_test_id("roll-track").nth(2)).to_be_attached(timeout=LONG_MS)
    expect(page.get_by_test_id("rolls-sentence")).to_contain_text("raw image")
    expect(page.get_by_test_id("deceleration")).to_contain_text("active calibration")
    expect(page.get_by_test_id("use-deceleration")).to_have_count(0)
    manual_picture(page, "rolling-ball")
    before = kept(server)
    page.reload()
    expect(page.get_by_test_id("roll").nth(len(before) - 1)).to_be_visible(timeout=LONG_MS)
    assert before <= kept(server)

    last = page.get_by_test_id("roll").last  # the oldest: new ones come above it
    last.get_by_test_id("roll-leave").click()
    expect(last).to_have_attribute("data-level", "left-out")
    expect(last).to_contain_text(t("rolling.roll.left-out"))
    assert server.api("GET", "/cameras/rolling/rolls").json()["items"][0]["left_out"]
    # the list may be told before the deed is answered
    expect(page.get_by_test_id("do-take-roll")).to_be_enabled()
    page.keyboard.press("Control+z")
    expect(last).not_to_contain_text(t("rolling.roll.left-out"))
    assert not server.api("GET", "/cameras/rolling/rolls").json()["items"][0]["left_out"]


@pytest.mark.long
def test_the_lens_of_the_rolls_is_kept_and_chosen_for_the_next_picture(rolling, server):
    page = rolling
    # of the first three, one may disagree
    expect(page.locator(AGREEING).nth(5)).to_be_visible(timeout=LONG_MS)
    page.get_by_test_id("rolls-kind").select_option("division")
    page.get_by_test_id("do-fit-rolls").click()
    expect(page.get_by_test_id("rolls-made")).to_contain_text(
        t("rolling.made.lens"), timeout=LONG_MS
    )
    lens = server.api("GET", "/lenses").json()["items"][0]
    assert (lens["model"], lens["camera"], lens["image_size"]) == (
        "division",
        "rolling",
        [640, 480],
    )
    page.get_by_test_id("use-roll-lens").click()
    expect(page.get_by_test_id("held-next")).to_contain_text(lens["note"])
    page.goto(f"{server.url}/#/lenses/ball/rolling")
    old = kept(server)
    page.get_by_test_id("do-forget-rolls").click()
    expect(page.get_by_test_id("do-forget-rolls")).to_contain_text(like("rolling.page.press-again"))
    page.get_by_test_id("do-forget-rolls").click()
    expect(page.get_by_test_id("do-forget-rolls")).to_contain_text(t("rolling.forget-all"))
    until(lambda: kept(server), lambda now: not old & now)  # the ball rolls on meanwhile
