"""The stages of seeing: robots, numbers and the ball on a simulated field whose truth is known; and their laws."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from tests.support.sim_truth import truth_at
from tests.support.tiers import long
from tests.support.watched_field import Score, colour_clicks, scored, sight_of, world
from touchline.core.errors import TouchlineError
from touchline.core.geometry import ImageSize
from touchline.core.ssl_pattern import DOTS_MM, NUMBER_OF
from touchline.detection.blobs import Blobs, fine_middles, runs_of
from touchline.detection.profile import ColourProfile, ColourSample
from touchline.detection.records import Detection, FieldLocator
from touchline.detection.stages import (
    STAGES,
    FrameState,
    Stage,
    StageConfig,
    StageContext,
    StagePipeline,
)
from touchline.detection.store import load_plans

PLANS = load_plans()


@pytest.fixture(scope="module")
def match():
    """Sixteen robots with drawn numbers at 1080p, light ±40 %, noise of 4 grey levels; learned in the first frame."""
    return world()


@pytest.fixture(scope="module", params=[6, long(36)])
def frames(request):
    """So many over a whole coming and going of the light."""
    return request.param


@pytest.fixture(scope="module")
def watched(match, frames):
    sight, score = sight_of(match), Score.fresh()
    for i in range(frames):
        time_s = i * 60.0 / frames
        scored(score, sight.process(match.frame_at(i, time_s)), truth_at(match, time_s))
    return score


def test_no_robot_is_missed_and_none_is_taken_for_another(watched, frames):
    assert watched.robots == 16 * frames
    assert (watched.missed, watched.wrong, watched.unnamed, watched.invented) == (0, 0, 0, 0)


def test_places_are_within_millimetres_at_the_height_of_the_hats(watched):
    # required: 5 and 15
    assert np.median(watched.off_mm) < 1 and np.quantile(watched.off_mm, 0.99) < 4


def test_fronts_are_within_two_degrees(watched):
    assert np.quantile(watched.turned_deg, 0.99) < 1.5 and max(watched.turned_deg) < 2.5


def test_the_ball_is_found_wherever_it_can_be_seen(watched, frames):
    assert (
        watched.balls > 0.7 * frames
        and watched.balls_missed <= 0.02 * frames
        and watched.balls_invented == 0
    )
    assert np.median(watched.ball_mm) < 1.5 and np.quantile(watched.ball_mm, 0.99) < 8


def test_every_number_of_both_teams_is_told():
    """Thirty-two robots: all numbers from 0 to 15, twice."""
    crowd = world(robots=32, drift=0.0, noise=2.0)
    seen = sight_of(crowd).process(crowd.frame_at(0, 0.0)).detections
    told = {(d.team, d.id) for d in seen.of("robot")}
    true = {(r.team, r.number) for r in truth_at(crowd, 0.0).robots if r.seen > 0.99}
    assert len(true) >= 30 and told >= true


def test_numbers_are_the_leagues():
    """Dots from the front left to the front right, counter-clockwise, green a one: the rules' table in other words."""
    bits = {
        0b0000: 9,
        0b0001: 15,
        0b0010: 4,
        0b0011: 7,
        0b0100: 0,
        0b0101: 3,
        0b0110: 10,
        0b0111: 14,
        0b1000: 13,
        0b1001: 11,
        0b1010: 5,
        0b1011: 6,
        0b1100: 1,
        0b1101: 2,
        0b1110: 12,
        0b1111: 8,
    }
    assert {
        sum(green << 3 - i for i, green in enumerate(dots)): number
        for dots, number in NUMBER_OF.items()
    } == bits
    ahead, left = DOTS_MM[0]
    assert (
        ahead > 0
        and left > 0
        and DOTS_MM[3] == (ahead, -left)
        and DOTS_MM[1][0] < 0 < DOTS_MM[1][1]
    )


