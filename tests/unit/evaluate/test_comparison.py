"""Models on the same clicks, ranked by what they miss inside the field: the right one wins, for a reason it can say."""

import json
from functools import cache

import numpy as np
import pytest

from tests.support.fields import plain_field
from tests.support.operator import FIELD, REGION, SIZE, reference_camera
from tests.support.paths import CLICKS
from tests.support.second_simulator.scene_spec import camera_of, fields, region_of, scene_spec
from tests.support.sim_clicks import border_observations, known_grid, rms_mm
from tests.support.tiers import long, rounds
from touchline.core.errors import FitFailed
from touchline.core.field import BORDERS
from touchline.core.geometry import ImageSize, with_z
from touchline.core.records import Observation, observations_from_json
from touchline.evaluate.cross_validation import folds_for
from touchline.evaluate.difference import difference_report
from touchline.fitting import FITTERS
from touchline.models import MODELS, RayModel, field_from_raw
from touchline.store.fields import load_fields
from touchline.workflows import calibration, model_choice

QUICK = ("polynomial", "homography", "division", "brown-conrady")


def clicks(lens, tilt=8, seed=0):
    return border_observations(
        reference_camera(lens, tilt), REGION, 9, 0.3, np.random.default_rng(seed)
    )


@cache
def compared(lens, seed=0):
    return model_choice.compare(clicks(lens, seed=seed), FIELD, REGION, SIZE, QUICK).ranking


@pytest.mark.parametrize("lens", ["strong", long("half"), "pincushion"])
def test_under_a_lens_a_lens_model_wins_though_polynomials_fit_the_borders_as_well(lens):
    found = compared(lens)
    by_name = {row["model"]: row for row in found["ranking"]}
    assert found["recommended"] in ("division", "brown-conrady")
    assert by_name["polynomial"]["rms_px"] < 1.1 * by_name[found["recommended"]]["rms_px"]
    assert by_name["polynomial"]["field_mm"] > 4 * by_name[found["recommended"]]["field_mm"]
    assert not found["no_significant_distortion"]
    assert "mm inside the field" in found["reason"] and found["failed"] == []


@rounds("seed", *range(4))
def test_without_a_lens_it_says_so_and_takes_the_simplest_that_the_inside_was_asked_about(seed):
    """On borders alone no model without rays, which may be anywhere between them; with a line inside the simplest."""
    camera, field, rng = (
        reference_camera("none", 8),
        plain_field(REGION),
        np.random.default_rng(seed),
    )
    places = camera.raw_from_field(field.lines["at-x-1"].sample(9))
    line = Observation("at-x-1", "line", places + rng.normal(0, 0.3, (9, 2)))
    for more, rays in (((), True), ((line,), False)):
        found = model_choice.compare(
            (*clicks("none", seed=seed), *more), field, REGION, SIZE, QUICK
        ).ranking
        assert (
            found["reason"].startswith("No significant distortion.")
            and found["no_significant_distortion"]
        )
        chosen = next(row for row in found["ranking"] if row["model"] == found["recommended"])
        assert issubclass(MODELS[chosen["model"]], RayModel) == rays
        assert rays or chosen["parameters"] <= 8


def test_where_the_clicks_hardly_tell_any_lens_the_most_probable_one_is_recommended():
    """36 clicks on borders under a real fisheye: polynomials pass each border and are decimetres off inside."""
    spec = scene_spec(
        31, lens="usb-fisheye-170", field="ssl-div-b", region="half-right", tilt_deg=7.0
    )
    camera, region, field = camera_of(spec), region_of(spec), fields()[spec.field]
    rng, seen = np.random.default_rng(0), []
    for name in BORDERS:
        raw = camera.project(with_z(region.border(name).sample(60)))
        raw = raw[camera.inside(raw, 3)]
        chosen = raw[np.linspace(0, len(raw) - 1, 9).astype(int)]
        seen.append(Observation(name, "line", chosen + rng.normal(0, 0.4, (9, 2))))
    tape = {"height_mm": {"value": float(camera.position_mm[2]), "sigma": 30.0}}
    found = model_choice.compare(
        tuple(seen), field, region, ImageSize(*spec.size), (*QUICK, "fisheye", "ssl"), tape
    ).ranking
    rows = {row["model"]: row for row in found["ranking"]}
    assert all(
        "weakly-determined" in row["warnings"]
        for row in rows.values()
        if row["expected_hat_mm"] is not None
    )
    assert found["recommended"] == "fisheye" and rows["fisheye"]["apart_mm"] is None
    assert rows["polynomial"]["field_mm"] > 100 > rows["fisheye"]["field_mm"]
    # more than a click's noise may be by the options, and listed all the same
    assert rows["homography"]["rms_px"] > 20


@pytest.mark.parametrize("seed", [2, 3])
def test_a_lens_of_one_term_that_another_contradicts_is_not_recommended_for_being_simple(seed):
    camera = reference_camera("half", 15)
    seen = border_observations(camera, REGION, 9, 0.5, np.random.default_rng(seed))
    found = model_choice.compare(
        seen, FIELD, REGION, SIZE, ("division", "brown-conrady", "fisheye", "ssl")
    ).ranking
    rows = {row["model"]: row for row in found["ranking"]}
    assert (
        "another-lens" in rows["ssl"]["warnings"]
        and "another-lens" not in rows[found["recommended"]]["warnings"]
    )
    raw, truth = known_grid(camera, REGION, 21, 17)
    true_mm = {
        name: rms_mm(field_from_raw(FITTERS[name].fit(seen, FIELD, REGION, SIZE).model, raw), truth)
        for name in ("ssl", found["recommended"])
    }
    assert true_mm[found["recommended"]] < true_mm["ssl"]


