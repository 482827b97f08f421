"""REST of rigs: kept by one hand at a time, checked, refitted alike, and seen as one picture."""

import cv2
import numpy as np
import pytest
from starlette.testclient import TestClient

from tests.support.activation import activate_despite
from tests.support.refusals import API, refusal
from tests.support.rest_jobs import accepted, finished
from tests.support.rig_over_field import FIELD, REGIONS, sim_source, sim_task
from tests.support.waiting import until
from touchline.core.errors import Cancelled
from touchline.core.geometry import ImageSize
from touchline.formats import FORMATS
from touchline.images import encode
from touchline.main import create_app
from touchline.settings import Settings

RIGS = f"{API}/rigs"
HERE = "http://127.0.0.1:8000"
ADDRESS = "sim://ssl-div-b?cameras=2&camera={}&lens=half&tilt=6&fill=0.86&robots=0&fps=30"
BODY = {
    "title": "Hall",
    "field": "ssl-div-b",
    "cameras": [
        {"camera": "cam0", "region": "half-left"},
        {"camera": "cam1", "region": "half-right"},
    ],
}


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    """Two simulated cameras over one field, calibrated from an operator's clicks and active; and one without."""
    halves = (
        {"id": f"cam{n}", "name": f"Camera {n}", "source": ADDRESS.format(n), "field": "ssl-div-b"}
        for n in (0, 1)
    )
    cameras = (*halves, {"id": "idle", "name": "Idle", "source": ADDRESS.format(0)})
    settings = Settings(data=tmp_path_factory.mktemp("data"), cameras=cameras)
    with TestClient(create_app(settings), base_url=HERE) as opened:
        for number in (0, 1):
            activate(opened, number)
        yield opened


def activate(client, number, model="brown-conrady", options=None, field="ssl-div-b"):
    task = sim_task(2, number, model=model, options=options)
    data = FORMATS["json"].write(task.record(task.run(cross_validate=False)))
    data = data.replace(b'"ssl-div-b"', f'"{field}"'.encode())
    made = client.post(f"{API}/calibrations/import", files={"file": data})
    assert made.status_code == 201, made.text
    activate_despite(client, made.json()["id"])
    assert made.json()["camera"] == f"cam{number}"
    return made.json()["id"]


@pytest.fixture
def rig(client):
    """The name of one that is kept for a test."""
    assert client.put(f"{RIGS}/hall", json=BODY).status_code == 201
    yield f"{RIGS}/hall"
    client.delete(f"{RIGS}/hall")


def test_a_rig_is_made_read_changed_and_removed(client):
    made = client.put(f"{RIGS}/hall", json=BODY)
    assert made.status_code == 201 and made.headers["location"] == f"{RIGS}/hall"
    read = client.get(f"{RIGS}/hall")
    assert read.json() == made.json() and read.headers["etag"] == made.headers["etag"]
    assert [rig["name"] for rig in client.get(RIGS).json()["items"]] == ["hall"]
    changed = client.put(
        f"{RIGS}/hall",
        json={**BODY, "title": "Big hall"},
        headers={"If-Match": read.headers["etag"]},
    )
    assert changed.status_code == 200 and changed.json()["title"] == "Big hall"
    assert client.delete(f"{RIGS}/hall").status_code == 204
    assert refusal(client.get(f"{RIGS}/hall"), 404)["type"].endswith("unknown-rig")


def test_nobody_overwrites_anothers_rig(client, rig):
    assert refusal(client.put(rig, json=BODY), 428)
    etag = client.get(rig).headers["etag"]
    assert (
        client.put(rig, json={**BODY, "title": "theirs"}, headers={"If-Match": etag}).status_code
        == 200
    )
    slower = client.put(rig, json={**BODY, "title": "ours"}, headers={"If-Match": etag})
    told = refusal(slower, 412)
    assert (
        told["current"]["title"] == "theirs"
        and slower.headers["etag"] == client.get(rig).headers["etag"]
    )
    assert refusal(client.delete(rig, headers={"If-Match": etag}), 412)
    assert client.get(rig).json()["title"] == "theirs"
    assert refusal(client.put(f"{RIGS}/other", json=BODY, headers={"If-Match": etag}), 412)


