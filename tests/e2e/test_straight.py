"""A lens judged by straight edges, by the page: pictures added, edges seen before and after, and the verdict."""

import re

import cv2
import numpy as np
import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.bar_pictures import BENT, STRAIGHT, bars_behind
from tests.support.manual_pictures import manual_picture
from tests.support.waiting import jobs_so_far, newest_job
from tests.support.words import like, t


@pytest.fixture
def desk(operator):
    """At the straight edges, by the rail, without pictures."""
    operator.page.get_by_test_id("rail-lenses").click()
    operator.page.get_by_test_id("do-straight").click()
    expect(operator.page.get_by_test_id("straight-desk")).to_be_visible()
    return operator.page


@pytest.fixture
def drawn(tmp_path):
    """A function: a drawn picture's path."""

    def drawn(name, pixels):
        cv2.imwrite(str(tmp_path / name), pixels)
        return tmp_path / name

    return drawn


def judge(desk, files):
    desk.get_by_test_id("file").set_input_files(files)
    uploaded = desk.get_by_test_id("view").filter(has_text=t("lens-pictures.state.uploaded"))
    expect(uploaded).to_have_count(len(files), timeout=LONG_MS)
    desk.get_by_test_id("next").click()


def report(server):
    """Of the newest job, as REST tells it."""
    return newest_job(server, "straightness", "done")["result"]


def overflowing(desk):
    return desk.evaluate(
        "[...document.querySelectorAll('aside, .stage, footer')]"
        ".filter(e => e.scrollWidth > e.clientWidth + 1).map(e => e.className || e.tagName)"
    )


