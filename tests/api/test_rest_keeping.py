"""REST of what is kept: everything as one zip, who made what, and what the server says of its disk."""

import io
import json
import zipfile

from starlette.testclient import TestClient

from tests.support.activation import activate_despite
from tests.support.refusals import API
from tests.support.store_opener import damage_row
from touchline.main import create_app
from touchline.store.archive import restore_into
from touchline.store.store import Store
from touchline.store.tables import CalibrationRow

HERE = "http://127.0.0.1:8000"


def test_everything_is_downloaded_as_one_zip_that_a_bare_machine_restores(
    client, calibration, clicks, tmp_path
):
    client.put(
        f"{API}/fields/mine",
        json={
            "name": "mine",
            "length_mm": 3000,
            "width_mm": 2000,
            "lines": [{"name": "a", "from": [0, 0], "to": [0, 9]}],
            "landmarks": {"b": [0, 1]},
            "regions": {"full": {"x": [-1500, 1500], "y": [-1000, 1000]}},
        },
    )
    answer = client.get(f"{API}/archive")
    assert answer.status_code == 200 and answer.headers["content-type"] == "application/zip"
    with zipfile.ZipFile(io.BytesIO(answer.content)) as found:
        assert found.testzip() is None
        end = json.loads(found.read("end.json"))
    assert end["rows"]["calibrations"] == 1 and end["pictures"] == 1 and end["missing"] == []
    (tmp_path / "all.zip").write_bytes(answer.content)
    restore_into(tmp_path / "all.zip", tmp_path / "bare", None)
    assert (tmp_path / "bare" / "fields" / "mine.yaml").is_file()
    with Store(tmp_path / "bare") as store:
        assert store.calibrations.get(calibration["id"]).to_json() == calibration
        assert store.snapshots.picture(calibration["snapshot"])


def test_who_saves_and_activates_is_written_beside_it(client, snapshot, task, calibration):
    assert calibration["made_by"] == "testclient"  # the caller's address, where no name is given
    anna = {"X-Operator": "Anna"}
    body = {**{k: v for k, v in task.items() if k != "image_size"}, "snapshot": snapshot["id"]}
    made = client.post(f"{API}/calibrations", json=body, headers=anna).json()
    assert (
        made["made_by"]
        == "Anna"
        == client.get(f"{API}/calibrations/{made['id']}").json()["made_by"]
    )
    activate_despite(client, made["id"], headers={"X-Operator": "x" * 500})
    (activation,) = client.app.state.services.store.calibrations.history(made["camera"])
    assert activation["calibration"] == made["id"] and activation["by"] == "x" * 64
    draft = client.put(
        f"{API}/drafts/{snapshot['id']}",
        json={"field": "table"},
        headers={**anna, "If-Match": client.get(f"{API}/drafts/{snapshot['id']}").headers["ETag"]},
    ).json()
    assert draft["updated_by"] == "Anna"


def test_health_names_what_was_damaged_and_what_to_know_of_the_disk(settings, client, calibration):
    healthy = client.get(f"{API}/health").json()
    assert (
        healthy["status"] == "ok"
        and healthy["damaged"] == []
        and isinstance(healthy["warnings"], list)
    )
    damage_row(
        client.app.state.services.store,
        CalibrationRow,
        lambda text: text[:-1],
        id=calibration["id"],
    )
    client.__exit__(None, None, None)
    with TestClient(create_app(settings), base_url=HERE) as again:
        (damage,) = again.get(f"{API}/health").json()["damaged"]
        assert damage["kind"] == "calibrations" and damage["file"].startswith(
            "quarantine/calibrations/"
        )


def test_no_file_of_a_field_stops_a_start_and_each_that_is_not_used_is_told(settings):
    own = settings.own_fields
    own.mkdir(parents=True)
    for name, text in (
        ("big", "#" * 300_000),
        (
            "ssl-2008",
            "name: ssl-2008\nlength_mm: 1000\nwidth_mm: 900\nregions:\n"
            "  full: {x: [-500, 500], y: [-450, 450]}\n",
        ),
    ):
        (own / f"{name}.yaml").write_text(text)
    with TestClient(create_app(settings), base_url=HERE) as client:
        told = {one["reason"]: one for one in client.get(f"{API}/health").json()["warnings"]}
        assert (
            "fields/big.yaml" in told["field-not-read"]["text"]
            and "ssl-2008" in told["field-replaced"]["text"]
        )
        shown = client.get(f"{API}/fields/ssl-2008").json()
        assert shown["own"] and shown["length_mm"] == 1000
        assert client.delete(f"{API}/fields/ssl-2008").status_code == 204
        assert not client.get(f"{API}/fields/ssl-2008").json()["own"]


def test_a_disk_with_little_room_refuses_pictures_with_507_and_still_saves_calibrations(
    client, calibration, picture, task, snapshot
):
    client.app.state.services.store._quota._free = lambda folder: 50_000_000
    assert [w["reason"] for w in client.get(f"{API}/health").json()["warnings"]][:1] == [
        "disk-nearly-full"
    ]
    answer = client.post(f"{API}/snapshots", files={"file": picture + b"\0"})
    assert (
        answer.status_code == 507
        and answer.json()["type"] == "/problems/disk-full"
        and answer.json()["fix"]
    )
    body = {**{k: v for k, v in task.items() if k != "image_size"}, "snapshot": snapshot["id"]}
    assert client.post(f"{API}/calibrations", json=body).status_code == 201
