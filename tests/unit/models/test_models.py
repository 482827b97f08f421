"""The laws of camera models, over every example of every model in the table."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from tests.support.examples import examples
from tests.support.fields import grid, marks_seen, plain_field, seen
from touchline.core.errors import BadInput, FitFailed, NotFound, TouchlineError
from touchline.core.field import QUARTER_TURNS
from touchline.core.geometry import ImageSize
from touchline.core.options import Option, read_options
from touchline.core.quarter_turn import QuarterTurn
from touchline.core.records import Observation
from touchline.fitting import FITTERS
from touchline.models import (
    MODELS,
    CameraModel,
    RayModel,
    field_from_raw,
    model_from_json,
    parameters_json,
    raw_from_field,
)
from touchline.models.rotation import vector_from_matrix

EXAMPLES = [
    pytest.param(model, id=f"{name}-{i}")
    for name in MODELS
    for i, model in enumerate(examples(name))
]
every_example = pytest.mark.parametrize("model", EXAMPLES)
every_turnable = pytest.mark.parametrize(
    "model",
    [
        *EXAMPLES,
        *(  # pixels that are not square, and a centre out of the middle, tell a wrong turn from a right one
            pytest.param(
                replace(model, aspect=1.04, centre_px=(600.0, 540.0)), id=f"{name}-{i}-askew"
            )
            for name in MODELS
            if issubclass(MODELS[name], RayModel)
            for i, model in enumerate(examples(name))
        ),
    ],
)
every_fitted_model = pytest.mark.parametrize(
    "model_class", [pytest.param(MODELS[n], id=n) for n in FITTERS]
)
every_fitted_example = pytest.mark.parametrize(
    "model",
    [
        pytest.param(model, id=f"{name}-{i}")
        for name in FITTERS
        for i, model in enumerate(examples(name))
    ],
)


def own_options(model) -> dict:
    """What makes a fit look for just this example: its own degrees and rectangles."""
    if isinstance(model, RayModel):
        chosen = {
            "terms": [n for n, t in zip(model.LENS.TERMS, model.lens_terms, strict=True) if t]
        }
        has_terms = any(o.name == "terms" for o in FITTERS[model.NAME].OPTIONS)
        return {
            **(chosen if has_terms else {}),
            "click_sigma_px": 0.01,
            "height_mm": {"value": model.position_mm[2], "sigma": 1.0},
            "n_rectangles_x": model.n_rectangles_x,
            "n_rectangles_y": model.n_rectangles_y,
            **{
                f"{a}_max_rectangle_px": getattr(model, side) / getattr(model, f"n_rectangles_{b}")
                for a, side, b in (("w", "width_px", "x"), ("h", "height_px", "y"))
            },
        }
    if model.NAME != "polynomial":
        return {}
    return {
        "degree": {
            side: getattr(model, side).degree for side in ("left", "right", "top", "bottom")
        },
        "relation_degree": len(model.down_mm) - 1,
        "n_rectangles_x": model.n_rectangles_x,
        "n_rectangles_y": model.n_rectangles_y,
        "w_max_rectangle_px": model.width_px / model.n_rectangles_x,
        "h_max_rectangle_px": model.height_px / model.n_rectangles_y,
    }


def raw_grid(model):
    """Return pixels (9, 12, 2) over the whole raw picture, its corners too."""
    width, height = model.image_size
    x, y = np.linspace(-0.5, width - 0.5, 12), np.linspace(-0.5, height - 0.5, 9)
    return np.stack(np.meshgrid(x, y), axis=-1)


def corrected_grid(model):
    return grid(model.corrected_size.width - 1, model.corrected_size.height - 1)


@every_example
def test_it_follows_the_contract(model):
    assert isinstance(model, CameraModel)
    assert MODELS[model.NAME] is type(model)
    assert model.TITLE and model.HELP
    assert model.NAME not in FITTERS or all(
        isinstance(o, Option) and o.help for o in FITTERS[model.NAME].OPTIONS
    )


@every_example
def test_there_and_back_is_the_same_pixel(model):
    corrected = corrected_grid(model)
    raw = model.raw_from_corrected(corrected)
    assert np.isfinite(raw).all()
    np.testing.assert_allclose(model.corrected_from_raw(raw), corrected, atol=1e-6)
    middle = raw.reshape(-1, 2).mean(axis=0) + np.array([[0.0, 0.0], [1e-3, -1e-3], [0.5, 0.25]])
    np.testing.assert_allclose(
        model.raw_from_corrected(model.corrected_from_raw(middle)), middle, atol=1e-6
    )


@every_example
def test_there_and_back_is_the_same_place_on_the_carpet(model):
    corrected = corrected_grid(model)
    field = model.field_from_corrected(corrected)
    np.testing.assert_allclose(model.corrected_from_field(field), corrected, atol=1e-6)
    np.testing.assert_allclose(
        field_from_raw(model, raw_from_field(model, field)), field, atol=1e-5
    )


@every_example
@pytest.mark.parametrize("shape", [(2,), (1, 2), (0, 2), (3, 2), (4, 5, 2)])
def test_the_shape_of_the_points_is_kept(model, shape):
    points = np.full(shape, 200.0)
    for mapping in (
        model.corrected_from_raw,
        model.raw_from_corrected,
        model.field_from_corrected,
        model.corrected_from_field,
    ):
        assert mapping(points).shape == shape


@every_example
def test_a_point_out_of_reach_is_nan_not_a_guess(model):
    for far in ([1e9, 1e9], [np.nan, 5.0], [5.0, np.inf], [-np.inf, np.nan]):
        for mapping in (model.corrected_from_raw, model.raw_from_corrected):
            there = mapping(np.array([far]))
            assert np.isnan(there).all() or np.isfinite(there).all()
    assert np.isnan(
        model.corrected_from_raw(np.array([[np.nan, 5.0], [5.0, np.inf], [1e9, 1e9]]))
    ).all()
    assert np.isnan(
        model.raw_from_corrected(np.array([[np.nan, 5.0], [5.0, np.inf], [1e9, 1e9]]))
    ).all()


@pytest.mark.parametrize("name", [name for name in MODELS if issubclass(MODELS[name], RayModel)])
def test_what_a_camera_sees_above_the_horizon_is_nowhere_on_the_carpet(name):
    # level, along x
    ahead = vector_from_matrix(np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]))
    model = replace(examples(name)[2], rotation=tuple(map(float, ahead)))
    x, y = model.centre_px
    below, above = model.unproject(np.array([[x, y + 200.0], [x, y - 200.0]]))
    assert below[0] > model.position_mm[0] and np.isnan(above).all()


@every_example
def test_parameters_survive_json_exactly(model):
    text = json.dumps(parameters_json(model), allow_nan=False)
    assert model_from_json(model.NAME, json.loads(text)) == model


@every_example
@pytest.mark.parametrize(
    "spoil",
    [
        lambda p: p.popitem(),
        lambda p: p.update(extra=1),
        lambda p: p.clear(),
        lambda p: p.update({next(iter(p)): None}),
        lambda p: p.update({next(iter(p)): float("nan")}),
    ],
)
def test_spoilt_parameters_are_refused(model, spoil):
    parameters = parameters_json(model)
    spoil(parameters)
    with pytest.raises(BadInput) as refusal:
        model_from_json(model.NAME, parameters)
    assert refusal.value.fix


@every_example
def test_any_single_spoilt_number_is_refused_or_harmless(model):
    """inf, NaN and giants in any place of the parameters are refused."""

    def places(value, path=()):
        if isinstance(value, dict):
            return [p for k, v in value.items() for p in places(v, (*path, k))]
        if isinstance(value, list):
            return [p for k, v in enumerate(value) for p in places(v, (*path, k))]
        return [path] if isinstance(value, (int, float)) else []

    for path in places(parameters_json(model)):
        for bad in (float("inf"), float("nan"), 1e308, -1e308, "x", None):
            parameters = parameters_json(model)
            inner = parameters
            for key in path[:-1]:
                inner = inner[key]
            inner[path[-1]] = bad
            try:
                spoilt = model_from_json(model.NAME, parameters)
            except TouchlineError:
                continue
            pytest.fail(f"{path} = {bad} was accepted: {spoilt}")


@every_fitted_example
def test_a_fit_on_its_own_exact_points_returns_itself(model):
    field = plain_field(model.region)
    observations = (*seen(model, model.region, 11), *marks_seen(model, field))
    fit = FITTERS[model.NAME].fit(
        observations, field, model.region, model.image_size, own_options(model)
    )
    assert all(fine.all() for fine in fit.inliers)
    corrected = corrected_grid(model)
    # What is known of cameras pulls a lens by less than the noise that the options tell, 0.01 px.
    pulled = isinstance(model, RayModel)
    np.testing.assert_allclose(
        fit.model.raw_from_corrected(corrected),
        model.raw_from_corrected(corrected),
        atol=2e-3 if pulled else 1e-6,
    )
    np.testing.assert_allclose(
        fit.model.field_from_corrected(corrected), model.field_from_corrected(corrected), atol=1e-5
    )


@every_fitted_example
def test_a_scaled_image_gives_the_scaled_model(model):
    field, scale = plain_field(model.region), 2.0
    options = own_options(model)
    observations = (*seen(model, model.region, 11), *marks_seen(model, field))
    larger = tuple(replace(o, points=scale * (o.points + 0.5) - 0.5) for o in observations)
    size = ImageSize(*(round(scale * n) for n in model.image_size))
    small = (
        FITTERS[model.NAME].fit(observations, field, model.region, model.image_size, options).model
    )
    large = FITTERS[model.NAME].fit(larger, field, model.region, size, options).model
    raw = small.raw_from_corrected(corrected_grid(small))
    np.testing.assert_allclose(
        field_from_raw(large, scale * (raw + 0.5) - 0.5),
        field_from_raw(small, raw),
        atol=0.02 if isinstance(model, RayModel) else 1e-5,
    )


@every_turnable
@pytest.mark.parametrize("turn_deg", QUARTER_TURNS)
def test_a_turned_pixel_of_the_turned_model_is_the_same_place(model, turn_deg):
    turned, turn = model.turned(turn_deg), QuarterTurn(turn_deg, model.image_size)
    pixels = raw_grid(model)
    x, y = pixels[..., 0], pixels[..., 1]
    width, height = model.image_size
    there = {
        0: (x, y),
        90: (height - 1 - y, x),
        180: (width - 1 - x, height - 1 - y),
        270: (y, width - 1 - x),
    }[turn_deg]
    turned_pixels = np.stack(there, axis=-1)
    np.testing.assert_array_equal(turn.points(pixels), turned_pixels)
    assert turned.image_size == (ImageSize(height, width) if turn_deg % 180 else model.image_size)
    places = field_from_raw(model, pixels)
    assert np.isfinite(places).all(axis=-1).mean() > 0.5
    # far places lie near the horizon, where rounding in the picture counts for more
    np.testing.assert_allclose(field_from_raw(turned, turned_pixels), places, rtol=1e-10, atol=1e-6)
    # out to where the reach of a model ends
    around = grid(3.7 * width, 3.7 * height, 60, 60) - 1.35 * np.array([width, height])
    np.testing.assert_array_equal(
        np.isnan(field_from_raw(turned, turn.points(around))),
        np.isnan(field_from_raw(model, around)),
    )
    if isinstance(model, RayModel):
        np.testing.assert_allclose(
            turned.unproject(turned_pixels, 150.0),
            model.unproject(pixels, 150.0),
            rtol=1e-10,
            atol=1e-6,
        )
    assert model_from_json(turned.NAME, json.loads(json.dumps(parameters_json(turned)))) == turned


@every_turnable
@pytest.mark.parametrize("turn_deg", QUARTER_TURNS)
def test_a_turned_model_draws_the_same_corrected_picture(model, turn_deg):
    turned, corrected = model.turned(turn_deg), corrected_grid(model)
    assert (turned.region, turned.corrected_size) == (model.region, model.corrected_size)
    raw = QuarterTurn(turn_deg, model.image_size).points(model.raw_from_corrected(corrected))
    np.testing.assert_allclose(turned.raw_from_corrected(corrected), raw, atol=1e-8)
    by_grid = turned.raw_from_corrected_grid(corrected[0, :, 0], corrected[:, :1, 1])
    np.testing.assert_allclose(np.stack(by_grid, axis=-1), raw, atol=1e-8)


@every_turnable
def test_four_quarter_turns_are_none(model):
    around = model
    for _ in range(4):
        around = around.turned(90)
    pixels = raw_grid(model)
    assert around.image_size == model.image_size
    np.testing.assert_allclose(
        field_from_raw(around, pixels), field_from_raw(model, pixels), rtol=1e-10, atol=1e-6
    )
    as_numbers = json.dumps(parameters_json(model)), json.dumps(parameters_json(around))
    first, second = (np.array(re.findall(r"-?[0-9][0-9.e+-]*", text), float) for text in as_numbers)
    np.testing.assert_allclose(second, first, rtol=1e-9, atol=1e-12)


def test_a_model_turns_by_quarters_alone():
    for name in MODELS:
        with pytest.raises(BadInput, match="45") as refusal:
            examples(name)[0].turned(45)
        assert refusal.value.reason == "bad-turn"
    turned = parameters_json(examples("polynomial")[0].turned(90))
    for wrong in (45, -90, 90.5, "90", True, None):
        with pytest.raises(BadInput):
            model_from_json("polynomial", {**turned, "turn_deg": wrong})


@every_fitted_model
def test_too_few_points_say_how_many_are_needed(model_class):
    model = examples(model_class.NAME)[0]
    field = plain_field(model.region)
    one = Observation("left", "line", np.array([[100.0, 100.0]]))
    for observations in ((), (one,)):
        with pytest.raises(FitFailed) as refusal:
            FITTERS[model_class.NAME].fit(observations, field, model.region, model.image_size)
        assert refusal.value.fix
    assert any(c.isdigit() for c in FITTERS[model_class.NAME].points_needed())


def test_an_unknown_model_lists_the_known_ones():
    with pytest.raises(NotFound, match="polynomial") as refusal:
        MODELS["pinhole"]
    assert refusal.value.reason == "unknown-camera-model"


@pytest.mark.parametrize(
    "name, value",
    [
        ("degree", 0),
        ("degree", 9),
        ("degree", 2.5),
        ("degree", "cubic"),
        ("degree", True),
        ("degree", float("nan")),
        ("robust", 1),
        ("w_max_rectangle_px", float("inf")),
        ("n_rectangles_x", -1),
    ],
)
def test_an_option_out_of_range_is_refused_with_what_is_allowed(name, value):
    with pytest.raises(BadInput, match=name) as refusal:
        read_options(FITTERS["polynomial"].OPTIONS, {name: value})
    assert refusal.value.fix.startswith("Use")


def test_an_unknown_option_is_refused_by_name():
    with pytest.raises(BadInput, match="degre"):
        read_options(FITTERS["polynomial"].OPTIONS, {"degre": 3})
