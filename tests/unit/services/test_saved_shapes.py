"""Rows whose checksum is right and that this version cannot read: set aside, told, and fatal to nothing."""

import json
import shutil
from types import SimpleNamespace

import pytest
from sqlalchemy import select, update
from starlette.testclient import TestClient

from tests.support.paths import CLICKS
from tests.support.pictures import encoded, gradient
from tests.support.refusals import API, without_size
from touchline.main import create_app
from touchline.services.open_store import READERS
from touchline.settings import Settings
from touchline.store.integrity import update_checksum
from touchline.store.snapshots import EMPTY
from touchline.store.store import Store
from touchline.store.tables import CHECKSUMMED_TABLES, LedgerRow
from touchline.straight.service import RollRepository

TABLES = {table.__tablename__: table for table in CHECKSUMMED_TABLES}
LENS = {
    "model": "division",
    "camera": None,
    "note": "",
    "board": None,
    "image_size": [64, 48],
    "lens": {"focal": 1.0},
    "report": {"rms_px": 0.1, "verdict": {}, "views": [{"used": True}]},
    "snapshots": None,
    "software": "0",
}
RIG = {
    "title": "Pair",
    "field": "table",
    "cameras": [{"camera": "north", "region": None, "rotate": None}],
    "w_max_rectangle_px": None,
    "h_max_rectangle_px": None,
    "n_rectangles_x": None,
    "n_rectangles_y": None,
}
ROLL = {
    "at": 10.0,
    "seconds": 1.0,
    "points": [[10.0 * x, 20.0] for x in range(9)],
    "image_size": [64, 48],
    "rms_px": 0.1,
    "straight_px": 0.1,
}
COLOURS = {
    "name": "hall",
    "colours": {"orange": [{"rgb": [250, 112, 30]}], "green": [{"rgb": [10, 120, 30]}]},
}


@pytest.fixture(scope="module")
def filled(tmp_path_factory):
    """A data folder with one row of each kind, and the paths of what shows them."""
    folder = tmp_path_factory.mktemp("filled") / "data"
    task = json.loads((CLICKS / "ssl_2008_half.json").read_text())
    with TestClient(create_app(Settings(data=folder)), base_url="http://127.0.0.1:8000") as client:
        snapshot = client.post(
            f"{API}/snapshots", files={"file": encoded("png", gradient(780, 580))}
        ).json()["id"]
        made = client.post(
            f"{API}/calibrations",
            json={**without_size(task), "snapshot": snapshot, "camera": "north"},
        )
        made = made.json()["id"]
    with Store(folder) as store:
        store.drafts.save(snapshot, EMPTY, store.drafts.get(snapshot).etag, "Ada")
        store.calibrations.activate(made)
        lens = store.lenses.add(LENS)["id"]
        store.cameras.add(
            "north", {"name": "North", "source": "sim://table", "field": "table", "region": None}
        )
        store.identities.confirm(made, {"address": "sim://table", "serial": "7"})
        store.rigs.add("pair", RIG)
        store.repository(RollRepository).add("north", "0" * 16, ROLL)
        store.colour_profiles.add("hall", COLOURS)
    return folder, [
        "/health",
        "/settings",
        "/publishing",
        "/readiness",
        "/events",
        "/jobs",
        "/cameras",
        "/cameras/north",
        "/cameras/status",
        "/cameras/north/rolls",
        "/cameras/north/seeing",
        "/rigs",
        "/rigs/pair",
        "/colours",
        "/colours/hall",
        "/lenses",
        f"/lenses/{lens}",
        "/snapshots",
        f"/snapshots/{snapshot}",
        f"/drafts/{snapshot}",
        "/calibrations",
        "/calibrations?brief=true",
        f"/calibrations/{made}",
        "/calibrations/activations?camera=north",
    ]


def served(folder, paths):
    """What each path answers, and which kinds /health calls damaged."""
    app = create_app(Settings(data=folder))
    with TestClient(app, base_url="http://127.0.0.1:8000", raise_server_exceptions=False) as client:
        answers = {path: client.get(API + path) for path in paths}
    faults = {
        path: answer.json().get("detail")
        for path, answer in answers.items()
        if answer.status_code >= 500 and answer.json()["type"] != "/problems/damaged-file"
    }
    return faults, answers["/health"].json()["damaged"]


def changed_copy(folder, copy, table=None):
    """A copy of a closed folder that an earlier version has read; the rows of a table are of another shape."""
    shutil.copytree(folder, copy)
    with Store(copy) as store, store._database.writing("The change") as rows:
        rows.execute(update(LedgerRow).values(read_by="0.0"))
        for row in rows.scalars(select(TABLES[table])) if table else ():
            row.body = json.dumps(dict.fromkeys(json.loads(row.body), 3))
            update_checksum(row)
    return copy


def test_every_kind_of_row_has_a_reader():
    assert READERS.keys() == TABLES.keys()


def test_a_draft_needs_no_more_than_its_points():
    draft = {"field": None, "region": None, "observations": []}
    body = {"revision": 1, "updated_at": "2026-01-01", "updated_by": "", "draft": draft}
    assert READERS["drafts"](SimpleNamespace(body=json.dumps(body)))


def test_a_lens_of_an_early_version_is_read_and_listed(tmp_path):
    with Store(tmp_path) as store:
        store.lenses.add({"model": "division", "lens": {"focal_px": 500.5}})
    faults, damaged = served(
        changed_copy(tmp_path, tmp_path.with_name("early")), ["/health", "/lenses"]
    )
    assert faults == {} and damaged == []


def test_what_is_sound_is_read_and_nothing_is_set_aside(filled, tmp_path):
    folder, paths = filled
    faults, damaged = served(changed_copy(folder, tmp_path / "copy"), paths)
    assert faults == {} and damaged == []


@pytest.mark.parametrize("table", TABLES)
def test_a_row_that_cannot_be_read_is_set_aside_and_every_page_is_answered(filled, tmp_path, table):
    folder, paths = filled
    copy = changed_copy(folder, tmp_path / "copy", table)
    faults, (damage,) = served(copy, paths)
    assert faults == {} and damage["kind"] == table and not damage["restorable"]
    assert "cannot read it" in damage["note"] and "Create it again" in damage["note"]
