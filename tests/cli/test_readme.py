"""The README's commands do what it says, word by word, with the points that it shows."""

import json
import re

import cv2
import numpy as np
import pytest

from tests.support.paths import ROOT

README = (ROOT / "README.md").read_text(encoding="utf-8")
SERVER = "http://127.0.0.1:8000"


def words_of(command: str) -> list[str]:
    """The words after `touchline` of the one line that begins with this command."""
    (line,) = re.findall(rf"^\.venv/bin/touchline ({command} .+)$", README, re.MULTILINE)
    return line.split()


@pytest.fixture
def picture(tmp_path):
    """As large as the points need it."""
    cv2.imwrite(str(tmp_path / "field.jpg"), np.full((580, 780, 3), 90, np.uint8))


@pytest.mark.usefixtures("picture")
def test_its_points_make_a_calibration_that_corrects_and_transforms(touchline, tmp_path):
    (points,) = re.findall(r"```json\n(.*?)```", README, re.DOTALL)
    assert points.count("\n") <= 10
    assert words_of("auto")[-2:] == ["--points", "clicks.json"]  # a picture of lines takes seconds
    (tmp_path / "clicks.json").write_text(points)
    code, out, err = touchline(*words_of("calibrate"))
    assert (code, err) == (0, "") and "mm" in out
    assert touchline(*words_of("correct"))[0] == 0
    assert (tmp_path / "corrected.png").stat().st_size > 1000
    code, out, _ = touchline(*words_of("transform"))
    assert code == 0 and re.fullmatch(r"-?[\d.]+,-?[\d.]+\n", out)


def test_its_camera_is_added_by_one_call(touchline, tmp_path):
    *words, server = words_of("call")
    assert server == SERVER and words.pop() == "--server"
    code, out, err = touchline(*words, "--data", tmp_path / "data")
    assert (code, err) == (0, "")
    assert json.loads(out)["source"] == "rtsp://192.168.1.20/stream1"
