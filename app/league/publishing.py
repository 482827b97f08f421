"""Publishing and listening together, as one plan says; the plan may change at any time."""

import threading
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from app.core.errors import Conflict, NotFound, TouchlineError
from app.core.field import Field
from app.core.records import Calibration, Warning
from app.league.config import Plan
from app.league.geometry_listener import Absorber, Heard
from app.league.geometry_packet import Spoken, Wiring, spoken
from app.league.multicast_address import interfaces
from app.league.multicast_sender import Group
from app.league.publisher import Publisher
from app.league.received import contradictions, heard_json


class Publishing:
    """What a server says to its network and hears there. Begins with start(), follows the plan until close().

    active: every camera's calibration as it stands now; it may block.
    """

    def __init__(self, plan: Plan, active: Callable[[], Sequence[Calibration]]) -> None:
        self.plan = plan
        self._active = active
        self._wiring = Wiring()
        self._lock = threading.Lock()
        self._publisher: Publisher | None = None
        self._absorber: Absorber | None = None
        self._running = False

    def start(self) -> None:
        with self._lock:
            self._running = True
            self._follow(self.plan)

    def close(self) -> None:
        with self._lock:
            self._running = False
            self._follow(Plan())

    def check(self, plan: Plan) -> None:
        """NetworkTrouble where what the plan switches on cannot be done on this network now."""
        fresh = plan.route != self.plan.route
        if (plan.enabled and (fresh or not self.plan.enabled)) or (plan.absorb and (fresh or not self.plan.absorb)):
            Group(plan.route).check()

    def follow(self, plan: Plan) -> None:
        """From now on this plan."""
        with self._lock:
            self.plan = plan
            if self._running:
                self._follow(plan)

    def wake(self) -> None:
        """A calibration was activated, or a camera changed: say it at once."""
        if (publisher := self._publisher) is not None:
            publisher.wake()

    @property
    def group(self) -> Group | None:
        """The way to the group while publishing is on: what else is published is sent by it."""
        publisher = self._publisher
        return None if publisher is None else publisher.group

    def cameras(self) -> tuple[Spoken, ...]:
        """As they are sent, or would be: worked out now."""
        return spoken(self._active(), self.plan, self._wiring)

    def status(self) -> dict[str, Any]:
        """All of it as plain JSON; takes as long as the lenses of new calibrations take."""
        publisher, told = self._publisher, self.cameras()
        said = None if publisher is None else publisher.said
        problem = None if said is None else said.problem
        state = ("off" if said is None else "failing" if problem is not None else
                 "silent" if not any(one.sent for one in told) else "on-air" if said.packets else "starting")
        return {**self.plan.to_json(), "state": state, "problem": _json(problem),
                "said": None if said is None else said.to_json(),
                "cameras": [one.to_json() for one in told], "interfaces": interfaces()}

    def heard(self, known: Iterable[Field]) -> dict[str, Any]:
        """Who else is there, as plain JSON. known: the fields of this house."""
        absorber, publisher = self._absorber, self._publisher
        if absorber is None:
            return {"listening": False, "problem": None, "datagrams": 0, "own": 0, "items": []}
        known = tuple(known)
        ours = () if publisher is None else publisher.said.cameras
        items = sorted((heard_json(sender, known, ours) for sender in absorber.heard), key=lambda one: one["id"])
        return {"listening": absorber.problem is None, "problem": _json(absorber.problem),
                "datagrams": absorber.datagrams, "own": absorber.own, "items": items}

    def sender(self, id: str) -> Heard:
        """One that has sent geometry; NotFound, or Conflict."""
        found = None if self._absorber is None else self._absorber.get(id)
        if found is None:
            raise NotFound(f"Nobody was heard from {id}.", "See GET /api/v1/publishing/heard, with absorb switched on.",
                           reason="unknown-sender")
        if found.geometry is None:
            raise Conflict(f"{id} has sent no geometry yet.", "Wait until it does; the league's software sends it "
                           "every few seconds.", reason="no-geometry")
        return found

    @property
    def warnings(self) -> tuple[Warning, ...]:
        """What an operator should know wherever he looks: that nothing goes out, or that two say different things."""
        publisher, absorber = self._publisher, self._absorber
        told = []
        if publisher is not None and (problem := publisher.said.problem) is not None:
            told.append(Warning("publishing", f"Geometry is not published: {problem.what}", problem.fix))
        if absorber is not None and (problem := absorber.problem) is not None:
            told.append(Warning("absorbing", f"The network is not listened to: {problem.what}", problem.fix))
        if publisher is not None and absorber is not None:
            for sender, one in contradictions(absorber.heard, publisher.said.cameras):
                told.append(Warning("two-publishers", f"{sender.address} also publishes camera {one.number}, which is "
                                    f"{one.name}, with another calibration.", "Two publishers confuse every team: "
                                    "switch one of them off, or take theirs over."))
        return tuple(told)

    def _follow(self, plan: Plan) -> None:
        old, listener = self._publisher, self._absorber
        if old is not None and (not plan.enabled or old.plan != plan):
            self._publisher = None
            old.close()
        if plan.enabled and self._publisher is None:
            self._publisher = Publisher(plan, self._active, self._wiring)
        if listener is not None and (not plan.absorb or listener.route != plan.route):
            self._absorber = None
            listener.close()
        if plan.absorb and self._absorber is None:
            self._absorber = Absorber(plan.route, self._is_own)

    def _is_own(self, address: str, port: int) -> bool:
        group = self.group
        return group is not None and group.sent(address, port)


def _json(problem: TouchlineError | None) -> dict[str, str] | None:
    return None if problem is None else {"reason": problem.reason, "what": problem.what, "fix": problem.fix}
