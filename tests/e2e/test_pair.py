"""Two cameras, by the page: the same things clicked in two pictures, and whether the cameras agree about them."""

import json
import re

import cv2
import numpy as np
import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.activation import activate_despite
from tests.support.held_requests import holding, wait_until_held
from tests.support.manual_pictures import manual_picture
from tests.support.pair_pictures import calibration_body, pair_seen
from tests.support.waiting import until
from tests.support.words import like, t

NUMBER = re.compile(r"[\d.]+")
# Where a picture's corner is on the screen, and how large one of its pixels is there.
WHERE = """picture => {
  const { left, top, width } = picture.getBoundingClientRect();
  return [[left, top], width / picture.naturalWidth];
}"""


class Desk:
    """What an operator does at two pictures."""

    def __init__(self, page, server):
        self.page, self.server = page, server

    def at(self, pictures):
        """Before two pictures, by their address."""
        ids = [self.server.api("POST", "/snapshots", files={"file": picture}).json()["id"] for picture in pictures]
        self.page.goto(f"{self.server.url}/#/field/pairs/{'/'.join(ids)}")
        self.wait_for_pictures()
        return self

    def open(self, pictures):
        """The same by hand."""
        self.page.get_by_test_id("rail-field").click()
        self.page.get_by_test_id("do-pair").click()
        expect(self.page.get_by_test_id("choice-a")).to_be_visible()
        self.page.get_by_test_id("file").set_input_files(
            [{"name": f"{i}.png", "mimeType": "image/png", "buffer": picture} for i, picture in enumerate(pictures)])
        self.wait_for_pictures()
        return self

    def wait_for_pictures(self):
        for side in "ab":
            expect(self.page.get_by_test_id(f"picture-{side}")).to_be_visible(timeout=LONG_MS)
            self.page.get_by_test_id(f"picture-{side}").evaluate("picture => picture.decode()")

    @property
    def ids(self):
        address = re.compile(r"#/field/pairs/(\w+)/(\w+)")
        expect(self.page).to_have_url(address)
        return address.search(self.page.url).groups()

    def spot(self, side, point):
        corner, scale = self.page.get_by_test_id(f"picture-{side}").evaluate(WHERE)
        return tuple(start + (v + 0.5) * scale for start, v in zip(corner, point, strict=True))

    def click(self, side, point):
        self.page.mouse.click(*self.spot(side, point))

    def match(self, a, b, z_mm=None):
        """The same thing, left, then right."""
        if z_mm is not None:
            self.height(z_mm)
        self.click("a", a)
        self.click("b", b)

    def height(self, z_mm):
        self.page.get_by_test_id("next-height").fill(f"{z_mm:g}")
        self.page.get_by_test_id("next-height").press("Tab")

    def match_all(self, seen, which):
        height = None
        for i in which:
            new = seen.z_mm[i] if seen.z_mm[i] != height else None
            self.match(seen.a[i], seen.b[i], new)
            height = seen.z_mm[i]
        expect(self.page.get_by_test_id("matches").locator("li")).to_have_count(len(which))

    def load(self, seen, which):
        """As if clicked before, in this browser; test_things_clicked… does it by hand."""
        matches = [{"a": seen.a[i].round(2).tolist(), "b": seen.b[i].round(2).tolist(), "z_mm": seen.z_mm[i]}
                   for i in which]
        self.page.evaluate("([name, text]) => localStorage.setItem(name, text)", [
            "touchline.pair." + ".".join(self.ids), json.dumps({"matches": matches})])
        self.page.reload()
        self.wait_for_pictures()
        expect(self.page.get_by_test_id("matches").locator("li")).to_have_count(len(which))

    def kept(self):
        """The document as this browser keeps it."""
        a, b = self.ids
        return self.page.evaluate("name => JSON.parse(localStorage.getItem(name))", f"touchline.pair.{a}.{b}")

    def asked(self):
        """What the page should have asked, answered by REST."""
        matches = self.kept()["matches"]
        body = {f"points_{side}": [m[side] for m in matches] for side in "ab"}
        chosen = {f"calibration_{side}": self.page.get_by_test_id(f"calibration-{side}").input_value() for side in "ab"}
        answer = self.server.api("POST", "/pairs", json={**body, "z_mm": [m["z_mm"] for m in matches],
                                                         **(chosen if all(chosen.values()) else {})})
        assert answer.ok, answer.text
        return answer.json()

    def settled(self):
        """Until the newest answer stands there."""
        expect(self.page.get_by_test_id("pair-report")).to_have_attribute("data-stale", "false", timeout=LONG_MS)
        return self.asked()

    def line(self, side):
        """The epipolar line that is drawn in a picture, (n, 2) px."""
        path = self.page.get_by_test_id(f"epipolar-{side}").locator("path").last.get_attribute("d")
        return np.array([[float(v) for v in part.split()] for part in re.split("[ML]", path) if part])

    def calibrate(self, which, shifted_px=0.0):
        made = self.server.api("POST", "/calibrations", json=calibration_body(which, self.ids[which], shifted_px))
        assert made.ok, made.text
        return made.json()["id"]


