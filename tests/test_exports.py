"""Every export format: written, read back where it can be, and the remap table used the way the manual shows."""

import io
import json

import cv2
import numpy as np
import pytest
from worlds import plain_field, seen

from app import pipeline
from app.correction import correction_map
from app.errors import BadInput, TouchlineError
from app.exports import EXPORTS
from app.models import field_from_raw, parameters_json
from app.models.polynomial import Polynomial
from app.records import Calibration

MODEL = next(iter(Polynomial.examples()))


def calibration() -> Calibration:
    field = plain_field(MODEL.region)
    observations = seen(MODEL, MODEL.region, 9)
    made = pipeline.calibrate(observations, field, MODEL.region, MODEL.image_size)
    return Calibration("c0ffee", 3, "north", field.to_json(), MODEL.region.name, MODEL.region.rotate_deg, "polynomial",
                       parameters_json(made.model), MODEL.image_size, made.model.corrected_size,
                       tuple(o.to_json() for o in observations), {}, made.report, "2026-01-01T00:00:00+00:00",
                       "0.1.0", snapshot="5eed", image_sha256="00" * 32, note="after the lens was knocked")


@pytest.mark.parametrize("name", list(EXPORTS))
def test_it_follows_the_contract(name):
    export = EXPORTS[name]
    assert name == export.NAME and export.TITLE and "/" in export.MEDIA_TYPE and export.SUFFIX.startswith(".")
    assert isinstance(export.write(calibration()), bytes)


@pytest.mark.parametrize("name", [n for n in EXPORTS if hasattr(EXPORTS[n], "read")])
def test_what_was_written_is_read_back(name):
    original = calibration()
    read = EXPORTS[name].read(EXPORTS[name].write(original))
    assert json.dumps(read.to_json(), sort_keys=True) == json.dumps(original.to_json(), sort_keys=True)


@pytest.mark.parametrize("name", [n for n in EXPORTS if hasattr(EXPORTS[n], "read")])
@pytest.mark.parametrize("spoil", [lambda d: d[:len(d) // 2], lambda d: b"", lambda d: b"[]", lambda d: b"\xff\xfe" + d,
                                   lambda d: b"[" * 100_000, lambda d: d.replace(b'_lens_pct": 3.0', b'_lens_pct": 1e999'),
                                   lambda d: d.replace(b'"width_px": ', b'"width_px": -'),
                                   lambda d: d.replace(b"780", b"NaN"), lambda d: b" " * (5 << 20)])
def test_a_spoilt_file_is_refused_with_a_fix(name, spoil):
    written = EXPORTS[name].write(calibration())
    assert spoil(written) != written
    with pytest.raises(TouchlineError) as refusal:
        EXPORTS[name].read(spoil(written))
    assert isinstance(refusal.value, BadInput) and refusal.value.fix


def test_the_remap_table_corrects_a_picture_with_numpy_and_opencv_alone():
    picture = np.random.default_rng(0).integers(0, 255, (580, 780, 3), np.uint8)
    table = np.load(io.BytesIO(EXPORTS["npz"].write(calibration())), allow_pickle=False)
    corrected = cv2.remap(picture, table["raw_x"], table["raw_y"], cv2.INTER_LINEAR)
    model = Polynomial.from_parameters(calibration().model_parameters)
    ours = correction_map(model).apply_exactly(picture)
    inside = np.isfinite(table["raw_x"]) & (table["raw_x"] > 1) & (table["raw_x"] < 778) & (table["raw_y"] > 1) & (
        table["raw_y"] < 578)
    np.testing.assert_array_equal(corrected[inside], ours[inside])
    column, row = 13, 29
    pixel = np.array([table["grid_x"][column], table["grid_y"][row]], float)
    np.testing.assert_allclose(table["field_mm"][row, column], field_from_raw(model, pixel), atol=1e-2)
    assert json.loads(str(table["about"]))["camera"] == "north"
