"""Files made to harm: for every reader, mutated and invented ones are read or refused, at once and with a cure."""

import time
from functools import cache

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.support.exported import OF_LEAGUE, READABLE, example
from tests.support.tiers import rounds
from tests.unit.formats.test_imports import OUTSIDE
from touchline.core.errors import TouchlineError
from touchline.formats import FORMATS
from touchline.workflows import interchange

# of processor time; one is promised and 0.2 were measured, but a loaded machine is given more
SECONDS = 5.0
SCRAPS = [
    b"",
    b"\x00",
    b"\xff\xfe",
    b"\xef\xbb\xbf",
    b"&a *a",
    b"!!python/name:os.system",
    b"<<: *x",
    b"? [",
    b"- - -",
    b"1e999",
    b"-1e308",
    b".inf",
    b"nan",
    b"9" * 400,
    b"0x7f",
    b"1_000",
    b"1:30:00",
    b"\xed\xa0\x80",
    b"%YAML 9",
    b"---\n---\n",
    b"\t",
    b"'",
    b'"',
    b"'''",
    b"\\x",
    b"{{{{",
    b"]]]]",
    b"(((",
    b"#",
    b"=cmd()",
    b";",
    b"\n\n",
]


@cache
def written(format: str) -> bytes:
    return interchange.export(
        example("ssl" if format in OF_LEAGUE else "brown-conrady", 0), format
    ).data


def harmless(read, data: bytes) -> None:
    """Read or refused, quickly; whatever it is, it is told with a cure."""
    began = time.process_time()
    try:
        read(data)
    except TouchlineError as refused:
        assert refused.what and refused.fix and refused.status < 500 and len(refused.what) < 1000
    assert time.process_time() - began < SECONDS


def all_of_it(data: bytes) -> None:
    """The way of an import, to its end."""
    found = interchange.read_file(data)
    if interchange.is_lens(found):
        interchange.lens_record_from_file(found, interchange.ImportOptions())
    elif hasattr(found, "at_size"):
        interchange.calibration_from_file(
            found, interchange.ImportOptions(field="ssl-2008"), _fields()
        )


@cache
def _fields():
    from touchline.store.fields import load_fields

    return load_fields()


def tried(examples: int):
    return settings(max_examples=examples, deadline=None, suppress_health_check=list(HealthCheck))


@rounds("examples", 20, 150)
@pytest.mark.parametrize("format", READABLE)
def test_a_mutated_file_is_read_or_refused(format, examples):
    @tried(examples)
    @given(st.data())
    def read_or_refused(data):
        text = bytearray(
            data.draw(st.sampled_from([written(format), OUTSIDE.get(format, "x").encode()]))
        )
        for _ in range(data.draw(st.integers(1, 3))):
            start = data.draw(st.integers(0, len(text)))
            end = data.draw(st.integers(start, min(len(text), start + 40)))
            text[start:end] = data.draw(st.sampled_from(SCRAPS) | st.binary(max_size=8))
        harmless(FORMATS[format].read, bytes(text))
        harmless(all_of_it, bytes(text))

    read_or_refused()


@rounds("examples", 20, 150)
@pytest.mark.parametrize("format", READABLE)
def test_anything_at_all_is_read_or_refused(format, examples):
    @tried(examples)
    @given(
        data=st.binary(max_size=300)
        | st.text(max_size=200).map(lambda t: t.encode("utf-8", "surrogatepass"))
    )
    def read_or_refused(data):
        harmless(FORMATS[format].read, data)

    read_or_refused()


@pytest.mark.parametrize("format", READABLE)
@pytest.mark.parametrize(
    "bomb",
    [
        b"[" * 1_000_000,
        b"{" * 1_000_000,
        b"(" * 1_000_000,
        b"[1," * 300_000,
        b'{"a":' * 200_000,
        b"- " * 100_000,
        b"a: &x [1]\nb: [*x,*x,*x,*x,*x,*x]\n" * 5000,
        b"9" * 1_000_000,
        b"1." + b"0" * 1_000_000,
        b"#" * 4_000_000,
        b"# x\n" * 1_000_000,
        b"\n" * 4_000_000,
        b"'" * 1_000_001,
        b"{'a': " + b"-" * 1_000_000 + b"}",
        b"{'lensmodel': 'LENSMODEL_OPENCV4', 'intrinsics': [" + b"1," * 1_000_000 + b"]}",
        b"feature,raw_x_px,raw_y_px\n" + b"left,1,1\n" * 400_000,
        b"feature,raw_x_px,raw_y_px\n" + b"," * 4_000_000,
        b"\x12\xff\xff\xff\xff\x0f" * 10_000,
        b"\x12" + b"\x80" * 60_000,
        b"\x0a\x00" * 30_000,
        b"\x08\x01" * 32_000,
        b"camera_matrix: " + b"? " * 60_000,
        b"%YAML:1.0\n---\nx: " + b"!!opencv-matrix " * 15_000,
        b'<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b "b">'
        + b"".join(b'<!ENTITY c%d "&b;&b;&b;&b;&b;&b;&b;&b;">' % i for i in range(40))
        + b"]><a>&c39;</a>",
        b'<!DOCTYPE a SYSTEM "file:///etc/passwd"><opencv_storage/>',
        b'<!DOCTYPE a PUBLIC "b" "http://127.0.0.1:9/"><opencv_storage/>',
        b"<a>" * 80_000,
        b"<a>" * 20 + b"<data>" + b"1 " * 100_000,
        b"[" + b"a." * 100_000 + b"a]\nb = 1\n",
        b"a = " + b"[" * 100_000,
        b"1 OPENCV 1 1" + b" 1" * 100_000,
        b"[image]\nwidth\n" + b"1\n" * 100_000,
        b'{"a": "' + b"A" * 4_000_000,
        b'{"a": "' + b"A" * 60_000_000 + b'"}',
        b"# touchline: " + b"[" * 8000 + b"\ncamera_name: x\n",
        b"\xff" * 1_000_000,
        b"a" * 5_000_000,
    ],
    ids=lambda b: b[:12].hex(),
)
def test_a_bomb_does_not_go_off(format, bomb):
    harmless(FORMATS[format].read, bomb)
    harmless(all_of_it, bomb)
    harmless(FORMATS[format].read, written(format) + bomb[:200_000])
