"""ssl-vision's settings with what is published, over REST."""

import pytest
from starlette.testclient import TestClient

from tests.support import ssl_listener as listener
from tests.support.activation import activate_despite
from tests.support.group_listener import Listener, free_group
from tests.support.publishing import over
from tests.support.refusals import API, refusal
from tests.unit.formats.test_league_files import SSL, settings
from tests.unit.formats.test_ssl_settings_update import ALL_MODELS, parameters, texts
from touchline.formats.ssl_settings_update import CAMERA_NUMBERS
from touchline.main import create_app
from touchline.settings import Settings
from touchline.store.fields import load_fields
from touchline.workflows import interchange

MODELS = {
    "straight_two_phase": {"acc_slide": -3.5, "acc_roll": -0.25, "k_switch": 0.6},
    "chip_fixed_loss": None,
}


@pytest.fixture
def client(tmp_path):
    app = create_app(
        Settings(
            data=tmp_path / "data",
            cameras=[{"id": "north", "source": "sim://table?size=320x256&fps=5"}],
            publish={"listen_first_s": 0, "interval_s": 0.1},
        )
    )
    with TestClient(app, base_url="http://127.0.0.1:8000") as client:
        yield client


def update(client, data):
    return client.post(f"{API}/publishing/ssl-vision-settings", files={"file": ("a.xml", data)})


def test_the_file_says_what_the_packet_says(client):
    refusal(update(client, settings(SSL)), 409, "nothing-published")
    data = interchange.export(over(load_fields()["ssl-div-b"]), "json").data
    made = client.post(
        f"{API}/calibrations/import", files={"file": ("a.json", data)}, data={"camera": "north"}
    )
    activate_despite(client, made.json()["id"])
    way = free_group()
    with Listener(**way) as ear:
        answer = client.put(
            f"{API}/publishing", json={"enabled": True, "ball_models": MODELS, **way}
        )
        assert answer.status_code == 200
        sent = listener.Packet.FromString(ear.receive().data).geometry
    before = settings(SSL, SSL, sign=",", models=ALL_MODELS)
    answer = update(client, before)
    assert answer.status_code == 200, answer.text
    after = answer.json()["content"].encode()
    assert answer.json()["cameras"] == [0]
    assert [one["text"] for one in answer.json()["notes"]] == [
        "Replaced: the field, the ball models, and the cameras with these numbers: 0.",
        "Unchanged, as they are not published: the cameras with these numbers: 1.",
    ]
    for wire, name in CAMERA_NUMBERS.items():
        value = float(parameters(after)[name].replace(",", "."))
        assert value == pytest.approx(getattr(sent.calib[0], wire), rel=1e-6)
    assert texts(after).sent.field_length == sent.field.field_length == 9000
    assert texts(after).models().straight_two_phase.acc_slide == -3.5
    refusal(update(client, b"focal: 1"), 422, "bad-calibration")
    refusal(update(client, bytes(3 << 20)), 413)
    client.put(f"{API}/publishing", json={"numbers": {"north": 5}})
    refusal(update(client, before), 409, "no-such-camera")
