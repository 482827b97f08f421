"""Calibrations: kept with all they came from, numbered for each camera, activated, used, exported and read back."""

import base64
import io
import json

import cv2
import numpy as np
import pytest

from tests.support.activation import activate_despite
from tests.support.pictures import encoded, gradient
from tests.support.refusals import API, refusal, without_size
from tests.support.tiers import long
from touchline.installation import __version__

CAL = f"{API}/calibrations"
BINARY = {"Content-Type": "application/octet-stream"}


def pixels_of(answer):
    assert answer.status_code == 200, answer.text
    return cv2.imdecode(np.frombuffer(answer.content, np.uint8), cv2.IMREAD_COLOR)


def test_a_calibration_keeps_all_that_it_came_from(client, snapshot, task):
    body = {
        **without_size(task),
        "snapshot": snapshot["id"],
        "camera": "north",
        "note": "after the lens was knocked",
        "options": {"degree": 3},
    }
    answer = client.post(CAL, json=body)
    made = answer.json()
    assert answer.status_code == 201 and answer.headers["location"] == f"{CAL}/{made['id']}"
    assert made["image_sha256"] == snapshot["sha256"] and made["snapshot"] == snapshot["id"]
    assert made["software"] == f"touchline {__version__}" and made["created_at"].endswith("Z")
    assert (made["version"], made["parent"], made["active"]) == (1, None, False)
    assert (
        made["image_size"] == [780, 580]
        and made["options"] == {"degree": 3}
        and made["note"] == body["note"]
    )
    assert [o["points"] for o in made["observations"]] == [
        o["points"] for o in task["observations"]
    ]
    assert made["field"] == "ssl-2008" and made["field_definition"]["length_mm"] == 6050
    assert made["report"]["rms_px"] < 0.5 and made["report"]["distortion"]["kind"] == "barrel"
    assert client.get(answer.headers["location"]).json() == made


def test_versions_are_counted_for_each_camera_and_name_their_parent(client, task):
    first = client.post(CAL, json={**task, "camera": "north"}).json()
    other = client.post(CAL, json={**task, "camera": "south"}).json()
    second = client.post(CAL, json={**task, "camera": "north"}).json()
    assert [(c["version"], c["parent"]) for c in (first, other, second)] == [
        (1, None),
        (1, None),
        (2, first["id"]),
    ]
    listed = client.get(CAL, params={"camera": "north"}).json()["items"]
    assert [c["id"] for c in listed] == [second["id"], first["id"]]
    page = client.get(CAL, params={"limit": 2}).json()
    rest = client.get(CAL, params={"limit": 2, "cursor": page["next_cursor"]}).json()
    assert [c["id"] for c in page["items"] + rest["items"]] == [
        second["id"],
        other["id"],
        first["id"],
    ]


def test_a_brief_list_is_the_same_versions_without_what_lists_do_not_show(client, task):
    made = client.post(CAL, json={**task, "camera": "north"}).json()
    whole, brief = (client.get(CAL, params={"camera": "north", "brief": b}) for b in (False, True))
    (listed,) = brief.json()["items"]
    assert len(brief.content) < len(whole.content) / 3
    assert (
        listed["observations"] == []
        and listed["field_definition"] == {}
        and listed["report"]["per_feature"] == []
    )
    bulk = ("observations", "field_definition", "report")
    assert listed.pop("field_changes") == []
    assert {k: v for k, v in listed.items() if k not in bulk} == {
        k: v for k, v in made.items() if k not in bulk
    }
    assert listed["report"]["verdict"] == made["report"]["verdict"]


@pytest.mark.parametrize("covariance", ["nonsense", [], {"names": 5}, 7])
def test_a_brief_list_bears_an_imported_covariance_that_is_none(client, task, covariance):
    made = client.post(CAL, json={**task, "camera": "north"}).json()
    made["report"]["covariance"] = covariance
    exported = client.get(f"{CAL}/{made['id']}/export/json").json()
    file = {"file": json.dumps({**exported, "report": made["report"]}).encode()}
    assert client.post(f"{CAL}/import", files=file).status_code == 201
    assert len(client.get(CAL, params={"brief": True}).json()["items"]) == 2


