"""The wheel without extras, installed in an environment of its own: the help and the smallest use of every command."""

import json
import subprocess
from pathlib import Path

import pytest

from tests.support.command_desk import laid_out
from tests.support.installed import clean_environment, installed_python
from tests.support.waiting import LONG_S
from touchline.capabilities import commands

USES = {  # of every command that ends by itself, in this order: what one writes, another reads
    "calibrate": "pictures/north-1.png --points pictures/north-1.json --model division -o cal.json",
    "auto": "pictures/north-1.png --field ssl-div-b -o auto.json",
    "call": "GET /health --temporary",
    "correct": "pictures/north-1.png --calibration cal.json -o corrected.png",
    "transform": "--calibration cal.json --from image --to field 320.5,240",
    "report": "cal.json --enough any -o report.html",
    "export": "cal.json --format json -o again.json",
    "import": "again.json -o imported.json",
    "turn": "cal.json --turn 180 -o turned.json",
    "check": "cal.json pictures/north-1.png --enough any",
    "board": "board0.png board1.png board2.png board3.png board4.png --columns 9 --rows 6 --square-mm 25 "
    "--option terms=[] --option warp=false -o lens.json",
    "archive": "all.zip --data empty",
    "restore": "all.zip --data restored",
    "restore-backup": "--data kept",
}
RUN = """
import contextlib, io, json, sys
from touchline.cli import main
told = {}
for name, words in json.loads(sys.argv[1]).items():
    out, err = io.StringIO(), io.StringIO()
    sys.argv = ["touchline", *words]
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            main()
        except SystemExit as end:
            told[name] = end.code or 0, out.getvalue(), err.getvalue()
print(json.dumps(told))
"""


@pytest.fixture(scope="module")
def desk(tmp_path_factory) -> Path:
    return laid_out(tmp_path_factory.mktemp("desk"))


def run(folder: Path, uses: dict[str, list[str]]) -> dict[str, tuple[int, str, str]]:
    """Run commands one after the other in one process, which imports OpenCV once: exit code, stdout, stderr of each."""
    done = subprocess.run(
        [installed_python(), "-c", RUN, json.dumps(uses)],
        cwd=folder,
        env=clean_environment(),
        capture_output=True,
        text=True,
        timeout=10 * LONG_S,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_every_command_tells_its_own_help(tmp_path):
    told = run(tmp_path, {name: [name, "--help"] for name in commands()})
    assert not {
        name: done
        for name, done in told.items()
        if done[0] or done[2] or f"touchline {name}" not in done[1]
    }


def test_every_command_that_ends_does_its_smallest_job(desk):
    assert {*USES, "serve", "demo"} == {*commands()}
    told = run(desk, {name: [name, *words.split()] for name, words in USES.items()})
    assert not {name: done for name, done in told.items() if done[0] or "Traceback" in done[2]}