def away(point, line):
    step = np.diff(line, axis=0)
    share = np.clip(np.sum((point - line[:-1]) * step, axis=1) / np.sum(step**2, axis=1), 0, 1)
    return float(np.linalg.norm(point - line[:-1] - share[:, None] * step, axis=1).min())


@pytest.fixture
def seen():
    return pair_seen()


@pytest.fixture
def desk(operator, server, seen):
    """At the two simulated pictures, nothing clicked."""
    operator.page.set_viewport_size({"width": 1500, "height": 900})
    return Desk(operator.page, server).at(seen.pictures)


@pytest.fixture
def matched(desk, seen):
    """Twelve marks on the carpet and twelve hats in both."""
    desk.load(seen, range(24))
    return desk


@pytest.mark.long
def test_things_clicked_in_both_pictures_tell_the_geometry_and_its_lines(desk, seen, tmp_path):
    desk.match_all(seen, range(24))
    matched, page, told = desk, desk.page, desk.settled()
    assert told["fundamental"]["outliers"] == [] and told["fundamental"]["rms_px"] < 1
    expect(page.get_by_test_id("fundamental")).to_contain_text(
        f"{told['fundamental']['rms_px']:.2f} {t('pair.epipolar.rms')}")
    expect(page.get_by_test_id("fundamental")).to_contain_text(told["fundamental"]["verdict"]["sentence"])
    expect(page.get_by_test_id("match-24")).to_contain_text(f"{told['fundamental']['epipolar_px'][23]:.2f} px")
    page.mouse.move(*matched.spot("a", seen.a[14]))
    expect(page.get_by_test_id("epipolar-b")).to_have_attribute("data-by", "matches")
    expect(page.get_by_test_id("mark-b-15")).to_contain_text(like("pair.mark.off"))
    matrix = np.array(told["fundamental"]["matrix"])
    line = matched.line("b")
    kept = matched.kept()["matches"][14]
    a, b, c = matrix @ [*kept["a"], 1]
    assert np.abs(line @ [a, b] + c).max() / np.hypot(a, b) < 0.01
    assert away(np.array(kept["b"]), line) < 3
    page.screenshot(path=tmp_path / "matched.png")


def test_matches_are_made_by_keyboard_and_a_mistake_is_named_removed_and_brought_back(operator, server, seen, tmp_path):
    operator.page.set_viewport_size({"width": 1500, "height": 900})
    desk = Desk(operator.page, server).open(seen.pictures)
    all_by_keyboard(desk)
    desk.match(seen.a[0], seen.b[0])
    matches = desk.page.get_by_test_id("matches").locator("li")
    for count in (2, 1, 0):  # the last one removed leaves the one before chosen
        expect(matches).to_have_count(count)
        desk.page.keyboard.press("Delete")
    desk.load(seen, range(24))
    a_mistake(desk, seen, tmp_path)


