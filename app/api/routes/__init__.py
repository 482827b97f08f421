"""Routes by resource: one file each, with a `router`."""

from collections.abc import Iterator
from importlib import import_module

from fastapi import APIRouter

# In the order of the documentation; where two paths match a request, the first one wins.
RESOURCES = ("health", "archive", "cameras", "streams", "snapshots", "fields", "drafts", "models", "fit", "versions",
             "calibrations", "boards", "lenses", "uncertainty", "reports", "pairs", "rigs", "straightness", "points",
             "pictures", "jobs", "detections", "live_detection", "colours", "snapping", "publishing", "settings_view",
             "board_capture", "rolls", "motion", "auto", "scenes", "checks", "reregister", "tracks", "clips")


def resources() -> Iterator[APIRouter]:
    """Yield the router of every resource."""
    return (import_module(f"{__name__}.{name}").router for name in RESOURCES)
