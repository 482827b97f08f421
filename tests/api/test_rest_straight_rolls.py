"""REST of rolls: followed before a live camera, kept, judged, and made into a lens or a refined calibration."""

from contextlib import ExitStack, contextmanager

import cv2
import numpy as np
import pytest
from starlette.testclient import TestClient

from tests.support.activation import activate_despite
from tests.support.refusals import API, refusal
from tests.support.rest_jobs import accepted, finished
from tests.support.rolling_balls import FPS, SIZE, chords, film, lens_of
from tests.support.sim_clicks import border_clicks
from tests.support.waiting import receive_until, until
from touchline.main import create_app
from touchline.settings import Settings
from touchline.sources import SourceContext, source_from_url
from touchline.store.fields import load_fields

SOURCE = "sim://table?robots=0&ball=true&lens=division&k=-0.3&size=640x480&fps=25&height=1400"
ROLLS = 4


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    """A server with a camera above a rolling ball, one above an empty field, and a film in its pictures folder."""
    folder = tmp_path_factory.mktemp("rolls")
    out = cv2.VideoWriter(
        str(folder / "rolls.avi"), cv2.VideoWriter_fourcc(*"MJPG"), FPS, tuple(SIZE)
    )
    for _, pixels in film(
        lens_of(-0.25),
        [
            ((60, 60), (580, 70), 20),
            ((590, 90), (560, 430), 20),
            ((540, 440), (60, 430), 20),
            ((50, 400), (80, 70), 20),
        ],
        seed=7,
    ):
        out.write(pixels)
    out.release()
    settings = Settings(
        data=folder / "data",
        pictures=folder,
        cameras=[
            {"id": "ball", "source": SOURCE, "field": "table", "region": "full"},
            {"id": "bare", "source": "sim://table?robots=0&size=320x256&fps=20"},
        ],
    )
    with TestClient(create_app(settings), base_url="http://127.0.0.1:8000") as client:
        yield client


@contextmanager
def listening(client, camera, query=""):
    with client.websocket_connect(
        f"{API}/cameras/{camera}/rolls/stream{query}", headers={"host": "127.0.0.1:8000"}
    ) as line:
        yield line


@pytest.fixture(scope="module")
def rolled(client):
    """What was told until some rolls were kept."""
    # on a busy machine its process takes longer to start than a line waits
    status = f"{API}/cameras/ball/status"
    until(lambda: client.get(status).json()["state"], lambda state: state == "live")
    with listening(client, "ball") as line:
        return receive_until(
            line, lambda told: told["told"] and len(told["told"]["items"]) >= ROLLS
        )


@pytest.fixture(scope="module")
def calibration(client):
    """A version of that camera by a few clicks on each border; it is active."""
    field = load_fields()["table"]
    camera = source_from_url(SOURCE, SourceContext(fields={"table": field})).camera
    clicks = border_clicks(camera, field.regions["full"], 4, 0.5, np.random.default_rng(1))
    body = {
        "camera": "ball",
        "image_size": list(SIZE),
        "field": "table",
        "region": "full",
        "model": "division",
        "options": {"height_mm": {"value": 1400.0, "sigma": 10.0}},
        "observations": [
            {"feature": name, "points": points.tolist()} for name, points in clicks.items()
        ],
    }
    made = client.post(f"{API}/calibrations", json=body)
    assert made.status_code == 201, made.text
    activate_despite(client, made.json()["id"])
    return made.json()


def test_each_roll_is_told_with_its_number_and_kept_once(client, rolled):
    items = rolled[-1]["told"]["items"]
    assert sum(len(told["new"]) for told in rolled) == len(items) >= ROLLS
    assert any(track for told in rolled for track in told["tracks"]) and rolled[-1]["hint"] == ""
    assert [(told["width"], told["height"]) for told in rolled[:1]] == [tuple(SIZE)]
    judged = [item["raw"] for item in items]
    assert all(
        roll["spread_pct"] > 0 and roll["words"] and len(item["points"]) >= 8
        for item, roll in zip(items, judged, strict=True)
    )
    kept = client.get(f"{API}/cameras/ball/rolls").json()
    assert {item["id"] for item in items} <= {item["id"] for item in kept["items"]}
    report = kept["report"]
    assert (
        report["raw"]["border_pct"] < -2 * report["raw"]["border_sigma_pct"]
        and "barrel" in report["sentence"]
    )
    assert np.shape(report["raw"]["zones"]) == (3, 3)


