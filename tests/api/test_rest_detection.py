"""REST of live seeing: a real camera's process finds robots and ball, by colours that are learned and kept."""

import json
import re
import time
from contextlib import contextmanager

import cv2
import numpy as np
import pytest
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from tests.support.group_listener import Listener, free_group
from tests.support.live_play import Before
from tests.support.refusals import API, refusal
from tests.support.sim_truth import truth_at
from tests.support.ssl_listener import Packet
from tests.support.viser_page import LOOK, PROTOCOL, messages_of
from tests.support.waiting import until
from touchline.main import create_app
from touchline.processes.framing import decode_body
from touchline.settings import Settings

HOST = {"host": "127.0.0.1:8000"}
LONG_S = 90.0  # a loaded machine starts a camera's process slowly


@pytest.fixture(scope="module")
def play():
    return Before("north")


@pytest.fixture(scope="module")
def settings(tmp_path_factory, play):
    bare = {"id": "bare", "source": play.source, "field": "ssl-div-b", "region": play.region}
    return Settings(data=tmp_path_factory.mktemp("seeing"), cameras=[play.settings, bare])


@pytest.fixture(scope="module")
def client(settings):
    with TestClient(create_app(settings), base_url="http://127.0.0.1:8000") as client:
        yield client


@pytest.fixture(scope="module")
def taught(client, play):
    """The camera is calibrated, and its colours are clicked and kept under a name."""
    calibration = play.calibrate(client)
    # its process has started, which takes long on a busy machine
    seen_until(client, lambda seen: True)
    learned = client.post(f"{API}/cameras/north/colours/learn", json={"clicks": play.clicks()})
    assert learned.status_code == 200, learned.text
    made = client.put(f"{API}/colours/hall", json={"profile": learned.json()["profile"]})
    assert made.status_code == 201, made.text
    put(client, colours="hall")
    return calibration


def put(client, camera="north", **changes):
    """What is set, changed by that."""
    at = f"{API}/cameras/{camera}/seeing"
    before = client.get(at)
    body = {name: before.json()[name] for name in ("on", "plan", "colours", "publish")} | changes
    answer = client.put(at, json=body, headers={"If-Match": before.headers["etag"]})
    assert answer.status_code == 200, answer.text
    return answer


@contextmanager
def listening(client, path):
    with client.websocket_connect(f"{API}/{path}", headers=HOST) as line:
        yield line


def seen_until(client, wanted, camera="north"):
    """The first frame that is as wanted."""
    end = time.monotonic() + LONG_S
    while time.monotonic() < end:
        with listening(client, f"cameras/{camera}/detections") as line:
            while "seq" in (seen := line.receive_json()) and time.monotonic() < end:
                if wanted(seen):
                    return seen
        assert "seq" in seen or seen["status"] == 503, seen  # its process is still starting
    raise AssertionError(f"it was not seen: {seen}")


def test_a_camera_without_calibration_sees_in_pixels_by_colours_it_finds_itself(client, play):
    told = client.get(f"{API}/cameras/bare/seeing").json()
    assert (
        told["on"]
        and told["plan"]["name"] == "ssl"
        and told["colours"] is None
        and not told["publish"]
    )
    answer = until(
        lambda: client.get(f"{API}/cameras/bare/detections"),
        lambda answer: answer.status_code != 503,
    )  # until then its process is starting
    assert answer.status_code == 200, answer.text
    seen = answer.json()
    assert seen["calibration"] is None and any(
        "positions are not available" in note for note in seen["notes"]
    )
    assert seen["items"] and all(item["x_mm"] is None for item in seen["items"])
    told = until(
        lambda: client.get(f"{API}/cameras/bare/seeing").json(), lambda told: told["learned"]
    )
    assert told["learned"] == "picture" and "orange" in told["profile"]["colours"]
    assert {one["level"] for one in told["health"]} <= {"good", "close", "mixed"}


def test_robots_and_ball_stand_where_they_are_with_number_and_covariance(client, play, taught):
    truth = play.robots
    seen = seen_until(
        client, lambda seen: seen["calibration"] == taught["id"] and len(seen["items"]) > len(truth)
    )
    robots = {(d["team"], d["id"]): d for d in seen["items"] if d["kind"] == "robot"}
    assert set(truth) <= set(robots)
    off = [
        np.hypot(robots[key]["x_mm"] - r.x_mm, robots[key]["y_mm"] - r.y_mm)
        for key, r in truth.items()
    ]
    assert np.median(off) < 8 and max(off) < 25, off
    turned = [
        abs((robots[key]["orientation_deg"] - np.degrees(r.angle) + 180) % 360 - 180)
        for key, r in truth.items()
    ]
    assert max(turned) < 8
    assert all(np.linalg.eigvalsh(d["covariance_mm2"]).min() > 0 for d in robots.values())
    assert [s["name"] for s in seen["stages"]] == [
        "noise",
        "colours",
        "blobs",
        "butterfly",
        "ball",
        "places",
    ]
    assert seen["ms"] == pytest.approx(sum(s["ms"] for s in seen["stages"]), abs=0.1)
    told = client.get(f"{API}/cameras/north/seeing").json()
    assert told["learned"] == "clicks" and told["profile"]["name"] == "hall"
    assert {one["colour"] for one in told["health"]} == {
        "orange",
        "yellow",
        "blue",
        "pink",
        "green",
    }


