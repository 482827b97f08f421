"""Rolling things as plumb lines: found, followed, cut at kicks, and honest about what they tell of the lens."""

import json

import cv2
import numpy as np
import pytest
from rolling_balls import FPS, SIZE, chords, film, lens_of

from app.errors import BadInput, Conflict
from app.evaluate.rolls import border_pct, rolls_of
from app.geometry import ImageSize
from app.models.plumb_view import StraightPicture
from app.motion_pipeline import Rolling
from app.motion_task import rolls_in_film
from app.vision.straight_runs import straight_runs

CHORDS = [((60, 60), (580, 70), 40), ((590, 90), (560, 430), 30), ((540, 440), (60, 430), 40),
          ((50, 400), (80, 70), 30), ((100, 100), (520, 380), 35)]


def followed(frames, model=None):
    rolling = Rolling()
    for seconds, pixels in frames:
        rolling.add(seconds, pixels)
    rolling.end()
    return rolling.report(model, "example" if model else None)


@pytest.mark.parametrize("k", [-0.25, 0.0, 0.12])
def test_rolls_in_a_film_tell_the_lens_that_it_was_taken_with(k):
    told = followed(film(lens_of(k), CHORDS, seed=3))
    assert told["rolls"] == 5 and max(run["rms_px"] for run in told["runs"]) < 0.3
    truth = border_pct(k, SIZE)
    assert abs(told["raw"]["border_pct"] - truth) < max(3 * told["raw"]["border_sigma_pct"], 0.1)
    assert told["raw"]["border_sigma_pct"] < 0.8
    kind = "no distortion" if k == 0 else "barrel" if k < 0 else "pincushion"
    assert kind in told["sentence"]
    assert all(run["to_s"] > run["from_s"] for run in told["runs"]) and json.dumps(told, allow_nan=False)


def test_what_a_right_model_leaves_is_nothing_and_what_a_wrong_one_leaves_is_told():
    frames = list(film(lens_of(-0.25), CHORDS, seed=4))
    right = followed(frames, StraightPicture(lens_of(-0.25)))
    assert abs(right["corrected"]["border_pct"]) < max(3 * right["corrected"]["border_sigma_pct"], 0.1)
    assert "corrected" in right["sentence"] and "no distortion" in right["sentence"]
    wrong = followed(frames, StraightPicture(lens_of(0.0)))["corrected"]
    assert wrong["border_pct"] < -3 * wrong["border_sigma_pct"]


def test_the_lens_by_plumb_lines_comes_along_where_three_rolls_tell_it():
    told = followed(film(lens_of(-0.25), CHORDS, seed=5))
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
        runs = straight_runs(frames, np.concatenate([first, second]) + rng.normal(0, 0.25, (60, 2)), 1000.0)
        assert [abs(run.frames[-1] - 29) <= 2 for run in runs[:1]] == [True] and len(runs) == 2
        assert abs(runs[1].frames[0] - 30) <= 2 and max(run.rms_px for run in runs) < 0.4


def test_what_stands_shakes_or_turns_all_the_time_is_no_straight_run():
    rng, frames = np.random.default_rng(2), np.arange(80)
    shaking = rng.normal(300, 2, (80, 2))
    angle = np.linspace(0, 4 * np.pi, 80)
    circle = 300 + 60 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    crawling = np.stack([np.linspace(100, 130, 80), np.full(80, 50.0)], axis=1)
    for points in (shaking, circle, crawling):
        assert straight_runs(frames, points, 800.0) == []
    assert straight_runs(frames[:3], shaking[:3], 800.0) == []


