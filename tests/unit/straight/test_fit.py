"""A lens from straight lines: what it straightens, how sure it is, what it leaves out, and when it says nothing."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.support.plumb_pictures import straightness_of
from tests.support.straight_edges import FLOOR_PX, SIZE, arc, lens_of, lines_seen
from tests.support.tiers import rounds
from touchline.core.errors import BadInput, FitFailed
from touchline.core.geometry import homogeneous
from touchline.models.distortion import LINE_LENSES, Distortion
from touchline.models.lenses.division import EvenDivisionLens
from touchline.straight.bow import sag_px, sag_verdict
from touchline.straight.fit import fit_plumb_lines
from touchline.straight.search import Chains, LineFit, with_best_lines
from touchline.straight.straightness import straightness

FEW_OR_ALL = rounds("seeds", 1, 8)
WORLDS = [
    ("division", (-0.25,)),
    ("division", (0.08,)),
    ("division-even", (-0.3, -0.1)),
    ("brown-conrady", (-0.28, 0.09)),
]


@cache
def noisy_fit(name, terms, seed):
    """What lines behind that lens, off the middle, give; made once for all tests of this file."""
    return fit_plumb_lines(lines_seen(lens_of(name, terms, centre=(8, -5)), seed), SIZE, name)


@pytest.mark.parametrize(("name", "terms"), WORLDS)
def test_exact_points_give_the_lens_back(name, terms):
    lens = lens_of(name, terms, centre=(8, -5))
    fit = fit_plumb_lines(lines_seen(lens, 0, noise_px=0), SIZE, name, centre_sigma_px=50)
    assert fit.after_px < 1e-3
    # the prior pulls the centre
    np.testing.assert_allclose(fit.values, [*terms, *lens.centre_px], atol=0.2)
    np.testing.assert_allclose(fit.values[: len(terms)], terms, atol=2e-4)


@FEW_OR_ALL
@pytest.mark.parametrize(("name", "terms"), WORLDS)
def test_lines_become_straight_to_the_noise_of_their_points(name, terms, seeds):
    after = [noisy_fit(name, terms, seed).after_px for seed in range(seeds)]
    assert max(after) <= 0.32  # px; the points err by 0.309
    assert min(after) > 0.9 * FLOOR_PX  # less would be following the noise


@rounds("seeds", 3, 8)
@pytest.mark.parametrize(("name", "terms"), WORLDS)
def test_the_truth_lies_within_what_sigma_promises(name, terms, seeds):
    truth = np.array([*terms, *lens_of(name, terms, centre=(8, -5)).centre_px])
    fits = [noisy_fit(name, terms, seed) for seed in range(seeds)]
    chance = np.array(
        [np.abs(f.values - truth) / np.sqrt(np.diag(f.statistical_covariance)) for f in fits]
    )
    assert 0.3 < np.sqrt(np.mean(chance**2)) < 1.1  # a σ that is far too large is no answer either
    assert chance.max() < 3
    assert all((f.sigma >= np.sqrt(np.diag(f.statistical_covariance))).all() for f in fits)


@FEW_OR_ALL
def test_a_lens_of_another_kind_lies_within_the_sigma_that_allows_for_it(seeds):
    """The world is a division lens of two terms; its leading term must be within σ of what one term finds."""
    fits = [
        fit_plumb_lines(lines_seen(lens_of("division-even", (-0.4, -0.14)), seed), SIZE, "division")
        for seed in range(seeds)
    ]
    off = np.array([abs(f.values[0] + 0.4) for f in fits])
    sigma = np.sqrt([f.statistical_covariance[0, 0] for f in fits])
    assert (off > 4 * sigma).mean() > 0.5  # chance alone does not explain it
    assert (off < 2 * np.array([f.sigma[0] for f in fits])).all()


@pytest.mark.parametrize(("name", "terms"), WORLDS)
def test_the_derivatives_are_those_of_the_distances(name, terms):
    lens = lens_of(name, terms, centre=(8, -5))
    chains = Chains.of(lines_seen(lens, 1, lines=5), lens.unit_px, 0.3)
    empty = np.empty(0)
    state = LineFit(
        LINE_LENSES[name][0], np.array(lens.terms), np.array(lens.centre_px), empty, empty, empty
    )
    state = with_best_lines(state, chains)

    def residuals(moved):
        # the feet must follow: the distance is to the curve, not to a place on it
        for _ in range(4):
            moved = replace(moved, feet=feet_below(moved, chains))
        return moved.linearise(chains).residuals

    look, step = state.linearise(chains), 1e-6
    for i in range(len(terms)):
        column = list(LINE_LENSES[name][0].TERMS).index(list(LINE_LENSES[name][1])[i])
        up, down = (
            replace(state, terms=state.terms + s * np.eye(len(state.terms))[column])
            for s in (step, -step)
        )
        np.testing.assert_allclose(
            (residuals(up) - residuals(down)) / (2 * step),
            look.by_lens[:, column],
            atol=1e-3 * np.abs(look.by_lens[:, column]).max(),
        )
    for i, which in enumerate(("angle", "offset")):
        up, down = (replace(state, **{which: getattr(state, which) + s}) for s in (step, -step))
        np.testing.assert_allclose(
            (residuals(up) - residuals(down)) / (2 * step),
            look.by_line[:, i],
            atol=1e-3 * np.abs(look.by_line[:, i]).max(),
        )
    up, down = (replace(state, centre=state.centre + np.array([s, 0])) for s in (1e-3, -1e-3))
    np.testing.assert_allclose(
        (residuals(up) - residuals(down)) / 2e-3, look.by_lens[:, -2], atol=2e-3
    )


def feet_below(state, chains):
    """Where along each line its point lies nearest in the picture, by stepping along the curve."""
    n = np.stack([np.cos(state.angle), np.sin(state.angle)], axis=1)[chains.owner]
    d = np.stack([-n[:, 1], n[:, 0]], axis=1)
    place = homogeneous(state.offset[chains.owner, None] * n + state.feet[:, None] * d)
    curve, by_ray, _ = state.lens.distort_jacobian(state.terms, place)
    along = np.einsum("nij,nj->ni", by_ray[..., :2], d)
    seen = (chains.pixels - state.centre) / chains.unit_px
    return state.feet + np.sum(along * (seen - curve), axis=1) / np.sum(along**2, axis=1)


def test_the_even_division_lens_goes_there_and_back_and_ends_at_its_horizon():
    rng = np.random.default_rng(3)
    plane = rng.uniform(-0.7, 0.7, (200, 2))
    for terms in ((-0.4, -0.14, 0.02), (0.2, 0.05, 0.0), (0.0, 0.0, 0.0)):
        rays = EvenDivisionLens.undistort(np.array(terms), plane)
        np.testing.assert_allclose(
            EvenDivisionLens.distort(np.array(terms), rays), plane, atol=1e-12
        )
    assert np.isnan(
        EvenDivisionLens.undistort(np.array([-0.4, -0.14, 0.0]), np.array([1.4, 0.0]))
    ).all()
    rays = homogeneous(rng.uniform(-1, 1, (40, 2)))
    terms = np.array([-0.4, -0.14, 0.02])
    _, by_ray, by_terms = EvenDivisionLens.distort_jacobian(terms, rays)
    for derivative, moved in (
        (by_ray, lambda s: EvenDivisionLens.distort(terms, rays + s)),
        (by_terms, lambda s: EvenDivisionLens.distort(terms + s, rays)),
    ):
        for i in range(3):
            step = 1e-6 * np.eye(3)[i]
            np.testing.assert_allclose(
                (moved(step) - moved(-step)) / 2e-6, derivative[..., i], atol=1e-7
            )


def test_an_edge_that_is_no_straight_line_is_named_and_left_out():
    lens = lens_of("division", (-0.25,))
    chains = lines_seen(lens, 2)
    crooked = [
        *chains[:3],
        arc((300, 300), 250, 0.2, 1.2),
        *chains[3:],
        arc((900, 500), 200, 2.0, 1.5),
    ]
    fit = fit_plumb_lines(crooked, SIZE, "division")
    assert [(c.index, c.reason) for c in fit.chains if not c.used] == [
        (3, "not-straight"),
        (15, "not-straight"),
    ]
    assert abs(fit.values[0] + 0.25) < 3 * fit.sigma[0]


def test_an_edge_that_bows_by_four_pixels_of_its_own_is_left_out_too():
    chains = lines_seen(lens_of("division", (-0.25,)), 2)
    way = chains[5][-1] - chains[5][0]
    side = np.array([-way[1], way[0]]) / np.linalg.norm(way)
    chains[5] = chains[5] + 4 * np.sin(np.linspace(0, np.pi, len(chains[5])))[:, None] * side
    fit = fit_plumb_lines(chains, SIZE, "division")
    assert [c.index for c in fit.chains if not c.used] == [5]


def test_a_stray_point_bends_nothing():
    lens = lens_of("division", (-0.25,))
    chains = lines_seen(lens, 4)
    chains[0][5] += (6, 6)
    fit = fit_plumb_lines(chains, SIZE, "division")
    assert abs(fit.values[0] + 0.25) < 3 * fit.sigma[0]


def test_two_sides_of_one_bar_count_as_one_object():
    lens = lens_of("division", (-0.25,))
    chains = lines_seen(lens, 5)
    twice = [*chains, *(c + 2.0 for c in chains)]
    alone, both = (
        fit_plumb_lines(chains, SIZE, "division"),
        fit_plumb_lines(twice, SIZE, "division"),
    )
    assert both.groups == alone.groups
    assert both.sigma[0] > 0.8 * alone.sigma[0]  # nothing new was seen


def test_several_pictures_tell_more_than_one():
    lens = lens_of("division", (-0.25,))
    sets = [lines_seen(lens, seed) for seed in range(4)]
    one = fit_plumb_lines(sets[0], SIZE, "division")
    four = fit_plumb_lines(
        [c for s in sets for c in s], SIZE, "division", pictures=np.repeat(range(4), 14)
    )
    assert four.sigma[0] < 0.8 * one.sigma[0]


def test_what_the_centre_is_known_to_counts():
    lens = lens_of("division", (-0.25,), centre=(12, 0))
    chains = lines_seen(lens, 6)
    held, known, free = (
        fit_plumb_lines(chains, SIZE, "division", centre_sigma_px=s) for s in (0, 0.01, 30)
    )
    assert held.names == ("k",) and held.lens.centre_px == SIZE.centre
    np.testing.assert_allclose(known.lens.centre_px, SIZE.centre, atol=0.1)
    assert abs(free.lens.centre_px[0] - lens.centre_px[0]) < 3 * free.sigma[1] < 30


def test_terms_are_those_of_a_camera_of_any_focal_length():
    lens = lens_of("brown-conrady", (-0.28, 0.09))
    raw = np.random.default_rng(0).uniform((0, 0), (1279, 1023), (50, 2))
    terms = np.zeros(8)
    terms[[0, 1, 4]] = list(lens.terms_for(900.0).values())
    rays = lens.lens.undistort(terms, (raw - lens.centre_px) / 900.0)
    np.testing.assert_allclose(
        rays[:, :2] * 900.0 + lens.centre_px, lens.undistorted_from_raw(raw), atol=1e-8
    )


def test_the_lens_survives_json_exactly():
    lens = lens_of("brown-conrady", (-0.28, 0.09), centre=(1 / 3, 0.1))
    assert Distortion.from_json(json.loads(json.dumps(lens.to_json()))) == lens
    for broken in (
        None,
        {},
        {**lens.to_json(), "name": "wide"},
        {**lens.to_json(), "centre_px": [float("nan"), 0]},
    ):
        with pytest.raises(BadInput):
            Distortion.from_json(broken)


def test_the_bow_of_a_known_lens_is_known():
    """A line at height h before the centre, ± a wide: division gives y = h 2 / (1 + √(1 - 4 k r²)), worked out here."""
    lens = lens_of("division", (-0.2,))
    unit, (x, y) = lens.unit_px, lens.centre_px
    straight = np.array([[-0.5, 0.4], [0.0, 0.4], [0.5, 0.4]])
    gain = 2 / (1 + np.sqrt(1 + 0.8 * np.sum(straight**2, axis=1)))
    raw = straight * gain[:, None] * unit + (x, y)
    assert sag_px(lens, raw[[0, 2]]) == pytest.approx(raw[1, 1] - raw[0, 1], abs=1e-6)


def test_a_bow_is_as_unsure_as_the_lenses_that_the_fit_allows_for_make_it():
    chains = lines_seen(lens_of("division", (-0.25,), centre=(8, -5)), 7)
    fit = fit_plumb_lines(chains, SIZE, "division", centre_sigma_px=30)
    verdict = sag_verdict(fit, chains)
    allowed = np.random.default_rng(0).multivariate_normal(
        fit.values, fit.statistical_covariance, 400
    )
    for bow in (verdict.most, verdict.longest):
        ends = chains[bow.index][[0, -1]]
        bows = [
            sag_px(replace(fit.lens, terms=(k,), centre_px=(x, y)), ends) for k, x, y in allowed
        ]
        # 3.4 times what chance does to 400
        assert bow.sigma_px == pytest.approx(np.std(bows), rel=0.12)


@FEW_OR_ALL
def test_a_straight_picture_has_no_significant_distortion(seeds):
    for seed in range(seeds):
        chains = lines_seen(lens_of("division", (0.0,)), seed)
        assert sag_verdict(fit_plumb_lines(chains, SIZE, "division"), chains).answer == "none"


def test_thousands_of_points_do_not_make_a_bow_of_a_tenth_of_a_pixel_significant():
    lens = lens_of("division", (-0.001,))
    chains = lines_seen(lens, 1, lines=60, points=200)
    verdict = sag_verdict(fit_plumb_lines(chains, SIZE, "division"), chains)
    assert verdict.answer == "none"
    # a bare test of significance would have cried out
    assert verdict.most.px > 2 * verdict.most.sigma_px


def test_a_bent_picture_has():
    report = straightness((), lines_seen(lens_of("division", (-0.05,)), 0), SIZE)
    assert report["distortion"] == "significant"
    assert report["bow"]["most"]["px"] > 3


def test_edges_that_tell_nothing_say_so():
    """Short edges about the centre fit any lens."""
    rng, chains = np.random.default_rng(0), []
    for _ in range(5):
        start, angle = np.array(SIZE.centre) + rng.uniform(-40, 40, 2), rng.uniform(0, np.pi)
        along = np.linspace(0, 60, 12)[:, None] * [np.cos(angle), np.sin(angle)]
        chains.append(start + along + rng.normal(0, 0.02, along.shape))
    report = straightness((), chains, SIZE, lens="division")
    assert report["distortion"] == "unknown"
    assert report["sigma"]["k"] > 0.3  # anything from a strong barrel to a strong pincushion


def test_the_report_names_lines_and_is_plain_json():
    chains = [
        *lines_seen(lens_of("division", (-0.25,)), 2),
        arc((300, 300), 250, 0.2, 1.2),
        np.array([[1.0, 2.0]]),
    ]
    report = json.loads(
        json.dumps(straightness((), [c.tolist() for c in chains], SIZE), allow_nan=False)
    )
    assert (
        report["lines"][14]["name"] == "line 15" and report["lines"][14]["reason"] == "not-straight"
    )
    assert report["lines"][15]["reason"] == "too-few-points"
    assert report["straightness_px"]["after"] < 0.35 < report["straightness_px"]["before"]
    assert Distortion.from_json(report["lens"]).name == "division"


@pytest.mark.parametrize(
    ("lines", "reason"),
    [
        ([], "too-few-lines"),
        ([[[0, 0], [5, 5]]] * 9, "too-few-lines"),
        ([[[3, 3]] * 20] * 9, "too-few-lines"),
        (
            [arc((500 + 20 * i, 400), 60 + 17 * i, i, 3.0).tolist() for i in range(9)],
            "no-straight-lines",
        ),
        (
            [
                np.stack([np.linspace(0, 1279, 30), np.full(30, 100.0 + i)], axis=1).tolist()
                for i in range(9)
            ],
            "one-edge",
        ),
        ([[[i, i], [i + 3, i], [i + 6, i + 1]] for i in range(20)], "too-few-lines"),
        ([[[0, 0], [float("nan"), 5]]] * 9, "non-finite-points"),
    ],
)
def test_what_is_no_straight_lines_is_refused_by_name(lines, reason):
    with pytest.raises(BadInput) as refusal:
        straightness((), lines, SIZE, lens="division")
    assert refusal.value.reason == reason


def test_clicks_may_come_in_any_order():
    chains = lines_seen(lens_of("division", (-0.25,)), 3)
    mixed = [np.random.default_rng(i).permutation(c) for i, c in enumerate(chains)]
    ordered, any_order = (straightness((), c, SIZE, lens="division") for c in (chains, mixed))
    assert any_order["bow"]["most"]["px"] == pytest.approx(ordered["bow"]["most"]["px"], rel=0.01)


def test_unknown_lenses_are_refused():
    for bad in (
        lambda: straightness((), [[[0, 0]]], SIZE, lens="fisheye"),
        lambda: fit_plumb_lines([], SIZE, "division", ("k9",)),
        lambda: fit_plumb_lines([], SIZE, "division-even", ("k2",)),
        lambda: fit_plumb_lines([], SIZE, "division", centre_sigma_px=float("nan")),
    ):
        with pytest.raises(BadInput):
            bad()
    with pytest.raises(FitFailed, match="There are 0 lines"):
        straightness_of(np.zeros((40, 60, 3), np.uint8))


def test_what_a_line_along_the_pictures_own_edge_bows_is_told():
    chains = lines_seen(lens_of("division", (-0.25,)), 0)
    fit = fit_plumb_lines(chains, SIZE, "division")
    right, bottom = SIZE.width - 1, SIZE.height - 1
    corners = np.array([[0, 0], [right, 0], [right, bottom], [0, bottom]], float)
    bows = sag_px(fit.lens, np.stack([corners, np.roll(corners, -1, axis=0)], axis=1))
    border = sag_verdict(fit, chains).border
    which = int(np.argmin(np.abs(bows - border.px)))
    assert (
        border.px == pytest.approx(bows[which]) and border.length_px == (right, bottom)[which % 2]
    )