def test_frames_come_one_after_the_other_to_whoever_listens(client, taught):
    with listening(client, "cameras/north/detections") as line:
        told = [line.receive_json() for _ in range(4)]
    assert [t["seq"] for t in told] == sorted({t["seq"] for t in told})


@pytest.mark.parametrize("view", ["detections", "stage-colours", "stage-butterfly"])
def test_what_a_stage_made_of_the_picture_is_a_view_of_the_stream(client, taught, view):
    with listening(client, f"cameras/north/stream?view={view}&width=480") as line:
        head, jpeg = decode_body(line.receive_bytes())
    assert head["view"] == view and (head["width"], head["raw_width"]) == (480, 800)
    assert cv2.imdecode(np.frombuffer(jpeg, np.uint8), 1).shape == (360, 480, 3)


def test_a_view_is_had_as_a_single_picture_too_and_one_that_is_none_is_refused(client, taught):
    answer = client.get(f"{API}/cameras/north/frame.jpg?view=detections")
    assert cv2.imdecode(np.frombuffer(answer.content, np.uint8), 1).shape == (600, 800, 3)
    refusal(client.get(f"{API}/cameras/north/frame.jpg?view=stage-tags"), 404, "unknown-stage")
    for view in ("stage-", "stage-nothing", "sideways"):
        refusal(client.get(f"{API}/cameras/north/frame.jpg?view={view}"), 422, "unknown-view")
        refusal(client.get(f"{API}/cameras/north/stream.mjpg?view={view}"), 422, "unknown-view")
    refusal(client.get(f"{API}/cameras/north/frame.png?view=detections"), 422, "unknown-view")


def test_another_plan_is_followed_at_once_and_kept(client, taught):
    seen_until(client, lambda seen: any(item["kind"] == "ball" for item in seen["items"]))
    plan = client.get(f"{API}/cameras/north/seeing").json()["plan"]
    put(
        client,
        plan={
            **plan,
            "name": "no ball",
            "stages": [s for s in plan["stages"] if s["stage"] != "ball"],
        },
    )
    seen = seen_until(
        client, lambda seen: "ball" not in [s["name"] for s in seen["stages"]] and seen["items"]
    )
    assert {item["kind"] for item in seen["items"]} == {"robot"}
    kept = client.app.state.services.store.detection_plans.get("north").body
    assert (
        kept["plan"]["name"] == "no ball" and kept["colours"] == "hall" and kept["profile"] is None
    )
    put(client, plan="ssl")


def test_what_is_switched_off_is_not_seen(client, taught):
    put(client, on=False)
    refusal(client.get(f"{API}/cameras/north/detections"), 409, "seeing-off")
    refusal(client.get(f"{API}/cameras/north/frame.jpg?view=stage-colours"), 409, "seeing-off")
    with listening(client, "cameras/north/detections") as line:
        assert line.receive_json()["type"] == "/problems/seeing-off"
    put(client, on=True)
    assert client.get(f"{API}/cameras/north/detections").status_code == 200


def test_who_listens_is_told_when_it_is_switched_off(client, taught):
    with listening(client, "cameras/north/detections") as line:
        line.receive_json()
        put(client, on=False)
        with pytest.raises(WebSocketDisconnect) as closed:
            for _ in range(400):
                told = line.receive_json()
    assert told["type"] == "/problems/seeing-off" and closed.value.code == 4409
    put(client, on=True)


def test_what_somebody_else_has_set_is_not_written_over(client, taught):
    at = f"{API}/cameras/north/seeing"
    old = client.get(at).headers["etag"]
    body = {"on": True, "plan": "ssl", "colours": "hall"}
    refusal(client.put(at, json=body), 428, "if-match-needed")
    assert client.put(at, json=body, headers={"If-Match": old}).status_code == 200
    answer = client.put(at, json=body, headers={"If-Match": old})
    refusal(answer, 412, "stale-seeing")
    assert answer.headers["etag"] == client.get(at).headers["etag"]
    refusal(
        client.put(f"{API}/cameras/bare/seeing", json=body, headers={"If-Match": old}),
        412,
        "stale-seeing",
    )


