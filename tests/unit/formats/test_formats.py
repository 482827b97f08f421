"""Every export format: what it holds is read back, what it cannot hold is refused or approximated with its error."""

import io
import json
from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest

from tests.support.examples import plain_examples
from tests.support.exported import (
    EXAMPLES,
    LENS_FORMATS,
    OF_LEAGUE,
    RAY_EXAMPLES,
    READABLE,
    example,
    field_around,
    model_of,
    of_model,
    seen_places,
)
from tests.support.fields import seen
from tests.support.pictures import remapped_exactly
from tests.support.tiers import long
from touchline.core.errors import BadInput, Conflict, TouchlineError
from touchline.core.field import Region
from touchline.core.field_json import field_from_json
from touchline.core.geometry import ImageSize
from touchline.core.records import Calibration, Observation
from touchline.formats import FORMATS, Format, camera_file
from touchline.formats.approximation import exact_camera
from touchline.formats.camera_file import CameraFile
from touchline.imaging.correction import correction_map
from touchline.models import MODELS, RayModel, field_from_raw, model_from_json, parameters_json
from touchline.models.contract import RECTANGLE_FIELDS
from touchline.models.polynomial import Polynomial
from touchline.models.ray_camera import BrownConrady
from touchline.workflows import interchange
from touchline.workflows.calibration import calibrate

MODEL = plain_examples("polynomial")[0]


@cache
def calibration() -> Calibration:
    field = field_around(MODEL.region)
    observations = seen(MODEL, MODEL.region, 9)
    made = calibrate(observations, field, MODEL.region, MODEL.image_size)
    return Calibration(
        "c0ffee",
        3,
        "north",
        field.to_json(),
        MODEL.region.name,
        MODEL.region.rotate_deg,
        "polynomial",
        parameters_json(made.model),
        MODEL.image_size,
        made.model.corrected_size,
        tuple(o.to_json() for o in observations),
        {},
        made.report,
        "2026-01-01T00:00:00+00:00",
        "0.1.0",
        snapshot="5eed",
        image_sha256="00" * 32,
        note="after the lens was knocked",
    )


def holds(format: str, name: str, index: int) -> bool:
    kind = FORMATS[format]
    return exact_camera(model_of(name, index), kind.lenses, kind.square_pixels) is not None


def camera_in(data: bytes, name: str, index: int):
    """What our reader makes of the file, with the rectangle of the example."""
    found = interchange.read_file(data)
    assert isinstance(found, CameraFile)
    return found.camera({key: getattr(model_of(name, index), key) for key in RECTANGLE_FIELDS})


HELD = [(f, *e) for f in LENS_FORMATS for e in EXAMPLES if holds(f, *e)]
NOT_HELD = [(f, *e) for f in LENS_FORMATS for e in EXAMPLES if not holds(f, *e)]
FIRST = {each[:2]: each for each in reversed(NOT_HELD)}  # of every format and model
NEAREST = [each if each is FIRST[each[:2]] else long(*each) for each in NOT_HELD]


@pytest.mark.parametrize("name", list(FORMATS))
def test_it_follows_the_contract(name):
    export = FORMATS[name]
    assert export.title and "/" in export.media_type and export.suffix.startswith(".")
    assert export.holds.endswith(".")
    assert isinstance(export, Format) and (export.read or not export.lenses)
    # a camera file of another program is read by one reader, which recognises it itself
    assert (export.recognises is not None) == (export.read not in (None, camera_file.read))
    assert all(
        set(terms) <= set(MODELS[model].LENS.TERMS) for model, terms in export.lenses.items()
    )


def test_every_format_holds_some_example_and_every_lens_model_is_held_by_some_format():
    assert {f for f, _, _ in HELD} == set(LENS_FORMATS)
    assert {n for _, n, _ in HELD} >= {"brown-conrady", "fisheye", "ssl"}


@pytest.mark.parametrize("format, name, index", HELD)
def test_what_a_format_holds_is_projected_alike_when_it_is_read_back(format, name, index):
    made = interchange.export(example(name, index), format)
    model, back = model_of(name, index), camera_in(made.data, name, index)
    for z in (0.0, 150.0):
        off = np.abs(
            back.project(seen_places(model, z)) - model.project(seen_places(model, z))
        ).max()
        # floats of four bytes: a thousandth of a pixel
        assert off < (1e-6 if made.loss is None else 2e-3)
    if format in OF_LEAGUE:
        assert 0 < made.loss.worst_mm < 0.01 and made.loss.hat_worst_mm < 0.01
    else:
        assert made.loss is None


@pytest.mark.parametrize("format, name, index", NOT_HELD)
def test_what_a_format_cannot_hold_is_refused_with_what_to_do(format, name, index):
    with pytest.raises(Conflict) as refusal:
        interchange.export(example(name, index), format)
    assert refusal.value.reason == "format-cannot-hold" and "approximate=true" in refusal.value.fix