def test_one_version_is_active_and_rolling_back_is_activating_the_former(client, task):
    first, second = (
        client.post(CAL, json={**task, "camera": "north"}).json()["id"] for _ in range(2)
    )
    for id in (first, second, first):
        activate_despite(client, id)
        assert [c["id"] for c in client.get(CAL).json()["items"] if c["active"]] == [id]
        assert client.get(f"{API}/cameras/north").json()["active_calibration"] == id
    refusal(client.delete(f"{CAL}/{first}"), 409, "calibration-active")
    assert client.delete(f"{CAL}/{second}").status_code == 204
    refusal(client.get(f"{CAL}/{second}"), 404, "unknown-calibration")


@pytest.mark.parametrize(
    "call",
    [
        ("GET", ""),
        ("DELETE", ""),
        ("POST", "/activate"),
        ("GET", "/export/json"),
        ("GET", "/corrected.png"),
        ("POST", "/correct"),
        ("GET", "/overlay.json"),
        ("POST", "/transform"),
    ],
)
def test_an_unknown_id_is_said_to_be_unknown(standing, call):
    method, path = call
    refusal(standing.request(method, f"{CAL}/0123456789abcdef{path}"), 404, "unknown-calibration")


def test_models_are_compared_on_the_same_clicks_and_nothing_is_kept(client, task):
    for models, recommended in (
        (["polynomial", "homography"], None),
        (["polynomial", "division"], "division"),
    ):
        found = client.post(f"{CAL}/compare", json={**task, "models": models}).json()
        assert {row["model"] for row in (*found["ranking"], *found["failed"])} == set(models)
        # of borders alone, only what has rays
        assert found["recommended"] == recommended and found["reason"]
    assert client.get(CAL).json()["items"] == []
    refusal(
        client.post(f"{CAL}/compare", json={**task, "models": ["no-such"]}),
        404,
        "unknown-camera-model",
    )
    refusal(client.post(f"{CAL}/compare", json={**task, "models": []}), 422)
    refusal(client.post(f"{CAL}/compare", json={**task, "field": "no-such"}), 404, "unknown-field")


def transformed(client, id, source, target, points, **more):
    answer = client.post(
        f"{CAL}/{id}/transform", json={"from": source, "to": target, "points": points, **more}
    )
    assert answer.status_code == 200, answer.text
    return answer.json()["points"]


def test_there_and_back_is_the_same_pixel(standing, standing_calibration):
    pixels = (
        np.stack(np.meshgrid(np.linspace(90, 650, 9), np.linspace(70, 500, 9)), axis=-1)
        .reshape(-1, 2)
        .tolist()
    )
    for frame in ("corrected", "field"):
        away = transformed(standing, standing_calibration["id"], "image", frame, pixels)
        assert np.allclose(
            transformed(standing, standing_calibration["id"], frame, "image", away),
            pixels,
            atol=1e-6,
        )
    assert np.allclose(
        transformed(standing, standing_calibration["id"], "image", "image", pixels),
        pixels,
        atol=1e-9,
    )
    assert transformed(standing, standing_calibration["id"], "image", "field", []) == []


def test_a_corner_of_the_region_lies_where_the_borders_meet(standing, standing_calibration):
    region = standing_calibration["field_definition"]["regions"]["half"]
    corners = [
        region["left"]["from"],
        region["left"]["to"],
        region["right"]["from"],
        region["right"]["to"],
    ]
    found = np.array(
        transformed(standing, standing_calibration["id"], "field", "corrected", corners)
    )
    width, height = standing_calibration["corrected_size"]
    assert np.allclose(
        found, [[0, 0], [0, height - 1], [width - 1, 0], [width - 1, height - 1]], atol=1e-6
    )


def test_points_in_bulk_give_the_same_numbers_as_json(standing, standing_calibration):
    rng = np.random.default_rng(5)
    points = rng.uniform(0, 580, (5000, 2))
    as_json = transformed(standing, standing_calibration["id"], "image", "field", points.tolist())
    answer = standing.post(
        f"{CAL}/{standing_calibration['id']}/transform",
        params={"from": "image", "to": "field"},
        content=points.astype("<f8").tobytes(),
        headers=BINARY,
    )
    assert answer.headers["content-type"] == "application/octet-stream"
    as_binary = np.frombuffer(answer.content, "<f8").reshape(-1, 2)
    assert np.array_equal(
        as_binary, np.array([p or [np.nan, np.nan] for p in as_json]), equal_nan=True
    )


