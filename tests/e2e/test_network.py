"""Publishing to the network: switched on and off, what is lost, who else is there, and taking over from them."""

import re
import socket

import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS, press_activate
from tests.support import ssl_listener as listener
from tests.support.activation import activate_despite
from tests.support.exported import example, model_of
from tests.support.group_listener import Listener, free_group, said
from tests.support.league_geometry import packet_of
from tests.support.manual_pictures import manual_picture
from tests.support.rig_over_field import sim_task
from tests.support.words import t
from tests.unit.formats.test_league_files import SSL, settings
from touchline.formats import FORMATS
from touchline.league.packet import PublishingConfig, geometry_packet, published_cameras
from touchline.workflows import interchange

ASKED_MM = 10


def activate(server, camera: str, name: str, index: int) -> None:
    data = interchange.export(example(name, index), "json").data
    made = server.api(
        "POST", "/calibrations/import", files={"file": ("a.json", data)}, data={"camera": camera}
    ).json()
    activate_despite(server, made["id"])


def activate_half(server, camera: str, number: int) -> None:
    task = sim_task(2, number)
    data = FORMATS["json"].write(task.record(task.run(cross_validate=False)))
    made = server.api(
        "POST", "/calibrations/import", files={"file": data}, data={"camera": camera}
    ).json()
    activate_despite(server, made["id"])


def focal(came) -> float:
    return listener.Packet.FromString(came.data).geometry.calib[0].focal_length


def is_set(answer) -> bool:
    return answer.request.method == "PUT" and answer.url.endswith("/publishing")


def test_an_operator_publishes_sees_the_loss_and_takes_over_what_another_sends(page, own_server):
    way = free_group()
    activate(own_server, "overhead", "brown-conrady", 0)
    activate(own_server, "east", "fisheye", 1)
    page.goto(f"{own_server.url}/#/system/publishing")
    state = page.get_by_test_id("network-state")
    expect(state).to_have_attribute("data-state", "off")
    expect(page.get_by_test_id("sent-overhead")).to_contain_text(t("network.sent.ready"))

    with Listener(**way) as ear:
        for name, value in (
            {name: way[name] for name in ("group", "port", "ttl")} | {"limit_mm": ASKED_MM}
        ).items():
            page.get_by_test_id(f"network-{name}").fill(str(value))
            with page.expect_response(is_set):
                page.get_by_test_id(f"network-{name}").press("Tab")
        with page.expect_response(is_set):
            page.get_by_test_id("network-interface").select_option("lo")
        page.get_by_test_id("publish").click()
        expect(state).to_have_attribute("data-state", "on-air")
        expect(state).to_contain_text(
            t(
                "network.summary.sent",
                count=1,
                total=2,
                group=way["group"],
                port=way["port"],
                interface="lo",
            )
        )
        assert len(listener.Packet.FromString(ear.receive().data).geometry.calib) == 1

        # the notice says it, too
        expect(page.get_by_role("cell", name="both have camera number 0")).to_be_visible()
        page.get_by_test_id("number-east").fill("1")
        with page.expect_response(
            lambda r: r.request.method == "GET" and r.url.endswith("/publishing/heard")
        ):
            pass  # the panel is drawn again while the number is being typed
        expect(page.get_by_test_id("number-east")).to_have_value("1")
        page.get_by_test_id("number-east").press("Tab")
        page.get_by_test_id("approve-east").click()
        expect(page.get_by_test_id("sent-east")).to_have_attribute("data-published", "true")
        ear.hear_until(lambda came: len(listener.Packet.FromString(came.data).geometry.calib) == 2)

        expect(page.get_by_test_id("nobody")).to_be_visible()  # it listens while it publishes
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            theirs = listener.Packet.FromString(
                geometry_packet(published_cameras([example("ssl", 1)], PublishingConfig()))
            )
            theirs.geometry.models.chip_fixed_loss.MergeFrom(
                listener.CLASSES["SSL_BallModelChipFixedLoss"](
                    damping_xy_first_hop=0.5, damping_xy_other_hops=0.8, damping_z=0.5
                )
            )
            port = said(theirs.SerializeToString(), **way, sock=stranger)
            told = page.get_by_test_id("contradiction")
            expect(told).to_contain_text(
                t("network.contradiction", sender="127.0.0.1", number=0, camera="overhead"),
                timeout=LONG_MS,
            )
            expect(page.get_by_test_id("passed-on")).to_contain_text("127.0.0.1")
            ear.hear_until(
                lambda came: listener.Packet.FromString(came.data).geometry.HasField("models")
            )
            page.get_by_test_id(f"take-over-127.0.0.1-{port}-0").click()
            notice = page.get_by_test_id("notice").filter(
                has_text=t(
                    "network.kept", number=0, sender="127.0.0.1", version=2, camera="overhead"
                )
            )
            press_activate(page, notice.get_by_role("button", name=t("network.kept.activate")))
            ear.hear_until(
                lambda came: focal(came) == pytest.approx(model_of("ssl", 1).focal_px, rel=1e-6)
            )
            # both say the same now
            expect(page.get_by_test_id("contradiction")).to_have_count(0, timeout=LONG_MS)

        page.get_by_test_id("publish").click()
        expect(state).to_have_attribute("data-state", "off")
    assert re.search(
        "Received from 127.0.0.1", own_server.api("GET", "/calibrations").json()["items"][0]["note"]
    )


