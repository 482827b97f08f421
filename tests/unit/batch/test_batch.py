"""An archive of pictures, calibrated or checked: every picture is a row, whatever happens to it or to the run."""

import csv
import json
import re

import cv2
import pytest

from tests.support import sample_jobs
from tests.support.batch_pictures import clicks, folder_of, picture
from tests.support.paths import CLICKS
from tests.support.pictures import hostile
from touchline.batch import SUFFIXES, encode_table, read_table, run_requests
from touchline.batch.requests import BatchRequest
from touchline.batch.table import COLUMNS, row_of
from touchline.core.errors import BadInput
from touchline.jobs import JobEngine

BROWN = ("--model", "brown-conrady", "--option", 'height_mm={"value": 6500, "sigma": 30}')
HOMOGRAPHY = ("--model", "homography", "--enough", "any")  # where it is not the fit that matters


def batch(touchline, *words):
    """By one worker: each imports for longer than it fits a few pictures."""
    return touchline("batch", *words, "--workers", 1)


@pytest.fixture
def archive(tmp_path):
    return folder_of(tmp_path / "archive", 3)


def table(path):
    return {row["picture"]: row for row in read_table(path.read_bytes(), path.suffix)}


def test_every_picture_is_calibrated_from_the_clicks_beside_it_as_calibrate_does_it(touchline, archive, tmp_path):
    code, out, err = batch(touchline, archive, *BROWN, "-o", "table.json")
    assert (code, err) == (0, "")
    assert re.fullmatch(r"3 images: (\d (good|fair)(, )?)+\.\nSaved as table\.json\.\n", out), out
    rows = table(tmp_path / "table.json")
    assert list(rows) == ["north-1.png", "north-2.png", "north-3.png"]
    for name, row in rows.items():
        points = (archive / name).with_suffix(".json")
        touchline("calibrate", archive / name, "--points", points, *BROWN, "-o", "c.json")
        record = json.loads((tmp_path / "c.json").read_text())
        report = record["report"]
        assert (row["rms_px"], row["rms_mm"], row["worst_mm"], row["held_out_mm"]) == (
            report["rms_px"], report["rms_mm"], report["max_mm"], report["cv_rms_mm"])
        assert row["verdict"] == report["verdict"]["level"] and row["sha256"] == record["image_sha256"]
        assert row["distortion_before_pct"] < -3 and abs(row["distortion_after_pct"]) < 0.3 and row["seconds"] > 0


