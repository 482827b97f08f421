"""Saved rigs with all that belongs to them while the server runs: active calibrations, pictures, and the newest check.

An agreement holds as long as its cameras stand where they stood.
"""

import asyncio
import json
from collections.abc import Iterable, Iterator, Mapping
from datetime import datetime, timedelta
from functools import partial
from typing import Any, Literal, final

from anyio import from_thread
from typing_extensions import TypedDict

from touchline.core.errors import BadInput, Conflict, FitFailed, TouchlineError
from touchline.core.field_json import field_from_json
from touchline.core.jobs import Progress
from touchline.core.records import Calibration
from touchline.core.statements import Stated, join, say, sentence_in, stated
from touchline.evaluate.claims import Claim
from touchline.evaluate.report_types import Level
from touchline.live.messages import CameraStatus
from touchline.rigs.check import RigReport, compare
from touchline.rigs.mosaic import FieldView, Stitcher, stitcher_of
from touchline.rigs.rig import NAMES, Rectangles, Rig, RigMember, RigStatus, rig_status
from touchline.rigs.verdict import (
    CheckedLevel,
    RigTrouble,
    RigVerdict,
    camera_trouble,
    neighbour_claim,
    of_report,
    rig_claim,
)
from touchline.services.container import IsAbandoned, Services
from touchline.services.live import TakenFrame, take_frame
from touchline.store.documents import Document
from touchline.store.repository import LruCache, timestamp, utc_now

Pictures = Mapping[str, Mapping[str, Any]]

# other troubles of its cameras are claims of their own
OF_RIG = ("other-field", "other-region", "other-rectangles")
MAX_CHECKS = 200
MAX_STITCHER_BYTES = 128 << 20  # a rig's picture as the page shows it has some 20 MB
MAX_AGE = timedelta(hours=24)  # a warm hall and a cold one are a day apart
CHECK_AGAIN = say("rig.check-again.fix", "Then check the rig again.")

Reason = Literal["moved", "misplaced", "out-of-focus", "not-monitored", "old"]
# the others only date an agreement
VOID: tuple[Reason, ...] = ("moved", "misplaced", "out-of-focus")
REASONS: dict[str, Reason] = {
    "knocked": "moved",
    "replaced": "moved",
    "misplaced": "misplaced",
    "out-of-focus": "out-of-focus",
}


class OutdatedCheck(Stated):
    """Why a check says less than it did; camera: whose fault that is, null where it is nobody's."""

    camera: str | None
    reason: Reason
    text: str
    fix: str


class CheckedPair(TypedDict):
    """How far two cameras are apart on the carpet, where both see it; level: that of their verdict."""

    a: str
    b: str
    level: Level
    median_mm: float
    max_mm: float


class NewestCheck(TypedDict):
    """p95_mm: on the carpet or at robot tops, whichever is more, of the two cameras that are farthest apart; null where
    none could be compared. pairs: those that could."""

    at: str
    verdict: RigVerdict
    p95_mm: float | None
    pairs: list[CheckedPair]


@final
class CheckedRig(NewestCheck):
    """A check, and what it says now: where a camera has moved since, the verdict's level is null, and its pairs are
    gone."""

    outdated: list[OutdatedCheck]


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


class RigState:
    """checks: the newest of each rig. stitchers: how its images are joined."""

    def __init__(self, _services: Services) -> None:
        self.checks = RigChecks()
        self.stitchers: LruCache[tuple[object, ...], tuple[Stitcher, list[str]]] = LruCache(
            MAX_STITCHER_BYTES, lambda made: made[0].nbytes
        )


def save_check(services: Services, result: RigReport, context: list[str]) -> RigReport:
    """Keep a check's verdict, and return the check."""
    return services.part(RigState).checks.save(result, context)


