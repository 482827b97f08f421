"""What a command shows besides its result: errors with their fix on stderr, exit codes, and removed commands."""

import sys
import traceback
from enum import StrEnum
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from touchline.core.errors import TouchlineError

UNEXPECTED, USAGE, REFUSED, FILE, POOR = 1, 2, 3, 4, 5
FILE_REASONS = (
    "port-taken",
    "data-folder",
    "data-folder-in-use",
    "not-saved",
    "disk-full",
    "no-settings-file",
    "database-damaged",
    "database-missing",
    "database-away",
    "newer-database",
    "folder-not-empty",
    "database-not-empty",
    "restore-unfinished",
    "no-archive",
    "no-good-backup",
    "no-own-backups",
    "no-interface",
    "no-route",
    "forbidden",
    "network",
)
EXIT_CODES = (
    "Exit codes: 0 done; 1 internal error; 2 wrong command line; 3 the input was refused (points, image, "
    "field, settings); 4 a file, folder, port or network cannot be used; 5 report, check, call: the "
    "verdict is below --enough."
)

REMOVED = {  # what is a file in the call must be JSON as the REST description has it
    "pair": "touchline call POST /pairs @pair.json",
    "rig": "touchline call POST /rigs/NAME/check, or GET /rigs/NAME/stitched.png --out hall.png",
    "straight": "touchline call POST /straightness @straightness.json",
    "motion": "touchline call POST /motion film=FILM.mp4",
    "publish": "touchline call --server URL PUT /publishing enabled=true",
    "absorb": "touchline call --server URL GET /publishing/heard",
    "detect": "touchline call POST /detections @detections.json",
    "compare": "touchline call POST /calibrations/compare @compare.json",
    "difference": "touchline call GET /calibrations/ID/difference/OTHER.json",
    "uncertainty": "touchline call GET /calibrations/ID/uncertainty.json",
    "scene": "touchline call GET /calibrations/ID/scene.html --out scene.html",
    "batch": "the script of the help page Scripts in Python that calibrates every image of a folder",
}
HELP = "The help page Shell commands describes it under Removed commands."


class FileTrouble(TouchlineError):
    """A file that cannot be read or written, or a port that is taken."""

    reason = "file-trouble"


def exit_code_of(error: Exception) -> int:
    """Print what went wrong and what to do; return the exit code for it."""
    if isinstance(error, BrokenPipeError):
        return 0  # whoever reads our output has had enough
    if isinstance(error, OSError):
        error = FileTrouble(
            f"{error.filename or 'A file'}: {error.strerror or error}.",
            "Check the path, its permissions and the free disk space.",
        )
    if isinstance(error, TouchlineError):
        print(f"error: {error.what}\nfix: {error.fix}", file=sys.stderr)
        return FILE if isinstance(error, FileTrouble) or error.reason in FILE_REASONS else REFUSED
    traceback.print_exception(error)
    print(
        "error: An internal error occurred.\nfix: Report it with the lines above.", file=sys.stderr
    )
    return UNEXPECTED


class Enough(StrEnum):
    """The verdict that a script is content with."""

    good = "good"
    fair = "fair"
    any = "any"


ACCEPTED = {
    Enough.good: {"good"},
    Enough.fair: {"good", "fair"},
    Enough.any: {"good", "fair", "poor", "unknown"},
}
EnoughOption = Annotated[
    Enough, typer.Option("--enough", help=f"Exit code {POOR} for a verdict below this.")
]


def exit_below(enough: Enough, level: str | None) -> None:
    """End with POOR where the verdict is below what is enough. level: None for an unknown one."""
    if (level or "unknown") not in ACCEPTED[enough]:
        raise typer.Exit(POOR)


def say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def removed_command(name: str) -> TyperCommand:
    """Return a command that takes any words, and says what took its place."""

    def replaced(**_: Any) -> None:
        say(f"error: touchline {name} was removed.\nfix: Use {REMOVED[name]}. {HELP}")
        raise typer.Exit(USAGE)

    return TyperCommand(
        name,
        callback=replaced,
        hidden=True,
        add_help_option=False,
        context_settings={
            "ignore_unknown_options": True,
            "allow_extra_args": True,
            "help_option_names": [],
        },
    )
