"""Points matched in two cameras of a rig, by the page: marked in both images, kept, and checked with the rig."""

import json
import re

import numpy as np
import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.activation import activate_despite
from tests.support.manual_pictures import manual_picture
from tests.support.pair_pictures import FIELD, REGION, TILTS, calibration_body, pair_seen
from tests.support.waiting import until
from tests.support.words import like, t

WEST, EAST = CAMERAS = ("match-west", "match-east")
RIG = f"{WEST}-{EAST}"  # as it is called that is made on the spot
SOURCE = f"sim://ssl-div-b?region={REGION}&tilt={{}}&lens=half&robots=12&seed=3&fps=5"
# Where a picture's corner is on the screen, and how large one of its pixels is there.
WHERE = """picture => {
  const { left, top, width } = picture.getBoundingClientRect();
  return [[left, top], width / picture.naturalWidth];
}"""


class Desk:
    """What an operator does at two images."""

    def __init__(self, page, server):
        self.page, self.server = page, server

    def at(self, address):
        self.page.goto(f"{self.server.url}/#{address}")
        return self.wait_for_pictures()

    def wait_for_pictures(self):
        for side in "ab":
            expect(self.page.get_by_test_id(f"picture-{side}")).to_be_visible(timeout=LONG_MS)
            self.page.get_by_test_id(f"picture-{side}").evaluate("picture => picture.decode()")
        return self

    def spot(self, side, point):
        corner, scale = self.page.get_by_test_id(f"picture-{side}").evaluate(WHERE)
        return tuple(start + (v + 0.5) * scale for start, v in zip(corner, point, strict=True))

    def click(self, side, point):
        self.page.mouse.click(*self.spot(side, point))

    def keep(self, pictures, seen, which):
        """As if matched in two images by a former version of the page, in this browser."""
        matches = [
            {
                "a": seen.a[i].round(2).tolist(),
                "b": seen.b[i].round(2).tolist(),
                "z_mm": seen.z_mm[i],
            }
            for i in which
        ]
        self.page.evaluate(
            "([name, text]) => localStorage.setItem(name, text)",
            [
                "touchline.pair." + ".".join(pictures),
                json.dumps({"matches": matches, "calibrations": {}}),
            ],
        )

    def kept(self):
        """The matches as this browser keeps them."""
        return self.page.evaluate(
            """name => {
          const { a, b } = JSON.parse(localStorage.getItem(name));
          return JSON.parse(localStorage.getItem(`touchline.pair.${a}.${b}`)).matches;
        }""",
            f"touchline.rig.{RIG}.{WEST}.{EAST}",
        )

    def check(self):
        """Check the rig; return what REST answers of these matches."""
        self.page.get_by_test_id("next").click()
        report = self.page.get_by_test_id("match-report")
        expect(report).to_have_attribute("data-stale", "false", timeout=LONG_MS)
        verdict = self.server.api("GET", f"/rigs/{RIG}").json()["checked"]["verdict"]["sentence"]
        largest = verdict.partition("Largest difference: ")[2]
        assert "differ by" in largest
        expect(report).to_contain_text(largest)
        complete = [m for m in self.kept() if m["a"] and m["b"]]
        body = {
            "a": WEST,
            "b": EAST,
            "z_mm": [m["z_mm"] for m in complete],
            **{f"points_{side}": [m[side] for m in complete] for side in "ab"},
        }
        asked = {"pictures": "none", "matches": [body]}
        return self.server.api("POST", f"/rigs/{RIG}/check", json=asked).json()["pairs"][0][
            "matches"
        ]


@pytest.fixture(scope="module")
def seen():
    return pair_seen()


@pytest.fixture(scope="module")
def cameras(server, seen):
    """Two live cameras over one half of a field, calibrated; the ids of an image from each."""
    images = []
    for number, (id, tilt) in enumerate(zip(CAMERAS, TILTS, strict=True)):
        added = server.api(
            "POST",
            "/cameras",
            json={
                "id": id,
                "name": id.title(),
                "source": SOURCE.format(tilt),
                "field": FIELD.name,
                "region": REGION,
            },
        )
        assert added.ok, added.text
        images.append(
            server.api(
                "POST", "/snapshots", data={"camera": id}, files={"file": seen.pictures[number]}
            ).json()["id"]
        )
        body = {**calibration_body(number, images[-1]), "camera": id}
        activate_despite(server, server.api("POST", "/calibrations", json=body).json()["id"])
    for id in CAMERAS:  # an image is taken once, of those that are awake
        until(
            lambda id=id: server.api("GET", f"/cameras/{id}/status").json()["state"],
            lambda s: s == "live",
            120,
        )
    yield images
    for id in CAMERAS:
        server.api("DELETE", f"/cameras/{id}")


