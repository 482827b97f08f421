"""From a picture to what plays on it, by a calibration that was fitted to clicks."""

import time

import numpy as np
import pytest

from tests.support.sim_truth import truth_at
from tests.support.watched_field import calibration_of, colour_clicks, world
from touchline.core.errors import Cancelled, TouchlineError
from touchline.detection.detect import context_for, detect, detections_image
from touchline.detection.profile import ColourProfile
from touchline.detection.stages import StageConfig
from touchline.detection.store import load_plan, load_plans

PLAN = load_plans()["ssl"]


@pytest.fixture(scope="module")
def match():
    return world(drift=0.0, noise=3.0)


@pytest.fixture(scope="module")
def pixels(match):
    return match.frame_at(0, 0.0)


@pytest.fixture(scope="module")
def calibration(match):
    """Brown–Conrady on clicks that are half a pixel off."""
    return calibration_of(match)


def off_mm(found, match):
    truth = {(r.team, r.number): r for r in truth_at(match, 0.0).robots}
    return [
        np.hypot(d.x_mm - truth[d.team, d.id].x_mm, d.y_mm - truth[d.team, d.id].y_mm)
        for d in found.seen.detections.of("robot")
    ]


def test_robots_are_where_the_calibration_says_at_the_height_of_their_hats(
    match, pixels, calibration
):
    found = detect(pixels, PLAN, calibration=calibration, clicks=colour_clicks(match))
    off = off_mm(found, match)
    assert len(off) == 16 and np.median(off) < 5 and max(off) < 15
    assert {d.z_mm for d in found.seen.detections.of("robot")} == {150.0}
    # The calibration's own error is part of each place's.
    sigma = calibration.report["sigma_mm"]["median"] / np.sqrt(2)
    assert all(np.sqrt(d.covariance_mm2[0][0]) >= sigma for d in found.seen.detections.items)


def test_a_plan_may_ask_for_the_picture_to_be_corrected_first_and_says_the_same_places_and_raw_pixels(
    match, pixels, calibration
):
    plan = StageConfig.from_json({**PLAN.to_json(), "corrected": True})
    assert StageConfig.from_json(plan.to_json()) == plan and "corrected" not in PLAN.to_json()
    raw, found = (
        detect(
            pixels,
            one,
            calibration=calibration,
            clicks=colour_clicks(match),
            pictures=("colours",),
            clock=time.perf_counter,
        )
        for one in (PLAN, plan)
    )
    off = off_mm(found, match)
    assert len(off) == 16 and np.median(off) < 5 and max(off) < 15
    there = {(d.kind, d.team, d.id): d.pixel for d in raw.seen.detections.items}
    same = [
        np.hypot(*np.subtract(d.pixel, there[d.kind, d.team, d.id]))
        for d in found.seen.detections.items
        if (d.kind, d.team, d.id) in there
    ]
    assert len(same) >= 17 and max(same) < 1.0
    assert (
        found.seen.detections.image_size == raw.seen.detections.image_size
        and "correct" in found.seen.took_ms
    )
    assert found.seen.pictures["colours"].shape != raw.seen.pictures["colours"].shape
    with pytest.raises(TouchlineError) as refused:
        detect(pixels, plan, mm_per_px=5.0, clicks=colour_clicks(match))
    assert refused.value.reason == "no-calibration"


def test_without_a_click_the_colours_are_found_in_the_picture(match, pixels, calibration):
    found = detect(pixels, PLAN, calibration=calibration)
    assert len(off_mm(found, match)) >= 15 and found.profile.name == "detected in the image"


def test_nothing_is_looked_for_beside_the_field(match, calibration):
    """Somebody in a blue shirt on the floor is no robot's dot; the camera sees more than the field."""
    within = context_for(
        match.camera.image_size,
        detect(match.frame_at(0, 0.0), PLAN, calibration=calibration).profile,
        calibration,
    ).within
    corners = match.camera.raw_from_field(
        np.array([(x, y) for x in (-4400, 4400) for y in (-2900, 2900)])
    ).round()
    assert all(within[int(y), int(x)] for x, y in corners) and 0.5 < (within > 0).mean() < 1


def test_a_picture_of_another_size_and_one_without_a_scale_are_refused(match, pixels, calibration):
    with pytest.raises(TouchlineError, match="the calibration is for"):
        detect(pixels[:1000], PLAN, calibration=calibration)
    with pytest.raises(TouchlineError, match="too large"):
        detect(np.broadcast_to(pixels[:1, :1], (4000, 4001, 3)), PLAN, mm_per_px=1.0)
    with pytest.raises(TouchlineError, match="scale of this image is unknown"):
        detect(pixels, PLAN)
    for clicks in (
        {"mauve": [[1, 2]]},
        {"blue": [[1, 2, 3]]},
        {"blue": [[1, float("nan")]]},
        {"blue": [[-5, 2]]},
        {"blue": [[1, 2]] * 41},
    ):
        with pytest.raises(TouchlineError):
            detect(pixels, PLAN, calibration=calibration, clicks=clicks)
    with pytest.raises(TouchlineError, match="above the carpet"):
        detect(pixels, PLAN, calibration=calibration, eye_mm=(0.0, 0.0, 0.0))