def test_a_point_out_of_reach_is_null_and_never_nan(standing, standing_calibration):
    far = [[1e6, 1e6], [-1e7, 1e7], [390.0, 290.0]]
    body = {"from": "field", "to": "image", "points": far}
    answer = standing.post(f"{CAL}/{standing_calibration['id']}/transform", json=body)
    json.loads(answer.text, parse_constant=lambda constant: pytest.fail(constant))
    assert None in answer.json()["points"] and answer.json()["points"][2] is not None


TRANSFORM_BAD = [
    ({"from": "image", "to": "moon", "points": []}, 422),
    ({"from": "image", "points": []}, 422),
    ({"from": "image", "to": "field", "points": [[1]]}, 422),
    ({"from": "image", "to": "field", "points": 3}, 422),
    ({"from": "image", "to": "field", "points": [], "more": 1}, 422),
    ([], 422),
    (None, 422),
    ({"from": "image", "to": "field", "points": [[1, 2]], "image_size": [640, 480]}, 409),
    ({"from": "image", "to": "field", "points": [[1, 2]], "z_mm": 150}, 409),
]


@pytest.mark.parametrize(("body", "status"), TRANSFORM_BAD)
def test_a_transform_that_cannot_be_says_why(standing, standing_calibration, body, status):
    refusal(standing.post(f"{CAL}/{standing_calibration['id']}/transform", json=body), status)


def test_bulk_points_that_are_none_are_refused(standing, standing_calibration):
    url, frames = f"{CAL}/{standing_calibration['id']}/transform", {"from": "image", "to": "field"}
    refusal(standing.post(url, params=frames, content=bytes(15), headers=BINARY), 422, "bad-points")
    refusal(standing.post(url, content=bytes(16), headers=BINARY), 422, "no-frames")
    refusal(
        standing.post(url, params={**frames, "to": "moon"}, content=bytes(16), headers=BINARY), 422
    )
    nan = np.array([[np.nan, 1.0]]).tobytes()
    refusal(
        standing.post(url, params=frames, content=nan, headers=BINARY), 422, "non-finite-points"
    )
    refusal(
        standing.post(url, params={**frames, "z_mm": "nan"}, content=bytes(16), headers=BINARY), 422
    )
    refusal(
        standing.post(url, content=b"{", headers={"Content-Type": "application/json"}),
        422,
        "bad-json",
    )


def test_a_corrected_picture_is_the_same_by_every_way_to_it(client, snapshot, calibration, picture):
    url = f"{CAL}/{calibration['id']}"
    own = pixels_of(client.get(f"{url}/corrected.png"))
    assert [own.shape[1], own.shape[0]] == calibration["corrected_size"]
    assert np.array_equal(
        own, pixels_of(client.get(f"{url}/corrected.png", params={"snapshot": snapshot["id"]}))
    )
    assert np.array_equal(own, pixels_of(client.post(f"{url}/correct", files={"file": picture})))
    assert np.array_equal(
        own, pixels_of(client.post(f"{url}/correct", params={"snapshot": snapshot["id"]}))
    )
    wide = pixels_of(client.get(f"{url}/corrected.jpg", params={"margin_px": 30, "width": 400}))
    assert wide.shape[1] == 400
    assert (
        client.post(f"{url}/correct", params={"format": "jpg"}, files={"file": picture}).headers[
            "content-type"
        ]
        == "image/jpeg"
    )


def test_a_picture_of_another_size_is_a_conflict_with_its_cure(client, calibration):
    url = f"{CAL}/{calibration['id']}"
    small = encoded("png", gradient(390, 290))
    other = client.post(f"{API}/snapshots", files={"file": small}).json()["id"]
    refusal(client.post(f"{url}/correct", files={"file": small}), 409, "size-mismatch")
    refusal(client.get(f"{url}/corrected.png", params={"snapshot": other}), 409, "size-mismatch")


