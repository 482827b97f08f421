"""The pages beside the steps: long work, versions, settings, and a board before a live camera."""

import json
import os
import re
import signal
import time

import numpy as np
import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS, Operator, Server, press_activate
from tests.support.board_film import film
from tests.support.demo_cameras import HEIGHT, WIDTH
from tests.support.held_requests import holding, wait_until_held
from tests.support.manual_pictures import manual_picture
from tests.support.old_answer import OldAnswer
from tests.support.pictures import encoded, gradient
from tests.support.waiting import until
from tests.support.words import like, t
from touchline.core.field import BORDERS


def kill(server):
    """As a power cut does: nothing is said, nothing is closed."""
    os.kill(server.process.pid, signal.SIGKILL)
    server.process.wait(20)


def comparison(server, clicks, a_line):
    """Work that was asked for by somebody else; how long it takes is up to the points on each line: 200 some seconds,
    thousands more than a minute."""
    task = clicks("ssl_2008_half")
    for one in task["observations"]:
        at = np.linspace(0, len(one["points"]) - 1, a_line)
        along = [np.interp(at, range(len(c)), c) for c in zip(*one["points"], strict=True)]
        one["points"] = np.stack(along, axis=1).tolist()
    answer = server.api("POST", "/calibrations/compare?job=true", json=task)
    assert answer.status_code == 202, answer.text
    return answer.json()["id"]


def job(page, id):
    return page.locator(f"[data-testid=job][data-id='{id}']")


@pytest.fixture
def versions(server, clicks):
    """Three versions of the camera "table", the newest last, none active; deleted in the end as far as that can be."""
    task = {**clicks("ssl_2008_half"), "camera": "table", "model": "polynomial"}
    made = [
        server.api("POST", "/calibrations", json={**task, "options": {"degree": degree}}).json()
        for degree in (1, 2, 3)
    ]
    yield made
    for version in made:
        server.api("DELETE", f"/calibrations/{version['id']}")


def test_long_work_is_watched_and_cancelled_and_leads_to_what_came_of_it(
    operator, server, clicks, tmp_path
):
    page, id = operator.page, comparison(server, clicks, 5000)
    expect(page.get_by_test_id("at-work")).to_be_visible(timeout=LONG_MS)
    page.get_by_test_id("at-work").click()
    expect(job(page, id)).to_have_attribute("data-state", "running", timeout=LONG_MS)
    expect(job(page, id).get_by_test_id("job-message")).to_contain_text("%")
    page.screenshot(path=tmp_path / "jobs.png")
    job(page, id).get_by_test_id("cancel-job").click()
    expect(job(page, id)).to_have_attribute("data-state", "cancelled", timeout=LONG_MS)
    expect(page.get_by_test_id("at-work")).to_have_count(0, timeout=LONG_MS)
    assert server.api("GET", f"/jobs/{id}").json()["state"] == "cancelled"

    picture = encoded("png", gradient(780, 580))  # of the clicks' size
    snapshot = server.api("POST", "/snapshots", files={"file": picture}).json()
    body = {
        **clicks("ssl_2008_half"),
        "snapshot": snapshot["id"],
        "image_size": None,
        "model": "homography",
    }
    made = server.api(
        "POST", "/calibrations?job=true", json={k: v for k, v in body.items() if v}
    ).json()["id"]
    expect(job(page, made)).to_have_attribute("data-state", "done", timeout=LONG_MS)
    job(page, made).get_by_test_id("show-made").click()
    expect(page.get_by_test_id("step-verify")).to_have_attribute(
        "aria-current", "step", timeout=LONG_MS
    )
    expect(page.get_by_test_id("corrected")).to_be_visible(timeout=LONG_MS)


@pytest.mark.long
def test_a_reload_in_the_middle_of_a_comparison_goes_on_watching_it(clicked, server):
    page = clicked("division").open_lens().page
    # In the middle of it: the page knows which job it is.
    asked = json.loads(
        until(lambda: page.evaluate("sessionStorage.getItem('touchline.comparison')"), bool)
    )
    page.reload()
    expect(page.get_by_test_id("ranking")).to_be_visible(timeout=LONG_MS)
    ours = [it for it in server.api("GET", "/jobs").json()["items"] if it["kind"] == "comparison"]
    assert (ours[0]["id"], ours[0]["state"]) == (asked["job"], "done")