@pytest.mark.parametrize("format, name, index", NEAREST)
def test_the_nearest_that_a_format_can_hold_errs_by_what_it_says(format, name, index):
    made = interchange.export(example(name, index), format, approximate=True)
    model, back = model_of(name, index), camera_in(made.data, name, index)
    error = np.linalg.norm(
        back.unproject(pixels := _pixels(model)) - field_from_raw(model, pixels), axis=1
    )
    assert np.isfinite(error).all()
    # other places than those that the figure is from: a little more is possible between them
    assert error.max() <= made.loss.worst_mm * 1.1 + 1e-3
    assert error.max() >= made.loss.rms_mm * 0.5 - 1e-3
    # not a wrong sign: that is hundreds
    assert made.loss.worst_mm < (40 if name == "polynomial" else 18)
    if isinstance(model, RayModel):
        flat = seen_places(model, made.loss.hat_height_mm)
        hats = np.linalg.norm(
            back.unproject(model.project(flat), made.loss.hat_height_mm) - flat[:, :2], axis=1
        )
        assert hats.max() <= made.loss.hat_worst_mm * 1.1 + 1e-3
        # fitted to both, not to the carpet alone
        assert made.loss.hat_rms_mm < 1.3 * made.loss.rms_mm + 0.02
    else:
        assert made.loss.hat_worst_mm is None
    if format not in ("ssl-vision", "photonvision"):
        assert f"largest error {made.loss.worst_mm:.3f} mm" in made.data.decode()


def _pixels(model):
    """(n, 2) px of the region that the picture shows."""
    u, v = np.meshgrid(
        *(np.linspace(0.02, 0.98, 14) * s for s in (model.region.width_mm, model.region.height_mm))
    )
    field = model.region.field_from_region(np.stack([u, v], -1).reshape(-1, 2))
    pixels = model.raw_from_corrected(model.corrected_from_field(field))
    inside = ((pixels > -0.5) & (pixels < np.array(tuple(model.image_size)) - 0.5)).all(axis=1)
    return pixels[inside]


def test_square_pixels_are_refused_by_name_and_approximated():
    tall = of_model(replace(model_of("ssl", 0), aspect=1.01))
    with pytest.raises(Conflict, match="not square"):
        interchange.export(tall, "ssl-vision")
    made = interchange.export(tall, "ssl-vision", approximate=True)
    assert 1 < made.loss.worst_mm < 40  # a hundredth of the picture's height, shared out


@pytest.mark.parametrize("name, index", RAY_EXAMPLES)
def test_the_list_of_formats_says_the_same_as_the_exports(name, index):
    told = {f["format"]: f for f in interchange.formats(example(name, index))}
    assert list(told) == list(FORMATS)
    for format in LENS_FORMATS:
        assert (
            told[format]["exact"] == holds(format, name, index) and told[format]["problem"] is None
        )
        loss = interchange.export(example(name, index), format, approximate=True).loss
        assert told[format]["loss"] == (None if loss is None else loss.to_json())
    assert told["npz"]["exact"] and not told["npz"]["reads"] and told["csv"]["reads"]


def test_json_is_read_back_whole():
    original = calibration()
    read = interchange.read_file(FORMATS["json"].write(original))
    assert json.dumps(read.to_json(), sort_keys=True) == json.dumps(
        original.to_json(), sort_keys=True
    )


def test_points_are_read_back_as_they_were_clicked():
    original = replace(
        calibration(),
        observations=(
            *calibration().observations,
            Observation((1200.5, -300.0), "landmark", np.array([[10.25, 20.5]])).to_json(),
            Observation(
                "centre-line", "line", np.array([[1 / 3, 2.0], [3.0, 4.0]]), 150.0
            ).to_json(),
        ),
    )
    data = FORMATS["csv"].write(original)
    assert [o.to_json() for o in interchange.read_file(data)] == list(original.observations)
    assert (
        len(data.splitlines()) == 1 + sum(len(o["points"]) for o in original.observations) + 25 * 19
    )


def test_a_table_without_clicks_is_read_as_landmarks_all_over_the_region():
    model = model_of("brown-conrady", 0)
    read = interchange.read_file(FORMATS["csv"].write(of_model(model)))
    place, pixel = np.array([read[7].feature]), read[7].points
    np.testing.assert_allclose(model.project(np.append(place, [[0]], 1)), pixel, atol=1e-6)
    assert len(read) == 25 * 19 and all(o.kind == "landmark" for o in read)


