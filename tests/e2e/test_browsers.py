"""The same story in the other browsers: Firefox, and the engine of Safari."""

import math
import os
import re

import pytest

from tests.support.activation import activate_despite
from tests.support.demo_cameras import HEIGHT, WIDTH
from tests.support.waiting import until
from tests.support.webdriver import BROWSERS, CONTROL, ENTER, Browser, virtual_screen
from tests.support.words import t

SIZE = (1280, 800)
# The sum of all colours of each canvas (a picture of 64 × 64 pixels is enough for that): 0 is black.
COLOURS = """return [...document.querySelectorAll(arguments[0])].map((canvas) => {
  const small = Object.assign(document.createElement("canvas"), { width: 64, height: 64 }),
    pen = small.getContext("2d");
  pen.drawImage(canvas, 0, 0, 64, 64);
  return pen.getImageData(0, 0, 64, 64).data.reduce((sum, value, i) => sum + (i % 4 === 3 ? 0 : value), 0);
});"""
GREY = 64 * 64 * 3 * 16  # no picture of a field is darker than that on average
SPOT = """const picture = document.querySelector("[data-testid=picture]"), box = picture.getBoundingClientRect();
return [box.left + (arguments[0] + .5) * box.width / picture.naturalWidth,
  box.top + (arguments[1] + .5) * box.height / picture.naturalHeight];"""


@pytest.fixture(scope="module")
def screen():
    with virtual_screen() as name:
        yield name


@pytest.fixture(params=BROWSERS)
def driven(request, tmp_path_factory, screen):
    """A browser of its own for each test."""
    kind = BROWSERS[request.param]
    if kind.program() is None:
        told = f"{kind.__name__} is not installed: apt-get install {' '.join(kind.packages)}"
        if os.environ.get("TOUCHLINE_TESTS") == "all":
            pytest.fail(told, pytrace=False)
        pytest.skip(told)
    browser = kind(tmp_path_factory.mktemp(request.param), screen)
    yield browser
    browser.end()


def are_drawn(browser: Browser, canvases: str, count: int) -> None:
    """Wait until so many canvases show something."""
    browser.until(COLOURS, canvases, holds=lambda sums: len(sums) == count and min(sums) > GREY)


def free_place(points: list[list[float]]) -> tuple[float, float]:
    """Where a picture has no point for the longest way around, so that a click there takes hold of none."""
    places = [(x, y) for x in range(50, WIDTH - 50, 10) for y in range(50, HEIGHT - 50, 10)]
    return max(places, key=lambda place: min(math.dist(place, point) for point in points))


def test_a_camera_is_calibrated_and_watched(driven, own_server):
    browser, server = driven, own_server

    def observed() -> dict[str, list[list[float]]]:
        draft = server.api("GET", f"/drafts/{snapshot}").json()
        return {o["feature"]: o["points"] for o in draft["observations"]}

    browser.resize(*SIZE)
    browser.visit(server.url)
    browser.script(
        "localStorage.setItem('touchline.snap', 'off');"
        "localStorage.setItem('touchline.correction', 'browser');"
    )
    # the same page in another place: it has to be loaded again
    browser.visit(f"{server.url}/#/system/server")
    browser.reload()
    browser.click("rail-cameras")
    cameras = len(server.api("GET", "/cameras").json()["items"])
    are_drawn(browser, ".live canvas", cameras)

    browser.click("camera-overhead")
    browser.sees("lines-found")
    browser.sees("verdict", "it.dataset.level")
    snapshot = re.search(r"calibrate/(\w+)/", browser.script("return location.hash"))[1]
    before = until(observed, lambda there: len(there.get("left", ())) > 3)
    browser.click("border-left")
    x, y = free_place([point for points in before.values() for point in points])
    browser.click_at(*browser.script(SPOT, x, y))
    clicked = until(observed, lambda there: len(there["left"]) == len(before["left"]) + 1)
    browser.drag(browser.script(SPOT, x, y), browser.script(SPOT, x + 20, y))
    until(
        observed,
        lambda there: there != clicked and any(abs(p[0] - x - 20) < 2 for p in there["left"]),
    )
    for state in (clicked, before):
        browser.press(CONTROL, "z")
        until(observed, lambda there, state=state: there == state)

    browser.click("next")
    browser.sees("corrected", "it.tagName === 'CANVAS' && it.dataset.drawn === ''")
    made = until(lambda: server.api("GET", "/calibrations").json()["items"])[0]
    activate_despite(server, made["id"])

    browser.press(CONTROL, "k")
    browser.sees("palette-input")
    browser.type("palette-input", t("shell.view.server"))
    browser.sees("found")
    browser.press(ENTER)
    browser.choose("correction", "server")
    browser.choose("language", "de")
    browser.until("return document.documentElement.lang === 'de'")
    browser.back()
    browser.sees("corrected", "it.tagName === 'IMG' && it.naturalWidth > 0")
    browser.forward()
    browser.choose("correction", "browser")

    for ours in ("browser", "server"):
        browser.choose("correction", ours)
        browser.click("rail-cameras")
        browser.click("look-at-overhead")
        browser.click("look-side")
        are_drawn(browser, ".live .sheet canvas", 2)
        browser.click("rail-system")
        browser.click("tab-server")
    assert browser.console() == []

    browser.click("rail-cameras")
    are_drawn(browser, ".live canvas", cameras)
    server.stop()
    browser.sees("away")
    server.start()
    browser.until("return document.querySelector('[data-testid=away]') === null")
    seen = browser.script(
        "return Number(document.querySelector('[data-testid=live-overhead]').dataset.seq)"
    )
    browser.sees(
        "live-overhead", f"it.dataset.state === 'live' && Number(it.dataset.seq) !== {seen}"
    )
