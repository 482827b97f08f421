"""The lenses: exact inverses, derivatives that a complex step confirms, OpenCV's numbers, and horizons."""

import cv2
import numpy as np
import pytest

from touchline.core.field import QUARTER_TURNS
from touchline.core.geometry import ImageSize
from touchline.core.quarter_turn import QuarterTurn
from touchline.models.lenses.brown_conrady import BrownConradyLens
from touchline.models.lenses.division import DivisionLens, EvenDivisionLens
from touchline.models.lenses.kannala_brandt import KannalaBrandtLens
from touchline.models.lenses.projection import smallest_root, stays_positive
from touchline.models.lenses.ssl import SslLens

CASES = [
    (BrownConradyLens, (-0.28, 0.09, 0.001, -0.002, 0.003, 0, 0, 0)),
    (BrownConradyLens, (0.4, 0.05, 0.0005, 0.001, 0.002, 0.7, 0.12, 0.006)),
    (DivisionLens, (-0.25,)),
    (DivisionLens, (0.06,)),
    (DivisionLens, (0.0,)),
    (SslLens, (0.3,)),
    (SslLens, (-0.05,)),
    (SslLens, (0.0,)),
    (KannalaBrandtLens, (0.0, 0.0, 0.0, 0.0)),
    (KannalaBrandtLens, (0.08, -0.03, 0.01, -0.002)),
]
every_lens = pytest.mark.parametrize(
    "lens, terms", [(lens, np.array(terms)) for lens, terms in CASES]
)


def rays(count=40, reach=0.9, seed=0):
    rng = np.random.default_rng(seed)
    found = np.concatenate([rng.uniform(-reach, reach, (count, 2)), np.ones((count, 1))], axis=1)
    found[0, :2], found[1, :2] = 0.0, 1e-9
    return found * rng.uniform(0.5, 3, (count, 1))


@every_lens
def test_undistort_is_the_inverse_of_distort(lens, terms):
    there = rays(200)
    back = lens.undistort(terms, lens.distort(terms, there))
    np.testing.assert_allclose(back[:, :2] / back[:, 2:], there[:, :2] / there[:, 2:], atol=1e-11)


@pytest.mark.parametrize(
    "lens, terms",
    [(lens, np.array(terms)) for lens, terms in [*CASES, (EvenDivisionLens, (-0.2, 0.02, -0.003))]],
)
def test_a_turned_ray_is_seen_in_the_turned_picture(lens, terms):
    there = rays()
    for turn_deg in QUARTER_TURNS:
        turn = QuarterTurn(turn_deg, ImageSize(640, 480))
        np.testing.assert_allclose(
            lens.distort(lens.turned(terms, turn.matrix), there @ turn.about_axis.T),
            lens.distort(terms, there) @ turn.matrix.T,
            atol=1e-14,
        )


@every_lens
def test_derivatives_are_those_of_a_complex_step(lens, terms):
    at = rays()
    plane, by_ray, by_terms = lens.distort_jacobian(terms, at)
    np.testing.assert_allclose(plane, lens.distort(terms, at), atol=1e-15)
    for axis in range(3):
        nudged = at.astype(complex)
        nudged[:, axis] += 1e-30j
        np.testing.assert_allclose(
            by_ray[..., axis], lens.distort(terms, nudged).imag / 1e-30, atol=1e-12
        )
    for index in range(len(terms)):
        nudged = terms.astype(complex)
        nudged[index] += 1e-30j
        np.testing.assert_allclose(
            by_terms[..., index], lens.distort(nudged, at).imag / 1e-30, atol=1e-12
        )


@pytest.mark.parametrize("terms", [terms for lens, terms in CASES if lens is BrownConradyLens])
def test_brown_conrady_is_opencvs(terms):
    there = rays()
    seen, _ = cv2.projectPoints(there, np.zeros(3), np.zeros(3), np.eye(3), np.array(terms))
    np.testing.assert_allclose(
        BrownConradyLens.distort(np.array(terms), there), seen.reshape(-1, 2), atol=1e-12
    )


@pytest.mark.parametrize("terms", [terms for lens, terms in CASES if lens is KannalaBrandtLens])
def test_the_fisheye_is_opencvs(terms):
    there = rays()[2:]
    seen, _ = cv2.fisheye.projectPoints(
        there.reshape(1, -1, 3), np.zeros(3), np.zeros(3), np.eye(3), np.array(terms)
    )
    np.testing.assert_allclose(
        KannalaBrandtLens.distort(np.array(terms), there), seen.reshape(-1, 2), atol=1e-12
    )


def test_a_fisheye_sees_behind_its_shoulder():
    aside = np.array([[1.0, 0.0, -0.2], [0.0, -1.0, -0.4]])
    terms = np.zeros(4)
    back = KannalaBrandtLens.undistort(terms, KannalaBrandtLens.distort(terms, aside))
    np.testing.assert_allclose(
        back / np.linalg.norm(back, axis=1, keepdims=True),
        aside / np.linalg.norm(aside, axis=1, keepdims=True),
        atol=1e-12,
    )


@pytest.mark.parametrize(
    "lens, terms, radius",
    [
        (BrownConradyLens, (-0.3, 0, 0, 0, 0, 0, 0, 0), 1.2),  # turns back at r = 1/√0.9 = 1.054
        (DivisionLens, (0.25,), 1.1),  # turns back at r_u = 1
        (SslLens, (-0.1,), 1.3),
    ],
)  # r_d ≤ 1/√0.3, r_u ≤ 1.217
def test_beyond_the_horizon_is_nan(lens, terms, radius):
    assert np.isfinite(
        lens.distort(np.array(terms), np.array([[0.9 * radius * 0.9, 0.0, 1.0]]))
    ).all()
    assert np.isnan(lens.distort(np.array(terms), np.array([[radius, 0.0, 1.0]]))).all()


