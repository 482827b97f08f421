"""A rig, by the page: made of two cameras, seen as one picture, checked, and told which camera was knocked."""

import json
import re

import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.activation import activate_despite
from tests.support.live_play import Before
from tests.support.manual_pictures import manual_picture
from tests.support.rig_over_field import sim_task
from tests.support.waiting import until
from tests.support.words import like, t
from touchline.formats import FORMATS

ADDRESS = "sim://ssl-div-b?cameras=2&camera={}&lens=half&tilt=6&fill=0.86&robots=0&fps=10"
KNOCK_MM = 50


@pytest.fixture
def two_cameras(server):
    """Two live cameras over one field; the second was knocked after it was calibrated."""
    ids, active = ("rig-north", "rig-south"), []
    for number, id in enumerate(ids):
        added = server.api(
            "POST",
            "/cameras",
            json={
                "id": id,
                "name": id.title(),
                "source": ADDRESS.format(number),
                "field": "ssl-div-b",
                "region": ("half-left", "half-right")[number],
            },
        )
        assert added.ok, added.text
        task = sim_task(2, number)
        record = json.loads(FORMATS["json"].write(task.record(task.run(cross_validate=False))))
        where = record.get("calibration", record)
        where["camera"] = id
        if number == 1:
            where["model"]["parameters"]["position_mm"][0] += KNOCK_MM
        made = server.api(
            "POST", "/calibrations/import", files={"file": json.dumps(record).encode()}
        ).json()
        activate_despite(server, made["id"])
        active.append(made["id"])
    for id in ids:  # a picture of all is taken once, of those that are awake
        are_live(server, id)
    yield ids
    server.api("DELETE", "/rigs/hall")
    for id in ids:
        server.api("DELETE", f"/cameras/{id}")


def are_live(server, id):
    until(
        lambda: server.api("GET", f"/cameras/{id}/status").json()["state"],
        lambda state: state == "live",
        120,
    )


def without_south(route):
    """As while that camera wakes up: the page has to ask again by itself."""
    answer = route.fetch()
    route.fulfill(
        response=answer,
        headers={**answer.headers, "x-rig-missing": "rig-south"},
    )


def test_a_rig_is_made_seen_and_checked_and_the_knocked_camera_is_named(page, server, two_cameras):
    page.goto(f"{server.url}/#/field")
    page.get_by_test_id("do-new-rig").click()
    page.get_by_test_id("rig-name").fill("hall")
    page.get_by_test_id("rig-field").select_option("ssl-div-b")
    expect(page.get_by_test_id(f"with-{two_cameras[1]}")).to_be_visible()
    for box in page.locator("input[type=checkbox][data-testid^=with-]").all():
        box.set_checked(box.get_attribute("data-testid") in [f"with-{id}" for id in two_cameras])
    expect(page.get_by_test_id("part-rig-south")).to_have_value("half-right")
    page.route("**/rigs/hall/stitched.jpg*", without_south, times=1)
    page.get_by_test_id("make-rig").click()
    expect(page.get_by_test_id("rig-page")).to_be_visible(timeout=LONG_MS)
    assert page.url.endswith("#/field/rigs/hall")
    south, seam = (
        page.get_by_test_id(f"over-{two_cameras[1]}"),
        page.get_by_test_id("seam-rig-north-rig-south"),
    )
    expect(south).to_contain_text(t("rig.absent.no-image"), timeout=LONG_MS)
    expect(south.get_by_role("link")).to_have_attribute("href", "#/cameras/rig-south/live")
    expect(south).not_to_contain_text(t("rig.absent.no-image"), timeout=LONG_MS)
    expect(south).to_have_text("Rig-South")
    expect(seam).to_have_text(t("rig.seam.unchecked"))
    picture = page.get_by_test_id("stitched")
    expect(picture).to_be_visible(timeout=LONG_MS)
    expect(picture).to_have_js_property("naturalWidth", 1200, timeout=LONG_MS)
    expect(page.get_by_test_id("unseen")).to_contain_text("The whole field is covered")
    expect(page.locator("[data-testid=rig-overlay] .paint path").nth(9)).to_be_attached()
    page.get_by_test_id("check-rig").click()
    verdict = page.get_by_test_id("rig-verdict")
    expect(verdict).to_have_attribute("data-level", "poor", timeout=2 * LONG_MS)
    expect(verdict).to_contain_text("The error is in Rig-South")
    expect(page.get_by_test_id("rig-worst")).to_contain_text(like("rig.picture.worst"))
    expect(seam).to_have_attribute("data-level", "poor")
    mean, most = (
        float(page.get_by_test_id(id).inner_text().split(" ")[0])
        for id in ("pair-mean", "pair-max")
    )
    assert mean == pytest.approx(KNOCK_MM, rel=0.1)
    assert mean <= most < 1.5 * KNOCK_MM  # at the worst place the clicked lens may be wrong as well
    median, largest = (float(v) for v in re.findall(r"\d+(?:\.\d+)?", seam.inner_text()))
    assert median == pytest.approx(KNOCK_MM, rel=0.1) and largest == most
    expect(page.locator("[data-testid=cells] rect").nth(20)).to_be_attached()
    manual_picture(page, "rigs")
    page.get_by_test_id("plane-hat").press("Enter")
    expect(page.get_by_test_id("plane-hat")).to_have_attribute("aria-pressed", "true")
    page.get_by_test_id("show-map").press("Enter")
    expect(page.get_by_test_id("rig-worst")).to_have_count(0)
    page.reload()
    expect(page.get_by_test_id("rig-page")).to_be_visible(timeout=LONG_MS)
    # its lines are not where they were calibrated, and that is an alarm by now
    expect(seam).to_have_text(t("rig.seam.moved"), timeout=LONG_MS)
    expect(verdict).to_contain_text("no longer valid")
    page.get_by_test_id("rail-field").click()
    field = page.get_by_test_id("field-card-ssl-div-b")
    expect(field.get_by_test_id("over-rig-north")).to_be_visible(timeout=LONG_MS)
    row = field.locator("li", has=page.get_by_test_id("rig-hall"))
    expect(row.locator(".level")).to_contain_text("mm")
    expect(row).to_contain_text("Rig-North and Rig-South")