@pytest.mark.parametrize("seed", [1, 2])
def test_the_lens_lies_within_two_sigma_of_what_rolls_tell_in_nineteen_of_twenty(seed):
    rng, size, off = np.random.default_rng(seed), ImageSize(1224, 1024), []
    for _ in range(60):
        k = rng.uniform(-0.35, 0.15)
        told = rolls_of(*chords(rng, lens_of(k, size), int(rng.integers(2, 13))), size)
        off.append((told.border_pct - border_pct(k, size)) / told.border_sigma_pct)
    assert np.mean(np.abs(off) < 2) >= 0.93 and np.sqrt(np.mean(np.square(off))) > 0.5  # nor far too humble


def test_a_roll_that_somebody_pushed_aside_counts_little_and_is_named():
    rng, size = np.random.default_rng(4), ImageSize(1224, 1024)
    tracks, seconds = chords(rng, lens_of(-0.2, size), 9)
    u = np.linspace(-1, 1, len(tracks[0]))[:, None]
    tracks[0] = tracks[0] + 25 * (1 - u**2)
    told = rolls_of(tracks, seconds, size)
    assert [roll.used for roll in told.rolls].count(False) >= 1 and not told.rolls[0].used
    assert abs(told.border_pct - border_pct(-0.2, size)) < 4 * told.border_sigma_pct


def test_without_rolls_nothing_is_claimed():
    told = followed(film(lens_of(0.0), [], still=20))
    assert told["rolls"] == 0 and told["raw"]["border_pct"] == 0 and told["raw"]["border_sigma_pct"] is None
    assert "Nothing rolled" in told["sentence"] and told["lens"] is None


def test_a_camera_that_is_not_still_is_refused():
    rng = np.random.default_rng(0)
    rolling = Rolling()
    for number in range(30):
        rolling.add(number / FPS, rng.integers(0, 255, (480, 640, 3)).astype(np.uint8))
    with pytest.raises(BadInput, match="not still"):
        rolling.report()
    with pytest.raises(BadInput, match="size"):
        rolling.add(2.0, np.zeros((10, 10, 3), np.uint8))
    with pytest.raises(BadInput):
        Rolling().report()


@pytest.fixture(scope="module")
def film_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("film") / "roll.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), FPS, tuple(SIZE))
    for _, pixels in film(lens_of(-0.25), CHORDS, seed=7):
        writer.write(pixels)
    writer.release()
    return path


def test_a_film_from_the_shell(touchline, film_file, tmp_path):
    code, out, err = touchline("motion", film_file, "--json", "--drawn", "drawn.png")
    assert code == 0, err
    told = json.loads(out)
    assert told["rolls"] == 5 and told["raw"]["border_pct"] < -1
    drawn = cv2.imread(str(tmp_path / "drawn.png"))
    x, y = np.round(told["runs"][0]["points"][5]).astype(int)
    assert drawn.shape == (480, 640, 3) and drawn[y, x, 2] > 200
    code, out, _ = touchline("motion", film_file)
    assert code == 0 and "barrel" in out and "roll 5" in out and "plumb lines" in out
    code, _, err = touchline("motion", "nothing.mp4")
    assert code != 0 and "nothing.mp4" in err


def test_a_calibration_for_another_size_is_refused(film_file):
    with pytest.raises(Conflict, match="640"):
        rolls_in_film(film_file, {"id": "x", "image_size": [800, 600], "name": "division", "parameters": {}})


def test_a_pool_ball_rolls_straight_to_a_third_of_a_pixel(real_data):
    told = rolls_in_film(real_data("motion/pool_smartcue/2019_PoolChamp_Clip15.mp4"))
    longest = max(told["runs"], key=lambda run: np.hypot(*np.subtract(run["points"][0], run["points"][-1])))
    assert len(longest["points"]) >= 20 and longest["straight_px"] < 0.35 and longest["rms_px"] < 0.2
    assert np.hypot(*np.subtract(longest["points"][0], longest["points"][-1])) > 290


def test_a_camera_in_somebodys_hand_is_refused(real_data):
    with pytest.raises(BadInput, match="not still"):
        rolls_in_film(real_data("motion/foosball/sample.avi"))
