"""The real application on a data folder of its own, driven through starlette's client."""

import json

import pytest
from starlette.testclient import TestClient

from tests.support.followed_camera import URL, Followed
from tests.support.paths import CLICKS
from tests.support.pictures import encoded, gradient
from tests.support.refusals import API, without_size
from tests.support.standing_processes import standing_processes
from touchline.main import create_app
from touchline.settings import Settings

HERE = "http://127.0.0.1:8000"
CAMERAS = (
    {
        "id": "north",
        "name": "North half",
        "source": "sim://table?size=320x256&fps=200",
        "field": "table",
        "region": "full",
    },
)


@pytest.fixture(scope="session", autouse=True)
def standing_processes_of_all():
    with standing_processes():
        yield


@pytest.fixture
def settings(tmp_path) -> Settings:
    return Settings(data=tmp_path / "data", cameras=CAMERAS)


@pytest.fixture
def client(settings):
    with TestClient(create_app(settings), base_url=HERE) as client:
        yield client


@pytest.fixture(scope="module")
def standing(tmp_path_factory):
    """One client for all tests of a file: for those that leave nothing behind."""
    settings = Settings(data=tmp_path_factory.mktemp("data"), cameras=CAMERAS)
    with TestClient(create_app(settings), base_url=HERE) as client:
        yield client


@pytest.fixture(scope="module")
def standing_calibration(standing) -> dict:
    """A calibration that all tests of a file read."""
    task = json.loads((CLICKS / "ssl_2008_half.json").read_text())
    kept = standing.post(
        f"{API}/snapshots", files={"file": encoded("png", gradient(780, 580))}
    ).json()
    return standing.post(
        f"{API}/calibrations", json={**without_size(task), "snapshot": kept["id"]}
    ).json()


@pytest.fixture(scope="module")
def followed(standing):
    """Cameras of one server, by their addresses; one is removed, and costs nothing more, when the next is added."""
    added = []

    def add(source=URL, field="table", region="full"):
        remove()
        added.append(f"camera-{len(added)}")
        camera = {
            "id": added[-1],
            "name": added[-1].title(),
            "source": source,
            "field": field,
            "region": region,
        }
        assert standing.post(f"{API}/cameras", json=camera).status_code == 201
        return Followed(standing, added[-1])

    def remove():
        if added:
            standing.delete(f"{API}/cameras/{added[-1]}")

    yield add
    remove()


@pytest.fixture
def clicks():
    """An operator's clicks on a real picture: field, region, image_size, observations."""
    return lambda name="ssl_2008_half": json.loads((CLICKS / f"{name}.json").read_text())


@pytest.fixture
def picture() -> bytes:
    """A picture of the clicks' size."""
    return encoded("png", gradient(780, 580))


@pytest.fixture
def snapshot(client, picture) -> dict:
    return client.post(f"{API}/snapshots", files={"file": picture}).json()


@pytest.fixture
def task(clicks) -> dict:
    """The body of a calibration, without a snapshot."""
    return clicks()


@pytest.fixture
def calibration(client, snapshot, task) -> dict:
    answer = client.post(
        f"{API}/calibrations", json={**without_size(task), "snapshot": snapshot["id"]}
    )
    assert answer.status_code == 201, answer.text
    return answer.json()