@pytest.mark.parametrize(
    "change, status, reason",
    [
        ({"plan": "cricket"}, 404, "unknown-stages"),
        ({"plan": {"name": "x"}}, 422, "bad-stages"),
        ({"colours": "nobody"}, 404, "unknown-colours"),
        ({"profile": {"name": "x"}}, 422, "bad-colours"),
        ({"on": "yes"}, 422, None),
        ({"sees": True}, 422, None),
    ],
)
def test_what_makes_no_sense_is_refused(client, taught, change, status, reason):
    at = f"{API}/cameras/north/seeing"
    etag = client.get(at).headers["etag"]
    body = {"on": True, "plan": "ssl"} | change
    refusal(client.put(at, json=body, headers={"If-Match": etag}), status, reason)
    refusal(
        client.put(f"{API}/cameras/nobody/seeing", json=body, headers={"If-Match": etag}),
        404 if reason else 422,
    )


def test_colours_are_kept_by_name_shared_and_never_written_over_unseen(client, play, taught):
    at = f"{API}/colours/attic"
    profile = client.get(f"{API}/colours/hall").json()["profile"]
    assert (
        client.put(at, json={"profile": {**profile, "name": "hall"}}).json()["profile"]["name"]
        == "attic"
    )
    refusal(client.put(at, json={"profile": profile}), 428, "if-match-needed")
    etag = client.get(at).headers["etag"]
    put(client, "bare", colours="attic")
    changed = client.put(
        at, json={"profile": {**profile, "reach": 2.5}}, headers={"If-Match": etag}
    )
    assert changed.status_code == 200 and changed.json()["used_by"] == ["bare"]
    assert client.get(f"{API}/cameras/bare/seeing").json()["profile"]["reach"] == 2.5
    refusal(
        client.put(at, json={"profile": profile}, headers={"If-Match": etag}), 412, "stale-colours"
    )
    refusal(client.delete(at), 409, "colours-used")
    put(client, "bare", colours=None, profile=None)
    assert client.delete(at).status_code == 204
    refusal(client.delete(at), 404, "unknown-colours")
    assert [one["name"] for one in client.get(f"{API}/colours").json()["items"]] == ["hall"]
    refusal(client.put(f"{API}/colours/new", json={"profile": {"name": "x"}}), 422, "bad-colours")


def test_colours_are_learned_onto_others_from_a_snapshot_or_without_a_click(client, play, taught):
    at = f"{API}/cameras/north/colours/learn"
    snapshot = client.post(f"{API}/snapshots", json={"camera": "north"}).json()["id"]
    orange = {"orange": play.clicks()["orange"][:1]}
    onto = client.post(at, json={"clicks": orange, "base": "hall", "snapshot": snapshot}).json()
    assert len(onto["profile"]["colours"]["orange"]) == 1 + len(play.clicks()["orange"])
    found = client.post(at, json={"automatic": True}).json()
    assert {"orange", "yellow", "blue"} <= set(found["profile"]["colours"]) and found["health"]
    both = client.post(at, json={"automatic": True, "clicks": orange}).json()
    assert {"yellow", "blue"} <= set(both["profile"]["colours"])
    refusal(client.post(at, json={}), 422, "no-colours")
    refusal(client.post(at, json={"clicks": {"mauve": [[1, 2]]}}), 422, "unknown-colour")
    refusal(client.post(at, json={"clicks": {"blue": [[-5, 2]]}}), 422, "click-outside")
    refusal(client.post(at, json={"clicks": orange, "base": "nobody"}), 404, "unknown-colours")
    refusal(client.post(at, json={"clicks": orange, "snapshot": "nobody"}), 404)


def test_a_listener_to_the_leagues_group_hears_what_was_seen_once_it_is_switched_on(
    client, play, taught
):
    group = free_group()
    with Listener(**group) as listener:
        assert client.put(f"{API}/publishing", json={**group, "enabled": True}).status_code == 200
        put(client, publish=True)
        came = listener.hear_until(
            lambda came: Packet.FromString(came.data).HasField("detection"), LONG_S
        )
        frame = Packet.FromString(came.data).detection
        told = client.get(f"{API}/cameras/north/seeing").json()
        assert (
            told["publish"]
            and told["published"]["packets"] > 0
            and told["published"]["problem"] is None
        )
        numbered = {"numbers": {"north": 6}}
        assert client.put(f"{API}/publishing", json=numbered).status_code == 200
        listener.hear_until(
            lambda came: Packet.FromString(came.data).detection.camera_id == 6, LONG_S
        )
        put(client, publish=False)
    assert (
        frame.camera_id == 0
        and abs(frame.t_capture - time.time()) < 600
        and frame.t_sent >= frame.t_capture
    )
    heard = {
        (team, r.robot_id): r
        for team in ("yellow", "blue")
        for r in getattr(frame, f"robots_{team}")
    }
    assert set(play.robots) <= set(heard)
    for key, robot in play.robots.items():
        assert np.hypot(heard[key].x - robot.x_mm, heard[key].y - robot.y_mm) < 25
        assert heard[key].height == pytest.approx(150) and heard[key].HasField("orientation")
    ball = truth_at(play.rendering, 0.0).ball
    if ball.seen > 0.9:
        assert np.hypot(frame.balls[0].x - ball.x_mm, frame.balls[0].y - ball.y_mm) < 25


