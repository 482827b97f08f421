"""Ball models and the file for another program over REST, and the decision to publish beside one."""

import socket

import pytest
from starlette.testclient import TestClient

from tests.api.test_rest_league import HERE, NORTH, heard, kept, put, state
from tests.support import ssl_listener as listener
from tests.support.group_listener import Listener, free_group, said
from tests.support.league_geometry import packet_of
from tests.support.refusals import API, refusal
from tests.support.waiting import until
from tests.unit.formats.test_league_files import settings as ssl_settings
from touchline.main import create_app
from touchline.settings import Settings

MODELS = {
    "straight_two_phase": {"acc_slide": -3.4, "acc_roll": -0.45, "k_switch": 0.64},
    "chip_fixed_loss": {"damping_xy_first_hop": 0.55}
    | {"damping_xy_other_hops": 0.88, "damping_z": 0.54},
}
YAML = b"""field:
  field_length: 9000
  field_width: 6000
  goal_width: 1000
  goal_depth: 180
  boundary_width: 300
  penalty_area_depth: 1000
  penalty_area_width: 2000
  center_circle_radius: 500
  line_thickness: 10
models:
  straight_two_phase: {acc_slide: -3.40, acc_roll: -0.45, k_switch: 0.64}
  chip_fixed_loss: {damping_xy_first_hop: 0.55, damping_xy_other_hops: 0.88, damping_z: 0.54}
"""
SSL_MODELS = {
    "Straight Two-Phase": {
        "Sliding acceleration [m/s^2]": -3.4,
        "Rolling acceleration [m/s^2]": -0.45,
        "Switch factor": 0.64,
    },
    "Chip fix loss": {
        "Damping (xy) on first hop": 0.55,
        "Damping (xy) on other hops": 0.88,
        "Damping (z)": 0.54,
    },
}


@pytest.fixture
def way():
    return free_group()


@pytest.fixture
def client(tmp_path):
    with TestClient(
        create_app(Settings(data=tmp_path / "data", cameras=(NORTH,))), base_url=HERE
    ) as client:
        yield client


def read(client, data: bytes, name: str):
    return client.post(f"{API}/publishing/ball-models/read", files={"file": (name, data)})


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("geometry.yml", YAML),
        ("heard.pb", packet_of("vision-processor", "ssl-div-b").SerializeToString()),
        ("robocup-ssl.xml", ssl_settings(models=SSL_MODELS)),
        ("robocup-ssl.xml", ssl_settings(models=SSL_MODELS, sign=",")),
    ],
)
def test_ball_models_are_read_from_files_of_the_leagues_programs(client, name, data):
    answer = read(client, data, name)
    assert answer.status_code == 200 and answer.json() == {"ball_models": MODELS}
    assert put(client, **answer.json())["ball_models"] == MODELS


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (YAML.partition(b"models:")[0], "bad-calibration"),
        (ssl_settings(models={"Straight Two-Phase": {"Switch factor": 0.7}}), "bad-calibration"),
        (b"{}", "bad-calibration"),
        (b"\x89PNG\r\n", "bad-calibration"),
        (b"", "bad-calibration"),
    ],
)
def test_a_file_without_ball_models_is_refused(client, data, reason):
    assert refusal(read(client, data, "a.yml"), 422)["type"] == f"/problems/{reason}"


@pytest.mark.parametrize(
    "wrong",
    [
        {"straight_two_phase": {**MODELS["straight_two_phase"], "acc_roll": 0.4}},
        {"straight_two_phase": {**MODELS["straight_two_phase"], "k_switch": 1.1}},
        {"straight_two_phase": {"acc_roll": -0.4}},
        {"chip_fixed_loss": {**MODELS["chip_fixed_loss"], "damping_z": "high"}},
        {"bounce": 1},
        {},
        7,
    ],
)
def test_wrong_ball_models_are_refused_and_change_nothing(client, wrong):
    none = dict.fromkeys(MODELS)
    body = {"ball_models": {**none, **wrong} if wrong and wrong != 7 else wrong}
    assert client.put(f"{API}/publishing", json=body).status_code == 422
    assert state(client)["ball_models"] is None


def test_the_other_program_gets_a_file_and_somebody_decides(client, way):
    nothing = client.get(f"{API}/publishing/geometry.yml")
    assert refusal(nothing, 409)["type"] == "/problems/nothing-published"
    kept(client)
    put(client, ball_models=MODELS, absorb=True, interval_s=0.1, listen_first_s=60, **way)
    until(lambda: client.get(f"{API}/publishing/heard").json()["listening"])
    with Listener(**way) as ear, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        theirs = packet_of("vision-processor", "ssl-div-b").SerializeToString()
        port = said(theirs, **way, sock=other)
        until(lambda: heard(client))
        assert heard(client)[0]["ball_models"] == MODELS
        put(client, enabled=True)
        until(lambda: state(client)["state"] == "asking")
        claims = client.get(f"{API}/readiness").json()["items"]
        (claim,) = (one for one in claims if one["code"] == "publishing")
        assert claim["state"] == "refuted" and "127.0.0.1" in claim["evidence"]
        assert client.post(f"{API}/publishing/confirm").status_code == 200
        came = ear.hear_until(lambda came: came.sender[1] != port)
    sent = listener.Packet.FromString(came.data).geometry
    file = client.get(f"{API}/publishing/geometry.yml")
    assert 'filename="touchline.geometry.yml"' in file.headers["content-disposition"]
    assert read(client, file.content, "geometry.yml").json() == {"ball_models": MODELS}
    again = client.post(
        f"{API}/calibrations/import",
        files={"file": ("geometry.yml", file.content)},
        data={"camera": "north"},
    )
    assert again.status_code == 201
    assert again.json()["model"]["parameters"]["focal_px"] == pytest.approx(
        sent.calib[0].focal_length
    )
