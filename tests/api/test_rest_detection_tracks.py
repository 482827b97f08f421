"""REST of tracks: two real cameras' processes above one field, each thing told once, and the seam between them."""

import numpy as np
import pytest
from starlette.testclient import TestClient

from tests.support.live_play import Before
from tests.support.refusals import API, refusal
from tests.support.waiting import receive_until, until
from touchline.main import create_app
from touchline.settings import Settings

LONG_S = 90.0
RIG = {"field": "ssl-div-b", "cameras": ["low", "high"]}


@pytest.fixture(scope="module")
def plays():
    """The same play, before two cameras whose pictures overlap at the middle."""
    return [
        Before(name, 8, region, "field", 20, 0.8)
        for name, region in (("low", "quarter-bottom-left"), ("high", "quarter-top-left"))
    ]


@pytest.fixture(scope="module")
def client(tmp_path_factory, plays):
    settings = Settings(
        data=tmp_path_factory.mktemp("tracks"), cameras=[play.settings for play in plays]
    )
    with TestClient(create_app(settings), base_url="http://127.0.0.1:8000") as client:
        profile = None
        for play in plays:
            play.calibrate(client)
            until(
                lambda play=play: client.get(f"{API}/cameras/{play.name}/detections").status_code,
                lambda status: status != 503,
            )  # until then its process is starting
            body = {"clicks": play.clicks(), "base": profile}
            learned = client.post(f"{API}/cameras/{play.name}/colours/learn", json=body)
            assert learned.status_code == 200, learned.text
            profile = learned.json()["profile"]
        assert client.put(f"{API}/colours/hall", json={"profile": profile}).status_code == 201
        for play in plays:
            answer = client.put(
                f"{API}/cameras/{play.name}/seeing",
                headers={"If-Match": "unset"},
                json={"on": True, "plan": "ssl", "colours": "hall"},
            )
            assert answer.status_code == 200, answer.text
        assert client.put(f"{API}/rigs/west", json=RIG).status_code == 201
        yield client


def test_each_thing_is_one_track_where_it_stands_and_the_seam_is_told(client, plays):
    truth = plays[0].robots | plays[1].robots
    both = set(plays[0].robots) & set(plays[1].robots)
    assert len(both) > 1

    def robots(told):
        return {(t["team"], t["id"]): t for t in told["items"] if t["kind"] == "robot"}

    def all_tracked(told):
        tracks = robots(told)
        return set(truth) <= set(tracks) and all(len(tracks[key]["cameras"]) == 2 for key in both)

    with client.websocket_connect(
        f"{API}/rigs/west/tracks", headers={"host": "127.0.0.1:8000"}
    ) as line:
        told = receive_until(line, all_tracked)[-1]
    tracks = robots(told)
    off = [
        np.hypot(tracks[key]["x_mm"] - r.x_mm, tracks[key]["y_mm"] - r.y_mm)
        for key, r in truth.items()
    ]
    assert np.median(off) < 10 and max(off) < 40, off
    names = [
        (t["team"], t["id"]) for t in told["items"] if t["kind"] == "robot" and t["id"] is not None
    ]
    assert len(names) == len(set(names))
    assert all(0 < tracks[key]["seam_mm"] < 40 for key in both)
    assert told["seams"]["things"] >= len(both) and told["seams"]["max_mm"] < 40
    assert all(camera["problem"] is None for camera in told["cameras"])
    assert all(np.hypot(t["vx_mm_s"], t["vy_mm_s"]) < 200 for t in tracks.values())


def test_a_single_answer_has_the_same(client):
    answer = client.get(f"{API}/rigs/west/tracks")
    assert answer.status_code == 200, answer.text
    told = answer.json()
    assert {c["camera"] for c in told["cameras"]} == {"low", "high"} and set(told["seams"]) == {
        "things",
        "median_mm",
        "max_mm",
    }


def test_a_rig_that_is_not_there_is_refused_and_a_camera_that_sees_nothing_says_why(client):
    refusal(client.get(f"{API}/rigs/nobody/tracks"), 404, "unknown-rig")
    at = f"{API}/cameras/high/seeing"
    etag = client.get(at).headers["etag"]
    body = {"plan": "ssl", "colours": "hall"}
    assert client.put(at, json={**body, "on": False}, headers={"If-Match": etag}).status_code == 200
    told = client.get(f"{API}/rigs/west/tracks").json()
    assert {c["camera"]: c["problem"] and c["problem"]["reason"] for c in told["cameras"]}[
        "high"
    ] == "seeing-off"
