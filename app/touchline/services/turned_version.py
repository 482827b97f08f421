"""A new version of a calibration for its camera's picture turned by quarters, with a turned copy of its own picture."""

from contextlib import suppress
from dataclasses import replace

import numpy as np

from touchline.core.errors import NotFound
from touchline.core.quarter_turn import QuarterTurn, turn_in_words
from touchline.core.records import Calibration
from touchline.images import encode
from touchline.services.container import Services
from touchline.services.result_savers import save_draft_of
from touchline.store.quarantine import DamagedFile
from touchline.store.snapshots import Snapshot
from touchline.workflows.turning import turned_calibration


def save_turned_version(services: Services, id: str, turn_deg: int, by: str) -> Calibration:
    """Save the version with that id turned clockwise as a new one, its child, not active; NotFound.

    Without a picture where the former one was deleted, or is damaged.
    """
    store = services.store
    before = store.calibrations.get(id)
    about = f"Version {before.version}, {turn_in_words(turn_deg)}."
    made = replace(turned_calibration(before, turn_deg, about), parent=before.id)
    evidence = store.identities.get(before.id)
    if before.snapshot is not None:
        evidence = evidence or store.identities.get(before.snapshot)
        with suppress(NotFound, DamagedFile):
            picture = _turned_picture(services, before.snapshot, turn_deg)
            made = replace(made, snapshot=picture.id, image_sha256=picture.sha256)
    saved = store.calibrations.add(made, by)
    save_draft_of(store, saved, by)
    if evidence is not None:  # it is of the same device
        store.identities.confirm(saved.id, evidence, by)
    return saved


def _turned_picture(services: Services, id: str, turn_deg: int) -> Snapshot:
    """Save a turned copy of a snapshot, pixel for pixel."""
    snapshots = services.store.snapshots
    before = snapshots.get(id)
    pixels = np.rot90(services.frame(id).pixels, -turn_deg // 90)
    return snapshots.add(
        encode(pixels, "png"),
        QuarterTurn(turn_deg, before.size).size_after,
        "png",
        before.camera,
        before.purpose,
        before.name,
        before.taken_at,
    )
