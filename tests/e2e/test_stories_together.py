"""Stories that do not go smoothly: two operators, a server that is killed in the middle, a camera that is dead."""

import os
import signal

import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS, SOON_MS, Operator, press_activate
from tests.support.activation import activate_despite
from tests.support.exported import example
from tests.support.words import t
from touchline.core.field import BORDERS
from touchline.workflows import interchange


@pytest.fixture(autouse=True)
def patience():
    """What a person waits for: a loaded machine may need a while."""
    expect.set_options(timeout=LONG_MS)
    yield
    expect.set_options(timeout=SOON_MS)


def kill(server):
    """As a power cut does: nothing is said, nothing is closed."""
    os.kill(server.process.pid, signal.SIGKILL)
    server.process.wait(20)


@pytest.fixture
def two(browser, server):
    """Ada at a workstation and Grace at a tablet, each in a browser of their own."""
    operators = {}
    for name, size in (("Ada", (1280, 800)), ("Grace", (1024, 768))):
        context = browser.new_context(
            viewport=dict(zip(("width", "height"), size, strict=True)), color_scheme="dark"
        )
        context.add_init_script(f"localStorage.setItem('touchline.operator', '{name}')")
        operators[name] = Operator(context.new_page(), server).visit()
    yield operators
    for operator in operators.values():
        operator.page.context.close()


def test_two_operators_see_each_other_and_each_others_clicks_at_once(
    two, straight_picture, frame_points, tmp_path
):
    ada, grace = two["Ada"], two["Grace"]
    ada.open(straight_picture, "table", "full").click("left", frame_points["left"][:3])
    ada.draft()
    grace.page.goto(ada.page.url)
    grace.wait_for_picture()
    expect(grace.page.get_by_test_id("border-left")).to_contain_text(t("common.points", count=3))
    expect(grace.page.get_by_test_id("presence")).to_contain_text(
        t("calibrate.presence.open", count=1, who="Ada")
    )
    expect(ada.page.get_by_test_id("presence")).to_contain_text(
        t("calibrate.presence.open", count=1, who="Grace")
    )
    ada.page.bring_to_front()
    grace.click("top", frame_points["top"])
    expect(ada.page.get_by_test_id("border-top")).to_contain_text(t("common.points", count=6))
    expect(ada.page.get_by_test_id("changed-by")).to_contain_text(
        t("calibrate.presence.changed", name="Grace")
    )
    ada.page.screenshot(path=tmp_path / "ada.png")
    grace.page.screenshot(path=tmp_path / "grace.png")
    for border, points in (
        ("left", frame_points["left"][3:]),
        *((b, frame_points[b]) for b in ("right", "bottom")),
    ):
        ada.click(border, points)
    expect(grace.page.get_by_test_id("border-bottom")).to_contain_text(t("common.points", count=6))
    assert {border: grace.points(border) for border in BORDERS} == {
        border: frame_points[border] for border in BORDERS
    }
    expect(ada.page.get_by_test_id("next")).to_have_attribute("aria-disabled", "false")
    ada.next("verify")
    assert ada.saved()["made_by"] == "Ada"
    ada.page.close()
    expect(grace.page.get_by_test_id("presence")).to_have_count(0)


@pytest.mark.long
def test_what_the_other_did_is_taken_back_by_one_undo(two, straight_picture, frame_points):
    ada, grace = two["Ada"], two["Grace"]
    ada.open(straight_picture, "table", "full").click("left", frame_points["left"])
    ada.draft()
    grace.page.goto(ada.page.url)
    grace.wait_for_picture()
    expect(grace.page.get_by_test_id("presence")).to_be_visible()
    grace.page.get_by_test_id("border-left").click()
    grace.page.get_by_test_id("stage").focus()
    grace.page.keyboard.press("Control+a")
    grace.page.keyboard.press("Delete")
    expect(ada.page.get_by_test_id("border-left")).not_to_contain_text(t("common.points", count=6))
    ada.page.get_by_test_id("undo-theirs").click()
    assert ada.points("left") == frame_points["left"]
    expect(grace.page.get_by_test_id("border-left")).to_contain_text(t("common.points", count=6))


@pytest.mark.long
def test_a_server_that_is_killed_in_the_middle_costs_nothing(
    page, own_server, frame_points, straight_picture, tmp_path
):
    operator = Operator(page, own_server).visit()
    operator.open(straight_picture, "table", "full").click("left", frame_points["left"])
    operator.draft()
    kill(own_server)
    operator.click("right", frame_points["right"])
    expect(page.get_by_test_id("away")).to_be_visible(timeout=LONG_MS)
    operator.click("top", frame_points["top"])
    page.screenshot(path=tmp_path / "away.png")
    own_server.start()
    expect(page.get_by_test_id("away")).to_have_count(0)
    operator.click("bottom", frame_points["bottom"])
    assert {border: operator.points(border) for border in BORDERS} == {
        b: frame_points[b] for b in BORDERS
    }
    expect(page.get_by_test_id("next")).to_have_attribute("aria-disabled", "false")
    operator.next("verify")
    kept = operator.saved()
    kill(own_server)
    own_server.start()
    page.reload()
    expect(page.get_by_test_id("step-verify")).to_have_attribute("aria-current", "step")
    expect(page.get_by_test_id("corrected")).to_be_visible(timeout=LONG_MS)
    assert operator.saved()["report"] == kept["report"]
    page.screenshot(path=tmp_path / "back.png")


