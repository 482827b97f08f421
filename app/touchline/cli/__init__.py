"""The command line. It calls the same workflows as REST, so the same input gives the same numbers.

A command's module is imported when the command is run, and only then: the table of capabilities names it, with its line
in the help.

    console.py    errors with their fix on stderr, exit codes, removed commands
    progress.py   the progress bar
    files.py      points, calibrations, lenses and pictures from files and to files
    requests.py   the options of a fit, shared by several commands
    archive.py    settings, and the data folder of a server that does not run
"""

import signal
import sys
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command

from touchline.capabilities import commands, find_command
from touchline.cli.console import EXIT_CODES, REMOVED, exit_code_of, removed_command
from touchline.core.registry import load
from touchline.installation import __version__


class LazyGroup(TyperGroup):
    """The commands of the table of capabilities."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of all commands."""
        return list(commands())

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Import the command's module and return its command; None for an unknown one."""
        if cmd_name in REMOVED:
            return removed_command(cmd_name)
        target = find_command(cmd_name)
        if target is None:
            return None
        command = load(target)
        if isinstance(command, typer.Typer):
            return get_command(command)
        single = typer.Typer(add_completion=False, rich_markup_mode=None)
        is_transform = cmd_name == "transform"  # where -10,20 is a point
        single.command(cmd_name, context_settings={"ignore_unknown_options": is_transform})(command)
        return get_command(single)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the list of commands without importing them."""
        lines = {name: TyperCommand(name, help=line) for name, (_, line) in commands().items()}
        limit = formatter.width - 6 - max(map(len, lines))
        with formatter.section("Commands"):
            formatter.write_dl(
                [(name, command.get_short_help_str(limit)) for name, command in lines.items()]
            )


cli = typer.Typer(
    cls=LazyGroup,
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    help="Calibrate the cameras above a robot-soccer field.",
    epilog=EXIT_CODES,
)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"touchline {__version__}")
        raise typer.Exit


@cli.callback()
def _touchline(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version and exit."
        ),
    ] = False,
) -> None:
    """Calibrate the cameras above a robot-soccer field."""


def main() -> None:
    """Run a command; every error ends as a sentence and an exit code."""
    # Ctrl-C ends a command also where whoever started it ignores it, as nohup and a shell's & do.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        cli(standalone_mode=True)
    except Exception as error:
        sys.exit(exit_code_of(error))
