"""Fields: those that come with Touchline are read, the operator's own are written and survive a restart."""

import json

import cv2
import pytest
from starlette.testclient import TestClient

from tests.support.activation import activate_despite
from tests.support.foreign_field import foreign_scene
from tests.support.paths import CLICKS
from tests.support.pictures import encoded, gradient
from tests.support.refusals import API, refusal
from tests.support.rest_jobs import accepted, finished
from tests.support.tape import SIDES_AND_DIAGONALS, measured
from touchline.core.field_json import field_from_json
from touchline.fields.measuring import JoinedField
from touchline.main import create_app

FIELDS = f"{API}/fields"
GARAGE = {
    "name": "garage",
    "length_mm": 3000,
    "width_mm": 2000,
    "lines": [{"name": "middle", "from": [0, -1000], "to": [0, 1000], "width_mm": 20}],
    "landmarks": {"spot": [500, 0]},
    "regions": {"full": {"x": [-1500, 1500], "y": [-1000, 1000]}},
}


def test_every_field_is_listed_whole(standing):
    listed = {field["name"]: field for field in standing.get(FIELDS).json()["items"]}
    assert {"ssl-2008", "ssl-div-b", "vsss-3v3", "table"} <= listed.keys()
    assert standing.get(f"{FIELDS}/ssl-2008").json() == listed["ssl-2008"]
    region = listed["ssl-2008"]["regions"]["half"]
    assert {
        "left",
        "right",
        "top",
        "bottom",
        "x",
        "y",
        "rotate",
        "width_mm",
        "height_mm",
    } <= region.keys()


def test_a_field_of_ones_own_is_kept_and_used(client, settings, task):
    kept = client.put(f"{FIELDS}/garage", json=GARAGE)
    assert kept.status_code == 200 and kept.json()["landmarks"] == {"spot": [500, 0]}
    assert client.get(f"{FIELDS}/garage").json() == kept.json()
    assert (
        client.post(
            f"{API}/calibrations", json={**task, "field": "garage", "region": "full"}
        ).status_code
        == 201
    )
    changed = client.put(f"{FIELDS}/garage", json={**GARAGE, "width_mm": 2100})
    assert changed.json()["width_mm"] == 2100


def test_a_field_of_ones_own_survives_a_restart(settings):
    base = "http://127.0.0.1:8000"
    with TestClient(create_app(settings), base_url=base) as first:
        kept = first.put(f"{FIELDS}/garage", json=GARAGE).json()
    with TestClient(create_app(settings), base_url=base) as second:
        assert second.get(f"{FIELDS}/garage").json() == kept
        # what is read can be sent back
        assert second.put(f"{FIELDS}/garage", json=kept).json() == kept


def test_what_comes_with_touchline_stays_as_it_is(standing):
    refusal(standing.put(f"{FIELDS}/table", json={**GARAGE, "name": "table"}), 409, "shipped-field")


def test_an_unknown_field_lists_the_known_ones(standing):
    assert "ssl-2008" in refusal(standing.get(f"{FIELDS}/moon"), 404, "unknown-field")["fix"]


@pytest.mark.parametrize(
    "change",
    [
        {"name": "other"},
        {"name": "../garage"},
        {"length_mm": -1},
        {"length_mm": float("nan")},
        {"length_mm": 1e308},
        {"lines": 3},
        {"lines": [{}]},
        {"regions": {}},
        {"regions": {"full": {"x": [0, 1e9], "y": [0, 1]}}},
        {"colour": "red"},
        {"landmarks": {"a": [float("inf"), 0]}},
        {"landmarks": {"\ud800": [0, 0]}},
        {"title": "x" * 10_000},
        {"lines": [{"name": "left", "from": [0, 0], "to": [1, 1]}]},
        {"extras": {"x": {}}},
        {"lines": [{"name": "a", "from": [0, 0], "to": [0, 0]}]},
    ],
    ids=lambda change: json.dumps(change)[:40],
)
def test_a_field_that_is_none_is_refused_and_not_kept(standing, change):
    body = json.dumps({**GARAGE, **change})
    refusal(
        standing.put(
            f"{FIELDS}/garage", content=body, headers={"Content-Type": "application/json"}
        ),
        422,
    )
    assert standing.get(f"{FIELDS}/garage").status_code == 404


