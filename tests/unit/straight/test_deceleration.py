"""The ball's decelerations from rolls that are integrated step by step and seen through a camera with a lens."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.support.exported import of_model
from tests.support.pair_over_field import FIELD
from tests.support.rig_over_field import true_models
from tests.support.rolling_balls import carpet, frame
from touchline.straight.deceleration import TimedRoll, _sentence, measure_deceleration
from touchline.straight.live import _Watch
from touchline.straight.rolling import stored_rolls_json
from touchline.straight.service import SAVED, read_roll

SLIDE, ROLL, SWITCH = -3.4, -0.42, 0.64
BALL_MM = 21.5
MODEL = true_models()[0]


def moved(rng, speed, kicked, dt=1e-4, until=2.0, slide=SLIDE, roll=ROLL, switch=SWITCH):
    """Times and distances, m, by Euler's steps."""
    roll *= 1 + rng.normal(0, 0.03)  # the carpet's pile, and its slope
    t, s, v, times, way = 0.0, 0.0, speed, [], []
    while t < until and v > 0.05:
        times.append(t)
        way.append(s)
        a = slide if kicked and v > switch * speed else roll
        v, s, t = v + a * dt, s + v * dt, t + dt
    return np.array(times), np.array(way)


def seen(rng, times, way, fps, noise_px=0.3, lies_s=0.0):
    """The roll's points, raw px, and their times: with a jitter of a millisecond, and every tenth frame missing."""
    frames = rng.uniform(0, 1 / fps) + np.arange(-round(lies_s * fps), times[-1] * fps - 1) / fps
    frames = frames[rng.random(len(frames)) > 0.1]
    s = np.interp(frames + rng.normal(0, 1e-3, len(frames)), times, way) * 1000
    for _ in range(100):
        region = MODEL.region
        start = rng.uniform((region.x_mm[0], region.y_mm[0]), (region.x_mm[1], region.y_mm[1]))
        angle = rng.uniform(0, 2 * np.pi)
        places = start + s[:, None] * [np.cos(angle), np.sin(angle)]
        pixels = MODEL.project(np.column_stack([places, np.full(len(s), BALL_MM)]))
        inside = np.isfinite(pixels).all(axis=1) & (pixels > 0).all(axis=1)
        inside &= (pixels < tuple(MODEL.image_size)).all(axis=1)
        if inside.mean() > 0.7:  # it may leave the picture, or come into it
            break
    pixels = pixels[inside] + rng.normal(0, noise_px, (inside.sum(), 2))
    return TimedRoll(MODEL.unproject(pixels, BALL_MM), frames[inside], bool(inside[0]))


def rolled(rng, count=10, kicked=False, lies_s=0.0, **changes):
    fps = rng.choice([30, 60, 75])
    return [
        seen(
            rng,
            *moved(
                rng,
                rng.uniform(1.0, 4.0) if not kicked else rng.uniform(2.0, 4.5),
                kicked,
                **changes,
            ),
            fps,
            lies_s=lies_s,
        )
        for _ in range(count)
    ]


def errors(seeds, kicked):
    """Error over the value and over σ of each quantity."""
    found = {}
    for seed in range(seeds):
        got = measure_deceleration(rolled(np.random.default_rng(seed), kicked=kicked))
        for name, true in (("acc_roll", ROLL), ("acc_slide", SLIDE), ("k_switch", SWITCH)):
            one = getattr(got, name)
            if one is not None:
                off = one.value - true
                found.setdefault(name, []).append((off / abs(true), off / one.sigma))
    return {name: np.array(values) for name, values in found.items()}


@pytest.mark.parametrize("kicked", [False, True])
def test_ten_rolls_tell_within_five_percent_and_two_sigma(kicked):
    found = errors(40, kicked)
    assert {*found} == ({"acc_roll", "acc_slide", "k_switch"} if kicked else {"acc_roll"})
    for name, values in found.items():
        share, sigmas = np.abs(values).T
        assert len(values) == 40 and np.mean(share < 0.05) >= 0.95, name
        assert np.mean(sigmas < 2) >= 0.9 and np.median(sigmas) > 0.15, name
        assert share.max() < 0.1 and abs(np.mean(values[:, 0])) < 0.01, name


