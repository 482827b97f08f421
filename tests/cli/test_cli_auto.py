"""The shell without clicks: a calibration where the lines prove it; else the points, a sentence and exit code 3."""

import json
import re
from dataclasses import replace

import cv2
import numpy as np
import pytest

from tests.support.auto_scenes import SceneSpec, scene_of

SPEC = SceneSpec(
    3, "ssl-div-b", "full", "mild", (816, 682), 5500.0, 12.0, 0.0, 3.0, 0.7, 2.0, 0.1, 4, 0
)


@pytest.fixture(scope="module")
def pixels():
    return scene_of(SPEC).pixels


@pytest.fixture
def seen(pixels, tmp_path):
    cv2.imwrite(str(tmp_path / "frame.png"), pixels)
    cv2.imwrite(str(tmp_path / "blank.png"), np.full((480, 640), 90, np.uint8))


@pytest.fixture(scope="module")
def answers():
    """What `auto` has said and written, once."""
    return {}


@pytest.fixture
def automatic(touchline, seen, answers, tmp_path):
    """What `auto` says of the picture; cal.json and points.json."""
    if not answers:
        words = (
            "auto",
            "frame.png",
            "--field",
            "ssl-div-b",
            "-o",
            "cal.json",
            "--points",
            "points.json",
        )
        answers["said"] = touchline(*words)
        answers["files"] = {
            name: (tmp_path / name).read_bytes() for name in ("cal.json", "points.json")
        }
    for name, content in answers["files"].items():
        (tmp_path / name).write_bytes(content)
    return answers["said"]


def test_auto_writes_a_calibration_and_its_points_which_calibrate_takes(
    touchline, automatic, tmp_path
):
    code, out, err = automatic
    assert (code, err) == (0, "") and "of the expected lines were detected" in out
    assert "Saved as cal.json." in out
    height_m, reach_m = map(
        float, re.search(r"Camera (\S+) ± (\S+) m above the carpet", out).groups()
    )
    assert abs(height_m - SPEC.height_mm / 1000) < 1.5 * reach_m < 1.5  # ± what holds in 95 of 100
    points = json.loads((tmp_path / "points.json").read_text())
    assert len(points["observations"]) >= 10 and points["field"] == "ssl-div-b"
    assert (
        touchline(
            "calibrate",
            "frame.png",
            "--points",
            "points.json",
            "--model",
            "homography",
            "-o",
            "again.json",
        )[0]
        == 0
    )


def test_auto_declines_with_the_reason_and_writes_no_calibration(touchline, seen, tmp_path):
    code, out, err = touchline(
        "auto", "blank.png", "--field", "ssl-div-b", "-o", "cal.json", "--points", "points.json"
    )
    assert (code, out) == (3, "") and err.startswith("error: No line detected in the image.\nfix: ")
    assert not (tmp_path / "cal.json").exists()
    assert json.loads((tmp_path / "points.json").read_text())["observations"] == []


def test_auto_recognises_the_field_and_names_what_it_is_not(touchline, seen, tmp_path):
    code, out, err = touchline("auto", "frame.png", "-o", "own.json")
    assert (code, err) == (0, "") and out.startswith(
        "Recognised: RoboCup Small Size League, Division B (full field, "
    )
    assert "The next best field, " in out and (tmp_path / "own.json").exists()


def test_auto_asks_which_end_of_the_field_it_is(touchline, tmp_path):
    half = scene_of(replace(SPEC, field="ssl-2008", region="half", lens="half"))
    cv2.imwrite(str(tmp_path / "half.png"), half.pixels)
    code, out, err = touchline("auto", "half.png", "--field", "ssl-2008", "-o", "half.json")
    assert (code, out) == (3, "") and err.splitlines()[1] == (
        "fix: Use one of: --field ssl-2008 --region half-right --rotate 90; "
        "--field ssl-2008 --region half-left --rotate 270."
    )
    assert not (tmp_path / "half.json").exists()


@pytest.mark.parametrize(
    "words, code",
    [
        (("frame.png", "--field", "moon"), 3),
        (("none.png", "--field", "table"), 4),
        ((), 2),
        (("frame.png", "--field", "table", "--height-mm", "-5"), 3),
        (("frame.png", "--corners", "1,2 3,x"), 2),
        (("frame.png", "--corners", "0,0 9,0 9,9 0,9"), 3),
    ],
)
def test_what_cannot_be_meant_is_refused(touchline, seen, words, code):
    assert touchline("auto", *words)[0] == code


def test_check_says_whether_it_still_holds_and_ends_with_5_where_it_does_not(
    touchline, automatic, tmp_path
):
    code, out, err = touchline(
        "check", "cal.json", "frame.png", "--drawn", "drawn.png", "--enough", "good"
    )
    assert (code, err) == (0, "") and out.startswith("The calibration is still valid: ")
    assert "top touch line" in out and cv2.imread(str(tmp_path / "drawn.png")).shape == (
        682,
        816,
        3,
    )
    cv2.imwrite(
        str(tmp_path / "knocked.png"), np.roll(cv2.imread(str(tmp_path / "frame.png")), 3, axis=1)
    )
    code, out, err = touchline("check", "cal.json", "knocked.png")
    assert (
        (code, err) == (5, "")
        and out.startswith("The calibration is no longer valid: ")
        and "has moved" in out
    )
    code, out, _ = touchline("check", "cal.json", "knocked.png", "--enough", "any", "--json")
    assert code == 0 and json.loads(out)["verdict"]["reason"] == "moved"
    code, _, err = touchline("check", "cal.json", "blank.png")
    assert code == 3 and "640 × 480" in err and "fix: " in err


def test_check_of_an_unchanged_calibration_ends_as_its_report_does(touchline, automatic, tmp_path):
    record = json.loads((tmp_path / "cal.json").read_text())
    for level, expected in (("fair", 0), ("poor", 5)):
        record["report"]["verdict"]["level"] = level
        (tmp_path / "cal.json").write_text(json.dumps(record))
        code, out, _ = touchline("check", "cal.json", "frame.png")
        assert (
            code
            == expected
            == touchline("report", "cal.json", "--picture", "frame.png", "--out", "r.html")[0]
        )
        assert out.startswith(f"The calibration is unchanged, and it was {level}: ")


def test_check_does_not_say_that_a_camera_has_moved_whose_imported_calibration_was_never_right(
    touchline, automatic, tmp_path
):
    assert (
        touchline(
            "export", "cal.json", "--format", "ssl-vision", "-o", "camera.txt", "--approximate"
        )[0]
        == 0
    )
    assert (
        touchline(
            "import",
            "camera.txt",
            "--field",
            "ssl-div-b",
            "--region",
            "full",
            "--image-size",
            "816x682",
            "-o",
            "theirs.json",
        )[0]
        == 0
    )
    cv2.imwrite(
        str(tmp_path / "knocked.png"), np.roll(cv2.imread(str(tmp_path / "frame.png")), 5, axis=1)
    )
    code, out, _ = touchline("check", "theirs.json", "knocked.png")
    assert code == 5 and out.startswith(
        "This calibration was never verified, and does not describe this camera: "
    )
    assert "camera has moved." not in out.replace("Nothing shows that the camera has moved.", "")
    assert "Calibrate this camera." in out
