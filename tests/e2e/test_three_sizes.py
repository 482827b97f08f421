"""At three sizes of window: what is pressed is large enough, and what is said is not cut."""

import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS, running
from tests.support.demo_cameras import CAMERAS
from tests.support.words import t

SIZES = [(1440, 900), (1024, 768), (390, 844)]
ADDRESSES = (
    "cameras",
    "cameras/new",
    "cameras/overhead/calibrate",
    "field/new-field/ssl-div-b",
    "library/import",
    "lenses",
    "system/publishing",
    "system/server",
)
# Links within a sentence are as high as its lines, as WCAG 2.2 has it.
SMALL = """() => [...document.querySelectorAll("a[href], button, input, select, summary")]
  .filter((it) => {
    const label = it.closest("label"),
      { width, height } = (it.matches("[type=checkbox], [type=radio]") && label ? label : it)
        .getBoundingClientRect();
    return width > 0 && height > 0 && Math.min(width, height) < 23.9
      && !it.matches(".sr, .skip, :disabled") && !(it.matches("a") && it.closest("p, dd, td"));
  })
  .map((it) => `${it.tagName} ${it.dataset.testid ?? ""} ${it.textContent.trim().slice(0, 30)}`)"""
CUT = """(it) => it.scrollWidth > it.clientWidth + 1 || it.scrollHeight > it.clientHeight + 1"""


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    """Of this file alone: the next step depends on what is calibrated."""
    yield from running(tmp_path_factory.mktemp("data"))


@pytest.mark.parametrize("size", SIZES, ids=str)
def test_targets_are_large_and_the_bars_are_not_cut(page, server, size):
    width, height = size
    page.set_viewport_size({"width": width, "height": height})
    found = {}
    for address in ADDRESSES:
        page.goto(f"{server.url}/#/{address}")
        expect(page.get_by_test_id("bell")).to_be_visible(timeout=LONG_MS)
        expect(page.get_by_text(t("shell.opening"), exact=True)).to_have_count(0, timeout=LONG_MS)
        if small := page.evaluate(SMALL):
            found[address] = small
    assert found == {}

    page.goto(f"{server.url}/#/cameras/overhead/calibrate")
    go = page.get_by_test_id("next")
    expect(go).to_have_attribute("title", t("live.next.take-picture", camera=CAMERAS[0]["name"]))
    assert not go.evaluate(CUT)
    fix = page.get_by_test_id("status").get_by_role("link")
    expect(fix).to_be_visible(timeout=LONG_MS)
    if width > 720:
        box, bar = go.bounding_box(), page.locator("header").bounding_box()
        assert bar["y"] <= box["y"] and box["y"] + box["height"] <= bar["y"] + bar["height"]
        assert fix.bounding_box()["x"] + fix.bounding_box()["width"] < width
        expect(page.get_by_text(t("shell.top.search"), exact=True)).to_be_visible()