def test_a_sent_camera_of_a_field_that_is_unknown_here_has_a_line_under_the_drawing(
    page, own_server
):
    activate(own_server, "overhead", "brown-conrady", 0)
    field = own_server.api("GET", "/publishing").json()["cameras"][0]["field"]
    assert own_server.api("GET", f"/fields/{field}").status_code == 404
    page.goto(f"{own_server.url}/#/system/publishing")
    line = page.get_by_test_id("plan-without-overhead")
    expect(line.locator("b")).to_have_text(re.compile("^0 · "))
    expect(line).to_contain_text(t("network.plan.unknown-field", field=field))
    expect(page.get_by_test_id("plan-of-overhead")).to_have_count(0)
    for width, height in ((1440, 900), (1024, 768)):  # the first rows are in sight
        page.set_viewport_size({"width": width, "height": height})
        expect(page.get_by_test_id("sent-overhead")).to_be_in_viewport(ratio=1)


def test_the_field_shows_each_camera_that_goes_out_and_why_others_do_not(page, own_server):
    for number, camera in enumerate(("overhead", "east")):  # the left half and the right one
        activate_half(own_server, camera, number)
    way = {**free_group(), "interface": "lo"}
    assert own_server.api("PUT", "/publishing", json={**way, "enabled": True}).ok
    page.goto(f"{own_server.url}/#/system/publishing")
    overhead, east, table = (
        page.get_by_test_id(f"plan-of-{id}") for id in ("overhead", "east", "table")
    )
    absent = page.locator("[data-testid=plan-ssl-div-b] .area.absent")
    expect(overhead.locator("b")).to_have_text(re.compile("^0 · "))
    expect(east.locator("b")).to_have_text(re.compile("^1 · "))
    error = page.get_by_test_id("sent-east").locator("td").nth(2).inner_text()
    expect(east).to_contain_text(t("network.plan.error", error=error))
    expect(table).to_contain_text(t("network.plan.uncalibrated"))
    expect(page.locator("[data-testid=plan-vsss-3v3] .area.absent")).to_have_count(1)
    expect(absent).to_have_count(0)
    expect(page.get_by_test_id("network-state")).to_have_attribute("data-state", "on-air")
    page.set_viewport_size({"width": 1280, "height": 1120})
    manual_picture(page.get_by_test_id("network"), "ssl-vision")
    page.get_by_test_id("program-files").locator("summary").click()
    file = {"name": "robocup-ssl.xml", "mimeType": "text/xml", "buffer": settings(SSL, SSL, SSL)}
    with page.expect_download() as saved:
        page.get_by_test_id("ssl-vision-settings").set_input_files(file)
    assert saved.value.suggested_filename == "robocup-ssl.xml"
    updated = saved.value.path().read_bytes()
    assert updated.startswith(file["buffer"][:40]) and updated != file["buffer"]
    notes = page.get_by_test_id("ssl-vision-notes")
    expect(notes).to_contain_text("Replaced: the field, and the cameras with these numbers: 0, 1.")
    expect(notes).to_contain_text("Unchanged")
    manual_picture(page.get_by_test_id("program-files"), "program-files")
    page.get_by_test_id("number-east").fill("0")
    page.get_by_test_id("number-east").press("Tab")
    expect(east).to_contain_text(t("network.plan.number-taken"))
    expect(east.locator("b")).not_to_contain_text("·")
    expect(absent).to_have_count(1)


def test_a_rig_is_published_separately_and_goes_back_to_the_others(page, own_server):
    for number, camera in enumerate(("overhead", "east")):
        activate_half(own_server, camera, number)
    rig = {"title": "Field B", "field": "ssl-div-b", "cameras": ["east"]}
    assert own_server.api("PUT", "/rigs/field-b", json=rig).status_code == 201
    way = {**free_group(), "interface": "lo"}
    assert own_server.api("PUT", "/publishing", json={**way, "listen_first_s": 0}).ok
    page.goto(f"{own_server.url}/#/system/publishing")
    expect(page.get_by_test_id("sent-east")).to_be_visible(timeout=LONG_MS)
    page.get_by_test_id("network-separate").select_option("field-b")
    expect(page.get_by_test_id("network-rig")).to_have_value("field-b")
    expect(page.get_by_test_id("sent-overhead")).to_have_count(0)
    expect(page.get_by_test_id("sent-east")).to_be_visible()
    own = free_group()
    for name, value in {"group": own["group"], "port": own["port"], "ttl": 0}.items():
        page.get_by_test_id(f"network-{name}").fill(str(value))
        with page.expect_response(lambda r: r.request.method == "PUT" and "rig=field-b" in r.url):
            page.get_by_test_id(f"network-{name}").press("Tab")
    page.get_by_test_id("network-interface").select_option("lo")
    with Listener(**own) as ear:
        page.get_by_test_id("publish").click()
        state = page.get_by_test_id("network-state")
        expect(state).to_have_attribute("data-state", "on-air", timeout=LONG_MS)
        assert len(listener.Packet.FromString(ear.receive().data).geometry.calib) == 1
        expect(page.get_by_test_id("network-together")).to_be_disabled()
        expect(page.get_by_test_id("plan-of-overhead")).to_have_count(0)
        page.set_viewport_size({"width": 1280, "height": 900})
        manual_picture(page.get_by_test_id("network"), "separate-rig")
        page.get_by_test_id("network-rig").select_option("")
        expect(state).to_have_attribute("data-state", "off")
        expect(page.get_by_test_id("sent-east")).to_have_count(0)
        expect(page.get_by_test_id("sent-overhead")).to_be_visible()
        page.get_by_test_id("network-rig").select_option("field-b")
        expect(state).to_have_attribute("data-state", "on-air")
        page.get_by_test_id("publish").click()
        page.get_by_test_id("network-together").click()
    expect(page.get_by_test_id("network-rig")).to_have_count(0)
    expect(page.get_by_test_id("sent-overhead")).to_be_visible()
    expect(page.get_by_test_id("sent-east")).to_be_visible()


