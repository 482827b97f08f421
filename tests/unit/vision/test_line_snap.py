"""Snapping a click to a painted line: its middle, from both edges, and why there is none."""

import numpy as np
import pytest

from tests.support.rendered import painted, round_line, straight
from tests.support.tiers import long, rounds
from touchline.vision.snap import Hint, Snapped, Unsnapped, snap

PX = 0.1  # what a click 4 px off must come within, on average
MIDDLE = np.array([60.3, 49.6])
SURROUNDINGS = {
    "white on green": (200, (80, 80)),
    "white on black": (250, (15, 15)),
    "burnt out": (255, (0, 0)),
    "dark on light": (40, (200, 200)),
    "carpet beside wood": (220, (120, 40)),
}


def normal_of(angle):
    return np.array([-np.sin(angle), np.cos(angle)])


def errors(edges_of, count=8, off_px=4.0, hint=Hint(), seed=0, **how):  # noqa: B008
    """Across the line, px: from its true middle to where clicks so far off land, at all angles."""
    rng, found = np.random.default_rng(seed), []
    for angle in rng.uniform(0, np.pi, count):
        middle = MIDDLE + rng.uniform(-0.5, 0.5, 2)
        picture = painted(edges_of(middle, angle), rng=rng, **how)
        answer = snap(picture, middle + rng.choice([-1, 1]) * off_px * normal_of(angle), hint)
        assert isinstance(answer, Snapped), (np.degrees(angle), answer)
        found.append(abs((np.array(answer.point) - middle) @ normal_of(angle)))
    return np.array(found)


@pytest.mark.parametrize("width_px", [2, long(3), long(4), 6])
@pytest.mark.parametrize("blur_px", [0.5, long(1.0), 1.6])
@pytest.mark.parametrize("where", SURROUNDINGS)
def test_a_click_four_px_off_lands_on_the_middle(where, blur_px, width_px):
    paint, ground = SURROUNDINGS[where]
    # A blurred step and a thin blurred bar are hard to tell apart, unless the width is told.
    hint = Hint(width_px=width_px) if ground[0] != ground[1] else Hint()
    found = errors(
        lambda m, a: [straight(m, a, width_px)],
        hint=hint,
        paint=paint,
        ground=ground,
        blur_px=blur_px,
    )
    assert found.mean() < PX


def test_a_wide_line_has_its_middle_there_too():
    assert errors(lambda m, a: [straight(m, a, 14)], off_px=5).mean() < PX


def test_edges_that_are_not_parallel_share_one_middle():
    assert errors(lambda m, a: [straight(m, a, 4, spread=0.04)]).mean() < PX


def test_an_arc_bends_under_the_window_and_moves_nothing():
    def circle(m, a):
        return [round_line(m - 40 * normal_of(a), 40, 3)]

    assert errors(circle).mean() < PX


def test_a_line_that_crosses_nearby_moves_nothing():
    def crossed(m, a):
        return [
            straight(m, a, 3),
            straight(m + 8 * np.array([np.cos(a), np.sin(a)]), a + np.pi / 2, 3),
        ]

    assert errors(crossed).mean() < PX


@pytest.mark.parametrize("apart_px", [8, 11, 14])
def test_of_two_lines_side_by_side_the_nearer_is_taken(apart_px):
    def pair(m, a):
        return [straight(m, a, 3), straight(m + apart_px * normal_of(a), a, 3)]

    # from either side: also from between the two
    assert errors(pair, off_px=0.3 * apart_px).mean() < PX


def test_the_width_is_found():
    picture = painted([straight(MIDDLE, 0.4, 5)])
    assert snap(picture, MIDDLE + 2).width_px == pytest.approx(5, abs=0.3)


def test_a_width_that_was_told_wrongly_hides_no_line():
    answer = snap(
        painted([straight(MIDDLE, np.pi / 2, 5)], blur_px=0.3), MIDDLE + 2, Hint(width_px=1.75)
    )
    assert isinstance(answer, Snapped)
    assert answer.point[0] == pytest.approx(MIDDLE[0], abs=PX)


