"""Detection settings of each camera: its stages, its colours, whether its detections are published; and defaults.

A camera has a colour profile of its own or names one that others use too; with neither, its process finds the colours
in its first picture.
"""

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any

from touchline.core.colour_profile import ColourProfile, ProfileJson
from touchline.core.errors import Conflict, NotFound, Stale, TouchlineError
from touchline.core.field import Field
from touchline.core.field_json import field_from_json
from touchline.core.records import Calibration, Frame
from touchline.core.statements import say, stated
from touchline.formats.ssl_geometry import camera_number
from touchline.live.detection_feed import OFF
from touchline.services.cameras import CameraService
from touchline.services.publishing import PublishingService
from touchline.store.fields import FieldRepository
from touchline.store.stages import named_plan
from touchline.store.store import Store
from touchline.vision.colour.automatic import automatic_profile
from touchline.vision.colour.separability import colour_health
from touchline.vision.stage_pipeline import StageConfig
from touchline.workflows.detection import colour_profile_for

UNSET = "unset"  # the ETag of settings that nobody has saved yet
SMALL_MM = 100.0  # robots lower than that wear two colours, and no SSL pattern
FIELD_SHARE = 0.9  # of the picture's diagonal, about
DEFAULT_EXTENT_MM = 5000.0  # where not even the field is known


class DetectionService:
    """Thread-safe; calls of the store block."""

    def __init__(self, store: Store, cameras: CameraService, fields: FieldRepository,
                 publishing: PublishingService) -> None:
        self._store, self._cameras, self._fields, self._publishing = store, cameras, fields, publishing

    def settings(self, id: str) -> tuple[dict[str, Any], str]:
        """Return {"on", "plan", "colours", "profile", "publish"} of a camera, and its ETag; NotFound."""
        self._cameras.get(id)
        try:
            preset = self._store.detection_plans.get(id)
        except NotFound:
            plan = named_plan(self._default_plan(id)).to_json()
            return {"on": True, "plan": plan, "colours": None, "profile": None, "publish": False}, UNSET
        return dict(preset.body), preset.etag

    def save(self, id: str, body: Mapping[str, Any], etag: str, by: str) -> None:
        """Save settings; Stale where somebody else was faster, NotFound or BadInput for an unknown profile or plan."""
        self._cameras.get(id)
        plan = named_plan(body["plan"]) if isinstance(body["plan"], str) else StageConfig.from_json(body["plan"])
        profile = None if body["profile"] is None else ColourProfile.from_json(body["profile"]).to_json()
        try:
            with self._store.references:
                if body["colours"] is not None and self.colours(body["colours"]).to_json() == profile:
                    profile = None  # it is the shared one, and follows it
                settings = {"on": body["on"], "plan": plan.to_json(), "colours": body["colours"], "profile": profile,
                            "publish": body["publish"]}
                self._store.detection_plans.save(id, settings, None if etag == UNSET else etag, by)
        except Conflict as error:
            if error.reason != "seeing-exists":
                raise
            current = self._store.detection_plans.get(id)
            raise Stale(say("detection.changed-meanwhile", "Another user has changed the object detection of this "
                            "camera since you opened it."),
                        say("detection.check-settings", "Check the current settings, then change them."),
                        reason="stale-seeing", current=dict(current.body), etag=current.etag) from None

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
        known = {camera.id for camera in self._cameras.all()}  # settings of a removed camera do not count
        return [preset.name for preset in self._store.detection_plans.all()
                if preset.body["colours"] == colours and preset.name in known]

    def remove_colours(self, name: str, etag: str | None) -> None:
        """Delete a profile with that ETag (None: whichever); Conflict while cameras name it, NotFound or Stale."""
        with self._store.references:
            if cameras := self.used_by(name):
                self._store.colour_profiles.get(name)
                raise Conflict(say("colours.in-use", "Cameras use the colour profile {name!r}: {cameras}.", name=name,
                                   cameras=list(cameras)),
                               say("colours.select-another", "Select another colour profile for these cameras first."),
                               reason="colours-used")
            self._store.colour_profiles.delete(name, etag)

    def process_settings(self, id: str) -> dict[str, Any]:
        """Return what a camera's process needs; switched off where saved settings cannot be read any more."""
        try:
            settings, _ = self.settings(id)
            StageConfig.from_json(settings["plan"])
            calibration = self._store.calibrations.active(id)
            return {"on": settings["on"], "plan": settings["plan"], "profile": self.profile(settings),
                    "publish": settings["publish"] and settings["on"], "camera_number": self._number(id, calibration),
                    "extent_mm": self._extent_mm(id)}
        except (TouchlineError, KeyError):
            return dict(OFF)

    def saved_frame_settings(self, id: str) -> dict[str, Any]:
        """Return "plan", "profile" and "extent_mm" for saved frames of a camera; defaults if it was removed."""
        try:
            settings, _ = self.settings(id)
            return {"plan": settings["plan"], "profile": self.profile(settings), "extent_mm": self._extent_mm(id)}
        except NotFound:
            return {"plan": named_plan("ssl").to_json(), "profile": None, "extent_mm": DEFAULT_EXTENT_MM}

    def publish(self, packet: bytes) -> TouchlineError | None:
        """Send a packet to the league's multicast group; return why it could not be sent."""
        sender = self._publishing.publisher.sender
        if sender is None:
            return Conflict(say("publishing.off", "Publishing is off."),
                            say("publishing.switch-on", 'Switch it on: PUT /api/v1/publishing with "enabled": true.'),
                            reason="not-publishing")
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
        return "vsss" if field is not None and field.hat_height_mm < SMALL_MM else "ssl"

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
        numbers = self._publishing.publisher.config.numbers
        if id in numbers:
            return numbers[id]
        field = field_from_json(calibration.field)
        return camera_number(field, field.region(calibration.region, calibration.rotate))


def health_json(profile: Mapping[str, Any] | None) -> list[dict[str, Any]]:
    """Return how well each colour is separated from the others; margin: in spreads, null where nothing is near."""
    if profile is None:
        return []
    entries = [health.to_json() for health in colour_health(ColourProfile.from_json(profile))]
    return [stated({"colour": entry["colour"], "margin": entry["gap"], "words": entry["sentence"],
                    "level": entry["level"], "nearest": entry["nearest"]}) for entry in entries]


def learn_profile(frame: Frame, plan: StageConfig, base: ColourProfile | None, clicks: Mapping[str, Any],
                  find_colours: bool) -> ColourProfile:
    """Return a profile from clicks by colour, from what is found in the picture, or from both: clicks win."""
    found = base
    if find_colours:
        found = (colour_profile_for(frame.pixels, plan) if base is None else
                 automatic_profile(base.name, frame.pixels, tuple(base.colours), base))
    if not any(clicks.values()):
        return found if found is not None else colour_profile_for(frame.pixels, plan)
    clicked = colour_profile_for(frame.pixels, plan, base, clicks)
    if not find_colours or found is None:
        return clicked
    others = {colour: samples for colour, samples in found.colours.items() if colour not in clicks}
    return replace(clicked, name=found.name, notes=found.notes, colours={
        **others, **{colour: clicked.colours[colour] for colour in clicks if colour in clicked.colours}})
