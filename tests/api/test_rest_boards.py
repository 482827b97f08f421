"""REST of boards: a lens from corners or from pictures, kept, listed, held by a fit over a field, and deleted."""

import json
import shutil

import numpy as np
import pytest

from tests.support.board_views import BOARD, SIZE, TRUTH, picture_of, views_of
from tests.support.lens_over_field import FIELD, clicks_through_the_lens
from tests.support.pictures import encoded
from tests.support.refusals import API, refusal
from tests.support.rest_jobs import accepted, finished
from tests.support.store_opener import damage_row
from touchline.boards.board import Board
from touchline.store.store import Store
from touchline.store.tables import LensRow

CAL, LENSES = f"{API}/calibrations", f"{API}/lenses"
SMALL = Board("chessboard", 8, 6, 30.0)


def seen(count=15, **more):
    """The body of a board calibration from corners."""
    views = [
        {**view.to_json(), "object_points": view.places_mm.tolist()}
        for view in views_of(count=count)
    ]
    return {"views": views, "image_size": list(SIZE), "board": BOARD.to_json(), **more}


@pytest.fixture(scope="module")
def lens(standing):
    """A job's result: a lens from corners."""
    told = finished(
        standing,
        accepted(standing.post(f"{CAL}/board", json=seen(camera="north", note="metre board"))),
    )
    assert told["state"] == "done", told
    return told["result"]


def test_a_lens_from_corners_is_the_camera_s_and_is_kept_whole(standing, lens):
    record = standing.get(f"{LENSES}/{lens['lens']}").json()
    assert record == lens["record"]
    assert record["lens"]["focal_px"] == pytest.approx(TRUTH.focal_px, abs=0.5)
    assert record["lens"]["centre_px"] == pytest.approx(TRUTH.centre_px, abs=1)
    assert (record["model"], record["camera"], record["note"], record["snapshots"]) == (
        "brown-conrady",
        "north",
        "metre board",
        None,
    )
    assert record["board"] == BOARD.to_json() and record["image_size"] == list(SIZE)
    assert record["report"]["sigma_px"] == pytest.approx(0.2, rel=0.1)
    (short,) = [item for item in standing.get(LENSES).json()["items"] if item["id"] == lens["lens"]]
    assert short["views"] == 15 and short["verdict"]["sentence"]


@pytest.mark.parametrize("sigma", ["0", "own"])
def test_a_field_s_fit_holds_the_lens_by_its_id(standing, lens, sigma):
    standing.put(f"{API}/fields/plain-4x3", json=FIELD)
    truth, body = clicks_through_the_lens()
    answer = standing.post(
        CAL, json={**body, "options": {"lens": lens["lens"], "lens_sigma": sigma}}
    )
    assert answer.status_code == 201, answer.text
    made = answer.json()
    found, kept = made["model"]["parameters"], lens["record"]["lens"]
    if sigma == "0":
        assert found["focal_px"] == pytest.approx(kept["focal_px"], rel=1e-12)
        assert found["lens_terms"] == pytest.approx(kept["terms"], abs=0)
    else:
        at = kept["estimated"].index("log_focal")
        moved = abs(np.log(found["focal_px"] / kept["focal_px"]))
        assert 0 < moved < 4 * np.sqrt(kept["covariance"][at][at])
    assert found["position_mm"] == pytest.approx(truth.position_mm, abs=8)
    assert made["options"]["lens"]["lens"] == kept


def test_without_the_lens_the_same_clicks_know_the_height_far_worse(standing, lens):
    """What the two tests above owe to the board."""
    standing.put(f"{API}/fields/plain-4x3", json=FIELD)
    truth, body = clicks_through_the_lens()
    alone = standing.post(CAL, json=body).json()["model"]["parameters"]
    held = standing.post(CAL, json={**body, "options": {"lens": lens["lens"]}}).json()["model"][
        "parameters"
    ]
    misses = [abs(p["position_mm"][2] - truth.position_mm[2]) for p in (alone, held)]
    assert misses[0] > 3 * misses[1]


