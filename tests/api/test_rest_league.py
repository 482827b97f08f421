"""Publishing over REST: off before somebody asks, kept over a restart, and whatever is heard does no harm."""

import json
import socket
import threading
import time

import pytest
from starlette.testclient import TestClient

from tests.support import ssl_listener as listener
from tests.support.activation import activate_despite
from tests.support.exported import example, model_of, of_model
from tests.support.group_listener import Listener, free_group, said
from tests.support.refusals import API, refusal
from tests.support.tiers import long
from tests.support.waiting import LONG_S, until
from touchline.league.packet import PublishingConfig, geometry_packet, published_cameras
from touchline.main import create_app
from touchline.network.multicast import MulticastReceiver
from touchline.settings import Settings
from touchline.workflows import interchange

HERE = "http://127.0.0.1:8000"
NORTH = {"id": "north", "source": "sim://table?size=320x256&fps=5", "field": "table"}


def kept(client, name="ssl", index=0, camera="north") -> str:
    """A version that was imported and activated."""
    data = interchange.export(example(name, index), "json").data
    made = client.post(
        f"{API}/calibrations/import", files={"file": ("a.json", data)}, data={"camera": camera}
    )
    assert made.status_code == 201, made.text
    activate_despite(client, made.json()["id"])
    return made.json()["id"]


def put(client, **changes) -> dict:
    answer = client.put(f"{API}/publishing", json=changes)
    assert answer.status_code == 200, answer.text
    return answer.json()


def state(client) -> dict:
    return client.get(f"{API}/publishing").json()


@pytest.fixture
def way():
    return free_group()


@pytest.fixture
def client(tmp_path):
    with TestClient(
        create_app(Settings(data=tmp_path / "data", cameras=(NORTH,))), base_url=HERE
    ) as client:
        yield client


def heard(client) -> list[dict]:
    return client.get(f"{API}/publishing/heard").json()["items"]


def test_it_is_off_and_says_what_would_be_lost(client):
    kept(client, "brown-conrady", 0)
    told = state(client)
    assert (told["enabled"], told["absorb"], told["state"], told["said"]) == (
        False,
        False,
        "off",
        None,
    )
    assert (told["group"], told["port"], told["ttl"]) == ("224.5.23.2", 10006, 1)
    (camera,) = told["cameras"]
    assert camera["published"] and not camera["exact"] and 0.1 < camera["loss"]["worst_mm"] < 10
    assert client.get(f"{API}/publishing/heard").json() == {
        "listening": False,
        "problem": None,
        "datagrams": 0,
        "own": 0,
        "items": [],
    }


def test_an_activation_is_on_the_air_at_once(client, way):
    with Listener(**way) as ear:
        assert put(client, enabled=True, interval_s=60, **way)["state"] in ("starting", "silent")
        first = kept(client, "ssl", 0)
        ear.hear_until(
            lambda came: focal(came) == pytest.approx(model_of("ssl", 0).focal_px, rel=1e-6)
        )
        kept(client, "ssl", 1)
        ear.hear_until(
            lambda came: focal(came) == pytest.approx(model_of("ssl", 1).focal_px, rel=1e-6)
        )
        activate_despite(client, first)  # rolled back
        ear.hear_until(
            lambda came: focal(came) == pytest.approx(model_of("ssl", 0).focal_px, rel=1e-6)
        )
        assert state(client)["state"] == "on-air"
        assert put(client, enabled=False)["state"] == "off"
        while ear.receive(0.05) is not None:
            pass
        kept(client, "ssl", 1)
        assert ear.receive(0.5) is None


def focal(came) -> float:
    return listener.Packet.FromString(came.data).geometry.calib[0].focal_length


