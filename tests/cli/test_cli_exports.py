"""export and import from a shell: the same files as over REST, what they cost, and exit codes for scripts."""

import json
import os

import numpy as np
import pytest

from tests.support.exported import example, model_of, of_model
from tests.unit.formats.test_imports import KALIBR
from touchline.core.geometry import ImageSize
from touchline.core.quarter_turn import QuarterTurn
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
    assert code == 0 and (tmp_path / "out").stat().st_size > 300
    assert ("largest error" in out) == (format == "ssl-vision")


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


@pytest.mark.parametrize("turn_deg", [90, 180])
def test_a_calibration_is_turned_with_its_images(touchline, cal, tmp_path, turn_deg):
    file = cal("brown-conrady", 1)
    code, out, err = touchline("turn", file, "--turn", str(turn_deg), "-o", "new.json")
    assert code == 0, err
    assert "turned by" in out and ("1024 × 1280" in out) == (turn_deg == 90)
    made = json.loads((tmp_path / "new.json").read_text())
    assert made["note"].startswith("Version 3, turned by")
    turned = QuarterTurn(turn_deg, ImageSize(1280, 1024)).points(np.array([320.5, 240.0]))
    asked = ("--from", "image", "--to", "field", "--z", "150", "--json")
    there, back = (
        json.loads(touchline("transform", "-c", name, *asked, f"{x!r},{y!r}")[1])
        for name, (x, y) in ((file, (320.5, 240.0)), ("new.json", turned.tolist()))
    )
    assert back["points"][0] == pytest.approx(there["points"][0], abs=1e-6)
    # the same on the way in
    assert touchline("import", file, "-o", "in.json", "--turn", str(turn_deg))[0] == 0
    read = json.loads((tmp_path / "in.json").read_text())
    assert read["model"] == made["model"] and "The file was turned by" in read["note"]


def test_a_lens_is_turned_with_its_images(touchline, tmp_path):
    (tmp_path / "chain.yaml").write_text(KALIBR)
    assert touchline("import", "chain.yaml", "-o", "lens.json")[0] == 0
    code, out, err = touchline("turn", "lens.json", "--turn", "270", "-o", "new.json")
    assert code == 0 and out.startswith("Lens turned by 90° counter-clockwise"), err
    before, after = (
        json.loads((tmp_path / name).read_text()) for name in ("lens.json", "new.json")
    )
    assert after["image_size"] == before["image_size"][::-1]
    assert after["lens"]["centre_px"] == pytest.approx(
        [
            before["lens"]["centre_px"][1],
            before["image_size"][0] - 1 - before["lens"]["centre_px"][0],
        ]
    )
    assert touchline("import", "chain.yaml", "-o", "in.json", "--turn", "270")[0] == 0
    assert json.loads((tmp_path / "in.json").read_text())["lens"] == after["lens"]
    from touchline.cli.files import read_lens_option

    assert read_lens_option(tmp_path / "new.json")["lens"] == after["lens"]


def test_a_turn_that_is_no_quarter_is_refused_and_nothing_is_written(touchline, cal, tmp_path):
    file = cal("ssl", 0)
    code, _, err = touchline("turn", file, "--turn", "100", "-o", "new.json")
    assert code == 3 and "Use 90, 180 or 270" in err
    assert touchline("turn", file, "--turn", "0", "-o", "new.json")[0] == 2
    assert touchline("import", file, "--turn", "45", "-o", "new.json")[0] == 3
    (tmp_path / "odd.json").write_text('{"format": "touchline-lens", "lens": {}}')
    assert touchline("turn", "odd.json", "--turn", "90", "-o", "new.json")[0] == 3
    assert not (tmp_path / "new.json").exists()