def with_hand(rng, at_end):
    """A roll that a hand stops, or still pushes, in its last or first sixth."""
    times, way = moved(rng, 2.5, kicked=False, until=1.2)
    v = np.gradient(way, times)
    edge = times > 1.0 if at_end else times < 0.2
    v[edge] = v[edge] - 8.0 * (times[edge] - 1.0) if at_end else v[~edge][0] * times[edge] / 0.2
    return seen(rng, times, np.cumsum(v) * (times[1] - times[0]), 60)


@pytest.mark.parametrize("at_end", [False, True])
def test_what_a_hand_does_at_an_end_does_not_count(at_end):
    rng = np.random.default_rng(5)
    found = measure_deceleration([with_hand(rng, at_end) for _ in range(10)])
    assert found.acc_roll.value == pytest.approx(ROLL, rel=0.15)
    assert abs(found.acc_roll.value - ROLL) < 2 * found.acc_roll.sigma
    assert found.acc_slide is None


def test_what_is_driven_or_too_short_or_too_few_tells_nothing():
    rng = np.random.default_rng(1)
    even = [seen(rng, *moved(rng, 1.5, False, roll=0.0), 60) for _ in range(10)]
    assert measure_deceleration(even).acc_roll is None
    said = _sentence(measure_deceleration(even), is_calibrated=True, is_free=True)
    assert "show no deceleration" in said
    two = rolled(rng, count=2)
    assert measure_deceleration(two).acc_roll is None and measure_deceleration(two).rolls == 2
    short = [TimedRoll(one.places_mm[:8], one.times_s[:8]) for one in rolled(rng)]
    lost = [TimedRoll(one.places_mm * np.nan, one.times_s) for one in rolled(rng)]
    for none in (short, lost, []):
        found = measure_deceleration(none)
        assert found == replace(measure_deceleration([]), short=len(none))


def test_short_slides_in_few_frames_do_not_draw_the_mean():
    values = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        rolls = [
            seen(rng, *moved(rng, rng.uniform(2, 4.5), True, slide=-3.0), 30) for _ in range(10)
        ]
        values.append(measure_deceleration(rolls).acc_slide.value)
    assert np.mean(values) == pytest.approx(-3.0, rel=0.015)


def test_a_kicked_ball_that_a_hand_stops_rolls_as_others_do():
    values = []
    for seed in range(12):
        rng, rolls = np.random.default_rng(seed), []
        for _ in range(10):
            times, way = moved(rng, rng.uniform(2, 4.5), True)
            v, at = np.gradient(way, times), np.searchsorted(times, rng.uniform(1.0, 1.6))
            v[at:] = np.maximum(v[at] - 6.0 * (times[at:] - times[at]), 0)
            rolls.append(seen(rng, times, np.cumsum(v) * 1e-4, 60))
        values.append(measure_deceleration(rolls).acc_roll.value)
    assert np.mean(values) == pytest.approx(ROLL, rel=0.03)


def test_a_kick_is_known_better_of_a_ball_that_was_seen_to_lie():
    sudden, known = (
        measure_deceleration(rolled(np.random.default_rng(7), kicked=True, lies_s=lies_s)).k_switch
        for lies_s in (0.0, 0.5)
    )
    assert known.value == pytest.approx(SWITCH, abs=2 * known.sigma)
    assert known.rolls >= 8 and known.sigma < 0.7 * sudden.sigma


DRIVES = {  # moments, s, and speeds, m/s
    "drives off and stops": ([0, 0.6, 1.7, 2.5], [0, 1, 1, 0]),
    "brakes and creeps": ([0, 0.9, 2.0], [2.5, 0.3, 0.3]),
    "brakes": ([0, 1.5], [2.2, 0.4]),
    "drives off, brakes and rolls": ([0, 0.25, 0.75, 2.0], [0, 2.5, 1.6, 1.2]),
}


def robot(rng, drive="drives off and stops"):
    times = np.arange(0, DRIVES[drive][0][-1], 1e-3)
    return seen(rng, times, np.cumsum(np.interp(times, *DRIVES[drive])) * 1e-3, 60)


