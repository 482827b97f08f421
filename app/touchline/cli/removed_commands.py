"""Commands of earlier versions, each with what answers the same now."""

from typing import Any

import typer
from typer.core import TyperCommand

from touchline.cli.console import USAGE, say

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


def removed_command(name: str) -> TyperCommand:
    """Return a command that takes any words, and says what took its place."""
    def replaced(**_: Any) -> None:
        say(f"error: touchline {name} was removed.\nfix: Use {REMOVED[name]}. {HELP}")
        raise typer.Exit(USAGE)
    return TyperCommand(name, callback=replaced, hidden=True, add_help_option=False, context_settings={
        "ignore_unknown_options": True, "allow_extra_args": True, "help_option_names": []})