@pytest.mark.parametrize("looks", [1, 2])
def test_it_ends_between_its_steps_once_nobody_waits_any_more(pixels, calibration, looks):
    told = []

    def progress(share, _message):
        told.append(share)
        if len(told) == looks:
            raise Cancelled("Nobody waits for it any more.", "Ask again.")

    with pytest.raises(Cancelled):
        detect(pixels, PLAN, calibration=calibration, progress=progress)
    assert len(told) == looks and told == sorted(told)


def test_noise_without_end_is_answered_in_time():
    """Every pixel another colour: thousands of patches, none of them a robot."""
    wild = np.random.default_rng(0).integers(0, 256, (480, 640, 3), np.uint8)
    for name, plan in load_plans().items():
        found = detect(wild, plan, mm_per_px=6.0, clock=time.perf_counter)
        assert sum(found.seen.took_ms.values()) < 20_000, name


def test_a_plan_of_ones_own_is_read_from_a_file(tmp_path, pixels, calibration):
    (tmp_path / "mine.yaml").write_text(
        "name: mine\ntitle: Ball only\nstages:\n"
        "  - {stage: colours, everywhere: [orange]}\n  - {stage: blobs}\n"
        "  - {stage: ball}\n  - {stage: places}\n"
    )
    found = detect(pixels, load_plan(tmp_path / "mine.yaml"), calibration=calibration).to_json()
    assert {d["kind"] for d in found["detections"]} == {"ball"} and found["stages"] == "mine"
    (tmp_path / "bad.yaml").write_text("name: x\ntitle: X\nstages: [{stage: dreams}]\n")
    with pytest.raises(TouchlineError):
        load_plan(tmp_path / "bad.yaml")


def test_what_is_drawn_is_drawn_where_it_was_found(match, pixels, calibration):
    found = detect(pixels, PLAN, calibration=calibration)
    view = context_for(match.camera.image_size, found.profile, calibration).view
    changed = (detections_image(pixels, found.seen.detections, view) != pixels).any(axis=-1)
    near = np.zeros_like(changed)
    for item in found.seen.detections.items:
        x, y = map(round, item.pixel)
        near[max(y - 45, 0) : y + 45, max(x - 45, 0) : x + 60] = True
    assert changed.any() and not (changed & ~near).any()


LOW_MM = 90.0  # as ibis' robots, on a field whose robots have 150


@pytest.fixture(scope="module")
def low():
    """A match in which the blue robots are lower than the field says: (its truth, a frame)."""
    match = world(drift=0.0, noise=3.0, blue_mm=LOW_MM)
    return match, match.frame_at(0, 0.0)


@pytest.mark.parametrize("corrected", [False, True])
def test_a_teams_robots_are_where_they_are_at_the_height_of_that_team(low, calibration, corrected):
    match, pixels = low
    plan = StageConfig.from_json({**PLAN.to_json(), "corrected": corrected})
    truth = {(r.team, r.number): r for r in truth_at(match, 0.0).robots}
    edge_mm = np.quantile([np.hypot(r.x_mm, r.y_mm) for r in truth.values()], 0.5)

    def off_at_the_edge(**tops_mm):
        found = detect(
            pixels, plan, calibration=calibration, clicks=colour_clicks(match), team_z_mm=tops_mm
        )
        robots = found.seen.detections.of("robot")
        assert len(robots) == 16
        assert {d.z_mm for d in robots if d.team == "blue"} == {tops_mm.get("blue", 150.0)}
        assert {d.z_mm for d in robots if d.team == "yellow"} == {150.0}
        off = {
            key: np.hypot(d.x_mm - truth[key].x_mm, d.y_mm - truth[key].y_mm)
            for d in robots
            if np.hypot(truth[key := (d.team, d.id)].x_mm, truth[key].y_mm) > edge_mm
        }
        return [
            max(mm for (team, _), mm in off.items() if team == one) for one in ("blue", "yellow")
        ]

    blue_mm, yellow_mm = off_at_the_edge()
    assert blue_mm > 25 and yellow_mm < 15
    blue_mm, same_mm = off_at_the_edge(blue=LOW_MM)
    assert blue_mm < 15 and same_mm == yellow_mm


def test_small_robots_have_the_fields_height_whoever_plays_elsewhere():
    small = world("vsss-5v5", robots=2)
    context = context_for(
        small.camera.image_size,
        ColourProfile("here", {}),
        calibration_of(small),
        team_z_mm={"blue": 143.0},
    )
    assert list(context.robot_tops_mm(["blue", "yellow"])) == [75.0, 75.0]
