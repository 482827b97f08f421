"""The real application on a data folder of its own, driven through starlette's client."""

import json
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from app.main import create_app
from app.settings import Settings

CLICKS = Path(__file__).parents[1] / "clicks"
HERE = "http://127.0.0.1:8000"


@pytest.fixture
def settings(tmp_path) -> Settings:
    return Settings(data=tmp_path / "data")


@pytest.fixture
def client(settings):
    with TestClient(create_app(settings), base_url=HERE) as client:
        yield client


@pytest.fixture
def clicks():
    """An operator's clicks on a real picture: field, region, image_size, observations."""
    return lambda name="ssl_2008_half": json.loads((CLICKS / f"{name}.json").read_text())
