"""Several fields in one hall: what a rig publishes separately, and two servers on one machine."""

import socket
from contextlib import ExitStack, contextmanager

import pytest
from starlette.testclient import TestClient

from tests.support import ssl_listener as listener
from tests.support.activation import activate_despite
from tests.support.group_listener import LO, Listener, free_group
from tests.support.publishing import over
from tests.support.refusals import API, refusal
from tests.support.waiting import until
from touchline.detection.service import DetectionService
from touchline.main import create_app
from touchline.settings import Settings
from touchline.store.fields import load_fields
from touchline.workflows import interchange

HERE = "http://127.0.0.1:8000"
FIELDS = load_fields()
CAMERAS = {"north": "ssl-div-b", "south": "ssl-div-a"}  # by the field that it covers


@contextmanager
def served(folder, cameras=tuple(CAMERAS)):
    """A server with these cameras, each calibrated above its field and in a rig of its own."""
    settings = Settings(
        data=folder,
        publish={"listen_first_s": 0, "interval_s": 0.1},
        cameras=[
            {"id": id, "source": "sim://table?size=320x256&fps=5", "field": CAMERAS[id]}
            for id in cameras
        ],
    )
    with TestClient(create_app(settings), base_url=HERE) as client:
        for id in cameras:
            if client.get(f"{API}/rigs/{id}-rig").status_code == 200:
                continue
            made = client.post(
                f"{API}/calibrations/import",
                files={
                    "file": ("a.json", interchange.export(over(FIELDS[CAMERAS[id]]), "json").data)
                },
                data={"camera": id},
            )
            assert made.status_code == 201, made.text
            activate_despite(client, made.json()["id"])
            assert save_rig(client, f"{id}-rig", CAMERAS[id], [id]).status_code == 201
        yield client


def save_rig(client, name, field, cameras, **headers):
    body = {"field": field, "cameras": cameras}
    return client.put(f"{API}/rigs/{name}", json=body, headers=headers)


def put(client, rig="", **changes):
    answer = client.put(f"{API}/publishing", params={"rig": rig}, json=changes)
    assert answer.status_code == 200, answer.text
    return answer.json()


def state(client, rig=""):
    answer = client.get(f"{API}/publishing", params={"rig": rig})
    assert answer.status_code == 200, answer.text
    return answer.json()


def heard(client, rig=""):
    return client.get(f"{API}/publishing/heard", params={"rig": rig}).json()


def lengths(ear, packets=5) -> set[int]:
    """The lengths of the fields in the next packets."""
    came = [ear.receive() for _ in range(packets)]
    return {listener.Packet.FromString(one.data).geometry.field.field_length for one in came}


@pytest.fixture
def client(tmp_path):
    with served(tmp_path / "data") as client:
        yield client


def test_two_rigs_of_one_server_are_in_no_packet_of_each_other(client):
    north, south = free_group(), free_group()
    with Listener(**north) as ear_north, Listener(**south) as ear_south:
        assert not put(client, "north-rig", **north)["enabled"]
        put(client, "north-rig", enabled=True)
        put(client, "south-rig", enabled=True, **south)
        assert lengths(ear_north) == {9000} and lengths(ear_south) == {12000}
        for rig in ("north-rig", "south-rig"):
            until(lambda rig=rig: state(client, rig)["state"] == "on-air")
            until(lambda rig=rig: heard(client, rig)["own"] > 3)
            assert heard(client, rig)["items"] == []
        assert [one["camera"] for one in state(client, "north-rig")["cameras"]] == ["north"]
        assert (
            state(client)["cameras"] == [] and client.get(f"{API}/health").json()["warnings"] == []
        )
        file = client.get(f"{API}/publishing/geometry.yml", params={"rig": "south-rig"})
        assert b"12000" in file.content
        claims = client.get(f"{API}/readiness").json()["items"]
        found = {one["code"]: one["state"] for one in claims if one["code"].startswith("publish")}
        assert found == {"publishing-north-rig": "held", "publishing-south-rig": "held"}


@pytest.mark.parametrize("shared", ["group", "port"])
def test_two_servers_of_two_fields_on_one_machine_do_not_hear_each_other(tmp_path, shared):
    north, south = free_group(), free_group()
    south[shared] = north[shared]
    with ExitStack() as stack:
        servers = [
            stack.enter_context(served(tmp_path / name, (name,))) for name in ("north", "south")
        ]
        ears = [stack.enter_context(Listener(**way)) for way in (north, south)]
        for server, way in zip(servers, (north, south), strict=True):
            put(server, enabled=True, **way)
        assert [lengths(ear) for ear in ears] == [{9000}, {12000}]
        for server in servers:
            until(lambda server=server: heard(server)["own"] > 3)
            assert heard(server)["items"] == [] and state(server)["state"] == "on-air"


