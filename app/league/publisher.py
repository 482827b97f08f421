"""Says where the cameras hang: every few seconds, and at once when something changed; what fails is tried again."""

import logging
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from app.core.errors import TouchlineError, Unavailable
from app.core.records import Calibration
from app.league.config import Plan
from app.league.geometry_packet import Spoken, Wired, packet_of, spoken
from app.league.multicast_sender import Group

log = logging.getLogger("touchline")
RETRY_S = 1.0  # after a failure, or sooner where the interval is shorter
JOIN_S = 5.0


@dataclass(frozen=True)
class Said:
    """What was done so far. last_s: time.monotonic() of the newest packet; failures: since the last one."""

    packets: int = 0
    bytes: int = 0
    last_s: float | None = None
    failures: int = 0
    problem: TouchlineError | None = None
    cameras: tuple[Spoken, ...] = ()

    def to_json(self) -> dict[str, Any]:
        age_s = None if self.last_s is None else round(time.monotonic() - self.last_s, 3)
        return {"packets": self.packets, "bytes": self.bytes, "age_s": age_s, "failures": self.failures}


class Publisher:
    """A thread that publishes until it is closed.

    active: the calibrations that stand now. wire: each as a message. group: what else is sent there shares its socket.
    """

    def __init__(self, plan: Plan, active: Callable[[], Sequence[Calibration]],
                 wire: Callable[[Calibration], Wired | TouchlineError]) -> None:
        self.plan = plan
        self.group = Group(plan.route)
        self.said = Said()
        self._active, self._wire = active, wire
        self._wanted = threading.Event()
        self._ended = False
        self._thread = threading.Thread(target=self._run, name="publisher", daemon=True)
        self._thread.start()

    def wake(self) -> None:
        """Something changed: say it now."""
        self._wanted.set()

    def close(self) -> None:
        """No packet leaves after this."""
        self._ended = True
        self._wanted.set()
        self._thread.join(JOIN_S)
        self.group.close()

    def _run(self) -> None:
        while not self._ended:
            self._wanted.clear()  # before looking: what changes while we look is said in the next round
            self.said = self._next()
            self._wanted.wait(self.plan.interval_s if self.said.problem is None else
                              min(RETRY_S, self.plan.interval_s))

    def _next(self) -> Said:
        before, told = self.said, self.said.cameras
        try:
            told = spoken(self._active(), self.plan, self._wire)
            packet = packet_of(told)
            if self._ended or packet is None:
                return Said(before.packets, 0, before.last_s, 0, None, told)
            self.group.send(packet)
            return Said(before.packets + 1, len(packet), time.monotonic(), 0, None, told)
        except TouchlineError as refused:
            problem = refused
        except Exception:
            log.exception("geometry could not be published")
            problem = Unavailable("Geometry could not be published.", "It is tried again; the server's log says why.",
                                  reason="publishing-failed")
        return Said(before.packets, before.bytes, before.last_s, before.failures + 1, problem, told)