@pytest.mark.parametrize(
    "query",
    [
        "margin_px=-1",
        "margin_px=2001",
        "width=15",
        "width=8193",
        "width=x",
        "snapshot=%2e%2e",
        "snapshot=0123456789abcdef",
        "margin_px=nan",
    ],
)
def test_a_view_that_cannot_be_drawn_is_refused(standing, standing_calibration, query):
    refusal(standing.get(f"{CAL}/{standing_calibration['id']}/corrected.png?{query}"))


def test_a_calibration_without_a_snapshot_says_what_to_name(client, task):
    made = client.post(CAL, json=task).json()
    assert (
        "snapshot"
        in refusal(client.get(f"{CAL}/{made['id']}/corrected.png"), 422, "no-snapshot")["fix"]
    )


def test_the_overlay_is_straight_in_the_corrected_view(standing, standing_calibration):
    features = standing.get(
        f"{CAL}/{standing_calibration['id']}/overlay.json",
        params={"frame": "corrected", "margin_px": 30, "width": 400},
    ).json()["features"]
    left = np.array(
        next(f["points"] for f in features if f["feature"] == "left" and f["kind"] == "border")
    )
    assert np.ptp(left[:, 0]) < 1e-6 and {f["kind"] for f in features} == {
        "border",
        "line",
        "arc",
        "landmark",
    }


def test_json_comes_back_from_its_file_as_a_new_version_with_the_same_numbers(client, calibration):
    answer = client.get(f"{CAL}/{calibration['id']}/export/json")
    assert "attachment" in answer.headers["content-disposition"]
    back = client.post(f"{CAL}/import", files={"file": answer.content})
    assert back.status_code == 201, back.text
    same = (
        "model",
        "observations",
        "report",
        "image_size",
        "corrected_size",
        "field_definition",
        "options",
        "region",
    )
    assert all(back.json()[key] == calibration[key] for key in same)
    assert back.json()["id"] != calibration["id"] and "Imported" in back.json()["note"]
    activate_despite(client, back.json()["id"])


def test_npz_corrects_a_picture_with_numpy_and_opencv_alone(
    standing, standing_calibration, picture
):
    table = np.load(
        io.BytesIO(standing.get(f"{CAL}/{standing_calibration['id']}/export/npz").content)
    )
    raw = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR)
    ours = pixels_of(standing.get(f"{CAL}/{standing_calibration['id']}/corrected.png")).astype(int)
    theirs = cv2.remap(raw, table["raw_x"], table["raw_y"], cv2.INTER_LINEAR).astype(int)
    assert np.abs(ours - theirs)[3:-3, 3:-3].max() <= 3  # ours is bicubic


def test_a_format_that_nobody_knows_lists_the_known_ones(standing, standing_calibration):
    answer = standing.get(f"{CAL}/{standing_calibration['id']}/export/xml")
    assert "json" in refusal(answer, 404, "unknown-export-format")["fix"]


SPOILED = {
    "no JSON": lambda record: b"\xff\xfe",
    "empty": lambda record: b"",
    "a list": lambda record: b"[]",
    "deep": lambda record: b"[" * 100_000,
    "NaN": lambda record: json.dumps({**record, "x": float("nan")}).encode(),
    "huge": lambda record: b" " * (5 << 20),
}
ENTRIES = {
    "camera": [{"a": 1}, "x" * 100, "\ud800"],
    "region": ["moon", 3],
    "rotate": [45, True],
    "field": [7],
    "field_definition": [{}, []],
    "model": [{}, {"name": "x"}, {"name": "polynomial", "parameters": {}}],
    "image_size": [[1, 1], "x"],
    "corrected_size": [[640, 480]],
    "observations": [{}, [{"feature": "left", "points": [[1]]}], [{"feature": {"a": 1}}]],
    "options": [[]],
    "report": [[]],
    "created_at": [3],
    "software": [3],
    "note": [[], "x" * 5000],
    "version": ["1", -1],
    "format": ["other"],
    "format_version": [2],
    "id": [None],
    "parent": [{}],
    "snapshot": [[]],
    "image_sha256": [1],
    "active": ["yes"],
    "extra": [1],
}


@pytest.mark.parametrize("spoil", SPOILED.values(), ids=SPOILED.keys())
def test_a_file_that_is_no_calibration_is_refused(standing, standing_calibration, spoil):
    before = standing.get(CAL).json()
    record = standing.get(f"{CAL}/{standing_calibration['id']}/export/json").json()
    refusal(standing.post(f"{CAL}/import", files={"file": spoil(record)}))
    assert standing.get(CAL).json() == before