class RigChecks:
    """The newest check of each rig, until the rig or a calibration in it is another; forgotten with the server.

    Thread-safe.
    """

    def __init__(self) -> None:
        self._newest: LruCache[tuple[str, str], NewestCheck] = LruCache(MAX_CHECKS)

    def context(self, rig: Rig) -> list[str]:
        """Return what a job needs to keep its result: the rig's name, and what its check depends on."""
        cameras = [
            [c.camera, c.region, c.rotate, c.calibration and c.calibration.id] for c in rig.cameras
        ]
        return [
            rig.name,
            json.dumps(
                [rig.field_json, rig.given and rig.given.options(), cameras], sort_keys=True
            ),
        ]

    def save(self, result: RigReport, context: list[str]) -> RigReport:
        """Keep a check's verdict, and return the check."""
        p95: list[float] = []
        pairs: list[CheckedPair] = []
        for pair in result["pairs"]:
            found, verdict = pair["agreement"], pair["verdict"]
            if found is None or verdict is None:
                continue
            carpet = found["carpet"]
            p95 += [part["p95_mm"] for part in (carpet, found["hat"]) if part]
            pairs.append(
                {
                    "a": pair["a"],
                    "b": pair["b"],
                    "level": verdict["level"],
                    "median_mm": carpet["median_mm"],
                    "max_mm": carpet["max_mm"],
                }
            )
        name, state = context
        self._newest.put(
            (name, state),
            {
                "at": timestamp(utc_now),
                "verdict": result["verdict"],
                "p95_mm": max(p95, default=None),
                "pairs": pairs,
            },
        )
        return result

    def get(self, rig: Rig) -> NewestCheck | None:
        """Return the newest check; None where this rig with these calibrations was not checked."""
        name, state = self.context(rig)
        return self._newest.get((name, state))


def save(
    services: Services, name: str, definition: Mapping[str, Any], etag: str | None, by: str
) -> Document:
    """Save a rig over the one with that ETag, None for a new one; BadInput, NotFound, Conflict or Stale."""
    with services.store.references:
        saved = services.store.rigs.save(name, _checked_definition(services, definition), etag, by)
    _follow(services, name)
    return saved


def delete(services: Services, name: str, etag: str | None) -> None:
    """Delete a rig; NotFound, Stale, or Conflict while it is published separately."""
    with services.store.references:
        users = [use for part in services.running_parts for use in part.uses_of_rig(name)]
        if users:
            raise Conflict(
                say("rig.in-use", "The rig {name} is in use: {users}.", name=name, users=users),
                say("rig.stop-publishing", "Stop publishing it, then delete it."),
                reason="rig-used",
            )
        services.store.rigs.delete(name, etag)
    _follow(services, name)


def _follow(services: Services, name: str) -> None:
    for part in services.running_parts:
        part.rig_changed(name)
    for camera in services.live.running:  # whose packets may leave otherwise now
        from_thread.run_sync(services.live.refresh, camera)


