"""Nothing is lost: reloads, second tabs, a server that goes away."""

import re

import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS, Operator
from tests.support.held_requests import holding, wait_until_held
from tests.support.old_answer import OldAnswer
from tests.support.waiting import until
from tests.support.words import t


@pytest.mark.long
def test_a_picture_opened_before_the_lists_are_there_stays(page, server, straight_picture):
    """On a slow network somebody is quicker than the page: late lists neither close the picture nor lose its field."""
    held = []
    page.route("**/api/v1/fields", lambda route: held.append(route))
    with page.expect_request("**/api/v1/fields"):
        page.goto(server.url)
    with page.expect_response(
        lambda answer: answer.request.method == "POST" and answer.url.endswith("/snapshots")
    ):
        page.get_by_test_id("file").set_input_files(straight_picture)
    held[0].continue_()
    expect(page.get_by_test_id("field")).to_be_visible()
    expect(page.get_by_test_id("field").locator("option")).not_to_have_count(0)
    # the address is followed from here on
    expect(page).to_have_url(re.compile(r"#/calibrate/\w+/field$"))
    page.wait_for_timeout(300)  # for what would close it
    expect(page.get_by_test_id("field")).to_be_visible()


@pytest.mark.long
def test_a_reload_goes_on_where_the_operator_stood(operator, straight_picture, frame_points):
    operator.open(straight_picture, "table", "full")
    operator.click("left", frame_points["left"]).click("top", frame_points["top"])
    before = operator.draft()
    operator.page.reload()
    expect(operator.page.get_by_test_id("border-top")).to_contain_text(t("common.points", count=6))
    expect(operator.page.get_by_test_id("step-points")).to_have_attribute("aria-current", "step")
    assert operator.draft() == before


def test_a_click_that_was_not_saved_yet_survives_a_reload_and_one_undone_while_it_is_saved_is_gone(
    arriving, server, straight_picture, frame_points
):
    operator, page, left = arriving, arriving.page, frame_points["left"]
    kept = server.api("POST", "/snapshots", files={"file": straight_picture.read_bytes()}).json()
    operator.go_on(
        kept["id"],
        {
            "field": "table",
            "region": "full",
            "model": None,
            "options": {},
            "observations": [{"feature": "left", "kind": "line", "points": left[:3]}],
        },
        "points",
    )
    drafts = "**/api/v1/drafts/*"
    page.route(
        drafts, lambda route: route.abort() if route.request.method == "PUT" else route.continue_()
    )
    operator.click("left", left[3:4])
    expect(page.get_by_test_id("saved")).to_have_attribute("data-state", "away")
    page.reload()
    expect(page.get_by_test_id("border-left")).to_contain_text(t("common.points", count=4))
    page.unroute(drafts)  # only now: what came back was kept by the browser alone
    assert operator.points("left") == left[:4]

    operator.wait_for_picture()
    with holding(page, drafts, "PUT") as saves:
        operator.click("left", left[4:5])
        wait_until_held(page, saves)
        page.keyboard.press("Control+z")
    until(lambda: operator.points("left"), lambda points: points == left[:4])
    page.reload()
    operator.wait_for_picture()
    assert operator.points("left") == left[:4]


def test_two_tabs_that_disagree_are_asked_and_either_answer_loses_nothing(
    operator, server, straight_picture, frame_points
):
    """Behind a proxy that passes no sockets, so that neither hears of the other before it saves."""
    no_line = ("**/drafts/*/stream*", lambda line: line.close())
    operator.page.route_web_socket(*no_line)
    operator.open(straight_picture, "table", "full").click("left", frame_points["left"][:2])
    operator.draft()
    other = Operator(operator.page.context.new_page(), server)
    other.page.route_web_socket(*no_line)
    other.page.goto(operator.page.url)
    expect(other.page.get_by_test_id("border-left")).to_contain_text(t("common.points", count=2))
    other.click("left", frame_points["left"][2:3])
    other.draft()
    operator.click("top", frame_points["top"][:2])
    expect(operator.page.get_by_test_id("conflict")).to_be_visible()
    operator.page.get_by_test_id("keep-mine").click()
    assert operator.points("top") == frame_points["top"][:2]
    assert operator.points("left") == frame_points["left"][:2]
    operator.page.get_by_test_id("stage").focus()
    operator.page.keyboard.press("Control+z")  # theirs stands one undo back
    assert operator.points("left") == frame_points["left"][:3]
    operator.page.keyboard.press("Control+y")
    # saved, before the other one hears of it
    assert operator.points("left") == frame_points["left"][:2]

    other.click("right", frame_points["right"][:1])
    expect(other.page.get_by_test_id("conflict")).to_be_visible()
    other.page.get_by_test_id("take-theirs").click()
    expect(other.page.get_by_test_id("conflict")).to_have_count(0)
    assert other.points("top") == frame_points["top"][:2]
    other.page.get_by_test_id("stage").focus()
    other.page.keyboard.press("Control+z")  # ours too
    assert other.points("right") == frame_points["right"][:1]


