"""Fields: those that come with Touchline are read, the operator's own are written and survive a restart."""

import json

import pytest
from starlette.testclient import TestClient

from app.main import create_app
from tests.support.refusals import API, refusal

FIELDS = f"{API}/fields"
GARAGE = {"name": "garage", "length_mm": 3000, "width_mm": 2000,
          "lines": [{"name": "middle", "from": [0, -1000], "to": [0, 1000], "width_mm": 20}],
          "landmarks": {"spot": [500, 0]}, "regions": {"full": {"x": [-1500, 1500], "y": [-1000, 1000]}}}


def test_every_field_is_listed_whole(standing):
    listed = {field["name"]: field for field in standing.get(FIELDS).json()["items"]}
    assert {"ssl-2008", "ssl-div-b", "vsss-3v3", "table"} <= listed.keys()
    assert standing.get(f"{FIELDS}/ssl-2008").json() == listed["ssl-2008"]
    region = listed["ssl-2008"]["regions"]["half"]
    assert {"left", "right", "top", "bottom", "x", "y", "rotate", "width_mm", "height_mm"} <= region.keys()


def test_a_field_of_ones_own_is_kept_and_used(client, settings, task):
    kept = client.put(f"{FIELDS}/garage", json=GARAGE)
    assert kept.status_code == 200 and kept.json()["landmarks"] == {"spot": [500, 0]}
    assert client.get(f"{FIELDS}/garage").json() == kept.json()
    assert client.post(f"{API}/calibrations", json={**task, "field": "garage", "region": "full"}).status_code == 201
    changed = client.put(f"{FIELDS}/garage", json={**GARAGE, "width_mm": 2100})
    assert changed.json()["width_mm"] == 2100


def test_a_field_of_ones_own_survives_a_restart(settings):
    base = "http://127.0.0.1:8000"
    with TestClient(create_app(settings), base_url=base) as first:
        kept = first.put(f"{FIELDS}/garage", json=GARAGE).json()
    with TestClient(create_app(settings), base_url=base) as second:
        assert second.get(f"{FIELDS}/garage").json() == kept
        assert second.put(f"{FIELDS}/garage", json=kept).json() == kept  # what is read can be sent back


def test_what_comes_with_touchline_stays_as_it_is(standing):
    refusal(standing.put(f"{FIELDS}/table", json={**GARAGE, "name": "table"}), 409, "shipped-field")


def test_an_unknown_field_lists_the_known_ones(standing):
    assert "ssl-2008" in refusal(standing.get(f"{FIELDS}/moon"), 404, "unknown-field")["fix"]


@pytest.mark.parametrize("change", [
    {"name": "other"}, {"name": "../garage"}, {"length_mm": -1}, {"length_mm": float("nan")}, {"length_mm": 1e308},
    {"lines": 3}, {"lines": [{}]}, {"regions": {}}, {"regions": {"full": {"x": [0, 1e9], "y": [0, 1]}}},
    {"colour": "red"},
    {"landmarks": {"a": [float("inf"), 0]}}, {"landmarks": {"\ud800": [0, 0]}}, {"title": "x" * 10_000},
    {"lines": [{"name": "left", "from": [0, 0], "to": [1, 1]}]}, {"extras": {"x": {}}},
    {"lines": [{"name": "a", "from": [0, 0], "to": [0, 0]}]},
], ids=lambda change: json.dumps(change)[:40])
def test_a_field_that_is_none_is_refused_and_not_kept(standing, change):
    body = json.dumps({**GARAGE, **change})
    refusal(standing.put(f"{FIELDS}/garage", content=body, headers={"Content-Type": "application/json"}), 422)
    assert standing.get(f"{FIELDS}/garage").status_code == 404


@pytest.mark.parametrize("body", [b"[]", b"3", b"null", b"{}", b"", b"{" * 9999, b"\xff"])
def test_a_body_that_is_no_field_is_refused(standing, body):
    refusal(standing.put(f"{FIELDS}/garage", content=body, headers={"Content-Type": "application/json"}))
