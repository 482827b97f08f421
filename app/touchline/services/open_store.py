"""The store that settings describe, and what this version reads of each saved row.

Rows that this version has written can be read; those of an earlier one, of an archive or of a stranger may not.
"""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NotRequired

from pydantic import TypeAdapter
from typing_extensions import TypedDict

from touchline.capabilities import call, saved_rows
from touchline.core.records import Calibration
from touchline.settings import CameraSettings, Settings
from touchline.sources import Identity
from touchline.store.files import MB
from touchline.store.integrity import content
from touchline.store.snapshots import Snapshot
from touchline.store.store import Store

Row = Any  # of a table, intact
Plain = dict[str, Any]

SNAPSHOT = TypeAdapter(Snapshot)


class _Saved(TypedDict):
    updated_at: str
    updated_by: str


class _DraftBody(TypedDict):
    """Only what is looked at: an operator's clicks are worth more than a whole record."""

    field: str | None
    region: str | None
    rotate: NotRequired[int | None]
    model: NotRequired[str | None]
    options: NotRequired[Plain]
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
    model: str
    lens: Plain
    camera: NotRequired[str | None]
    note: NotRequired[str]
    board: NotRequired[Plain | None]
    image_size: NotRequired[tuple[int, int]]
    report: NotRequired[_LensReport]


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


def _of(
    shape: Any, read: Callable[[Any, Row], object] = lambda record, row: record
) -> Callable[[Row], object]:
    """Return a reader of rows with content of that shape. read: goes on with the content and its row."""
    adapter = TypeAdapter(shape)
    return lambda row: read(adapter.validate_python(content(row)), row)


# By table; each raises for a row that cannot be read.
READERS: Mapping[str, Callable[[Row], object]] = {
    "snapshots": _of(
        Plain, lambda record, _: SNAPSHOT.validate_python(Snapshot(**record).to_json())
    ),
    "drafts": _of(_Draft),
    "calibrations": lambda row: Calibration.from_json(content(row)),
    "active": _of(_Active),
    "lenses": _of(_Lens),
    "cameras": _of(_Camera, lambda record, row: CameraSettings(id=row.id, **record["camera"])),
    "identities": _of(_Identity, lambda record, _: Identity(**record["evidence"])),
    "rigs": _of(_Rig),
    **{table: partial(call, target) for table, target in saved_rows().items()},
}


def open_store(settings: Settings) -> Store:
    """Open the store of the settings' data folder, or of their database."""
    return Store(
        settings.data,
        database=settings.database.get_secret_value() if settings.database else None,
        uploads_bytes=int(settings.storage.uploads_mb * MB),
        backups_bytes=int(settings.storage.backups_mb * MB),
        readers=READERS,
    )
