"""One fact has one sentence on the page: notices replace each other, and every place counts the same problems."""

import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.waiting import until
from tests.support.words import like, t

PLACES = ("cameras", "field", "lenses", "library", "system")


@pytest.fixture
def two_versions(own_server, clicks):
    """Two versions of the camera "table", neither active."""
    task = {**clicks("ssl_2008_half"), "camera": "table", "model": "polynomial"}
    return [
        own_server.api("POST", "/calibrations", json={**task, "options": {"degree": degree}}).json()
        for degree in (1, 2)
    ]


def answer_until(page, is_done) -> None:
    """Answer what the page asks before an activation: with its first picture, a camera has one claim more."""
    anyway = page.get_by_test_id("activate-anyway")
    until(lambda: is_done() or (anyway.is_visible() and anyway.click()), bool, LONG_MS / 1000)


def activate(page, version: int) -> None:
    shelf = page.locator(f"[data-testid=shelf-version][data-version='{version}']")
    button = shelf.get_by_test_id("shelf-activate")
    button.click()
    answer_until(page, lambda: button.count() == 0)


def test_activate_undo_activate_leaves_one_notice(page, own_server, two_versions):
    page.goto(f"{own_server.url}/#/cameras/table/versions")
    notices = page.get_by_test_id("notice")
    for version in (1, 2):
        activate(page, version)
    # the first said it for a few seconds, and cannot be undone
    expect(notices).to_have_text(like("versions.activated", version=2), timeout=LONG_MS)
    notices.get_by_role("button", name=t("common.undo")).click()
    first = page.locator("[data-testid=shelf-version][data-version='1']")
    answer_until(page, lambda: first.get_attribute("data-active") == "true")
    expect(notices).to_have_count(1)
    expect(notices).to_have_text(like("versions.activated", version=1), timeout=LONG_MS)


def test_bell_status_bar_rail_and_system_page_count_the_same_problems(page, own_server):
    page.goto(f"{own_server.url}/#/system/server")  # no camera is calibrated yet
    expect(page.get_by_test_id("health-elsewhere")).to_be_visible(timeout=LONG_MS)
    expect(page.get_by_text(t("settings.health.good"), exact=True)).to_have_count(0)
    counts = page.evaluate(
        """(places) => {
          const at = (id) => document.querySelector(`[data-testid="${id}"]`),
            number = (node) => Number(node?.querySelector("span[aria-hidden]")?.textContent ?? 0);
          const more = /\\d+/.exec(at("status").querySelector("small")?.textContent ?? "0");
          return [
            document.querySelectorAll('[data-testid="problem"]').length,
            number(at("bell")),
            1 + Number(more[0]),
            places.reduce((sum, place) => sum + number(at(`dot-${place}`)), 0),
            Number(at("health").dataset.count),
          ];
        }""",
        PLACES,
    )
    assert len(set(counts)) == 1 and counts[0] > 0, counts
    levels = [page.get_by_test_id(it) for it in ("bell", "status", "dot-cameras")]
    assert [it.get_attribute("data-level") for it in levels] == ["warn"] * 3
