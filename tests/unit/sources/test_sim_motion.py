"""Robots, the ball and people move as they would, and the truth knows what the camera sees of them."""

import cv2
import numpy as np
import pytest

from tests.support.sim_truth import robots_in, truth_at
from tests.support.tiers import long
from touchline.core.geometry import ImageSize
from touchline.sources.sim.actors import Motion, ball_at, moving, people_at, robots_at
from touchline.sources.sim.camera import LENSES, SimCamera
from touchline.sources.sim.render import Rendering, Sensor
from touchline.sources.sim.solids import Box, Capsule, CutDisc, Disc
from touchline.store.fields import load_fields

FIELD = load_fields()["ssl-div-b"]
REGION = FIELD.regions["full"]
SMALL = ImageSize(640, 480)
seeds = pytest.mark.parametrize("seed", [1, *(long(seed) for seed in (2, 3))])


def rendering(play: Motion, size=SMALL, region=REGION, noise=0.0, **pose) -> Rendering:
    camera = SimCamera.above(region, size, LENSES["strong"], **{"height_mm": 6500, **pose})
    return Rendering.of(camera, FIELD, region, play, sensor=Sensor(noise=noise))


@seeds
def test_robots_are_as_fast_as_asked_and_say_their_own_speed(seed):
    play, step_s = Motion(robots=10, seed=seed, speed_mm_s=900), 0.001
    speeds = []
    for t in np.arange(0, 40, 0.5):
        now, then = robots_at(play, FIELD, REGION, t), robots_at(play, FIELD, REGION, t + step_s)
        for a, b in zip(now, then, strict=True):
            moved = np.array([b.x_mm - a.x_mm, b.y_mm - a.y_mm]) / step_s
            np.testing.assert_allclose(moved, [a.vx_mm_s, a.vy_mm_s], atol=5)
            assert np.cos(a.angle - np.arctan2(moved[1], moved[0])) > 0.999  # they drive ahead
            speeds.append(np.hypot(*moved))
    assert 600 < np.median(speeds) < 1300 and max(speeds) < 3000


@seeds
def test_a_robot_that_is_asked_to_stand_stands(seed):
    play = Motion(robots=4, seed=seed, speed_mm_s=0)
    assert robots_at(play, FIELD, REGION, 0.0) == robots_at(play, FIELD, REGION, 50.0)


@pytest.mark.parametrize(("seed", "seconds"), [(2, 80), *(long(seed, 400) for seed in (1, 2, 3))])
def test_the_ball_rolls_straight_between_kicks_and_bounces_and_stays_inside(seed, seconds):
    play, step_s = Motion(seed=seed, speed_mm_s=1000), 0.02
    path = np.array([ball_at(play, FIELD, REGION, t) for t in np.arange(0, seconds, step_s)])
    assert (np.abs(path) <= (FIELD.length_mm / 2, FIELD.width_mm / 2)).all()
    way = np.diff(path, axis=0)
    speed = np.linalg.norm(way, axis=1) / step_s
    assert speed.max() < 3001 and np.median(speed) > 300
    # mm/s: how much the velocity changed
    turned = np.linalg.norm(np.diff(way, axis=0), axis=1) / step_s
    straight = turned < 20  # rolling costs 0.25 of 3000 mm/s a second: 15 in a step
    assert 0.93 < straight.mean() < 0.999
    along, across = way[:-1][straight], way[1:][straight]
    turn = along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0]
    lengths = np.linalg.norm(along, axis=1) * np.linalg.norm(across, axis=1)
    # A kick or a grazing bounce that changes little is among them.
    assert np.quantile(np.abs(turn[lengths > 1] / lengths[lengths > 1]), 0.99) < 1e-6
    bounced = (
        ~straight & (np.abs(way[1:, 0] + way[:-1, 0]) < 2) & (np.abs(way[1:, 1] - way[:-1, 1]) < 2)
    )
    assert bounced.sum() >= 1  # off a goal line: x turns round, y goes on


@seeds
def test_people_start_at_an_edge_and_walk_across_the_lines_without_a_jump(seed):
    play, step_s = Motion(people=3, seed=seed, walk_mm_s=1400), 0.05
    paths = np.array(
        [[(p.x_mm, p.y_mm) for p in people_at(play, REGION, t)] for t in np.arange(0, 120, step_s)]
    )
    speed = np.linalg.norm(np.diff(paths, axis=0), axis=-1) / step_s
    assert speed.max() < 1.21 * 1400 and np.median(speed) > 0.7 * 1400
    outside = np.maximum(np.abs(paths[0]) - (FIELD.length_mm / 2, FIELD.width_mm / 2), 0)
    assert (
        np.abs(np.abs(paths[0]) - (FIELD.length_mm / 2, FIELD.width_mm / 2)).min(axis=1) < 500
    ).all()
    assert outside.max() < 200
    sides = np.sign(paths[..., 1])
    # everybody crosses the middle within two minutes
    assert (sides.min(axis=0) < sides.max(axis=0)).all()


def test_people_who_are_asked_to_stand_stand():
    play = Motion(people=3, walk_mm_s=0)
    assert people_at(play, REGION, 0.0) == people_at(play, REGION, 9.0)


OUTLINES = {
    "disc": Disc((10.0, 20.0), 90.0),
    "capsule": Capsule((0.0, -190.0), (0.0, 190.0), 120.0),
    "shoe": Capsule((-40.0, -90.0), (70.0, 30.0), 48.0),
    "robot": CutDisc((5.0, -8.0), 90.0, 0.7, 72.0),
    "wall": Box((3.0, 4.0), (50.0, 80.0), 0.4),
}


