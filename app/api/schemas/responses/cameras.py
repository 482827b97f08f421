"""Cameras and their pictures."""

from typing import Any, Literal

from app.api.schemas.responses.base import Answer, Page


class Snapshot(Answer):
    id: str
    width: int
    height: int
    camera: str | None
    taken_at: str
    sha256: str
    purpose: str


class Snapshots(Page):
    items: list[Snapshot]


class Camera(Answer):
    id: str
    name: str
    field: str | None
    region: str | None
    source: str
    editable: bool
    active_calibration: str | None
    updated_at: str | None
    updated_by: str | None


class Cameras(Page):
    items: list[Camera]


class CameraTest(Answer):
    width: int
    height: int
    fps: float
    identity: dict[str, str] | None
    picture: str


class FoundCameras(Answer):
    items: list[dict[str, Any]]


class Sources(Answer):
    items: list[dict[str, Any]]


class Controls(Answer):
    items: list[dict[str, Any]]


class CameraStatus(Answer):
    state: Literal["connecting", "live", "stalled", "offline", "mismatch"]
    problem: dict[str, Any] | None
    fps: float
    width: int | None
    height: int | None
    frame_age_s: float | None
    reconnects: int
    light: dict[str, Any] | None
    sharpness: Any
    active_calibration: str | None
    drift_px: float | None
    drift: dict[str, Any] | None