@pytest.mark.long
def test_work_goes_on_when_the_server_was_killed_in_the_middle_of_it(page, own_server, clicks):
    page.set_default_navigation_timeout(LONG_MS)
    Operator(page, own_server).visit()
    page.goto(f"{own_server.url}/#/system/jobs")
    id = comparison(own_server, clicks, 200)
    expect(job(page, id)).to_have_attribute("data-state", "running", timeout=LONG_MS)
    kill(own_server)
    expect(page.get_by_test_id("jobs-page").get_by_text(t("jobs.away"))).to_be_visible(
        timeout=LONG_MS
    )
    own_server.start()
    expect(job(page, id).get_by_test_id("job-attempt")).to_contain_text(
        t("jobs.attempt", attempt=2), timeout=LONG_MS
    )
    manual_picture(page, "jobs")
    expect(job(page, id)).to_have_attribute("data-state", "done", timeout=LONG_MS)


def test_settings_are_read_without_secrets_and_a_name_is_kept(operator, server, tmp_path):
    page = operator.page
    page.get_by_test_id("rail-system").click()
    page.get_by_test_id("tab-server").click()
    expect(page.get_by_test_id("taken-pictures")).to_contain_text(
        t("settings.storage.limit", limit="2.0 GB")
    )
    expect(page.get_by_test_id("newest-backup")).not_to_be_empty()
    expect(page.get_by_test_id("setting-token")).to_contain_text(t("settings.value.not-set"))
    page.get_by_test_id("section-jobs").locator("summary").click()
    expect(page.get_by_test_id("setting-jobs.workers")).to_contain_text("Jobs running at once")
    page.screenshot(path=tmp_path / "settings.png")
    page.get_by_test_id("operator-name").fill("Ada")
    page.get_by_test_id("operator-name").press("Enter")
    page.reload()
    expect(page.get_by_test_id("operator-name")).to_have_value("Ada")
    taken = until(
        lambda: server.api("POST", "/snapshots", json={"camera": "overhead"}), lambda a: a.ok
    )
    snapshot = taken.json()["id"]
    operator.go_on(
        snapshot,
        {
            "field": "ssl-div-b",
            "region": "half",
            "model": "polynomial",
            "options": {},
            "observations": [],
        },
        "points",
    )
    operator.click("left", [[100, 100]])
    assert operator.draft()["updated_by"] == "Ada"


def shows_what_changed(page, server, row, former, now):
    """Arrows and the largest change; nothing moves when they arrive."""
    change = row.get_by_test_id("version-change")
    with holding(page, "**/difference/*.json", "GET") as held:
        page.reload()
        row.scroll_into_view_if_needed()
        wait_until_held(page, held)
        expect(change.get_by_test_id("version-change-words")).to_have_text(t("common.asking"))
        before = row.bounding_box()
    expect(change.locator(".map path").first).to_be_attached(timeout=LONG_MS)
    assert row.bounding_box() == before
    largest = server.api("GET", f"/calibrations/{former['id']}/difference/{now['id']}.json").json()[
        "max_mm"
    ]
    words = like("versions.change.largest", version=former["version"])
    expect(change.get_by_test_id("version-change-words")).to_have_text(words)
    shown = change.locator("small b").text_content().split()[0].replace("\u202f", "")
    assert float(shown) == pytest.approx(largest, abs=0.6)