def test_small_robots_are_told_by_two_colours():
    crowd = world(
        "vsss-5v5",
        size=(1280, 1024),
        robots=10,
        drift=0.0,
        noise=2.0,
        shuffled=False,
        speed_mm_s=300,
    )
    sight, score = sight_of(crowd, "vsss"), Score.fresh()
    for i in range(4):
        scored(
            score, sight.process(crowd.frame_at(i, 4.0 * i)), truth_at(crowd, 4.0 * i), near_mm=40
        )
    assert score.robots > 30 and score.missed <= 1 and (score.wrong, score.invented) == (0, 0)
    # patches touch each other
    assert np.median(score.off_mm) < 0.5 and np.quantile(score.turned_deg, 0.95) < 1


def test_covariance_is_as_large_as_the_error(match):
    """The median of d² for two degrees of freedom is 1.4; that of a bold or a timid answer is far from it."""
    sight, squares = sight_of(match), []
    for i in range(4):
        truth = {(r.team, r.number): r for r in truth_at(match, i * 1.7).robots}
        for d in sight.process(match.frame_at(i, i * 1.7)).detections.of("robot"):
            off = np.array([d.x_mm - truth[d.team, d.id].x_mm, d.y_mm - truth[d.team, d.id].y_mm])
            squares.append(off @ np.linalg.inv(d.covariance_mm2) @ off)
    assert 0.2 < np.median(squares) < 4


@pytest.mark.parametrize("gain", [long((0.5, 0.5, 0.5)), (0.45, 0.6, 0.9), long((1.3, 0.9, 0.6))])
def test_the_lookup_table_follows_the_light(match, gain):
    """Learned in one light, used in half of it, under warmer and under colder lamps: nothing loses its number."""
    sight = sight_of(match)
    bright = match.frame_at(1, 1.0)
    pixels = np.clip(np.rint(bright * np.array(gain)), 0, 255).astype(np.uint8)
    for _ in range(30):  # slowly: the light is measured now and then, and believed little by little
        seen = sight.process(pixels).detections
    assert (
        len([d for d in seen.of("robot") if d.id is not None]) == 16 and len(seen.of("ball")) == 1
    )


# Laws of every stage


def test_every_stage_keeps_the_contract(match):
    pixels = match.frame_at(0, 0.0)
    setting = sight_of(match).context
    for name in STAGES:
        kind = STAGES[name]
        assert name == kind.NAME and kind.TITLE and kind.HELP.endswith(".")
        for option in kind.OPTIONS:
            assert option.help.endswith(".") and option.read(None) == option.default
        assert isinstance(kind({o.name: o.default for o in kind.OPTIONS}, setting), Stage)
    before = pixels.copy()
    sight = StagePipeline(PLANS["ssl"], setting)
    ticks = iter(range(1000))
    seen = sight.process(pixels, clock=lambda: float(next(ticks)), pictures=tuple(STAGES))
    assert list(seen.pictures) == list(seen.took_ms) == [name for name, _ in PLANS["ssl"].stages]
    assert all(p.shape == pixels.shape and p.dtype == np.uint8 for p in seen.pictures.values())
    assert (pixels == before).all()  # nobody writes into the frame that others see too


@pytest.mark.parametrize("method", ["median", "bilateral", "temporal"])
def test_noise_reduction_leaves_less_noise_and_the_same_picture(method):
    small = world(size=(640, 480), robots=0, drift=0.0, noise=6.0)
    clean = world(size=(640, 480), robots=0, drift=0.0, noise=0.0).frame_at(0, 0.0).astype(float)
    setting = StageContext(
        ImageSize(640, 480),
        ColourProfile("x", {"blue": (ColourSample((200, 90, 20)),)}),
        FieldLocator.flat(ImageSize(640, 480), 10),
    )
    kind = STAGES["noise"]
    stage = kind({o.name: o.default for o in kind.OPTIONS} | {"method": method}, setting)
    for i in range(4):
        pixels = small.frame_at(i, 0.0)
        seeing = stage.run(FrameState.of(pixels))
    assert np.std(seeing.clean - clean) < 0.8 * np.std(pixels - clean)
    assert abs(np.mean(seeing.clean - clean)) < 1


