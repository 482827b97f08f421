"""What the server says of itself reaches the operator: damage stands above the picture, and stops nothing."""

import json
import sqlite3

from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.demo_cameras import CAMERAS
from tests.support.manual_pictures import manual_picture
from tests.support.words import like, t


def test_a_damaged_version_is_a_banner_with_what_to_do_and_the_page_goes_on(page, own_server):
    api = own_server.api
    lens = {"resolution": {"width": 640, "height": 480}, "distCoeffs": {"rows": 1, "cols": 5, "type": 6,
            "data": [-0.2, 0.03, 0, 0, 0]}, "cameraIntrinsics": {"rows": 3, "cols": 3, "type": 6,
            "data": [620, 0, 319.5, 0, 620, 239.5, 0, 0, 1]}}
    kept = api("POST", "/calibrations/import", files={"file": ("lens.photon.json", json.dumps(lens))})
    assert kept.status_code == 201, kept.text
    own_server.stop()
    (database,) = own_server.data.glob("*.sqlite*") if list(own_server.data.glob("*.sqlite")) else [
        path for path in own_server.data.iterdir() if path.suffix in (".db", ".sqlite3")]
    with sqlite3.connect(database) as rows:
        assert rows.execute("UPDATE lenses SET body = replace(body, '640', '641')").rowcount == 1
    rows.close()
    own_server.start()
    (damage,) = api("GET", "/health").json()["damaged"]
    page.goto(own_server.url)
    told = page.get_by_test_id("problem").filter(has_text=like("shell.problem.damaged"))  # a full disk is told as well
    expect(told).to_have_count(1, timeout=LONG_MS)
    page.get_by_test_id("bell").click()
    expect(told).to_contain_text(damage["file"])
    expect(told).to_contain_text(damage["note"] or t("shell.problem.damaged.fix"))
    for camera in CAMERAS:
        expect(page.get_by_test_id(f"live-{camera['id']}")).to_have_attribute("data-state", "live", timeout=LONG_MS)
    manual_picture(page, "troubleshooting")
    told.get_by_role("link").click()
    expect(page.get_by_test_id("health-warnings")).to_contain_text(damage["file"])
    expect(page.get_by_test_id("status")).to_have_attribute("data-level", "bad")  # told as long as it is so
