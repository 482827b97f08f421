"""The command line. It calls the same workflows as REST, so the same input gives the same numbers.

A command's module is imported when the command is run, and only then: COMMANDS names it, with its line in the help.

    console.py    errors with their fix on stderr, exit codes
    progress.py   the progress bar
    files.py      points, calibrations, lenses and pictures from files and to files
    requests.py   the options of a fit, shared by several commands
    archive.py    settings, and the data folder of a server that does not run
"""

import signal
import sys
from importlib import import_module
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command

from touchline.cli.console import EXIT_CODES, exit_code_of
from touchline.cli.removed_commands import REMOVED, removed_command
from touchline.installation import __version__

COMMANDS = {  # name: (module:function in this package, the first line of its help)
    "serve": ("server:serve", "Serve the dashboard and REST."),
    "demo": ("server:demo", "Serve a simulated field camera behind a real lens model, ready to calibrate."),
    "call": ("call:call", "Make calls of the REST interface, in this process or to a running server."),
    "archive": ("archive:archive", "Write all saved data to one zip file."),
    "restore": ("archive:restore", "Restore an archive to an empty folder and an empty database."),
    "restore-backup": ("archive:restore_backup", "Restore the newest backup without damage. The current database "
                                                 "moves to quarantine."),
    "calibrate": ("calibration:calibrate", "Calibrate one image from points."),
    "auto": ("auto:auto", "Detect the field lines in an image and calibrate from them, if all checks pass."),
    "check": ("checking:check", "Compare the field lines with a calibration. Exit code 5 if it is below --enough."),
    "correct": ("calibration:correct", "Correct one image."),
    "transform": ("calibration:transform", "Convert pixels to field millimetres, or back."),
    "board": ("lenses:board", "Calibrate a lens from images of a board, for calibrate --lens."),
    "export": ("exports:export", "Write a calibration in the format of another program."),
    "import": ("exports:import_file", "Read a file of another program."),
    "report": ("reports:report", "Show or write the report of one calibration. Exit code 0 if it is good enough."),
}

class LazyGroup(TyperGroup):
    """The commands of COMMANDS."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        self.commands = {name: TyperCommand(name, help=line) for name, (_, line) in COMMANDS.items()}

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Import the command's module and return its command; None for an unknown one."""
        if cmd_name in REMOVED:
            return removed_command(cmd_name)
        if cmd_name not in COMMANDS:
            return None
        module, _, name = COMMANDS[cmd_name][0].partition(":")
        command = getattr(import_module(f"touchline.cli.{module}"), name)
        if isinstance(command, typer.Typer):
            return get_command(command)
        single = typer.Typer(add_completion=False, rich_markup_mode=None)
        is_transform = cmd_name == "transform"  # where -10,20 is a point
        single.command(cmd_name, context_settings={"ignore_unknown_options": is_transform})(command)
        return get_command(single)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the list of commands without importing them."""
        limit = formatter.width - 6 - max(map(len, COMMANDS))
        with formatter.section("Commands"):
            formatter.write_dl([(name, command.get_short_help_str(limit)) for name, command in self.commands.items()])


cli = typer.Typer(cls=LazyGroup, no_args_is_help=True, add_completion=False, rich_markup_mode=None,
                  help="Calibrate the cameras above a robot-soccer field.", epilog=EXIT_CODES)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"touchline {__version__}")
        raise typer.Exit


@cli.callback()
def _touchline(version: Annotated[bool, typer.Option("--version", callback=_print_version, is_eager=True,
                                                     help="Print the version and exit.")] = False) -> None:
    """Calibrate the cameras above a robot-soccer field."""


def main() -> None:
    """Run a command; every error ends as a sentence and an exit code."""
    # Ctrl-C ends a command also where whoever started it ignores it, as nohup and a shell's & do.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        cli(standalone_mode=True)
    except Exception as error:
        sys.exit(exit_code_of(error))