@pytest.mark.long
def test_an_interface_that_is_not_there_is_told_on_the_page(page, own_server):
    page.goto(f"{own_server.url}/#/system/publishing")
    assert own_server.api("PUT", "/publishing", json={"interface": "gone0"}).ok
    page.reload()
    page.get_by_test_id("publish").click()
    expect(
        page.get_by_test_id("notice").filter(has_text="This computer has no interface gone0.")
    ).to_be_visible()
    expect(page.get_by_test_id("network-state")).to_have_attribute("data-state", "off")


def test_beside_another_program_it_asks_and_takes_its_ball_models(page, own_server):
    way = free_group()
    activate_half(own_server, "overhead", 0)
    quick = {**way, "interface": "lo", "absorb": True, "listen_first_s": 0, "interval_s": 0.1}
    assert own_server.api("PUT", "/publishing", json=quick).ok
    page.goto(f"{own_server.url}/#/system/publishing")
    theirs = packet_of("ssl-vision", "ssl-div-b").SerializeToString()
    with Listener(**way) as ear, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        expect(page.get_by_test_id("nobody")).to_be_visible(timeout=LONG_MS)
        port = said(theirs, **way, sock=stranger)
        expect(page.get_by_test_id(f"heard-127.0.0.1-{port}")).to_be_visible(timeout=LONG_MS)
        page.get_by_test_id("publish").click()
        expect(page.get_by_test_id("asking")).to_be_visible(timeout=LONG_MS)
        expect(page.get_by_test_id("network-state")).to_have_attribute("data-state", "asking")
        with page.expect_download() as file:
            page.get_by_test_id("geometry-file").click()
        assert b"calib:" in file.value.path().read_bytes()
        expect(page.get_by_test_id("asking")).to_contain_text("Only you send the cameras")
        expect(page.get_by_test_id("sent-overhead")).to_contain_text(t("network.sent.ready"))
        page.set_viewport_size({"width": 1280, "height": 1200})
        manual_picture(page.get_by_test_id("network"), "another-publisher")
        page.get_by_test_id("publish-both").click()
        expect(page.get_by_test_id("asking")).to_have_count(0)
        ear.hear_until(lambda came: came.sender[1] != port)
        expect(page.get_by_test_id("sent-overhead")).to_contain_text(t("network.sent.sent"))

        models = page.get_by_test_id("ball-models")
        models.locator("summary").click()
        page.get_by_test_id(f"ball-copy-127.0.0.1-{port}").click()
        expect(page.get_by_test_id("ball-acc_roll")).to_have_value("-0.4")
        with page.expect_response(is_set):
            page.get_by_test_id("ball-acc_roll").fill("-0.3")
            page.get_by_test_id("ball-acc_roll").press("Enter")
        said_now = own_server.api("GET", "/publishing").json()["ball_models"]
        assert said_now["straight_two_phase"]["acc_roll"] == -0.3
        with page.expect_response(is_set):
            page.get_by_test_id("ball-clear").click()
        for name, value in (("acc_slide", "-3"), ("acc_roll", "-0.4")):
            page.get_by_test_id(f"ball-{name}").fill(value)
            page.get_by_test_id(f"ball-{name}").press("Tab")
        assert own_server.api("GET", "/publishing").json()["ball_models"] is None  # one is missing
        with page.expect_response(is_set):
            page.get_by_test_id("ball-k_switch").fill("0.6")
            page.get_by_test_id("ball-k_switch").press("Tab")
        expect(page.get_by_test_id("ball-acc_slide")).to_have_value("-3")
        assert own_server.api("GET", "/publishing").json()["ball_models"] == {
            "straight_two_phase": {"acc_slide": -3.0, "acc_roll": -0.4, "k_switch": 0.6},
            "chip_fixed_loss": None,
        }
