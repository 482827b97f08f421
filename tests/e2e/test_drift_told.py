"""A camera that is knocked: told on every page, registered anew by a button, used by another, and no longer told."""

import re

import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS, running
from tests.support.activation import activate_despite
from tests.support.live_cameras import calibrated
from tests.support.manual_pictures import manual_picture
from tests.support.waiting import until
from tests.support.words import like, t

ID = "knocked"
SOURCE = "sim://table?size=480x384&fps=10&robots=3"


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    """Of this file alone: what comes first here depends on which cameras are in trouble."""
    yield from running(tmp_path_factory.mktemp("data"))


@pytest.fixture
def followed(server):
    """A camera whose active calibration came from its own picture."""
    answer = server.api(
        "POST",
        "/cameras",
        json={"id": ID, "name": "Knocked", "source": SOURCE, "field": "table", "region": "full"},
    )
    assert answer.status_code == 201, answer.text
    taken = until(
        lambda: server.api("POST", "/snapshots", json={"camera": ID}), lambda answer: answer.ok
    )
    snapshot = taken.json()
    made = server.api(
        "POST",
        "/calibrations",
        json={
            "camera": ID,
            "snapshot": snapshot["id"],
            "field": "table",
            "region": "full",
            "model": "brown-conrady",
            "observations": [dict(o) for o in calibrated(SOURCE, "brown-conrady").observations],
        },
    ).json()
    activate_despite(server, made["id"])
    yield made["id"]
    server.api("DELETE", f"/cameras/{ID}")


def is_told(page, level: str) -> None:
    """Wherever the page is: by bell, status bar, rail and title. level: "bad", or "ok" where it stands well."""
    told = page.get_by_test_id("problem").filter(has_text="Knocked: The camera has moved")
    if level == "bad":
        expect(told).to_have_count(1, timeout=LONG_MS)
        expect(page.get_by_test_id("bell")).to_have_attribute("data-level", "bad")
        expect(page.get_by_test_id("status")).to_have_attribute("data-level", "bad")
        expect(page.get_by_test_id("dot-cameras")).to_have_attribute("data-level", "bad")
        expect(page).to_have_title(re.compile("^▲ "))
    else:
        expect(told).to_have_count(0, timeout=LONG_MS)
        expect(page).not_to_have_title(re.compile("Knocked: The camera has moved"))


def has_lines_as_chosen(page) -> None:
    """On the wall's picture, unless they are switched off, which this browser remembers."""
    lines = page.get_by_test_id(f"live-{ID}").locator(".field-lines")
    expect(lines).to_have_count(1, timeout=LONG_MS)
    page.get_by_test_id("do-wall-lines").click()
    expect(lines).to_have_count(0)
    page.reload()
    expect(page.get_by_test_id("do-wall-lines")).to_have_attribute("aria-pressed", "false")
    expect(page.get_by_test_id(f"live-{ID}")).to_have_attribute(
        "data-state", "live", timeout=LONG_MS
    )
    expect(lines).to_have_count(0)
    page.get_by_test_id("do-wall-lines").click()
    expect(lines).to_have_count(1, timeout=LONG_MS)


def is_first(page) -> None:
    tile = page.locator("[data-testid^=tile-]").first
    expect(tile).to_have_attribute("data-testid", f"tile-{ID}", timeout=LONG_MS)


def moves_only_while_the_operator_is_elsewhere(page, server) -> None:
    """A camera that is knocked goes to the front once neither pointer nor focus is in the wall."""
    tiles, tile = page.locator("[data-testid^=tile-]"), page.get_by_test_id(f"tile-{ID}")
    expect(tiles.last).to_have_attribute("data-testid", f"tile-{ID}")
    tile.hover()
    assert server.api("PATCH", f"/cameras/{ID}/controls", json={"controls": {"knock": 0}}).ok
    expect(tile).to_have_attribute("data-level", "bad", timeout=LONG_MS)
    expect(tiles.last).to_have_attribute("data-testid", f"tile-{ID}")
    page.get_by_test_id("fix-" + ID).focus()
    page.mouse.move(5, 5)
    expect(tiles.last).to_have_attribute("data-testid", f"tile-{ID}")
    page.get_by_test_id("bell").focus()
    is_first(page)