def all_by_keyboard(desk):
    page = desk.page
    page.get_by_test_id("half-a").focus()
    page.keyboard.press("a")
    expect(page.get_by_test_id("half-b")).to_be_focused()
    page.keyboard.press("a")
    expect(page.get_by_test_id("mark-b-1")).to_have_attribute("data-waits", "false")
    x, y = desk.kept()["matches"][0]["b"]
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Shift+ArrowUp")
    page.keyboard.press("Control+ArrowDown")
    assert desk.kept()["matches"][0]["b"] == [pytest.approx(x + 0.1, abs=0.011), pytest.approx(y + 9, abs=0.011)]
    page.keyboard.press("Delete")
    expect(page.get_by_test_id("mark-a-1")).to_have_count(0)
    page.keyboard.press("Control+z")
    expect(page.get_by_test_id("mark-a-1")).to_have_count(1)
    before = page.get_by_test_id("read-out-b").inner_text()
    page.keyboard.press("+")
    expect(page.get_by_test_id("read-out-b")).not_to_have_text(before)
    page.keyboard.press("0")
    until(page.get_by_test_id("read-out-b").inner_text, lambda now: now == before)


def a_mistake(matched, seen, tmp_path):
    """Named, coloured, removed and brought back."""
    page = matched.page
    matched.settled()
    page.mouse.move(*matched.spot("b", seen.b[19]))
    page.mouse.down()
    page.mouse.move(*matched.spot("b", seen.b[19] + [40, -90]), steps=5)
    page.mouse.up()
    expect(page.get_by_test_id("mark-b-20")).to_have_attribute("data-mistake", "true", timeout=LONG_MS)
    told = matched.settled()
    assert told["fundamental"]["outliers"] == [19]
    expect(page.get_by_test_id("fundamental")).to_contain_text("Match 20 does not.")
    expect(page.get_by_test_id("mistakes")).to_contain_text(
        t("pair.epipolar.mistake", match=20, error=f"{told['fundamental']['epipolar_px'][19]:.1f}"))
    page.get_by_test_id("next").click()
    expect(page.get_by_test_id("mark-a-20")).to_have_attribute("data-chosen", "true")
    page.screenshot(path=tmp_path / "mistake.png")
    page.get_by_test_id("drop-20").click()
    expect(page.get_by_test_id("matches").locator("li")).to_have_count(23)
    expect(page.get_by_test_id("mistakes")).to_have_count(0, timeout=LONG_MS)
    page.get_by_test_id("half-a").focus()
    page.keyboard.press("Control+z")
    expect(page.get_by_test_id("mark-b-20")).to_have_attribute("data-mistake", "true", timeout=LONG_MS)
    page.keyboard.press("Control+z")
    expect(page.get_by_test_id("mark-b-20")).to_have_attribute("data-mistake", "false", timeout=LONG_MS)
    assert np.allclose(matched.kept()["matches"][19]["b"], seen.b[19], atol=2)


