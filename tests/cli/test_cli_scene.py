"""touchline scene: the page in 3-D of one calibration, and of what moved since another."""

import json

import pytest

from tests.support.rig_over_field import sim_task
from touchline.formats import FORMATS


@pytest.fixture
def calibration(tmp_path):
    task = sim_task(2, 0)
    path = tmp_path / "cal.json"
    path.write_bytes(FORMATS["json"].write(task.record(task.run(cross_validate=False))))
    return path


def test_a_page_is_written_and_nothing_else_is_said(touchline, calibration, tmp_path):
    record = json.loads(calibration.read_text())
    record.get("calibration", record)["model"]["parameters"]["position_mm"][0] += 30
    (tmp_path / "old.json").write_text(json.dumps(record))
    code, out, err = touchline("scene", calibration, "--before", "old.json", "--dark", "-o", "scene.html")
    assert (code, out, err) == (0, "Saved as scene.html.\n", "")
    page = (tmp_path / "scene.html").read_text()
    assert "__VISER_EMBED_DATA__" in page and "<title>Scene of cam0, version 1</title>" in page


def test_a_file_that_is_no_calibration_is_refused(touchline, tmp_path):
    (tmp_path / "no.json").write_text("{}")
    code, _, err = touchline("scene", "no.json", "-o", "scene.html")
    assert code == 3 and "fix:" in err and not (tmp_path / "scene.html").exists()