@pytest.mark.parametrize("body", [b"[]", b"3", b"null", b"{}", b"", b"{" * 9999, b"\xff"])
def test_a_body_that_is_no_field_is_refused(standing, body):
    refusal(
        standing.put(f"{FIELDS}/garage", content=body, headers={"Content-Type": "application/json"})
    )


def test_a_refusal_names_the_entry(standing):
    def entry(**change):
        return refusal(
            standing.put(f"{FIELDS}/garage", json={**GARAGE, **change}), 422, "bad-field"
        )["entry"]

    line = GARAGE["lines"][0]
    assert entry(lines=[line, {**line, "name": "second", "to": [0, 1e9]}]) == "lines[1].to"
    assert entry(lines=[line, line]) == "lines[1].name"
    assert entry(arcs=[{"name": "middle", "centre": [0, 0], "radius_mm": 50}]) == "arcs[0].name"
    assert (
        entry(arcs=[{"name": "ring", "centre": [0, 0], "radius_mm": 50, "end_deg": 999}])
        == "arcs[0].end_deg"
    )
    assert entry(landmarks={"spot": [0, "x"]}) == "landmarks.spot"
    assert entry(regions={"full": {"x": [0, 1e9], "y": [0, 900]}}) == "regions.full.x"
    assert (
        entry(width_mm=-1) == "width_mm"
        and entry(name="../garage") == "name"
        and entry(colour="red") == ""
    )


def test_only_a_new_field_is_written_where_that_is_asked(client):
    only_new = {"If-None-Match": "*"}
    assert client.put(f"{FIELDS}/garage", json=GARAGE, headers=only_new).status_code == 200
    told = refusal(
        client.put(f"{FIELDS}/garage", json={**GARAGE, "width_mm": 2100}, headers=only_new),
        409,
        "field-exists",
    )
    assert told["entry"] == "name" and client.get(f"{FIELDS}/garage").json()["width_mm"] == 2000


def test_a_field_of_ones_own_says_so_and_is_deleted(client, settings):
    assert client.put(f"{FIELDS}/garage", json=GARAGE).json()["own"] is True
    assert client.get(f"{FIELDS}/table").json()["own"] is False
    seen = client.get(f"{FIELDS}/garage").headers["ETag"]
    client.put(f"{FIELDS}/garage", json={**GARAGE, "width_mm": 2100})
    refusal(client.delete(f"{FIELDS}/garage", headers={"If-Match": seen}), 412, "stale-field")
    assert client.delete(f"{FIELDS}/garage").status_code == 204
    refusal(client.get(f"{FIELDS}/garage"), 404, "unknown-field")
    refusal(client.delete(f"{FIELDS}/garage"), 404, "unknown-field")
    assert not list(settings.own_fields.glob("*.yaml"))


def test_what_comes_with_touchline_is_not_deleted(standing):
    refusal(standing.delete(f"{FIELDS}/table"), 409, "shipped-field")


def test_a_field_that_is_used_is_not_deleted(client):
    client.put(f"{FIELDS}/garage", json=GARAGE)
    client.post(
        f"{API}/cameras",
        json={"id": "cam", "name": "Garage door", "source": "sim://table", "field": "garage"},
    )
    client.post(f"{API}/cameras", json={"id": "sim", "name": "Simulated", "source": "sim://garage"})
    client.put(f"{API}/rigs/hall", json={"title": "Hall", "field": "garage", "cameras": ["cam"]})
    client.put(f"{API}/publishing", json={"field": "garage"})
    told = refusal(client.delete(f"{FIELDS}/garage"), 409, "field-used")
    assert told["users"] == [
        "the camera Garage door",
        "the camera Simulated",
        "the rig Hall",
        "publishing",
    ]
    client.put(f"{API}/publishing", json={"field": None})
    client.delete(f"{API}/rigs/hall")
    client.delete(f"{API}/cameras/sim")
    etag = client.get(f"{API}/cameras/cam").headers["ETag"]
    client.patch(f"{API}/cameras/cam", json={"field": None}, headers={"If-Match": etag})
    assert client.delete(f"{FIELDS}/garage").status_code == 204


