"""The paper's model: borders straight and in place, its errata, its rectangles, its refusals."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.examples import plain_examples
from tests.support.fields import FULL, HALF, grid, marks_seen, plain_field, seen
from touchline.core.errors import BadInput, FitFailed
from touchline.core.field import BORDERS
from touchline.core.geometry import ImageSize
from touchline.core.records import Observation
from touchline.fitting.polynomial import PolynomialFitter
from touchline.models import field_from_raw

SIZE = ImageSize(1280, 1024)
BARREL, PINCUSHION, TILTED = plain_examples("polynomial")


def fit(observations, region=FULL, size=SIZE, **options):
    return PolynomialFitter.fit(observations, plain_field(region), region, size, options)


def clicks(model=PINCUSHION, count=9, noise_px=0.0, seed=0):
    return seen(model, model.region, count, noise_px=noise_px, rng=np.random.default_rng(seed))


def moved(observations, feature, index, by):
    return tuple(
        replace(o, points=o.points + np.array(by) * (np.arange(len(o.points)) == index)[:, None])
        if o.feature == feature
        else o
        for o in observations
    )


@pytest.mark.parametrize("model", [BARREL, PINCUSHION, TILTED])
def test_the_borders_land_on_the_rectangle(model):
    for observation in seen(model, model.region, 9):
        fitted = fit(seen(model, model.region, 9), model.region, model.image_size, degree=4).model
        corrected = fitted.corrected_from_raw(observation.points)
        place = {
            "left": corrected[:, 0],
            "right": corrected[:, 0] - fitted.width_px,
            "top": corrected[:, 1],
            "bottom": corrected[:, 1] - fitted.height_px,
        }[observation.feature]
        assert np.abs(place).max() < 1e-6


def test_equation_4_as_printed_misses_the_right_border():
    """As printed it divides by I / (x_final - x_initial): the right border then lands on (x_final - x_initial)² / I."""
    y = np.linspace(100, 900, 9)
    x_initial, x_final, i_width = PINCUSHION.left(y), PINCUSHION.right(y), PINCUSHION.width_px
    as_printed = (x_final - x_initial) / (i_width / (x_final - x_initial))
    as_meant = (x_final - x_initial) * i_width / (x_final - x_initial)
    np.testing.assert_allclose(as_printed, (x_final - x_initial) ** 2 / i_width)
    assert np.abs(as_printed - i_width).max() > 30
    np.testing.assert_allclose(as_meant, i_width)
    ours = PINCUSHION.corrected_from_raw(np.stack([x_final, y], axis=-1))[:, 0]
    np.testing.assert_allclose(ours, i_width, atol=1e-9)


def test_the_one_pass_map_is_the_two_passes():
    corrected = grid(BARREL.width_px, BARREL.height_px)
    x_c, y_c = corrected[..., 0], corrected[..., 1]
    # Eq. (8) inverted
    y = BARREL.top(x_c) + y_c * (BARREL.bottom(x_c) - BARREL.top(x_c)) / BARREL.height_px
    # Eq. (4) inverted
    x = BARREL.left(y) + x_c * (BARREL.right(y) - BARREL.left(y)) / BARREL.width_px
    np.testing.assert_allclose(
        BARREL.raw_from_corrected(corrected), np.stack([x, y], axis=-1), atol=1e-9
    )


def test_the_corrected_picture_holds_all_four_borders():
    assert tuple(PINCUSHION.corrected_size) == (1161, 871)
    corners = PINCUSHION.raw_from_corrected(np.array([[0.0, 0.0], [1160.0, 870.0]]))
    assert np.isfinite(corners).all()


@pytest.mark.parametrize("w_max, n_x, h_max, n_y", [(100, 8, 75, 6), (33.5, 20, 40, 12)])
def test_rectangles_of_the_rig_decide_the_corrected_size(w_max, n_x, h_max, n_y):
    model = fit(
        clicks(),
        w_max_rectangle_px=w_max,
        n_rectangles_x=n_x,
        h_max_rectangle_px=h_max,
        n_rectangles_y=n_y,
    ).model
    assert model.width_px == w_max * n_x  # Eq. (3)
    assert model.height_px == h_max * n_y  # Eq. (7)


def test_default_rectangles_do_not_depend_on_the_clicks():
    one, other = fit(clicks(PINCUSHION)).model, fit(clicks(TILTED)).model
    assert (one.width_px, one.height_px) == (other.width_px, other.height_px) == (1280, 960)
    assert (one.n_rectangles_x, one.n_rectangles_y) == (10, 8)


@pytest.mark.parametrize(
    "rotate, goal", [(0, "left"), (90, "top"), (180, "right"), (270, "bottom")]
)
def test_a_turned_region_stands_as_the_camera_sees_it(rotate, goal):
    region = FULL.rotated(rotate)
    left_goal_line = region.border(
        BORDERS[
            ("left", "right", "top", "bottom").index(
                {0: "left", 90: "bottom", 180: "right", 270: "top"}[rotate]
            )
        ]
    )
    np.testing.assert_allclose(np.array([left_goal_line.start, left_goal_line.end])[:, 0], -2000)
    assert goal  # the table reads: after a quarter turn counter-clockwise, what was right is on top


def test_field_millimetres_come_out_where_the_region_says():
    model = fit(clicks(replace(PINCUSHION, region=HALF)), HALF).model
    corners = model.field_from_corrected(
        np.array([[0, 0], [model.width_px, 0], [0, model.height_px]], float)
    )
    np.testing.assert_allclose(corners, [[2000, 1500], [2000, -1500], [0, 1500]], atol=1e-6)


def test_known_points_inside_bend_the_relation():
    field = plain_field()
    observations = (*seen(TILTED, FULL, 9), *marks_seen(TILTED, field))
    places = grid(4000, 3000) - [2000, 1500]
    raw = TILTED.raw_from_corrected(TILTED.corrected_from_field(places))
    linear = fit(observations, relation_degree=1).model
    cubic = fit(observations).model
    assert np.abs(field_from_raw(linear, raw) - places).max() > 50
    assert np.abs(field_from_raw(cubic, raw) - places).max() < 1e-4


def test_lines_inside_tell_what_they_know():
    field = plain_field()
    rows = [
        Observation(
            line.name,
            "line",
            TILTED.raw_from_corrected(TILTED.corrected_from_field(line.sample(5))),
        )
        for line in field.lines.values()
    ]
    fitted = fit((*seen(TILTED, FULL, 9), *rows))
    assert fitted.notes["relation"]["degree"] == 3
    assert fitted.notes["relation"]["known_down"] == fitted.notes["relation"]["known_across"] == 25
    assert all(fitted.used)


def test_arcs_and_points_above_the_carpet_only_check():
    circle = plain_field().arcs["circle"]
    arc = Observation(
        "circle", "line", TILTED.raw_from_corrected(TILTED.corrected_from_field(circle.sample(7)))
    )
    hat = Observation("mark-2-2", "landmark", np.array([[640.0, 500.0]]), z_mm=150.0)
    assert fit((*seen(TILTED, FULL, 9), arc, hat)).used == (True,) * 4 + (False, False)


@pytest.mark.parametrize("border", BORDERS)
@pytest.mark.parametrize("index", [0, 4, 8])
def test_a_stray_click_is_named_and_left_out(border, index):
    across = (14.0, 0.0) if border in ("left", "right") else (0.0, 14.0)
    observations = moved(clicks(noise_px=0.3), border, index, across)
    fitted = fit(observations)
    strays = [(w.feature, w.index) for w in fitted.warnings if w.reason == "stray-click"]
    assert strays == [(border, index)]
    assert "px from the curve" in fitted.warnings[0].text and "remove" in fitted.warnings[0].fix
    assert sum((~fine).sum() for fine in fitted.inliers) == 1


def test_a_landmark_clicked_on_the_wrong_mark_is_named():
    field = plain_field()
    marks = list(marks_seen(TILTED, field))
    marks[7] = replace(marks[7], points=marks[8].points)
    fitted = fit((*seen(TILTED, FULL, 9), *marks))
    assert [w.feature for w in fitted.warnings] == ["mark-1-2"]


def test_a_border_clicked_only_in_its_middle_is_warned_about():
    observations = seen(PINCUSHION, FULL, 9, ends=0.3)
    reasons = {(w.reason, w.feature) for w in fit(observations, degree=2).warnings}
    assert reasons == {("border-extrapolated", name) for name in BORDERS}


def test_borders_that_meet_are_out_of_reach_beyond():
    corrected = TILTED.corrected_from_raw(
        np.array([[640.0, 5000.0], [640.0, -4000.0], [640.0, 500.0]])
    )
    assert np.isnan(corrected[:2]).all() and np.isfinite(corrected[2]).all()


def swapped(observations, one, other):
    names = {one: other, other: one}
    return tuple(replace(o, feature=names.get(o.feature, o.feature)) for o in observations)


def crossing(observations):
    return tuple(
        replace(o, points=np.stack([np.linspace(300, 900, 9), np.linspace(100, 900, 9)], 1))
        if o.feature == "left"
        else replace(o, points=np.stack([np.linspace(900, 300, 9), np.linspace(100, 900, 9)], 1))
        if o.feature == "right"
        else o
        for o in observations
    )


def with_points(feature, points):
    return lambda observations: tuple(
        replace(o, points=np.array(points, float)) if o.feature == feature else o
        for o in observations
    )


@pytest.mark.parametrize(
    "spoil, reason",
    [
        (lambda o: o[:3], "too-few-points"),
        (with_points("left", [[100, 100], [100, 500]]), "too-few-points"),
        (with_points("left", [[100, 100]] * 5), "too-few-points"),
        (with_points("top", [[100, 100], [102, 100], [104, 101], [106, 100]]), "collinear-points"),
        (
            lambda o: tuple(
                replace(b, points=np.stack([np.linspace(10, 1200, 9), np.linspace(10, 1000, 9)], 1))
                for b in o
            ),
            "collinear-points",
        ),
        (
            with_points("right", [[1300, 100], [1290, 500], [1285, 700], [1281, 900]]),
            "outside-picture",
        ),
        (lambda o: swapped(o, "left", "right"), "borders-swapped"),
        (lambda o: swapped(o, "top", "bottom"), "borders-swapped"),
        (crossing, "borders-cross"),
    ],
)
def test_clicks_that_cannot_be_borders_are_refused_by_name(spoil, reason):
    with pytest.raises(FitFailed) as refusal:
        fit(spoil(clicks()), degree=2)
    assert refusal.value.reason == reason
    assert refusal.value.fix.endswith(".")
    assert refusal.value.details.get("feature") in {None, *BORDERS}


@pytest.mark.parametrize(
    "options",
    [
        {"w_max_rectangle_px": 10_000, "n_rectangles_x": 1000},
        {"w_max_rectangle_px": 1, "n_rectangles_x": 1},
    ],
)
def test_rectangles_that_make_no_picture_are_refused(options):
    with pytest.raises(BadInput) as refusal:
        fit(clicks(), **options)
    assert refusal.value.reason == "bad-corrected-size"


def test_a_relation_of_higher_degree_needs_known_points():
    with pytest.raises(FitFailed, match="known points"):
        fit(clicks(), relation_degree=3)


def test_each_border_may_have_its_own_degree():
    fitted = fit(clicks(), degree={"left": 1, "top": 3})
    assert fitted.model.left.degree == 1 and fitted.model.top.degree == 3
    assert fitted.notes["degree"]["left"]["reason"] == "Chosen by the user."
    with pytest.raises(BadInput, match="middle"):
        fit(clicks(), degree={"middle": 2})


def test_progress_is_told_and_may_stop_the_fit():
    told = []
    PolynomialFitter.fit(
        clicks(), plain_field(), FULL, SIZE, None, lambda share, words: told.append((share, words))
    )
    assert told == sorted(told) and all(words for _, words in told)

    class Stop(Exception):
        pass

    def stop(share, words):
        raise Stop

    with pytest.raises(Stop):
        PolynomialFitter.fit(clicks(), plain_field(), FULL, SIZE, None, stop)