def test_a_rig_without_calibrations_shows_its_field_and_what_to_press(page, server):
    made = server.api("PUT", "/rigs/bare", json={"field": "vsss-3v3", "cameras": ["table"]})
    assert made.status_code == 201, made.text
    try:
        page.goto(f"{server.url}/#/field/rigs/bare")
        expect(page.get_by_test_id("no-stitched")).to_be_visible(timeout=LONG_MS)
        camera = page.get_by_test_id("over-table")
        expect(camera).to_contain_text(t("rig.absent.uncalibrated"))
        expect(page.locator("[data-testid=rig-overlay] .absent")).to_have_count(1)
        expect(page.locator("[data-testid=rig-overlay] .paint path").nth(5)).to_be_attached()
        camera.get_by_role("link", name=t("rig.absent.calibrate")).click()
        expect(page).to_have_url(f"{server.url}/#/cameras/table/calibrate")
    finally:
        server.api("DELETE", "/rigs/bare")


@pytest.mark.long
def test_cameras_with_other_rectangles_are_refitted_by_one_button_and_not_activated(
    page, server, two_cameras
):
    body = {
        "field": "ssl-div-b",
        "cameras": [{"camera": "rig-north"}],
        "w_max_rectangle_px": 90,
        "h_max_rectangle_px": 80,
        "n_rectangles_x": 9,
        "n_rectangles_y": 12,
    }
    assert server.api("PUT", "/rigs/hall", json=body).status_code == 201
    before = server.api("GET", "/cameras/rig-north").json()["active_calibration"]
    page.goto(f"{server.url}/#/field/rigs/hall")
    expect(page.get_by_test_id("member-rig-north")).to_contain_text(
        "Fit Rig-North again", timeout=LONG_MS
    )
    page.get_by_test_id("refit-rig").click()
    expect(page.get_by_text(t("rig.notice.refitted", count=1))).to_be_visible(timeout=2 * LONG_MS)
    versions = server.api("GET", "/calibrations?camera=rig-north").json()["items"]
    assert versions[0]["parent"] == before and not versions[0]["active"]
    assert server.api("GET", "/cameras/rig-north").json()["active_calibration"] == before


@pytest.mark.long
def test_ball_and_robots_of_all_cameras_stand_on_the_field_once_each_with_the_seam(
    page, server, tmp_path
):
    """The same play before two cameras whose pictures overlap at the middle."""
    plays = [
        Before(name, 8, region, "field", 20, 0.8)
        for name, region in (("low", "quarter-bottom-left"), ("high", "quarter-top-left"))
    ]
    api = Client(server)
    profile = None
    try:
        for play in plays:
            assert server.api("POST", "/cameras", json=play.settings).ok
            play.calibrate(api)
            asked = {"clicks": play.clicks(), "base": profile}
            learned = until(  # its process may still be starting
                lambda at=f"/cameras/{play.name}/colours/learn", asked=asked: server.api(
                    "POST", at, json=asked
                ),
                lambda answer: answer.status_code != 503,
                120,
            )
            profile = learned.json()["profile"]
        assert server.api("PUT", "/colours/hall", json={"profile": profile}).ok
        for play in plays:
            assert server.api(
                "PUT",
                f"/cameras/{play.name}/seeing",
                headers={"If-Match": "unset"},
                json={"on": True, "plan": "ssl", "colours": "hall"},
            ).ok
            are_live(server, play.name)
        assert server.api(
            "PUT", "/rigs/west", json={"field": "ssl-div-b", "cameras": ["low", "high"]}
        ).ok
        page.goto(f"{server.url}/#/field/rigs/west")
        expect(page.get_by_test_id("stitched")).to_be_visible(timeout=LONG_MS)
        page.get_by_test_id("do-follow-play").click()
        told = [like("rig.tracks.seam", **how_many).pattern for how_many in ({}, {"count": 1})]
        expect(page.get_by_test_id("seam")).to_contain_text(
            re.compile("|".join(told)), timeout=2 * LONG_MS
        )
        expect(page.get_by_test_id("track-robot").nth(5)).to_be_attached(timeout=LONG_MS)
        page.screenshot(path=tmp_path / "tracks.png")
        page.get_by_test_id("do-follow-play").click()
        expect(page.get_by_test_id("track-report")).to_have_count(0)
    finally:
        server.api("DELETE", "/rigs/west")
        for play in plays:
            server.api("DELETE", f"/cameras/{play.name}")


class Client:
    """The server, as the tests of REST speak to theirs."""

    def __init__(self, server) -> None:
        self.server = server

    def post(self, address, **more):
        answer = self.server.api("POST", address.removeprefix("/api/v1"), **more)
        answer.is_success = answer.ok
        return answer