def test_what_is_set_is_kept_over_a_restart_and_wins_over_the_settings_file(tmp_path, way):
    settings = Settings(
        data=tmp_path / "data", cameras=(NORTH,), publish={"limit_mm": 3.0, "interval_s": 1.0}
    )
    with TestClient(create_app(settings), base_url=HERE) as client:
        kept(client)
        put(client, enabled=True, absorb=True, limit_mm=7.5, numbers={"north": 2}, **way)
        put(client, numbers={"south": 1}, approved={"north": "abc"})
        put(client, numbers={"south": None})
    with Listener(**way) as ear, TestClient(create_app(settings), base_url=HERE) as client:
        assert listener.Packet.FromString(ear.receive().data).geometry.calib[0].camera_id == 2
        told = state(client)
        assert (
            told["enabled"]
            and told["absorb"]
            and told["limit_mm"] == 7.5
            and told["interval_s"] == 1.0
        )
        assert (told["numbers"], told["approved"]) == ({"north": 2}, {"north": "abc"})


def test_settings_can_switch_it_on(tmp_path, way):
    settings = Settings(data=tmp_path / "data", cameras=(NORTH,), publish={"enabled": True, **way})
    with Listener(**way) as ear, TestClient(create_app(settings), base_url=HERE) as client:
        kept(client)
        assert ear.receive() is not None


@pytest.mark.parametrize(
    "damage",
    [
        b"{",
        *(
            long(more)
            for more in (
                b"[]",
                b'{"enabled": "yes"}',
                b'{"group": "10.0.0.1"}',
                b"\xff\xfe",
                b'{"enabled": true, "nobody": 1}',
                b"[" * 100_000,
            )
        ),
    ],
)
def test_kept_settings_that_are_damaged_publish_nothing_and_say_so(tmp_path, damage, way):
    data = tmp_path / "data"
    data.mkdir()
    (data / "publishing.json").write_bytes(damage)
    settings = Settings(data=data, cameras=(NORTH,), publish={"enabled": True, **way})
    with Listener(**way) as ear, TestClient(create_app(settings), base_url=HERE) as client:
        kept(client)
        assert state(client)["state"] == "off" and ear.receive(0.3) is None
        (warning,) = client.get(f"{API}/health").json()["warnings"]
        assert warning["reason"] == "publishing-damaged" and warning["fix"]
        assert put(client, enabled=True, **way)["enabled"]
        assert ear.receive() is not None and client.get(f"{API}/health").json()["warnings"] == []


@pytest.mark.parametrize(
    "body, reason",
    [
        ({"group": "10.0.0.1"}, "bad-group"),
        ({"group": "224.5.23.2\0"}, "bad-group"),
        ({"group": ""}, "bad-group"),
        ({"port": 0}, None),
        ({"ttl": 300}, None),
        ({"interface": "../x"}, "bad-interface"),
        ({"interval_s": 0}, None),
        ({"limit_mm": -1}, None),
        ({"enabled": "yes"}, None),
        ({"numbers": {"a b": 1}}, None),
        ({"nobody": 1}, None),
        ({"numbers": {"north": -1}}, None),
        ({"approved": {"north": 7}}, None),
        ([], None),
    ],
)
def test_what_cannot_be_set_is_refused_and_changes_nothing(standing, body, reason):
    before = state(standing)
    refusal(standing.put(f"{API}/publishing", json=body), 422, reason)
    assert {**state(standing), "interfaces": 0} == {**before, "interfaces": 0}


@pytest.mark.parametrize(
    "text", ['{"limit_mm": NaN}', '{"interval_s": 1e999}', '{"interval_s": Infinity}', "{", ""]
)
def test_what_is_no_number_is_refused(standing, text):
    refusal(
        standing.put(
            f"{API}/publishing", content=text, headers={"Content-Type": "application/json"}
        )
    )


def test_a_field_that_nobody_knows_is_refused(standing):
    refusal(standing.put(f"{API}/publishing", json={"field": "nowhere"}), 404, "unknown-field")


