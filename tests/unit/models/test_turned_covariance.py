"""What is known of a camera in a turned picture: every place is as uncertain as before, whatever was estimated."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.examples import examples
from touchline.core.field import QUARTER_TURNS
from touchline.core.geometry import ImageSize, with_z
from touchline.core.quarter_turn import QuarterTurn
from touchline.fitting import sensitivity_of
from touchline.fitting.ray_camera.lens_prior import DistortionEstimate
from touchline.models import RayModel
from touchline.models.distortion import LINE_LENSES, Distortion
from touchline.models.intrinsics import PINHOLE_PARAMETERS, Intrinsics
from touchline.models.ray_camera import lens_model
from touchline.models.turned_covariance import turned_covariance, turned_terms

SIZE = ImageSize(1280, 960)
every_turn = pytest.mark.parametrize("turn_deg", QUARTER_TURNS)


def covariance(n, seed=0):
    """Return a full covariance (n, n), of parameters that are known alike."""
    rows = np.random.default_rng(seed).normal(size=(n, 2 * n))
    return 1e-6 * rows @ rows.T


def askew(model):
    if isinstance(model, RayModel):
        return replace(model, aspect=1.04, centre_px=(600.0, 540.0))
    return model


@every_turn
@pytest.mark.parametrize("name", ["brown-conrady", "division", "fisheye", "ssl", "homography"])
@pytest.mark.parametrize(
    "without", [(), ("p1",), ("aspect",), ("centre_x",), ("turn_y",), ("log_focal",)]
)
def test_every_place_is_as_uncertain_as_before(name, turn_deg, without):
    model = askew(examples(name)[1])
    turned, turn = model.turned(turn_deg), QuarterTurn(turn_deg, model.image_size)
    lens = getattr(model, "LENS", None)
    names = tuple(n for n in sensitivity_of(model).names if n not in without)
    sigma = covariance(len(names))
    there, moved = turned_covariance(
        names, sigma, turn, lens.VECTORS if lens else (), getattr(model, "aspect", 1.0)
    )
    places = with_z(
        np.array([[-900.0, -700.0], [0.0, 0.0], [800.0, 300.0]]), 100.0 if lens else 0.0
    )

    def spread(of, names, matrix):
        by = sensitivity_of(of).field_jacobian(places, names)
        return by @ matrix @ by.swapaxes(-1, -2)

    np.testing.assert_allclose(
        spread(turned, there, moved), spread(model, names, sigma), rtol=1e-7, atol=1e-9
    )


def lens(estimated, terms=(-0.28, 0.09, 0.002, -0.003, 0.0, 0.0, 0.0, 0.0)):
    sigma = covariance(len(estimated))
    return Intrinsics(
        "brown-conrady",
        terms,
        900.0,
        1.04,
        (600.0, 500.0),
        SIZE,
        estimated,
        tuple(tuple(map(float, row)) for row in sigma),
    )


@every_turn
def test_a_turned_lens_sees_the_turned_ray_at_the_turned_pixel(turn_deg):
    turn = QuarterTurn(turn_deg, SIZE)
    before = lens((*PINHOLE_PARAMETERS, "k1", "k2", "p1", "p2"))
    after = before.turned(turn_deg)
    rays = np.array([[0.0, 0.0, 1.0], [0.3, -0.2, 1.0], [-0.5, 0.4, 1.0], [0.1, 0.6, 1.2]])
    np.testing.assert_allclose(
        after.project(rays @ turn.about_axis.T), turn.points(before.project(rays)), atol=1e-9
    )
    assert Intrinsics.from_json(after.to_json()) == after
    sigma, by = after.sigma, before.sigma
    names = {"centre_x": "centre_y", "centre_y": "centre_x", "p1": "p2", "p2": "p1"}
    for name in ("centre_x", "centre_y", "p1", "p2", "k1"):
        assert sigma[name] == pytest.approx(by[names.get(name, name) if turn_deg % 180 else name])


def test_four_quarter_turns_of_a_lens_are_none():
    before = around = lens((*PINHOLE_PARAMETERS, "k1", "p1"))
    for _ in range(4):
        around = around.turned(90)
    assert around.estimated == before.estimated
    np.testing.assert_allclose(around.covariance, before.covariance, rtol=1e-9)
    np.testing.assert_allclose(around.terms, before.terms, atol=1e-15)
    np.testing.assert_allclose(
        [*around.values.values()], [*before.values.values()], rtol=1e-12, atol=1e-15
    )


def test_a_lens_without_a_covariance_turns_too():
    assert lens(()).turned(90).covariance == ()


def test_where_one_term_of_a_pair_is_estimated_the_other_one_is_afterwards():
    turn = QuarterTurn(90, SIZE)
    vectors = lens_model("brown-conrady").LENS.VECTORS
    assert turned_terms(["k1", "p1"], turn, vectors) == ["k1", "p2"]
    assert turned_terms(["k1", "p1", "p2"], turn, vectors) == ["k1", "p1", "p2"]
    names, matrix = turned_covariance(("p1",), np.array([[4.0]]), turn, vectors, 1.0)
    assert (names, matrix.tolist()) == (("p2",), [[4.0]])


@every_turn
@pytest.mark.parametrize("name", LINE_LENSES)
def test_a_turned_lens_from_straight_lines_bends_alike(name, turn_deg):
    kind, terms = LINE_LENSES[name]
    values = tuple(-0.1 if t in terms[:1] else 0.01 for t in kind.TERMS)
    if name == "brown-conrady":
        values = (-0.1, 0.01, 0.002, -0.003, 0.0, 0.0, 0.0, 0.0)
    before = Distortion(name, values, (600.0, 500.0), SIZE)
    known = DistortionEstimate(before, (*terms, "centre_x", "centre_y"), covariance(len(terms) + 2))
    after, turn = known.turned(turn_deg), QuarterTurn(turn_deg, SIZE)
    pixels = np.array([[0.0, 0.0], [640.0, 100.0], [1200.0, 900.0]])
    np.testing.assert_allclose(
        after.distortion.undistorted_from_raw(turn.points(pixels)),
        turn.points(before.undistorted_from_raw(pixels)),
        atol=1e-9,
    )
    i, j = (known.names.index(n) for n in ("centre_x", "centre_y"))
    first, second = (j, i) if turn_deg % 180 else (i, j)
    assert after.names == known.names
    assert after.covariance[i, i] == pytest.approx(known.covariance[first, first])
    assert after.covariance[j, j] == pytest.approx(known.covariance[second, second])
    DistortionEstimate.from_json(after.to_json())
