"""What stands in a room: cameras, their pictures, rays, errors, boards; every number held against the models' own."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.board_views import BOARD, SIZE, TRUTH, views_of
from tests.support.examples import plain_examples
from tests.support.pair_over_field import FIELD
from tests.support.rig_over_field import sim_task, true_models
from touchline.boards.request import calibrate_board
from touchline.core.errors import Conflict, TouchlineError
from touchline.core.geometry import ImageSize
from touchline.core.records import Calibration, Observation
from touchline.models import MODELS, field_from_raw, parameters_json, raw_from_field
from touchline.models.ray_camera import RayCamera
from touchline.scene.frustum import IN_FRONT, MAX_FOV_DEG, BoardViews, Frustum, Viewpoint
from touchline.scene.scene_camera import (
    PoseChange,
    RayHits,
    SceneCamera,
    carpet_intersection,
    describe_place,
)
from touchline.scene.shapes import carpet, goals, paint
from touchline.workflows.calibration import uncertainty

RAYS = [
    (name, number)
    for name in MODELS
    if isinstance(MODELS[name], type) and issubclass(MODELS[name], RayCamera)
    for number in range(2)
]


@pytest.fixture(params=RAYS, ids=str)
def camera(request):
    name, number = request.param
    return plain_examples(name)[number]


@pytest.fixture(scope="module")
def kept():
    """A saved version with its covariance, from an operator's clicks."""
    task = sim_task(2, 0)
    return replace(task.record(task.run(cross_validate=False)), id="a" * 16)


@pytest.fixture(scope="module")
def standing(kept):
    return SceneCamera.of(kept.id, "North", kept)


def test_the_straightened_picture_is_a_pinholes(camera):
    frustum, size = Frustum.of(camera), camera.image_size
    places = np.array([[200.0, 300.0, 0.0], [-400.0, 100.0, 0.0], [600.0, -300.0, 150.0]])
    arms = (places - frustum.position_mm) @ frustum.field_from_camera  # right, down, ahead
    width = 480
    straight = frustum.undistortion(width, size)
    height = straight.raw_x.shape[0]
    seen = (arms[:, :2] / arms[:, 2:] / frustum.half + 1) / 2 * [width, height] - 0.5
    raw = camera.project(places)
    for (x, y), (raw_x, raw_y) in zip(seen, raw, strict=True):
        column, row = int(x), int(y)
        fx, fy = x - column, y - row
        weights = np.array([[(1 - fx) * (1 - fy), fx * (1 - fy)], [(1 - fx) * fy, fx * fy]])
        patch = np.s_[row : row + 2, column : column + 2]
        told = (weights * straight.raw_x[patch]).sum(), (weights * straight.raw_y[patch]).sum()
        # px; between four of its own the map is not straight
        assert told == pytest.approx((raw_x, raw_y), abs=0.1)


