"""The shell door: the same floors below as the REST door, so the same input gives the same numbers.

    words.py        what goes to stderr: errors with their fix, a progress bar; the exit codes
    files.py        points, calibrations, lenses and pictures from files and to files
    tasks.py        what a fit's options on the command line mean
    calibration.py  calibrate, correct, transform
    judging.py      compare, difference, uncertainty
    reports.py      report
    scenes.py       scene
    exports.py      export, import
    boards.py       board
    pairs.py        pair
    rigs.py         rig check, rig stitch
    straight.py     straight
    motion.py       motion
    auto.py         auto
    detection.py    detect
    checking.py     check
    archives.py     batch
    network.py      publish, absorb
    server.py       serve, demo
    keeping.py      archive, restore
"""

import sys
from typing import Annotated

import typer

from app import __version__
from app.cli import (
    archive,
    auto,
    batch,
    boards,
    calibration,
    checking,
    detection,
    evaluation,
    exports,
    motion,
    network,
    pairs,
    reports,
    rigs,
    scenes,
    server,
    straight,
)
from app.cli.console import EXIT_CODES, exit_code_of

cli = typer.Typer(no_args_is_help=True, add_completion=False, rich_markup_mode=None,
                  help="Calibrate the cameras above a robot-soccer field.", epilog=EXIT_CODES)
cli.command()(server.serve)
cli.command()(server.demo)
cli.command()(archive.archive)
cli.command()(archive.restore)
cli.command()(calibration.calibrate)
cli.command()(calibration.correct)
cli.command()(evaluation.compare)
cli.command()(evaluation.difference)
cli.command()(evaluation.uncertainty)
cli.command()(reports.report)
cli.command()(scenes.scene)
cli.command()(exports.export)
cli.command("import")(exports.import_file)
cli.command()(network.publish)
cli.command()(network.absorb)
cli.command()(boards.board)
cli.command()(pairs.pair)
cli.add_typer(rigs.rig, name="rig")
cli.command()(straight.straight)
cli.command()(motion.motion)
cli.command()(auto.auto)
cli.command()(detection.detect)
cli.command()(checking.check)
cli.command()(batch.batch)
cli.command(context_settings={"ignore_unknown_options": True})(calibration.transform)  # -10,20 is a point


def _tell_version(asked: bool) -> None:
    if asked:
        typer.echo(f"touchline {__version__}")
        raise typer.Exit


@cli.callback()
def _touchline(version: Annotated[bool, typer.Option("--version", callback=_tell_version, is_eager=True,
                                                     help="Print the version and end.")] = False) -> None:
    """Calibrate the cameras above a robot-soccer field."""


def main() -> None:
    """Run a command; every error ends as a sentence and an exit code."""
    try:
        cli(standalone_mode=True)
    except Exception as error:
        sys.exit(exit_code_of(error))