@pytest.mark.long
def test_of_two_changes_by_another_hand_the_later_one_is_shown(
    operator, server, straight_picture, frame_points
):
    """However late the page hears what the first one was."""
    page, told, held, late = operator.page, [], [], [True]

    def hold(route):
        if late[0] and route.request.method == "GET":
            held.append((route, route.fetch()))
        else:
            route.continue_()

    def save(points):
        tag = server.api("GET", path).headers["ETag"]
        left = [{"feature": "left", "kind": "line", "points": points}]
        assert server.api(
            "PUT", path, json=empty | {"observations": left}, headers={"If-Match": tag}
        ).ok

    def wait_until(holds):
        for _ in range(LONG_MS // 50):
            if holds():
                return
            page.wait_for_timeout(50)
        raise AssertionError("nothing was heard")

    def listen(line):
        if "/drafts/" in line.url:
            line.on("framereceived", lambda text: told.append(text))

    page.on("websocket", listen)
    operator.open(straight_picture, "table", "full")
    kept, path = operator.draft(), f"/drafts/{operator.snapshot}"
    empty = {name: kept[name] for name in ("field", "region", "model", "options")}
    wait_until(lambda: told)  # the page hears of others from here on
    page.route("**/api/v1/drafts/*", hold)
    save(frame_points["left"][:1])
    wait_until(lambda: held)
    save(frame_points["left"][:2])
    page.wait_for_timeout(1000)  # a page that asks for both at once has asked by now
    late[0] = False
    for route, answer in held:
        route.fulfill(response=answer)
    expect(page.get_by_test_id("border-left")).to_contain_text(t("common.points", count=2))


def test_work_goes_on_while_the_server_is_away(page, own_server, straight_picture, frame_points):
    operator = Operator(page, own_server).visit()
    operator.open(straight_picture, "table", "full").click("left", frame_points["left"][:3])
    operator.draft()
    own_server.stop()
    operator.click("left", frame_points["left"][3:])
    expect(page.get_by_test_id("away")).to_be_visible(timeout=LONG_MS)
    expect(page.get_by_test_id("border-left")).to_contain_text(t("common.points", count=6))
    own_server.start()
    expect(page.get_by_test_id("away")).to_have_count(0, timeout=LONG_MS)
    assert operator.points("left") == frame_points["left"]
    expect(page.get_by_test_id("curve-left")).to_be_attached()


@pytest.mark.long
def test_of_two_pictures_that_are_opened_the_one_asked_for_last_stays(
    operator, server, straight_picture, frame_points
):
    page = operator.page
    first = (
        operator.open(straight_picture, "table", "full")
        .click("left", frame_points["left"][:3])
        .snapshot
    )
    operator.draft()
    page.goto(f"{server.url}/#/library/images")
    second = server.api("POST", "/snapshots", json={"camera": "overhead"}).json()["id"]
    page.reload()
    expect(page.get_by_test_id(f"recent-{second}")).to_be_visible()
    old = OldAnswer(page, f"**/api/v1/drafts/{first}")
    page.get_by_test_id(f"recent-{first}").click()
    old.made()
    page.go_back()
    page.get_by_test_id(f"recent-{second}").click()
    expect(page).to_have_url(re.compile(f"#/calibrate/{second}/points"))
    old.comes()
    assert operator.snapshot == second
    expect(page.get_by_test_id("border-left")).not_to_contain_text(t("common.points", count=3))
