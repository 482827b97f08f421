"""Unusual sets of points in the shell: fitted or refused with a fix; every command reads what was written."""

import json

import pytest

from tests.support.calibration_surfaces import finite
from tests.support.pictures import encoded, gradient
from tests.support.point_sets import REGIONS, SETS, SIZE, TURNS, View
from touchline.fitting import FITTERS
from touchline.formats import FORMATS
from touchline.workflows.model_choice import AUTO

DONE, REFUSED, POOR = 0, 3, 5
ALL = (*FITTERS, AUTO)


@pytest.fixture
def ask(touchline, tmp_path):
    """Run a command that may be refused: its exit code and what it says."""
    (tmp_path / "field.png").write_bytes(encoded("png", gradient(*SIZE)))

    def run(*words, codes=(DONE, REFUSED)):
        code, out, err = touchline(*words)
        assert code in codes and "Traceback" not in err, (words, code, err)
        assert code != REFUSED or "\nfix: " in err, err
        assert "None" not in out and "nan" not in out.lower().replace("nan,nan", ""), out
        return code, out

    return run


@pytest.fixture
def calibrate(ask, tmp_path):
    """Calibrate from a set of points; the exit code and what is said."""

    def run(view, name, model, *words):
        (tmp_path / "points.json").write_text(json.dumps(view.body(SETS[name](view), model)))
        (tmp_path / "cal.json").unlink(missing_ok=True)
        code, out = ask(
            "calibrate", "field.png", "--points", "points.json", "-o", "cal.json", *words
        )
        assert (tmp_path / "cal.json").exists() == (code == DONE)
        return code, out

    return run


def test_corners_alone_are_calibrated_and_what_they_cannot_tell_is_told_as_unknown(calibrate):
    code, out = calibrate(View("half", 90), "four corners", "homography")
    assert code == DONE and "cross-validated unknown." in out and " before, unknown after" in out
    assert "Distortion after: unknown. It needs four points along one border.\n" in out
    assert "Cross-validated error: unknown. It needs more points on lines or landmarks.\n" in out
    assert out.endswith("Saved as cal.json.\n")
    code, out = calibrate(View("half", 90), "four corners", "homography", "--json")
    assert code == DONE and finite(out)["distortion"]["after_pct"] is None


def test_a_report_tells_what_is_unknown_in_words_and_on_its_page(calibrate, ask, tmp_path):
    calibrate(View("half", 90), "four corners", "homography")
    _, out = ask("report", "cal.json", "--out", "report.html", codes=(DONE, POOR))
    for needs in (
        "Expected error, robot tops: unknown. It needs a physical lens model.",
        "Distortion after: unknown. It needs four points along one border.",
    ):
        assert needs in out
    assert (
        "unknown, it needs four points along one border" in (tmp_path / "report.html").read_text()
    )


@pytest.mark.long
@pytest.mark.parametrize("model", ALL)
@pytest.mark.parametrize("name", SETS)
def test_every_command_reads_what_was_written(calibrate, ask, name, model):
    number = [*SETS].index(name) + ALL.index(model)
    view = View(REGIONS[number % len(REGIONS)], TURNS[number % len(TURNS)])
    code, _ = calibrate(view, name, model)
    if code == DONE:
        read_by_every_command(ask)


def read_by_every_command(ask) -> None:
    """Give cal.json to each command that takes a calibration."""
    for as_json in ((), ("--json",)):
        ask("report", "cal.json", "--picture", "field.png", *as_json, codes=(DONE, POOR))
        ask("check", "cal.json", "field.png", *as_json, codes=(DONE, REFUSED, POOR))
    for z_mm in (0, 150):
        for there, back in (("image", "field"), ("corrected", "image"), ("field", "corrected")):
            for source, target in ((there, back), (back, there)):
                ask(
                    "transform",
                    "-c",
                    "cal.json",
                    "--from",
                    source,
                    "--to",
                    target,
                    "--z",
                    z_mm,
                    "390,290",
                    "-5,7",
                )
    ask("correct", "field.png", "-c", "cal.json", "-o", "corrected.png", "--width", 320)
    ask("export", "cal.json", codes=(DONE,))
    for format in FORMATS:
        for words in ((), ("--approximate",)):
            ask("export", "cal.json", "-f", format, "-o", f"out-{format}", *words)
    ask("import", "out-json", "-o", "again.json", codes=(DONE,))