SPOILT = [
    lambda d: d[: len(d) // 2],
    lambda d: b"",
    lambda d: b"[]",
    lambda d: b"\xff\xfe" + d,
    lambda d: b"[" * 100_000,
    lambda d: b"{" * 100_000,
    lambda d: b"\x00" + d,
    lambda d: b" " * (5 << 20),
]


@pytest.mark.parametrize(
    ("name", "spoil"),
    [
        (name, spoil)
        for name in READABLE
        for spoil in SPOILT
        # half a table is a table
        if (name, spoil) != ("csv", SPOILT[0])
    ],
)
def test_a_spoilt_file_is_refused_with_a_fix(name, spoil):
    model = ("ssl", 0) if name in OF_LEAGUE else ("brown-conrady", 0)
    written = interchange.export(example(*model), name).data
    assert spoil(written) != written
    with pytest.raises(TouchlineError) as refusal:
        FORMATS[name].read(spoil(written))
    assert isinstance(refusal.value, BadInput) and refusal.value.fix


@pytest.mark.parametrize(
    "spoil",
    [
        lambda d: d.replace(b'_lens_pct": 3.0', b'_lens_pct": 1e999'),
        lambda d: d.replace(b'"width_px": ', b'"width_px": -'),
        lambda d: d.replace(b"780", b"NaN"),
    ],
)
def test_our_own_file_with_a_wrong_number_is_refused(spoil):
    written = FORMATS["json"].write(calibration())
    assert spoil(written) != written
    with pytest.raises(BadInput):
        FORMATS["json"].read(spoil(written))


def test_the_remap_table_corrects_a_picture_with_numpy_and_opencv_alone():
    picture = np.random.default_rng(0).integers(0, 255, (580, 780, 3), np.uint8)
    table = np.load(io.BytesIO(FORMATS["npz"].write(calibration())), allow_pickle=False)
    corrected = cv2.remap(picture, table["raw_x"], table["raw_y"], cv2.INTER_LINEAR)
    model = Polynomial.from_parameters(calibration().model_parameters)
    ours = remapped_exactly(correction_map(model), picture)
    inside = (
        np.isfinite(table["raw_x"])
        & (table["raw_x"] > 1)
        & (table["raw_x"] < 778)
        & (table["raw_y"] > 1)
        & (table["raw_y"] < 578)
    )
    np.testing.assert_array_equal(corrected[inside], ours[inside])
    column, row = 13, 29
    pixel = np.array([table["grid_x"][column], table["grid_y"][row]], float)
    np.testing.assert_allclose(
        table["field_mm"][row, column], field_from_raw(model, pixel), atol=1e-2
    )
    assert json.loads(str(table["about"]))["camera"] == "north"


@pytest.mark.parametrize("format, name, index", [h for h in HELD if h[0] != "ssl-vision"])
def test_a_file_that_is_imported_is_the_same_camera_over_the_same_region(format, name, index):
    original = example(name, index)
    field = {"plain": field_from_json(original.field)}
    found = interchange.read_file(interchange.export(original, format).data)
    back = interchange.calibration_from_file(found, interchange.ImportOptions(), field)
    assert (back.region, back.rotate, back.camera, back.image_size) == (
        original.region,
        original.rotate,
        "north",
        original.image_size,
    )
    assert (
        back.corrected_size == original.corrected_size
        and back.report["verdict"]["level"] == "unknown"
    )
    model, other = model_of(name, index), model_from_json(back.model_name, back.model_parameters)
    flat = seen_places(model, 150.0)
    atol = 1e-3 if format in OF_LEAGUE else 1e-6
    np.testing.assert_allclose(other.project(flat), model.project(flat), atol=atol)
    pixels = _pixels(model)
    np.testing.assert_allclose(
        other.corrected_from_raw(pixels), model.corrected_from_raw(pixels), atol=atol
    )


def test_a_place_at_the_very_end_of_a_lens_makes_no_error_infinite():
    """The far corner lies where the lens folds back: written and read, it is on one side or the other of that."""
    region = Region("corner", (0.0, 3025.0), (0.0, 2025.0), 180)
    terms = (
        0.27341522555560455,
        -2.0664203962135934,
        -0.002933045311720396,
        1.4783583102005027e-05,
        -4.888251678968877,
        0.0,
        0.0,
        0.0,
    )
    model = BrownConrady(
        terms,
        811.1558458798219,
        1.0004198026769184,
        (388.36112400731434, 259.9904033303603),
        (-0.00018047405513214003, 3.1361062677204408, 0.059040759806470146),
        (1534.2957428607692, 837.3090857253, 3628.738155830111),
        780.0,
        522.0,
        10,
        7,
        region,
        ImageSize(780, 580),
    )
    rows = {row["format"]: row for row in interchange.formats(of_model(model))}
    json.dumps(rows, allow_nan=False)
    assert (
        rows["opencv"]["exact"]
        and rows["opencv"]["loss"] is None
        and rows["opencv"]["problem"] is None
    )
