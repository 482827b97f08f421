"""A rendered picture shows what the truth says, to a few hundredths of a pixel, and the same each time."""

import time
from functools import lru_cache

import numpy as np
import pytest

from tests.support.line_centres import centroids, clear_of_others
from tests.support.sim_truth import robots_in
from tests.support.tiers import long
from touchline.core.geometry import ImageSize, normal_cdf
from touchline.sources.sim.actors import Motion, ball_at
from touchline.sources.sim.camera import LENSES, SimCamera
from touchline.sources.sim.ground import Ground, Light, arc_coverage, line_coverage
from touchline.sources.sim.render import Rendering, Sensor
from touchline.store.fields import load_fields

FIELD = load_fields()["ssl-div-b"]
SIZE = ImageSize(1280, 1024)
PLAIN = Light(vignette=0, unevenness=0, glare=0, grain=0)
EMPTY = Motion(robots=0)
QUIET = Sensor(blur_px=0.65, noise=0)


def above(
    lens: str = "strong",
    region: str = "full",
    size: ImageSize = SIZE,
    height_mm: float = 6500,
    **pose,
) -> SimCamera:
    return SimCamera.above(FIELD.regions[region], size, LENSES[lens], height_mm=height_mm, **pose)


@lru_cache(maxsize=1)
def rendering(
    lens: str = "strong",
    region: str = "full",
    play: Motion = EMPTY,
    light: Light = PLAIN,
    sensor: Sensor = QUIET,
    size: ImageSize = SIZE,
    **pose,
) -> Rendering:
    return Rendering.of(
        above(lens, region, size, **pose), FIELD, FIELD.regions[region], play, light, sensor
    )


@lru_cache
def clear(marking) -> np.ndarray:
    return clear_of_others(FIELD, marking, 200)


@pytest.mark.parametrize(
    ("lens", "pose"),
    [
        ("strong", {}),
        ("none", {"tilt_deg": 12, "roll_deg": 4}),
        ("pincushion", {"tilt_deg": 7}),
        ("crooked", {"roll_deg": 30}),
        ("fisheye", {"tilt_deg": 20, "pan_deg": 9}),
    ],
)
def test_the_centre_of_every_rendered_line_is_where_the_truth_says(lens, pose):
    shown = rendering(lens, **pose)
    picture = shown.frame(0)[..., 2]
    worst, count = 0.0, 0
    for marking in (*FIELD.lines.values(), *FIELD.arcs.values()):
        off = centroids(picture, shown.camera, marking, 200)[clear(marking)]
        worst, count = max(worst, np.abs(off).max()), count + len(off)
        assert abs(np.median(off)) < 0.01, f"{marking.name} is off by {np.median(off):.3f} px"
    assert count > 1500
    assert worst < 0.05  # px; a grey level of rounding across 12 px is worth 0.03


def test_carpet_noise_and_light_blur_the_lines_but_do_not_move_them():
    shown = rendering(light=Light(), sensor=Sensor())
    picture = shown.frame(0)[..., 2]
    for marking in FIELD.lines.values():
        off = centroids(picture, shown.camera, marking, 200)[clear(marking)]
        # The carpet's grain alone moves the worst line by 0.046 px.
        assert abs(np.mean(off)) < 0.07 and np.std(off) < 0.4, marking.name


def test_a_line_is_as_bright_as_it_is_wide():
    """The coverage across a line sums up to its width in pixels, however thin it is."""
    camera = above("none", height_mm=6500)
    ground = Ground.of(camera)
    line = FIELD.lines["halfway-line"]
    total = np.zeros(SIZE.width * SIZE.height)
    pick, cover = line_coverage(ground, line, 0.65)
    total[pick] = cover
    rows = total.reshape(SIZE.height, SIZE.width)[200:800].sum(axis=1)
    mm_per_px = 6500 / camera.focal_px[0]
    np.testing.assert_allclose(rows, line.width_mm / mm_per_px, rtol=1e-4)