def test_an_interface_that_is_not_there_is_refused_with_those_that_are(client):
    asked = client.put(f"{API}/publishing", json={"enabled": True, "interface": "gone0"})
    problem = refusal(asked, 409, "no-interface")
    assert (
        "lo (127.0.0.1)" in problem["fix"]
        and state(client)["interface"] == ""
        and not state(client)["enabled"]
    )
    # while it is off, what is to come may be prepared
    assert put(client, interface="gone0")["interface"] == "gone0"


def test_a_network_that_is_away_at_the_start_is_told_and_tried_again(tmp_path, way):
    settings = Settings(
        data=tmp_path / "data",
        cameras=(NORTH,),
        publish={"enabled": True, "absorb": True, **way, "interface": "gone0"},
    )
    with TestClient(create_app(settings), base_url=HERE) as client:
        kept(client)
        until(lambda: state(client)["state"] == "failing")
        until(lambda: len(client.get(f"{API}/health").json()["warnings"]) == 2)
        told = state(client)
        assert told["problem"]["reason"] == "no-interface" and told["said"]["failures"] > 0
        assert client.get(f"{API}/publishing/heard").json()["problem"]["reason"] == "no-interface"
        with Listener(**way) as ear:
            put(client, **way)
            assert ear.receive() is not None
        until(
            lambda: (
                state(client)["state"] == "on-air"
                and not client.get(f"{API}/health").json()["warnings"]
            )
        )


def test_a_loss_above_the_limit_is_sent_only_once_it_is_approved(client, way):
    with Listener(**way) as ear:
        id = kept(client, "fisheye", 1)
        told = put(client, enabled=True, interval_s=0.1, limit_mm=1, **way)
        assert told["cameras"][0]["problem"]["reason"] == "loss-above-limit"
        until(lambda: state(client)["state"] == "silent")
        assert any(
            w["reason"] == "camera-not-published"
            for w in client.get(f"{API}/health").json()["warnings"]
        )
        assert ear.receive(0.3) is None
        assert put(client, approved={"north": id})["cameras"][0]["published"]
        assert ear.receive() is not None
        kept(client, "fisheye", 2)  # nobody is asked again for this camera
        assert state(client)["cameras"][0]["published"]
        assert put(client, approved={"north": None})["cameras"][0]["published"] is False


def test_a_camera_that_is_heard_becomes_a_calibration_that_says_where_it_is_from(client, way):
    put(client, absorb=True, **way)
    theirs = geometry_packet(
        published_cameras([example("ssl", 1)], PublishingConfig(numbers={"north": 3}))
    )
    until(lambda: client.get(f"{API}/publishing/heard").json()["listening"])
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        port = said(theirs, **way, sock=stranger)
        (one,) = until(lambda: heard(client))
        assert one["cameras"][0]["camera_id"] == 3 and one["field"]["known"] is False
        path = f"{API}/publishing/heard/{one['id']}/import"
        made = client.post(
            path,
            json={"camera_id": 3, "camera": "north", "sha256": one["sha256"]},
            headers={"X-Operator": "Anna"},
        )
        assert made.status_code == 201, made.text
        calibration = made.json()
        assert (
            f"Received from 127.0.0.1, port {port} (other), as camera 3, at 20"
            in calibration["note"]
        )
        assert (calibration["made_by"], calibration["camera"], calibration["active"]) == (
            "Anna",
            "north",
            False,
        )
        parameters = calibration["model"]["parameters"]
        assert parameters["focal_px"] == pytest.approx(model_of("ssl", 1).focal_px, rel=1e-6)
        assert parameters["position_mm"] == pytest.approx(model_of("ssl", 1).position_mm, abs=0.01)
        refusal(client.post(path, json={"camera_id": 0}), 409, "no-such-camera")
        refusal(client.post(path, json={"camera_id": 3, "field": "nowhere"}), 404, "unknown-field")
        refusal(
            client.post(path, json={"camera_id": 3, "image_size": [100, 100]}), 409, "size-mismatch"
        )
        refusal(client.post(path, json={"camera_id": -3}), 422)
        said(
            geometry_packet(published_cameras([example("ssl", 2)], PublishingConfig())),
            **way,
            sock=stranger,
        )
        until(lambda: heard(client)[0]["geometries"] == 2)
        refusal(
            client.post(path, json={"camera_id": 3, "sha256": one["sha256"]}), 409, "heard-changed"
        )
    refusal(
        client.post(f"{API}/publishing/heard/10.0.0.1-5/import", json={"camera_id": 0}),
        404,
        "unknown-sender",
    )


