"""The shell's rig: the same check and the same picture, and an exit code that scripts can trust."""

import json

import cv2
import numpy as np
import pytest

from tests.support.exported import example
from tests.support.rig_over_field import sim_rig, sim_source, sim_task
from touchline.core.records import Calibration
from touchline.formats import FORMATS
from touchline.images import encode
from touchline.store.store import Store


@pytest.fixture(scope="module")
def calibrations():
    return [Calibration.from_json(camera["calibration"]) for camera in sim_rig(2)["cameras"]]


@pytest.fixture
def files(calibrations, tmp_path):
    """north.json, south.json, and what both see."""
    for name, calibration, number in zip(("north", "south"), calibrations, (0, 1), strict=True):
        (tmp_path / f"{name}.json").write_bytes(FORMATS["json"].write(calibration))
        (tmp_path / f"{name}.png").write_bytes(encode(sim_source(2, number).read().pixels))
    return ("north.json", "south.json")


PICTURES = ("--picture", "north.png", "--picture", "south.png")


def knocked(path):
    """The calibration of before, of a camera that now sees all 50 mm to its side."""
    record = json.loads(path.read_text())
    where = record.get("calibration", record)
    position = where["model"]["parameters"]["position_mm"]
    position[0] += 50
    path.write_text(json.dumps(record))


def test_cameras_that_agree_end_with_0(touchline, files):
    code, out, err = touchline("rig", "check", *files, *PICTURES, "--json")
    assert code == 0, (out, err)
    (pair,) = json.loads(out)["pairs"]
    assert pair["from"] == "pictures" and pair["agreement"]["carpet"]["p95_mm"] < 15


@pytest.mark.long
def test_one_that_was_knocked_ends_with_5_and_is_named(touchline, files, tmp_path):
    knocked(tmp_path / "south.json")
    code, out, _ = touchline("rig", "check", *files, *PICTURES)
    assert code == 5 and out.startswith("poor: ") and "The error is in south" in out and "Calibrate south again" in out
    assert touchline("rig", "check", *files, *PICTURES, "--enough", "any")[0] == 0


@pytest.fixture
def matches(tmp_path):
    """matches.json: thirty places that both see, as rows."""
    places = np.random.default_rng(0).uniform([-200, -2800], [200, 2800], (30, 2))
    rows = np.concatenate([sim_source(2, n).camera.raw_from_field(places) for n in (0, 1)], axis=1)
    (tmp_path / "matches.json").write_text(json.dumps(rows.tolist()))


def test_one_that_was_knocked_ends_with_5_by_matches_too(touchline, files, matches, tmp_path):
    knocked(tmp_path / "south.json")
    code, out, _ = touchline("rig", "check", *files, "--matches", "matches.json")
    assert code == 5 and out.startswith("poor: ")


def test_matches_are_taken_as_pair_takes_them(touchline, files, matches):
    code, out, _ = touchline("rig", "check", *files, "--matches", "matches.json", "--json")
    (pair,) = json.loads(out)["pairs"]
    assert code == 0 and pair["from"] == "matches" and pair["agreement"]["n"] == 60


def test_heights_in_the_file_of_matches_come_before_the_option(touchline, tmp_path):
    for name in ("north", "south"):
        (tmp_path / f"{name}.json").write_bytes(FORMATS["json"].write(example("division", 0)))
    points = [[600, 500], [640, 480], [700, 520]]
    (tmp_path / "m.json").write_text(json.dumps({"points_a": points, "points_b": points, "z_mm": [150, 150]}))
    code, _, err = touchline("rig", "check", "north.json", "south.json", "--matches", "m.json", "--z", "0")
    assert code == 3 and "There are 2 heights for 3 matches." in err


def test_the_stitched_picture_is_written_and_what_nobody_sees_is_said(touchline, files, tmp_path):
    code, out, _ = touchline("rig", "stitch", *files, *PICTURES, "-o", "hall.png", "--width", "800")
    assert code == 0 and "The whole field is covered." in out
    assert cv2.imread(str(tmp_path / "hall.png")).shape == (550, 800, 3)
    code, out, _ = touchline("rig", "stitch", *files, "--picture", "north.png", "-o", "half.jpg")
    assert code == 0 and "not covered by any camera" in out
    code, _, err = touchline("rig", "stitch", *files, "-o", "none.png")
    assert code == 3 and "fix: Give one image for each camera" in err


def test_a_rig_that_a_server_keeps_is_checked_by_its_name(touchline, calibrations, tmp_path):
    with Store(tmp_path / "data") as store:
        for calibration in calibrations:
            store.calibrations.activate(store.calibrations.add(calibration).id)
        store.rigs.add("hall", {"title": "Hall", "field": "ssl-div-b", "w_max_rectangle_px": None,
                               "h_max_rectangle_px": None, "n_rectangles_x": None, "n_rectangles_y": None,
                               "cameras": [{"camera": f"cam{n}", "region": None, "rotate": None} for n in (0, 1)]})
    code, out, err = touchline("rig", "check", "hall", "--data", "data")
    assert code == 0 and "cam0 – cam1 (by clicks)" in out, err
    assert touchline("rig", "check", "attic", "--data", "data")[0] == 3
    assert touchline("rig", "check", "hall", "--data", "nowhere")[0] == 4


def test_calibrations_that_share_no_field_or_are_given_twice_are_refused(touchline, files, tmp_path):
    assert touchline("rig", "check", "north.json", "north.json")[0] == 3
    assert touchline("rig", "check", "north.json", "nowhere.json")[0] == 4
    assert touchline("rig", "check", *files, *PICTURES, "--picture", "north.png")[0] == 3
    assert sim_task(2, 0).field.name == "ssl-div-b"
