"""What a live camera sees, by the page: marked and listed, colours taught and taken back, presets, stages, clips."""

import re

import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.axe import axe_path, grave
from tests.support.live_play import Before
from tests.support.manual_pictures import manual_picture
from tests.support.old_answer import OldAnswer
from tests.support.waiting import until
from tests.support.words import like, t

FPS = 4


class Asking:
    """As live_play asks the server of other tests."""

    def __init__(self, server):
        self._server = server

    def post(self, path, **more):
        answer = self._server.api("POST", path.removeprefix("/api/v1"), **more)
        answer.is_success = answer.ok
        return answer


@pytest.fixture(scope="module")
def play(server):
    """Robots and a ball before two cameras, of which one is calibrated; gone when these tests are done."""
    play = Before("seer")
    play.settings["source"] = play.source.replace("fps=20", f"fps={FPS}")
    for id, name in (("seer", "Seer"), ("second", "Second")):
        made = server.api("POST", "/cameras", json={**play.settings, "id": id, "name": name})
        assert made.status_code == 201, made.text
    play.calibrate(Asking(server))
    yield play
    for id in ("seer", "second"):
        server.api("DELETE", f"/cameras/{id}")


@pytest.fixture
def page(operator, server, play):
    """At the page of what that camera sees, as it was at first."""
    fresh = {"on": True, "plan": "ssl", "colours": None, "profile": None, "publish": False}

    def set_anew():  # the page of the test before may have had a wish on its way
        tag = server.api("GET", "/cameras/seer/seeing").headers["ETag"]
        return server.api("PUT", "/cameras/seer/seeing", json=fresh, headers={"If-Match": tag})

    until(set_anew, lambda answer: answer.ok)
    page = operator.page
    page.goto(f"{server.url}/#/cameras/seer/live")
    page.reload()
    expect(page.get_by_test_id("live-desk")).to_be_visible()
    page.keyboard.press("F9")
    expect(page.get_by_test_id("mark-robot").first).to_be_visible(timeout=LONG_MS)
    # The colours that the camera found are known to the page as well: samples are counted from here on.
    expect(page.get_by_test_id("learned")).to_contain_text(
        t("detection.colours.found"), timeout=LONG_MS
    )
    return page


def press(page, key, action):
    """A key means something only once its action can be done."""
    expect(page.get_by_test_id(f"do-{action}")).to_be_enabled(timeout=LONG_MS)
    page.keyboard.press(key)


def kept(server, camera="seer"):
    return server.api("GET", f"/cameras/{camera}/seeing").json()


def held(server):
    """Frames that were kept to be clicked in."""
    return server.api("GET", "/snapshots?purpose=seeing").json()["items"]


def click_at(page, x, y):
    box = page.get_by_test_id("picking").bounding_box()
    page.mouse.click(
        box["x"] + (x + 0.5) / 800 * box["width"], box["y"] + (y + 0.5) / 600 * box["height"]
    )


def test_robots_are_marked_and_listed_and_every_stage_shows_its_picture_and_time(
    page, server, play, tmp_path
):
    rows = page.get_by_test_id("seen-row")
    # the calibration is in use
    expect(page.get_by_role("columnheader", name="x mm")).to_be_visible(timeout=LONG_MS)
    expect(rows.nth(len(play.robots) - 1)).to_be_visible(timeout=LONG_MS)
    (team, number), robot = next(iter(play.robots.items()))
    row = rows.filter(
        has=page.get_by_role("rowheader", name=f"{team.capitalize()} {number}", exact=True)
    )

    def place_mm():  # the table is drawn anew with each frame
        said = [
            text.replace("\u202f", "").replace("−", "-")
            for text in row.locator("td").all_inner_texts()[:2]
        ]
        return [int(text) for text in said if re.fullmatch(r"-?\d+", text)]

    until(place_mm, lambda now: now == pytest.approx([robot.x_mm, robot.y_mm], abs=30))
    manual_picture(page, "detection")
    press(page, "v", "seen-corrected")
    expect(page.locator("[data-view=corrected]")).to_be_visible()
    expect(page.get_by_test_id("mark-robot").first).to_be_visible(timeout=LONG_MS)

    for name in ("noise", "colours", "blobs", "butterfly", "ball", "places"):
        expect(page.get_by_test_id(f"ms-{name}")).to_contain_text("ms")
    page.get_by_test_id("stage-colours").get_by_role("button").click()
    expect(
        page.locator("[data-view=stage-colours] [data-testid=stage-live-colours]")
    ).not_to_have_attribute("data-seq", "0", timeout=LONG_MS)
    page.get_by_test_id("options-ball").click()
    # a page looks every three seconds
    old = OldAnswer(page, "**/api/v1/cameras/seer/seeing").made()
    page.get_by_test_id("stage-ball-most").fill("3")
    with page.expect_response(lambda answer: answer.request.method == "PUT"):
        page.get_by_test_id("stage-ball-most").blur()
    expect(page.get_by_test_id("plan")).to_have_value("")
    old.comes()
    # what was asked before is no news any more
    assert page.get_by_test_id("plan").input_value() == ""
    page.screenshot(path=tmp_path / "stages.png")
    page.evaluate(axe_path().read_text())
    assert grave(page) == []
    page.get_by_test_id("do-undo-seeing").click()
    expect(page.get_by_test_id("plan")).to_have_value("ssl")
    expect(page.get_by_test_id("publish-words")).to_contain_text(t("detection.publish.off"))
    page.get_by_test_id("publish").check()
    expect(page.get_by_test_id("publish-problem")).to_contain_text(
        "Publishing is off.", timeout=LONG_MS
    )
    until(lambda: kept(server)["publish"], bool)
    page.get_by_test_id("publish").uncheck()
    expect(page.get_by_test_id("publish-words")).to_contain_text(t("detection.publish.off"))
    until(lambda: not kept(server)["publish"], bool)


