"""export and import from a shell: the same files as over REST, what they cost, and exit codes for scripts."""

import json
import os

import pytest

from tests.support.exported import OF_LEAGUE, example, model_of, of_model
from tests.unit.formats.test_imports import KALIBR
from touchline.formats import FORMATS
from touchline.store.fields import load_fields


@pytest.fixture
def cal(tmp_path):
    """Write an example as a calibration file: its name."""

    def write(name: str, index: int) -> str:
        (tmp_path / "cal.json").write_bytes(FORMATS["json"].write(example(name, index)))
        return "cal.json"

    return write


def test_formats_are_listed_with_what_each_costs(touchline, cal):
    code, out, _ = touchline("export", cal("brown-conrady", 0))
    lines = {line.split()[0]: line for line in out.splitlines()}
    assert code == 0 and list(lines) == list(FORMATS)
    assert (
        " exact. " in lines["opencv"]
        and "largest error 4.676 mm on the carpet, 6.400 mm" in lines["ssl-vision"]
    )
    assert "with --approximate" in lines["ssl-vision"] and "--approximate" not in lines["mrcal"]


@pytest.mark.parametrize("format", list(FORMATS))
def test_every_format_is_written(touchline, cal, tmp_path, format):
    code, out, _ = touchline(
        "export", cal("brown-conrady", 0), "-f", format, "-o", "out", "--approximate"
    )
    assert code == 0 and (tmp_path / "out").stat().st_size > 100
    assert ("largest error" in out) == (format in OF_LEAGUE)


def test_what_cannot_be_held_is_refused_and_nothing_is_written(touchline, cal, tmp_path):
    code, _, err = touchline("export", cal("thin-plate", 2), "-f", "ros", "-o", "out.yaml")
    assert (
        code == 3 and "is not one" in err and "fix:" in err and not (tmp_path / "out.yaml").exists()
    )
    assert touchline("export", cal("ssl", 0), "-f", "xml", "-o", "out")[0] == 3
    assert touchline("export", cal("ssl", 0), "-f", "ros")[0] == 2  # no --output
    assert touchline("export", "none.json", "-f", "ros", "-o", "out")[0] == 4


def test_a_fifo_and_a_symbolic_link_are_written_to_and_not_replaced(touchline, cal, tmp_path):
    asked = ("export", cal("brown-conrady", 0), "-f", "opencv", "-o")
    assert touchline(*asked, "plain")[0] == 0
    written = (tmp_path / "plain").read_bytes()
    (tmp_path / "link").symlink_to("target")
    for _ in range(2):  # before there is a target, and over one
        assert touchline(*asked, "link")[0] == 0
        assert (tmp_path / "link").is_symlink() and (tmp_path / "target").read_bytes() == written
        (tmp_path / "target").write_bytes(b"old")
    os.mkfifo(tmp_path / "fifo")
    reader = os.open(tmp_path / "fifo", os.O_RDONLY | os.O_NONBLOCK)
    assert touchline(*asked, "fifo")[0] == 0
    assert os.read(reader, 1 << 20) == written and (tmp_path / "fifo").is_fifo()
    os.close(reader)
    (tmp_path / "folder").mkdir()
    assert touchline(*asked, "folder")[0] == 4


def test_a_file_of_another_program_becomes_a_lens_that_calibrate_takes(touchline, tmp_path):
    (tmp_path / "chain.yaml").write_text(KALIBR)
    code, out, _ = touchline("import", "chain.yaml", "-o", "lens.json")
    lens = json.loads((tmp_path / "lens.json").read_text())
    assert code == 0 and "--lens" in out and lens["lens"]["model"] == "fisheye"
    from touchline.cli.files import read_lens_option

    assert read_lens_option(tmp_path / "lens.json")["lens"]["focal_px"] == 461.6


def test_a_file_of_ours_becomes_a_calibration_that_transform_takes(touchline, tmp_path):
    field = load_fields()["table"]
    from dataclasses import replace

    model = replace(model_of("ssl", 0), region=field.region("full"), position_mm=(0.0, 0.0, 1700.0))
    original = replace(of_model(model), field=field.to_json(), region="full")
    (tmp_path / "cal.json").write_bytes(FORMATS["json"].write(original))
    assert (
        touchline("export", "cal.json", "-f", "ssl-vision", "-o", "north.pb", "--camera-id", "2")[0]
        == 0
    )
    code, out, err = touchline("import", "north.pb", "-o", "back.json", "--camera-id", "2")
    assert code == 0, err
    assert "ssl, 1280 × 1024 px, table, full field" in out
    asked = ("--from", "image", "--to", "field", "320.5,240", "--json")
    there, back = (
        json.loads(touchline("transform", "-c", name, *asked)[1])
        for name in ("cal.json", "back.json")
    )
    assert back["points"][0] == pytest.approx(there["points"][0], abs=0.01)
    assert touchline("import", "north.pb", "-o", "x.json", "--camera-id", "7")[0] == 3
    assert touchline("import", "north.pb", "-o", "x.json", "--image-size", "640x512")[0] == 0
    assert touchline("import", "north.pb", "-o", "x.json", "--image-size", "big")[0] == 3