@pytest.mark.long
def test_two_calibrations_agree_in_millimetres_and_a_moved_camera_is_found(matched, seen, tmp_path):
    page = matched.page
    good = [matched.calibrate(which) for which in (0, 1)]
    moved = matched.calibrate(1, shifted_px=25.0)
    page.reload()
    matched.wait_for_pictures()
    expect(page.get_by_test_id("calibration-a")).to_have_value(good[0])
    expect(page.get_by_text(t("pair.calibration.proposed-made"))).to_have_count(2)
    page.get_by_test_id("calibration-b").select_option(good[1])
    expect(page.get_by_test_id("agreement")).to_have_attribute("data-level", "good", timeout=LONG_MS)
    told = matched.settled()
    agreed = told["agreement"]
    assert agreed["from"] == "matches" and agreed["n"] == 24
    expect(page.get_by_test_id("agreement")).to_contain_text(f"{agreed['median_mm']:.1f} {t('pair.agreement.median')}")
    expect(page.get_by_test_id("agreement")).to_contain_text(agreed["verdict"]["sentence"])
    distance = int(re.sub(r"\D", "", page.get_by_test_id("baseline").inner_text()))
    assert distance == pytest.approx(told["calibrated"]["distance_mm"], abs=1) and distance > 2000
    expect(page.get_by_test_id("pose")).to_contain_text(f"{told['pose']['angle_deg']:.2f}°")
    expect(page.get_by_test_id("match-1")).to_contain_text("mm")

    page.get_by_test_id("lines-by").select_option("calibrations")
    page.get_by_test_id("match-14").get_by_role("button").first.click()
    expect(page.get_by_test_id("epipolar-b")).to_have_attribute("data-by", "calibrations")
    assert away(seen.b[13], matched.line("b")) < 3 and away(seen.a[13], matched.line("a")) < 3
    assert len(matched.line("b")) > 10  # bent as the lens bends
    expect(page.get_by_test_id("foretold-b")).to_contain_text(t("pair.foretold.up", height=150))
    manual_picture(page, "two-cameras")

    page.get_by_test_id("calibration-b").select_option(moved)
    expect(page.get_by_test_id("agreement")).to_have_attribute("data-level", "poor", timeout=LONG_MS)
    worse = matched.settled()
    expect(page.get_by_test_id("agreement")).to_contain_text(worse["agreement"]["verdict"]["fix"])
    assert worse["agreement"]["median_mm"] > 50
    page.screenshot(path=tmp_path / "moved.png")
    page.get_by_test_id("half-a").focus()
    page.keyboard.press("Control+z")
    expect(page.get_by_test_id("calibration-b")).to_have_value(good[1])


@pytest.mark.long
def test_calibrations_alone_foretell_where_to_click_before_the_first_match(desk, seen):
    for which in (0, 1):
        desk.calibrate(which)
    desk.page.reload()
    desk.wait_for_pictures()
    expect(desk.page.get_by_test_id("agreement")).to_contain_text(t("pair.agreement.places"), timeout=LONG_MS)
    desk.click("a", seen.a[4])
    foretold = desk.page.get_by_test_id("foretold-b")
    expect(foretold).to_contain_text(t("pair.foretold.carpet"))
    x, y = map(float, NUMBER.findall(foretold.get_attribute("transform")))
    box = desk.page.get_by_test_id("half-b").bounding_box()
    assert np.allclose((box["x"] + x, box["y"] + y), desk.spot("b", seen.b[4]), atol=2)
    expect(desk.page.get_by_test_id("sentence")).to_have_text(t("pair.missing.click.b", point=1))
    assert away(seen.b[4], desk.line("b")) < 3


@pytest.mark.long
def test_a_reload_and_a_second_tab_go_on_with_every_click_even_a_half_match(desk, seen):
    desk.match_all(seen, range(3))
    desk.click("a", seen.a[3])
    expect(desk.page.get_by_test_id("mark-a-4")).to_have_attribute("data-waits", "true")
    expect(desk.page.get_by_test_id("kept")).to_have_text(t("shell.saved.in-browser"))
    before = desk.kept()
    desk.page.reload()
    desk.wait_for_pictures()
    expect(desk.page.get_by_test_id("mark-a-4")).to_have_attribute("data-waits", "true")
    assert desk.kept() == before and len(before["matches"]) == 4
    desk.click("b", seen.b[3])
    expect(desk.page.get_by_test_id("mark-b-4")).to_have_attribute("data-waits", "false")

    second = Desk(desk.page.context.new_page(), desk.server)
    second.page.goto(desk.page.url)
    second.wait_for_pictures()
    expect(second.page.get_by_test_id("matches").locator("li")).to_have_count(4)
    second.match(seen.a[4], seen.b[4])
    expect(desk.page.get_by_test_id("matches").locator("li")).to_have_count(5)  # the first tab has followed
    second.page.close()

    address = desk.page.url
    desk.page.get_by_test_id("another-a").click()
    expect(desk.page.get_by_test_id("choice-a")).to_be_visible()
    desk.page.evaluate("id => fetch(`/api/v1/snapshots/${id}`).then((r) => r.text())", address.split("/")[-1])
    expect(desk.page.get_by_test_id("choice-a")).to_be_visible()  # the pair that was there does not come back
    expect(desk.page.get_by_test_id("picture-b")).to_be_visible()
    desk.page.go_back()
    desk.wait_for_pictures()
    expect(desk.page).to_have_url(address)
    expect(desk.page.get_by_test_id("matches").locator("li")).to_have_count(5)


