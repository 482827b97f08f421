"""touchline report: the page, the JSON and the exit code of one calibration, from a file or by its id."""

import json
import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.support.pictures import encoded, gradient
from touchline.cli.files import read_calibration
from touchline.core.geometry import ImageSize
from touchline.store.store import Store

POOR = 5


@pytest.fixture
def picture(tmp_path):
    path = tmp_path / "field.png"
    path.write_bytes(encoded("png", gradient(780, 580)))
    return path


@pytest.fixture(scope="module")
def how():
    """A lens model, whose error is known everywhere."""
    return "--model", "brown-conrady", "--height-mm", 4000


def with_level(path: Path, level: str) -> Path:
    """The same calibration with another verdict."""
    record = json.loads(path.read_text())
    record["report"]["verdict"]["level"] = level
    other = path.with_name(f"{level}.json")
    other.write_text(json.dumps(record))
    return other


def test_a_page_is_written_and_the_verdict_is_said(touchline, calibration, picture, tmp_path):
    code, out, err = touchline("report", calibration, "--picture", picture, "--out", "report.html")
    verdict = json.loads(calibration.read_text())["report"]["verdict"]
    assert err == "" and code == (0 if verdict["level"] in ("good", "fair") else POOR)
    assert verdict["sentence"] in out and "Saved as report.html" in out
    page = (tmp_path / "report.html").read_text()
    assert page.startswith("<!doctype html>") and page.count("data:image/jpeg") == 2
    assert page.count("data:image/png") == 2


def test_json_holds_the_calibrations_own_numbers(touchline, calibration, picture):
    _, out, _ = touchline("report", calibration, "--picture", picture, "--json")
    said, kept = json.loads(out), json.loads(calibration.read_text())["report"]
    assert said["figures"]["rms_px"]["value"] == kept["rms_px"]
    assert said["uncertainty"]["carpet"]["map"]["rms"] == pytest.approx(
        kept["sigma_mm"]["rms"], rel=1e-9
    )
    assert said["uncertainty"]["hat"]["map"]["max"] == pytest.approx(
        kept["sigma_mm"]["hat"]["max"], rel=1e-9
    )
    assert said["picture"]["same"] is True


def test_what_stands_against_a_calibration_is_said_with_what_to_do(
    touchline, calibration, tmp_path
):
    _, out, _ = touchline("report", with_level(calibration, "poor"), "--out", "report.html")
    page = (tmp_path / "report.html").read_text()
    assert "Failed: " in out and ">Failed<" in page
    _, out, _ = touchline("report", calibration, "--json")
    claims = {claim["code"]: claim["state"] for claim in json.loads(out)["claims"]}
    assert (
        set(claims) == {"accuracy", "robot-tops", "model", "height"} and "held" in claims.values()
    )


@pytest.mark.parametrize(
    "level, enough, wanted",
    [
        ("good", "good", 0),
        ("fair", "good", POOR),
        ("fair", "fair", 0),
        ("poor", "fair", POOR),
        ("unknown", "fair", POOR),
        ("poor", "any", 0),
        ("unknown", "any", 0),
        ("excellent", "fair", POOR),
    ],
)
def test_the_exit_code_is_the_verdict(touchline, calibration, level, enough, wanted):
    code, out, err = touchline("report", with_level(calibration, level), "--enough", enough)
    assert (code, err) == (wanted, "") and out


def test_fair_is_enough_where_nothing_is_said(touchline, calibration):
    codes = [
        touchline("report", with_level(calibration, level))[0]
        for level in ("good", "fair", "poor", "unknown")
    ]
    assert codes == [0, 0, POOR, POOR]


def test_another_picture_is_told_and_one_of_another_size_refused(
    touchline, calibration, picture, tmp_path
):
    cv2.imwrite(str(tmp_path / "other.png"), np.zeros((580, 780), np.uint8))
    _, out, _ = touchline("report", calibration, "--picture", "other.png", "--out", "report.html")
    assert "not the calibration image" in out
    assert "not the calibration image" in (tmp_path / "report.html").read_text()
    cv2.imwrite(str(tmp_path / "small.png"), np.zeros((58, 78), np.uint8))
    code, out, err = touchline(
        "report", calibration, "--picture", "small.png", "--out", "small.html"
    )
    assert (code, out) == (3, "") and re.fullmatch(r"error: .+\nfix: .+\n", err)
    assert not (tmp_path / "small.html").exists()


def test_by_its_id_out_of_the_servers_folder_with_its_own_picture(
    touchline, calibration, picture, tmp_path
):
    with Store(tmp_path / "data") as store:
        snapshot = store.snapshots.add(picture.read_bytes(), ImageSize(780, 580), "png")
        record = json.loads(calibration.read_text()) | {"snapshot": snapshot.id}
        calibration.write_text(json.dumps(record))
        kept = store.calibrations.add(read_calibration(calibration))
        code, _, err = touchline("report", kept.id, "--data", tmp_path / "data")
        assert code == 4 and "is in use by another" in err  # the server is running
    code, out, err = touchline(
        "report",
        kept.id,
        "--data",
        tmp_path / "data",
        "--enough",
        "any",
        "--json",
        "--out",
        "report.html",
    )
    said = json.loads(out)
    assert (
        (code, err) == (0, "")
        and said["calibration"]["id"] == kept.id
        and said["picture"]["same"] is True
    )
    assert (tmp_path / "report.html").read_text().count("data:image/jpeg") == 2


def test_what_is_not_there_or_no_calibration_is_refused_with_its_cure(
    touchline, calibration, tmp_path
):
    (tmp_path / "no.json").write_text("{}")
    (tmp_path / "data").mkdir()
    cases = [
        (4, ("nowhere.json",)),
        (3, ("no.json",)),
        (4, (calibration, "--picture", "nowhere.png")),
        (3, ("0123456789abcdef", "--data", tmp_path / "data")),
        (4, ("0123456789abcdef", "--data", tmp_path / "nowhere")),
        (4, (calibration, "--out", "no/such/report.html")),
    ]
    for wanted, words in cases:
        code, out, err = touchline("report", *words)
        assert (code, out) == (wanted, ""), (words, err)
        assert re.fullmatch(r"error: .+\nfix: .+\n", err), err
    assert touchline("report", calibration, "--enough", "perfect")[0] == 2
    assert not (tmp_path / "nowhere").exists()
