"""Addresses: each view has one that a reload, the way back and another tab lead to; former ones lead to the present."""

import re

import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.waiting import until
from tests.support.words import like, t

# A former address, the present one, and what is to be seen there. {}: a picture, see `kept`.
ADDRESSES = [
    ("#/", "#/cameras", "camera-overhead"),
    ("#/live/overhead", "#/cameras/overhead/live", "live-desk"),
    ("#/live/new camera", "#/cameras/new", "camera-form"),
    ("#/seeing/overhead", "#/cameras/overhead/detection", "seeing-page"),
    ("#/versions/overhead", "#/cameras/overhead/versions", "versions-page"),
    ("#/versions", "#/library/versions", "versions-page"),
    ("#/library", "#/library/images", "images-page"),
    ("#/cameras/overhead", "#/cameras/overhead/live", "live-desk"),
    ("#/cameras/overhead/calibrate", "#/cameras/overhead/calibrate", "camera-images-page"),
    ("#/cameras/overhead/drift", "#/cameras/overhead/drift", "drift-page"),
    ("#/cameras/overhead/settings", "#/cameras/overhead/settings", "tab-camera-form"),
    ("#/field", "#/field", "field-page"),
    ("#/lenses", "#/lenses", "lenses-page"),
    ("#/library/import", "#/library/import", "import-page"),
    ("#/system", "#/system/publishing", "publishing-page"),
    ("#/rig", "#/field/new", "new-rig-page"),
    ("#/rig/above", "#/field/rigs/above", "rig-page"),
    ("#/pair", "#/field/pairs", "pair-desk"),
    ("#/pair/{}/{}", "#/field/pairs/{}/{}", "picture-b"),
    ("#/scene", "#/field/scene", "scene-page"),
    ("#/scene/rig/above", "#/field/scene/rig/above", "scene-page"),
    ("#/lens", "#/lenses/board", "board-desk"),
    ("#/capture/overhead", "#/lenses/board/overhead", "capture-page"),
    ("#/straight", "#/lenses/edges", "straight-desk"),
    ("#/rolls/overhead", "#/lenses/ball/overhead", "rolls-page"),
    ("#/jobs", "#/system/jobs", "jobs-page"),
    ("#/settings", "#/system/server", "settings-page"),
    ("#/{}", "#/calibrate/{}/field", "step-field"),
    ("#/{}/picture", "#/calibrate/{}/field", "step-field"),
    ("#/{}/borders", "#/calibrate/{}/points", "step-points"),
    ("#/{}/model", "#/calibrate/{}/points", "models"),
    ("#/{}/compare", "#/calibrate/{}/verify", "step-verify"),
    ("#/{}/activate", "#/calibrate/{}/verify", "step-verify"),
    ("#/calibrate/{}", "#/calibrate/{}/field", "step-field"),
]


@pytest.fixture(scope="module")
def kept(server):
    """The id of a picture; beside it there is a rig called above."""
    rig = {"title": "", "field": "ssl-div-b", "cameras": [{"camera": "overhead", "region": "half"}]}
    assert server.api("PUT", "/rigs/above", json=rig).ok
    yield until(lambda: server.api("POST", "/snapshots", json={"camera": "overhead"}), lambda a: a.ok).json()["id"]
    server.api("DELETE", "/rigs/above")


def test_former_addresses_lead_to_the_present_ones_and_a_reload_or_the_way_back_shows_the_same(operator, kept):
    page, url = operator.page, operator.server.url

    def is_at(address: str, place: str) -> None:
        expect(page).to_have_url(f"{url}/{address}", timeout=LONG_MS)
        there = page.get_by_test_id(place)
        if place.startswith("step-"):
            expect(there).to_have_attribute("aria-current", "step", timeout=LONG_MS)
        expect(there).to_be_visible(timeout=LONG_MS)

    visited = []
    for former, present, place in ADDRESSES:
        former, present = former.replace("{}", kept), present.replace("{}", kept)
        page.goto(f"{url}/{former}")
        is_at(present, place)
        page.reload()
        is_at(present, place)
        visited.append((present, place))
    for present, place in reversed(visited[:-1]):  # a former address is no stop on the way back
        page.go_back()
        is_at(f"{present}/{kept}/{kept}" if present == "#/field/pairs" else present, place)  # the last two pictures


def test_an_address_of_nothing_says_so_and_leads_on(operator):
    page, url = operator.page, operator.server.url
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
