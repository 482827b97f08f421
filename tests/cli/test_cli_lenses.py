"""Lenses in the shell: from boards, and held by calibrate."""

import json
import re

import cv2
import numpy as np
import pytest
import yaml

from tests.support.board_views import BOARD, SIZE, TRUTH, picture_of, views_of
from tests.support.lens_over_field import FIELD, clicks_through_the_lens
from tests.support.paths import CLICKS as CLICKS_FOLDER
from touchline.boards.board import Board
from touchline.boards.request import BoardCalibrationRequest
from touchline.cli.files import write_lens

CLICKS = CLICKS_FOLDER / "ssl_2008_half.json"
SMALL = Board("chessboard", 8, 6, 30.0)
SIDES = ("--columns", 8, "--rows", 6, "--square-mm", 30)


@pytest.fixture
def board_pictures(tmp_path):
    """Five pictures of the small board, and one of nothing."""
    rng = np.random.default_rng(0)
    paths = [tmp_path / f"board{n}.png" for n in range(5)]
    for path in paths:
        turn = rng.uniform(-0.3, 0.3)
        c, s = 2.6 * np.cos(turn), 2.6 * np.sin(turn)
        seen = np.array(
            [
                [c, -s, 180 + rng.uniform(0, 100)],
                [s, c, 180 + rng.uniform(0, 60)],
                [*rng.uniform(-6e-4, 6e-4, 2), 1],
            ]
        )
        cv2.imwrite(str(path), picture_of(SMALL, seen))
    blank = tmp_path / "blank.png"
    cv2.imwrite(str(blank), np.full((800, 1000), 90, np.uint8))
    return [*paths, blank]


def test_board_finds_a_lens_and_names_the_picture_that_shows_none(
    touchline, board_pictures, tmp_path
):
    words = (
        "board",
        *board_pictures,
        *SIDES,
        "--option",
        "terms=[]",
        "--option",
        "warp=false",
        "-o",
        "lens.json",
    )
    code, out, err = touchline(*words)
    assert (code, err) == (0, "")
    assert (
        re.search(r"5 of 5 views, 2\d\d corners", out)
        and "blank.png shows no chessboard" in out
        and "± " in out
    )
    lens = json.loads((tmp_path / "lens.json").read_text())
    assert (
        lens["format"] == "touchline-lens"
        and lens["board"] == SMALL.to_json()
        and lens["image_size"] == [1000, 800]
    )
    assert json.loads(touchline(*words, "--json")[1]) == lens["report"]


def test_board_refuses_what_tells_no_lens_and_writes_nothing(touchline, board_pictures, tmp_path):
    small = tmp_path / "small.png"
    cv2.imwrite(str(small), np.zeros((80, 100), np.uint8))
    cases = [
        (3, board_pictures[:2], SIDES, ()),
        (3, [board_pictures[0], small], SIDES, ()),
        (3, board_pictures[-1:], SIDES, ()),
        (3, board_pictures, SIDES, ("--kind", "dartboard")),
        (3, board_pictures, SIDES, ("--model", "polynomial")),
        (3, board_pictures, SIDES, ("--option", "degree=3")),
        (3, board_pictures, ("--columns", 8, "--rows", 6, "--square-mm", 0), ()),
        (4, [tmp_path / "nowhere.png"], SIDES, ()),
        (2, board_pictures, ("--columns", 8), ()),
        (2, [], SIDES, ()),
    ]
    for wanted, pictures, sides, more in cases:
        code, out, err = touchline("board", *pictures, *sides, *more, "-o", "lens.json")
        assert (code, out) == (wanted, ""), (pictures, more, err)
        assert wanted == 2 or re.fullmatch(r"error: .+\nfix: .+\n", err), err
    assert not (tmp_path / "lens.json").exists()


@pytest.fixture(scope="module")
def found_lens():
    """What a board calibration answers, from corners alone."""
    return BoardCalibrationRequest(BOARD).from_views(views_of(count=12), SIZE)


@pytest.fixture
def over_the_field(found_lens, tmp_path):
    """The true camera; files for calibrate: picture, points, field, lens."""
    truth, task = clicks_through_the_lens()
    (tmp_path / "points.json").write_text(json.dumps(task))
    (tmp_path / "fields").mkdir()
    (tmp_path / "fields" / "plain-4x3.yaml").write_text(yaml.safe_dump(FIELD))
    cv2.imwrite(str(tmp_path / "raw.png"), np.zeros((SIZE.height, SIZE.width), np.uint8))
    write_lens(tmp_path / "lens.json", found_lens)
    return truth