def test_robots_among_the_balls_do_not_count():
    rng = np.random.default_rng(2)
    found = measure_deceleration(rolled(rng, count=8) + [robot(rng) for _ in range(3)])
    assert found.acc_roll.value == pytest.approx(ROLL, rel=0.05)
    assert found.acc_slide is None and found.uneven + found.apart >= 3


@pytest.mark.parametrize("drive", DRIVES)
def test_robots_alone_are_no_kicks(drive):
    rng = np.random.default_rng(3)
    found = measure_deceleration([robot(rng, drive) for _ in range(20)])
    assert found.acc_slide is None and found.k_switch is None
    assert found.acc_roll is None or drive == "drives off, brakes and rolls"


def test_a_ball_that_comes_into_the_picture_does_not_tell_when_it_was_kicked():
    rolls = [
        replace(one, begins_inside=False) for one in rolled(np.random.default_rng(2), kicked=True)
    ]
    found = measure_deceleration(rolls)
    assert found.acc_slide is not None and found.k_switch is None


def followed(rng, kicked=False, lies=0):
    """The rolls that a camera's process finds in pictures of five balls, as it sends them; each lies so many frames."""
    ground, watch, rolls = carpet(1, MODEL.image_size), _Watch(), []
    noise = rng.normal(0, 2, ground.shape).astype(np.float32)
    count = 0
    for number in range(5):
        times, way = moved(rng, 3.0 if kicked else 2.0, kicked, until=1.3)
        s = np.interp(np.arange(-lies, times[-1] * 60) / 60 + 0.007, times, way, left=0) * 1000
        x, y = MODEL.region.x_mm[0] + 800, MODEL.region.y_mm[0] + 900 + 900 * number
        places = np.column_stack([x + s, np.full(len(s), y), np.full(len(s), BALL_MM)])
        still = [[]] * 16
        for balls in [*still, *([pixel] for pixel in MODEL.project(places)), *still]:
            taken = SimpleNamespace(moment=count / 60, time=1e9 + count / 60, seq=count)
            rolls += watch.add(taken, frame(ground, balls, np.roll(noise, number, 1), 4.0))
            count += 1
    return rolls


def test_kicks_of_a_ball_that_lay_before_are_found_in_pictures():
    sent = followed(np.random.default_rng(4), kicked=True, lies=30)
    timed = [
        TimedRoll(MODEL.unproject(np.array(roll["points"]), BALL_MM), np.array(roll["times"]))
        for roll in sent
    ]
    found = measure_deceleration(timed)
    assert found.acc_slide.rolls >= 4 and found.acc_slide.value == pytest.approx(SLIDE, rel=0.05)
    assert found.k_switch.value == pytest.approx(SWITCH, abs=2 * found.k_switch.sigma)


def test_a_cameras_rolls_tell_it_and_old_ones_without_times_do_not():
    size = [*MODEL.image_size]
    more = {"camera": "c", "kept_at": "", "left_out": False, "image_size": size}
    stored = [
        {**{name: roll[name] for name in SAVED}, "id": roll["id"], **more}
        for roll in followed(np.random.default_rng(3))
    ]
    assert len(stored) >= 4 and all(
        read_roll(SimpleNamespace(body=json.dumps(one))) for one in stored
    )
    calibration = of_model(MODEL, field=FIELD.to_json())
    found = stored_rolls_json(stored, calibration)["deceleration"]
    assert found["acc_roll"]["value"] == pytest.approx(ROLL, rel=0.1)
    assert (
        "m/s²" in found["sentence"] and found["acc_slide"] is None and "kick" in found["sentence"]
    )
    old = [{name: value for name, value in one.items() if name != "times"} for one in stored]
    assert all(read_roll(SimpleNamespace(body=json.dumps(one))) for one in old)
    told = stored_rolls_json(old, calibration)["deceleration"]
    assert told["acc_roll"] is None and "so far 0" in told["sentence"]
    assert told["skipped"]["untimed"] >= 4 and "without times" in told["sentence"]
    for wrong in (old[0]["points"][0], [0.0] * len(old[0]["points"]), [float("nan")]):
        with pytest.raises(ValueError, match="one time for each point"):
            read_roll(SimpleNamespace(body=json.dumps({**old[0], "times": wrong})))
    assert "active calibration" in stored_rolls_json(stored, None)["deceleration"]["sentence"]