@pytest.mark.parametrize("outline", OUTLINES.values(), ids=OUTLINES)
def test_a_swept_outline_is_the_nearest_of_all_its_places(outline):
    rng = np.random.default_rng(4)
    x, y = rng.uniform(-250, 250, (2, 4000)).astype(np.float32)
    dx, dy = rng.uniform(-150, 150, (2, 4000)).astype(np.float32)
    dx[:400] = 0
    every = np.min(
        [
            outline.distance(x + t * dx, y + t * dy)
            for t in np.linspace(0, 1, 1001, dtype=np.float32)
        ],
        axis=0,
    )
    off = outline.swept(x, y, dx, dy) - every
    assert np.abs(off[np.abs(every) < 20]).max() < 0.5  # mm; a pixel is 5 mm and more
    assert outline.swept(x, y, dx, dy).dtype == np.float32  # 64 bits take twice as long


def test_what_is_farther_from_the_camera_is_drawn_first():
    things = moving(Motion(robots=12, people=3), FIELD, REGION, 3.0, (0.0, 0.0, 6500.0))
    owners = list(dict.fromkeys(thing.owner for thing in things))
    centre = {thing.owner: thing.centre for thing in reversed(things)}
    away = [np.hypot(*centre[owner]) for owner in owners[1:]]
    # a person's first part is beside the middle
    assert owners[0] == "ball" and (np.diff(away) < 250).all()


@seeds
def test_hidden_is_what_looks_other_than_the_empty_field(seed):
    play = Motion(robots=8, people=2, seed=seed)
    shown, empty = rendering(play), rendering(Motion(robots=0, seed=seed))
    truth = truth_at(shown, 20 / 25)
    goals = truth_at(empty, 0.0).hidden
    looks_other = np.abs(shown.frame(20).astype(int) - empty.frame(20)).max(axis=2) > 25
    moved = truth.hidden & ~goals
    # jeans look like floor here and there
    assert moved.sum() > 500 and (looks_other & moved).sum() / moved.sum() > 0.8
    near = cv2.dilate(truth.hidden.astype(np.uint8), np.ones((5, 5))) > 0
    assert (looks_other & ~near).sum() < 0.05 * moved.sum()  # shadows


def test_the_carpet_is_seen_where_nothing_stands_before_it():
    shown = rendering(Motion(robots=8, people=2, seed=2))
    truth = truth_at(shown, 0.0)
    robots = np.array([(r.x_mm, r.y_mm) for r in truth.robots])
    assert not truth.carpet_seen(robots).any()
    assert truth.carpet_seen(np.array([[99_000.0, 0.0]])).tolist() == [False]
    spots = np.stack(
        np.meshgrid(np.linspace(-4000, 4000, 40), np.linspace(-2800, 2800, 30)), axis=-1
    )
    seen = truth.carpet_seen(spots)
    assert seen.shape == (30, 40) and 0.85 < seen.mean() < 1
    assert truth_at(rendering(Motion(robots=0)), 0.0).carpet_seen(spots).all()


def test_each_hat_is_where_the_truth_has_it():
    shown = rendering(Motion(robots=8, seed=3), ImageSize(1280, 960))
    truth = truth_at(shown, 10 / 25)
    for robot in truth.robots:
        ys, xs = np.nonzero(truth.owned_by(robot.name))
        hat = shown.camera.raw_from_field(np.array([robot.x_mm, robot.y_mm, robot.z_mm]))
        # The side is seen too, and the flat front is not: 7 px of 27.
        assert np.hypot(xs.mean() - hat[0], ys.mean() - hat[1]) < 7 and robot.seen > 0.95
    assert not truth.owned_by("nobody").any()


def test_a_ball_under_a_robot_is_not_seen_and_one_on_the_carpet_is():
    shown = rendering(Motion(robots=24, seed=5), ImageSize(1280, 960))
    seen, near = [], []
    for index in range(0, 3000, 5):
        time_s = index / 25
        ball = np.array(ball_at(shown.motion, FIELD, REGION, time_s))
        away = min(np.hypot(r.x_mm - ball[0], r.y_mm - ball[1]) for r in robots_in(shown, index))
        if away < 45 or (away > 400 and index % 200 == 0):
            near.append(away < 45)
            seen.append(truth_at(shown, index / 25).ball.seen)
    seen, near = np.array(seen), np.array(near)
    assert near.sum() >= 1 and (~near).sum() >= 3
    assert (seen[near] == 0).all() and (seen[~near] > 0.9).all()


def test_a_robot_at_the_pictures_edge_is_seen_in_part():
    shown = rendering(Motion(robots=12, seed=1), ImageSize(640, 480), fill=1.6)
    shares = [r.seen for i in range(0, 2000, 100) for r in truth_at(shown, i / 25).robots]
    assert min(shares) == 0 and max(shares) == 1 and any(0.2 < s < 0.8 for s in shares)


@seeds
def test_what_does_not_move_is_the_same_in_every_frame(seed):
    """Wiping a thing away leaves exactly what was there."""
    play = Motion(robots=8, people=1, seed=seed)
    shown, empty = rendering(play), rendering(Motion(robots=0, seed=seed)).frame(0)
    for index in (0, 30, 7, 500):
        frame = shown.frame(index)
    untouched = (frame == empty).all(axis=2)
    assert 0.75 < untouched.mean() < 1
    assert (shown.frame(7) == rendering(play).frame(7)).all()
