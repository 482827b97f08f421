"""Addresses: each view has one that a reload, the way back and another tab lead to; former ones lead to the present."""

import re

import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.waiting import until
from tests.support.words import like, t

# What is to be seen at each address; {}: a picture. tests/page/addresses.test.mjs has all former ones.
ADDRESSES = {
    "#/cameras": "camera-overhead",
    "#/cameras/new": "camera-form",
    "#/cameras/overhead/live": "live-desk",
    "#/cameras/overhead/calibrate": "camera-images-page",
    "#/cameras/overhead/drift": "drift-page",
    "#/cameras/overhead/detection": "seeing-page",
    "#/cameras/overhead/settings": "tab-camera-form",
    "#/cameras/overhead/versions": "versions-page",
    "#/field": "field-page",
    "#/field/new": "new-rig-page",
    "#/field/rigs/above": "rig-page",
    "#/field/scene": "scene-page",
    "#/field/scene/rig/above": "scene-page",
    "#/lenses": "lenses-page",
    "#/lenses/board": "board-desk",
    "#/lenses/board/overhead": "capture-page",
    "#/lenses/edges": "straight-desk",
    "#/lenses/ball/overhead": "rolls-page",
    "#/library/images": "images-page",
    "#/library/versions": "versions-page",
    "#/library/import": "import-page",
    "#/system/publishing": "publishing-page",
    "#/system/jobs": "jobs-page",
    "#/system/server": "settings-page",
    "#/calibrate/{}/field": "step-field",
    "#/calibrate/{}/points": "step-points",
    "#/calibrate/{}/verify": "step-verify",
}
FORMER = {
    "#/": "#/cameras",
    "#/scene/rig/above": "#/field/scene/rig/above",
    "#/pair": "#/field",
    "#/capture/overhead": "#/lenses/board/overhead",
    "#/jobs": "#/system/jobs",
    "#/{}/activate": "#/calibrate/{}/verify",
}


@pytest.fixture(scope="module")
def kept(server):
    """The id of a picture; beside it there is a rig called above."""
    rig = {"title": "", "field": "ssl-div-b", "cameras": [{"camera": "overhead", "region": "half"}]}
    assert server.api("PUT", "/rigs/above", json=rig).ok
    yield until(
        lambda: server.api("POST", "/snapshots", json={"camera": "overhead"}), lambda a: a.ok
    ).json()["id"]
    server.api("DELETE", "/rigs/above")


def test_former_addresses_lead_to_the_present_ones_and_a_reload_or_the_way_back_shows_the_same(
    operator, kept
):
    page, url = operator.page, operator.server.url

    def is_at(address: str) -> None:
        expect(page).to_have_url(f"{url}/{address.replace('{}', kept)}", timeout=LONG_MS)
        there = page.get_by_test_id(ADDRESSES[address])
        if address.startswith("#/calibrate"):
            expect(there).to_have_attribute("aria-current", "step", timeout=LONG_MS)
        expect(there).to_be_visible(timeout=LONG_MS)

    for former, present in FORMER.items():
        page.goto(f"{url}/{former.replace('{}', kept)}")
        is_at(present)
        page.reload()
        is_at(present)
    for present in reversed([*FORMER.values()][:-1]):  # a former address is no stop on the way back
        page.go_back()
        is_at(present)
    is_said_to_lead_nowhere(page, url)


def is_said_to_lead_nowhere(page, url: str) -> None:
    """An address of nothing says so, and leads on."""
    for address in ("#/system/nothing", "#/%E0%A4%A", "#/calibrate/1/2/3/4"):
        page.goto(f"{url}/{address}")
        expect(page.get_by_role("heading", name=t("shell.nowhere.title")).first).to_be_visible()
    page.get_by_role("link", name=t("shell.back-to-cameras")).click()
    expect(page).to_have_url(re.compile("#/cameras$"))
    for address in ("#/cameras/nobody/live", "#/cameras/nobody/settings", "#/lenses/ball/nobody"):
        page.goto(f"{url}/{address}")
        expect(page.get_by_role("heading", name=t("shell.nowhere.no-camera"))).to_be_visible()
    page.goto(f"{url}/#/calibrate/{'0' * 16}/points")
    expect(page.get_by_test_id("notice")).to_contain_text(like("calibrate.pictures.not-opened"))
    expect(page).to_have_url(re.compile("#/cameras$"))
