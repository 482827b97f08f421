"""In the server: what each camera is to detect, who listens to its detections, and the tracks of a rig.

A camera has a colour profile of its own or names one that others use too; with neither, its process finds the colours
in its first picture. What a process detected is passed on as it came: the server reads none of it but a packet that
goes to the network, and the positions that are tracked.
"""

import asyncio
import contextlib
import json
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any

from touchline.core.errors import Conflict, NotFound, Stale, TouchlineError, Unavailable
from touchline.core.field import Field
from touchline.core.field_json import field_from_json
from touchline.core.geometry import Pixels
from touchline.core.json_values import JsonObject
from touchline.core.records import Calibration
from touchline.core.sentences import NOT_CALIBRATED, OPEN_AGAIN, SENDS_NO_FRAMES, use_one_of
from touchline.core.statements import say
from touchline.detection.detect import (
    colour_profile_for,
    detection_json,
    detections_image,
    pipeline_for,
    wears_ssl_pattern,
)
from touchline.detection.profile import ColourProfile, ProfileJson
from touchline.detection.records import Detection
from touchline.detection.stages import DRAWN, STAGE, STAGES, StageConfig, stage_of
from touchline.detection.store import ClipRepository, named_plan
from touchline.detection.tracks import ObjectTracker, seams_of
from touchline.formats.ssl_vision import camera_number
from touchline.league.service import PublishingService
from touchline.live.camera import LiveCamera
from touchline.live.camera_feed import CameraFeed
from touchline.live.streams import Viewer
from touchline.processes.framing import decode_body, split_body
from touchline.referee.heights import TEAMS, TeamHeight
from touchline.referee.service import RefereeService
from touchline.services.container import Services

UNSET = "unset"  # the ETag of settings that nobody has saved yet
FIELD_SHARE = 0.9  # of the picture's diagonal, about
DEFAULT_EXTENT_MM = 5000.0  # where not even the field is known
OFF: dict[str, Any] = {
    "on": False,
    "plan": None,
    "profile": None,
    "publish": False,
    "camera_number": 0,
    "extent_mm": 1.0,
    "team_z_mm": {},
}
INPUT_FPS = 20.0  # of each camera that go in: the server's own thread reads them
INTERVAL_S = 0.05
RETRY_S = 1.0  # after a camera that cannot be listened to
SILENT_S = 5.0
RAW = "raw"  # a clip's frame as it is


