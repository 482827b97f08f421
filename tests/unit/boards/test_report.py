"""What a board calibration says of itself: spread, doubts, the next view, and its JSON."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.support.board_views import BOARD, FISHEYE, PLAIN, SIZE, TRUTH, picture_of, views_of
from touchline.boards.board import Board, BoardView, views_from_json
from touchline.boards.fit import fit_board
from touchline.boards.poses import NEXT_SHARE, cell_counts, rotation_to, tilt_vector
from touchline.boards.problem import BoardObservations
from touchline.boards.report import neighbour_correlation
from touchline.boards.request import calibrate_board, require_board
from touchline.boards.uncertainty import expected_over_picture, next_view, tilts
from touchline.core.errors import BadInput, FitFailed
from touchline.models import MODELS
from touchline.models.rotation import matrix_from_vector

BROWN = MODELS["brown-conrady"]


def reasons(report):
    return {w["reason"] for w in report["warnings"]}


def test_well_spread_views_are_good_and_the_report_is_plain_json():
    told = []
    answer = calibrate_board(views_of(count=20), BOARD, SIZE, progress=lambda f, m: told.append(f))
    report = json.loads(json.dumps(answer, allow_nan=False))["report"]
    assert report["verdict"]["level"] == "good"
    assert not reasons(report) & {
        "badly-spread-views",
        "wrong-model",
        "halves-disagree",
        "picture-not-covered",
    }
    assert report["bow_mm"]["x"] == pytest.approx(1.0, abs=0.1)
    assert report["cross_validation"]["held_out_ratio"] == pytest.approx(1.0, abs=0.1)
    assert report["sigma_px"] == pytest.approx(0.2, abs=0.01)
    assert report["next_view"]["worst_before_px"] == pytest.approx(
        report["expected_px"]["max"], rel=1e-6
    )
    assert told == sorted(told) and told[-1] == 1.0


def test_views_that_face_the_camera_are_flagged_as_badly_spread():
    report = calibrate_board(views_of(count=20, tilt_deg=4), BOARD, SIZE)["report"]
    assert report["verdict"]["level"] == "poor" and "badly-spread-views" in reasons(report)
    assert any("are tilted by 25°" in w["text"] for w in report["warnings"])
    assert report["rms_px"] < 0.3  # the small residual proves nothing
    assert report["next_view"]["tilt_deg"] == 35


def test_corners_in_the_middle_alone_leave_the_picture_uncovered():
    views = [
        v.only(np.linalg.norm(v.pixels - SIZE.centre, axis=1) < 330) for v in views_of(count=60)
    ]
    report = calibrate_board([v for v in views if len(v.pixels) > 40], BOARD, SIZE)["report"]
    assert "picture-not-covered" in reasons(report)
    assert report["expected_px"]["max"] > 5 * report["expected_px"]["median"]


def test_a_lens_of_another_kind_is_flagged_as_a_wrong_model():
    views = views_of(replace(FISHEYE, terms=(0.3, -0.25, 0.1, 0.0)), 20)
    wrong = calibrate_board(views, BOARD, SIZE, options={"terms": ["k1"]})["report"]
    right = calibrate_board(views, BOARD, SIZE, "fisheye")["report"]
    assert "wrong-model" in reasons(wrong) and wrong["verdict"]["level"] == "poor"
    assert "wrong-model" not in reasons(right)
    assert wrong["neighbour_correlation"] > 0.4 > 0.1 > abs(right["neighbour_correlation"])


def test_terms_that_may_be_nought_are_named():
    report = calibrate_board(
        views_of(replace(TRUTH, terms=(-0.2,) + (0.0,) * 7), 12),
        BOARD,
        SIZE,
        options={"terms": list(PLAIN)},
    )["report"]
    told = [w["text"] for w in report["warnings"] if w["reason"] == "term-not-supported"]
    assert told and all(" ± " in text and "e-" not in text for text in told)


def test_the_next_view_helps_as_much_as_it_says():
    """Views with nothing at the left: the suggested view, really taken, lowers the worst error as foretold."""
    views = [v for v in views_of(count=60, seed=3) if v.pixels[:, 0].min() > 400][:8]
    before = fit_board(tuple(views), SIZE, BROWN, {"terms": list(PLAIN)})
    told = next_view(before)
    assert "left" in told.text.split(",")[0]
    ray, middle = TRUTH.rays(np.array(told.place_px)), BOARD.places_mm.mean(axis=0)
    facing, leaning = matrix_from_vector(np.array([rotation_to(ray), tilt_vector(told.nearer)]))
    distance = 2 * middle[0] * TRUTH.focal_px / (NEXT_SHARE * SIZE.width)
    pixels = TRUTH.project((BOARD.places_mm - middle) @ (facing @ leaning).T + ray * distance)
    inside = ((pixels > 0) & (pixels < np.array(tuple(SIZE)) - 1)).all(axis=1)
    taken = BoardView(
        pixels + np.random.default_rng(0).normal(0, 0.2, pixels.shape), BOARD.places_mm
    ).only(inside)
    after = fit_board((*views, taken), SIZE, BROWN, {"terms": list(PLAIN)})
    worst = np.nanmax(expected_over_picture(after.lens))
    assert worst == pytest.approx(told.worst_after_px, rel=0.15)
    assert worst < 0.85 * told.worst_before_px


def test_tilts_and_cells_are_those_of_the_views():
    fit = fit_board(views_of(count=12, noise_px=0.05), SIZE, BROWN, {})
    degrees, nearer = tilts(fit)
    assert cell_counts(fit.observations.pixels[fit.observations.present], SIZE).sum() == 1200
    for k, (deg, edge) in enumerate(zip(degrees, nearer, strict=True)):
        rays, pixels = fit.state.camera_points(fit.observations)[k], fit.observations.pixels[k]
        if not edge:
            assert deg <= 12
            continue
        axis, sign = {"left": (0, -1), "right": (0, 1), "top": (1, -1), "bottom": (1, 1)}[edge]
        along = np.polyfit(pixels[:, axis], np.linalg.norm(rays, axis=1), 1)[0]
        # nearer where the edge is, unless the board is so far aside that the distance itself decides
        if deg > 25:
            assert along * sign < 0


def test_noise_has_no_neighbours_and_a_shape_has():
    observations, rng = BoardObservations.of(views_of(count=6)), np.random.default_rng(0)
    noise = rng.normal(0, 1, observations.pixels.shape)
    assert abs(neighbour_correlation(noise, observations)) < 0.1
    # alike along each row, and rows know nothing of others
    rows = np.repeat(rng.normal(0, 1, (6, 10, 2)), 10, axis=1)
    assert neighbour_correlation(rows, observations) == pytest.approx(1.0)
    shuffled = rng.permutation(100)  # the order in which corners are listed is nobody's business
    mixed = BoardObservations.of(tuple(v.only(shuffled) for v in views_of(count=6)))
    assert neighbour_correlation(rows[:, shuffled], mixed) == pytest.approx(1.0)


@pytest.mark.parametrize("edge, corner", [("left", 0), ("right", 9), ("top", 4), ("bottom", 94)])
def test_a_lean_brings_its_edge_nearer(edge, corner):
    away = (
        matrix_from_vector(tilt_vector(edge)) @ (BOARD.places_mm - BOARD.places_mm.mean(axis=0)).T
    )[2]
    assert away[corner] < -200 and tilt_vector("").tolist() == [0, 0, 0]


def test_corners_that_are_found_badly_are_said_to_be():
    report = calibrate_board(views_of(count=15, noise_px=3.0), BOARD, SIZE)["report"]
    assert "noisy-corners" in reasons(report) and report["verdict"]["level"] == "poor"


def test_left_out_views_stand_in_the_report_with_their_reason():
    views = list(views_of(count=8))
    views[2] = views[2].only(np.arange(100) < 3)
    report = calibrate_board(views, BOARD, SIZE)["report"]
    assert report["views"][2] == {
        "name": "view 3",
        "corners": 3,
        "used": False,
        "reason": "too-few-corners",
        "text": "View 3 has 3 corners; at least 6 are required.",
    }
    assert "view-left-out" in reasons(report)
    assert [v["used"] for v in report["views"]].count(True) == 7


def test_few_views_have_no_cross_validation_and_say_null():
    report = calibrate_board(views_of(count=4), BOARD, SIZE)["report"]
    assert report["cross_validation"]["halves_px"] is None


def test_a_picture_becomes_a_view_or_says_what_to_check():
    board = Board("chessboard", 9, 6, 30.0)
    picture = picture_of(
        board, np.array([[1.9, 0.25, 260], [-0.12, 1.75, 240], [2.2e-4, -1.5e-4, 1.0]])
    )
    assert len(require_board(picture, board).pixels) == 54
    with pytest.raises(FitFailed, match="8 × 6") as refusal:
        require_board(picture[:, :300], Board("chessboard", 8, 6, 30.0), "door.png")
    assert refusal.value.what.startswith("door.png shows no chessboard")
    assert refusal.value.reason == "no-board"


def test_views_travel_as_json():
    views = views_of(count=3)
    again = views_from_json(json.loads(json.dumps([v.to_json() for v in views])))
    assert all(
        (a.pixels == b.pixels).all() and a.name == b.name for a, b in zip(views, again, strict=True)
    )


@pytest.mark.parametrize(
    "change",
    [
        {"kind": "circles"},
        {"columns": 1},
        {"rows": 6.5},
        {"square_mm": 0},
        {"square_mm": float("nan")},
        {"columns": True},
        {"marker_mm": 3},
        {"colour": "red"},
        {"kind": "charuco"},
        {"kind": "charuco", "marker_mm": 40, "dictionary": "DICT_4X4_50"},
        {"kind": "charuco", "marker_mm": 20, "dictionary": "CharucoBoard"},
        {"kind": "charuco", "marker_mm": 20, "dictionary": ["DICT_4X4_50"]},
        {"kind": "charuco", "marker_mm": 20, "dictionary": "DICT_APRILTAG_16h5"},
    ],
)
def test_no_board_is_refused_by_name(change):
    with pytest.raises(BadInput) as refusal:
        Board.from_json({"kind": "chessboard", "columns": 9, "rows": 6, "square_mm": 30, **change})
    assert refusal.value.reason == "bad-board"


def test_boards_survive_their_json():
    for board in (BOARD, Board("charuco", 7, 7, 25.4, 19.05, "DICT_4X4_1000", True)):
        assert Board.from_json(json.loads(json.dumps(board.to_json()))) == board


@pytest.mark.parametrize(
    "value",
    [
        3,
        "ab",
        [3],
        [{"image_points": [[1, 2]]}],
        [{"image_points": "x"}],
        [{"more": 1}],
        [{"image_points": [[1, 2]], "object_points": [[1, "a", 0]]}],
        [{"image_points": [[1, 2]], "object_points": [[1, float("inf"), 0]]}],
        [{}] * 1001,
        [{"image_points": [[1, 2]] * 9000, "object_points": [[1, 2, 0]] * 9000}] * 40,
    ],
)
def test_what_is_no_list_of_views_is_refused(value):
    with pytest.raises(BadInput):
        views_from_json(value)
