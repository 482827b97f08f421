"""Rolling things as plumb lines: found, followed, cut at kicks, and honest about what they tell of the lens."""

import json
from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest

from tests.support.live_cameras import capturing
from tests.support.rolling_balls import FPS, SIZE, chords, film, lens_of
from tests.support.sim_clicks import border_observations, known_grid, rms_mm
from tests.support.tiers import long, rounds
from tests.support.waiting import LONG_S, until
from touchline.core.errors import BadInput, Conflict, FitFailed, NotFound
from touchline.core.geometry import ImageSize
from touchline.core.jobs import no_progress
from touchline.live import capture as live_capture
from touchline.models import field_from_raw, model_from_json
from touchline.sources.sim.camera import LENSES, SimCamera
from touchline.store.fields import load_fields
from touchline.straight import live as live_rolls
from touchline.straight import rolling as recording
from touchline.straight import tracks as tracking
from touchline.straight.rolling import (
    RollRecorder,
    check_refinable,
    lens_record,
    refine,
    run_motion,
    stored_rolls_json,
    track_film,
)
from touchline.straight.rolls import RecordedRoll, analyse_rolls, border_pct, roll_report
from touchline.straight.straightness import UndistortedView
from touchline.straight.tracks import MovingBlob, Tracker, straight_runs
from touchline.workflows.calibration_request import CalibrationRequest

LARGE = ImageSize(1224, 1024)
CHORDS = [
    ((60, 60), (580, 70), 40),
    ((590, 90), (560, 430), 30),
    ((540, 440), (60, 430), 40),
    ((50, 400), (80, 70), 30),
    ((100, 100), (520, 380), 35),
]


def followed(frames):
    rolling = RollRecorder()
    for seconds, pixels in frames:
        rolling.add(seconds, pixels)
    rolling.end()
    return rolling.report()


@pytest.fixture(scope="module")
def filmed(tmp_path_factory):
    """Of a lens: what five rolls behind it were recorded as, and their film; made once."""
    folder, kept = tmp_path_factory.mktemp("films"), {}

    def of(k):
        if k not in kept:
            rolling, path = RollRecorder(), folder / f"{k}.avi"
            writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), FPS, tuple(SIZE))
            for seconds, pixels in film(lens_of(k), CHORDS, seed=3):
                rolling.add(seconds, pixels)
                writer.write(pixels)
            writer.release()
            rolling.end()
            kept[k] = rolling, path
        return kept[k]

    return of


@pytest.mark.parametrize("k", [-0.25, long(0.0), long(0.12)])
def test_rolls_in_a_film_tell_the_lens_that_it_was_taken_with(filmed, k):
    told = filmed(k)[0].report()
    assert told["rolls"] == 5 and max(run["rms_px"] for run in told["runs"]) < 0.3
    truth = border_pct(k, SIZE)
    assert abs(told["raw"]["border_pct"] - truth) < max(3 * told["raw"]["border_sigma_pct"], 0.1)
    assert told["raw"]["border_sigma_pct"] < 0.8
    kind = "no significant distortion" if k == 0 else "barrel" if k < 0 else "pincushion"
    assert kind in told["sentence"]
    assert all(run["to_s"] > run["from_s"] for run in told["runs"]) and json.dumps(
        told, allow_nan=False
    )


def test_what_a_right_model_leaves_is_nothing_and_what_a_wrong_one_leaves_is_told(filmed):
    recorded = filmed(-0.25)[0]
    right = recorded.report(UndistortedView(lens_of(-0.25)), "example")
    assert abs(right["corrected"]["border_pct"]) < max(
        3 * right["corrected"]["border_sigma_pct"], 0.1
    )
    assert "corrected" in right["sentence"] and "no significant distortion" in right["sentence"]
    wrong = recorded.report(UndistortedView(lens_of(0.0)), "example")["corrected"]
    assert wrong["border_pct"] < -3 * wrong["border_sigma_pct"]


