"""Publishing without a server: a publication with its settings in a folder, and the calibrations that a test has."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from touchline.core.field import Field
from touchline.core.records import Calibration
from touchline.league.live import Publication
from touchline.league.packet import NO_FIELDS
from touchline.league.packet_camera import PacketCameraCache
from touchline.league.service import FILE, RECEIVED_FILE
from touchline.settings import PublishSettings
from touchline.store.files import RecentFailures


def publishing_of(
    folder: Path,
    active: Callable[[], Sequence[Calibration]],
    fields: Mapping[str, Field] = NO_FIELDS,
    **settings: Any,
) -> Publication:
    """Return it as yet not started. folder: of its files; active: returns the active calibrations."""
    return Publication(
        folder / FILE,
        folder / RECEIVED_FILE,
        PublishSettings(**{"listen_first_s": 0, **settings}).to_json(),
        RecentFailures(),
        active,
        PacketCameraCache(),
        fields,
    )