def test_a_draft_of_a_deleted_field_names_none_and_keeps_its_clicks(client, snapshot):
    path, clicked = (
        f"{API}/drafts/{snapshot['id']}",
        [{"feature": "middle", "kind": "line", "points": [[1.0, 2.0]], "z_mm": 0.0}],
    )
    client.put(f"{FIELDS}/garage", json=GARAGE)
    body = {
        "field": "garage",
        "region": "full",
        "rotate": 90,
        "model": None,
        "options": {},
        "observations": clicked,
    }
    client.put(path, json=body, headers={"If-Match": client.get(path).headers["ETag"]})
    assert "notice" not in client.get(path).json()
    client.put(f"{FIELDS}/garage", json={**GARAGE, "regions": {"other": GARAGE["regions"]["full"]}})
    told = client.get(path).json()
    assert (told["field"], told["region"], told["rotate"]) == (
        "garage",
        None,
        None,
    ) and "full" in told["notice"]
    client.delete(f"{FIELDS}/garage")
    told = client.get(path).json()
    assert told["field"] is None and "garage" in told["notice"] and told["observations"] == clicked
    client.put(f"{FIELDS}/garage", json=GARAGE)
    assert client.get(path).json()["region"] == "full", "it is there again"


@pytest.mark.parametrize("format", ["json", "ssl-vision"])
def test_every_field_is_exported_and_read_back(standing, format):
    for field in standing.get(FIELDS).json()["items"]:
        answer = standing.get(f"{FIELDS}/{field['name']}/export/{format}")
        assert answer.status_code == 200 and field["name"] in answer.headers["Content-Disposition"]
        read = standing.post(f"{FIELDS}/read", files={"file": ("field", answer.content)}).json()
        assert read == field


def test_a_packet_of_an_unknown_field_is_read_to_the_millimetre(client):
    client.put(f"{FIELDS}/garage", json=GARAGE)
    packet = client.get(f"{FIELDS}/garage/export/ssl-vision").content
    client.delete(f"{FIELDS}/garage")
    read = client.post(f"{FIELDS}/read", files={"file": ("garage.pb", packet)}).json()
    assert read["lines"] == client.put(f"{FIELDS}/garage", json=GARAGE).json()["lines"]
    assert (read["length_mm"], read["width_mm"], read["own"]) == (3000, 2000, False)


@pytest.mark.parametrize(
    "data", [b"", b"{}", b"[]", b"\x0a\x05\x00\x00\x00", b"\xff\xfe", b"{" * 5000, b'{"name": NaN}']
)
def test_a_file_that_holds_no_field_is_refused(standing, data):
    refusal(standing.post(f"{FIELDS}/read", files={"file": ("field.json", data)}), 422)


def brief(client, id) -> dict:
    listed = client.get(f"{API}/calibrations", params={"brief": True}).json()["items"]
    return next(version for version in listed if version["id"] == id)


