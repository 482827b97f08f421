"""Cameras' calibrations → the league's geometry packet, and what its one-term lens loses of each in millimetres."""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from app.core.errors import Conflict, TouchlineError
from app.core.field_json import field_from_json
from app.core.records import Calibration
from app.evaluate.fit.approximation import ApproximationError, approximation_error
from app.formats.approximation import held
from app.formats.ssl_field import wire_field
from app.formats.ssl_geometry import camera_from_wire, camera_number, wire_camera
from app.formats.ssl_vision import SslVision
from app.league.config import Plan
from app.models import model_from_json
from app.models.top_view import VIEW_FIELDS
from app.ssl_protocol.messages import CameraCalibration, Geometry, Sender, WrapperPacket
from app.ssl_protocol.protobuf import decode, encode


@dataclass(frozen=True)
class Wired:
    """A calibration as the league's message holds it, under the number that its region has.

    loss: of that message, read back as a listener does, against the calibration. exact: whether the model is the
    league's own, so that only the rounding to four bytes is lost.
    """

    sent: CameraCalibration
    loss: ApproximationError
    exact: bool

    @property
    def worst_mm(self) -> float:
        return max(self.loss.worst_mm, self.loss.hat_worst_mm or 0.0)


@dataclass(frozen=True)
class Spoken:
    """One camera of the packet, or why it is not in it (problem)."""

    calibration: Calibration
    number: int
    wired: Wired | None = None
    problem: TouchlineError | None = None

    @property
    def name(self) -> str:
        return self.calibration.camera or self.calibration.id

    @property
    def sent(self) -> CameraCalibration | None:
        """As it is in the packet; None where it is left out."""
        if self.wired is None or self.problem is not None:
            return None
        return replace(self.wired.sent, camera_id=self.number)

    def to_json(self) -> dict[str, Any]:
        c, wired, problem = self.calibration, self.wired, self.problem
        loss = None if wired is None or not math.isfinite(wired.worst_mm) else wired.loss.to_json()
        return {"camera": self.name, "calibration": c.id, "version": c.version, "model": c.model_name,
                "field": c.field["name"], "region": c.region, "camera_id": self.number,
                "published": self.sent is not None, "exact": wired is not None and wired.exact, "loss": loss,
                "problem": None if problem is None else {
                    "reason": problem.reason, "what": problem.what, "fix": problem.fix}}


class Wiring:
    """Calibrations as messages, each worked out once: a version never changes, and the nearest lens takes a while."""

    KEPT = 64

    def __init__(self) -> None:
        self._known: dict[str, Wired | TouchlineError] = {}

    def __call__(self, calibration: Calibration) -> Wired | TouchlineError:
        """Or why the league's lens cannot hold it."""
        if calibration.id not in self._known:
            while len(self._known) >= self.KEPT:
                self._known.pop(next(iter(self._known)), None)
            self._known[calibration.id] = wired(calibration)
        return self._known[calibration.id]


def wired(calibration: Calibration) -> Wired | TouchlineError:
    """The calibration as a message and its loss, or why the league's lens cannot hold it."""
    try:
        field = field_from_json(calibration.field)
        region = field.region(calibration.region, calibration.rotate)
        camera = held(calibration, SslVision, approximate=True)
        sent = wire_camera(camera.camera, camera_number(field, region))
        read = camera_from_wire(decode(CameraCalibration, encode(sent)), field)
        back = read.camera({name: getattr(camera.camera, name) for name in VIEW_FIELDS})
        model = model_from_json(calibration.model_name, calibration.model_parameters)
        return Wired(sent, approximation_error(model, back, region, field.hat_height_mm), camera.loss is None)
    except TouchlineError as refused:
        return refused


def spoken(calibrations: Sequence[Calibration], plan: Plan,
           wire: Callable[[Calibration], Wired | TouchlineError] = wired) -> tuple[Spoken, ...]:
    """Each camera as it would be sent, or why not: its lens, its loss, its number, its field."""
    field = _field(calibrations, plan)
    told: list[Spoken] = []
    for calibration in calibrations:
        made = wire(calibration)
        if isinstance(made, TouchlineError):
            told.append(Spoken(calibration, plan.numbers.get(calibration.camera or "", 0), None, made))
            continue
        one = Spoken(calibration, plan.numbers.get(calibration.camera or "", made.sent.camera_id), made)
        told.append(replace(one, problem=_problem(one, told, plan, field)))
    return tuple(told)


def packet_of(told: Iterable[Spoken]) -> bytes | None:
    """The packet with all cameras that are to be sent; None where there is none."""
    cameras = [one for one in told if one.sent is not None]
    if not cameras:
        return None
    newest = max(cameras, key=lambda one: one.calibration.created_at)  # its field is the one of today
    field = wire_field(field_from_json(newest.calibration.field))
    return encode(WrapperPacket(geometry=Geometry(field, tuple(one.sent for one in cameras)),
                                source=int(Sender.OTHER)))


def _field(calibrations: Iterable[Calibration], plan: Plan) -> str | None:
    """The one field that a packet has: as it is set, else that of most cameras, the first of equals."""
    if plan.field is not None:
        return plan.field
    names = Counter(calibration.field["name"] for calibration in calibrations)
    return max(names, key=lambda name: names[name], default=None)


def _problem(one: Spoken, before: Iterable[Spoken], plan: Plan, field: str | None) -> TouchlineError | None:
    """Why a camera that the lens can hold is left out; None where it is sent."""
    name, worst = one.name, one.wired.worst_mm
    if one.calibration.field["name"] != field:
        return Conflict(f"{name} looks at {one.calibration.field['name']}, and a packet has one field: {field}.",
                        "Publish that field instead, or switch this camera's field.", reason="other-field")
    twin = next((other for other in before if other.sent is not None and other.number == one.number), None)
    if twin is not None:
        return Conflict(f"{name} and {twin.name} would both be camera {one.number}.",
                        f"Give {name} a number of its own.", reason="number-taken")
    if not math.isfinite(worst):
        return Conflict(f"The league's lens does not reach all that {name} sees.",
                        "Fit the ssl model to the same clicks, and activate that.", reason="loss-unlimited")
    if worst > plan.limit_mm and plan.approved.get(name) != one.calibration.id:
        return Conflict(f"The league's lens puts {name} {worst:.1f} mm off at worst; the limit is "
                        f"{plan.limit_mm:g} mm.", "Fit the ssl model to the same clicks and activate that, or approve "
                        "this loss.", reason="loss-above-limit")
    return None