def test_a_model_that_only_borders_were_clicked_for_is_not_recommended():
    found = model_choice.compare(
        clicks("strong"), FIELD, REGION, SIZE, ("polynomial", "homography")
    ).ranking
    assert found["recommended"] is None and "inside the field" in found["reason"]


@pytest.mark.parametrize("lens", ["strong", "none"])
def test_the_ranking_is_near_the_truth(lens):
    """Field error as told against the true one over the grid: within a factor of two, and the order of the far ones."""
    camera = reference_camera(lens, 8)
    raw, truth = known_grid(camera, REGION, 21, 17)
    found = compared(lens)
    for row in found["ranking"]:
        model = FITTERS[row["model"]].fit(clicks(lens), FIELD, REGION, SIZE).model
        error = rms_mm(field_from_raw(model, raw), truth)
        assert row["field_mm"] == pytest.approx(error, rel=1.0, abs=2.5)


def test_a_model_that_cannot_be_fitted_is_listed_with_its_fix():
    # 3 points a border
    few = tuple(Observation(o.feature, "line", o.points[::4]) for o in clicks("half"))
    found = model_choice.compare(
        few, FIELD, REGION, SIZE, ("polynomial", "brown-conrady"), {"degree": 4}
    ).ranking
    assert [f["model"] for f in found["failed"]] == ["polynomial"]
    assert found["failed"][0]["fix"] and found["failed"][0]["reason"] == "too-few-points"
    with pytest.raises(FitFailed):
        model_choice.compare((), FIELD, REGION, SIZE, QUICK)


def test_progress_is_told_in_order_and_may_stop():
    told = []
    model_choice.compare(
        clicks("half"),
        FIELD,
        REGION,
        SIZE,
        ("polynomial", "homography"),
        progress=lambda share, words: told.append(share),
    )
    assert told == sorted(told) and told[0] >= 0 and told[-1] <= 1


def test_the_difference_of_two_calibrations_is_the_distance_between_their_places():
    one, other = (
        calibration.calibrate(clicks("strong", seed=s), FIELD, REGION, SIZE, m).model
        for s, m in ((0, "brown-conrady"), (1, "polynomial"))
    )
    found = difference_report(one, other, REGION)
    assert found["max_mm"] > 20 and found["median_mm"] < found["rms_mm"] < found["max_mm"]
    assert (
        np.array(found["grid"]["mm"], float).shape
        == np.array(found["grid"]["px"], float).shape
        == (19, 25)
    )
    same = difference_report(one, one, REGION)
    assert same["max_mm"] < 1e-6 and same["max_px"] < 1e-6


def test_lines_inside_are_left_out_whole_and_borders_in_thirds():
    observations = (
        *clicks("half"),
        Observation("at-x-1", "line", np.random.default_rng(0).uniform(300, 600, (5, 2))),
        Observation((0.0, 0.0), "landmark", [[600.0, 500.0]]),
    )
    with_lens = folds_for(observations, (True,) * 6, needs_every_border=False)
    assert [(4, k) for k in range(5)] in with_lens and [(5, 0)] in with_lens
    assert sorted(len(f) for f in with_lens if f[0][0] < 4) == [3] * 12
    of_borders = folds_for(observations, (True,) * 6, needs_every_border=True)
    assert all(len(f) == 1 for f in of_borders if f[0][0] < 4)
    for folds in (with_lens, of_borders):
        assert sorted(p for f in folds for p in f) == sorted(
            (i, k) for i, o in enumerate(observations) for k in range(len(o.points))
        )


@pytest.mark.parametrize(
    "name, field_name, worse",
    [
        long("ssl_2008_half", "ssl-2008", ["polynomial", "homography"]),
        ("unball_full", "vsss-3v3", ["polynomial"]),
    ],
)
def test_every_model_is_fitted_to_real_clicks_ranked_and_the_choice_explained(
    name, field_name, worse
):
    """The pictures are not needed: the clicks on them are ours."""
    given = json.loads((CLICKS / f"{name}.json").read_text())
    field = load_fields()[field_name]
    found = model_choice.compare(
        observations_from_json(given["observations"]),
        field,
        field.region(given["region"]),
        ImageSize.of(given["image_size"]),
    ).ranking
    assert found["failed"] == []
    rows = {row["model"]: row for row in found["ranking"]}
    assert set(rows) == set(FITTERS)
    assert all(row["parameters"] >= 7 for row in rows.values())
    assert issubclass(MODELS[found["recommended"]], RayModel)
    assert all(
        rows[model]["field_mm"] > 2 * rows[found["recommended"]]["field_mm"] for model in worse
    )
    assert (
        found["reason"].startswith(rows[found["recommended"]]["title"])
        and found["reason"].count(".") >= 1
    )


def test_a_fisheye_without_terms_is_a_lens_all_the_same():
    """An equidistant lens has no numbers of its own and still bends every border."""
    found = model_choice.compare(
        clicks("strong"), FIELD, REGION, SIZE, ("fisheye", "homography")
    ).ranking
    assert not found["no_significant_distortion"]
    assert found["recommended"] == "fisheye"