def test_calibrations_made_before_a_change_are_told_and_made_again_from_their_points(client, task):
    own = {**client.get(f"{FIELDS}/ssl-2008").json(), "name": "hall"}
    assert client.put(f"{FIELDS}/hall", json=own).status_code == 200
    points = [
        *task["observations"],
        {"feature": "defence-right-front", "kind": "line", "points": [[300, 200], [301, 300]]},
    ]
    made = client.post(
        f"{API}/calibrations",
        json={
            **task,
            "field": "hall",
            "camera": "north",
            "observations": points,
            "model": "homography",
        },
    ).json()
    assert brief(client, made["id"])["field_changes"] == []
    activate_despite(client, made["id"])
    refusal(client.post(f"{FIELDS}/hall/refit", json={}), 409, "nothing-to-refit")

    lines = [line for line in own["lines"] if line["name"] != "defence-right-front"]
    assert client.put(f"{FIELDS}/hall", json={**own, "lines": lines}).status_code == 200
    assert brief(client, made["id"])["field_changes"] == ["defence-right-front"]
    (camera,) = client.get(f"{API}/cameras").json()["items"]
    assert camera["active"]["field_changes"] == ["defence-right-front"]
    assert [camera["active"][key] for key in ("field", "region", "rotate")] == [
        "hall",
        made["region"],
        made["rotate"],
    ]
    (sent,) = client.get(f"{API}/publishing").json()["cameras"]
    assert not sent["published"] and sent["problem"]["reason"] == "field-changed"

    refusal(client.post(f"{FIELDS}/hall/refit", json={"cameras": ["south"]}), 422, "unknown-camera")
    job = finished(client, accepted(client.post(f"{FIELDS}/hall/refit", json={})))
    assert job["state"] == "done", job
    (id,) = job["result"]["calibrations"]
    again = client.get(f"{API}/calibrations/{id}").json()
    assert (again["parent"], again["active"], brief(client, id)["field_changes"]) == (
        made["id"],
        False,
        [],
    )
    assert again["field_definition"]["lines"] == lines
    assert [o["feature"] for o in again["observations"]] == [
        o["feature"] for o in task["observations"]
    ]
    activate_despite(client, id)
    (sent,) = client.get(f"{API}/publishing").json()["cameras"]
    assert sent["problem"] is None or sent["problem"]["reason"] != "field-changed"


def test_a_field_is_adjusted_to_tape_distances_and_nothing_is_saved(standing):
    field = standing.get(f"{FIELDS}/ssl-div-b").json()
    truth = JoinedField(field_from_json(field)).moved({"goal-line-right": (-15.0, -15.0)}, {})
    distances = [
        {"from": a, "to": b, "mm": mm} for a, b, mm in measured(truth, SIDES_AND_DIAGONALS)
    ]
    told = standing.post(f"{FIELDS}/measured", json={"field": field, "distances": distances}).json()
    assert told["offsets"]["goal-line-right"]["mm"] == pytest.approx(-15, abs=1)
    assert told["offsets"]["goal-line-right"]["sigma_mm"] < 3
    assert len(told["residuals_mm"]) == len(distances) and told["field"][
        "length_mm"
    ] == pytest.approx(9015, abs=1)
    assert standing.get(f"{FIELDS}/ssl-div-b").json() == field


@pytest.mark.parametrize(
    ("change", "status"),
    [
        ({"distances": []}, 422),
        ({"distances": [{"from": "centre", "to": "moon", "mm": 5}]}, 422),
        ({"distances": [{"from": "centre", "to": "corner-top-left", "mm": -5}]}, 422),
        ({"distances": [{"from": "centre", "to": "corner-top-left", "mm": 1e300}]}, 422),
        ({"distances": [{"from": "centre", "to": "corner-top-left"}]}, 422),
        ({"field": {}}, 422),
        ({"field": 3}, 422),
        ({"distances": [{"from": "centre", "to": "corner-top-left", "mm": 1e5}]}, 422),
        ({"distances": [{"from": "centre", "to": "corner-top-left", "mm": 5400}]}, 200),
    ],
)
def test_what_was_not_measured_is_refused(standing, change, status):
    field = standing.get(f"{FIELDS}/ssl-div-b").json()
    body = {
        "field": field,
        "distances": [{"from": "corner-top-left", "to": "corner-top-right", "mm": 9015}],
        **change,
    }
    answer = standing.post(f"{FIELDS}/measured", json=body)
    assert answer.status_code == status, answer.text
    if status != 200:
        refusal(answer)