def test_a_scene_draws_what_was_detected_by_its_own_calibration_and_by_no_other(client, taught):
    record = client.get(f"{API}/calibrations/{taught['id']}/export/json").content
    other = client.post(f"{API}/calibrations/import", files={"file": record}).json()
    assert other["camera"] == "north"
    with listening(client, "scene") as line:
        address = line.receive_json()["address"].rstrip("/")
        line.send_json(
            {"set": {"layers": ["things"]}, "show": {"calibrations": [other["id"], taught["id"]]}}
        )
        assert line.receive_json()["shown"]
        with client.websocket_connect(address, subprotocols=[PROTOCOL], headers=HOST) as viewer:
            viewer.send_bytes(LOOK)
            drawn = []  # whose detections, packet by packet
            while drawn.count({taught["id"]}) < 3:
                drawn.append(
                    set(re.findall(r"/things/(\w+)/", messages_of(viewer.receive_bytes())))
                )
                assert other["id"] not in drawn[-1]


def test_publishing_that_leads_nowhere_is_said(client, taught):
    assert client.put(f"{API}/publishing", json={"enabled": False}).status_code == 200
    put(client, publish=True)
    at = f"{API}/cameras/north/seeing"
    problem = until(lambda: client.get(at).json()["published"]["problem"])
    assert problem["reason"] == "not-publishing" and problem["fix"]
    put(client, publish=False)
    assert json.loads(client.get(at).content)["published"]["problem"] is None


def test_a_clip_is_stepped_through_frame_by_frame_and_stage_by_stage(client, play, taught):
    answer = client.post(f"{API}/cameras/north/clip", json={"seconds": 1})
    assert answer.status_code == 201, answer.text
    clip = answer.json()
    assert clip["camera"] == "north" and clip["frames"] >= 3 and clip["seconds"] > 0.5
    at = f"{API}/clips/{clip['clip']}"
    assert [one["clip"] for one in client.get(f"{API}/clips").json()["items"]] == [clip["clip"]]
    times = client.get(at).json()["times_s"]
    assert times == sorted(times) and len(times) == clip["frames"]
    last = clip["frames"] - 1
    told = client.get(f"{at}/frames/{last}").json()
    assert told["time_s"] == times[last] and told["calibration"] == taught["id"]
    robots = {(d["team"], d["id"]): d for d in told["items"] if d["kind"] == "robot"}
    for key, robot in play.robots.items():
        assert np.hypot(robots[key]["x_mm"] - robot.x_mm, robots[key]["y_mm"] - robot.y_mm) < 25
    assert client.get(f"{at}/frames/{last}").json()["items"] == told["items"]
    for stage in ("raw", "detections", "colours"):
        answer = client.get(f"{at}/frames/0.jpg?stage={stage}")
        assert cv2.imdecode(np.frombuffer(answer.content, np.uint8), 1).shape == (600, 800, 3)
    refusal(client.get(f"{at}/frames/0.jpg?stage=tags"), 404, "unknown-stage")
    assert client.get(f"{at}/frames/0.jpg?stage=tags&plan=vsss").status_code == 200
    refusal(client.get(f"{at}/frames/{clip['frames']}"), 404, "unknown-frame")
    assert client.delete(at).status_code == 204
    refusal(client.get(f"{at}/frames/0.jpg"), 404, "unknown-clip")
    refusal(client.post(f"{API}/cameras/north/clip", json={"seconds": 31}), 422)


def test_a_clip_has_the_seconds_before_where_somebody_was_looking(client, taught):
    with listening(client, "cameras/north/stream?view=stage-colours&width=160") as line:
        begun, end = None, time.monotonic() + LONG_S
        while time.monotonic() < end:
            head, _ = decode_body(line.receive_bytes())
            begun = begun or head["time"]
            if head["time"] - begun > 2.5:
                break
        asked = head["time"]
        clip = client.post(f"{API}/cameras/north/clip", json={"seconds": 2}).json()
    times = client.get(f"{API}/clips/{clip['clip']}").json()["times_s"]
    assert times[0] < asked - 0.5 and clip["seconds"] == pytest.approx(2, abs=0.5)