@pytest.mark.long
def test_fingers_tap_matches_and_pinch_one_picture(browser, server, seen):
    context = browser.new_context(viewport={"width": 900, "height": 1200}, has_touch=True, color_scheme="dark")
    page = context.new_page()
    page.goto(server.url)
    desk = Desk(page, server).open(seen.pictures)
    page.touchscreen.tap(*desk.spot("a", seen.a[1]))
    expect(page.get_by_test_id("mark-a-1")).to_have_attribute("data-waits", "true")
    page.touchscreen.tap(*desk.spot("b", seen.b[1]))
    expect(page.get_by_test_id("mark-b-1")).to_have_attribute("data-waits", "false")
    assert np.allclose(desk.kept()["matches"][0]["b"], seen.b[1], atol=3)
    context.close()


@pytest.mark.long
def test_things_on_the_carpet_alone_are_refused_with_what_to_do(desk, seen, tmp_path):
    desk.load(seen, range(11))
    expect(desk.page.get_by_test_id("sentence")).to_have_text(t("pair.missing.more", count=1))
    desk.match(seen.a[11], seen.b[11])
    refusal = desk.page.get_by_test_id("pair-refusal")
    expect(refusal).to_contain_text("plane", timeout=LONG_MS)
    expect(refusal).to_contain_text("off that plane, such as robot tops")
    desk.page.screenshot(path=tmp_path / "plane.png")


@pytest.mark.long
def test_corners_of_a_real_board_are_one_plane_too(operator, server, real_data):
    files = [real_data(f"boards/opencv_left_right/{side}01.jpg") for side in ("left", "right")]
    pictures = [cv2.imread(str(file)) for file in files]
    desk = Desk(operator.page, server).open([cv2.imencode(".png", picture)[1].tobytes() for picture in pictures])
    corners = [cv2.findChessboardCorners(picture, (9, 6))[1].reshape(-1, 2).astype(float) for picture in pictures]
    for i in (0, 4, 8, 18, 22, 26, 36, 40, 44, 45, 49, 53):
        desk.match(corners[0][i], corners[1][i])
    expect(desk.page.get_by_test_id("pair-refusal")).to_contain_text("plane", timeout=LONG_MS)


@pytest.mark.long
def test_while_the_server_is_silent_clicks_are_kept_and_asked_when_it_is_back(page, own_server, seen):
    page.set_viewport_size({"width": 1500, "height": 900})
    page.goto(own_server.url)
    desk = Desk(page, own_server).open(seen.pictures)
    desk.load(seen, [*range(6), *range(12, 17)])
    own_server.stop()
    desk.match(seen.a[18], seen.b[18])
    expect(page.get_by_test_id("away")).to_be_visible(timeout=LONG_MS)
    desk.match(seen.a[20], seen.b[20])
    assert len(desk.kept()["matches"]) == 13
    own_server.start()
    expect(page.get_by_test_id("away")).to_have_count(0, timeout=LONG_MS)
    expect(page.get_by_test_id("fundamental")).to_be_visible(timeout=LONG_MS)


