"""What is asked of and answered about the network: see publishing.py."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from app.api.schemas.requests import CameraId, Name, Number, Rotate, Size, Strict

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


class TakeOver(Strict):
    """Which camera of a sender is kept as a calibration, and what the packet does not say of it."""

    camera_id: WireNumber
    camera: CameraId | None = None
    field: CameraId | None = None
    region: CameraId | None = None
    rotate: Rotate | None = None
    image_size: Size | None = None
    sha256: Annotated[str, Field(min_length=64, max_length=64)] | None = Field(
        None, description="of the packet that was looked at: 409 where the sender has said something else since")


class _Answer(BaseModel):
    """Entries may be added, and are never renamed."""

    model_config = ConfigDict(extra="allow")


class PublishedCamera(_Answer):
    camera: str
    calibration: str
    version: int
    model: str
    field: str
    region: str
    camera_id: int
    published: bool
    exact: bool
    loss: dict[str, Any] | None
    problem: dict[str, str] | None


class Publishing(_Answer):
    enabled: bool
    absorb: bool
    group: str
    port: int
    interface: str
    ttl: int
    interval_s: float
    limit_mm: float
    field: str | None
    numbers: dict[str, int]
    approved: dict[str, str]
    state: Literal["off", "starting", "on-air", "silent", "failing"]
    problem: dict[str, str] | None
    said: dict[str, Any] | None
    cameras: list[PublishedCamera]
    interfaces: list[dict[str, Any]]


class HeardSender(_Answer):
    id: str
    address: str
    port: int
    source: str
    age_s: float
    packets: int
    geometries: int
    refused: int
    refusal: str | None
    skipped: int
    geometry_age_s: float | None
    sha256: str | None
    field: dict[str, Any] | None
    problem: dict[str, str] | None
    cameras: list[dict[str, Any]]


class Heard(_Answer):
    listening: bool
    problem: dict[str, str] | None
    datagrams: int
    own: int
    items: list[HeardSender]