@pytest.mark.parametrize(
    ("change", "status"),
    [
        ({"field": "nowhere"}, 404),
        ({"cameras": ["cam0", "nobody"]}, 404),
        ({"cameras": []}, 422),
        ({"cameras": ["cam0", "cam0"]}, 422),
        ({"cameras": [{"camera": "cam0", "region": "nowhere"}]}, 404),
        ({"w_max_rectangle_px": 100}, 422),
        ({"unknown": 1}, 422),
        (
            {
                "w_max_rectangle_px": 9000,
                "h_max_rectangle_px": 9000,
                "n_rectangles_x": 900,
                "n_rectangles_y": 900,
            },
            422,
        ),
        (
            {
                "w_max_rectangle_px": 1e309,
                "h_max_rectangle_px": 1,
                "n_rectangles_x": 1,
                "n_rectangles_y": 1,
            },
            422,
        ),
    ],
)
def test_what_is_no_rig_is_refused_with_what_to_do(client, change, status):
    import json

    answer = client.put(
        f"{RIGS}/bad",
        content=json.dumps({**BODY, **change}),
        headers={"Content-Type": "application/json"},
    )
    assert refusal(answer, status)["fix"]
    assert client.get(f"{RIGS}/bad").status_code == 404


def test_names_alone_do_for_its_cameras(client):
    made = client.put(
        f"{RIGS}/short", json={"field": "ssl-div-b", "cameras": ["cam0", "idle"]}
    ).json()
    assert [c["region"] for c in made["cameras"]] == [None, None]
    assert [t["reason"] for c in made["cameras"] for t in c["troubles"]] == ["not-calibrated"]
    assert client.delete(f"{RIGS}/short").status_code == 204


@pytest.mark.long
def test_a_check_by_live_pictures_says_in_plain_words_that_the_cameras_agree(client, rig):
    job = finished(client, accepted(client.post(f"{rig}/check?job=true", json={})))
    assert job["state"] == "done", job
    (pair,) = job["result"]["pairs"]
    assert pair["from"] == "pictures", (pair["notes"], job["result"]["missing"])
    assert pair["failed"] is None and job["result"]["missing"] == []
    told = pair["agreement"]
    assert told["carpet"]["mean_mm"] < 6 and told["hat"]["mean_mm"] < 8
    assert np.array(pair["fundamental"]["matrix"]).shape == (3, 3)
    assert "Camera 0 and Camera 1" in pair["verdict"]["sentence"]
    assert job["result"]["verdict"]["level"] in ("good", "fair")


def test_a_check_by_matches_holds_them_against_the_foretold_geometry(client, rig):
    places = np.random.default_rng(0).uniform([-200, -2800, 0], [200, 2800, 150], (40, 3))
    a, b = (sim_source(2, n).camera.raw_from_field(places).tolist() for n in (1, 0))
    answer = client.post(
        f"{rig}/check",
        json={
            "pictures": "none",
            "matches": [
                {
                    "a": "cam1",
                    "b": "cam0",
                    "points_a": [*a, None],
                    "points_b": [*b, [1, 1]],
                    "z_mm": [*places[:, 2].tolist(), 0],
                }
            ],
        },
    )
    assert answer.status_code == 200, answer.text
    (pair,) = answer.json()["pairs"]
    assert (pair["a"], pair["b"], pair["from"]) == ("cam0", "cam1", "matches")
    assert pair["agreement"]["carpet"]["p95_mm"] < 6
    assert pair["matches"]["calibrated"]["median_px"] < 1


def test_a_check_by_clicks_says_what_it_cannot_see(client, rig):
    (pair,) = client.post(f"{rig}/check", json={"pictures": "none"}).json()["pairs"]
    assert pair["from"] == "clicks" and "Check with current images" in pair["verdict"]["fix"]


@pytest.mark.parametrize("as_job", [False, True])
def test_a_rig_shows_its_newest_check_until_a_calibration_is_replaced(client, rig, as_job):
    def checked():
        (listed,) = client.get(RIGS).json()["items"]
        one, other = listed["checked"], client.get(rig).json()["checked"]
        for found in filter(None, (one, other)):
            # a camera that is learnt anew may be monitored from one moment to the next
            found.pop("outdated")
        assert one == other
        return one

    former = activate(client, 0)
    assert checked() is None
    answer = client.post(f"{rig}/check", params={"job": as_job}, json={"pictures": "none"})
    result = finished(client, accepted(answer))["result"] if as_job else answer.json()
    (pair,) = result["pairs"]
    assert checked()["verdict"] == result["verdict"] and checked()["at"].endswith("Z")
    assert checked()["p95_mm"] == max(pair["agreement"][z]["p95_mm"] for z in ("carpet", "hat"))
    carpet = pair["agreement"]["carpet"]
    assert checked()["pairs"] == [
        {
            **{name: pair[name] for name in ("a", "b")},
            **{name: carpet[name] for name in ("median_mm", "max_mm")},
            "level": pair["verdict"]["level"],
        }
    ]
    assert 0 < carpet["median_mm"] <= carpet["max_mm"]
    etag = client.get(rig).headers["etag"]
    assert client.put(
        rig, json={**BODY, "title": "Other words"}, headers={"If-Match": etag}
    ).json()["checked"]
    activate(client, 0)
    assert checked() is None
    activate_despite(client, former)
    assert checked()["verdict"] == result["verdict"]  # it is about these very calibrations


