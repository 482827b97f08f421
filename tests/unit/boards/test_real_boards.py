"""Real pictures of boards, where they lie beside the project: published figures reached, bad sets flagged by name."""

import json

import cv2
import numpy as np
import pytest

from tests.support.tiers import long, rounds
from touchline.boards.board import Board, BoardView, find_board
from touchline.boards.fit import fit_board
from touchline.boards.request import calibrate_board
from touchline.core.errors import FitFailed
from touchline.core.geometry import ImageSize
from touchline.models import MODELS

PLAIN = {"terms": ["k1", "k2", "p1", "p2", "k3"]}
CHESS = Board("chessboard", 9, 6, 30.0)


@pytest.fixture(scope="module")
def seen(real_data):
    """Views and picture size of a folder of pictures, found once."""
    kept = {}

    def look(folder: str, pattern: str, board: Board, most: int = 100):
        key = (folder, pattern, most)
        if key not in kept:
            views = []
            for path in sorted(real_data(f"boards/{folder}").glob(pattern))[:most]:
                picture = cv2.imread(str(path))
                view = find_board(picture, board, path.stem)
                if view is not None:
                    views.append(view)
            kept[key] = tuple(views), ImageSize(picture.shape[1], picture.shape[0])
        return kept[key]

    return look


def reasons(report):
    return {w["reason"] for w in report["warnings"]}


def test_the_classic_left_camera(seen):
    """0.186 to 0.187 px rms are published; finer corners and a board that may be bowed reach less."""
    views, size = seen("opencv_left_right", "left*.jpg", CHESS)
    fit = fit_board(views, size, MODELS["brown-conrady"], PLAIN)
    assert len(views) == 13 and fit.used.all() and fit.outliers.sum() <= 7
    assert fit.rms_px <= 0.187
    flat = fit_board(
        views, size, MODELS["brown-conrady"], {**PLAIN, "warp": False, "robust": False}
    )
    assert flat.rms_px <= 0.187
    assert fit.lens.focal_px == pytest.approx(533.4, abs=1.5)  # five tools agree on 532 to 536


def test_a_wide_action_camera_needs_k3_and_gets_it(seen):
    views, size = seen("carnd_wide", "*.jpg", Board("chessboard", 8, 6, 25.0), most=24)
    fit = fit_board(views, size, MODELS["brown-conrady"])
    assert "k3" in fit.terms and "k4" not in fit.terms
    assert abs(fit.lens.values["k3"]) > 20 * fit.lens.sigma["k3"]
    assert fit.tried["k1 k2 k3"] < 0.6 * fit.tried["k1 k2"]


@rounds("most", 12, 100)
def test_a_fisheye_is_flagged_as_a_wrong_model_for_plain_terms_and_fits_its_own(seen, most):
    views, size = seen("camodocal_fisheye", "*.png", Board("chessboard", 9, 6, 25.0), most)
    plain = calibrate_board(views, None, size, "brown-conrady", PLAIN)["report"]
    own = calibrate_board(views, None, size, "fisheye")["report"]
    assert "wrong-model" in reasons(plain) and plain["rms_px"] > 2
    assert own["rms_px"] <= 0.70 and "wrong-model" not in reasons(own)


def test_a_webcams_face_on_views_are_flagged_though_the_residual_is_small(seen, real_data):
    """PhotonVision's LifeCam: cross-validation far above σ. Its own file's corners say the same."""
    views, size = seen("photonvision/squares/lifecam", "*/*", Board("chessboard", 10, 10, 25.4))
    filed = json.loads(real_data("boards/photonvision/calibration/lifecam480p.json").read_text())[
        "observations"
    ]
    theirs = tuple(
        BoardView(
            np.array([[p["x"], p["y"]] for p in o["locationInImageSpace"]]),
            np.array([[p["x"], p["y"], p["z"]] for p in o["locationInObjectSpace"]], float),
            o["snapshotName"],
        )
        for o in filed
    )
    for given in (views, theirs):
        report = calibrate_board(given, None, size)["report"]
        assert report["verdict"]["level"] == "poor"
        assert {"badly-spread-views", "halves-disagree"} <= reasons(report)
        assert report["cross_validation"]["halves_ratio"] > 10


def test_views_that_all_face_the_camera_leave_the_focal_length_open(seen):
    views, size = seen(
        "photonvision/squares/gloworm", "960_720_1/*", Board("chessboard", 8, 6, 25.4)
    )
    answer = calibrate_board(views, None, size)
    assert "badly-spread-views" in reasons(answer["report"])
    assert answer["report"]["parameters"]["log_focal"]["sigma"] > 0.01
    assert (
        answer["report"]["next_view"]["worst_after_px"]
        < 0.5 * answer["report"]["next_view"]["worst_before_px"]
    )


@rounds("most", 6, 16)
@pytest.mark.parametrize(
    "folder, legacy",
    [("2024-05-07_lifecam_1280", False), ("2024-06-19_lifecam_480_Old_Pattern", True)],
)
def test_charuco_boards_of_both_patterns(seen, folder, legacy, most):
    board = Board("charuco", 7, 7, 25.4, 19.05, "DICT_4X4_1000", legacy)
    views, size = seen(f"photonvision/charuco/{folder}", "*", board, most)
    fit = fit_board(views, size, MODELS["brown-conrady"], PLAIN)
    assert len(views) == most and fit.sigma_px < 0.2


@pytest.mark.parametrize("folder", ["attempt1", long("main")])
def test_a_teams_own_pictures(seen, folder):
    views, size = seen(f"vsss_silentsammy/{folder}", "*.jpg", Board("chessboard", 8, 5, 30.0))
    report = calibrate_board(views, None, size)["report"]
    assert report["sigma_px"] < 0.3 and len(views) >= 20
    assert "wrong-model" not in reasons(report)


def test_one_picture_is_no_calibration(seen):
    views, size = seen("ocamcalib_one", "*.jpg", Board("chessboard", 6, 5, 30.0))
    with pytest.raises(FitFailed) as refusal:
        calibrate_board(views, None, size)
    assert refusal.value.reason == "too-few-views"
