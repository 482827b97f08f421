"""What a command says besides its result: errors with their fix on stderr, exit codes, also for a poor verdict."""

import sys
import traceback
from enum import StrEnum
from typing import Annotated

import typer

from touchline.core.errors import TouchlineError

UNEXPECTED, USAGE, REFUSED, FILE, POOR = 1, 2, 3, 4, 5
FILE_REASONS = ("port-taken", "data-folder", "data-folder-in-use", "not-saved", "disk-full", "no-settings-file",
                "database-damaged", "database-missing", "database-away", "newer-database", "folder-not-empty",
                "database-not-empty", "restore-unfinished", "no-archive", "no-good-backup", "no-own-backups",
                "no-interface", "no-route", "forbidden", "network")
EXIT_CODES = ("Exit codes: 0 done; 1 internal error; 2 wrong command line; 3 the input was refused (points, image, "
              "field, settings); 4 a file, folder, port or network cannot be used; 5 report, check, call: the "
              "verdict is below --enough.")


class FileTrouble(TouchlineError):
    """A file that cannot be read or written, or a port that is taken."""

    reason = "file-trouble"


def exit_code_of(error: Exception) -> int:
    """Print what went wrong and what to do; return the exit code for it."""
    if isinstance(error, BrokenPipeError):
        return 0  # whoever reads our output has had enough
    if isinstance(error, OSError):
        error = FileTrouble(f"{error.filename or 'A file'}: {error.strerror or error}.",
                            "Check the path, its permissions and the free disk space.")
    if isinstance(error, TouchlineError):
        print(f"error: {error.what}\nfix: {error.fix}", file=sys.stderr)
        return FILE if isinstance(error, FileTrouble) or error.reason in FILE_REASONS else REFUSED
    traceback.print_exception(error)
    print("error: An internal error occurred.\nfix: Report it with the lines above.", file=sys.stderr)
    return UNEXPECTED


class Enough(StrEnum):
    """The verdict that a script is content with."""

    good = "good"
    fair = "fair"
    any = "any"


ACCEPTED = {Enough.good: {"good"}, Enough.fair: {"good", "fair"}, Enough.any: {"good", "fair", "poor", "unknown"}}
EnoughOption = Annotated[Enough, typer.Option("--enough", help=f"Exit code {POOR} for a verdict below this.")]


def exit_below(enough: Enough, level: str | None) -> None:
    """End with POOR where the verdict is below what is enough. level: None for an unknown one."""
    if (level or "unknown") not in ACCEPTED[enough]:
        raise typer.Exit(POOR)


def say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)
