"""What each camera is to see, as operators have set it: its plan, its colours, whether it is published; and by default.

A camera keeps a profile of its own or names one that others use too; where it has neither, its process finds the
colours in its first picture.
"""

from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from app.core.colour_profile import ColourProfile
from app.core.errors import Conflict, NotFound, Stale, TouchlineError
from app.core.field import Field
from app.core.field_json import field_from_json
from app.core.records import Calibration
from app.formats.ssl_geometry import camera_number
from app.live.detection_feed import OFF
from app.services.cameras import CameraShelf
from app.services.publishing import PublishingShelf
from app.store import Store
from app.store.field_repository import FieldRepository
from app.store.stages import named_plan
from app.vision.colour.separability import colour_health
from app.vision.stage_pipeline import StageConfig

UNKEPT = "unset"  # the ETag of what nobody has set yet
SMALL_MM = 100.0  # robots lower than that wear two colours, and no butterfly
FILLED = 0.9  # of the picture, about, by the field
SOME_FIELD_MM = 5000.0  # where not even the field is known


class SeeingShelf:
    """Thread-safe; what it asks of the store may block."""

    def __init__(self, store: Store, cameras: CameraShelf, fields: FieldRepository,
                 publishing: PublishingShelf) -> None:
        self._store, self._cameras, self._fields, self._publishing = store, cameras, fields, publishing

    def kept(self, id: str) -> tuple[dict[str, Any], str]:
        """{"on", "plan", "colours", "profile", "publish"} of a camera, and its ETag; NotFound for an unknown one."""
        self._cameras.get(id)
        try:
            preset = self._store.detection_plans.get(id)
        except NotFound:
            plan = named_plan(self._usual_plan(id)).to_json()
            return {"on": True, "plan": plan, "colours": None, "profile": None, "publish": False}, UNKEPT
        return dict(preset.body), preset.etag

    def save(self, id: str, body: Mapping[str, Any], etag: str, by: str) -> None:
        """Stale where somebody else was faster; NotFound or BadInput for a profile or a plan that there is not."""
        self._cameras.get(id)
        plan = named_plan(body["plan"]) if isinstance(body["plan"], str) else StageConfig.from_json(body["plan"])
        profile = None if body["profile"] is None else ColourProfile.from_json(body["profile"]).to_json()
        if body["colours"] is not None and self.colours(body["colours"]).to_json() == profile:
            profile = None  # it is the shared one, and follows it
        kept = {"on": body["on"], "plan": plan.to_json(), "colours": body["colours"], "profile": profile,
                "publish": body["publish"]}
        try:
            self._store.detection_plans.save(id, kept, None if etag == UNKEPT else etag, by)
        except Conflict as error:
            if error.reason != "seeing-exists":
                raise
            current = self._store.detection_plans.get(id)
            raise Stale("Somebody else has set what this camera sees since you opened it.", "Look at it again, then "
                        "change it.", reason="stale-seeing", current=dict(current.body), etag=current.etag) from None

    def colours(self, name: str) -> ColourProfile:
        """A kept profile; NotFound."""
        return ColourProfile.from_json(self._store.colour_profiles.get(name).body)

    def profile(self, kept: Mapping[str, Any]) -> dict[str, Any] | None:
        """The colours that a camera goes by: its own, or those it names; None where it finds them itself."""
        if kept["profile"] is not None:
            return kept["profile"]
        if kept["colours"] is not None:
            with suppress(NotFound):
                return self.colours(kept["colours"]).to_json()
        return None

    def used_by(self, colours: str) -> list[str]:
        """Cameras that name these colours."""
        known = {camera.id for camera in self._cameras.all()}  # what was set for one that is removed holds nothing up
        return [preset.name for preset in self._store.detection_plans.all()
                if preset.body["colours"] == colours and preset.name in known]

    def wanted(self, id: str) -> dict[str, Any]:
        """What a camera's process is told; switched off where what was kept is not understood any more."""
        try:
            kept, _ = self.kept(id)
            StageConfig.from_json(kept["plan"])
            calibration = self._store.calibrations.active(id)
            return {"on": kept["on"], "plan": kept["plan"], "profile": self.profile(kept),
                    "publish": kept["publish"] and kept["on"], "camera_number": self._number(id, calibration),
                    "extent_mm": self._extent_mm(id)}
        except (TouchlineError, KeyError):
            return dict(OFF)

    def still(self, id: str) -> dict[str, Any]:
        """By what a kept picture of a camera is looked at: "plan", "profile", "extent_mm"; usual for one removed."""
        try:
            kept, _ = self.kept(id)
            return {"plan": kept["plan"], "profile": self.profile(kept), "extent_mm": self._extent_mm(id)}
        except NotFound:
            return {"plan": named_plan("ssl").to_json(), "profile": None, "extent_mm": SOME_FIELD_MM}

    def publish(self, packet: bytes) -> TouchlineError | None:
        """Send it to the league's group; why it did not leave."""
        sender = self._publishing.publishing.sender
        if sender is None:
            return Conflict("Nothing is published to the network.", "Switch it on: PUT /api/v1/publishing with "
                            '"enabled": true.', reason="not-publishing")
        try:
            sender.send(packet)
        except TouchlineError as error:
            return error
        return None

    def _field(self, id: str) -> Field | None:
        name = self._cameras.get(id).field
        return self._fields[name] if name is not None and name in self._fields else None

    def _usual_plan(self, id: str) -> str:
        field = self._field(id)
        return "vsss" if field is not None and field.hat_height_mm < SMALL_MM else "ssl"

    def _extent_mm(self, id: str) -> float:
        field, region = self._field(id), self._cameras.get(id).region
        if field is None:
            return SOME_FIELD_MM
        if region is not None:
            with suppress(TouchlineError):
                seen = field.region(region)
                return float((seen.width_mm**2 + seen.height_mm**2) ** 0.5) / FILLED
        return float((field.length_mm**2 + field.width_mm**2) ** 0.5) / FILLED

    def _number(self, id: str, calibration: Calibration | None) -> int:
        """The camera's number on the wire, the same as in the geometry that is published."""
        if calibration is None:
            return 0
        numbers = self._publishing.publishing.config.numbers
        if id in numbers:
            return numbers[id]
        field = field_from_json(calibration.field)
        return camera_number(field, field.region(calibration.region, calibration.rotate))


def health_json(profile: Mapping[str, Any] | None) -> list[dict[str, Any]]:
    """How well each colour is told from the others, in words; margin: in spreads, null where nothing is near."""
    if profile is None:
        return []
    told = [health.to_json() for health in colour_health(ColourProfile.from_json(profile))]
    return [{"colour": one["colour"], "margin": one["gap"], "words": one["sentence"], "level": one["level"],
             "nearest": one["nearest"]} for one in told]