def test_a_camera_that_moves_after_a_check_makes_its_agreement_void_until_it_is_back(client, rig):
    def checked():
        return client.get(rig).json()["checked"]

    def knocked(px):
        answer = client.patch(f"{API}/cameras/cam0/controls", json={"controls": {"knock": px}})
        assert answer.status_code == 200, answer.text

    level = client.post(f"{rig}/check", json={"pictures": "none"}).json()["verdict"]["level"]
    until(checked, lambda now: now["outdated"] == [])  # once both are monitored
    knocked(30)
    void = until(checked, lambda now: now["verdict"]["level"] is None)
    assert [(one["camera"], one["reason"]) for one in void["outdated"]] == [("cam0", "moved")]
    assert (
        void["verdict"]["reason"] == "outdated"
        and client.get(RIGS).json()["items"][0]["checked"] == void
    )
    knocked(0)
    assert until(checked, lambda now: now["outdated"] == [])["verdict"]["level"] == level


@pytest.mark.parametrize(
    "body",
    [
        {"snapshots": {"nobody": "a" * 16}},
        {
            "matches": [{"a": "cam0", "b": "nobody", "points_a": [[1, 2]], "points_b": [[1, 2]]}],
            "pictures": "none",
        },
        {
            "matches": [
                {"a": "cam0", "b": "cam1", "points_a": [[1, 2]], "points_b": [[1, 2], [3, 4]]}
            ],
            "pictures": "none",
        },
    ],
)
def test_a_check_of_nonsense_is_refused(client, rig, body):
    assert refusal(client.post(f"{rig}/check", json=body), 422)["fix"]


def test_cameras_with_other_rectangles_are_told_and_refitted_but_never_activated(client, rig):
    mine = {
        "w_max_rectangle_px": 90.0,
        "h_max_rectangle_px": 80.0,
        "n_rectangles_x": 9,
        "n_rectangles_y": 12,
    }
    etag = client.get(rig).headers["etag"]
    told = client.put(rig, json={**BODY, **mine}, headers={"If-Match": etag}).json()
    assert told["rectangles"] == mine and told["rectangles_from"] == "rig"
    assert [c["troubles"][0]["reason"] for c in told["cameras"]] == ["other-rectangles"] * 2
    before = [c["calibration"] for c in told["cameras"]]
    job = finished(client, accepted(client.post(f"{rig}/refit", json={"cameras": ["cam1"]})))
    assert job["state"] == "done", job
    (made,) = job["result"]["calibrations"]
    calibration = client.get(f"{API}/calibrations/{made}").json()
    assert (
        not calibration["active"]
        and calibration["parent"] == before[1]
        and calibration["camera"] == "cam1"
    )
    assert [c["calibration"] for c in client.get(rig).json()["cameras"]] == before
    activate_despite(client, made)
    cameras = client.get(rig).json()["cameras"]
    assert (
        cameras[1]["troubles"] == [] and cameras[1]["rectangles"] == mine and cameras[0]["troubles"]
    )
    activate_despite(client, before[1])


def test_nothing_is_refitted_where_all_agree(client, rig):
    assert refusal(client.post(f"{rig}/refit", json={}), 409)["type"].endswith("nothing-to-refit")


def test_the_stitched_picture_shows_the_lines_where_the_description_says(client, rig):
    answer = client.get(f"{rig}/stitched.png?width=1500")
    assert answer.status_code == 200 and answer.headers["x-rig-missing"] == "", answer.text
    picture = cv2.imdecode(np.frombuffer(answer.content, np.uint8), cv2.IMREAD_GRAYSCALE).astype(
        float
    )
    told = client.get(f"{rig}/stitched.json?width=1500").json()
    assert (picture.shape[1], picture.shape[0]) == (told["width"], told["height"])
    assert told["unseen"]["share"] == 0 and float(answer.headers["x-unseen-share"]) == 0
    (line,) = [one for one in told["overlay"] if one["feature"] == "halfway-line"]
    (x, y0), (_, y1) = line["points"]
    rows = np.linspace(y0, y1, 40)[4:-4].round().astype(int)
    brightest = [np.argmax(picture[row, round(x) - 6 : round(x) + 7]) - 6 for row in rows]
    assert abs(np.median(brightest)) <= 1  # px of 6.4 mm
    jpeg = client.get(f"{rig}/stitched.jpg?width=300")
    assert jpeg.headers["content-type"] == "image/jpeg"
    assert cv2.imdecode(np.frombuffer(jpeg.content, np.uint8), cv2.IMREAD_COLOR).shape[1] == 300