@pytest.fixture
def desk(operator, server, cameras):
    """Nowhere yet, and without a rig."""
    operator.page.set_viewport_size({"width": 1500, "height": 900})
    yield Desk(operator.page, server)
    server.api("DELETE", f"/rigs/{RIG}")


@pytest.fixture
def rig(server, desk):
    body = {"title": "Hall", "field": FIELD.name, "cameras": list(CAMERAS)}
    assert server.api("PUT", f"/rigs/{RIG}", json=body).status_code == 201
    return RIG


def test_points_are_matched_from_the_rigs_page_and_a_reload_and_undo_lose_none(desk, rig, seen):
    page = desk.page
    page.goto(f"{desk.server.url}/#/field/rigs/{rig}")
    page.get_by_test_id(f"door-{WEST}-{EAST}").click()
    desk.wait_for_pictures()  # taken now
    expect(page).to_have_url(re.compile(f"#/field/rigs/{rig}/{WEST}/{EAST}$"))
    desk.click("a", seen.a[4])
    expect(page.get_by_test_id("sentence")).to_have_text(t("rig.match.step.click.b", point=1))
    foretold = page.get_by_test_id("foretold-b")
    expect(foretold).to_contain_text(t("rig.match.foretold.carpet"))
    x, y = map(float, re.findall(r"[\d.]+", foretold.get_attribute("transform")))
    box = page.get_by_test_id("half-b").bounding_box()
    assert np.allclose((box["x"] + x, box["y"] + y), desk.spot("b", seen.b[4]), atol=3)
    expect(page.get_by_test_id("epipolar-b")).to_be_attached()
    desk.click("b", seen.b[4])
    by_keyboard(desk)
    expect(page.get_by_test_id("kept")).to_have_text(t("shell.saved.in-browser"))
    before = desk.kept()
    assert np.allclose(before[0]["b"], seen.b[4], atol=2) and before[2]["b"] is None
    page.reload()
    desk.wait_for_pictures()
    expect(page.get_by_test_id("mark-a-3")).to_have_attribute("data-waits", "true")
    assert desk.kept() == before
    page.get_by_test_id("do-take-match-images").click()
    expect(page.get_by_test_id("matches").locator("li")).to_have_count(0, timeout=LONG_MS)
    page.get_by_test_id("do-undo").click()  # the images before, with their matches
    expect(page.get_by_test_id("matches").locator("li")).to_have_count(3)
    assert desk.wait_for_pictures().kept() == before
    page.get_by_test_id("to-rig").click()
    expect(page.get_by_test_id(f"pair-{WEST}-{EAST}")).to_contain_text(
        t("rig.match.count", count=2)
    )


def by_keyboard(desk):
    """A second match and half of a third; the second moved, removed and brought back."""
    page = desk.page
    page.mouse.move(0, 0)  # else it is under the mouse
    page.get_by_test_id("half-a").focus()
    page.keyboard.press("a")
    expect(page.get_by_test_id("half-b")).to_be_focused()
    page.keyboard.press("a")
    expect(page.get_by_test_id("mark-b-2")).to_have_attribute("data-waits", "false")
    x, y = desk.kept()[1]["b"]
    for key in ("ArrowRight", "Shift+ArrowUp", "Control+ArrowDown"):
        page.keyboard.press(key)
    assert desk.kept()[1]["b"] == [
        pytest.approx(x + 0.1, abs=0.011),
        pytest.approx(y + 9, abs=0.011),
    ]
    page.keyboard.press("Delete")
    expect(page.get_by_test_id("mark-a-2")).to_have_count(0)
    page.keyboard.press("Control+z")
    expect(page.get_by_test_id("mark-a-2")).to_have_count(1)
    page.keyboard.press("Escape")
    page.get_by_test_id("half-a").focus()
    page.keyboard.press("a")
    expect(page.get_by_test_id("mark-a-3")).to_have_attribute("data-waits", "true")