def test_it_says_that_it_listens_once_it_has_joined_the_group(client, way, monkeypatch):
    may_join = threading.Event()

    class SlowReceiver(MulticastReceiver):
        def __init__(self, address):
            may_join.wait(LONG_S)
            super().__init__(address)

    monkeypatch.setattr("touchline.network.listener.MulticastReceiver", SlowReceiver)
    put(client, absorb=True, **way)
    assert not client.get(f"{API}/publishing/heard").json()["listening"]
    may_join.set()
    until(lambda: client.get(f"{API}/publishing/heard").json()["listening"])


def test_who_has_sent_no_geometry_cannot_be_taken_over(client, way):
    put(client, absorb=True, **way)
    until(lambda: client.get(f"{API}/publishing/heard").json()["listening"])
    said(b"nonsense", **way)
    (one,) = until(lambda: heard(client))
    assert one["refused"] == 1 and one["refusal"]
    refusal(
        client.post(f"{API}/publishing/heard/{one['id']}/import", json={"camera_id": 0}),
        409,
        "no-geometry",
    )


def test_another_sender_for_our_camera_number_is_told(client, way):
    kept(client)
    put(client, enabled=True, absorb=True, **way)
    until(
        lambda: (
            state(client)["state"] == "on-air"
            and client.get(f"{API}/publishing/heard").json()["listening"]
        )
    )
    said(geometry_packet(published_cameras([example("ssl", 1)], PublishingConfig())), **way)
    (one,) = until(lambda: heard(client))
    assert (one["cameras"][0]["ours"], one["cameras"][0]["contradicts"]) == ("north", True)
    (warning,) = client.get(f"{API}/health").json()["warnings"]
    assert warning["reason"] == "two-publishers" and "camera 0, which is north" in warning["text"]
    put(client, enabled=False)
    assert client.get(f"{API}/health").json()["warnings"] == []


def test_a_camera_that_is_removed_is_no_longer_sent(client):
    assert client.post(f"{API}/cameras", json={**NORTH, "id": "south"}).status_code == 201
    kept(client, camera="south")
    assert [one["camera"] for one in state(client)["cameras"]] == ["south"]
    etag = client.get(f"{API}/cameras/south").headers["ETag"]
    assert client.delete(f"{API}/cameras/south", headers={"If-Match": etag}).status_code == 204
    assert state(client)["cameras"] == []


def test_it_ends_with_the_server(tmp_path, way):
    settings = Settings(
        data=tmp_path / "data",
        cameras=(NORTH,),
        publish={"enabled": True, "absorb": True, "interval_s": 0.1, **way},
    )
    with Listener(**way) as ear:
        with TestClient(create_app(settings), base_url=HERE) as client:
            kept(client)
            assert ear.receive() is not None
            begun = time.monotonic()
        assert time.monotonic() - begun < 20
        while ear.receive(0.05) is not None:
            pass
        assert ear.receive(0.5) is None


def test_a_polynomial_is_sent_as_the_camera_that_shows_the_same_carpet(client, way):
    """Where it has no rays, nothing is said of heights."""
    data = interchange.export(of_model(model_of("polynomial", 1)), "json").data
    made = client.post(
        f"{API}/calibrations/import", files={"file": ("a.json", data)}, data={"camera": "north"}
    ).json()
    activate_despite(client, made["id"])
    (camera,) = put(client, limit_mm=1000)["cameras"]
    assert camera["published"] and camera["loss"]["hat_worst_mm"] is None
    assert json.dumps(camera, allow_nan=False)