CALIBRATE = ("calibrate", "raw.png", "--points", "points.json", "--fields", "fields")


def test_calibrate_holds_a_lens_from_a_board_and_knows_the_height_better(
    touchline, over_the_field, tmp_path
):
    heights = {}
    for name, more in {
        "alone": (),
        "held": ("--lens", "lens.json"),
        "own": ("--lens", "lens.json", "--lens-sigma", "own"),
    }.items():
        code, _, err = touchline(*CALIBRATE, *more, "-o", f"{name}.json")
        assert (code, err) == (0, "")
        heights[name] = json.loads((tmp_path / f"{name}.json").read_text())["model"]["parameters"][
            "position_mm"
        ][2]
    miss = {name: abs(height - over_the_field.position_mm[2]) for name, height in heights.items()}
    assert miss["held"] < 8 and miss["own"] < 8 and miss["alone"] > 3 * miss["held"]
    assert heights["held"] != heights["own"]


def test_calibrate_takes_the_lens_of_another_calibration_over(touchline, over_the_field, tmp_path):
    assert touchline(*CALIBRATE, "--lens", "lens.json", "-o", "first.json")[0] == 0
    assert touchline(*CALIBRATE, "--lens", "first.json", "-o", "second.json")[0] == 0
    first, second = (
        json.loads((tmp_path / f"{name}.json").read_text())["model"]["parameters"]["lens_terms"]
        for name in ("first", "second")
    )
    assert first == second == pytest.approx(TRUTH.terms, abs=0.02)


def test_calibrate_holds_another_calibrations_lens_as_well_as_its_clicks_told_it(
    touchline, over_the_field, tmp_path
):
    assert touchline(*CALIBRATE, "--height-mm", 4000, "-o", "first.json")[0] == 0
    own = ("--lens-sigma", "own", "-o", "second.json")
    assert touchline(*CALIBRATE, "--lens", "first.json", *own)[0] == 0
    first, second = (
        json.loads((tmp_path / f"{name}.json").read_text()) for name in ("first", "second")
    )
    assert {"log_focal", "k1"} <= set(second["report"]["covariance"]["names"])
    assert second["options"]["lens"]["covariance"] == first["report"]["covariance"]
    assert touchline(*CALIBRATE, "--lens", "first.json", "-o", "fast.json")[0] == 0
    code, out, err = touchline(*CALIBRATE, "--lens", "fast.json", *own)
    assert (code, out) == (3, "") and "fix: Use a lens from a board" in err


def test_a_lens_or_a_height_that_cannot_be_is_refused(touchline, over_the_field, tmp_path):
    (tmp_path / "broken.json").write_text(
        (tmp_path / "lens.json").read_text().replace('"focal_px"', '"focal"')
    )
    (tmp_path / "none.json").write_text("[]")
    cases = [
        (3, ("--lens", "broken.json")),
        (3, ("--lens", "none.json")),
        (3, ("--lens", "points.json")),
        (3, ("--lens", "lens.json", "--model", "fisheye")),
        (3, ("--lens", "lens.json", "--lens-sigma", "1")),
        (3, ("--height-mm", "-5")),
        (2, ("--lens-sigma", "own")),
        (2, ("--height-sigma-mm", "3")),
        (2, ("--height-mm", "high")),
        (4, ("--lens", "nowhere.json")),
    ]
    for wanted, more in cases:
        code, out, err = touchline(*CALIBRATE, *more, "-o", "no.json")
        assert (code, out) == (wanted, ""), (more, code, err)
        assert wanted == 2 or re.fullmatch(r"error: .+\nfix: .+\n", err), err
    assert not (tmp_path / "no.json").exists()


@pytest.mark.long
def test_the_classic_left_camera_from_its_own_pictures(touchline, real_data, tmp_path):
    pictures = sorted(real_data("boards/opencv_left_right").glob("left*.jpg"))
    code, out, _ = touchline(
        "board", *pictures, "--columns", 9, "--rows", 6, "--square-mm", 25, "-o", "lens.json"
    )
    assert code == 0 and "13 of 13 views" in out
    assert json.loads((tmp_path / "lens.json").read_text())["report"]["rms_px"] < 0.25