def test_a_former_address_leads_to_a_rig_made_for_it_and_the_check_names_an_outlier(
    desk, seen, cameras
):
    page, west_east = desk.page, "/".join(cameras)
    desk.keep(cameras, seen, range(24))
    desk.at(f"/field/pairs/{west_east}")
    expect(page).to_have_url(re.compile(f"#/field/rigs/{RIG}/{WEST}/{EAST}$"))
    made = desk.server.api("GET", f"/rigs/{RIG}").json()
    assert [made["field"], *(c["camera"] for c in made["cameras"])] == [FIELD.name, WEST, EAST]
    expect(page.get_by_test_id("matches").locator("li")).to_have_count(24)
    page.mouse.move(*desk.spot("b", seen.b[19]))
    page.mouse.down()
    page.mouse.move(*desk.spot("b", seen.b[19] + [40, -90]), steps=5)
    page.mouse.up()
    told = desk.check()
    assert told["fundamental"]["outliers"] == [19]
    wrong = page.get_by_test_id("match-20")
    expect(wrong).to_contain_text(t("rig.match.outlier"))
    expect(wrong).to_contain_text(f"{told['calibrated']['epipolar_px'][19]:.2f} px")
    page.get_by_test_id("do-worst-match").click()
    expect(page.get_by_test_id("mark-b-20")).to_have_attribute("data-chosen", "true")
    expect(page.get_by_test_id("mark-b-20")).to_contain_text(like("rig.match.mark.off"))
    page.keyboard.press("Delete")
    expect(page.get_by_test_id("match-report")).to_have_attribute("data-stale", "true")
    told = desk.check()
    assert told["fundamental"]["outliers"] == [] and told["agreement"]["verdict"]["level"] == "good"
    expect(page.get_by_test_id("match-1")).to_contain_text(
        f"{told['calibrated']['epipolar_px'][0]:.2f} px"
    )
    expect(page.get_by_test_id("match-1")).to_contain_text(
        f"{told['agreement']['apart_mm'][0]:.1f} mm"
    )
    page.get_by_test_id("match-14").get_by_role("button").first.click()
    expect(page.get_by_test_id("foretold-b")).to_contain_text(
        t("rig.match.foretold.up", height=150)
    )
    manual_picture(page, "matched-points")
    desk.at(f"/pair/{'/'.join(reversed(cameras))}")  # the same rig, the same matches
    expect(page).to_have_url(re.compile(f"#/field/rigs/{RIG}/{WEST}/{EAST}$"))
    expect(page.get_by_test_id("matches").locator("li")).to_have_count(23)


@pytest.mark.long
def test_former_images_that_no_rig_can_have_say_what_to_do(desk, seen, cameras):
    uploaded = desk.server.api("POST", "/snapshots", files={"file": seen.pictures[0]}).json()["id"]
    again = desk.server.api(
        "POST", "/snapshots", data={"camera": WEST}, files={"file": seen.pictures[0]}
    ).json()["id"]
    for pictures, why in (
        ((uploaded, cameras[1]), "no-camera"),
        ((cameras[0], again), "one-camera"),
    ):
        desk.page.goto(f"{desk.server.url}/#/field/pairs/{'/'.join(pictures)}")
        expect(desk.page.get_by_test_id("field-page")).to_be_visible(timeout=LONG_MS)
        expect(desk.page.get_by_test_id("notice").last).to_contain_text(t(f"rig.former.{why}"))
        expect(desk.page.get_by_test_id("notice").last).to_contain_text(t(f"rig.former.{why}.fix"))
    assert desk.server.api("GET", f"/rigs/{RIG}").status_code == 404


@pytest.mark.long
def test_fingers_tap_matches_and_a_second_tab_follows(browser, desk, rig, server, seen):
    context = browser.new_context(
        viewport={"width": 900, "height": 1200}, has_touch=True, color_scheme="dark"
    )
    page, second = context.new_page(), context.new_page()
    first = Desk(page, server).at(f"/field/rigs/{rig}/{EAST}/{WEST}")
    Desk(second, server).at(f"/field/rigs/{rig}/{WEST}/{EAST}")
    for side in "ab":
        page.touchscreen.tap(*first.spot(side, getattr(seen, side)[1]))
    expect(page.get_by_test_id("mark-b-1")).to_have_attribute("data-waits", "false")
    assert np.allclose(first.kept()[0]["b"], seen.b[1], atol=3)
    expect(second.get_by_test_id("mark-b-1")).to_have_attribute("data-waits", "false")
    context.close()


@pytest.mark.long
@pytest.mark.parametrize(
    "scheme, width, height",
    [("dark", 1440, 900), ("light", 1024, 768), ("dark", 390, 844), ("light", 390, 844)],
)
def test_it_fits_every_screen_in_both_themes(desk, cameras, seen, tmp_path, scheme, width, height):
    page = desk.page
    desk.keep(cameras, seen, [*range(0, 12, 2), *range(12, 22)])
    page.emulate_media(color_scheme=scheme)
    page.set_viewport_size({"width": width, "height": height})
    desk.at(f"/field/pairs/{'/'.join(cameras)}")
    page.screenshot(path=tmp_path / "before.png")
    desk.check()
    page.get_by_test_id("match-14").get_by_role("button").first.click()
    expect(page.get_by_test_id("epipolar-b")).to_be_attached()
    overflowing = page.evaluate("""[document.documentElement,
        ...document.querySelectorAll('#app, aside, .match-desk, .halves, header')]
        .filter(e => e.scrollWidth > e.clientWidth + 1).map(e => e.className || e.tagName)""")
    assert overflowing == []
    for name in ("match-desk", "matches", "match-report"):
        page.get_by_test_id(name).scroll_into_view_if_needed()
        page.screenshot(path=tmp_path / f"{name}.png")
