"""The wheel without extras, installed in an environment of its own: the help and the smallest use of every command."""

import json
import subprocess
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.support import batch_pictures, pair_over_field
from tests.support.bar_pictures import BENT, bars_behind
from tests.support.board_views import picture_of
from tests.support.group_listener import free_group
from tests.support.installed import clean_environment, installed_python
from tests.support.rolling_balls import FPS, SIZE, film, lens_of
from tests.support.waiting import LONG_S
from touchline.cli import COMMANDS
from touchline.core.board import Board
from touchline.formats import FORMATS
from touchline.store.store import Store

BOARD = Board("chessboard", 9, 6, 25.0)
USES = {  # of every command that ends by itself, in this order: what one writes, another reads
    "calibrate": "pictures/north-1.png --points pictures/north-1.json --model division -o cal.json",
    "auto": "pictures/north-1.png --field ssl-div-b -o auto.json",
    "correct": "pictures/north-1.png --calibration cal.json -o corrected.png",
    "transform": "--calibration cal.json --from image --to field 320.5,240",
    "compare": "pictures/north-1.png --points pictures/north-1.json",
    "difference": "cal.json auto.json",
    "uncertainty": "cal.json",
    "report": "cal.json --enough any -o report.html",
    "scene": "cal.json -o scene.html",
    "export": "cal.json --format json -o again.json",
    "import": "again.json -o imported.json",
    "check": "cal.json pictures/north-1.png --enough any",
    "detect": "pictures/north-1.png --calibration cal.json",
    "straight": "bars.png",
    "board": "board0.png board1.png board2.png board3.png board4.png --columns 9 --rows 6 --square-mm 25 "
             "--option terms=[] --option warp=false -o lens.json",
    "pair": "matches.json --a left.json --b right.json",
    "rig": "check left.json right.json --matches rows.json --enough any",
    "motion": "film.avi",
    "batch": "pictures --model homography --enough any -o table.html",
    "publish": "left.json --approve",
    "absorb": "--for 0.1",
    "archive": "all.zip --data empty",
    "restore": "all.zip --data restored",
    "restore-backup": "--data kept",
}
ON_THE_NETWORK = ("publish", "absorb")
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
    """A folder with all that the commands read."""
    folder = tmp_path_factory.mktemp("desk")
    batch_pictures.folder_of(folder / "pictures", 1)
    cv2.imwrite(str(folder / "bars.png"), bars_behind(BENT))
    rng = np.random.default_rng(0)
    for number in range(5):
        turn = rng.uniform(-0.3, 0.3)
        c, s = 2.6 * np.cos(turn), 2.6 * np.sin(turn)
        board_from_mm = np.array([[c, -s, 180 + rng.uniform(0, 100)], [s, c, 180 + rng.uniform(0, 60)],
                                  [*rng.uniform(-6e-4, 6e-4, 2), 1]])
        cv2.imwrite(str(folder / f"board{number}.png"), picture_of(BOARD, board_from_mm))
    left, right = pair_over_field.matches()
    (folder / "matches.json").write_text(json.dumps({"points_a": left, "points_b": right}))
    (folder / "rows.json").write_text(json.dumps([[*a, *b] for a, b in zip(left, right, strict=True)]))
    for name, calibration in zip(("left", "right"), pair_over_field.calibrations(), strict=True):
        (folder / f"{name}.json").write_bytes(FORMATS["json"].write(calibration))
    writer = cv2.VideoWriter(str(folder / "film.avi"), cv2.VideoWriter.fourcc(*"MJPG"), FPS, tuple(SIZE))
    for _, pixels in film(lens_of(-0.25), [((60, 60), (560, 90), 30), ((80, 420), (560, 300), 30)]):
        writer.write(pixels)
    writer.release()
    (folder / "empty").mkdir()
    with Store(folder / "kept") as store:  # which backs up what it has saved
        store.calibrations.add(pair_over_field.calibrations()[0])
    return folder


def run(folder: Path, uses: dict[str, list[str]]) -> dict[str, tuple[int, str, str]]:
    """Run commands one after the other in one process, which imports OpenCV once: exit code, stdout, stderr of each."""
    done = subprocess.run([installed_python(), "-c", RUN, json.dumps(uses)], cwd=folder, env=clean_environment(),
                          capture_output=True, text=True, timeout=10 * LONG_S)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_every_command_tells_its_own_help(tmp_path):
    told = run(tmp_path, {name: [name, "--help"] for name in COMMANDS})
    assert not {name: done for name, done in told.items() if done[0] or done[2] or f"touchline {name}" not in done[1]}


def test_every_command_that_ends_does_its_smallest_job(desk):
    assert {*USES, "serve", "demo"} == {*COMMANDS}
    group = free_group()
    network = [f"--{name}={group[name]}" for name in ("group", "port", "interface")]
    told = run(desk, {name: [name, *words.split(), *(network if name in ON_THE_NETWORK else ())]
                      for name, words in USES.items()})
    assert not {name: done for name, done in told.items() if done[0] or "Traceback" in done[2]}