def _checked_definition(services: Services, definition: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is saved: names that exist, each camera once, and rectangles that give a picture."""
    field = services.fields[definition["field"]]
    cameras: list[dict[str, Any]] = [
        {"camera": camera, "region": None, "rotate": None} if isinstance(camera, str) else camera
        for camera in definition["cameras"]
    ]
    if len({camera["camera"] for camera in cameras}) < len(cameras):
        raise BadInput(
            say("rig.camera-twice", "The rig contains a camera twice."),
            say("rig.list-once", "List each camera once."),
            reason="camera-twice",
        )
    rectangles = Rectangles.of_rig(definition)
    for camera in cameras:
        services.cameras.get(camera["camera"])
        region = (
            field.region(camera["region"], camera["rotate"])
            if camera["region"] is not None
            else None
        )
        active = services.store.calibrations.active(camera["camera"])
        if rectangles is not None and active is not None and region is not None:
            rectangles.check(region, active.image_size)
    return {
        "title": definition["title"],
        "field": definition["field"],
        "cameras": cameras,
        **{name: definition[name] for name in NAMES},
    }


def rig_of(services: Services, saved: Document, pictures: Pictures | None = None) -> Rig:
    """Return a saved rig with active calibrations, and pictures by camera."""
    body, active = saved.body, services.store.calibrations.active
    cameras = (
        RigMember(
            one["camera"],
            services.cameras.title(one["camera"]),
            one["region"],
            one["rotate"],
            active(one["camera"]),
            (pictures or {}).get(one["camera"]),
        )
        for one in body["cameras"]
    )
    return Rig(
        saved.name,
        body["title"] or saved.name,
        services.fields[body["field"]],
        Rectangles.of_rig(body),
        tuple(cameras),
    )


def rig_json(services: Services, saved: Document) -> RigJson:
    """Return the rig as the API shows it; called in a worker thread of the event loop that its cameras run on."""
    rig, body = rig_of(services, saved), saved.body
    check = services.part(RigState).checks.get(rig)
    titles = (
        {}
        if check is None
        else {c.camera: c.title for c in rig.cameras if c.calibration is not None}
    )
    statuses = {camera: from_thread.run_sync(services.live.status, camera) for camera in titles}
    return {
        "name": saved.name,
        "title": body["title"],
        "field": body["field"],
        "w_max_rectangle_px": body["w_max_rectangle_px"],
        "h_max_rectangle_px": body["h_max_rectangle_px"],
        "n_rectangles_x": body["n_rectangles_x"],
        "n_rectangles_y": body["n_rectangles_y"],
        **rig_status(rig),
        "checked": None if check is None else as_of_now(check, titles, statuses, utc_now()),
        "updated_at": saved.updated_at,
        "updated_by": saved.updated_by,
    }


def snapshots_by_camera(services: Services, rig: Document, texts: Iterable[str]) -> dict[str, str]:
    """Read CAMERA:SNAPSHOT, or a snapshot that a camera of the rig has taken, as {camera: snapshot}."""
    store, known, snapshots = (
        services.store,
        [camera["camera"] for camera in rig.body["cameras"]],
        {},
    )
    for text in texts:
        camera, _, id = text.rpartition(":")
        camera = camera or store.snapshots.get(id).camera or ""
        if camera not in known:
            raise BadInput(
                f"The camera of the rig that took the image {id!r} is unknown.",
                f"Write CAMERA:{id}, with one of {', '.join(known)}.",
                reason="unknown-camera",
            )
        snapshots[camera] = store.snapshots.get(id).id
    return snapshots


async def take_frames(
    services: Services, cameras: Iterable[str]
) -> tuple[dict[str, TakenFrame], list[RigTrouble]]:
    """Take a frame of each camera, all at once; and say what is wrong with those that give none."""

    async def take(id: str) -> TakenFrame | RigTrouble:
        try:
            return await take_frame(services.live.get(id))
        except TouchlineError as error:
            return camera_trouble(id, error.reason, error.what, error.fix)

    results = await asyncio.gather(*map(take, cameras))
    return (
        {frame.camera.id: frame for frame in results if isinstance(frame, TakenFrame)},
        [problem for problem in results if not isinstance(problem, TakenFrame)],
    )


def save_frames(services: Services, frames: Mapping[str, TakenFrame]) -> dict[str, dict[str, Any]]:
    """Keep the frames that were taken for a check, so that it can be repeated; return them as a job reads them."""
    snapshots = services.store.snapshots
    return {
        camera: snapshots.for_job(frame.save(services.store, "rig").id)
        for camera, frame in frames.items()
    }


def stitcher_for(
    services: Services, rig: Rig, cameras: Iterable[str], width: int, progress: Progress
) -> tuple[Stitcher, list[str]]:
    """Return the maps for those cameras at that width, and their names in order; made once while nothing changes."""
    cameras = set(cameras)
    shown = (
        (c.camera, c.region, c.calibration.id)
        for c in rig.cameras
        if c.camera in cameras and c.calibration is not None
    )
    # the whole field: one's own may change under its name
    key = (width, json.dumps(rig.field_json), *shown)
    return services.part(RigState).stitchers.get_or_make(
        key, lambda: stitcher_of(rig, cameras, FieldView(rig.field, width), progress)
    )


def as_of_now(
    check: NewestCheck,
    titles: Mapping[str, str],
    statuses: Mapping[str, CameraStatus],
    now: datetime,
) -> CheckedRig:
    """Return a check with what outdates it, what makes it void first.

    titles, statuses: of the rig's cameras that have a calibration, by id; now: with a time zone.
    """
    outdated = [
        *(
            one
            for camera, title in titles.items()
            if (one := _of_camera(camera, title, statuses[camera]))
        ),
        *_of_age(check["at"], now),
    ]
    outdated.sort(key=lambda one: one["reason"] not in VOID)
    void = [one for one in outdated if one["reason"] in VOID]
    moved = {one["camera"] for one in void}
    verdict = check["verdict"]
    if void and verdict["level"] is not None:
        verdict = stated(
            RigVerdict(
                level=None,
                reason="outdated",
                fix=sentence_in(void[0], "fix"),
                sentence=join(
                    say("rig.void", "The last check is no longer valid."),
                    *(sentence_in(one, "text") for one in void),
                ),
            )
        )
    return {
        **check,
        "verdict": verdict,
        "outdated": outdated,
        "pairs": [pair for pair in check["pairs"] if moved.isdisjoint((pair["a"], pair["b"]))],
    }


def _of_camera(camera: str, title: str, status: CameraStatus) -> OutdatedCheck | None:
    drift, named = status["drift"], say("rig.of-camera", "{camera}:", camera=title)
    if drift is None:
        return stated(
            OutdatedCheck(
                camera=camera,
                reason="not-monitored",
                text=say(
                    "rig.not-live",
                    "{camera} is not monitored for movement: it is not live.",
                    camera=title,
                ),
                fix=join(say("rig.not-live.fix", "Check its connection."), CHECK_AGAIN),
            )
        )
    if not drift["alarm"] and drift["monitored"]:
        return None
    reason = REASONS[drift["state"]] if drift["alarm"] else "not-monitored"
    return stated(
        OutdatedCheck(
            camera=camera,
            reason=reason,
            text=join(named, sentence_in(drift, "sentence")),
            fix=join(sentence_in(drift, "fix"), CHECK_AGAIN),
        )
    )


def _of_age(at: str, now: datetime) -> Iterator[OutdatedCheck]:
    age = now - datetime.fromisoformat(at.replace("Z", "+00:00"))
    if age > MAX_AGE:
        yield stated(
            OutdatedCheck(
                camera=None,
                reason="old",
                text=say(
                    "rig.old-check",
                    "The last check is {hours} hours old.",
                    hours=int(age / timedelta(hours=1)),
                ),
                fix=say("rig.old-check.fix", "Check the rig again."),
            )
        )


async def neighbour_claims(
    services: Services, calibration: Calibration, _is_abandoned: IsAbandoned
) -> list[Claim]:
    """Compare a version with the active ones of its neighbours; nothing of a version that belongs to no camera."""
    return await services.run_in_thread(_against_neighbours, services, calibration)


def _against_neighbours(services: Services, calibration: Calibration) -> list[Claim]:
    if calibration.camera is None:
        return []
    claims: list[Claim] = []
    for id, title, other in _neighbours(services, calibration):
        claims += services.claims_kept.get_or_make(
            ("neighbour", calibration.id, other.id),
            partial(_neighbour, calibration, id, title, other),
        )
    return claims


def _neighbour(calibration: Calibration, id: str, title: str, other: Calibration) -> list[Claim]:
    if calibration.field != other.field:
        return []
    names = calibration.camera or "", title
    try:
        found = compare(calibration, other, field_from_json(calibration.field), names)
    except FitFailed:  # they share nothing
        return []
    against = [
        trouble["level"]
        for name, each in zip(names, (calibration, other), strict=True)
        for trouble in of_report(name, name, each.report)
        if trouble["level"] is not None
    ]
    return [neighbour_claim(id, title, found.agreement, against)]


def _neighbours(
    services: Services, calibration: Calibration
) -> Iterator[tuple[str, str, Calibration]]:
    """Yield other cameras over the same field whose areas touch this one: id, name and active version."""
    regions, name = calibration.field["regions"], calibration.field["name"]
    own = regions.get(calibration.region)
    for camera in services.cameras.all():
        if camera.id == calibration.camera or camera.field != name:
            continue
        there = None if camera.region is None else regions.get(camera.region)
        if own is not None and there is not None and not _touch(own, there):
            continue
        if (active := services.store.calibrations.active(camera.id)) is not None:
            yield camera.id, camera.title, active


def _touch(one: Any, other: Any) -> bool:
    return all(
        max(one[axis]) >= min(other[axis]) and max(other[axis]) >= min(one[axis])
        for axis in ("x", "y")
    )


def site_claims(services: Services) -> list[Claim]:
    """Return the claim of each rig, from what is known now; called as rig_json is."""
    return [_site_claim(rig_json(services, saved)) for saved in services.store.rigs.all()]


def _site_claim(rig: RigJson) -> Claim:
    troubles = [
        one for camera in rig["cameras"] for one in camera["troubles"] if one["reason"] in OF_RIG
    ]
    known = (
        CheckedLevel()
        if (checked := rig["checked"]) is None
        else CheckedLevel(
            True,
            checked["verdict"]["level"],
            checked["p95_mm"],
            join(*(sentence_in(one, "text") for one in checked["outdated"][:1])),
        )
    )
    return rig_claim(rig["name"], rig["title"] or rig["name"], known, troubles)