def test_a_file_with_one_wrong_entry_is_refused(standing, standing_calibration):
    before = standing.get(CAL).json()
    record = standing.get(f"{CAL}/{standing_calibration['id']}/export/json").json()
    for name, values in ENTRIES.items():
        for value in values:
            refusal(
                standing.post(
                    f"{CAL}/import", files={"file": json.dumps({**record, name: value}).encode()}
                )
            )
        short = {key: entry for key, entry in record.items() if key != name}
        if name != "extra":
            refusal(standing.post(f"{CAL}/import", files={"file": json.dumps(short).encode()}))
    assert standing.get(CAL).json() == before


@pytest.mark.parametrize("places", [4, long(40)])
def test_any_number_of_a_file_may_be_wrong_and_nothing_breaks(
    standing, standing_calibration, places
):
    text = standing.get(f"{CAL}/{standing_calibration['id']}/export/json").text
    for wrong in ("NaN", "1e999", "-Infinity", "1e308", '"x"', "null", "[]", "9" * 400):
        for place in range(0, len(text), len(text) // places):
            at = text.find(": ", place) + 2
            end = min(i for i in (text.find(",", at), text.find("\n", at)) if i > 0)
            answer = standing.post(
                f"{CAL}/import", files={"file": (text[:at] + wrong + text[end:]).encode()}
            )
            assert answer.status_code in (201, 404, 413, 422), answer.text


def mesh_of(answer):
    length = int.from_bytes(answer.content[:4], "little")
    head = json.loads(answer.content[4 : 4 + length])
    return head, np.frombuffer(answer.content[4 + length :], "<f4").reshape(
        head["rows"], head["columns"], 2
    )


def test_a_mesh_says_where_the_corrected_picture_comes_from(client, task):
    made = client.post(CAL, json=task).json()
    head, nodes = mesh_of(client.get(f"{CAL}/{made['id']}/mesh", params={"margin_px": 40}))
    assert (
        head["corrected_size"] == made["corrected_size"]
        and head["image_size"] == made["image_size"]
    )
    assert head["margin_px"] == 40 and head["error_px"] <= 0.05
    at = [[head["first"][0] + 3 * head["step"][0], head["first"][1] + 2 * head["step"][1]]]
    raw = client.post(
        f"{CAL}/{made['id']}/transform", json={"from": "corrected", "to": "image", "points": at}
    ).json()
    np.testing.assert_allclose(nodes[2, 3], raw["points"][0], atol=1e-3)
    head, nodes = mesh_of(client.get(f"{CAL}/{made['id']}/mesh?view=corrected&columns=5&rows=3"))
    assert (head["columns"], head["rows"]) == (5, 3) and head["first"] == [-0.5, -0.5]
    refused = client.get(f"{CAL}/{made['id']}/mesh?columns=1")
    assert refused.status_code == 422 and refused.json()["fix"]
    assert client.get(f"{CAL}/{made['id']}/mesh?view=raw").status_code == 422


@pytest.mark.parametrize("way", ["preview", "attempt"])
def test_a_preview_has_the_mesh_that_the_saved_one_would_have(client, task, way):
    asked = client.post(
        f"{API}/fit/{way}", params={"quick": True, "mesh_margin_px": 40}, json=task
    ).json()
    mesh = asked["mesh"] if way == "preview" else asked["preview"]["mesh"]
    id = client.post(CAL, json=task).json()["id"]
    head, nodes = mesh_of(client.get(f"{CAL}/{id}/mesh?margin_px=40"))
    shown = np.frombuffer(base64.b64decode(mesh["raw_px"]), "<f4").reshape(nodes.shape)
    np.testing.assert_allclose(shown, nodes, atol=1e-3)
    assert {name: mesh[name] for name in head} == head
    assert (
        mesh["overlay"]
        == client.get(f"{CAL}/{id}/overlay.json?frame=corrected&margin_px=40").json()["features"]
    )
    without = client.post(f"{API}/fit/{way}", params={"quick": True}, json=task).json()
    assert (without if way == "preview" else without["preview"])["mesh"] is None
