"""A kept rig with all that stands behind it: its cameras, their active calibrations, and pictures of them."""

import asyncio
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import asdict
from typing import Any

from fastapi import Request

from app.api.routes.streams import first_picture, live_camera
from app.api.schemas.rigs import RigBody, RigCamera
from app.api.work import at_work
from app.core.errors import BadInput, NotFound, TouchlineError
from app.core.field_json import field_from_json
from app.core.geometry import ImageSize
from app.evaluate.cameras.rectangles import NAMES, Rectangles
from app.imaging.mosaic import FieldView, Stitcher, stitcher_of
from app.store import Document
from app.workflows.rig import rig_status

Pictures = Mapping[str, Mapping[str, Any]]
KEPT_STITCHERS = 4
LIVE_S = 20.0  # several cameras that wake at once take their time


def body_of(request: Request, body: RigBody) -> dict[str, Any]:
    """What is kept: names that exist, each camera once, and rectangles that make a picture."""
    state = request.app.state
    field = state.fields[body.field]
    cameras = [RigCamera(camera=c) if isinstance(c, str) else c for c in body.cameras]
    if len({c.camera for c in cameras}) < len(cameras):
        raise BadInput("A camera stands in the rig twice.", "Name each camera once.", reason="camera-twice")
    wanted = Rectangles.of_rig(body.model_dump())
    for camera in cameras:
        state.camera_shelf.get(camera.camera)
        region = field.region(camera.region, camera.rotate) if camera.region is not None else None
        active = state.store.calibrations.active(camera.camera)
        if wanted is not None and active is not None and region is not None:
            wanted.check(region, active.image_size)
    return {"title": body.title, "field": body.field, "cameras": [c.model_dump() for c in cameras],
            **{name: getattr(body, name) for name in NAMES}}


def whole(request: Request, kept: Document, pictures: Pictures | None = None) -> dict[str, Any]:
    """The rig as rig_pipeline.py takes it."""
    state, body, cameras = request.app.state, kept.body, []
    for camera in body["cameras"]:
        title = camera["camera"]
        with suppress(NotFound):  # it was removed since; its calibrations stay
            title = state.camera_shelf.get(camera["camera"]).title
        active = state.store.calibrations.active(camera["camera"])
        cameras.append({**camera, "title": title, "calibration": active.to_json() if active else None,
                        "picture": (pictures or {}).get(camera["camera"])})
    return {"name": kept.name, "title": body["title"] or kept.name, "field": state.fields[body["field"]].to_json(),
            "rectangles": {name: body[name] for name in NAMES}, "cameras": cameras}


def described(request: Request, kept: Document) -> dict[str, Any]:
    """As GET answers it."""
    body = kept.body
    return {"name": kept.name, "title": body["title"], "field": body["field"], **{n: body[n] for n in NAMES},
            **rig_status(whole(request, kept)), "updated_at": kept.updated_at, "updated_by": kept.updated_by}


def snapshots_given(request: Request, kept: Document, given: Iterable[str]) -> dict[str, str]:
    """CAMERA:SNAPSHOT, or a snapshot that a camera of the rig has taken, as {camera: snapshot}."""
    store, known, found = request.app.state.store, [c["camera"] for c in kept.body["cameras"]], {}
    for text in given:
        camera, _, id = text.rpartition(":")
        camera = camera or store.snapshots.get(id).camera or ""
        if camera not in known:
            raise BadInput(f"It is not known which camera of the rig took the picture {id!r}.",
                           f"Write CAMERA:{id}, with one of {', '.join(known)}.", reason="unknown-camera")
        found[camera] = store.snapshots.get(id).id
    return found


async def live_pictures(request: Request, names: Iterable[str]) -> tuple[dict[str, bytes], list[dict[str, Any]]]:
    """A PNG of each camera, taken now and all at once; and what is wrong with those that give none."""
    async def one(name: str) -> tuple[str, bytes | TouchlineError]:
        try:
            camera = await live_camera(request, name)
            _, png = await first_picture(camera, lambda timeout_s: camera.still(1, timeout_s), LIVE_S)
            return name, png
        except TouchlineError as error:
            return name, error
    taken = await asyncio.gather(*(one(name) for name in names))
    return ({name: it for name, it in taken if isinstance(it, bytes)},
            [{"camera": name, "reason": it.reason, "text": it.what, "fix": it.fix} for name, it in taken
             if isinstance(it, TouchlineError)])


async def kept_pictures(request: Request, pngs: Mapping[str, bytes]) -> dict[str, dict[str, Any]]:
    """Pictures that were taken for a check are kept, so that it can be made again: as a job's spec names them."""
    state = request.app.state

    def keep() -> dict[str, dict[str, Any]]:
        made = {}
        for camera, png in pngs.items():
            frame = state.decoder.frame_from_bytes(png)
            snapshot = state.store.snapshots.add(png, ImageSize(*frame.size), "png", camera, "rig")
            live = state.live.get_running(camera)
            if live is not None and live.identity is not None:
                state.store.identities.confirm(snapshot.id, asdict(live.identity))
            made[camera] = picture_of(request, snapshot.id)
        return made
    return await at_work(request, keep)


def picture_of(request: Request, snapshot: str) -> dict[str, Any]:
    """A snapshot as a job reads it."""
    store = request.app.state.store
    known = store.snapshots.get(snapshot)
    return {"name": known.id, "path": str(store.snapshots.path(known)), "sha256": known.sha256}


def stitcher(request: Request, rig: Mapping[str, Any], names: Iterable[str], width: int) -> tuple[Stitcher, list[str]]:
    """The maps for those cameras at that width, and their names in order; made once while nothing changes."""
    state = request.app.state
    if not hasattr(state, "rig_stitchers"):
        state.rig_stitchers = {}
    kept, names = state.rig_stitchers, set(names)
    key = (width, rig["field"]["name"], *((c["camera"], c["region"], c["calibration"]["id"]) for c in rig["cameras"]
                                          if c["camera"] in names and c["calibration"] is not None))
    if key not in kept:
        made = stitcher_of(rig, names, FieldView(field_from_json(rig["field"]), width))
        while len(kept) >= KEPT_STITCHERS:
            kept.pop(next(iter(kept)), None)
        kept[key] = made
    return kept[key]