@pytest.mark.long
def test_a_colour_is_taught_on_a_held_frame_taken_back_and_shared_with_another_camera(
    page, server, play
):
    press(page, " ", "hold-frame")
    expect(page.get_by_test_id("held-frame")).to_be_visible(timeout=LONG_MS)
    page.keyboard.press("3")
    expect(page.get_by_test_id("colour-blue")).to_have_attribute("aria-pressed", "true")
    before = page.get_by_test_id("sample-blue").count()
    click_at(page, *play.clicks()["blue"][0])
    expect(page.get_by_test_id("sample-blue")).to_have_count(before + 1, timeout=LONG_MS)
    expect(page.get_by_test_id("learned")).to_contain_text("seer", timeout=LONG_MS)
    expect(page.get_by_test_id("health-blue")).to_contain_text(
        like("detection.colours.margin"), timeout=LONG_MS
    )
    until(lambda: kept(server)["learned"], lambda learned: learned == "clicks")
    press(page, "m", "mask")
    expect(
        page.locator("[data-view=stage-colours] [data-testid=stage-held-colours]")
    ).to_be_visible(timeout=LONG_MS)
    manual_picture(page, "detection-colours")

    page.reload()  # the frame, the colours and the way back are still there
    expect(page.get_by_test_id("held-frame")).to_be_visible(timeout=LONG_MS)
    expect(page.get_by_test_id("sample-blue")).to_have_count(before + 1, timeout=LONG_MS)
    press(page, "Control+z", "undo-seeing")
    expect(page.get_by_test_id("learned")).not_to_contain_text("seer")
    page.get_by_test_id("do-redo-seeing").click()
    expect(page.get_by_test_id("sample-blue")).to_have_count(before + 1, timeout=LONG_MS)

    page.get_by_test_id("preset-name").fill("north hall")
    page.get_by_test_id("save-preset").click()
    expect(page.get_by_test_id("preset")).to_have_value("north-hall", timeout=LONG_MS)
    page.get_by_test_id("copy-to").select_option("second")
    page.get_by_test_id("copy-colours").click()
    expect(page.get_by_text(t("detection.presets.copied", camera="Second"))).to_be_visible(
        timeout=LONG_MS
    )
    assert kept(server, "second")["colours"] == kept(server)["colours"] == "north-hall"
    page.get_by_test_id("notice").get_by_role(
        "button", name=t("detection.presets.copied.take-back")
    ).click()
    until(lambda: kept(server, "second")["colours"], lambda name: name is None)
    page.get_by_test_id("sample-blue").last.click()
    expect(page.get_by_test_id("learned")).to_contain_text("north-hall, changed", timeout=LONG_MS)


@pytest.mark.long
def test_a_clip_is_recorded_stepped_and_a_colour_taught_in_it(page, server, play, tmp_path):
    count = len(held(server))
    press(page, "r", "record-clip")
    expect(page.get_by_test_id("clip-place")).to_be_visible(timeout=LONG_MS)
    expect(page.get_by_test_id("held-frame")).to_be_visible(timeout=LONG_MS)
    press(page, ".", "next-frame")
    expect(page.get_by_text(like("detection.clips.place", frame=2))).to_be_visible(timeout=LONG_MS)
    expect(page.get_by_test_id("mark-robot").first).to_be_visible(timeout=LONG_MS)
    page.keyboard.press("2")
    assert len(held(server)) == count
    before = page.get_by_test_id("sample-yellow").count()
    click_at(page, *play.clicks()["yellow"][0])
    expect(page.get_by_test_id("sample-yellow")).to_have_count(before + 1, timeout=LONG_MS)
    assert len(held(server)) == count + 1  # that very frame, not the newest one
    page.keyboard.press("Escape")
    press(page, "p", "play-clip")
    # Not one frame of those: each is there for a quarter of a second.
    later = like("detection.clips.place", frame="LATER").pattern.replace("LATER", r"([4-9]|\d\d)")
    expect(page.get_by_text(re.compile(later))).to_be_visible(timeout=LONG_MS)
    page.screenshot(path=tmp_path / "clip.png")
    page.get_by_test_id("do-play-clip").click()
    page.get_by_test_id("remove-clip").click()
    expect(page.get_by_test_id("live-seer")).to_be_visible(timeout=LONG_MS)
    assert server.api("GET", "/clips").json()["items"] == []
