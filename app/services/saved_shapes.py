"""What this version reads of each saved row: another one is set aside when a data folder is opened, and stops nothing.

Rows that this version has written can be read; those of an earlier one, of an archive or of a stranger may not.
"""

from collections.abc import Callable, Mapping
from typing import Any

from pydantic import TypeAdapter
from typing_extensions import TypedDict

from app.core.colour_profile import ColourProfile
from app.core.records import Calibration
from app.settings import CameraSettings
from app.sources import Identity
from app.store.checksummed import content
from app.store.snapshots import Snapshot
from app.vision.stage_pipeline import StageConfig

Row = Any  # of a table, intact
Plain = dict[str, Any]


class _Saved(TypedDict):
    updated_at: str
    updated_by: str


class _DraftBody(TypedDict):
    field: str | None
    region: str | None
    rotate: int | None
    model: str | None
    options: Plain
    observations: list[Plain]


class _Draft(_Saved):
    revision: int
    draft: _DraftBody


class _Active(TypedDict):
    camera_key: str
    calibration: str


class _View(TypedDict):
    used: bool


class _LensReport(TypedDict):
    rms_px: float | None
    verdict: Plain
    views: list[_View]


class _Lens(TypedDict):
    id: str
    created_at: str
    camera: str | None
    note: str
    model: str
    board: Plain | None
    image_size: tuple[int, int]
    lens: Plain
    report: _LensReport
    software: str


class _Camera(_Saved):
    sequence: int
    revision: int
    camera: Plain


class _Identity(TypedDict):
    confirmed_at: str
    confirmed_by: str
    evidence: dict[str, str]


class _RigCamera(TypedDict):
    camera: str
    region: str | None
    rotate: int | None


class _RigBody(TypedDict):
    title: str
    field: str
    cameras: list[_RigCamera]
    w_max_rectangle_px: float | None
    h_max_rectangle_px: float | None
    n_rectangles_x: int | None
    n_rectangles_y: int | None


class _Rig(_Saved):
    etag: str
    rig: _RigBody


class _Roll(TypedDict):
    id: str
    camera: str
    kept_at: str
    left_out: bool
    at: float
    seconds: float
    rms_px: float
    straight_px: float
    points: list[tuple[float, float]]
    image_size: tuple[int, int]


class _Preset(_Saved):
    etag: str
    preset: Plain


class _Seeing(TypedDict):
    on: bool
    plan: Plain
    colours: str | None
    profile: Plain | None
    publish: bool


def _of(shape: Any) -> Callable[[Row], object]:
    adapter = TypeAdapter(shape)
    return lambda row: adapter.validate_python(content(row))


def _snapshot(row: Row) -> object:
    return TypeAdapter(Snapshot).validate_python(Snapshot(**content(row)).to_json())


def _camera(row: Row) -> object:
    record = TypeAdapter(_Camera).validate_python(content(row))
    return CameraSettings(id=row.id, **record["camera"])


def _identity(row: Row) -> object:
    return Identity(**TypeAdapter(_Identity).validate_python(content(row))["evidence"])


def _preset(row: Row) -> object:
    preset = TypeAdapter(_Preset).validate_python(content(row))["preset"]
    if row.key.startswith("colours:"):
        return ColourProfile.from_json(preset)
    settings = TypeAdapter(_Seeing).validate_python(preset)
    if settings["profile"] is not None:
        ColourProfile.from_json(settings["profile"])
    return StageConfig.from_json(settings["plan"])


# By table; each raises for a row that cannot be read.
READERS: Mapping[str, Callable[[Row], object]] = {
    "snapshots": _snapshot, "drafts": _of(_Draft), "calibrations": lambda row: Calibration.from_json(content(row)),
    "active": _of(_Active), "lenses": _of(_Lens), "cameras": _camera, "identities": _identity, "rigs": _of(_Rig),
    "rolls": _of(_Roll), "presets": _preset}
