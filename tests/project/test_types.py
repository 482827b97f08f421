"""The types of app/ and of tests/support, as the type checker reads them; the rules are in pyproject.toml."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

from tests.support.paths import PACKAGE, ROOT

# By package, a wrong call: points for a size, millimetres for a name, or what may be missing handed on unguarded.
PLANTED = {
    "api.responses": "created({}, mm)",
    "automatic.hypotheses": "outline_about(name)",
    "cli.files": "read_bytes(maybe_folder)",
    "boards.poses": "cell_counts(points, maybe_size)",
    "capabilities": "find_command(mm)",
    "client.client": "to_server(mm)",
    "core.geometry": "inside_picture(points, points)",
    "detection.detect": "field_area(name, name)",
    "evaluate.distortion": "distortion_kind(name)",
    "drift.check": "verdict_in(points, name)",
    "fields.tidying": "scaled(name, mm)",
    "fitting": "sensitivity_of(points)",
    "formats.ssl_field": "field_to_wire(name)",
    "images.limits": "checked_size(1280, mm, touchline.images.limits.ImageLimits())",
    "imaging.correction": "CorrectedView().size(size)",
    "installation": "shipped(mm)",
    "jobs.engine": "current_name(mm)",
    "league.packet_camera": "packet_camera(mm)",
    "live.picture": "scaled_down(points, 640)",
    "main": "create_app(name)",
    "models": "model_from_json(maybe_name, {})",
    "network.address": "MulticastAddress(mm)",
    "processes.framing": "encode_body(points)",
    "referee.heights": "folded(mm)",
    "report.page": "data_address(points, name)",
    "rigs.mosaic": "FieldView(mm, name)",
    "scene.shapes": "paint(name)",
    "services.result_savers": "save_new_version(name, name, name)",
    "settings": "load_settings(name)",
    "sources": "source_from_url(mm, touchline.sources.SourceContext())",
    "ssl_protocol.ssl_vision_pb2": "SSL_GeometryCameraCalibration(mm, name)",
    "store.integrity": "json_text({}, maybe_name)",
    "straight.search": "initial_bend(name, points)",
    "vision.sharpness": "measure_sharpness(points)",
    "workflows.calibration": "check_size(name, name)",
}
AMONG = """
def planted(points: touchline.core.geometry.Points, size: touchline.core.geometry.ImageSize, mm: float, name: str,
            folder: Path, maybe_size: touchline.core.geometry.ImageSize | None, maybe_folder: Path | None,
            maybe_name: str | None) -> None:
"""


def mypy(*arguments: str) -> str:
    command = shutil.which("mypy", path=str(Path(sys.executable).parent)) or shutil.which("mypy")
    assert command, "mypy is missing: install the dev extra (pip install -e '.[dev]')"
    return subprocess.run([command, *arguments], cwd=ROOT, capture_output=True, text=True).stdout


def test_all_types_fit():
    found = mypy()
    assert found.startswith("Success: "), found


def test_a_wrong_call_into_any_package_is_refused(tmp_path):
    assert {module.partition(".")[0] for module in PLANTED} == {
        path.stem for path in (PACKAGE).iterdir() if not path.stem.startswith("_")
    }
    before = [
        "from pathlib import Path",
        *(f"import touchline.{module}" for module in PLANTED),
        *AMONG.splitlines(),
    ]
    planted = tmp_path / "planted.py"
    calls = (f"    touchline.{module}.{call}" for module, call in PLANTED.items())
    planted.write_text("\n".join([*before, *calls, ""]))
    found = re.findall(r"planted\.py:(\d+): error: .*\[(.+)\]$", mypy(str(planted)), re.M)
    assert set(found) == {(str(len(before) + n), "arg-type") for n in range(1, 1 + len(PLANTED))}
