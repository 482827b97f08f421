"""The simulated camera is the truth that models are tested against: exact, and the same as OpenCV's."""

from dataclasses import astuple

import cv2
import numpy as np
import pytest

from tests.support.reference_camera import HEIGHT_MM, SIZE, reference_camera, reference_field
from tests.support.sim_clicks import (
    border_clicks,
    border_observations,
    known_grid,
    landmark_observations,
    line_clicks,
)
from touchline.core.errors import BadInput
from touchline.core.field import BORDERS
from touchline.core.geometry import ImageSize
from touchline.sources.sim.camera import (
    LENSES,
    BrownConrady,
    Division,
    KannalaBrandt,
    SimCamera,
    Ssl,
)

REGION = reference_field().regions["full"]
every_lens = pytest.mark.parametrize("lens", LENSES.values(), ids=LENSES)
POSES = {
    "straight down": {},
    "tilted": {"tilt_deg": 15},
    "every way": {"tilt_deg": 9, "pan_deg": -7, "roll_deg": 12},
}
every_pose = pytest.mark.parametrize("pose", POSES.values(), ids=POSES)


def pixel_grid(size: ImageSize = SIZE) -> np.ndarray:
    return np.stack(
        np.meshgrid(np.linspace(0, size.width - 1, 33), np.linspace(0, size.height - 1, 27)),
        axis=-1,
    )


def above(lens, **pose) -> SimCamera:
    return SimCamera.above(REGION, SIZE, lens, height_mm=HEIGHT_MM, **pose)


@every_pose
@every_lens
@pytest.mark.parametrize("z_mm", [0.0, 150.0])
def test_there_and_back_is_the_same_pixel(lens, pose, z_mm):
    camera, pixels = above(lens, **pose), pixel_grid()
    field = camera.field_from_raw(pixels, z_mm)
    assert field.shape == pixels.shape
    back = camera.raw_from_field(
        np.concatenate([field, np.full((*field.shape[:-1], 1), z_mm)], axis=-1)
    )
    assert np.isfinite(field).mean() > 0.9
    np.testing.assert_allclose(
        back[np.isfinite(field)], pixels[np.isfinite(field)], rtol=0, atol=1e-9
    )


@every_pose
@every_lens
def test_every_border_is_in_the_picture_and_fills_it(lens, pose):
    camera = above(lens, **pose)
    reach = (
        np.abs(
            np.concatenate([camera.raw_from_field(REGION.border(b).sample(65)) for b in BORDERS])
            - camera.centre_px
        )
        / camera.centre_px
    )
    assert reach.max() == pytest.approx(0.9)


BROWN_CONRADY = {name: lens for name, lens in LENSES.items() if isinstance(lens, BrownConrady)}
BROWN_CONRADY["rational"] = BrownConrady(0.3, -0.05, 0.001, -0.002, 0.01, 0.6, 0.05, -0.01)