def test_the_lens_of_a_calibration_is_held_as_well_as_its_own_clicks_told_it(standing):
    """The next pose holds it by its id; one that held it fast itself cannot say how well it is known."""
    standing.put(f"{API}/fields/plain-4x3", json=FIELD)
    _, body = clicks_through_the_lens()
    first = standing.post(
        CAL, json={**body, "options": {"height_mm": {"value": 4000.0, "sigma": 30.0}}}
    ).json()
    own = {"lens": first["id"], "lens_sigma": "own"}
    answer = standing.post(CAL, json={**body, "options": own})
    assert answer.status_code == 201, answer.text
    made = answer.json()
    assert "log_focal" in made["report"]["covariance"]["names"]
    assert made["options"]["lens"]["covariance"] == first["report"]["covariance"]
    moved = abs(
        np.log(made["model"]["parameters"]["focal_px"] / first["model"]["parameters"]["focal_px"])
    )
    names = first["report"]["covariance"]["names"]
    assert (
        0
        < moved
        < 4
        * np.sqrt(
            first["report"]["covariance"]["matrix"][names.index("log_focal")][
                names.index("log_focal")
            ]
        )
    )
    fast = standing.post(CAL, json={**body, "options": {"lens": first["id"]}}).json()
    refusal = standing.post(CAL, json={**body, "options": {**own, "lens": fast["id"]}})
    assert refusal.status_code == 422 and refusal.json()["type"].endswith("lens-sigma-unknown")
    assert "fix the lens" in refusal.json()["fix"]


