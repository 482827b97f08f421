"""The five places of the rail, each with something done there, by the keyboard alone and by a finger."""

import re
from types import MappingProxyType

import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.pictures import encoded, gradient
from tests.support.waiting import until
from tests.support.words import like, t

MOST_JUMP_PX = 20  # the height of a card follows from what it says
MOST_TABS = 80  # more than any page has before what is looked for
FOCUSED = "(id) => document.activeElement.dataset.testid === id"
RING_PX = "parseFloat(getComputedStyle(document.activeElement).outlineWidth)"


class Keyboard:
    """Who has no pointer: to a control by Tab, which must be seen to be there, and Enter."""

    screen = MappingProxyType({"viewport": {"width": 1280, "height": 800}})

    def __init__(self, page):
        self.page = page

    def to(self, name: str) -> None:
        expect(self.page.get_by_test_id(name)).to_be_visible(timeout=LONG_MS)
        for _ in range(MOST_TABS):
            if self.page.evaluate(FOCUSED, name):
                assert self.page.evaluate(RING_PX) >= 2, f"nothing shows that {name} has the focus"
                return
            self.page.keyboard.press("Tab")
        raise AssertionError(f"{name} is not reached by {MOST_TABS} times Tab")

    def press(self, name: str) -> None:
        self.to(name)
        self.page.keyboard.press("Enter")

    def choose(self, name: str, value: str) -> None:
        self.to(name)
        self.page.keyboard.type(value)


class Finger:
    """Who holds a telephone: what is tapped is in sight, large enough, and under nothing else."""

    screen = MappingProxyType(
        {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
    )

    def __init__(self, page):
        self.page = page

    def press(self, name: str) -> None:
        control = self.page.get_by_test_id(name)
        expect(control).to_be_visible(timeout=LONG_MS)
        control.scroll_into_view_if_needed()
        box = control.bounding_box()
        # WCAG 2.5.8
        assert min(box["width"], box["height"]) >= 24, (
            f"{name} is {box['width']} × {box['height']} px"
        )
        control.tap()

    def choose(self, name: str, value: str) -> None:
        self.page.get_by_test_id(name).select_option(label=value)


@pytest.fixture(params=[Keyboard, Finger], ids=["keyboard", "finger"])
def way(request, browser, server):
    context = browser.new_context(**request.param.screen)
    page = context.new_page()
    page.goto(server.url)
    yield request.param(page)
    context.close()


def test_in_each_place_of_the_rail_something_is_done(way, server):
    page = way.page
    way.press("rail-cameras")
    way.press("look-at-overhead")
    expect(page.get_by_test_id("live-desk")).to_be_visible(timeout=LONG_MS)
    for tab, shown in (
        ("camera-images", "camera-images-page"),
        ("drift", "drift-page"),
        ("versions", "versions-page"),
    ):
        way.press(f"tab-{tab}")
        expect(page.get_by_test_id(shown)).to_be_visible(timeout=LONG_MS)
        expect(page.get_by_test_id(f"tab-{tab}")).to_have_attribute("aria-current", "page")
    way.press("step-camera")
    expect(page.get_by_test_id("tile-overhead")).to_be_visible()

    way.press("rail-field")
    way.press("do-new-rig")
    expect(page.get_by_test_id("new-rig-page")).to_be_visible(timeout=LONG_MS)
    expect(page.get_by_test_id("next")).not_to_be_empty()

    way.press("rail-lenses")
    way.press("tab-edges")
    expect(page.get_by_test_id("straight-desk")).to_be_visible(timeout=LONG_MS)

    taken = until(
        lambda: server.api("POST", "/snapshots", json={"camera": "overhead"}),
        lambda answer: answer.ok,
    )
    page.reload()  # the list of images is the page's own
    picture = taken.json()["id"]
    way.press("rail-library")
    way.press(f"recent-{picture}")
    expect(page).to_have_url(re.compile(f"#/calibrate/{picture}/"))
    expect(page.get_by_test_id("picture")).to_be_visible(timeout=LONG_MS)

    way.press("rail-system")
    way.press("tab-jobs")
    expect(page.get_by_test_id("jobs-page")).to_be_visible(timeout=LONG_MS)
    way.choose("theme", t("core.theme.dark"))
    expect(page.locator("html")).to_have_attribute("data-theme", "dark")


def test_a_picture_from_a_file_has_its_name_wherever_it_is_listed(page, server):
    page.goto(server.url)
    picture = {
        "name": "Halle Süd.png",
        "mimeType": "image/png",
        "buffer": encoded("png", gradient(64, 48)),
    }
    page.get_by_test_id("file").set_input_files(picture)
    expect(page.locator("header .where")).to_contain_text("Halle Süd.png", timeout=LONG_MS)
    page.get_by_test_id("rail-library").click()
    expect(page.get_by_test_id("images-page")).to_contain_text("Halle Süd.png", timeout=LONG_MS)


def test_a_camera_has_its_place_on_the_wall_before_it_is_listed(page, server):
    held = []
    page.route("**/api/v1/cameras", lambda route: held.append(route))
    page.goto(server.url)
    places = page.locator(".cards .waits")
    expect(places).to_have_count(3)
    before = places.first.bounding_box()
    for route in held:
        route.continue_()
    page.unroute("**/api/v1/cameras")
    tile = page.locator("[data-testid^=tile-]").first
    expect(tile).to_be_visible(timeout=LONG_MS)
    expect(places).to_have_count(0)
    after = tile.bounding_box()
    assert [before[it] for it in ("x", "y", "width")] == [after[it] for it in ("x", "y", "width")]
    assert abs(before["height"] - after["height"]) < MOST_JUMP_PX, (before, after)


def test_no_door_opens_on_an_empty_room(page, own_server):
    """Before anything is calibrated."""
    server, asked = own_server, []
    page.on("request", lambda sent: sent.url.endswith("/rigs") and asked.append(sent.url))
    page.goto(f"{server.url}/#/field/scene")
    expect(page.get_by_test_id("next")).to_have_text(
        like("common.calibrate-camera"), timeout=LONG_MS
    )
    expect(page.locator("aside")).to_have_count(0)
    assert len(asked) == 1
    page.goto(f"{server.url}/#/lenses")
    ways = page.get_by_test_id("lens-ways")
    expect(ways.locator("li")).to_have_count(3)
    expect(ways).to_contain_text(t("board.lenses.by-edges"))
    page.goto(f"{server.url}/#/field")
    card = page.get_by_test_id("field-card-ssl-div-b")
    expect(card.get_by_test_id("over-overhead")).to_be_visible()
    page.goto(f"{server.url}/#/cameras/overhead/settings")
    settings = page.get_by_test_id("camera-settings")
    expect(settings).to_contain_text("sim://")
    expect(settings.get_by_test_id("live-overhead")).to_have_attribute(
        "data-state", "live", timeout=LONG_MS
    )