def test_the_active_calibration_is_judged_by_the_same_rolls(client, rolled, calibration):
    report = client.get(f"{API}/cameras/ball/rolls").json()["report"]
    assert report["model"] == calibration["id"]
    assert abs(report["corrected"]["border_pct"]) < abs(report["raw"]["border_pct"])
    assert "corrected" in report["sentence"]


def test_who_only_listens_keeps_nothing_and_hears_the_rolls_themselves(client, rolled):
    before = client.get(f"{API}/cameras/ball/rolls").json()
    with listening(client, "ball", "?keep=false") as line:
        told = receive_until(line, lambda told: told["new"])[-1]
    assert len(told["new"][0]["points"]) >= 8 and told["new"][0]["seconds"] > 0
    assert len(client.get(f"{API}/cameras/ball/rolls").json()["items"]) == len(before["items"])


def test_a_roll_is_left_out_taken_in_again_and_forgotten(client, rolled):
    at = f"{API}/cameras/ball/rolls"
    first = client.get(at).json()["items"][0]["id"]
    out = client.patch(f"{at}/{first}", json={"left_out": True}).json()
    assert out["items"][0]["left_out"] and out["items"][0]["raw"] is None
    again = client.patch(f"{at}/{first}", json={"left_out": False}).json()
    assert again["items"][0]["raw"] and again["report"]["rolls"] == out["report"]["rolls"] + 1
    assert client.delete(f"{at}/{first}").status_code == 204
    refusal(client.delete(f"{at}/{first}"), 404, "unknown-roll")
    assert first not in [item["id"] for item in client.get(at).json()["items"]]
    refusal(
        client.patch(
            f"{API}/cameras/bare/rolls/{again['items'][1]['id']}", json={"left_out": True}
        ),
        404,
    )
    assert client.delete(f"{API}/cameras/bare/rolls").status_code == 204


def test_a_lens_of_kept_rolls_is_kept_and_a_fit_holds_it(client, rolled, calibration):
    done = finished(
        client,
        accepted(
            client.post(
                f"{API}/motion",
                json={"camera": "ball", "make": "lens", "lens": "division", "note": "after lunch"},
            )
        ),
    )
    assert done["state"] == "done", done
    lens = client.get(f"{API}/lenses/{done['result']['lens']}").json()
    listed = client.get(f"{API}/lenses").json()["items"][0]
    assert (listed["id"], listed["note"], listed["model"]) == (
        lens["id"],
        "after lunch",
        "division",
    )
    unit = lens["lens"]["unit_px"]
    assert lens["lens"]["terms"]["k"] < 0 and lens["report"]["verdict"]["sentence"]
    body = {
        key: calibration[key] for key in ("camera", "image_size", "field", "region", "observations")
    }
    for sigma in ("0", "own"):
        made = client.post(
            f"{API}/calibrations",
            json={
                **body,
                "model": "division",
                "options": {
                    "lens": lens["id"],
                    "lens_sigma": sigma,
                    "height_mm": {"value": 1400.0, "sigma": 10.0},
                },
            },
        )
        assert made.status_code == 201, made.text
        found = made.json()["model"]["parameters"]
        bend = found["lens_terms"][0] * (unit / found["focal_px"]) ** 2
        off = abs(bend - lens["lens"]["terms"]["k"]) / lens["report"]["sigma"]["k"]
        assert off < (0.05 if sigma == "0" else 3)
    refusal(
        client.post(
            f"{API}/calibrations",
            json={**body, "model": "brown-conrady", "options": {"lens": lens["id"]}},
        ),
        422,
        "bad-option",
    )
    refusal(
        client.post(
            f"{API}/calibrations",
            json={
                **body,
                "image_size": [800, 600],
                "model": "division",
                "options": {"lens": lens["id"]},
            },
        ),
        422,
        "bad-option",
    )


def test_the_active_calibration_is_refined_as_a_new_version_that_is_not_active(
    client, rolled, calibration
):
    done = finished(
        client, accepted(client.post(f"{API}/motion", json={"camera": "ball", "make": "refined"}))
    )
    assert done["state"] == "done" and done["result"]["lens"] is None, done
    made = client.get(f"{API}/calibrations/{done['result']['calibration']}").json()
    assert made["version"] > calibration["version"] and made["parent"] and not made["active"]
    assert (
        made["camera"] == "ball"
        and made["options"]["lens_sigma"] == "own"
        and "lens refined with" in made["note"]
    )
    assert client.get(f"{API}/calibrations/{calibration['id']}").json()["active"]
    assert client.get(f"{API}/calibrations/{made['id']}/uncertainty.json").status_code == 200
    assert client.get(f"{API}/calibrations/{made['id']}/report.html").status_code == 200
    assert client.get(f"{API}/calibrations/{made['id']}/export/json").status_code == 200
    refusal(
        client.post(
            f"{API}/motion", json={"camera": "ball", "make": "refined", "calibration": made["id"]}
        ),
        409,
        "not-refinable",
    )


