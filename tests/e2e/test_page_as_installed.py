"""The page of the wheel without extras: every place opens, a camera is added, and the console stays empty."""

from functools import partial

import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS, Server
from tests.e2e.test_addresses import ADDRESSES
from tests.support.installed import installed_python
from tests.support.waiting import until

# A place that is left before its socket is open; the picture of a rig whose camera has no calibration.
EXPECTED = ("WebSocket is closed before the connection is established", "/rigs/above/stitched.json")


class InstalledServer(Server):
    """Runs the installed `touchline`, in a folder in which the project's sources are not found."""

    def program(self) -> list[str]:
        return [str(installed_python().with_name("touchline"))]


@pytest.fixture
def installed(tmp_path):
    server = InstalledServer(tmp_path)
    yield server
    server.stop()


def test_every_place_opens_and_a_camera_is_added(page, installed):
    said: list[str] = []
    page.on("console", lambda message: said.append(f"{message.text} {message.location}"))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on(
        "response",
        lambda answer: (
            said.append(f"{answer.status} {answer.url}") if answer.status >= 400 else None
        ),
    )
    page.set_default_timeout(LONG_MS)
    page.goto(f"{installed.url}/#/cameras/new")
    page.get_by_test_id("camera-source").fill("sim://table?size=320x256&fps=5")
    page.get_by_test_id("do-try-camera").click()
    expect(page.get_by_test_id("tried")).to_be_visible(timeout=LONG_MS)
    page.get_by_test_id("camera-id").fill("spare")
    page.get_by_test_id("camera-field").select_option("table")
    page.get_by_test_id("next").click()
    expect(page.get_by_test_id("live-spare")).to_have_attribute(
        "data-state", "live", timeout=LONG_MS
    )

    taken = until(
        partial(installed.api, "POST", "/snapshots", json={"camera": "overhead"}),
        lambda answer: answer.ok,
    )
    rig = {"title": "", "field": "ssl-div-b", "cameras": [{"camera": "overhead", "region": "half"}]}
    assert installed.api("PUT", "/rigs/above", json=rig).ok
    for address, place in ADDRESSES.items():
        page.goto(f"{installed.url}/{address.replace('{}', taken.json()['id'])}")
        expect(page.get_by_test_id(place)).to_be_visible(timeout=LONG_MS)
    page.goto(f"{installed.url}/docs")
    expect(page.get_by_text("/api/v1/cameras").first).to_be_visible(timeout=LONG_MS)
    assert not [text for text in said if not any(part in text for part in EXPECTED)]