def test_a_smaller_raw_picture_has_the_same_straight_one(camera):
    frustum, size = Frustum.of(camera), camera.image_size
    half = ImageSize(size.width // 2, size.height // 2)
    full, small = frustum.undistortion(64, size), frustum.undistortion(64, half)
    assert (full.raw_x + 0.5) / 2 - 0.5 == pytest.approx(small.raw_x, abs=1e-3, nan_ok=True)


def test_lines_drawn_closer_stay_where_they_are_seen(camera):
    frustum = Frustum.of(camera)
    places = np.array([[0.0, 0.0, 0.0], [500.0, 200.0, 0.0], [300.0, -200.0, 150.0]])
    closer = frustum.drawn_closer(places)
    assert camera.project(closer) == pytest.approx(camera.project(places), abs=1e-6)
    depth = (closer - frustum.position_mm) @ frustum.field_from_camera[:, 2]
    # all just before the picture
    assert depth == pytest.approx(np.full(3, IN_FRONT * frustum.depth_mm))


def test_height_and_tilt_are_the_cameras_own():
    model = plain_examples("brown-conrady")[0]  # straight down
    frustum = Frustum.of(model)
    assert frustum.height_mm == model.position_mm[2] and frustum.tilt_deg == pytest.approx(
        0, abs=1e-6
    )
    assert frustum.complete


def test_a_lens_that_sees_too_much_shows_its_middle_and_says_so(kept):
    fisheye = replace(plain_examples("fisheye")[0], focal_px=450.0)
    frustum = Frustum.of(fisheye)
    assert not frustum.complete and np.degrees(2 * np.arctan(max(frustum.half))) == pytest.approx(
        MAX_FOV_DEG
    )
    wide = SceneCamera(kept.id, "Wide", kept, fisheye, FIELD, FIELD.region("full"))
    assert "120°" in wide.to_json()["why_not_whole"] and wide.to_json()["why_no_frustum"] is None


def test_the_footprint_is_where_the_pictures_border_meets_the_carpet(camera):
    footprint = Frustum.of(camera).footprint()
    known = np.isfinite(footprint).all(axis=1)
    seen = raw_from_field(camera, footprint[known])
    size = np.array(tuple(camera.image_size)) - 1
    assert known.any()
    assert np.minimum(np.abs(seen), np.abs(seen - size)).min(axis=1) == pytest.approx(0, abs=1e-3)


def test_a_model_without_rays_says_why_and_its_picture_lies_on_its_region(kept):
    model = plain_examples("polynomial")[0]
    flat = SceneCamera(kept.id, "Flat", replace(kept, report={}), model, FIELD, model.region)
    assert flat.frustum is None and "no frustum" in flat.to_json()["why_no_frustum"]
    told = flat.to_json()
    assert (
        told["height_mm"] is None and told["sheet"]["carpet"]["why"] and told["sheet"]["hat"]["fix"]
    )
    quad, region = flat.quad, model.region
    assert quad.middle_mm == pytest.approx([np.mean(region.x_mm), np.mean(region.y_mm)], abs=1)
    # from the outer edge of the first pixels to that of the last: half a pixel more at each end
    assert quad.width_mm == pytest.approx(region.width_mm, rel=0.01)
    corner = quad.middle_mm - quad.right * quad.width_mm / 2 - quad.down * quad.height_mm / 2
    assert model.corrected_from_field(corner) == pytest.approx([-0.5, -0.5], abs=1e-6)


def test_exact_clicks_land_on_their_line_and_a_stray_is_one():
    model = true_models()[0]
    border = model.region.border("top")
    points = raw_from_field(model, border.sample(5))
    points[2] += [0, 40]
    found = RayHits.of(
        model,
        (Observation("top", "line", points),),
        FIELD,
        model.region,
        [np.array([False, False, True, False, False])],
    )
    assert found.outlier.tolist() == [False, False, True, False, False]
    assert np.linalg.norm(found.residuals, axis=1)[~found.outlier] == pytest.approx(0, abs=1e-6)
    assert found.points[:, :2] == pytest.approx(field_from_raw(model, points))
    ends = found.arrows(10.0)[2]
    assert (
        ends[1] - ends[0] == pytest.approx(10 * found.residuals[2])
        and np.linalg.norm(found.residuals[2]) > 50
    )
    rays = found.rays_from(np.array(model.position_mm))
    assert rays[0, 0] == pytest.approx(model.position_mm) and rays[0, 1] == pytest.approx(
        found.points[0]
    )


def test_a_point_at_height_lands_at_its_height():
    model = true_models()[0]
    raw = model.project(np.array([[-2000.0, 1000.0, 150.0]]))
    found = RayHits.of(
        model,
        (Observation((-2000.0, 1000.0), "landmark", raw, 150.0),),
        FIELD,
        model.region,
        [np.array([False])],
    )
    assert found.points[0] == pytest.approx([-2000, 1000, 150], abs=1e-6)


def test_the_sheet_is_the_expected_error_and_lies_on_its_region(standing, kept):
    sheet, region = standing.carpet_error, standing.region
    told = uncertainty(standing.model, kept.covariance, region)
    assert sheet.largest_mm == pytest.approx(told["max"])
    corner = (
        sheet.quad.middle_mm
        - sheet.quad.right * sheet.quad.width_mm / 2
        - sheet.quad.down * sheet.quad.height_mm / 2
    )
    assert corner == pytest.approx(region.field_from_region(np.zeros(2)))
    assert standing.robot_top_error.quad.z_mm == FIELD.hat_height_mm
    picture = sheet.picture(5.0)
    assert picture.shape[2] == 4 and (picture[..., 3] > 0).all()
    holed = replace(sheet, sigma_mm=np.full_like(sheet.sigma_mm, np.nan))
    assert (holed.picture(5.0)[..., 3] == 0).all()


def test_a_place_tells_its_pixel_and_expected_error_in_every_camera(standing, kept):
    told = uncertainty(standing.model, kept.covariance, standing.region, 0.0, 3, 3)
    place, sigma = told["grid"]["places"][1][1], told["grid"]["sigma_mm"][1][1]
    other = SceneCamera.of("b" * 16, "Flat", replace(kept, report={}))
    one, two = describe_place(place, [standing, other])["cameras"]
    assert one["pixel"] == pytest.approx(raw_from_field(standing.model, np.array(place)).tolist())
    assert one["inside"] and one["sigma_mm"] == pytest.approx(sigma)
    assert one["hat_pixel"] == pytest.approx(
        standing.model.project(np.array([*place, 150.0])).tolist()
    )
    at_hats = uncertainty(standing.model, kept.covariance, standing.region, 150.0, 3, 3)["grid"][
        "sigma_mm"
    ][1][1]
    assert (
        one["hat_sigma_mm"] == pytest.approx(at_hats)
        and two["sigma_mm"] is None
        and two["pixel"] == one["pixel"]
    )
    far = describe_place((60_000.0, 0.0), [standing])["cameras"][0]
    assert not far["inside"]


@pytest.mark.parametrize(
    ("origin", "ahead", "place"),
    [
        ((100, 200, 3000), (0, 0, -1), (100, 200)),
        ((0, 0, 1000), (1, 1, -2), (500, 500)),
        ((0, 0, 1000), (0, 0, 1), None),
        ((0, 0, 1000), (1, 0, 0), None),
        ((0, 0, np.nan), (0, 0, -1), None),
        ((0, 0, -500), (1, 0, 1), (500, 0)),
    ],
)
def test_a_line_of_sight_meets_the_carpet_once_or_not_at_all(origin, ahead, place):
    found = carpet_intersection(origin, ahead)
    assert found is None if place is None else found == pytest.approx(place)


def test_what_moved_is_told_by_the_camera_and_on_the_carpet():
    model = true_models()[0]
    knocked = replace(
        model,
        position_mm=(model.position_mm[0] + 30, model.position_mm[1] + 40, model.position_mm[2]),
    )
    moved = PoseChange.between(model, knocked, model.region, Frustum.of(model), Frustum.of(knocked))
    assert moved.shift_mm == pytest.approx([30, 40, 0]) and moved.turn_deg == pytest.approx(
        0, abs=1e-3
    )
    # a camera that is shifted shifts all that it sees
    assert moved.median_mm == pytest.approx(50, abs=1e-6)
    assert moved.scaled(3.0)[0, 1] - moved.scaled(3.0)[0, 0] == pytest.approx(
        [90, 120, 0], abs=1e-6
    )


def test_a_version_beside_its_older_one_knows_what_moved(kept):
    older = replace(
        kept,
        id="c" * 16,
        model_parameters={
            **kept.model_parameters,
            "position_mm": [
                kept.model_parameters["position_mm"][0] - 50,
                *kept.model_parameters["position_mm"][1:],
            ],
        },
    )
    told = SceneCamera.of(kept.id, "North", kept, older).to_json()["moved"]
    assert told["shift_mm"] == pytest.approx([50, 0, 0]) and told["max_mm"] == pytest.approx(
        50, abs=0.1
    )


def test_arrows_are_enlarged_until_they_are_seen(standing):
    lengths = np.linalg.norm(standing.ray_hits.residuals[~standing.ray_hits.outlier], axis=1)
    assert np.median(lengths) * standing.arrow_scale == pytest.approx(200, rel=0.01)


@pytest.mark.parametrize(
    "report",
    [
        {},
        {"per_feature": "no"},
        {"per_feature": [3]},
        {"covariance": [1, 2]},
        {"per_feature": [{"residuals": [None] * 99}]},
    ],
)
def test_a_strangers_report_cannot_break_the_room(kept, report):
    # where every imported or stored one is read
    read = Calibration.from_json({**kept.to_json(), "report": report})
    told = SceneCamera.of(read.id, "North", read).to_json()
    assert told["points"] > 0 and told["sheet"]["carpet"]["why"]


def test_the_paint_is_as_wide_as_it_is():
    ground = carpet(FIELD)
    assert (
        np.ptp(ground.vertices[:, 0]) == FIELD.length_mm + 2 * FIELD.extras["boundary"]["goal_mm"]
    )
    lines = paint(FIELD)
    corners = lines.vertices[lines.faces][..., :2]
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() / 2
    wanted = sum(
        (one.length_mm + one.width_mm) * one.width_mm
        for one in (*FIELD.lines.values(), *FIELD.arcs.values())
    )
    assert area == pytest.approx(wanted, rel=0.002)  # a circle is drawn by chords


def test_goals_stand_behind_the_goal_lines_with_their_mouths_open():
    edges = goals(FIELD)
    assert np.abs(edges[..., 0]).min() == FIELD.length_mm / 2
    assert np.abs(edges[..., 0]).max() == FIELD.length_mm / 2 + FIELD.extras["goal"]["depth_mm"]
    mouth = (np.abs(edges[..., 0]) == FIELD.length_mm / 2).all(axis=1) & (edges[..., 2] == 0).all(
        axis=1
    )
    assert not mouth.any()
    assert not len(goals(replace(FIELD, extras={})))


def test_from_above_the_whole_field_is_in_the_window():
    for aspect in (0.5, 1.0, 2.5):
        view = Viewpoint.above(FIELD, aspect)
        half = np.tan(view.fov_rad / 2) * view.position_mm[2]
        assert half >= FIELD.width_mm / 2 and half * aspect >= FIELD.length_mm / 2


def test_through_a_camera_its_whole_picture_is_in_the_window(camera):
    frustum = Frustum.of(camera)
    for aspect in (0.6, 2.0):
        half = np.tan(Viewpoint.through(frustum, aspect).fov_rad / 2)
        assert half >= frustum.half[1] - 1e-12 and half * aspect >= frustum.half[0] - 1e-12


def test_a_lens_says_where_its_boards_were_held():
    views = views_of(count=6, seed=2, noise_px=0.0, bow_mm=(0.0, 0.0))
    lens = calibrate_board(views, BOARD, SIZE, "brown-conrady", {"warp": False})
    boards = BoardViews.of(lens)
    assert len(boards.quads) == 6 and boards.names[0] == "view 1"
    outermost = [
        0,
        BOARD.columns - 1,
        BOARD.columns * BOARD.rows - 1,
        BOARD.columns * (BOARD.rows - 1),
    ]
    for quad, view in zip(boards.quads, views, strict=True):
        assert TRUTH.project(quad) == pytest.approx(view.pixels[outermost], abs=0.5)  # px
    assert boards.to_json()["nearest_mm"] > 0 and boards.coverage().shape[2] == 3


@pytest.mark.parametrize(
    "lens", [{}, {"report": {"views": []}}, {"report": {"views": [{"used": True}]}}]
)
def test_a_lens_from_before_says_that_it_does_not_know(lens):
    with pytest.raises(Conflict, match="does not contain the poses"):
        BoardViews.of(lens)


def test_a_room_of_a_strangers_calibration_is_refused_in_words(kept):
    with pytest.raises(TouchlineError):
        SceneCamera.of(
            "x",
            "X",
            replace(kept, model_parameters={**parameters_json(true_models()[0]), "focal_px": "?"}),
        )


def test_a_lens_so_absurd_that_its_border_is_one_line_still_has_a_view():
    """Such a one may be imported; what is drawn of it has a width and a height."""
    model = replace(true_models()[0], centre_px=(639.5, 0.0))
    flat = MODELS["division"](
        (-25.0,),
        900.0,
        1.0,
        model.centre_px,
        (np.pi, 0.0, 0.0),
        (30.0, -20.0, 4150.0),
        1280.0,
        960.0,
        10,
        8,
        model.region,
        ImageSize(1280, 1024),
    )
    frustum = Frustum.of(flat)
    assert 1 / 8 <= frustum.aspect <= 8 and min(frustum.half) > 0 and not frustum.complete