def test_bent_edges_are_seen_as_taken_and_straightened_and_the_lens_is_told(
    desk, server, drawn, tmp_path
):
    desk.screenshot(path=tmp_path / "empty.png")
    judge(
        desk, [drawn("bent.png", bars_behind(BENT)), drawn("dim.png", bars_behind(BENT, shade=110))]
    )
    expect(desk.get_by_test_id("straight-verdict")).to_be_visible(timeout=LONG_MS)
    found = report(server)
    expect(desk.get_by_test_id("straight-verdict")).to_have_attribute(
        "data-distortion", "significant"
    )
    expect(desk.get_by_test_id("straight-verdict")).to_contain_text(found["sentence"])
    expect(desk.get_by_test_id("straight-bow")).to_have_text(
        f"{found['bow']['most']['px']:.2f} ± {found['bow']['most']['sigma_px']:.2f} px"
    )
    expect(desk.get_by_test_id("straight-before")).to_have_text(
        f"{found['straightness_px']['before']:.2f} px"
    )
    expect(desk.get_by_test_id("straight-after")).to_have_text(
        f"{found['straightness_px']['after']:.2f} px"
    )
    expect(desk.get_by_test_id("straight-lens")).to_contain_text(
        f"−{-found['lens']['terms']['k']:.4f} ±"
    )
    first = [line for line in found["lines"] if line["picture"] == 0]
    expect(desk.get_by_test_id("edge")).to_have_count(len(first))
    used = sum(e["used"] for e in first)
    expect(desk.get_by_test_id("view").first).to_contain_text(
        t("straight.edges-used", used=used, count=len(first))
    )
    manual_picture(desk, "straight-edges")

    lies_on_the_picture(desk, first[0]["chain"])
    x, y = spot(desk, first[0]["chain"][len(first[0]["chain"]) // 2])
    desk.mouse.move(x, y)
    told = "straight.edge.counted" if first[0]["used"] else "straight.edge.left-out"
    expect(desk.get_by_test_id("pointed")).to_contain_text(like(told, name=first[0]["name"]))

    desk.get_by_test_id("next").click()
    expect(desk.get_by_test_id("edges")).to_have_attribute("data-shown", "straight")
    expect(desk.get_by_test_id("edges-picture")).to_have_attribute(
        "src", re.compile("^blob:"), timeout=LONG_MS
    )
    lies_on_the_picture(desk, first[0]["straight"])
    desk.screenshot(path=tmp_path / "straightened.png")
    desk.get_by_test_id("as-taken").click()
    expect(desk.get_by_test_id("edges")).to_have_attribute("data-shown", "taken")

    desk.emulate_media(color_scheme="light")
    desk.set_viewport_size({"width": 1024, "height": 768})
    desk.screenshot(path=tmp_path / "light.png")
    assert overflowing(desk) == []


def spot(desk, point):
    """Where a picture pixel of the figure is on the screen."""
    desk.get_by_test_id("edges").scroll_into_view_if_needed()
    box = desk.get_by_test_id("edges-picture").bounding_box()
    return box["x"] + (point[0] + 0.5) * box["width"] / 640, box["y"] + (point[1] + 0.5) * box[
        "height"
    ] / 480


def lies_on_the_picture(desk, chain):
    """The drawn edge is where the shown picture's own brightness changes."""
    picture = desk.get_by_test_id("edges-picture")
    picture.evaluate("picture => picture.decode()")
    hidden = desk.add_style_tag(content=".edges svg, .edges .bow { visibility: hidden; }")
    pixels = cv2.imdecode(np.frombuffer(picture.screenshot(), np.uint8), 0).astype(float)
    hidden.evaluate("style => style.remove()")
    scale = np.array(pixels.shape[::-1]) / (640, 480)
    points = (
        np.array([p for p in chain if p and 20 < p[0] < 620 and 20 < p[1] < 460]) + 0.5
    ) * scale
    steep = np.hypot(*np.gradient(cv2.GaussianBlur(pixels, (0, 0), 1.5)))
    x, y = points.astype(int).T
    assert len(points) >= 5 and np.median(steep[y, x]) > 8


@pytest.mark.long
def test_a_straight_picture_is_said_to_be_straight_and_a_reload_goes_on(desk, drawn):
    judge(desk, [drawn("straight.png", bars_behind(STRAIGHT))])
    verdict = desk.get_by_test_id("straight-verdict")
    expect(verdict).to_contain_text("No significant distortion", timeout=LONG_MS)
    desk.reload()
    expect(verdict).to_contain_text("No significant distortion", timeout=LONG_MS)
    expect(desk.get_by_test_id("edge").first).to_be_attached()
    # the report is of another question now
    desk.get_by_test_id("straight-kind").select_option("brown-conrady")
    expect(verdict).to_have_count(0)
    desk.get_by_test_id("next").click()
    expect(verdict).to_be_visible(timeout=LONG_MS)
    expect(desk.get_by_test_id("straight-lens-kind")).to_have_text(t("straight.kind.brown-conrady"))


@pytest.mark.long
def test_judging_is_stopped_and_what_shows_no_edges_is_refused_with_what_to_do(
    desk, server, drawn, tmp_path
):
    judge(desk, [drawn("grey.png", np.full((480, 640, 3), 128, np.uint8))])
    expect(desk.get_by_test_id("straight-refusal")).to_contain_text(
        "more straight edges", timeout=LONG_MS
    )
    desk.screenshot(path=tmp_path / "refused.png")
    desk.get_by_role("button", name=t("lens-pictures.remove-all")).click()
    # which takes long to look through
    grain = np.random.default_rng(1).normal(0, 10, (480, 640, 3))
    before = jobs_so_far(server)
    judge(
        desk,
        [
            drawn(f"{n}.png", np.clip(bars_behind(shade=90 + n) + grain, 0, 255).astype(np.uint8))
            for n in range(24)
        ],
    )
    desk.get_by_test_id("do-stop-judging").click()
    expect(desk.get_by_test_id("finding")).to_have_count(0)
    newest_job(server, "straightness", "cancelled", besides=before)
    expect(desk.get_by_test_id("straight-verdict")).to_have_count(0)


@pytest.mark.long
def test_the_desk_has_an_address_and_tabs_to_the_board_and_back(desk, server):
    expect(desk).to_have_url(re.compile("#/lenses/edges$"))
    desk.get_by_test_id("tab-board").click()
    expect(desk.get_by_test_id("board-desk")).to_be_visible()
    expect(desk).to_have_url(re.compile("#/lenses/board$"))
    desk.go_back()
    expect(desk.get_by_test_id("straight-desk")).to_be_visible()
    desk.goto(f"{server.url}/#/")
    expect(desk.get_by_test_id("camera-overhead")).to_be_visible()
    expect(desk.get_by_test_id("straight-desk")).to_have_count(0)


@pytest.mark.long
def test_a_picture_is_taken_with_a_camera_and_its_lens_is_judged(desk, server, tmp_path):
    desk.get_by_test_id("straight-camera-overhead").click()
    uploaded = desk.get_by_test_id("view").filter(has_text=t("lens-pictures.state.uploaded"))
    expect(uploaded).to_have_count(1, timeout=LONG_MS)
    desk.get_by_test_id("next").click()
    expect(desk.get_by_test_id("straight-verdict")).to_have_attribute(
        "data-distortion", "significant", timeout=LONG_MS
    )
    assert report(server)["straightness_px"]["after"] < 0.3
    desk.screenshot(path=tmp_path / "camera.png")


@pytest.mark.long
def test_the_facade_of_a_published_picture(desk, server, real_data, tmp_path):
    judge(desk, [real_data("lines/ipol_alvarez/building.png")])
    expect(desk.get_by_test_id("straight-verdict")).to_be_visible(timeout=LONG_MS)
    found = report(server)
    assert found["straightness_px"]["after"] <= 0.20
    expect(desk.get_by_test_id("bow-label")).to_contain_text(
        t("straight.figure.bow", bow=f"{found['bow']['most']['px']:.1f}")
    )
    expect(desk.get_by_test_id("left-out").locator("li")).to_have_count(
        len(found["lines"]) - found["lines_used"]
    )
    desk.screenshot(path=tmp_path / "facade.png")
    desk.get_by_test_id("as-straightened").click()
    expect(desk.get_by_test_id("edges-picture")).to_have_attribute(
        "src", re.compile("^blob:"), timeout=LONG_MS
    )
    desk.get_by_test_id("edges-picture").evaluate("picture => picture.decode()")
    desk.screenshot(path=tmp_path / "facade-straightened.png")