def is_shown(page) -> None:
    """Arrows on the picture, and the knock on the time line, by keys and in the table."""
    expect(page.get_by_test_id(f"live-{ID}").locator(".field-lines")).to_have_count(
        1, timeout=LONG_MS
    )
    arrows = page.get_by_test_id("drift-arrows")
    expect(arrows.locator("[data-level=fair], [data-level=poor]").first).to_be_attached(
        timeout=LONG_MS
    )
    expect(page.get_by_test_id("drift-legend")).to_contain_text(like("drift.arrows.scale"))
    plot, words = page.get_by_test_id("drift-plot"), page.get_by_test_id("drift-time-words")
    moved = "Knocked moved by"
    page.get_by_test_id("fold-drift").locator("summary").click()
    row = page.get_by_test_id("drift-table").get_by_role("row").filter(has_text=moved)
    expect(row).to_have_count(1, timeout=LONG_MS)
    plot.focus()
    for _ in range(20):  # from stop to stop
        if moved in (plot.get_attribute("aria-valuetext") or ""):
            break
        plot.press("ArrowRight")
    expect(plot).to_have_attribute("aria-valuetext", re.compile(moved))
    expect(words).to_contain_text(moved)
    page.get_by_test_id("fold-drift").locator("summary").click()


def test_a_knock_is_told_registered_anew_and_used_only_when_the_operator_says_so(
    operator, server, followed, tmp_path
):
    page = operator.page
    operator.visit()
    card = page.get_by_test_id(f"drift-{ID}")
    expect(card).to_contain_text("No movement detected", timeout=LONG_MS)
    is_told(page, "ok")
    has_lines_as_chosen(page)
    page.get_by_test_id("rail-system").click()
    assert server.api("PATCH", f"/cameras/{ID}/controls", json={"controls": {"knock": 4}}).ok
    is_told(page, "bad")  # though nobody looks at a camera
    page.screenshot(path=tmp_path / "elsewhere.png")
    page.get_by_test_id("rail-cameras").click()
    expect(page.get_by_test_id(f"tile-{ID}")).to_have_attribute("data-level", "bad")
    expect(page.get_by_test_id(f"tile-{ID}")).to_contain_text(like("live.wall.off"))
    is_first(page)
    fix = t("shell.next.fix-camera", camera="Knocked")
    # before any camera is calibrated that is not yet
    expect(page.get_by_test_id("next")).to_have_text(fix)
    page.screenshot(path=tmp_path / "wall.png")
    page.get_by_test_id("next").click()
    expect(page).to_have_url(re.compile(f"#/cameras/{ID}/drift$"))
    page.get_by_test_id("rail-cameras").click()
    page.get_by_test_id("bell").click()
    page.get_by_test_id("problem").filter(has_text="Knocked").get_by_role("link").click()
    drift = page.get_by_test_id("drift")
    expect(drift).to_have_attribute("data-state", "knocked", timeout=LONG_MS)
    is_shown(page)
    expect(page.get_by_test_id("problems")).to_be_hidden()
    expect(page.get_by_test_id("next")).to_have_text(t("drift.reregister"))
    page.get_by_test_id("next").click()
    made = page.get_by_test_id("registered")
    expect(made).to_contain_text(t("drift.registered", version=2), timeout=LONG_MS)
    expect(made).to_contain_text(like("drift.registered.apart"), timeout=LONG_MS)
    expect(page.get_by_test_id("next")).to_have_text(t("common.activate-version", version=2))
    assert server.api("GET", f"/cameras/{ID}").json()["active_calibration"] == followed
    made.scroll_into_view_if_needed()
    page.get_by_role("heading", level=1).scroll_into_view_if_needed()
    page.set_viewport_size({"width": 960, "height": 1490})  # with the displacement over time
    manual_picture(page, "drift")
    page.get_by_test_id("look-at-registered").click()
    newest = server.api("GET", f"/calibrations?camera={ID}").json()["items"][0]["id"]
    expect(page.get_by_test_id("report")).to_have_attribute(
        "href", re.compile(newest), timeout=LONG_MS
    )
    is_told(page, "bad")
    # what is shown is what the version was made of
    expect(page.get_by_test_id("next")).to_contain_text(
        t("common.activate-version", version=2), timeout=LONG_MS
    )
    page.screenshot(path=tmp_path / "looked_at.png")
    page.goto(f"{server.url}/#/cameras/{ID}/versions")
    newest = page.get_by_test_id("version-change").first
    newest.locator("img").evaluate("picture => picture.decode()")
    assert newest.locator("img").evaluate("picture => picture.naturalWidth") == 192
    expect(newest.locator(".map [data-level=poor]").first).to_be_attached(timeout=LONG_MS)
    page.goto(f"{server.url}/#/cameras/{ID}/drift")
    page.get_by_test_id("use-registered").click()
    expect(drift).to_have_attribute("data-state", "steady", timeout=LONG_MS)
    expect(page.get_by_test_id("drift-alarm")).to_have_count(0, timeout=LONG_MS)
    assert server.api("GET", f"/cameras/{ID}").json()["active_calibration"] != followed
    is_told(page, "ok")
    page.get_by_test_id("rail-cameras").click()
    expect(page.get_by_test_id(f"tile-{ID}")).to_have_attribute("data-level", "ok")
    expect(page.get_by_test_id("events")).to_contain_text("Knocked moved by")
    moves_only_while_the_operator_is_elsewhere(page, server)
