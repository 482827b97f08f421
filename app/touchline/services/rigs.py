"""A saved rig with all that belongs to it: its cameras, their active calibrations, and pictures of them."""

import asyncio
import json
from collections.abc import Iterable, Mapping
from typing import Any

from anyio import from_thread

from touchline.core.errors import BadInput, TouchlineError
from touchline.core.field_json import field_from_json
from touchline.core.progress import Progress
from touchline.core.statements import say
from touchline.evaluate.cameras.rectangles import NAMES, Rectangles
from touchline.evaluate.cameras.rig_verdict import RigTrouble
from touchline.imaging.mosaic import FieldView, Stitcher, stitcher_of
from touchline.services.container import Services
from touchline.services.live import TakenFrame, take_frame
from touchline.services.rig_checks import RigState
from touchline.services.rig_outdated import CheckedRig, as_of_now
from touchline.store.documents import Document
from touchline.store.repository import utc_now
from touchline.workflows.rig import camera_trouble, rig_status
from touchline.workflows.rig_types import RigStatus

Pictures = Mapping[str, Mapping[str, Any]]


class RigJson(RigStatus):
    """A rig; checked: the newest check since the server start, null if there is none, or the rig or a calibration has
    changed since then."""

    name: str
    title: str
    field: str
    w_max_rectangle_px: float | None
    h_max_rectangle_px: float | None
    n_rectangles_x: int | None
    n_rectangles_y: int | None
    checked: CheckedRig | None
    updated_at: str
    updated_by: str


def save(services: Services, name: str, definition: Mapping[str, Any], etag: str | None, by: str) -> Document:
    """Save a rig over the one with that ETag, None for a new one; BadInput, NotFound, Conflict or Stale."""
    with services.store.references:
        return services.store.rigs.save(name, _checked_definition(services, definition), etag, by)


def _checked_definition(services: Services, definition: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is saved: names that exist, each camera once, and rectangles that give a picture."""
    field = services.fields[definition["field"]]
    cameras: list[dict[str, Any]] = [{"camera": camera, "region": None, "rotate": None} if isinstance(camera, str)
                                     else camera for camera in definition["cameras"]]
    if len({camera["camera"] for camera in cameras}) < len(cameras):
        raise BadInput(say("rig.camera-twice", "The rig contains a camera twice."),
                       say("rig.list-once", "List each camera once."), reason="camera-twice")
    rectangles = Rectangles.of_rig(definition)
    for camera in cameras:
        services.cameras.get(camera["camera"])
        region = field.region(camera["region"], camera["rotate"]) if camera["region"] is not None else None
        active = services.store.calibrations.active(camera["camera"])
        if rectangles is not None and active is not None and region is not None:
            rectangles.check(region, active.image_size)
    return {"title": definition["title"], "field": definition["field"], "cameras": cameras,
            **{name: definition[name] for name in NAMES}}


def rig_spec(services: Services, rig: Document, pictures: Pictures | None = None) -> dict[str, Any]:
    """Return the rig as touchline/workflows/rig.py takes it, with calibrations and pictures by camera."""
    cameras = []
    for camera in rig.body["cameras"]:
        id = camera["camera"]
        active = services.store.calibrations.active(id)
        cameras.append({**camera, "title": services.cameras.title(id),
                        "calibration": active.to_json() if active else None, "picture": (pictures or {}).get(id)})
    return {"name": rig.name, "title": rig.body["title"] or rig.name,
            "field": services.fields[rig.body["field"]].to_json(),
            "rectangles": {name: rig.body[name] for name in NAMES}, "cameras": cameras}


def rig_json(services: Services, rig: Document) -> RigJson:
    """Return the rig as the API shows it; called in a worker thread of the event loop that its cameras run on."""
    spec, body = rig_spec(services, rig), rig.body
    check = services.part(RigState).checks.get(spec)
    titles = {c["camera"]: c["title"] for c in spec["cameras"] if check is not None and c["calibration"] is not None}
    statuses = {camera: from_thread.run_sync(services.live.status, camera) for camera in titles}
    return {"name": rig.name, "title": body["title"], "field": body["field"],
            "w_max_rectangle_px": body["w_max_rectangle_px"], "h_max_rectangle_px": body["h_max_rectangle_px"],
            "n_rectangles_x": body["n_rectangles_x"], "n_rectangles_y": body["n_rectangles_y"], **rig_status(spec),
            "checked": None if check is None else as_of_now(check, titles, statuses, utc_now()),
            "updated_at": rig.updated_at, "updated_by": rig.updated_by}


def snapshots_by_camera(services: Services, rig: Document, texts: Iterable[str]) -> dict[str, str]:
    """Read CAMERA:SNAPSHOT, or a snapshot that a camera of the rig has taken, as {camera: snapshot}."""
    store, known, snapshots = services.store, [camera["camera"] for camera in rig.body["cameras"]], {}
    for text in texts:
        camera, _, id = text.rpartition(":")
        camera = camera or store.snapshots.get(id).camera or ""
        if camera not in known:
            raise BadInput(f"The camera of the rig that took the image {id!r} is unknown.",
                           f"Write CAMERA:{id}, with one of {', '.join(known)}.", reason="unknown-camera")
        snapshots[camera] = store.snapshots.get(id).id
    return snapshots


async def take_frames(services: Services, cameras: Iterable[str]) -> tuple[dict[str, TakenFrame], list[RigTrouble]]:
    """Take a frame of each camera, all at once; and say what is wrong with those that give none."""
    async def take(id: str) -> TakenFrame | RigTrouble:
        try:
            return await take_frame(services.live.get(id))
        except TouchlineError as error:
            return camera_trouble(id, error.reason, error.what, error.fix)
    results = await asyncio.gather(*map(take, cameras))
    return ({frame.camera.id: frame for frame in results if isinstance(frame, TakenFrame)},
            [problem for problem in results if not isinstance(problem, TakenFrame)])


def save_frames(services: Services, frames: Mapping[str, TakenFrame]) -> dict[str, dict[str, Any]]:
    """Keep the frames that were taken for a check, so that it can be repeated; return them as a job reads them."""
    snapshots = services.store.snapshots
    return {camera: snapshots.for_job(frame.save(services.store, "rig").id) for camera, frame in frames.items()}


def stitcher_for(services: Services, rig: Mapping[str, Any], cameras: Iterable[str], width: int,
                 progress: Progress) -> tuple[Stitcher, list[str]]:
    """Return the maps for those cameras at that width, and their names in order; made once while nothing changes."""
    cameras = set(cameras)
    shown = ((c["camera"], c["region"], c["calibration"]["id"]) for c in rig["cameras"]
             if c["camera"] in cameras and c["calibration"] is not None)
    key = (width, json.dumps(rig["field"]), *shown)  # the whole field: one's own may change under its name
    return services.part(RigState).stitchers.get_or_make(
        key, lambda: stitcher_of(rig, cameras, FieldView(field_from_json(rig["field"]), width), progress))