def test_the_lens_by_plumb_lines_comes_along_where_three_rolls_tell_it(filmed):
    told = filmed(-0.25)[0].report()
    assert abs(told["lens"]["lens"]["terms"]["k"] + 0.25) < 0.04
    assert followed(film(lens_of(-0.25), CHORDS[:1], seed=5))["lens"] is None


def test_two_balls_at_once_and_one_that_passes_behind_a_robot_are_followed():
    rolls = [[((60, 100), (560, 120), 40), ((560, 380), (80, 300), 40)]]
    frames = list(film(lens_of(0.0), rolls, seed=6))
    for _, pixels in frames[20:23]:
        pixels[60:440, 280:310] = frames[0][1][60:440, 280:310]  # hidden for three frames
    told = followed(frames)
    assert told["rolls"] == 2
    assert sorted(round(run["points"][0][0] / 100) for run in told["runs"]) == [1, 6]


def test_a_kick_cuts_a_track_in_two_at_its_corner():
    frames, rng = np.arange(60), np.random.default_rng(1)
    for turn in (25, 60, 120):
        way = np.deg2rad(turn)
        first = np.stack([np.linspace(100, 400, 30), np.full(30, 200.0)], axis=1)
        second = first[-1] + np.arange(1, 31)[:, None] * 10 * np.array([np.cos(way), np.sin(way)])
        runs = straight_runs(
            frames, np.concatenate([first, second]) + rng.normal(0, 0.25, (60, 2)), 1000.0
        )
        assert [abs(run.frames[-1] - 29) <= 2 for run in runs[:1]] == [True] and len(runs) == 2
        assert abs(runs[1].frames[0] - 30) <= 2 and max(run.rms_px for run in runs) < 0.4


def test_live_a_roll_is_told_soon_after_its_end_though_the_ball_is_still_followed():
    rolling, told = RollRecorder(live=True), []
    # one track, two kicks
    path = [((60, 60), (580, 70), 40), ((580, 70), (560, 430), 30), ((560, 430), (60, 430), 40)]
    for number, (seconds, pixels) in enumerate(film(lens_of(-0.25), path, seed=8)):
        # every other frame was missed
        told += [(number, roll) for roll in rolling.add(seconds, pixels, 2 * number)]
    ends = [3 + 40, 3 + 70]
    assert [round(roll.to_s * FPS) for _, roll in told[:2]] == pytest.approx(ends, abs=3)
    assert all(number - roll.to_s * FPS < 20 for number, roll in told)
    told += [(0, roll) for roll in rolling.end()]
    assert len(told) == 3 and max(roll.rms_px for _, roll in told) < 0.4


def test_what_is_followed_all_day_takes_no_more_room(monkeypatch):
    monkeypatch.setattr(recording, "MAX_KNOWN_FRAMES", 100)
    monkeypatch.setattr(tracking, "MAX_POINTS", 60)
    tracker, rolling, lengths = Tracker(), RollRecorder(live=True), []
    for frame in range(160):
        tracker.add(
            frame,
            [MovingBlob(320 + 100 * np.cos(frame / 9), 240 + 100 * np.sin(frame / 9), 50.0, 40.0)],
        )
        lengths += [len(track.points) for track in tracker.now]
    assert max(lengths) == 59  # the sixtieth ends it
    pixels = np.zeros((48, 64, 3), np.uint8)
    for frame in range(150):
        rolling.add(frame / 30, pixels)
    assert len(rolling._times) <= 100


def test_what_stands_shakes_or_turns_all_the_time_is_no_straight_run():
    rng, frames = np.random.default_rng(2), np.arange(80)
    shaking = rng.normal(300, 2, (80, 2))
    angle = np.linspace(0, 4 * np.pi, 80)
    circle = 300 + 60 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    crawling = np.stack([np.linspace(100, 130, 80), np.full(80, 50.0)], axis=1)
    for points in (shaking, circle, crawling):
        assert straight_runs(frames, points, 800.0) == []
    assert straight_runs(frames[:3], shaking[:3], 800.0) == []