class DetectionService:
    """Thread-safe; calls of the store block."""

    def __init__(self, services: Services) -> None:
        self._store, self._cameras, self._fields = services.store, services.cameras, services.fields
        self._publishing = services.part(PublishingService)
        self._referee = services.part(RefereeService)

    def settings(self, id: str) -> tuple[dict[str, Any], str]:
        """Return {"on", "plan", "colours", "profile", "publish"} of a camera, and its ETag; NotFound."""
        self._cameras.get(id)
        try:
            preset = self._store.detection_plans.get(id)
        except NotFound:
            plan = named_plan(self._default_plan(id)).to_json()
            return {
                "on": True,
                "plan": plan,
                "colours": None,
                "profile": None,
                "publish": False,
            }, UNSET
        return dict(preset.body), preset.etag

    def save(self, id: str, body: Mapping[str, Any], etag: str, by: str) -> None:
        """Save settings; Stale where somebody else was faster, NotFound or BadInput for an unknown profile or plan."""
        self._cameras.get(id)
        plan = (
            named_plan(body["plan"])
            if isinstance(body["plan"], str)
            else StageConfig.from_json(body["plan"])
        )
        profile = (
            None if body["profile"] is None else ColourProfile.from_json(body["profile"]).to_json()
        )
        try:
            with self._store.references:
                if (
                    body["colours"] is not None
                    and self.colours(body["colours"]).to_json() == profile
                ):
                    profile = None  # it is the shared one, and follows it
                settings = {
                    "on": body["on"],
                    "plan": plan.to_json(),
                    "colours": body["colours"],
                    "profile": profile,
                    "publish": body["publish"],
                }
                self._store.detection_plans.save(id, settings, None if etag == UNSET else etag, by)
        except Conflict as error:
            if error.reason != "seeing-exists":
                raise
            current = self._store.detection_plans.get(id)
            raise Stale(
                say(
                    "detection.changed-meanwhile",
                    "Another user has changed the object detection of this "
                    "camera since you opened it.",
                ),
                say("detection.check-settings", "Check the current settings, then change them."),
                reason="stale-seeing",
                current=dict(current.body),
                etag=current.etag,
            ) from None

    def colours(self, name: str) -> ColourProfile:
        """Return a saved profile; NotFound."""
        return ColourProfile.from_json(self._store.colour_profiles.get(name).body)

    def profile(self, settings: Mapping[str, Any]) -> ProfileJson | None:
        """Return the camera's own colours, or those it names; None where it finds them itself."""
        if settings["profile"] is not None:
            return settings["profile"]
        if settings["colours"] is not None:
            with suppress(NotFound):
                return self.colours(settings["colours"]).to_json()
        return None

    def used_by(self, colours: str) -> list[str]:
        """Return the cameras that name these colours."""
        # settings of a removed camera do not count
        known = {camera.id for camera in self._cameras.all()}
        return [
            preset.name
            for preset in self._store.detection_plans.all()
            if preset.body["colours"] == colours and preset.name in known
        ]

    def remove_colours(self, name: str, etag: str | None) -> None:
        """Delete a profile with that ETag (None: whichever); Conflict while cameras name it, NotFound or Stale."""
        with self._store.references:
            if cameras := self.used_by(name):
                self._store.colour_profiles.get(name)
                raise Conflict(
                    say(
                        "colours.in-use",
                        "Cameras use the colour profile {name!r}: {cameras}.",
                        name=name,
                        cameras=list(cameras),
                    ),
                    say(
                        "colours.select-another",
                        "Select another colour profile for these cameras first.",
                    ),
                    reason="colours-used",
                )
            self._store.colour_profiles.delete(name, etag)

    def process_settings(self, id: str) -> dict[str, Any]:
        """Return what a camera's process needs; switched off where saved settings cannot be read any more."""
        try:
            settings, _ = self.settings(id)
            StageConfig.from_json(settings["plan"])
            calibration = self._store.calibrations.active(id)
            return {
                "on": settings["on"],
                "plan": settings["plan"],
                "profile": self.profile(settings),
                "publish": settings["publish"] and settings["on"],
                "camera_number": self._number(id, calibration),
                "extent_mm": self._extent_mm(id),
                "team_z_mm": self._referee.heights(),
            }
        except (TouchlineError, KeyError):
            return dict(OFF)

    def teams(self, id: str) -> JsonObject:
        """Return blue's and yellow's robots as this camera takes them: team, entry, height_mm, source."""
        calibration = self._store.calibrations.active(id)
        field = self._field(id) if calibration is None else field_from_json(calibration.field)
        usual_mm = None if field is None else field.hat_height_mm
        is_small = field is not None and not wears_ssl_pattern(field)
        found = dict.fromkeys(TEAMS, TeamHeight()) if is_small else self._referee.teams()
        return {
            team: {**one.to_json(), "height_mm": one.height_mm or usual_mm}
            for team, one in found.items()
        }

    def team_heights(self) -> Mapping[str, float]:
        """Return the heights of the teams whose robots are known."""
        return self._referee.heights()

    def saved_frame_settings(self, id: str) -> dict[str, Any]:
        """Return "plan", "profile" and "extent_mm" for saved frames of a camera; defaults if it was removed."""
        try:
            settings, _ = self.settings(id)
            return {
                "plan": settings["plan"],
                "profile": self.profile(settings),
                "extent_mm": self._extent_mm(id),
            }
        except NotFound:
            return {
                "plan": named_plan("ssl").to_json(),
                "profile": None,
                "extent_mm": DEFAULT_EXTENT_MM,
            }

    def publish(self, id: str, packet: bytes) -> TouchlineError | None:
        """Send a camera's packet to where its geometry is published; return why it could not be sent."""
        sender = self._publishing.of_camera(id).sender
        if sender is None:
            return Conflict(
                say("publishing.off", "Publishing is off."),
                say(
                    "publishing.switch-on",
                    'Switch it on: PUT /api/v1/publishing with "enabled": true.',
                ),
                reason="not-publishing",
            )
        try:
            sender.send(packet)
        except TouchlineError as error:
            return error
        return None

    def _field(self, id: str) -> Field | None:
        name = self._cameras.get(id).field
        return self._fields[name] if name is not None and name in self._fields else None

    def _default_plan(self, id: str) -> str:
        field = self._field(id)
        return "ssl" if field is None or wears_ssl_pattern(field) else "vsss"

    def _extent_mm(self, id: str) -> float:
        field, region = self._field(id), self._cameras.get(id).region
        if field is None:
            return DEFAULT_EXTENT_MM
        if region is not None:
            with suppress(TouchlineError):
                part = field.region(region)
                return math.hypot(part.width_mm, part.height_mm) / FIELD_SHARE
        return math.hypot(field.length_mm, field.width_mm) / FIELD_SHARE

    def _number(self, id: str, calibration: Calibration | None) -> int:
        """Return the camera's number in packets, the same as in the published geometry."""
        if calibration is None:
            return 0
        numbers = self._publishing.of_camera(id).config.numbers
        if id in numbers:
            return numbers[id]
        field = field_from_json(calibration.field)
        return camera_number(field, field.region(calibration.region, calibration.rotate))


