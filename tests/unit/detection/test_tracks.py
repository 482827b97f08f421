"""Tracks: one a thing however many cameras see it, with speed, covariance, and how far apart cameras see it."""

import numpy as np
import pytest

from touchline.detection.records import Detection
from touchline.detection.tracks import LOST_S, MIN_SIGHTINGS, ObjectTracker, seams_of

FPS = 30.0


def robot(x, y, number=3, team="yellow", sigma=2.0, front=0.0):
    return Detection(
        "robot",
        (0.0, 0.0),
        team,
        number,
        float(x),
        float(y),
        150.0,
        front,
        covariance_mm2=((sigma**2, 0.0), (0.0, sigma**2)),
    )


def ball(x, y):
    return Detection(
        "ball",
        (0.0, 0.0),
        None,
        None,
        float(x),
        float(y),
        21.5,
        covariance_mm2=((4.0, 0.0), (0.0, 4.0)),
    )


def test_a_robot_that_two_cameras_see_is_one_track_and_the_seam_is_told():
    tracker = ObjectTracker()
    for n in range(20):
        tracker.add("left", n / FPS, [robot(100 + 20 * n, 50)])
        tracker.add("right", n / FPS, [robot(100 + 20 * n, 62)])
    (track,) = tracker.to_json()
    assert (track["team"], track["id"], track["cameras"]) == ("yellow", 3, ["left", "right"])
    assert track["seam_mm"] == pytest.approx(12, abs=0.1) and track["y_mm"] == pytest.approx(
        56, abs=1.5
    )
    assert track["vx_mm_s"] == pytest.approx(600, abs=20) and abs(track["vy_mm_s"]) < 60
    assert seams_of([track]) == {
        "things": 1,
        "median_mm": track["seam_mm"],
        "max_mm": track["seam_mm"],
    }


def test_the_seam_of_what_moves_is_told_as_if_both_had_looked_at_once():
    tracker = ObjectTracker()
    for n in range(60):
        camera = ("left", "right")[n % 2]
        tracker.add(camera, n / 60, [robot(3000 * n / 60, 0 if camera == "left" else 9)])
    # each saw it 50 mm from where the other did
    assert tracker.to_json()[0]["seam_mm"] == pytest.approx(9, abs=3)


def test_where_one_camera_sees_it_there_is_no_seam():
    tracker = ObjectTracker()
    for n in range(5):
        tracker.add("left", n / FPS, [robot(0, 0)])
    assert (
        tracker.to_json()[0]["seam_mm"] is None and seams_of(tracker.to_json())["median_mm"] is None
    )


def test_a_track_goes_on_from_one_camera_to_the_next():
    tracker, numbers = ObjectTracker(), set()
    for n in range(60):
        x = -600 + 20 * n
        if x < 100:
            tracker.add("left", n / FPS, [robot(x, 0, sigma=4)])
        if x > -100:
            tracker.add("right", n / FPS + 0.005, [robot(x + 3, 0, sigma=4)])
        numbers |= {track["track"] for track in tracker.to_json()}
    assert len(numbers) == 1 and tracker.to_json()[0]["cameras"] == ["right"]


def test_robots_side_by_side_keep_their_tracks_and_a_lost_number_is_kept():
    tracker = ObjectTracker()
    for n in range(30):
        two = None if n % 3 == 0 else 2
        tracker.add("left", n / FPS, [robot(n * 10, 0, 1), robot(n * 10, 190, two)])
    told = {track["id"]: track for track in tracker.to_json()}
    assert set(told) == {1, 2} and told[2]["y_mm"] == pytest.approx(190, abs=4)


def test_what_flickers_is_not_told_and_what_is_gone_is_forgotten():
    tracker = ObjectTracker()
    tracker.add("left", 0.0, [ball(0, 0)])
    assert MIN_SIGHTINGS > 1 and tracker.to_json() == []
    for n in range(1, 4):
        tracker.add("left", n / FPS, [ball(0, 0)])
    assert len(tracker.to_json()) == 1
    assert tracker.to_json(3 / FPS + LOST_S + 0.01) == []
    tracker.add("left", 1.0, [])
    assert tracker.to_json() == []


def test_things_of_other_kinds_and_teams_are_never_one():
    tracker = ObjectTracker()
    for n in range(4):
        tracker.add("left", n / FPS, [robot(0, 0), robot(5, 0, team="blue"), ball(2, 0)])
    assert sorted((t["kind"], t["team"]) for t in tracker.to_json()) == [
        ("ball", None),
        ("robot", "blue"),
        ("robot", "yellow"),
    ]


def test_a_frame_that_comes_late_and_what_has_no_place_change_nothing():
    tracker = ObjectTracker()
    for n in range(4):
        tracker.add("left", 10 + n / FPS, [robot(0, 0), Detection("robot", (1.0, 1.0), "blue", 4)])
    before = tracker.to_json()
    tracker.add("right", 9.5, [robot(80, 0)])
    assert tracker.to_json() == before and len(before) == 1


def test_when_the_clock_is_set_back_all_tracks_begin_anew():
    tracker, back_s = ObjectTracker(), -60.0
    for n in range(20):
        tracker.add("left", n / FPS, [robot(100, 50)])
        tracker.add("right", n / FPS, [robot(100, 50)])
    for n in range(20, 40):
        tracker.add("left", n / FPS + back_s, [robot(400, 50)])
        if n != 25:  # one of its frames was under way when the clock was set
            tracker.add("right", n / FPS + back_s, [robot(400, 50)])
        else:
            tracker.add("right", n / FPS, [robot(100, 50)])
    (track,) = tracker.to_json()
    assert track["x_mm"] == pytest.approx(400, abs=1) and track["cameras"] == ["left", "right"]
    assert tracker.now_s == pytest.approx(39 / FPS + back_s)


def test_places_are_within_what_the_covariance_says():
    rng, inside, total = np.random.default_rng(2), 0, 0
    for _ in range(60):
        tracker, speed = ObjectTracker(), rng.normal(0, 600, 2)
        for n in range(25):
            true = speed * n / FPS
            tracker.add("left", n / FPS, [robot(*(true + rng.normal(0, 6, 2)), sigma=6)])
        track = tracker.to_json()[0]
        off = np.array([track["x_mm"], track["y_mm"]]) - true
        # 95 % of two dimensions
        inside += off @ np.linalg.solve(track["covariance_mm2"], off) < 5.99
        total += 1
    assert inside >= 0.9 * total