def test_lines_end_where_they_end_and_arcs_too():
    camera = above("none")
    ground = Ground.of(camera)
    mm_per_px = 6500 / camera.focal_px[0]
    line = FIELD.lines["defence-left-front"]
    assert line_coverage(ground, line, 0.65)[1].sum() == pytest.approx(
        (line.length_mm + line.width_mm) * line.width_mm / mm_per_px**2, rel=1e-4
    )
    arc = load_fields()["ssl-2008"].arcs["defence-right-arc-bottom"]
    assert arc_coverage(ground, arc, 0.65)[1].sum() == pytest.approx(
        arc.length_mm * 10 / mm_per_px**2, rel=2e-3
    )


def test_the_normal_distribution_is_good_to_a_ten_millionth():
    from math import erf, sqrt

    z = np.linspace(-6, 6, 1201)
    np.testing.assert_allclose(
        normal_cdf(z), [0.5 * (1 + erf(v / sqrt(2))) for v in z], rtol=0, atol=2e-7
    )


def test_the_same_arguments_give_the_same_picture_and_another_seed_another():
    def first(seed: int) -> np.ndarray:
        camera = above(size=ImageSize(320, 256))
        return Rendering.of(camera, FIELD, FIELD.regions["full"], Motion(6, 1, seed)).frame(3)

    assert (first(1) == first(1)).all()
    assert (first(1) != first(2)).mean() > 0.5


def test_any_frame_can_be_asked_for_in_any_order():
    shown = rendering(play=Motion(6), sensor=Sensor(), size=ImageSize(320, 256))
    later, sooner = shown.frame(40), shown.frame(0)
    assert (
        (shown.frame(40) == later).all()
        and (shown.frame(0) == sooner).all()
        and (later != sooner).any()
    )


def test_noise_is_as_strong_as_asked_and_new_in_every_frame():
    shown = rendering(sensor=Sensor(noise=4.0))
    first, second = (shown.frame(i).astype(float)[300:400, 300:500] for i in (0, 1))
    assert (first - second).std() == pytest.approx(4 * np.sqrt(2), rel=0.05)
    assert (
        abs(np.corrcoef((first - second)[:, :-1].ravel(), (first - second)[:, 1:].ravel())[0, 1])
        < 0.05
    )


@pytest.mark.parametrize("pose", [long({}), {"tilt_deg": 20}])
def test_a_robots_pattern_is_seen_at_the_height_of_its_hat(pose):
    """Robots are 150 mm high: their middle dot is seen farther out than they stand."""
    shown = rendering(
        region="quarter-top-left", play=Motion(robots=8, seed=5), height_mm=4000, **pose
    )
    picture, parallax = shown.frame(0).astype(float), []
    for robot in robots_in(shown, 0):
        hat, foot = shown.camera.raw_from_field(
            [[robot.x_mm, robot.y_mm, 150], [robot.x_mm, robot.y_mm, 0]]
        )
        parallax.append(np.linalg.norm(hat - foot))
        (x, y), reach = np.rint(hat).astype(int), 6
        patch = picture[y - reach : y + reach + 1, x - reach : x + reach + 1]
        channel = patch[..., 2] if robot.team == "yellow" else patch[..., 0]
        weight = np.maximum(channel - 60, 0)
        ys, xs = np.mgrid[-reach : reach + 1, -reach : reach + 1]
        away = np.hypot(xs + x - hat[0], ys + y - hat[1])
        weight = weight * (away < reach)
        seen = (
            hat - (x, y) - ((weight * xs).sum() / weight.sum(), (weight * ys).sum() / weight.sum())
        )
        assert np.linalg.norm(seen) < 0.25, f"{robot.team} {robot.number} is off by {seen}"
    assert max(parallax) > 10


