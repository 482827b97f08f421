"""The shell on straight edges: a sentence, the bow, the lens; and a picture without its bend."""

import json
import re

import cv2
import numpy as np
import pytest

from tests.support.bar_pictures import BENT, STRAIGHT, bars_behind
from tests.support.straight_edges import lens_of, lines_seen
from touchline.workflows.straight_lines_request import StraightLinesRequest


@pytest.fixture
def bars(tmp_path):
    """One picture behind a barrel lens, one behind none, and one that shows nothing."""
    cv2.imwrite(str(tmp_path / "bent.png"), bars_behind(BENT))
    cv2.imwrite(str(tmp_path / "straight.png"), bars_behind(STRAIGHT))
    cv2.imwrite(str(tmp_path / "blank.png"), np.full((480, 640), 90, np.uint8))
    cv2.imwrite(str(tmp_path / "small.png"), np.full((48, 64), 90, np.uint8))


@pytest.fixture
def clicked(tmp_path):
    """Points along lines behind a known lens, in lines.json."""
    lines = {"lines": [line.tolist() for line in lines_seen(lens_of("division", (-0.25,)), 0)],
             "image_size": [1280, 1024]}
    (tmp_path / "lines.json").write_text(json.dumps(lines))
    return lines


def test_straight_says_in_a_sentence_how_far_the_lens_bows_edges(touchline, bars):
    code, out, err = touchline("straight", "bent.png")
    assert (code, err) == (0, "") and out.startswith("Distortion significant. The lens bows an edge of ")
    found = json.loads(touchline("straight", "bent.png", "--json")[1])
    bow, px = found["bow"]["most"], found["straightness_px"]
    assert f"Bow {bow['px']:.2f} ± {bow['sigma_px']:.2f} px, {bow['pct']:.2f} % of" in out
    assert f"Straightness {px['before']:.2f} px before, {px['after']:.3f} px after" in out
    assert "Lens division about (" in out and re.search(r"  k -0\.2\d+ ± ", out)
    assert "do not give the focal length" in out
    assert found["pictures"] == ["bent.png"]


def test_a_straight_picture_is_said_to_be_straight(touchline, bars):
    assert touchline("straight", "straight.png")[1].startswith("Distortion none. No significant distortion.")


def test_the_picture_without_its_bend_is_written_and_is_straight(touchline, bars, tmp_path):
    assert touchline("straight", "bent.png", "--corrected", "after.png")[0] == 0
    assert cv2.imread(str(tmp_path / "after.png")).shape == (480, 640, 3)
    before, after = (json.loads(touchline("straight", name, "--json")[1])["bow"]["most"]["px"]
                     for name in ("bent.png", "after.png"))
    assert after < 0.5 < 5 < before


def test_clicked_lines_give_what_every_door_gives(touchline, clicked, tmp_path):
    code, out, err = touchline("straight", "--lines", "lines.json", "--lens", "division", "--json")
    assert (code, err) == (0, "")
    from touchline.core.geometry import ImageSize
    assert json.loads(out) == StraightLinesRequest("division", None, tuple(clicked["lines"]), ImageSize(1280,
                                                                                                        1024)).answer()
    (tmp_path / "bare.json").write_text(json.dumps(clicked["lines"][:2]))
    cv2.imwrite(str(tmp_path / "bent.png"), bars_behind())
    both = json.loads(touchline("straight", "bent.png", "--lines", "bare.json", "--json")[1])
    assert [line["name"] for line in both["lines"][:3]] == ["line 1", "line 2", "image 1, edge 1"]


def test_what_tells_nothing_is_refused_in_two_lines_and_writes_nothing(touchline, bars, clicked, tmp_path):
    (tmp_path / "none.json").write_text('{"points": []}')
    (tmp_path / "text.json").write_text('{"lines": [[["a", 1]]], "image_size": [640, 480]}')
    (tmp_path / "sizeless.json").write_text(json.dumps({"lines": clicked["lines"]}))
    (tmp_path / "sized.json").write_text('{"lines": [], "image_size": "640x480"}')
    cases = [(3, ()), (3, ("blank.png",)), (3, ("bent.png", "small.png")), (3, ("bent.png", "bent.png")),
             (3, ("bent.png", "--lens", "fisheye")), (3, ("bent.png", "--centre-sigma-px", "-1")),
             (3, ("bent.png", "--centre-sigma-px", "nan")), (3, ("--lines", "none.json")),
             (3, ("--lines", "text.json")), (3, ("--lines", "sizeless.json")), (3, ("--lines", "sized.json")),
             (3, ("small.png", "--lines", "lines.json")), (3, ("lines.json",)), (4, ("nowhere.png",)),
             (4, ("--lines", "nowhere.json")), (3, ("bent.png", "--corrected", "after.gif")),
             (2, ("--lines", "lines.json", "--corrected", "after.png")), (2, ("bent.png", "--centre-sigma-px", "far"))]
    for wanted, words in cases:
        code, out, err = touchline("straight", *words)
        assert (code, out) == (wanted, ""), (words, code, out, err)
        assert wanted == 2 or re.fullmatch(r"error: .+\nfix: .+\n", err), err
    assert not list(tmp_path.glob("after.*"))


@pytest.mark.long
def test_the_facade_and_its_authors_correction_of_it(touchline, real_data):
    folder = real_data("lines/ipol_alvarez/building.png").parent
    assert touchline("straight", folder / "building.png")[1].startswith("Distortion significant.")
    assert touchline("straight", folder / "building_division_model.png")[1].startswith("Distortion none.")