@pytest.mark.long
def test_the_newest_question_is_the_one_that_is_answered(matched, seen):
    page, asked = matched.page, []
    matched.settled()
    page.on("request", lambda request: request.url.endswith("/pairs") and asked.append(request.post_data_json))
    page.get_by_test_id("match-3").get_by_role("button").first.click()
    page.get_by_test_id("half-a").focus()
    before = matched.kept()["matches"][2]["a"]
    with holding(page, "**/api/v1/pairs", "POST") as held:
        page.keyboard.press("Shift+ArrowLeft")
        wait_until_held(page, held)
        for _ in range(11):
            page.keyboard.press("Shift+ArrowLeft")
        moved = asked[0]["points_a"][2][0] - before[0]  # by the one press that was asked about
        until(lambda: matched.kept()["matches"][2]["a"][0],
              lambda x: x == pytest.approx(before[0] + 12 * moved, abs=0.01))  # all presses are heard
    told = matched.settled()
    assert len(asked) == 2  # the first one, which was under way, and the newest
    assert asked[-1]["points_a"] == [m["a"] for m in matched.kept()["matches"]]
    expect(page.get_by_test_id("match-3")).to_contain_text(f"{told['fundamental']['epipolar_px'][2]:.2f} px")


@pytest.mark.long
def test_a_picture_that_is_chosen_while_the_last_ones_come_stays(desk):
    page, (left, right) = desk.page, desk.ids
    page.goto(f"{desk.server.url}/#/field")
    page.reload()
    with holding(page, "**/api/v1/snapshots/*", "GET") as held:
        page.get_by_test_id("do-pair").click()
        wait_until_held(page, held)
        page.get_by_test_id(f"choose-a-{right}").click()
        expect(page.get_by_test_id("picture-a")).to_be_visible()
    page.evaluate("ids => Promise.all(ids.map(id => fetch(`/api/v1/snapshots/${id}`)))", [left, right])  # now they came
    expect(page.get_by_test_id("picture-a")).to_have_attribute("src", re.compile(right))
    expect(page.get_by_test_id("choice-b")).to_be_visible()


@pytest.mark.long
def test_a_cameras_active_calibration_is_proposed(operator, server, border_draft):
    snapshot, draft = border_draft("brown-conrady")
    body = {**draft, "snapshot": snapshot, "camera": "overhead"}
    first, second = (server.api("POST", "/calibrations", json=body).json()["id"] for _ in range(2))
    activate_despite(server, first)
    page = operator.page
    page.goto(f"{server.url}/#/field")
    page.reload()
    page.get_by_test_id("tab-pair").click()
    page.get_by_test_id("take-b-overhead").click()
    expect(page.get_by_test_id("calibration-b")).to_have_value(first, timeout=LONG_MS)
    expect(page.get_by_text(t("pair.calibration.proposed-active"))).to_be_visible()
    page.get_by_test_id("calibration-b").select_option("")
    expect(page.get_by_test_id("calibration-b")).to_have_value("")
    assert second != first


@pytest.mark.long
@pytest.mark.parametrize("scheme, width, height", [("dark", 1280, 800), ("light", 1280, 800), ("light", 1024, 768),
                                                   ("dark", 360, 740), ("light", 360, 740)])
def test_it_fits_every_screen_in_both_themes(desk, seen, tmp_path, scheme, width, height):
    page = desk.page
    for which in (0, 1):
        desk.calibrate(which)
    desk.load(seen, [*range(0, 12, 2), *range(12, 20)])
    desk.match(seen.a[21], seen.b[21] + [60, 60])
    page.emulate_media(color_scheme=scheme)
    page.set_viewport_size({"width": width, "height": height})
    page.reload()
    desk.wait_for_pictures()
    expect(page.get_by_test_id("mark-b-15")).to_have_attribute("data-mistake", "true", timeout=LONG_MS)
    page.get_by_test_id("match-15").get_by_role("button").first.click()
    expect(page.get_by_test_id("epipolar-b")).to_be_attached()
    desk.settled()
    page.evaluate("document.querySelector('#app').scrollTo(0, 0)")
    page.screenshot(path=tmp_path / "top.png")
    overflowing = page.evaluate("""[document.documentElement,
        ...document.querySelectorAll('#app, aside, .pair-desk, .halves, header')]
        .filter(e => e.scrollWidth > e.clientWidth + 1).map(e => e.className || e.tagName)""")
    assert overflowing == []
    for name in ("pair-report", "matches"):
        page.get_by_test_id(name).scroll_into_view_if_needed()
        page.screenshot(path=tmp_path / f"{name}.png")