@pytest.mark.parametrize(
    "lens, terms, plane",
    [
        (BrownConradyLens, (-0.3, 0, 0, 0, 0, 0, 0, 0), 0.8),
        (DivisionLens, (-0.25,), 2.1),
        (DivisionLens, (0.25,), 2.1),
        (SslLens, (-0.1,), 1.9),
        (KannalaBrandtLens, (-0.3, 0, 0, 0), 1.2),
    ],
)
def test_a_pixel_beyond_the_horizon_has_no_ray(lens, terms, plane):
    assert np.isnan(lens.undistort(np.array(terms), np.array([[plane, 0.0]]))).all()


def random_lenses():
    """Yield lenses that fold within sight, most of them: terms as fits of few clicks find them, and worse."""
    rng = np.random.default_rng(0)
    for number in range(120):
        tangential = rng.normal(0, 0.01, 2) * (number % 3 > 0)
        yield (
            BrownConradyLens,
            np.array(
                [
                    *rng.normal([-0.25, 0.08], [0.2, 0.1]),
                    *tangential,
                    rng.normal(-0.01, 0.05),
                    *(rng.normal(0, 0.1, 3) * (number % 5 == 0)),
                ]
            ),
        )
        yield KannalaBrandtLens, rng.normal(0, [0.1, 0.1, 0.05, 0.02])
        yield DivisionLens, rng.normal(0, 0.3, 1)
        yield SslLens, rng.normal(0, 0.5, 1)


def test_a_lens_maps_one_branch_only():
    """Where it maps at all no picture is folded or mirrored, what lies beyond is NaN, and pixels lead back there."""
    r, turn = np.meshgrid(
        np.linspace(0, 3.0, 240)[1:], np.linspace(0, 2 * np.pi, 25), indexing="ij"
    )
    there = np.stack([r * np.cos(turn), r * np.sin(turn), np.ones_like(r)], axis=-1)
    for lens, terms in [*CASES, *random_lenses()]:
        terms = np.array(terms)
        plane = lens.distort(terms, there)
        seen = np.isfinite(plane).all(axis=-1)
        assert (seen[1:] <= seen[:-1]).all(), (lens, terms)  # never again further out
        outwards, around = plane[1:, :-1] - plane[:-1, :-1], plane[:-1, 1:] - plane[:-1, :-1]
        area = outwards[..., 0] * around[..., 1] - outwards[..., 1] * around[..., 0]
        assert np.nanmin(area) > 0, (lens, terms)
        back = lens.undistort(terms, plane[seen])
        known = np.isfinite(back).all(axis=-1)
        # right at the fold Newton's method may not come there
        assert known.mean() > 0.97, (lens, terms)
        np.testing.assert_allclose(
            back[known, :2] / back[known, 2:], there[seen][known, :2], rtol=1e-5, atol=1e-9
        )
        # a fit may not move on a branch that nothing else sees
        np.testing.assert_array_equal(
            np.isfinite(lens.distort_jacobian(terms, there)[0]).all(axis=-1), seen
        )


@pytest.mark.parametrize("term", [np.nan, np.inf, 1e300, -1e300, 5e-324, -1e-320])
@pytest.mark.parametrize("lens", [BrownConradyLens, KannalaBrandtLens])
def test_terms_that_no_lens_has_place_nothing_and_break_nothing(lens, term):
    """A search may come by them, and a file may hold them."""
    terms = np.zeros(len(lens.TERMS))
    terms[-1] = term
    with np.errstate(all="ignore"):
        plane = lens.distort(terms, rays())
        lens.distort_jacobian(terms, rays())
        lens.undistort(terms, np.array([[0.1, 0.2], [0.5, 0.0]]))
    if 0 < abs(term) < 1e-300:  # as if there were none
        np.testing.assert_array_equal(plane, lens.distort(np.zeros(len(terms)), rays()))
    else:
        assert not np.isfinite(plane[2:]).all()


@pytest.mark.parametrize(
    "lens, terms", [(lens, terms) for lens, terms in CASES if lens is not KannalaBrandtLens]
)
def test_what_is_behind_the_camera_is_nan(lens, terms):
    assert np.isnan(
        lens.distort(np.array(terms), np.array([[0.1, 0.1, -1.0], [0.1, 0.1, 0.0]]))
    ).all()


def test_the_sign_of_the_league_is_not_opencvs():
    """A tool published k1 unchanged: barrel became pincushion. a ≈ -k1."""
    there = np.array([[0.3, 0.1, 1.0]])
    opencv = BrownConradyLens.distort(np.array([-0.2, 0, 0, 0, 0, 0, 0, 0.0]), there)
    right, wrong = (SslLens.distort(np.array([a]), there) for a in (0.2, -0.2))
    assert np.linalg.norm(right - opencv) < 0.1 * np.linalg.norm(wrong - opencv)


def test_a_polynomial_said_to_stay_positive_has_no_root_so_far():
    random, sure = np.random.default_rng(0), 0
    for _ in range(300):
        coefficients, end = [1.0, *random.normal(0, 1, 4)], random.uniform(0.1, 1.5)
        if stays_positive(coefficients, end):
            sure += 1
            assert smallest_root(coefficients) > end
    assert sure > 50
    assert not stays_positive([1.0, -0.5, np.nan], 0.5) and not stays_positive([1.0, 0.5], np.nan)