def test_a_ball_is_seen_at_its_own_height():
    shown = rendering(
        region="quarter-top-left", play=Motion(robots=1, seed=2), height_mm=4000, tilt_deg=25
    )
    picture = shown.frame(0).astype(float)
    x, y = ball_at(shown.motion, FIELD, shown.region, 0.0)
    near = np.rint(shown.camera.raw_from_field([x, y, 21.5])).astype(int)
    ys, xs = np.mgrid[near[1] - 12 : near[1] + 13, near[0] - 12 : near[0] + 13]
    weight = np.maximum(picture[ys, xs, 2] - picture[ys, xs, 1] - 40, 0)
    seen = np.array([(weight * xs).sum(), (weight * ys).sum()]) / weight.sum()
    # the shine is off the middle
    assert np.linalg.norm(seen - shown.camera.raw_from_field([x, y, 21.5])) < 0.5
    assert np.linalg.norm(seen - shown.camera.raw_from_field([x, y, 0])) > 1.5


def test_robots_move_smoothly_and_stay_apart_and_inside():
    shown = rendering(play=Motion(robots=12, seed=2), size=ImageSize(64, 48))
    paths = np.array([[(r.x_mm, r.y_mm) for r in robots_in(shown, i)] for i in range(200)])
    step = np.linalg.norm(np.diff(paths, axis=0), axis=-1)
    assert 1 < np.median(step) < 60 and step.max() < 100  # mm in 40 ms
    gaps = np.linalg.norm(paths[:, :, None] - paths[:, None], axis=-1) + 1e9 * np.eye(12)
    assert gaps.min() > 180
    assert (np.abs(paths) < (FIELD.length_mm / 2, FIELD.width_mm / 2)).all()


def test_people_hide_parts_of_lines():
    alone, crowded = (
        rendering(play=Motion(robots=0, people=n, seed=4)).frame(0).astype(int) for n in (0, 4)
    )
    camera = above()
    edge = np.concatenate(
        [FIELD.lines[n].sample(600) for n in FIELD.lines if "line" in n and n != "centre-line"]
    )
    x, y = np.rint(camera.raw_from_field(edge)).astype(int).T
    hidden = (np.abs(alone - crowded).sum(axis=2) > 60)[y, x]
    assert 0.005 < hidden.mean() < 0.3


def test_light_falls_off_towards_the_corners_and_blur_widens_lines():
    dark, even = rendering(light=Light(unevenness=0, glare=0, grain=0)), rendering()
    ratio = dark.frame(0)[..., 1] / np.maximum(even.frame(0)[..., 1], 1.0)
    assert ratio[512, 640] > 0.98 and 0.4 < ratio[5, 5] < 0.65
    on_a_line = tuple(np.rint(above().raw_from_field([0.0, 2000.0])).astype(int)[::-1])
    sharp, soft = (
        int(rendering(sensor=Sensor(b, 0)).frame(0)[..., 2][on_a_line]) for b in (0.5, 1.5)
    )
    assert sharp > soft + 30


def test_a_picture_costs_a_small_part_of_what_stays_the_same_in_all():
    """In processor time, which a busy machine does not lengthen; seconds are in tests/bench/bench_sim_and_light.py."""
    begun = time.process_time()
    shown = Rendering.of(above(), FIELD, FIELD.regions["full"], Motion(robots=8))
    shown.frame(0)
    built = time.process_time()
    for i in range(1, 6):
        shown.frame(i)
    assert (time.process_time() - built) / 5 < (built - begun) / 8  # on a quiet machine a thirtieth


@pytest.mark.filterwarnings("error")
def test_above_the_horizon_there_is_picture_all_the_same():
    camera = above(
        "none",
        size=ImageSize(320, 256),
        tilt_deg=60,
        height_mm=3000,
        focal_px=150,
        stand_mm=(2000, 0),
    )
    shown = Rendering.of(camera, FIELD, FIELD.regions["full"], Motion(robots=8, people=3))
    assert np.isnan(camera.field_from_raw(np.array([160.0, 0.0]))).all()
    greener = shown.frame(0)[..., 1].astype(int) - shown.frame(0)[..., 2]
    # the floor goes on for ever; the carpet is near
    assert greener[:20].mean() < 10 and greener[-40:].mean() > 20