def test_what_moves_leaves_no_ghost_in_noise_reduction_over_time():
    kind, size = STAGES["noise"], ImageSize(64, 48)
    setting = StageContext(
        size,
        ColourProfile("x", {"blue": (ColourSample((200, 90, 20)),)}),
        FieldLocator.flat(size, 10),
    )
    stage = kind({o.name: o.default for o in kind.OPTIONS} | {"method": "temporal"}, setting)
    first, second = np.full((48, 64, 3), 40, np.uint8), np.full((48, 64, 3), 40, np.uint8)
    first[10:20, 10:20] = 200
    second[10:20, 40:50] = 200
    stage.run(FrameState.of(first))
    seen = stage.run(FrameState.of(second)).clean
    assert (seen == second).all()


def test_patches_are_what_a_plain_search_finds():
    """Beside cv2, colour by colour, on noise that makes every form of patch."""
    labels = (np.random.default_rng(0).integers(0, 9, (60, 80)) % 4).astype(np.uint8)
    blobs = Blobs.of(runs_of(labels))
    found = []
    for colour in (1, 2, 3):
        _, _, stats, middles = cv2.connectedComponentsWithStats(
            (labels == colour).astype(np.uint8), connectivity=8
        )
        found += [
            (colour, *map(int, s[:4]), int(s[4]), *np.round(m, 6))
            for s, m in zip(stats[1:], middles[1:], strict=True)
        ]
    ours = [
        (int(c), x0, y0, x1 - x0 + 1, y1 - y0 + 1, int(a), *np.round(m, 6))
        for c, (x0, y0, x1, y1), a, m in zip(
            blobs.colour, blobs.box.tolist(), blobs.area, blobs.middle, strict=True
        )
    ]
    assert sorted(ours) == sorted(found)
    assert len(Blobs.of(runs_of(np.zeros((5, 5), np.uint8)))) == 0


def test_a_middle_is_found_to_a_twentieth_of_a_pixel():
    """Discs of 3.2 px drawn with the exact share of each pixel, at places between pixels."""
    rng, off = np.random.default_rng(3), []
    y, x = np.mgrid[0 : 31 * 8, 0 : 31 * 8] / 8 - 7 / 16
    for _ in range(20):
        middle = 15 + rng.uniform(-0.5, 0.5, 2)
        disc = (
            (np.hypot(x - middle[0], y - middle[1]) < 3.2).reshape(31, 8, 31, 8).mean(axis=(1, 3))
        )
        pixels = (
            (disc[..., None] * (20, 110, 240) + (1 - disc[..., None]) * (60, 100, 50))
            .round()
            .astype(np.uint8)
        )
        blobs = Blobs.of(runs_of((disc > 0.6).astype(np.uint8)))
        off.append(np.linalg.norm(fine_middles(pixels, blobs)[0] - middle))
    assert np.sqrt(np.mean(np.square(off))) < 0.05


def test_a_colour_that_is_all_over_the_picture_is_left_out_and_said(match):
    pixels, setting = match.frame_at(0, 0.0), sight_of(match).context
    carpet = {
        "yellow": setting.profile.colours["yellow"],
        "blue": (ColourSample((44.0, 90.0, 60.0), 0.05),),
    }
    sight = StagePipeline(PLANS["ssl"], replace(setting, profile=ColourProfile("bad", carpet)))
    seen = sight.process(pixels)
    assert any("blue covers" in note for note in seen.notes)
    assert not [d for d in seen.detections.of("robot") if d.team == "blue"]
    kind, size = STAGES["blobs"], setting.image_size
    scattered = (np.random.default_rng(0).random((size.height, size.width)) < 0.3).astype(np.uint8)
    stage = kind({o.name: o.default for o in kind.OPTIONS}, setting)
    flooded = replace(FrameState.of(pixels), labels=scattered, colours=("blue",))
    assert (
        len(stage.run(flooded).blobs)
        == 0
        < len(
            stage.run(
                replace(flooded, labels=scattered * (np.arange(size.width) < 200).astype(np.uint8))
            ).blobs
        )
    )