@pytest.mark.parametrize(("seed", "worlds"), [(1, 7), long(1, 60), long(2, 60)])
def test_the_lens_lies_within_two_sigma_of_what_rolls_tell_in_nineteen_of_twenty(seed, worlds):
    rng, size, off = np.random.default_rng(seed), ImageSize(1224, 1024), []
    for _ in range(worlds):
        k = rng.uniform(-0.35, 0.15)
        told = analyse_rolls(*chords(rng, lens_of(k, size), int(rng.integers(2, 13))), size)
        off.append((told.border_pct - border_pct(k, size)) / told.border_sigma_pct)
    # nor far too humble
    assert np.mean(np.abs(off) < 2) >= 0.93 and np.sqrt(np.mean(np.square(off))) > 0.5


def test_a_roll_that_somebody_pushed_aside_counts_little_and_is_named():
    rng, size = np.random.default_rng(4), ImageSize(1224, 1024)
    tracks, seconds = chords(rng, lens_of(-0.2, size), 9)
    u = np.linspace(-1, 1, len(tracks[0]))[:, None]
    tracks[0] = tracks[0] + 25 * (1 - u**2)
    told = analyse_rolls(tracks, seconds, size)
    assert [roll.used for roll in told.rolls].count(False) >= 1 and not told.rolls[0].used
    assert abs(told.border_pct - border_pct(-0.2, size)) < 4 * told.border_sigma_pct


def test_one_roll_that_carries_the_answer_alone_makes_it_unsure():
    rng, size = np.random.default_rng(4), ImageSize(1224, 1024)
    tracks, seconds = chords(rng, lens_of(0.0, size), 5)
    middle = np.array(size.centre)
    # through the middle: they tell nothing
    tracks = [(p - p.mean(axis=0)) * 0.3 + middle for p in tracks]
    u = np.linspace(-1, 1, 40)[:, None]
    hand = np.array([300.0, 60.0]) + np.concatenate([60 * u, 8 * (1 - u**2)], axis=1)
    alone = analyse_rolls([*tracks, hand], [*seconds, 0.4], size)
    assert abs(alone.border_pct) < 2 * alone.border_sigma_pct and alone.border_sigma_pct > 1


def test_what_is_driven_is_not_taken_for_rolls():
    rng, size, tracks = np.random.default_rng(5), ImageSize(1224, 1024), []
    for _ in range(12):  # robots, on rounds of about 150 px
        turn = rng.uniform(0, 2 * np.pi) + rng.choice([-1, 1]) * np.linspace(0, 0.8, 40)
        tracks.append(
            rng.uniform(200, 800, 2)
            + rng.uniform(100, 200) * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        )
    told = roll_report([RecordedRoll(p, 0.0, 1.3, 0.1, 1.0) for p in tracks], size)
    assert not told["raw"]["free"] and "driven or pushed" in told["sentence"]
    with pytest.raises(FitFailed) as refused:
        lens_record([RecordedRoll(p, 0.0, 1.3, 0.1, 1.0) for p in tracks], size)
    assert refused.value.reason == "not-free"


def test_without_rolls_nothing_is_claimed():
    told = followed(film(lens_of(0.0), [], still=20))
    assert (
        told["rolls"] == 0
        and told["raw"]["border_pct"] == 0
        and told["raw"]["border_sigma_pct"] is None
    )
    assert "No straight roll" in told["sentence"] and told["lens"] is None


def test_a_camera_that_is_not_still_is_refused():
    rng = np.random.default_rng(0)
    rolling = RollRecorder()
    for number in range(30):
        rolling.add(number / FPS, rng.integers(0, 255, (480, 640, 3)).astype(np.uint8))
    with pytest.raises(BadInput, match="not steady"):
        rolling.report()
    with pytest.raises(BadInput, match="size"):
        rolling.add(2.0, np.zeros((10, 10, 3), np.uint8))
    with pytest.raises(BadInput):
        RollRecorder().report()


