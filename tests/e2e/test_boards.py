"""A lens from pictures of a board, by the page: uploaded, found, judged, and held by a camera's fit."""

import re

import cv2
import numpy as np
import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.held_requests import holding, wait_until_held
from tests.support.waiting import jobs_so_far, newest_job
from tests.support.words import t


@pytest.fixture
def desk(operator):
    """At the board, by the rail, without pictures."""
    operator.page.get_by_test_id("rail-lenses").click()
    operator.page.get_by_test_id("do-board").click()
    expect(operator.page.get_by_test_id("board-desk")).to_be_visible()
    return operator.page


@pytest.fixture
def board_pictures(real_data):
    """The classic thirteen, 640 × 480, 9 × 6 inner corners."""
    return sorted(real_data("boards/opencv_left_right/left01.jpg").parent.glob("left*.jpg"))


@pytest.fixture
def grey(tmp_path):
    """A picture of the same size that shows no board."""
    path = tmp_path / "grey.png"
    cv2.imwrite(str(path), np.full((480, 640, 3), 128, np.uint8))
    return path


@pytest.fixture
def snow(tmp_path):
    """Pictures that show no board and take long to look through, half a second each on a quiet machine."""
    draw = np.random.default_rng(1)
    paths = [tmp_path / f"snow-{n}.jpg" for n in range(24)]
    for path in paths:
        cv2.imwrite(str(path), draw.integers(0, 256, (480, 640, 3), np.uint8))
    return paths


def uploaded(desk):
    """The pictures of which nothing more is said than that they are there."""
    return desk.get_by_test_id("view").filter(has_text=t("lens-pictures.state.uploaded"))


def test_a_lens_is_found_from_pictures_and_the_next_camera_holds_it(
    desk, operator, server, board_pictures, grey, straight_picture, tmp_path
):
    desk.get_by_test_id("board-square_mm").fill("30")
    desk.get_by_test_id("board-note").fill("classic lens")
    desk.screenshot(path=tmp_path / "empty.png")
    desk.get_by_test_id("file").set_input_files([*board_pictures, grey])
    expect(uploaded(desk)).to_have_count(len(board_pictures) + 1, timeout=LONG_MS)
    desk.get_by_test_id("next").click()
    expect(desk.get_by_test_id("lens-verdict")).to_be_visible(timeout=LONG_MS)

    lens = server.api("GET", "/lenses").json()["items"][0]
    report = server.api("GET", f"/lenses/{lens['id']}").json()["report"]
    assert lens["note"] == "classic lens" and report["rms_px"] < 0.2
    expect(desk.get_by_test_id("lens-rms")).to_have_text(f"{report['rms_px']:.2f} px")
    expect(desk.get_by_test_id("lens-verdict")).to_contain_text(report["verdict"]["sentence"])
    expect(desk.get_by_test_id("next-view")).to_contain_text(report["next_view"]["text"])
    expect(desk.get_by_test_id("view").last).to_contain_text(t("board.view.no-board"))
    used = [view for view in report["views"] if view["used"]]
    expect(desk.locator("[data-testid=view][data-level=good]")).to_have_count(len(used))
    expect(desk.get_by_test_id("view").first).to_contain_text(
        f"{report['views'][0]['rms_px']:.2f} px"
    )
    desk.screenshot(path=tmp_path / "found.png")

    desk.emulate_media(color_scheme="light")
    desk.set_viewport_size({"width": 1024, "height": 768})
    desk.screenshot(path=tmp_path / "found-light.png")
    overflowing = desk.evaluate(
        "[...document.querySelectorAll('aside, .stage, footer')]"
        ".filter(e => e.scrollWidth > e.clientWidth + 1).map(e => e.className || e.tagName)"
    )
    assert overflowing == []

    desk.reload()
    expect(desk.get_by_test_id("lens-verdict")).to_be_visible(timeout=LONG_MS)
    expect(desk.get_by_test_id("view")).to_have_count(len(board_pictures) + 1)

    desk.get_by_test_id("next").click()
    expect(desk.get_by_test_id("held-next")).to_contain_text("classic lens")
    desk.screenshot(path=tmp_path / "start.png")
    desk.get_by_test_id("file").set_input_files(straight_picture)
    expect(desk.get_by_test_id("step-field")).to_have_attribute("aria-current", "step")
    draft = operator.draft()
    assert (draft["model"], draft["options"]) == (
        "brown-conrady",
        {"lens": lens["id"], "lens_sigma": "own"},
    )
    desk.get_by_test_id("step-camera").click()
    expect(desk.get_by_test_id("held-next")).to_have_count(0)


@pytest.mark.long
def test_a_search_says_how_far_it_is_and_can_be_stopped(desk, server, snow):
    before = jobs_so_far(server)
    desk.get_by_test_id("file").set_input_files(snow)
    expect(uploaded(desk)).to_have_count(len(snow), timeout=LONG_MS)
    desk.get_by_test_id("next").click()
    expect(desk.get_by_test_id("finding")).to_contain_text(f"of {len(snow)})", timeout=LONG_MS)
    desk.get_by_test_id("do-stop-finding").click()
    expect(desk.get_by_test_id("finding")).to_have_count(0)
    newest_job(server, "board", "cancelled", besides=before)


def test_pictures_without_a_board_are_refused_with_what_to_do(desk, grey, tmp_path):
    holiday = {"name": "holiday.png", "mimeType": "image/png", "buffer": b"not a picture"}
    desk.get_by_test_id("file").set_input_files(grey)
    desk.get_by_test_id("file").set_input_files(holiday)
    # it is no picture
    expect(desk.locator("[data-testid=view][data-level=poor]")).to_have_count(1, timeout=LONG_MS)
    expect(uploaded(desk)).to_have_count(1, timeout=LONG_MS)
    desk.get_by_test_id("next").click()
    expect(desk.get_by_test_id("board-refusal")).to_contain_text(
        "Count the inner corners again", timeout=LONG_MS
    )
    desk.screenshot(path=tmp_path / "refused.png")
    expect(desk.get_by_test_id("board-marker_mm")).to_have_count(0)
    # the form asks for what such a board has more
    desk.get_by_test_id("board-kind").select_option("charuco")
    expect(desk.get_by_test_id("board-marker_mm")).to_be_visible()
    desk.reload()
    expect(desk.get_by_test_id("board-dictionary")).to_be_visible()


@pytest.mark.long
def test_a_place_that_is_gone_to_while_lists_are_on_their_way_has_its_address_at_once(page, server):
    with holding(page, "**/api/v1/snapshots?*", "GET") as held:
        page.goto(server.url)
        wait_until_held(page, held)
        page.get_by_test_id("rail-lenses").click()
        expect(page).to_have_url(re.compile("#/lenses$"))
    page.reload()
    expect(page.get_by_test_id("lenses-page")).to_be_visible()


@pytest.mark.long
def test_pictures_of_a_board_are_not_among_the_earlier_pictures_of_a_field(
    desk, server, straight_picture
):
    before = server.api("GET", "/snapshots?purpose=picture").json()["items"]
    desk.get_by_test_id("file").set_input_files(straight_picture)
    expect(uploaded(desk)).to_have_count(1, timeout=LONG_MS)
    kept = server.api("GET", "/snapshots").json()["items"][0]
    assert kept["purpose"] == "board"
    desk.goto(f"{server.url}/#/library/images")
    desk.reload()
    recent = desk.get_by_role("region", name=t("library.earlier-pictures"))
    expect(recent.locator("img")).to_have_count(min(len(before), 48))
    expect(recent.locator(f"img[src*='{kept['id']}']")).to_have_count(0)
