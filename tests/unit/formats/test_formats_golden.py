"""What others read of us does not change by accident: every golden file is written as it was, and read as it was."""

import re
from pathlib import Path

import numpy as np
import pytest

from tests.golden.make import cases, path
from tests.support.exported import LENS_FORMATS, OF_LEAGUE, example, model_of, seen_places
from touchline.core.records import Calibration
from touchline.formats import FORMATS
from touchline.formats.vision_processor_start import AreaCorners
from touchline.models import raw_from_field
from touchline.models.contract import RECTANGLE_FIELDS
from touchline.ssl_protocol.protobuf import decode
from touchline.ssl_protocol.ssl_vision_pb2 import SSL_WrapperPacket
from touchline.workflows import interchange

CASES = cases()
NUMBER = re.compile(r"-?[0-9]+\.[0-9]+(?:e[+-]?[0-9]+)?")


def test_there_is_a_golden_file_of_everything_and_of_nothing_else():
    golden = Path(path("json", "ssl", 0)).parents[1]
    kept = {file for format in FORMATS for file in (golden / format).rglob("*") if file.is_file()}
    assert kept == {path(*case) for case in CASES}
    assert {format for format, _, _ in CASES} == {name for name in FORMATS if FORMATS[name].read}


@pytest.mark.parametrize("format, name, index", CASES)
def test_it_is_written_as_it_was(format, name, index):
    """Word by word; numbers to what another processor's cosine may change."""
    now, then = (
        interchange.export(example(name, index), format).data,
        path(format, name, index).read_bytes(),
    )
    if format == "ssl-vision":
        ours, theirs = (
            decode(SSL_WrapperPacket, now).geometry,
            decode(SSL_WrapperPacket, then).geometry,
        )
        assert ours.field == theirs.field
        now, then = (
            {f.name: value for f, value in one.calib[0].ListFields()} for one in (ours, theirs)
        )
        assert now == pytest.approx(then, rel=1e-6, abs=1e-9)
        return
    ours, theirs = now.decode(), then.decode()
    assert NUMBER.sub("#", ours) == NUMBER.sub("#", theirs)
    np.testing.assert_allclose(
        np.array(NUMBER.findall(ours), float),
        np.array(NUMBER.findall(theirs), float),
        rtol=1e-6,
        atol=1e-6,
    )


@pytest.mark.parametrize("format, name, index", CASES)
def test_it_is_read_as_it_was(format, name, index):
    file = path(format, name, index)
    read = interchange.read_file(file.read_bytes())
    model = model_of(name, index)
    if format in LENS_FORMATS:
        assert read.program == format
        camera = read.camera({key: getattr(model, key) for key in RECTANGLE_FIELDS})
        places = seen_places(model, 150.0)
        np.testing.assert_allclose(
            camera.project(places),
            model.project(places),
            atol=2e-3 if format in OF_LEAGUE else 1e-6,
        )
    elif isinstance(read, AreaCorners):
        region = model.region
        np.testing.assert_allclose(
            [o.points[0] for o in read.observations(region)],
            raw_from_field(model, np.array([o.feature for o in read.observations(region)])),
            atol=0.06,
        )
    elif isinstance(read, Calibration):
        assert read.id == "c0ffee" and read.model_name == name
    else:
        assert len(read) == 25 * 19
