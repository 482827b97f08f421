"""First values by linear methods: from clicks anywhere on lines, vanishing points, and Tsai's two stages."""

import numpy as np
import pytest

from tests.support.reference_camera import SIZE, reference_camera, reference_field
from tests.support.sim_clicks import border_observations, known_grid
from touchline.core.errors import FitFailed
from touchline.core.geometry import ImageSize
from touchline.fitting.linear import (
    Incidences,
    focal_from_vanishing_points,
    homography_from_lines,
    line_through,
    pose_from_homography,
    tsai_two_stage,
)
from touchline.models.rotation import matrix_from_vector, nearest_rotation, vector_from_matrix

REGION = reference_field().regions["full"]
CENTRE = np.array(SIZE.centre)


def border_incidences(camera, count=9, **noise):
    observations = border_observations(camera, REGION, count, **noise)
    lines = [
        line_through(
            np.array(REGION.border(o.feature).start), np.array(REGION.border(o.feature).end)
        )
        for o in observations
    ]
    return Incidences(
        np.concatenate([o.points for o in observations]),
        np.concatenate(
            [np.tile(line, (len(o.points), 1)) for line, o in zip(lines, observations, strict=True)]
        ),
    )


def homography(camera):
    return np.linalg.inv(
        homography_from_lines(border_incidences(camera), CENTRE, np.zeros(1)).field_from_plane
    )


@pytest.mark.parametrize("tilt", [0, 8, 15])
def test_clicks_anywhere_on_four_lines_give_the_homography(tilt):
    camera = reference_camera("none", tilt)
    found = homography_from_lines(border_incidences(camera), CENTRE, np.zeros(1))
    raw, truth = known_grid(camera, REGION, 9, 7)
    about = (
        np.concatenate([raw - CENTRE, np.ones((*raw.shape[:-1], 1))], axis=-1)
        @ found.field_from_plane.T
    )
    np.testing.assert_allclose(about[..., :2] / about[..., 2:], truth, atol=1e-6)


@pytest.mark.parametrize(
    "lens, k1", [("strong", -0.28), ("half", -0.14), ("none", 0.0), ("pincushion", 0.1)]
)
def test_the_bend_comes_with_the_homography(lens, k1):
    camera = reference_camera(lens, 8)
    found = homography_from_lines(
        border_incidences(camera, noise_px=0.3, rng=np.random.default_rng(0)), CENTRE
    )
    assert found.bend * camera.focal_px[0] ** 2 == pytest.approx(k1, abs=0.25 * abs(k1) + 0.02)
    assert found.rms_mm < 6


@pytest.mark.parametrize("tilt", [5, 12, 18])
def test_vanishing_points_tell_the_focal_length_when_tilted(tilt):
    camera = reference_camera("none", tilt, height_mm=5500.0)
    assert focal_from_vanishing_points(homography(camera)) == pytest.approx(
        camera.focal_px[0], rel=1e-6
    )


def test_straight_from_above_vanishing_points_tell_nothing():
    plane_from_field = np.diag([0.18, -0.18, 1.0])
    plane_from_field[:2, 2] = 5.0
    assert focal_from_vanishing_points(plane_from_field) is None


def test_the_pose_comes_from_the_homography():
    camera = reference_camera("none", 12)
    rotation, position = pose_from_homography(homography(camera), camera.focal_px[0])
    np.testing.assert_allclose(position, camera.position_mm, atol=1e-4)
    np.testing.assert_allclose(rotation, np.array(camera.camera_from_field), atol=1e-9)


def test_poses_of_several_focal_lengths_are_those_of_each():
    seen = homography(reference_camera("none", 12))
    focals_px = np.array([400.0, 720.0, 1500.0])
    rotations, positions = pose_from_homography(seen, focals_px)
    for focal_px, rotation, position in zip(focals_px, rotations, positions, strict=True):
        for found, one in zip(
            (rotation, position), pose_from_homography(seen, float(focal_px)), strict=True
        ):
            np.testing.assert_allclose(found, one, rtol=1e-12, atol=1e-12)


def test_a_mirrored_field_is_refused():
    with pytest.raises(FitFailed) as refusal:
        pose_from_homography(
            homography(reference_camera("none", 12)) @ np.diag([-1.0, 1.0, 1.0]), 720.0
        )
    assert refusal.value.reason == "mirrored"


@pytest.mark.parametrize("tilt", [10, 15, 20])
def test_tsai_finds_pose_focal_length_and_k1(tilt):
    camera = reference_camera("half", tilt, height_mm=6000.0)
    raw, truth = known_grid(camera, REGION, 7, 5)
    rotation, position, focal, k1 = tsai_two_stage(
        raw.reshape(-1, 2) - CENTRE, truth.reshape(-1, 2)
    )
    assert focal == pytest.approx(camera.focal_px[0], rel=0.1)
    assert np.linalg.norm(position - camera.position_mm) < 0.1 * camera.position_mm[2]
    assert k1 == pytest.approx(-0.14, abs=0.1)
    assert (
        np.degrees(
            np.linalg.norm(vector_from_matrix(rotation @ np.array(camera.camera_from_field).T))
        )
        < 3
    )


@pytest.mark.parametrize(
    "spoil, reason",
    [
        (lambda i: Incidences(i.pixels[:5], i.lines[:5]), "too-few-points"),
        # left and right alone are parallel
        (lambda i: Incidences(i.pixels[:18], i.lines[:18]), "lines-not-enough"),
        (lambda i: Incidences(np.tile(i.pixels[:1], (36, 1)) + 0.0, i.lines), "lines-not-enough"),
    ],
)
def test_lines_that_are_not_enough_are_refused(spoil, reason):
    with pytest.raises(FitFailed) as refusal:
        homography_from_lines(spoil(border_incidences(reference_camera("none", 8))), CENTRE)
    assert refusal.value.reason == reason


@pytest.mark.parametrize(
    "vector",
    [
        (0, 0, 0),
        (1e-10, 0, 0),
        (0.3, -0.2, 1.0),
        (np.pi, 0, 0),
        (0, 2.2, -2.2),
        (-np.pi + 1e-9, 0, 0),
    ],
)
def test_rotations_there_and_back(vector):
    matrix = matrix_from_vector(np.array(vector, float))
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(matrix_from_vector(vector_from_matrix(matrix)), matrix, atol=1e-12)
    np.testing.assert_allclose(nearest_rotation(matrix * 1.3), matrix, atol=1e-12)


def test_the_size_of_the_reference_is_what_the_tests_think():
    assert ImageSize(1280, 1024) == SIZE
