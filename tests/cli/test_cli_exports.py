"""export and import from a shell: the same files as over REST, what they cost, and exit codes for scripts."""

import json
import os
import re

import numpy as np
import pytest

from tests.support.exported import OF_LEAGUE, example, model_of, of_model
from tests.unit.formats.test_imports import KALIBR
from touchline.core.geometry import ImageSize
from touchline.core.quarter_turn import QuarterTurn
from touchline.formats import FORMATS
from touchline.formats.approximation import export_camera
from touchline.ssl_protocol.ssl_vision_pb2 import SSL_WrapperPacket
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


CAMERA = {"fx": 400, "fy": 400, "cx": 320, "cy": 240, "D": [0.1, 0, 0, 0, 0]}
SIZED = {**CAMERA, "image_size": [640, 480]}
TABLE = "feature,raw_x_px,raw_y_px\n" + "top,1,2\n" * 9
# a file and the options with it; what is said, and what its cure is in a shell
ASKED = {
    "several cameras": (
        {"left": SIZED, "right": {**SIZED, "fx": 401}},
        (),
        "contains 2 cameras",
        "--entry",
    ),
    "another camera": (SIZED, ("--entry", "left"), "no camera called 'left'", "Omit --entry."),
    "no lens": (
        {**SIZED, "D": [0.1, 0, 0, 0]},
        (),
        "sees 85° as an ordinary lens, 106° as a fisheye",
        "--model as brown-conrady or fisheye",
    ),
    "another lens": (
        {**SIZED, "distortion_model": "plumb_bob"},
        ("--model", "fisheye"),
        "states its lens",
        "Omit --model.",
    ),
    "no size": (CAMERA, (), "image size", "--image-size"),
    "no size and no lens": ({**CAMERA, "D": [0.1, 0, 0, 0]}, (), "image size", "--image-size"),
    "no field": (TABLE, (), "but not their field", "--field, --region and --image-size (as "),
    "an unknown field": (
        TABLE,
        ("--field", "nowhere", "--region", "full", "--image-size", "640x480"),
        "no field called 'nowhere'",
        "--field",
    ),
}
REST_NAME = re.compile(r"(?<!-)\b(entry|model|image_size|camera_id)\b|[Ss]end|program,")


@pytest.mark.parametrize("name", ASKED)
def test_a_refused_import_names_the_options_of_the_shell(touchline, tmp_path, name):
    text, options, what, cure = ASKED[name]
    (tmp_path / "file.txt").write_text(text if isinstance(text, str) else json.dumps(text))
    code, _, err = touchline("import", "file.txt", "-o", "out.json", *options)
    assert code == 3 and what in err and cure in err
    assert not REST_NAME.search(err), err
    assert not (tmp_path / "out.json").exists()


def test_a_packet_of_two_cameras_is_read_by_the_number_that_its_refusal_names(
    touchline, cal, tmp_path
):
    one = FORMATS["ssl-vision"]
    packet = one.write(example("ssl", 0), export_camera(example("ssl", 0), one, True, 1))
    both = SSL_WrapperPacket.FromString(packet)
    both.geometry.calib.add().CopyFrom(both.geometry.calib[0])
    both.geometry.calib[1].camera_id = 4
    (tmp_path / "both.pb").write_bytes(both.SerializeToString())
    code, _, err = touchline("import", "both.pb", "-o", "out.json")
    assert code == 3 and "--entry" in err and not REST_NAME.search(err)
    for option in ("--entry", "--camera-id"):
        assert touchline("import", "both.pb", "-o", "out.json", option, "4")[0] == 0


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
