"""Requests about publishing to the league's network."""

from typing import Annotated

from pydantic import Field

from app.api.schemas.requests import CameraId
from app.services.value_types import Name, Number, Rotate, Size, Strict

Text = Annotated[str, Field(max_length=64)]
WireNumber = Annotated[int, Field(ge=0, le=2**32 - 1)]


class PublishingChanges(Strict):
    """What is to change; what is left out stays."""

    enabled: bool = False
    absorb: bool = False
    group: Text = Field("", description="IPv4 multicast address")
    port: Annotated[int, Field(ge=1, le=65535)] = 10006
    interface: Text = Field("", description="name or address; empty: the system's choice")
    ttl: Annotated[int, Field(ge=0, le=255)] = 1
    interval_s: Annotated[float, Field(ge=0.1, le=60)] = 3.0
    limit_mm: Annotated[Number, Field(ge=0, le=100_000)] = 10.0
    field: CameraId | None = Field(None, description="where cameras see several; null: that of most")
    numbers: Annotated[dict[CameraId, WireNumber | None], Field(max_length=100)] = Field(
        {}, description="cameras' numbers on the wire, null for that of the region; cameras not named stay")
    approved: Annotated[dict[CameraId, Name | None], Field(max_length=100)] = Field(
        {}, description="calibrations, by camera, whose loss is accepted; cameras not named stay")


class ImportBody(Strict):
    """Which camera of a sender is saved as a calibration, and what its packet does not say."""

    camera_id: WireNumber
    camera: CameraId | None = None
    field: CameraId | None = None
    region: CameraId | None = None
    rotate: Rotate | None = None
    image_size: Size | None = None
    sha256: Annotated[str, Field(min_length=64, max_length=64)] | None = Field(
        None, description="of the packet that was looked at: 409 where the sender has sent another one since")