@pytest.mark.long
def test_a_dead_camera_says_its_cure_and_the_rest_goes_on(operator, server, tmp_path):
    """Its picture is gone, as a network camera's may be."""
    answer = server.api(
        "POST",
        "/cameras",
        json={"id": "dead", "name": "Dead camera", "source": "picture://gone.png"},
    )
    assert answer.status_code == 201
    page = operator.page
    page.reload()
    expect(page.get_by_test_id("live-dead")).to_have_attribute("data-state", "offline")
    page.get_by_test_id("camera-dead").click()
    expect(page.get_by_test_id("notice")).to_contain_text("gone.png")
    page.screenshot(path=tmp_path / "dead.png")
    page.get_by_test_id("look-at-dead").click()
    expect(page.get_by_test_id("camera-problem")).to_be_visible(timeout=LONG_MS)
    expect(page.get_by_test_id("next")).to_have_attribute("aria-disabled", "true")
    page.get_by_test_id("do-watch-board").click()
    expect(page.get_by_test_id("capture-hint")).to_contain_text("gone.png")
    page.goto(server.url)
    operator.take().click("left", [[100, 100]])
    assert len(operator.points("left")) == 1
    server.api("DELETE", "/cameras/dead")


def test_of_two_who_change_the_same_the_slower_one_is_told_and_nothing_is_lost(page, own_server):
    """Behind the polls of an operator who looks away for a moment: another one activates, writes and publishes."""
    server, headers = own_server, {"X-Operator": "Grace"}
    ids = [
        server.api(
            "POST",
            "/calibrations/import",
            data={"camera": "overhead"},
            files={
                "file": ("a.json", interchange.export(example("brown-conrady", 0), "json").data)
            },
        ).json()["id"]
        for _ in range(3)
    ]
    page.goto(f"{server.url}/#/cameras/overhead/versions")
    newest = page.get_by_test_id("shelf-version").first
    expect(newest).to_be_visible()
    for path in ("cameras/status", "publishing"):
        page.route(
            f"**/api/v1/{path}",
            lambda route: route.abort() if route.request.method == "GET" else route.continue_(),
        )
    activate_despite(server, ids[0], headers=headers)
    assert server.api(
        "PATCH", f"/calibrations/{ids[2]}", json={"note": "by Grace"}, headers=headers
    ).ok

    press_activate(page, newest.get_by_test_id("shelf-activate"))
    expect(
        page.get_by_text("Grace has activated version 1 since you opened this page.")
    ).to_be_visible()
    assert server.api("GET", f"/calibrations/{ids[0]}").json()["active"]
    expect(page.get_by_test_id("shelf-version").last).to_have_attribute("data-active", "true")
    press_activate(
        page, page.get_by_role("button", name=t("versions.activate-all-the-same", version=3))
    )
    expect(newest).to_have_attribute("data-active", "true")

    note = page.get_by_test_id("shelf-note")
    assert server.api(
        "PATCH", f"/calibrations/{ids[1]}", json={"note": "by Grace"}, headers=headers
    ).ok
    note.nth(1).fill("by Ada")
    note.nth(1).press("Tab")
    expect(page.get_by_text(t("core.api.changed-since"))).to_be_visible()
    expect(note.nth(1)).to_have_value("by Grace")
    assert server.api("GET", f"/calibrations/{ids[1]}").json()["note"] == "by Grace"

    page.unroute("**/api/v1/publishing")
    page.goto(f"{server.url}/#/system/publishing")
    expect(page.get_by_test_id("network-ttl")).to_be_visible()
    page.route(
        "**/api/v1/publishing",
        lambda route: route.abort() if route.request.method == "GET" else route.continue_(),
    )
    assert server.api("PUT", "/publishing", json={"ttl": 3}, headers=headers).ok
    page.get_by_test_id("network-limit_mm").fill("20")
    page.get_by_test_id("network-limit_mm").press("Tab")
    expect(
        page.get_by_text("Another user has changed the publishing settings since you opened them.")
    ).to_be_visible()
    page.unroute("**/api/v1/publishing")
    expect(page.get_by_test_id("network-ttl")).to_have_value("3")
    assert server.api("GET", "/publishing").json()["limit_mm"] == 30