def test_the_direction_is_found():
    picture = painted([straight(MIDDLE, 2.0, 3)])
    assert snap(picture, MIDDLE + 2).angle_rad == pytest.approx(2.0, abs=0.01)


def test_a_told_direction_decides_where_lines_cross():
    picture = painted([straight(MIDDLE, 0.2, 3), straight(MIDDLE, 1.7, 3)])
    for angle in (0.2, 1.7):
        answer = snap(picture, MIDDLE + 3.0, Hint(angle_rad=angle + 0.1))
        assert answer.angle_rad == pytest.approx(angle, abs=0.03)
        assert abs((np.array(answer.point) - MIDDLE) @ normal_of(angle)) < PX


def test_a_click_moves_only_across_the_line():
    click = MIDDLE + 3 * normal_of(0.7)
    answer = snap(painted([straight(MIDDLE, 0.7, 3)]), click)
    step = np.array(answer.point) - click
    assert abs(step @ [np.cos(0.7), np.sin(0.7)]) < 0.05
    assert answer.moved_px == pytest.approx(np.linalg.norm(step))


@pytest.mark.parametrize("x", [2.5, 4.0, 116.5])
def test_a_line_beside_the_frame_of_the_picture_is_found(x):
    picture = painted([straight((x, 50), np.pi / 2, 2)], blur_px=0.6)
    answer = snap(picture, (x + (2 if x < 60 else -2), 50))
    assert isinstance(answer, Snapped), answer
    assert answer.point[0] == pytest.approx(x, abs=PX)


def test_a_line_that_is_cut_off_by_the_frame_has_no_second_edge():
    answer = snap(painted([straight((0, 50), np.pi / 2, 6)]), (4, 50))
    assert isinstance(answer, Unsnapped)


def test_bare_carpet_has_no_line():
    assert snap(painted([]), (60, 50)) == Unsnapped("no-line")


def test_a_step_from_light_to_dark_is_no_line():
    step = painted([(lambda p: p[..., 0] - 60, lambda p: -p[..., 0])], ground=(60, 160))
    assert snap(step, (62, 50)) == Unsnapped("one-edge")


def test_a_line_out_of_reach_is_left_alone():
    picture = painted([straight((60, 50), np.pi / 2, 3)])
    assert snap(picture, (74, 50), Hint(reach_px=8)) == Unsnapped("no-line")
    assert snap(picture, (74, 50), Hint(reach_px=18)).point[0] == pytest.approx(60, abs=PX)


@pytest.mark.parametrize("point", [(-3, 50), (60, 200), (np.nan, 50), (np.inf, 50)])
def test_a_click_outside_stays_where_it_is(point):
    assert snap(painted([]), point) == Unsnapped("off-picture")


def test_pure_noise_has_no_line():
    rng = np.random.default_rng(5)
    noise = rng.integers(0, 256, (100, 120), np.uint8)
    answers = [snap(noise, rng.uniform(20, 80, 2)) for _ in range(40)]
    assert sum(isinstance(answer, Snapped) for answer in answers) <= 4


def test_colour_is_looked_at_as_grey():
    grey = painted([straight(MIDDLE, 0.4, 3)])
    colour = np.stack([grey] * 3, axis=-1)
    assert snap(colour, MIDDLE + 2).point == pytest.approx(snap(grey, MIDDLE + 2).point, abs=0.02)


@rounds("pictures", 20, 60)
def test_sigma_is_what_the_noise_really_does(pictures):
    rng = np.random.default_rng(2)
    answers = [
        snap(painted([straight(MIDDLE, 0.4, 3)], noise=8, rng=rng), MIDDLE + 2)
        for _ in range(pictures)
    ]
    across = [(np.array(a.point) - MIDDLE) @ normal_of(0.4) for a in answers]
    # 20 tell it to 16 %
    assert np.std(across) == pytest.approx(np.mean([a.sigma_px for a in answers]), rel=0.4)


def test_a_tiny_picture_is_no_trouble():
    assert isinstance(snap(np.zeros((1, 1), np.uint8), (0, 0)), Unsnapped)
