"""Routes by resource: a file for those that belong together, with a `router`."""

from collections.abc import Iterator
from importlib import import_module

from fastapi import APIRouter

# In the order of the documentation; where two paths match a request, the first one wins.
RESOURCES = ("server_state", "cameras", "streams", "events", "snapshots", "fields", "fit", "calibrations", "lenses",
             "straight", "judging", "reports", "pairs", "claims", "rigs", "using", "jobs", "detections", "colours",
             "publishing", "board_capture", "rolls", "automatic", "drift", "scenes", "clips")


def resources() -> Iterator[APIRouter]:
    """Yield the router of every resource."""
    return (import_module(f"{__name__}.{name}").router for name in RESOURCES)