def test_what_another_publication_uses_is_refused(client):
    way = free_group()
    put(client, enabled=True, **way)
    put(client, "north-rig", **way)  # prepared, and off
    for changes in (
        {},
        {"interface": "lo"},
        {"interface": ""},
        {"group": "239.1.2.3", "broadcast": True},
    ):
        answer = client.put(
            f"{API}/publishing", params={"rig": "north-rig"}, json={"enabled": True, **changes}
        )
        problem = refusal(answer, 409, "address-taken")
        assert "the other cameras" in problem["detail"]
    assert not state(client, "north-rig")["enabled"]
    put(client, "north-rig", enabled=True, port=free_group()["port"])
    answer = client.put(f"{API}/publishing", json={"port": state(client, "north-rig")["port"]})
    assert "north-rig" in refusal(answer, 409, "address-taken")["detail"]


def test_a_rig_begins_switched_off_also_where_the_settings_file_publishes(tmp_path):
    settings = Settings(data=tmp_path, publish={"enabled": True, **free_group()})
    with TestClient(create_app(settings), base_url=HERE) as client:
        camera = {"id": "north", "name": "", "source": "sim://table?size=320x256&fps=5"}
        assert client.post(f"{API}/cameras", json=camera).status_code == 201
        assert save_rig(client, "north-rig", "ssl-div-b", ["north"]).status_code == 201
        assert state(client)["enabled"] and not put(client, "north-rig")["enabled"]


def test_what_a_rig_publishes_is_kept_over_a_restart_and_ends_with_it(tmp_path):
    north, south = free_group(), free_group()
    with served(tmp_path / "data") as client:
        put(client, enabled=True, **south)
        put(client, "north-rig", enabled=True, numbers={"north": 3}, **north)
    with served(tmp_path / "data") as client, Listener(**north) as ear, Listener(**south) as others:
        sent = listener.Packet.FromString(ear.receive().data).geometry
        assert [one.camera_id for one in sent.calib] == [3] and sent.field.field_length == 9000
        assert lengths(others) == {12000}
        assert (
            "publishing"
            in refusal(client.delete(f"{API}/rigs/north-rig"), 409, "rig-used")["detail"]
        )
        refusal(
            client.delete(f"{API}/publishing", params={"rig": "south-rig"}), 404, "not-separate"
        )
        refusal(client.delete(f"{API}/publishing"), 422)
        stale = client.delete(
            f"{API}/publishing", params={"rig": "north-rig"}, headers={"If-Match": '"old"'}
        )
        refusal(stale, 412, "stale-publishing")
        put(client, "north-rig", enabled=False)
        assert client.delete(f"{API}/rigs/north-rig").status_code == 204
        refusal(client.get(f"{API}/publishing", params={"rig": "north-rig"}), 404, "unknown-rig")
        assert [one["camera"] for one in state(client)["cameras"]] == ["north", "south"]
        assert save_rig(client, "north-rig", "ssl-div-b", ["north"]).status_code == 201
        refusal(client.get(f"{API}/publishing", params={"rig": "north-rig"}), 404, "not-separate")
    assert [*(tmp_path / "data" / "publishing").iterdir()] == []


def test_a_rig_goes_back_to_the_others_and_its_cameras_follow_the_rig(client):
    put(client, "north-rig", **free_group())
    assert [one["camera"] for one in state(client)["cameras"]] == ["south"]
    rig = client.get(f"{API}/rigs/north-rig")
    both = save_rig(
        client, "north-rig", "ssl-div-b", ["north", "south"], **{"If-Match": rig.headers["ETag"]}
    )
    assert both.status_code == 200
    put(client, "south-rig", **free_group())  # of two rigs with one camera the first has it
    assert [one["camera"] for one in state(client, "north-rig")["cameras"]] == ["north", "south"]
    assert state(client)["cameras"] == state(client, "south-rig")["cameras"] == []
    separate = {one["name"]: one["separate"] for one in state(client)["rigs"]}
    assert separate == {"north-rig": True, "south-rig": True}
    assert client.delete(f"{API}/publishing", params={"rig": "north-rig"}).status_code == 204
    assert [one["camera"] for one in state(client)["cameras"]] == ["north"]
    assert [one["camera"] for one in state(client, "south-rig")["cameras"]] == ["south"]


def test_detections_leave_with_the_numbers_of_the_rig(client):
    put(client, "north-rig", numbers={"north": 7}, **free_group())
    services = client.app.state.services
    detection = services.part(DetectionService)
    assert detection.process_settings("north")["camera_number"] == 7
    assert detection.publish("north", b"\x08\x01").reason == "not-publishing"


def test_broadcasts_reach_whoever_has_the_port_and_another_server(tmp_path):
    port = free_group()["port"]
    way = {"port": port, "interface": "lo", "broadcast": True}
    with ExitStack() as stack:
        ear = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        ear.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        ear.bind(("", port))  # as a program that has joined no group
        ear.settimeout(20)
        one = stack.enter_context(served(tmp_path / "north", ("north",)))
        other = stack.enter_context(served(tmp_path / "south", ("south",)))
        put(other, absorb=True, **way)
        until(lambda: heard(other)["listening"])
        put(one, enabled=True, **way)
        data, (address, _) = ear.recvfrom(70_000)
        assert address == LO
        assert listener.Packet.FromString(data).geometry.field.field_length == 9000
        (item,) = until(lambda: heard(other)["items"])
        assert item["field"]["name"] == "ssl-div-b"
        until(lambda: heard(one)["own"] > 0)
