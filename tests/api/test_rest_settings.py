"""GET /settings: everything that is set, with its meaning, and no secret."""

import pytest
from starlette.testclient import TestClient

from tests.support.refusals import API
from touchline.main import create_app
from touchline.settings import Settings

SECRETS = {"token": "a-token-that-is-long-enough", "password": "geheim-4711"}


@pytest.fixture
def told(tmp_path):
    settings = Settings(
        data=tmp_path / "data",
        token=SECRETS["token"],
        server={"port": 9000},
        cameras=[{"id": "north", "source": f"rtsp://user:{SECRETS['password']}@127.0.0.1:1/live"}],
    )
    with TestClient(
        create_app(settings),
        base_url="http://127.0.0.1:8000",
        headers={"Authorization": f"Bearer {SECRETS['token']}"},
    ) as client:
        yield client.get(f"{API}/settings")


def test_no_secret_is_ever_told(told):
    assert told.status_code == 200
    assert not [secret for secret in SECRETS.values() if secret in told.text]
    items = {item["name"]: item for item in told.json()["items"]}
    assert (items["token"]["value"], items["token"]["secret"]) == ("set", True)
    assert (items["database"]["value"], items["database"]["secret"]) == (None, True)
    assert items["cameras"]["value"] == ["north"]


def test_every_setting_stands_there_with_what_it_means(told):
    items = told.json()["items"]
    assert [item["name"] for item in items if not item["help"]] == []
    port = next(item for item in items if item["name"] == "server.port")
    assert (port["value"], port["default"], port["change"]) == (9000, 8000, None)
    assert {item["change"] for item in items} == {None, "cameras", "network"}


def test_the_storage_says_what_is_taken(told):
    storage = told.json()["storage"]
    assert storage["pictures_bytes"] == 0 and storage["pictures_limit_bytes"] == 2_000_000_000
    assert storage["database_bytes"] > 0 and storage["free_bytes"] > 0
    assert storage["backups"]["limit_bytes"] == 1_000_000_000