class DetectionFeed(CameraFeed):
    """What a camera is to detect, and what of it leaves for the network. learned: the colours found in its picture.

    packets: how many have left; problem: why the last one did not.
    """

    NAME = "detections"
    views = (DRAWN, *(STAGE + name for name in STAGES))

    def __init__(self, services: Services, camera: str, changed: Callable[[], None]) -> None:
        super().__init__(services, camera, changed)
        self._service = services.part(DetectionService)
        self.request: Mapping[str, Any] = OFF
        self.learned: ProfileJson | None = None
        self.packets = 0
        self.problem: TouchlineError | None = None

    def refresh(self) -> None:
        self.follow(self._service.process_settings(self.camera))

    def follow(self, request: Mapping[str, Any]) -> None:
        """Detect this from now on: {"on", "plan", "profile", "publish", "camera_number", "extent_mm",
        "team_z_mm"}."""
        if dict(request) == dict(self.request):
            return
        if (request["plan"], request["profile"]) != (self.request["plan"], self.request["profile"]):
            self.learned = None
        self.request, self.problem = dict(request), None
        if not request["on"]:
            self.end(_off())
        self.changed()

    def settings(self) -> JsonObject:
        return {**self.request, "run": bool(self.viewers) or self.request["publish"]}

    def require_view(self, view: str) -> None:
        self.require_listening()
        name, stages = stage_of(view), [stage["stage"] for stage in self.request["plan"]["stages"]]
        if name is not None and name not in stages:
            raise NotFound(
                say(
                    "detection.unknown-stage",
                    "This camera's plan has no stage called {stage!r}.",
                    stage=name,
                ),
                use_one_of(stages),
                reason="unknown-stage",
            )

    def require_listening(self) -> None:
        if not self.request["on"]:
            raise _off()

    def receive(self, body: bytes) -> None:
        super().receive(body)
        _, packet = split_body(body)
        if len(packet) and self.request["publish"]:
            self.problem = self._service.publish(self.camera, bytes(packet))
            self.packets += self.problem is None

    def update_status(self, status: Mapping[str, Any]) -> None:
        found = status.get("detector")
        self.learned = (
            found["learned"] if found is not None and self.request["profile"] is None else None
        )


def detections_of(camera: LiveCamera) -> DetectionFeed:
    """Return what a camera detects."""
    feed = camera.feeds[DetectionFeed.NAME]
    assert isinstance(feed, DetectionFeed)
    return feed


def json_text(body: bytes) -> str:
    """Return a message's JSON, not parsed."""
    text, _ = split_body(body)
    return str(text, "ascii")


def _off() -> Conflict:
    return Conflict(
        say("detection.off", "Object detection is off for this camera."),
        say("detection.enable", 'Enable it: PUT /api/v1/cameras/{{id}}/seeing with "on": true.'),
        reason="seeing-off",
    )


