"""What the server says of itself reaches the operator: damage stands above the picture, and stops nothing."""

import json
import sqlite3
from contextlib import closing

from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.demo_cameras import CAMERAS
from tests.support.manual_pictures import manual_picture
from tests.support.waiting import until
from tests.support.words import like

LENS = {
    "resolution": {"width": 640, "height": 480},
    "distCoeffs": {"rows": 1, "cols": 5, "type": 6, "data": [-0.2, 0.03, 0, 0, 0]},
    "cameraIntrinsics": {
        "rows": 3,
        "cols": 3,
        "type": 6,
        "data": [620, 0, 319.5, 0, 620, 239.5, 0, 0, 1],
    },
}


def imported_lens(api):
    kept = api(
        "POST", "/calibrations/import", files={"file": ("lens.photon.json", json.dumps(LENS))}
    )
    assert kept.status_code == 201, kept.text
    return kept.json()


def damage_lens(data, old, new):
    with closing(sqlite3.connect(data / "touchline.db")) as rows:
        assert (
            rows.execute("UPDATE lenses SET body = replace(body, ?, ?)", (old, new)).rowcount == 1
        )
        rows.commit()


def test_damage_is_a_banner_and_the_newest_good_backup_is_restored_once_it_is_said_what_that_costs(
    page, standing_context, own_server
):
    api = own_server.api
    imported_lens(api)
    (lens,) = api("GET", "/lenses").json()["items"]
    own_server.stop()  # it makes the last backup
    damage_lens(own_server.data, "640", "650")
    own_server.start()
    assert api("GET", f"/lenses/{lens['id']}").status_code == 503
    is_told_and_the_page_goes_on(page, own_server)

    newer = api("POST", "/cameras", json={**CAMERAS[0], "id": "newer", "name": "Newer"})
    assert newer.status_code == 201, newer.text
    other = standing_context.new_page()
    other.goto(own_server.url)
    expect(other.get_by_test_id("camera-newer")).to_be_visible(timeout=LONG_MS)
    page.get_by_test_id("find-backup").click(timeout=LONG_MS)
    told = page.get_by_test_id("restoration")
    expect(told).to_contain_text(like("settings.restore.backup"))
    expect(told).to_contain_text(like("settings.restore.lost", count=2))
    expect(told).to_contain_text("replaced")
    page.get_by_test_id("restore-cancel").click()
    expect(told).to_have_count(0)
    assert api("GET", f"/lenses/{lens['id']}").status_code == 503, "nothing was done"
    page.get_by_test_id("find-backup").click()
    with other.expect_event("load", timeout=LONG_MS):
        page.get_by_test_id("restore-backup").click()
    expect(page.get_by_test_id("replaced")).to_contain_text("touchline.db", timeout=LONG_MS)
    expect(page.get_by_text(like("shell.problem.damaged"))).to_have_count(0)
    expect(page.get_by_test_id("find-backup")).to_have_count(0)
    assert (
        until(lambda: api("GET", f"/lenses/{lens['id']}"), lambda answer: answer.ok).json()["id"]
        == lens["id"]
    )
    expect(other.get_by_test_id("camera-newer")).to_have_count(0, timeout=LONG_MS)
    page.goto(f"{own_server.url}/#/lenses")
    expect(page.get_by_text("640 × 480 px")).to_be_visible(timeout=LONG_MS)


def is_told_and_the_page_goes_on(page, server):
    """By a banner that says what to do, and leads to where it is done."""
    (damage,) = server.api("GET", "/health").json()["damaged"]
    page.goto(server.url)
    # a full disk is told as well
    told = page.get_by_test_id("problem").filter(has_text=like("shell.problem.damaged"))
    expect(told).to_have_count(1, timeout=LONG_MS)
    page.get_by_test_id("bell").click()
    expect(told).to_contain_text(damage["file"])
    expect(told).to_contain_text(damage["fix"])
    for camera in CAMERAS:
        expect(page.get_by_test_id(f"live-{camera['id']}")).to_have_attribute(
            "data-state", "live", timeout=LONG_MS
        )
    manual_picture(page, "troubleshooting")
    told.get_by_role("link").click()
    expect(page.get_by_test_id("health-warnings")).to_contain_text(damage["file"])
    # told as long as it is so
    expect(page.get_by_test_id("status")).to_have_attribute("data-level", "bad")