@cache
def calibrated_over_rolls(clicks=4, count=20, seed=1, lens="strong", size=LARGE):
    """A camera 6.5 m above a field: rolls before it, and a calibration by a few clicks on each border."""
    field = load_fields()["ssl-div-b"]
    region, rng = field.regions["full"], np.random.default_rng(seed)
    camera = SimCamera.above(region, size, LENSES[lens], height_mm=6500)
    task = CalibrationRequest(
        border_observations(camera, region, clicks, 0.5, rng, anywhere=True),
        field,
        region,
        camera.image_size,
        "brown-conrady",
        {"height_mm": {"value": 6500.0, "sigma": 30.0}},
        camera="north",
    )
    rolls = []
    while len(rolls) < count:
        start, angle = rng.uniform([-4300, -2900], [4300, 2900]), rng.uniform(0, 2 * np.pi)
        end = start + rng.uniform(1500, 5000) * np.array([np.cos(angle), np.sin(angle)])
        if abs(end[0]) < 4400 and abs(end[1]) < 2950:
            t = np.linspace(0, 1, 40)[:, None]
            raw = camera.raw_from_field(
                np.concatenate([start * (1 - t) + end * t, np.full((40, 1), 21.5)], axis=1)
            )
            rolls.append(RecordedRoll(raw + rng.normal(0, 0.25, raw.shape), 0.0, 1.3, 0.25, 0.3))
    return (camera, rolls), task.record(task.run(cross_validate=False))


def test_a_job_makes_a_report_a_lens_or_a_better_calibration_of_a_film(filmed):
    spec = {
        "film": str(filmed(-0.25)[1]),
        "rolls": [],
        "image_size": None,
        "calibration": None,
        "make": "lens",
        "lens": "division",
        "centre_sigma_px": 0.0,
        "note": "",
        "camera": None,
    }
    made = run_motion(spec, no_progress)
    assert (
        made["report"]["rolls"] == 5
        and made["report"]["raw"]["border_pct"] < -1
        and made["calibration"] is None
    )
    assert (
        made["lens"]["lens"]["name"] == "division"
        and abs(made["lens"]["lens"]["terms"]["k"] + 0.25) < 0.05
    )
    _, calibration = calibrated_over_rolls(size=SIZE)
    better = run_motion(
        {**spec, "make": "refined", "calibration": calibration.to_json()}, no_progress
    )["calibration"]
    assert better["options"]["lens_sigma"] == "own"
    with pytest.raises(NotFound, match=r"nothing\.mp4"):
        run_motion({**spec, "film": "nothing.mp4"}, no_progress)


def test_a_calibration_for_another_size_is_refused(filmed):
    _, made = calibrated_over_rolls()
    with pytest.raises(Conflict, match="640"):
        track_film(str(filmed(-0.25)[1]), calibration=made)


def test_rolls_tell_the_lens_within_three_sigma_and_a_fit_that_holds_it_needs_few_clicks():
    (camera, rolls), made = calibrated_over_rolls()
    kept = lens_record(rolls, camera.image_size, "brown-conrady")
    unit = np.hypot(*camera.image_size) / 2
    truth = {
        "k1": -0.28 * (unit / camera.focal_px[0]) ** 2,
        "k2": 0.09 * (unit / camera.focal_px[0]) ** 4,
    }
    for name in truth:
        assert (
            abs(kept["lens"]["terms"][name] - truth[name]) < 3 * kept["report"]["sigma"][name] < 0.3
        )
    raw, field = (points.reshape(-1, 2) for points in known_grid(camera, camera_region(), 9, 7))

    def off_mm(calibration):
        model = model_from_json(calibration.model_name, calibration.model_parameters)
        return rms_mm(field_from_raw(model, raw), field)

    better = refine(made, kept)
    # these four clicks a border tell the lens badly
    assert 20 > off_mm(made) > 1.5 * off_mm(better)
    assert (
        better.parent == made.id
        and "lens refined with" in better.note
        and better.options["lens_sigma"] == "own"
    )


def camera_region():
    return load_fields()["ssl-div-b"].regions["full"]