def test_versions_are_activated_gone_back_to_annotated_and_compared(operator, server, versions):
    page = operator.page
    page.goto(f"{server.url}/#/cameras/table/versions")

    def row(version):
        return page.locator(f"[data-testid=shelf-version][data-version='{version['version']}']")

    first, second, _ = versions
    shows_what_changed(page, server, row(second), first, second)
    before = len(server.api("GET", "/calibrations/activations?camera=table").json()["items"])
    for version in (first, second):
        press_activate(page, row(version).get_by_test_id("shelf-activate"))
        expect(row(version)).to_have_attribute("data-active", "true")
    expect(row(second).get_by_test_id("shelf-delete")).to_be_disabled()
    press_activate(page, page.get_by_test_id("do-roll-back"))
    expect(row(first)).to_have_attribute("data-active", "true")
    assert server.api("GET", "/cameras/table").json()["active_calibration"] == first["id"]
    expect(page.get_by_test_id("history").locator("li")).to_have_count(before + 3)

    row(second).get_by_test_id("shelf-note").fill("after the lens was cleaned")
    with page.expect_response(lambda answer: answer.request.method == "PATCH"):
        row(second).get_by_test_id("shelf-note").press("Tab")
    page.reload()
    expect(row(second).get_by_test_id("shelf-note")).to_have_value("after the lens was cleaned")

    old = OldAnswer(page, "**/api/v1/calibrations?brief=true&limit=50&camera=table")
    row(first).get_by_test_id("shelf-note").fill("before it was cleaned")
    row(first).get_by_test_id("shelf-note").press("Tab")
    old.made()
    press_activate(page, row(second).get_by_test_id("shelf-activate"))
    expect(row(second)).to_have_attribute("data-active", "true")
    old.comes()
    # the list after the note is no news any more
    assert row(second).get_attribute("data-active") == "true"

    for version in (first, second):
        row(version).get_by_test_id("shelf-compare").check()
    expect(page.get_by_test_id("apart-worst")).to_contain_text("mm", timeout=LONG_MS)
    apart = server.api("GET", f"/calibrations/{first['id']}/difference/{second['id']}.json").json()
    shown = float(
        page.get_by_test_id("apart-worst").text_content().split()[0].replace("\u202f", "")
    )
    assert shown == pytest.approx(apart["max_mm"], abs=0.6)
    page.locator("img[src*='/difference/']").evaluate("picture => picture.decode()")
    manual_picture(page, "saved-data")


@pytest.mark.long
def test_a_version_that_was_deleted_is_put_back(operator, server, versions):
    page, gone = operator.page, versions[2]
    page.goto(f"{server.url}/#/cameras/table/versions")
    row = page.locator(f"[data-testid=shelf-version][data-version='{gone['version']}']")
    row.get_by_test_id("shelf-delete").click()
    expect(row).to_have_count(0)
    page.get_by_role("button", name=t("common.put-back")).click()
    expect(row).to_be_visible()
    assert server.api("GET", f"/calibrations/{gone['id']}").json()["version"] == gone["version"]


@pytest.mark.long
def test_a_page_is_left_to_the_picture_it_was_opened_from(operator, straight_picture, frame_points):
    page = operator.open(straight_picture, "table", "full").click("left", frame_points["left"]).page
    operator.draft()
    snapshot = operator.snapshot
    page.get_by_test_id("stage").focus()
    page.keyboard.press("i")
    expect(page.get_by_test_id("jobs-page")).to_be_visible()
    page.keyboard.press("Delete")  # nothing unseen is changed
    page.go_back()
    operator.is_at("points")
    assert operator.snapshot == snapshot and operator.points("left") == frame_points["left"]


@pytest.mark.long
def test_a_board_before_a_live_camera_is_taken_by_itself_and_gives_a_lens(
    operator, server, tmp_path
):
    page, folder = operator.page, server.data / "shown"
    folder.mkdir(exist_ok=True)
    film(folder / "board.avi", 6)
    film_of_it = {"id": "film", "name": "Film of a board", "source": "video://board.avi"}
    assert server.api("POST", "/cameras", json=film_of_it).ok
    page.goto(f"{server.url}/#/cameras/film/live")
    page.reload()  # the list of cameras is the page's own
    page.get_by_test_id("do-watch-board").click()
    views = page.get_by_test_id("captured-view")
    expect(views.nth(1)).to_be_visible(timeout=LONG_MS)
    # the corners, over the live picture
    expect(page.locator(".captured circle")).to_have_count(54, timeout=LONG_MS)
    expect(page.locator(".captured .wanted polygon")).to_be_visible(timeout=LONG_MS)
    expect(page.get_by_test_id("sentence")).to_contain_text("Hold the board", timeout=LONG_MS)
    page.screenshot(path=tmp_path / "held.png")
    page.reload()
    expect(views.nth(1)).to_be_visible(timeout=LONG_MS)
    # each pose once, those before the reload as well
    expect(views).to_have_count(6, timeout=LONG_MS)
    page.keyboard.press("k")
    expect(page.get_by_test_id("do-capture")).to_contain_text(t("board.capture.start-automatic"))
    time.sleep(3)  # a whole pose goes by
    expect(views).to_have_count(6)
    page.get_by_test_id("next").click()
    expect(page.get_by_test_id("lens-verdict")).to_be_visible(timeout=LONG_MS)
    kept = json.loads(page.evaluate("localStorage.getItem('touchline.board')"))
    assert [p["camera"] for p in kept["pictures"]] == ["film"] * 6
    manual_picture(page, "boards")
    server.api("DELETE", "/cameras/film")