def test_a_film_in_the_pictures_folder_is_judged(client):
    done = finished(
        client, accepted(client.post(f"{API}/motion", json={"film": "rolls.avi", "make": "lens"}))
    )
    assert done["state"] == "done", done
    report = done["result"]["report"]
    assert report["rolls"] == 4 and report["raw"]["border_pct"] < -2
    assert (
        abs(
            client.get(f"{API}/lenses/{done['result']['lens']}").json()["lens"]["terms"]["k"] + 0.25
        )
        < 0.06
    )


def test_times_of_posted_rolls_give_a_deceleration_or_are_refused(client, calibration):
    tracks, seconds = chords(np.random.default_rng(3), lens_of(-0.2), 8)
    rolls = [
        {"points": p.tolist(), "seconds": t, "times": np.linspace(0, t, len(p)).tolist()}
        for p, t in zip(tracks, seconds, strict=True)
    ]
    body = {"rolls": rolls, "image_size": list(SIZE), "calibration": calibration["id"]}
    done = finished(client, accepted(client.post(f"{API}/motion", json=body)))
    report = done["result"]["report"]
    assert report["deceleration"]["skipped"]["untimed"] == 0 and report["runs"][0]["times"]
    untimed = [{name: one[name] for name in ("points", "seconds")} for one in rolls]
    done = finished(client, accepted(client.post(f"{API}/motion", json={**body, "rolls": untimed})))
    assert done["result"]["report"]["deceleration"]["skipped"]["untimed"] > 0
    for times in (rolls[0]["times"][1:], rolls[0]["times"][::-1], [0.0] * len(tracks[0])):
        wrong = {**body, "rolls": [{**rolls[0], "times": times}]}
        refusal(client.post(f"{API}/motion", json=wrong), 422)


def test_rolls_that_a_script_has_followed_itself_are_judged(client):
    tracks, seconds = chords(np.random.default_rng(3), lens_of(-0.2), 8)
    rolls = [{"points": p.tolist(), "seconds": t} for p, t in zip(tracks, seconds, strict=True)]
    done = finished(
        client,
        accepted(client.post(f"{API}/motion", json={"rolls": rolls, "image_size": list(SIZE)})),
    )
    told = done["result"]["report"]["raw"]
    assert len(told["rolls"]) == 8 and told["border_pct"] < -2 * told["border_sigma_pct"]
    assert done["result"]["lens"] is None
    short = finished(
        client,
        accepted(
            client.post(
                f"{API}/motion", json={"rolls": rolls[:2], "image_size": list(SIZE), "make": "lens"}
            )
        ),
    )
    assert short["state"] == "failed" and short["problem"]["type"].endswith("too-few-rolls")


@pytest.mark.parametrize(
    ("body", "status"),
    [
        ({}, 422),
        ({"film": "../rolls.avi"}, 404),
        ({"film": "none.avi"}, 404),
        ({"camera": "none"}, 404),
        ({"camera": "bare"}, 409),
        ({"film": "rolls.avi", "camera": "ball"}, 422),
        ({"film": "rolls.avi", "make": "refined"}, 409),
        ({"film": "rolls.avi", "make": "coffee"}, 422),
        ({"film": "rolls.avi", "lens": "cubic"}, 422),
        ({"film": "rolls.avi", "calibration": "none"}, 404),
        ({"rolls": [{"points": [[0, 0]] * 5, "seconds": 1.0}]}, 422),
        ({"rolls": [], "image_size": [640, 480]}, 422),
    ],
)
def test_what_cannot_be_judged_is_refused_with_what_to_do(client, body, status):
    refusal(client.post(f"{API}/motion", json=body), status)


def test_a_camera_that_is_not_there_and_a_fifth_who_watches_are_refused(client):
    with listening(client, "none") as line:
        assert line.receive_json()["status"] == 404
    refusal(client.get(f"{API}/cameras/none/rolls"), 404)
    # it may have slept until now
    until(lambda: client.get(f"{API}/cameras/bare/status").json()["state"] == "live")
    with ExitStack() as lines:
        for _ in range(4):
            assert lines.enter_context(listening(client, "bare")).receive_json()["new"] == []
        with listening(client, "bare") as fifth:
            assert fifth.receive_json()["type"].endswith("rolls-watched")
