"""Commands of an earlier version: what each was given, the calls that take its place, and the figures of both.

python -m tests.support.former_commands CHECKOUT     writes the figures anew, by a checkout that still has them
"""

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tests.support.command_desk import laid_out
from tests.support.paths import TESTS

FIGURES = TESTS / "golden" / "former_commands.json"
BEFORE = (  # what commands that stay write for them
    "calibrate pictures/north-1.png --points pictures/north-1.json --model division -o cal.json",
    "calibrate pictures/north-1.png --points pictures/north-1.json --model homography -o plain.json",
)


@dataclass(frozen=True)
class FormerCommand:
    """words: of the command; calls: the file of calls in its place; figures: where they are in both answers.

    within: the entry of the calls' answer that has what the command answered.
    """

    words: str
    calls: str
    figures: tuple[str, ...]
    within: str | None = None


FORMER = {
    "pair": FormerCommand(
        "pair matches.json --a left.json --b right.json --json",
        """a = POST /calibrations/import file=@left.json
           b = POST /calibrations/import file=@right.json
           POST /pairs @matches.json calibration_a=${a.id} calibration_b=${b.id}""",
        (
            "fundamental.rms_px",
            "fundamental.matrix.0.2",
            "agreement.verdict.level",
            "agreement.median_mm",
            "calibrated.median_px",
        ),
    ),
    "rig": FormerCommand(
        "rig check left.json right.json --matches rows.json --json",
        """left = POST /cameras id=left source=sim://ssl-div-b
           right = POST /cameras id=right source=sim://ssl-div-b
           a = POST /calibrations/import file=@left.json camera=left
           b = POST /calibrations/import file=@right.json camera=right
           POST /calibrations/${a.id}/activate > activated.json
           POST /calibrations/${b.id}/activate > activated.json
           rig = PUT /rigs/hall {"title": "Hall", "field": "ssl-div-b", "cameras": ["left", "right"]}
           POST /rigs/hall/check @rig_check.json pictures=none""",
        (
            "verdict.level",
            "pairs.0.from",
            "pairs.0.agreement.n",
            "pairs.0.agreement.carpet.p95_mm",
            "pairs.0.agreement.hat.p95_mm",
        ),
    ),
    "straight": FormerCommand(
        "straight bars.png --json",
        """picture = POST /snapshots file=@bars.png
           POST /straightness {"snapshots": ["${picture.id}"]}""",
        ("distortion", "lens.terms.k", "bow.most.px", "straightness_px.after"),
    ),
    "motion": FormerCommand(
        "motion film.avi --json",
        "POST /motion film=film.avi",
        ("rolls", "raw.border_pct", "raw.k"),
        within="report",
    ),
    "detect": FormerCommand(
        "detect pictures/north-1.png --calibration cal.json --json",
        """picture = POST /snapshots file=@pictures/north-1.png
           calibration = POST /calibrations/import file=@cal.json
           POST /detections snapshot=${picture.id} calibration=${calibration.id}""",
        (
            "detections.0.team",
            "detections.0.id",
            "detections.0.x_mm",
            "detections.0.covariance_mm2.0.0",
        ),
    ),
    "compare": FormerCommand(
        "compare pictures/north-1.png --points pictures/north-1.json --models polynomial,division --json",
        """picture = POST /snapshots file=@pictures/north-1.png
           POST /calibrations/compare @compare.json snapshot=${picture.id} 'models=["polynomial", "division"]'
        """,
        ("recommended", "ranking.0.field_mm", "ranking.1.held_out_mm"),
    ),
    "difference": FormerCommand(
        "difference cal.json plain.json --json",
        """one = POST /calibrations/import file=@cal.json
           other = POST /calibrations/import file=@plain.json
           GET /calibrations/${one.id}/difference/${other.id}.json""",
        ("rms_mm", "max_mm", "max_px", "worst_place.0"),
    ),
    "uncertainty": FormerCommand(
        "uncertainty cal.json --z 150 --json",
        """calibration = POST /calibrations/import file=@cal.json
           GET /calibrations/${calibration.id}/uncertainty.json z_mm=150""",
        ("z_mm", "rms", "median", "max"),
    ),
}


def lay_out(folder: Path) -> None:
    """Write what the commands and the calls read."""
    laid_out(folder)
    matches = json.loads((folder / "matches.json").read_text())
    (folder / "rig_check.json").write_text(
        json.dumps({"matches": [{"a": "left", "b": "right", **matches}]})
    )
    clicked = json.loads((folder / "pictures" / "north-1.json").read_text())
    wanted = {name: clicked[name] for name in ("field", "region", "observations")}
    (folder / "compare.json").write_text(json.dumps(wanted))


def figures_of(former: FormerCommand, answer: Any) -> dict[str, Any]:
    """Return the figures of an answer by their place in it."""
    return {path: _entry(answer, path) for path in former.figures}


def _entry(value: Any, path: str) -> Any:
    for name in path.split("."):
        value = value[int(name)] if isinstance(value, list) else value[name]
    return value


def _by_commands(checkout: Path) -> Mapping[str, Any]:
    program = [sys.executable, "-c", "from touchline.cli import main; main()"]
    environment = {**os.environ, "PYTHONPATH": str(checkout / "app")}
    with TemporaryDirectory() as name:
        lay_out(Path(name))

        def told(words: str) -> str:
            return subprocess.run(
                [*program, *words.split()],
                cwd=name,
                env=environment,
                check=True,
                capture_output=True,
                text=True,
            ).stdout

        for words in BEFORE:
            told(words)
        return {
            command: figures_of(former, json.loads(told(former.words)))
            for command, former in FORMER.items()
        }


if __name__ == "__main__":
    FIGURES.write_text(json.dumps(_by_commands(Path(sys.argv[1]).resolve()), indent=1) + "\n")
