"""Publishing without a server: a publication with its settings in a folder, and the calibrations that a test has."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from tests.support.exported import model_of, of_model
from touchline.core.field import Field
from touchline.core.records import Calibration
from touchline.league.live import Publication
from touchline.league.packet import NO_FIELDS
from touchline.league.packet_camera import PacketCameraCache
from touchline.league.service import FILE, RECEIVED_FILE
from touchline.models.ray_camera import Ssl
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


def over(field: Field, **changes: Any) -> Calibration:
    """A calibration whose camera a packet holds exactly, above the whole field."""
    region = field.regions["full"]
    model = model_of("ssl", 0)
    assert isinstance(model, Ssl)
    high = replace(
        model,
        region=region,
        rotation=(3.141592653589793, 0.0, 0.0),
        position_mm=(0.0, 0.0, 6000.0),
        focal_px=700.0,
    )
    return of_model(high, **{"field": field.to_json(), **changes})