def test_a_model_without_rays_says_that_a_place_is_on_the_carpet(match):
    """Unless the camera's place is told: then the height is allowed for."""

    class Carpet:
        image_size = match.camera.image_size

        def corrected_from_raw(self, points):
            return points

        def field_from_corrected(self, points):
            return match.camera.field_from_raw(points)

    setting, pixels, truth = sight_of(match).context, match.frame_at(0, 0.0), truth_at(match, 0.0)
    true = {(r.team, r.number): np.array([r.x_mm, r.y_mm]) for r in truth.robots}

    def off(view):
        found = (
            StagePipeline(PLANS["ssl"], replace(setting, view=view))
            .process(pixels)
            .detections.of("robot")
        )
        return found, [np.hypot(*(np.array([d.x_mm, d.y_mm]) - true[d.team, d.id])) for d in found]

    blind, off_mm = off(FieldLocator.of(Carpet()))
    assert len(blind) == 16 and all(d.on_carpet for d in blind) and max(off_mm) > 40
    told, off_mm = off(FieldLocator.of(Carpet(), match.camera.position_mm))
    assert len(told) == 16 and not any(d.on_carpet for d in told) and max(off_mm) < 3


def test_without_a_calibration_there_are_pixels_and_no_places(match):
    setting = sight_of(match).context
    sight = StagePipeline(
        PLANS["ssl"], replace(setting, view=FieldLocator.flat(setting.image_size, 6.4))
    )
    found = sight.process(match.frame_at(0, 0.0)).detections.of("robot")
    assert len(found) == 16 and all(d.x_mm is None and d.covariance_mm2 is None for d in found)


def test_another_size_of_picture_is_refused(match):
    with pytest.raises(TouchlineError, match="set up for 1920 × 1080"):
        sight_of(match).process(np.zeros((480, 640, 3), np.uint8))


# Plans and records


@pytest.mark.parametrize("name", PLANS)
def test_plans_that_come_with_us_are_read_and_survive_json(name):
    plan = PLANS[name]
    assert StageConfig.from_json(plan.to_json()) == plan and plan.stages[-1][0] == "places"


@pytest.mark.parametrize(
    "stages",
    [
        [],
        None,
        [{"stage": "blobs"}],
        [{"stage": "colours"}, {"stage": "colours"}],
        ["colours"],
        [{"follow": True}],
        [{"stage": "colours", "follow": 3}],
        [{"stage": "colours", "nothing": 3}],
        [{"stage": "dreams"}],
        [{"stage": "colours", "everywhere": ["mauve"]}],
        [{"stage": "noise", "strength": float("nan")}],
        [{"stage": "noise", "strength": float("inf")}],
        [{"stage": ["noise"]}],
    ],
)
def test_plans_that_make_no_sense_are_refused(stages):
    with pytest.raises(TouchlineError):
        StageConfig.from_json({"name": "x", "title": "X", "stages": stages})


def test_detections_survive_json(match):
    seen = (
        sight_of(match)
        .process(match.frame_at(0, 0.0), camera="north", frame=7, time_s=1.5e9)
        .detections
    )
    told = seen.to_json()
    assert told["camera"] == "north" and told["frame"] == 7
    for a, b in zip(map(Detection.from_json, told["detections"]), seen.items, strict=True):
        assert a == replace(
            b, orientation_rad=a.orientation_rad, orientation_sigma_rad=a.orientation_sigma_rad
        )
        assert b.orientation_rad is None or a.orientation_rad == pytest.approx(
            b.orientation_rad, abs=1e-12
        )


@pytest.mark.parametrize(
    "change",
    [
        {"kind": "person"},
        {"id": -1},
        {"id": 1.5},
        {"x_mm": float("nan")},
        {"pixel": [1]},
        {"pixel": [1, float("inf")]},
        {"covariance_mm2": [[1, 0]]},
        {"team": 3},
        {"on_carpet": 1},
        {"more": 1},
        {"confidence": None},
    ],
)
def test_detections_that_make_no_sense_are_refused(change):
    good = Detection(
        "robot", (1.0, 2.0), "blue", 3, 1.0, 2.0, 150.0, 0.5, 0.9, ((1.0, 0.0), (0.0, 1.0))
    ).to_json()
    assert Detection.from_json(good).id == 3
    with pytest.raises(TouchlineError):
        Detection.from_json({**good, **change})


def test_clicks_are_at_most_five_a_colour(match):
    assert all(1 <= len(places) <= 5 for places in colour_clicks(match).values())