def test_what_rolls_cannot_refine_is_refused_with_the_reason():
    (camera, rolls), made = calibrated_over_rolls()
    for wrong in (
        None,
        replace(made, model_name="polynomial"),
        replace(made, observations=()),
        refine(made, lens_record(rolls, camera.image_size, "brown-conrady")),
    ):
        with pytest.raises(Conflict) as refused:
            check_refinable(wrong)
        assert refused.value.fix
    with pytest.raises(FitFailed) as refused:
        lens_record(rolls[:2], camera.image_size)
    assert refused.value.reason == "too-few-rolls"


def test_kept_rolls_say_each_its_number_and_those_left_out_none():
    rng, size = np.random.default_rng(4), ImageSize(1224, 1024)
    tracks, seconds = chords(rng, lens_of(-0.2, size), 9)
    kept = [
        {
            "id": str(i),
            "at": 10.0 + i,
            "seconds": t,
            "points": p.tolist(),
            "image_size": list(size),
            "left_out": i == 3,
        }
        for i, (p, t) in enumerate(zip(tracks, seconds, strict=True))
    ]
    kept[0]["image_size"] = [640, 480]
    told = stored_rolls_json(kept, None)
    assert told["report"]["rolls"] == 7 and told["report"]["raw"]["border_pct"] < 0
    assert [item["id"] for item in told["items"] if item["raw"] is None] == ["0", "3"]
    assert not told["items"][0]["counts"] and told["items"][3]["left_out"]
    assert {item["raw"]["level"] for item in told["items"] if item["raw"]} <= {
        "good",
        "fair",
        "poor",
        "left-out",
    }
    assert json.dumps(told, allow_nan=False) and stored_rolls_json([], None) == {
        "items": [],
        "report": None,
        "deceleration": None,
    }


def recorded_of(path, first, last):
    """The frames of a film from the first to before the last."""
    film, rolling = cv2.VideoCapture(str(path)), RollRecorder()
    for number in range(last):
        ok = film.grab()
        assert ok
        if number >= first:
            rolling.add(number / FPS, film.retrieve()[1])
    rolling.end()
    return rolling


@rounds("part", (102, 136), None)
def test_a_pool_ball_rolls_straight_to_a_third_of_a_pixel(real_data, part):
    path = real_data("motion/pool_smartcue/2019_PoolChamp_Clip15.mp4")
    told = (recorded_of(path, *part) if part else track_film(str(path))).report()
    longest = max(
        told["runs"], key=lambda run: np.hypot(*np.subtract(run["points"][0], run["points"][-1]))
    )
    assert (
        len(longest["points"]) >= 20 and longest["straight_px"] < 0.35 and longest["rms_px"] < 0.2
    )
    assert np.hypot(*np.subtract(longest["points"][0], longest["points"][-1])) > 290


@rounds("part", (30, 46), None)
def test_a_camera_in_somebodys_hand_is_refused(real_data, part):
    path = real_data("motion/foosball/sample.avi")
    with pytest.raises(BadInput, match="not steady"):
        (recorded_of(path, *part) if part else track_film(str(path))).report()


def test_what_moves_is_followed_only_while_somebody_asks(monkeypatch):
    monkeypatch.setattr(live_rolls, "KEEP_S", LONG_S)
    monkeypatch.setattr(live_capture, "RESTS_AFTER_S", 0.3)
    with capturing("sim://table?robots=0&ball=true&size=320x256&fps=50") as capture:
        watch = live_rolls.RollMonitor(capture)

        def ask_for_the_last_time():
            monkeypatch.setattr(live_rolls, "KEEP_S", 0.0)
            watch.poll("", 0, 0)  # any picture will do: it is answered at once

        first = watch.poll("", 0, 0)
        again = watch.poll(first["watch"], 0, first["seq"])
        assert again["seq"] > first["seq"] and again["watch"] == first["watch"]
        assert (again["width"], again["height"]) == (320, 256)
        ask_for_the_last_time()
        until(lambda: watch._thread is None)  # it costs nothing now
        monkeypatch.setattr(live_rolls, "KEEP_S", LONG_S)
        assert watch.poll(first["watch"], 7, 0)["watch"] != first["watch"]  # and numbers begin anew
        ask_for_the_last_time()
        until(lambda: watch._thread is None and capture.resting)