class TrackFusion:
    """The tracks of one rig. Only for the event loop's own thread. camera: by its name, started; raises why not."""

    def __init__(self, names: Sequence[str], camera: Callable[[str], LiveCamera]) -> None:
        self.names = tuple(names)
        self._camera = camera
        self._viewers: set[Viewer] = set()
        self._tasks: list[asyncio.Task[None]] = []
        self._tracker = ObjectTracker()
        self._received_s: dict[str, float] = {}
        self._problems: dict[str, TouchlineError] = {}

    @contextlib.contextmanager
    def listening(self) -> Iterator[Viewer]:
        """Yield a viewer of JSON texts; nothing is followed when nobody listens."""
        viewer = Viewer()
        self._viewers.add(viewer)
        if not self._tasks:
            self._tracker = ObjectTracker()
            self._tasks = [asyncio.create_task(self._follow(name)) for name in self.names]
            self._tasks.append(asyncio.create_task(self._send()))
        try:
            yield viewer
        finally:
            self._viewers.discard(viewer)
            if not self._viewers:
                self._rest()

    def end(self) -> None:
        """The rig was changed, or the server ends."""
        self._rest()
        for viewer in self._viewers:
            viewer.end(
                Unavailable(
                    say("rig.changed", "This rig was changed or removed."),
                    OPEN_AGAIN,
                    reason="rig-gone",
                )
            )

    def _rest(self) -> None:
        for task in self._tasks:
            task.cancel()
        self._tasks = []

    async def _follow(self, name: str) -> None:
        """One camera, again and again: it may be switched off, changed, or come later."""
        while True:
            try:
                with self._camera(name).feeds[DetectionFeed.NAME].listening(INPUT_FPS) as viewer:
                    while True:
                        self._add(name, decode_body(await viewer.next(SILENT_S))[0])
            except TouchlineError as error:
                self._problems[name] = error
            # nothing, or nothing that can be read
            except (TimeoutError, ConnectionResetError, KeyError, TypeError):
                self._problems[name] = Unavailable(
                    SENDS_NO_FRAMES,
                    say("advice.check-state", "Check its state."),
                    reason="camera-silent",
                )
            await asyncio.sleep(RETRY_S)

    def _add(self, name: str, message: dict[str, Any]) -> None:
        self._received_s[name] = time.monotonic()
        self._problems.pop(name, None)
        if message["calibration"] is None:
            self._problems[name] = Unavailable(
                NOT_CALIBRATED,
                say("advice.activate", "Activate a calibration."),
                reason="not-calibrated",
            )
        self._tracker.add(
            name, message["time_s"], [Detection.from_json(item) for item in message["items"]]
        )

    async def _send(self) -> None:
        while True:
            await asyncio.sleep(INTERVAL_S)
            if self._received_s or len(self._problems) == len(self.names):
                text = json.dumps(self._to_json(), separators=(",", ":")).encode()
                now = asyncio.get_running_loop().time()
                for viewer in self._viewers:
                    viewer.offer(text, now)

    def _to_json(self) -> dict[str, Any]:
        tracks = self._tracker.to_json()
        now, received, problems = time.monotonic(), self._received_s, self._problems
        return {
            "time_s": round(self._tracker.now_s or time.time(), 4),
            "items": tracks,
            "seams": seams_of(tracks),
            "cameras": [
                {
                    "camera": name,
                    "age_s": round(now - received[name], 3) if name in received else None,
                    "problem": problems[name].to_json() if name in problems else None,
                }
                for name in self.names
            ],
        }


class Fusions(dict[str, TrackFusion]):
    """What each rig tracks, by its name, while the server runs."""

    def __init__(self, _services: Services) -> None:
        super().__init__()


async def track_fusion_of(services: Services, name: str) -> TrackFusion:
    """Return the rig's fusion, shared by all who watch; a new one where its cameras have changed; NotFound."""
    rig = await services.run_in_thread(services.store.rigs.get, name)
    cameras = tuple(camera["camera"] for camera in rig.body["cameras"])
    fusions = services.part(Fusions)
    fusion = fusions.get(name)
    if fusion is None or fusion.names != cameras:
        if fusion is not None:
            fusion.end()
        fusion = fusions[name] = TrackFusion(cameras, services.live.get)
    return fusion


def detect_in_clip(
    services: Services, id: str, number: int, plan_name: str | None, stage: str = DRAWN
) -> tuple[dict[str, Any], Callable[[], Pixels]]:
    """Return detections as a live camera sends them, and what draws them or returns what the stage made of the frame.

    The stages run on one frame alone: what they remember must not depend on which frames were read before.
    """
    clips = services.store.repository(ClipRepository)
    clip, jpeg = clips.get(id), clips.frame(id, number)
    settings = services.part(DetectionService).saved_frame_settings(clip.camera)
    plan = (
        named_plan(plan_name) if plan_name is not None else StageConfig.from_json(settings["plan"])
    )
    names = [name for name, _ in plan.stages]
    if stage not in (DRAWN, *names):
        raise NotFound(
            f"The plan {plan.name} has no stage called {stage!r}.",
            f"Use one of: {RAW}, {DRAWN}, {', '.join(names)}.",
            reason="unknown-stage",
        )
    frame = services.decoder.frame_from_bytes(jpeg)
    calibration = services.store.calibrations.active(clip.camera)
    calibration = (
        calibration if calibration is not None and calibration.image_size == frame.size else None
    )
    profile = (
        ColourProfile.from_json(settings["profile"])
        if settings["profile"] is not None
        else colour_profile_for(frame.pixels, plan)
    )
    mm_per_px = None if calibration else settings["extent_mm"] / math.hypot(*frame.size)
    heights = services.part(DetectionService).team_heights()
    pipeline = pipeline_for(plan, frame.size, profile, calibration, mm_per_px, team_z_mm=heights)
    head, pictures = clip.frames[number], () if stage == DRAWN else (stage,)
    result = pipeline.process(
        frame.pixels,
        clock=time.thread_time,
        pictures=pictures,
        camera=clip.camera,
        frame=head["seq"],
        time_s=head["time_s"],
    )
    json = detection_json(
        result,
        head["seq"],
        head["time_s"],
        frame.size,
        calibration,
        profile.notes,
        clip.to_json()["fps"],
    )
    return (
        json,
        lambda: (
            detections_image(frame.pixels, result.detections, pipeline.context.view)
            if stage == DRAWN
            else result.pictures[stage]
        ),
    )