@pytest.mark.parametrize("lens", BROWN_CONRADY.values(), ids=BROWN_CONRADY)
def test_opencv_projects_the_same_brown_conrady_pixels(lens):
    camera = above(lens, tilt_deg=11, pan_deg=4, roll_deg=3)
    _, field = known_grid(camera, REGION, 21, 17)
    points = np.concatenate([field.reshape(-1, 2), np.full((field.size // 2, 1), 150.0)], axis=1)
    ours = camera.raw_from_field(points)
    rvec, tvec, matrix = opencv_pose(camera)
    theirs, _ = cv2.projectPoints(points, rvec, tvec, matrix, np.array(astuple(lens)))
    np.testing.assert_allclose(ours, theirs.reshape(-1, 2), rtol=0, atol=1e-9)


def test_opencv_projects_the_same_fisheye_pixels():
    lens = LENSES["fisheye"]
    camera = above(lens, tilt_deg=11, pan_deg=4, roll_deg=3)
    _, field = known_grid(camera, REGION, 21, 17)
    points = np.concatenate([field.reshape(-1, 2), np.full((field.size // 2, 1), 150.0)], axis=1)
    rvec, tvec, matrix = opencv_pose(camera)
    theirs, _ = cv2.fisheye.projectPoints(
        points[None], rvec, tvec, matrix, np.array([lens.k1, lens.k2, lens.k3, lens.k4])
    )
    np.testing.assert_allclose(
        camera.raw_from_field(points), theirs.reshape(-1, 2), rtol=0, atol=1e-9
    )


def opencv_pose(camera: SimCamera):
    rotation = np.array(camera.camera_from_field)
    (fx, fy), (cx, cy) = camera.focal_px, camera.centre_px
    return (
        cv2.Rodrigues(rotation)[0],
        -rotation @ np.array(camera.position_mm),
        np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]]),
    )


def test_a_straight_camera_without_distortion_is_a_scale():
    camera = SimCamera.above(REGION, SIZE, LENSES["none"], height_mm=4000, focal_px=1000)
    np.testing.assert_allclose(
        camera.raw_from_field([[0, 0], [400, 0], [0, 400]]),
        # y of the field goes up
        [[639.5, 511.5], [739.5, 511.5], [639.5, 411.5]],
    )


def test_a_region_stands_in_the_picture_as_it_is_turned():
    camera = SimCamera.above(
        REGION.rotated(90), SIZE, LENSES["none"], height_mm=4000, focal_px=1000
    )
    np.testing.assert_allclose(
        camera.raw_from_field([[400, 0], [0, 400]]), [[639.5, 411.5], [539.5, 511.5]]
    )


@pytest.mark.parametrize(
    ("pose", "higher"), [({"tilt_deg": 10}, (0, 1)), ({"pan_deg": 10}, (1, 0))]
)
def test_tilt_looks_up_the_picture_and_pan_to_its_right(pose, higher):
    camera = above(LENSES["none"], **pose, stand_mm=(0, 0))
    moved = camera.raw_from_field([0.0, 0.0]) - camera.centre_px
    assert moved[0] * higher[0] <= 0 <= moved[1] * higher[1]  # what is below leaves the other way
    assert np.abs(moved).max() > 100
    aimed = above(LENSES["none"], **pose)
    np.testing.assert_allclose(aimed.raw_from_field([0.0, 0.0]), aimed.centre_px, atol=1e-9)


def test_a_higher_point_is_seen_farther_out():
    camera = above(LENSES["strong"])
    flat, high = camera.raw_from_field([[1500.0, 1000, 0], [1500, 1000, 150]]) - camera.centre_px
    assert 1.02 < np.linalg.norm(high) / np.linalg.norm(flat) < 1.05  # 4150 / 4000, less the lens


@pytest.mark.parametrize(
    "lens",
    [
        BrownConrady(k1=-0.3),
        KannalaBrandt(k1=-0.2),
        Division(-0.3),
        Division(0.3),
        BrownConrady(k1=-0.3, p1=0.01),
        BrownConrady(k4=0.4),
        Ssl(-0.3),
    ],
)
def test_a_point_out_of_reach_is_nan_not_a_guess(lens):
    """k1 alone folds back at r = 1/√(-3 k1); a pixel or a ray past the fold has no partner."""
    far = np.array([[8.0, 8, 1], [0, 0, -1], [0.1, 0.2, 1]])
    plane = lens.plane_from_ray(far)
    if lens != Division(-0.3):  # reaches everything in front of it
        assert np.isnan(plane[0]).all()
    assert np.isnan(plane[1]).all() and np.isfinite(plane[2]).all()
    rays = lens.ray_from_plane(np.array([[5.0, 5.0], [0.1, 0.2]]))
    assert np.isnan(rays[0]).all() and np.isfinite(rays[1]).all()


@pytest.mark.parametrize(
    "lens",
    [
        *LENSES.values(),
        BrownConrady(k1=-0.3),
        BrownConrady(k1=-0.3, p1=0.02, p2=-0.01),
        BROWN_CONRADY["rational"],
    ],
)
def test_whatever_ray_a_point_gets_leads_back_to_it(lens):
    """Also close to the fold, where Newton's method can jump to the wrong side."""
    x = np.linspace(-1.2, 1.2, 401)
    plane = np.stack(np.meshgrid(x, x), axis=-1)
    rays = lens.ray_from_plane(plane)
    back = lens.plane_from_ray(rays)
    reached = np.isfinite(rays).all(axis=-1)
    assert reached.mean() > 0.2
    np.testing.assert_allclose(back[reached], plane[reached], rtol=0, atol=1e-9)


def test_the_picture_ends_half_a_pixel_past_its_outer_pixel_centres():
    camera = reference_camera()
    corners = np.array(
        [[-0.5, -0.5], [1279.5, 1023.5], [1279.6, 0], [0, 1023.6], [-0.6, 0], [np.nan, np.nan]]
    )
    assert camera.sees(corners).tolist() == [True, True, False, False, False, False]


def test_the_middle_of_the_lens_is_no_special_case():
    for lens in LENSES.values():
        np.testing.assert_allclose(lens.plane_from_ray(np.array([0.0, 0, 2])), [0, 0], atol=0)
        x, y, z = lens.ray_from_plane(np.zeros(2))
        assert (x, y) == (0, 0) and z > 0


def test_a_fisheye_sees_past_a_right_angle_and_a_pinhole_does_not():
    sideways = np.array([1.0, 0, -0.1])
    assert np.isfinite(LENSES["fisheye"].plane_from_ray(sideways)).all()
    assert np.isnan(LENSES["none"].plane_from_ray(sideways)).all()


def test_a_pixel_above_the_horizon_meets_no_carpet():
    camera = above(LENSES["none"], tilt_deg=75, focal_px=500)
    assert np.isnan(camera.field_from_raw(np.array([640.0, 0.0]))).all()
    assert np.isfinite(camera.field_from_raw(np.array([640.0, 1023.0]))).all()


@pytest.mark.parametrize("pose", [{"tilt_deg": 88}, {"tilt_deg": 70, "height_mm": 300}])
def test_a_camera_that_cannot_see_the_field_says_so(pose):
    with pytest.raises(BadInput) as refused:
        SimCamera.above(REGION, SIZE, LENSES["strong"], **{"height_mm": 4000, **pose})
    assert refused.value.reason == "bad-camera"


def test_exact_clicks_lie_on_their_borders():
    camera = reference_camera("strong", 15)
    for name, points in border_clicks(camera, REGION, 9).items():
        field = camera.field_from_raw(points)
        assert points.shape == (9, 2)
        np.testing.assert_allclose(REGION.border(name).nearest(field), field, atol=1e-6)
        np.testing.assert_allclose(
            field[[0, -1]], [REGION.border(name).start, REGION.border(name).end], atol=1e-6
        )


def test_noisy_clicks_miss_by_as_much_as_was_asked_and_repeat_with_the_seed():
    camera = reference_camera()
    exact = np.concatenate(list(border_clicks(camera, REGION, 500).values()))
    noisy = [
        np.concatenate(
            list(border_clicks(camera, REGION, 500, 0.3, np.random.default_rng(s)).values())
        )
        for s in (1, 1, 2)
    ]
    assert (noisy[0] - exact).std() == pytest.approx(0.3, rel=0.05)
    assert (noisy[0] == noisy[1]).all() and (noisy[0] != noisy[2]).any()


def test_clicks_anywhere_are_spread_and_clicks_outside_the_picture_are_left_out():
    camera = reference_camera()
    raw, field = line_clicks(
        camera, REGION.border("top"), 40, rng=np.random.default_rng(3), anywhere=True
    )
    assert np.ptp(np.diff(field[:, 0])) > 10
    near = SimCamera.above(REGION, SIZE, LENSES["none"], height_mm=4000, focal_px=2500)
    raw, field = line_clicks(near, reference_field().lines["touch-line-top"], 40)
    assert len(raw) == 0
    assert len(border_clicks(camera, REGION, 9)["top"]) == 9


def test_clicks_and_grids_come_as_observations():
    camera = reference_camera()
    borders = border_observations(camera, REGION, 9)
    assert [(o.feature, o.kind, o.points.shape) for o in borders] == [
        (b, "line", (9, 2)) for b in BORDERS
    ]
    raw, field = known_grid(camera, REGION, 5, 4)
    marks = landmark_observations(raw, field)
    assert raw.shape == field.shape == (4, 5, 2) and len(marks) == 20
    np.testing.assert_allclose(camera.raw_from_field(marks[7].feature), marks[7].points[0])