def test_a_broken_picture_is_a_row_with_its_problem_and_cure_and_stops_nobody(touchline, archive, tmp_path):
    whole = (archive / "north-1.png").read_bytes()
    (archive / "cut.png").write_bytes(whole[:len(whole) // 2])
    (archive / "spoilt.png").write_bytes(hostile("a PNG with fewer rows than it says")[0])  # only decoding tells
    (archive / "empty.jpg").write_bytes(b"")
    (archive / "text.bmp").write_text("no picture")
    (archive / "gone.png").symlink_to(archive / "nowhere.png")
    cv2.imwrite(str(archive / "small.png"), cv2.imread(str(archive / "north-2.png"))[::2, ::2])
    picture(archive / "unclicked.png")
    picture(archive / "misclicked.png")
    picture(archive / "elsewhere.png")
    for name in ("cut", "small"):
        clicks(archive / f"{name}.json")
    clicks(archive / "spoilt.json", image_size=[8, 8])
    (archive / "misclicked.json").write_text('{"observations": [NaN')
    clicks(archive / "elsewhere.json", field="no-such-field")
    (archive / "folder.png").mkdir()
    (archive / "notes.txt").write_text("no picture and not called one")
    code, out, err = batch(touchline, archive, *BROWN, "-o", "table.csv")
    assert (code, err) == (1, "") and re.match(r"12 images: .*, 9 failed\.\n", out), out
    rows = table(tmp_path / "table.csv")
    said = {"cut.png": "incomplete", "spoilt.png": "decoded", "empty.jpg": "empty",
            "text.bmp": "not an image", "gone.png": "cannot be read",
            "small.png": "320 × 240", "unclicked.png": "no points", "misclicked.png": "NaN", "elsewhere.png": "no-such"}
    for name, words in said.items():
        assert rows[name]["verdict"] == "failed" and words in rows[name]["problem"], rows[name]
        assert rows[name]["fix"] and rows[name]["rms_mm"] is None and f"{name}: {rows[name]['problem']}" in out
    assert [name for name in rows if name not in said] == ["north-1.png", "north-2.png", "north-3.png"]


def test_a_kept_calibration_is_checked_by_edges_where_nothing_was_clicked(touchline, tmp_path):
    folder = folder_of(tmp_path / "archive", 2)
    touchline("calibrate", folder / "north-1.png", "--points", folder / "north-1.json", *BROWN, "-o", "cal.json")
    (folder / "north-2.json").unlink()
    assert batch(touchline, folder, "--calibration", "cal.json", "-o", "table.html")[0] == 0
    clicked, seen = table(tmp_path / "table.html").values()
    assert (clicked["judged_by"], seen["judged_by"]) == ("clicks and edges", "edges")
    assert {row["verdict"] for row in (clicked, seen)} <= {"good", "fair"} and seen["rms_mm"] is None
    assert abs(seen["distortion_before_pct"]) > 3 and abs(seen["distortion_after_pct"]) < 0.15


@pytest.mark.long
def test_a_kept_calibration_is_checked_by_clicks_and_by_edges(touchline, archive, tmp_path):
    """A knock turns the camera: edges stay straight and clicks tell. Another lens: edges tell without a click."""
    touchline("calibrate", archive / "north-1.png", "--points", archive / "north-1.json", *BROWN, "-o", "cal.json")
    for name in ("north-3.json",):
        (archive / name).unlink()
    picture(archive / "other-lens.png", 4, lens="pincushion")
    picture(archive / "turned.png", 5, roll_deg=2.0)
    picture(archive / "turned-unclicked.png", 5, roll_deg=2.0)
    clicks(archive / "turned.json", 5, roll_deg=2.0)
    cv2.imwrite(str(archive / "grey.png"), cv2.imread(str(archive / "north-1.png")) // 255 + 100)
    code, _, err = batch(touchline, archive, "--calibration", "cal.json", "-o", "table.html", "--enough", "good")
    assert (code, err) == (1, "")
    rows = table(tmp_path / "table.html")
    own, same, edges = (rows[f"north-{number}.png"] for number in (1, 2, 3))
    assert own["judged_by"] == same["judged_by"] == "clicks and edges" and edges["judged_by"] == "edges"
    assert own["held_out_mm"] is None and 0 < same["held_out_mm"] == same["rms_mm"] < 5
    assert {row["verdict"] for row in (own, same, edges)} <= {"good", "fair"} and edges["rms_mm"] is None
    assert abs(edges["distortion_before_pct"]) > 3 and abs(edges["distortion_after_pct"]) < 0.15
    other, turned = rows["other-lens.png"], rows["turned.png"]
    assert other["verdict"] == "poor" and other["judged_by"] == "edges" and other["worst_mm"] > 100
    assert turned["verdict"] == "poor" and turned["rms_mm"] > 50 and abs(turned["distortion_after_pct"]) < 0.3
    assert rows["turned-unclicked.png"]["verdict"] in ("good", "fair")  # what edges cannot see
    grey = rows["grey.png"]
    assert (grey["verdict"], grey["judged_by"]) == ("unknown", "") and grey["warnings"] and not grey["problem"]


def test_clicks_that_are_not_the_calibrations_are_told(touchline, archive, tmp_path):
    touchline("calibrate", archive / "north-1.png", "--points", archive / "north-1.json", *BROWN, "-o", "cal.json")
    clicks(archive / "north-1.json", region="half-left")
    clicks(archive / "north-2.json", image_size=[64, 48])
    given = json.loads((archive / "north-3.json").read_text())
    given["observations"][0]["points"][0] = [1e7, -1e7]
    (archive / "north-3.json").write_text(json.dumps(given))
    assert batch(touchline, archive, "-c", "cal.json", "-o", "table.json")[0] == 1
    rows = list(table(tmp_path / "table.json").values())
    assert "half-left" in rows[0]["problem"] and "640 × 480" in rows[1]["problem"]
    assert rows[2]["verdict"] == "poor" and "1 of 45 points" in rows[2]["warnings"][0]


def test_one_file_or_a_folder_of_clicks_serves_all(touchline, archive, tmp_path):
    common = clicks(tmp_path / "common.json")
    apart = tmp_path / "apart"
    apart.mkdir()
    for path in archive.glob("*.json"):
        path.rename(apart / f"{path.stem}.png.json")
    assert batch(touchline, archive, *HOMOGRAPHY)[0] == 1
    code, out, _ = batch(touchline, archive, *BROWN, "--points", apart)
    assert code == 0 and re.search("north-2.png: (good|fair), ", out), out
    assert batch(touchline, archive, *HOMOGRAPHY, "--points", common)[0] == 0


def test_the_command_line_that_cannot_be_meant_is_2_and_nothing_is_written(touchline, archive, tmp_path):
    (tmp_path / "empty").mkdir()
    (tmp_path / "text.json").write_text("{}")
    (tmp_path / "old.csv").write_text("a,b\n1,2\n")
    cases = [("nowhere",), ("empty",), (archive, "--field", "no-such"),
             (archive, "--field", "ssl-div-b", "--region", "x"), (archive, "--model", "no-such"),
             (archive, "-o", "table.txt"), (archive, "--resume"),
             (archive, "-c", "nowhere.json"), (archive, "-c", "text.json"), (archive, "--points", "nowhere"),
             (archive, "--workers", "0"), (archive, "--engine", "cluster"), (archive, "--option", "degree"),
             (archive, "-c", "text.json", "--model", "division"), (archive, "-o", "old.csv", "--resume")]
    before = sorted(tmp_path.rglob("*"))
    for words in cases:
        code, out, err = touchline("batch", *words)
        assert (code, out) == (2, "") and err, words
    assert sorted(tmp_path.rglob("*")) == before and (tmp_path / "old.csv").read_text() == "a,b\n1,2\n"


def test_what_is_the_same_is_not_computed_again(touchline, archive, tmp_path):
    batch(touchline, archive, *HOMOGRAPHY, "-o", "table.csv")
    first = table(tmp_path / "table.csv")
    (archive / "north-1.png").rename(archive / "south.png")
    (archive / "north-1.json").rename(archive / "south.json")
    clicks(archive / "north-2.json", 99)
    assert batch(touchline, archive, *HOMOGRAPHY, "-o", "table.csv", "--resume")[0] == 0
    second = table(tmp_path / "table.csv")
    assert second["south.png"] == {**first["north-1.png"], "picture": "south.png"}
    assert second["north-3.png"] == first["north-3.png"] and len(second) == 3
    assert second["north-2.png"]["inputs"] != first["north-2.png"]["inputs"]
    assert second["north-2.png"]["rms_mm"] != first["north-2.png"]["rms_mm"]
    batch(touchline, archive, "--model", "division", "-o", "table.csv", "--resume")
    assert not {row["inputs"] for row in table(tmp_path / "table.csv").values()} & {
        row["inputs"] for row in second.values()}


ROWS = [row_of(picture="=1+1.png", verdict="good", judged_by="fit", rms_mm=1 / 3, worst_mm=-0.0, sha256="ab",
               inputs="cd", warnings=['Here, a "comma".', "And | a line\nbreak <b>."], seconds=1e-9),
        row_of(picture="ß</script>.png", verdict="failed", problem="@ & <i>", fix="-")]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_table_is_read_as_it_was_written_and_no_cell_is_a_formula(suffix):
    data = encode_table(ROWS, suffix)
    back = read_table(data, suffix)
    assert [{**row, "warnings": " | ".join(row["warnings"])} for row in back] == [
        {**row, "warnings": " | ".join(row["warnings"])} for row in ROWS]
    if suffix == ".csv":
        cells = list(csv.reader(data.decode().splitlines(keepends=True)))
        assert tuple(cells[0]) == tuple(COLUMNS) and cells[1][0] == "'=1+1.png"
    if suffix == ".html":
        assert data.count(b"</script>") == 1 and b"<i>" not in data and b"<b>" not in data


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_damaged_or_foreign_table_is_refused(suffix):
    data = encode_table(ROWS, suffix)
    for bad in (b"", b"\xff\xfe\0", data[:len(data) // 2], data.replace(b"verdict", b"vertigo"), b"[" * 100_000,
                data.replace(b"0.333", b"nan or 0.333"), data.replace(b"0.3333333333333333", b"1e999")):
        if suffix == ".csv" and bad == data[:len(data) // 2]:
            continue  # half a CSV may be a shorter one
        with pytest.raises(BadInput):
            read_table(bad, suffix)


def test_more_pictures_than_may_wait_are_fed_as_there_is_room():
    asked = [BatchRequest(f"{number}.png", "", "", sample_jobs.adds, {"a": number, "b": 0}) for number in range(70)]
    asked[7] = row_of(picture="7.png", verdict="failed")
    with JobEngine(2) as jobs:
        rows = list(run_requests(jobs, 60, asked))
    assert sorted(int(row["picture"].split(".")[0]) for row in rows) == list(range(70))


def test_a_picture_whose_worker_dies_is_a_row_that_another_run_does_again():
    asked = [BatchRequest("bad.png", "ab", "cd", sample_jobs.dies, {"how": "SIGKILL"}),
             BatchRequest("slow.png", "ab", "cd", sample_jobs.adds, {"a": 1, "b": 1})]
    with JobEngine(1) as jobs:
        rows = {row["picture"]: row for row in run_requests(jobs, 1, asked)}
    assert rows["bad.png"]["verdict"] == "failed" and rows["bad.png"]["inputs"] == "" and rows["bad.png"]["fix"]
    assert rows["slow.png"]["inputs"] == "cd"


@pytest.mark.long
def test_the_real_archive_beside_the_project_is_gone_through(touchline, real_data, tmp_path):
    """The half field of 2008: straight edges confirm what its clicks say; a picture of another camera is refused."""
    folder = tmp_path / "real"
    folder.mkdir()
    (folder / "half.jpg").write_bytes(real_data("fields/ssl_2008/ssl-field-2008.jpg").read_bytes())
    points = CLICKS / "ssl_2008_half.json"
    touchline("calibrate", folder / "half.jpg", "--points", points, *BROWN, "-o", "cal.json")
    (folder / "other.jpg").write_bytes(real_data("fields/agh_mirosot/img/a_1.jpg").read_bytes())
    code, _, _ = batch(touchline, folder, "-c", "cal.json", "--points", points, "-o", "table.json")
    rows = table(tmp_path / "table.json")
    assert rows["half.jpg"]["held_out_mm"] is None and rows["half.jpg"]["rms_mm"] < 10 and code == 1
    assert rows["half.jpg"]["judged_by"] == "clicks and edges" and abs(rows["half.jpg"]["distortion_after_pct"]) < 0.6
    assert rows["other.jpg"]["verdict"] == "failed" and rows["other.jpg"]["fix"]