def test_a_picture_that_opens_late_does_not_take_back_who_went_elsewhere_and_no_address_is_written(
    operator, server
):
    page, picture = (
        operator.page,
        server.api("POST", "/snapshots", json={"camera": "overhead"}).json()["id"],
    )
    written = """(hash) => { const written = window.written = [], write = history.pushState.bind(history);
      history.pushState = (...to) => { written.push(to[2]); write(...to); }; location.hash = hash; }"""
    with (
        page.expect_response(f"**/api/v1/drafts/{picture}"),  # what opening it asks last
        holding(page, f"**/api/v1/snapshots/{picture}", "GET") as asked,
    ):
        page.goto(f"{server.url}/#/calibrate/{picture}/points")
        wait_until_held(page, asked)
        page.evaluate(written, "#/cameras/overhead/live")
        expect(page.get_by_test_id("live-desk")).to_be_visible()
    # by now the answer has been read
    page.evaluate("() => fetch('/api/v1/health').then((r) => r.text())")
    expect(page.get_by_test_id("look-corrected")).to_be_visible(timeout=LONG_MS)
    assert page.url.endswith("#/cameras/overhead/live")
    assert page.evaluate("window.written") == []  # a reload or the way back meets no other


def test_a_camera_lists_its_own_images_and_every_step_of_one_can_be_looked_at(operator, server):
    page = operator.page
    taken = until(
        lambda: server.api("POST", "/snapshots", json={"camera": "overhead"}),
        lambda answer: answer.ok,
    )
    snapshot = taken.json()["id"]
    page.goto(f"{server.url}/#/cameras/table/calibrate")
    expect(page.get_by_test_id("camera-images-page")).to_contain_text(
        t("library.calibrate-camera.how")
    )
    expect(page.get_by_test_id(f"recent-{snapshot}")).to_have_count(0)
    page.goto(f"{server.url}/#/cameras/overhead/calibrate")
    image = page.get_by_test_id(f"recent-{snapshot}")
    expect(image.locator("img")).to_have_js_property("naturalWidth", 320)
    image.click()
    operator.is_at("points")
    assert operator.snapshot == snapshot
    for step, missing in (
        ("points", like("shell.sentence.mark")),
        ("verify", t("shell.sentence.save-first")),
        ("field", t("shell.sentence.check-field", width=WIDTH, height=HEIGHT)),
    ):
        page.get_by_test_id(f"step-{step}").click()
        operator.is_at(step)
        expect(page.get_by_test_id("sentence")).to_contain_text(missing)
    assert not [border for border in BORDERS if operator.points(border)]


def test_who_signed_in_with_the_token_signs_out_again(page, tmp_path):
    server = Server(tmp_path, token="a-token-that-is-long-enough")
    try:
        page.goto(server.url)
        page.get_by_label("Access token").fill("a-token-that-is-long-enough")
        page.keyboard.press("Enter")
        expect(page.get_by_test_id("camera-overhead")).to_be_visible()
        page.goto(f"{server.url}/#/system/server")
        page.get_by_test_id("sign-out").click()
        expect(page).to_have_url(re.compile("/login$"))
        page.goto(server.url)
        expect(page).to_have_url(re.compile("/login$"))
    finally:
        server.stop()