REFUSED = {
    "neither": ({"views": None}, 422, "no-views"),
    "both": ({"snapshots": ["a"]}, 422, "no-views"),
    "no size": ({"image_size": None}, 422, "no-image-size"),
    "unknown model": ({"model": "no-such"}, 404, "unknown-camera-model"),
    "a model without a lens": ({"model": "polynomial"}, 422, "bad-model"),
    "unknown option": ({"options": {"degree": 3}}, 422, "unknown-option"),
    "unknown board": (
        {"board": {"kind": "dartboard", "columns": 9, "rows": 6, "square_mm": 30}},
        422,
        "bad-board",
    ),
    "no squares": (
        {"board": {"kind": "chessboard", "columns": 9, "rows": 6, "square_mm": 0}},
        422,
        "bad-board",
    ),
    "no views": ({"views": []}, 422, None),
    "uneven": ({"views": [{"image_points": [[1, 2]], "object_points": []}]}, 422, "bad-view"),
    "no triple": ({"views": [{"image_points": [[1, 2]], "object_points": [[1]]}]}, 422, None),
    "snapshots without a board": (
        {"views": None, "snapshots": ["a"], "board": None},
        422,
        "no-board",
    ),
    "an unknown snapshot": ({"views": None, "snapshots": ["nobody"]}, 404, "unknown-snapshot"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_done_is_refused_before_anybody_waits(standing, name):
    change, status, reason = REFUSED[name]
    body = {key: value for key, value in {**seen(3), **change}.items() if value is not None}
    before = len(standing.get(f"{API}/jobs").json()["items"])
    refusal(standing.post(f"{CAL}/board", json=body), status, reason)
    assert len(standing.get(f"{API}/jobs").json()["items"]) == before


def test_views_that_tell_no_lens_are_a_failed_job_with_a_fix(standing):
    before = standing.get(LENSES).json()
    told = finished(standing, accepted(standing.post(f"{CAL}/board", json=seen(2))))
    assert told["state"] == "failed" and told["problem"]["type"] == "/problems/too-few-views"
    assert told["problem"]["fix"] and standing.get(LENSES).json() == before


def test_a_lens_is_deleted_once_and_what_nobody_has_kept_is_404(client):
    id = client.app.state.services.store.lenses.add({"model": "ssl"})["id"]
    assert client.delete(f"{LENSES}/{id}").status_code == 204
    for call in (client.get, client.delete):
        refusal(call(f"{LENSES}/{id}"), 404, "unknown-lens")


def drawn(seed):
    """A grey picture of the small board, leaning its own way."""
    rng = np.random.default_rng(seed)
    turn = rng.uniform(-0.3, 0.3)
    c, s = 2.6 * np.cos(turn), 2.6 * np.sin(turn)
    lean = rng.uniform(-6e-4, 6e-4, 2)
    homography = np.array(
        [[c, -s, 180 + rng.uniform(0, 100)], [s, c, 180 + rng.uniform(0, 60)], [*lean, 1]]
    )
    return picture_of(SMALL, homography)


def uploaded(client, pixels):
    return client.post(f"{API}/snapshots", files={"file": encoded("png", pixels)}).json()["id"]


@pytest.fixture(scope="module")
def snapshots(standing):
    return [uploaded(standing, drawn(seed)) for seed in range(5)]


def test_the_board_is_found_in_kept_pictures_and_one_without_it_is_named(standing, snapshots):
    blank = uploaded(standing, np.full((800, 1000, 3), 90, np.uint8))
    body = {
        "snapshots": [*snapshots, blank],
        "board": SMALL.to_json(),
        "options": {"terms": [], "warp": False},
    }
    told = finished(standing, accepted(standing.post(f"{CAL}/board", json=body)))
    assert told["state"] == "done", told
    record = told["result"]["record"]
    assert record["snapshots"] == body["snapshots"] and record["image_size"] == [1000, 800]
    assert [view["name"] for view in record["report"]["views"]] == [
        f"image {n}" for n in range(1, 6)
    ]
    assert all(view["corners"] == 48 for view in record["report"]["views"])
    (named,) = [w for w in record["report"]["warnings"] if w["reason"] == "no-board"]
    assert named["index"] == 5 and named["text"].startswith("Image 6 shows no")


def test_pictures_without_any_board_or_of_two_sizes_are_refused(standing, snapshots):
    other = {**SMALL.to_json(), "columns": 7}
    body = {"snapshots": snapshots[:1], "board": other}
    told = finished(standing, accepted(standing.post(f"{CAL}/board", json=body)))
    assert told["state"] == "failed" and told["problem"]["type"] == "/problems/no-board"
    body = {
        "snapshots": [snapshots[0], uploaded(standing, np.zeros((80, 100, 3), np.uint8))],
        "board": SMALL.to_json(),
    }
    refusal(standing.post(f"{CAL}/board", json=body), 409, "size-mismatch")
    body = {"snapshots": snapshots, "board": SMALL.to_json(), "image_size": [100, 80]}
    refusal(standing.post(f"{CAL}/board", json=body), 409, "size-mismatch")


def test_a_picture_damaged_on_disk_is_a_failed_job(standing, snapshots):
    repository, spoilt = standing.app.state.services.store.snapshots, uploaded(standing, drawn(5))
    path = repository.path(repository.get(spoilt))
    path.write_bytes(path.read_bytes()[:-1] + b"x")
    body = {"snapshots": [*snapshots[:2], spoilt], "board": SMALL.to_json()}
    told = finished(standing, accepted(standing.post(f"{CAL}/board", json=body)))
    assert told["state"] == "failed" and told["problem"]["type"] == "/problems/damaged-file"
    assert "Image 3" in told["problem"]["detail"]


@pytest.mark.long
def test_the_classic_left_camera_from_its_own_pictures(client, real_data):
    pictures = sorted(real_data("boards/opencv_left_right").glob("left*.jpg"))
    kept = [
        client.post(f"{API}/snapshots", files={"file": path.read_bytes()}).json()["id"]
        for path in pictures
    ]
    board = {"kind": "chessboard", "columns": 9, "rows": 6, "square_mm": 25.0}
    told = finished(
        client, accepted(client.post(f"{CAL}/board", json={"snapshots": kept, "board": board}))
    )
    assert told["state"] == "done", told
    record = told["result"]["record"]
    assert record["report"]["rms_px"] < 0.25
    assert record["lens"]["focal_px"] == pytest.approx(534, abs=4)


def test_a_lens_survives_a_restart_and_a_damaged_one_is_named(settings, client):
    store = client.app.state.services.store
    ids = [store.lenses.add({"model": "ssl", "n": n})["id"] for n in range(3)]
    damage_row(store, LensRow, lambda text: text.replace('"n":1', '"n":7'), id=ids[1])
    client.__exit__(None, None, None)
    # It would be healed from a backup, were one made in between.
    shutil.rmtree(settings.data / "backups", ignore_errors=True)
    with Store(settings.data) as again:
        assert again.lenses.get(ids[2])["n"] == 2
        assert [lens["id"] for lens in again.lenses.list().items] == [ids[2], ids[0]]
        assert json.dumps([d.to_json() for d in again.damaged]).count(ids[1]) == 1
