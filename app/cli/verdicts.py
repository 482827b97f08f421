"""Verdicts as exit codes."""

from enum import StrEnum
from typing import Annotated

import typer

from app.cli.console import POOR


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