def test_more_markings_than_are_adjusted_at_once_are_refused(standing):
    lines = [{"name": f"line-{i}", "from": [0, i], "to": [100, i]} for i in range(400)]
    field = {**GARAGE, "lines": lines, "landmarks": {"a": [0, 0], "b": [100, 0]}}
    body = {"field": field, "distances": [{"from": "a", "to": "b", "mm": 100}]}
    refusal(standing.post(f"{FIELDS}/measured", json=body), 422, "too-many-markings")


def test_what_a_calibration_has_found_is_adopted_or_refused(standing, standing_calibration):
    field = standing.get(f"{FIELDS}/ssl-2008").json()
    path, body = f"{FIELDS}/painted", {"field": field, "calibration": standing_calibration["id"]}
    refusal(standing.post(path, json=body), 409, "no-offsets")  # each border is a curve of its own
    refusal(standing.post(path, json={**body, "calibration": "0" * 16}), 404, "unknown-calibration")
    task = {**json.loads((CLICKS / "ssl_2008_half.json").read_text()), "model": "division"}
    made = standing.post(f"{API}/calibrations", json=task).json()
    told = standing.post(path, json={**body, "calibration": made["id"]}).json()
    assert (
        told["offsets"].keys() >= {"touch-line-top", "goal-line-right"}
        and told["residuals_mm"] == []
    )
    assert all(one["sigma_mm"] > 0 for one in told["offsets"].values())
    refusal(
        standing.post(
            path, json={"field": {**field, "length_mm": 6000}, "calibration": made["id"]}
        ),
        409,
        "field-changed",
    )


def test_what_a_calibrated_picture_shows_is_added_or_refused(standing, standing_calibration):
    field = standing.get(f"{FIELDS}/ssl-2008").json()
    path, body = f"{FIELDS}/seen", {"field": field, "calibration": standing_calibration["id"]}
    told = standing.post(path, json=body)
    assert told.status_code == 200 and told.json()["added"] == []  # a picture without lines
    assert told.json()["field"]["lines"] == field["lines"]
    refusal(standing.post(path, json={**body, "snapshot": "0" * 16}), 404, "unknown-snapshot")
    other = standing.post(
        f"{API}/snapshots", files={"file": encoded("png", gradient(64, 48))}
    ).json()["id"]
    refusal(standing.post(path, json={**body, "snapshot": other}), 409, "size-mismatch")
    refusal(standing.post(path, json={**body, "field": {}}), 422, "bad-field")
    task = json.loads((CLICKS / "ssl_2008_half.json").read_text())
    blind = standing.post(f"{API}/calibrations", json=task).json()["id"]
    refusal(standing.post(path, json={**body, "calibration": blind}), 409, "no-picture")


def test_a_field_is_proposed_from_an_image_or_refused(standing):
    png = cv2.imencode(".png", foreign_scene().pixels)[1].tobytes()
    image = standing.post(f"{API}/snapshots", files={"file": png}).json()["id"]
    path, body = f"{FIELDS}/proposed", {"snapshot": image, "length_mm": 8000}
    told = standing.post(path, json=body)
    assert told.status_code == 200 and told.json()["is_ratio_known"]
    field = told.json()["field"]
    assert field["length_mm"] == 8000 and "centre-circle" in {arc["name"] for arc in field["arcs"]}
    assert standing.put(f"{FIELDS}/hall", json={**field, "name": "hall"}).status_code == 200
    assert standing.delete(f"{FIELDS}/hall").status_code == 204
    blank = standing.post(
        f"{API}/snapshots", files={"file": encoded("png", gradient(64, 48))}
    ).json()["id"]
    refusal(standing.post(path, json={**body, "snapshot": blank}), 422, "no-borders")
    refusal(standing.post(path, json={"snapshot": image}), 422, "no-length")
    refusal(standing.post(path, json={**body, "width_mm": 9000}), 422, "bad-size")
    refusal(standing.post(path, json={**body, "snapshot": "0" * 16}), 404, "unknown-snapshot")
    for wrong in (0, -5, 1e9, "8 m", None):
        assert standing.post(path, json={**body, "length_mm": wrong}).status_code == 422
