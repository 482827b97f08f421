"""What a command says besides its result, all of it on stderr: errors with their fix, and how far it has come."""

import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager

from app.core.errors import TouchlineError
from app.core.progress import Progress

UNEXPECTED, USAGE, REFUSED, FILE = 1, 2, 3, 4
FILE_REASONS = ("port-taken", "data-folder", "data-folder-in-use", "not-saved", "disk-full", "no-settings-file",
                "database-damaged", "database-missing", "database-away", "newer-database", "folder-not-empty",
                "database-not-empty", "restore-unfinished", "no-archive", "no-interface", "no-route", "forbidden",
                "network")
EXIT_CODES = ("Exit codes: 0 done; 1 something broke that should not; 2 the command line is wrong; 3 the input was "
              "refused (points, picture, field, settings); 4 a file, folder, port or network cannot be used; 5 report, "
              "rig check: the verdict is below what is --enough. batch: 1 some pictures were judged bad or failed; "
              "130 stopped by Ctrl-C.")


class FileTrouble(TouchlineError):
    """A file that cannot be read or written, or a port that is taken."""

    reason = "file-trouble"


def exit_code_of(error: Exception) -> int:
    """Say what went wrong and what to do; the exit code for it."""
    if isinstance(error, BrokenPipeError):
        return 0  # whoever read our output has had enough
    if isinstance(error, OSError):
        error = FileTrouble(f"{error.filename or 'A file'}: {error.strerror or error}.",
                            "Check the path, its permissions and the space on the disk.")
    if isinstance(error, TouchlineError):
        print(f"error: {error.what}\nfix: {error.fix}", file=sys.stderr)
        return FILE if isinstance(error, FileTrouble) or error.reason in FILE_REASONS else REFUSED
    traceback.print_exception(error)
    print("error: Something broke here that should not.\nfix: Please report it with the lines above.", file=sys.stderr)
    return UNEXPECTED


def say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


@contextmanager
def progress_bar(title: str) -> Iterator[Progress]:
    """A bar on a terminal, nothing elsewhere; gone when the work is done."""
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    console = Console(stderr=True)
    with Bar(TextColumn("{task.description}"), BarColumn(), TextColumn("{task.percentage:>3.0f} %"),
             TimeElapsedColumn(), console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(title, total=1.0)
        yield lambda fraction, message: bar.update(task, completed=fraction, description=message or title)