def test_it_is_stitched_from_snapshots_too_and_says_what_nobody_sees(client, rig):
    frame = sim_source(2, 1).read().pixels
    kept = client.post(
        f"{API}/snapshots", files={"file": encode(frame)}, data={"camera": "cam1"}
    ).json()["id"]
    answer = client.get(f"{rig}/stitched.png?width=600&snapshot={kept}")
    assert answer.status_code == 200 and answer.headers["x-rig-missing"] == "cam0"
    assert 0.15 < float(answer.headers["x-unseen-share"]) < 0.5
    again = client.get(f"{rig}/stitched.png?width=600&snapshot=cam1:{kept}")
    assert again.content == answer.content
    assert refusal(client.get(f"{rig}/stitched.png?snapshot=idle:{kept}"), 422)["fix"]
    for width in (9, 8192):
        assert refusal(client.get(f"{rig}/stitched.png?width={width}"), 422)["fix"]
    small = client.post(f"{API}/snapshots", files={"file": encode(frame[:500])}).json()["id"]
    assert refusal(client.get(f"{rig}/stitched.png?snapshot=cam1:{small}"), 409)["type"].endswith(
        "size-mismatch"
    )


def test_a_rig_of_which_nothing_can_be_shown_says_so(client):
    client.put(f"{RIGS}/empty", json={"field": "ssl-div-b", "cameras": ["idle"]})
    assert refusal(client.get(f"{RIGS}/empty/stitched.jpg"), 422)["type"].endswith(
        "nothing-to-stitch"
    )
    found = client.post(f"{RIGS}/empty/check", json={}).json()
    assert found["verdict"]["level"] is None and "Idle" in found["verdict"]["fix"]
    client.delete(f"{RIGS}/empty")


def test_regions_are_those_of_the_field():
    assert set(REGIONS[4]) <= set(FIELD.regions)


@pytest.fixture
def own(client):
    """After the test there is no rig "own", and the first camera is calibrated as before."""
    calibrated = client.get(f"{API}/cameras/cam0").json()["active_calibration"]
    yield
    client.delete(f"{RIGS}/own")
    activate_despite(client, calibrated)


def test_a_field_that_changed_under_its_name_changes_the_stitched_picture_at_once(client, own):
    def height():
        answer = client.get(f"{RIGS}/own/stitched.json?width=600")
        assert answer.status_code == 200, answer.text
        return answer.json()["height"]

    field = {**client.get(f"{API}/fields/ssl-div-b").json(), "name": "own"}
    assert client.put(f"{API}/fields/own", json=field).status_code == 200
    activate(client, 0, field="own")
    assert client.put(f"{RIGS}/own", json={**BODY, "field": "own"}).status_code == 201
    before = height()
    assert (
        client.put(
            f"{API}/fields/own", json={**field, "width_mm": field["width_mm"] + 1000}
        ).status_code
        == 200
    )
    assert height() > before


def test_another_region_of_a_camera_changes_the_stitched_picture_at_once(client, rig):
    def shares():
        return [
            one["share"] for one in client.get(f"{rig}/stitched.json?width=600").json()["cameras"]
        ]

    before, etag = shares(), client.get(rig).headers["etag"]
    cameras = [
        {"camera": "cam0", "region": "half-left"},
        {"camera": "cam1", "region": "quarter-top-right"},
    ]
    assert (
        client.put(rig, json={**BODY, "cameras": cameras}, headers={"If-Match": etag}).status_code
        == 200
    )
    assert shares() != before


def test_drawing_ends_once_its_caller_has_gone(client):
    looks = []

    async def has_gone():
        looks.append(1)
        return len(looks) > 2

    def draw(progress):
        while True:
            progress(0.5, "Drawing")

    with pytest.raises(Cancelled) as end:
        client.portal.call(
            client.app.state.services.process_picture, ImageSize(4000, 4000), draw, has_gone
        )
    assert end.value.fix and len(looks) == 3


def test_a_camera_calibrated_before_the_field_was_changed_is_told_and_not_compared(client, own):
    field = {**client.get(f"{API}/fields/ssl-div-b").json(), "name": "own"}
    assert client.put(f"{API}/fields/own", json=field).status_code == 200
    for number in (0, 1):
        activate(client, number, field="own")
    assert client.put(f"{RIGS}/own", json={**BODY, "field": "own"}).status_code == 201
    assert [c["troubles"] for c in client.get(f"{RIGS}/own").json()["cameras"]] == [[], []]
    arcs = [{**field["arcs"][0], "radius_mm": 515.0}]
    assert client.put(f"{API}/fields/own", json={**field, "arcs": arcs}).status_code == 200
    for camera in client.get(f"{RIGS}/own").json()["cameras"]:
        (trouble,) = camera["troubles"]
        assert trouble["reason"] == "field-changed" and "centre circle" in trouble["text"]
    found = client.post(f"{RIGS}/own/check", json={"pictures": "none"}).json()
    assert found["pairs"] == [] and {
        t["reason"] for c in found["cameras"] for t in c["troubles"]
    } == {"field-changed"}
