"""Publish the cameras' geometry: every few seconds, and at once after a change; failures are retried."""

import logging
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from touchline.core.common_sentences import TRIES_AGAIN
from touchline.core.errors import TouchlineError, Unavailable
from touchline.core.field import Field
from touchline.core.records import Calibration
from touchline.core.statements import say
from touchline.league.config import PublishingConfig
from touchline.league.geometry_packet import (
    NO_FIELDS,
    FitPacketCamera,
    PublishedCamera,
    geometry_packet,
    published_cameras,
)
from touchline.league.multicast import MulticastSender
from touchline.league.passed_on import PassedOn

log = logging.getLogger("touchline")
RETRY_S = 1.0  # after a failure, or sooner where the interval is shorter
JOIN_S = 5.0


@dataclass(frozen=True)
class PublishStatus:
    """What was sent so far. packet: the newest; last_s: its time.monotonic(); failures: since then."""

    packets: int = 0
    packet: bytes = b""
    last_s: float | None = None
    failures: int = 0
    problem: TouchlineError | None = None
    cameras: tuple[PublishedCamera, ...] = ()

    def to_json(self) -> dict[str, Any]:
        age_s = None if self.last_s is None else round(time.monotonic() - self.last_s, 3)
        return {"packets": self.packets, "bytes": len(self.packet), "age_s": age_s, "failures": self.failures}


class Publisher:
    """A thread that publishes until it is closed.

    active: returns the active calibrations. fit: fits a calibration's packet camera. fields: as they are now, by name.
    passed_on: returns what another publisher's geometry adds. sender: open to other packets as well.
    """

    def __init__(self, config: PublishingConfig, active: Callable[[], Sequence[Calibration]],
                 fit: FitPacketCamera, fields: Mapping[str, Field] = NO_FIELDS,
                 passed_on: Callable[[], PassedOn | None] = lambda: None,
                 sender: MulticastSender | None = None) -> None:
        self.config = config
        self.sender = sender or MulticastSender(config.address)
        self.status = PublishStatus()
        self._active, self._fit, self._fields, self._passed_on = active, fit, fields, passed_on
        self._wakened = threading.Event()
        self._ended = False
        self._thread = threading.Thread(target=self._run, name="publisher", daemon=True)
        self._thread.start()

    def wake(self) -> None:
        """Publish now: something has changed."""
        self._wakened.set()

    def close(self) -> None:
        """End the thread; no packet leaves afterwards."""
        self._ended = True
        self._wakened.set()
        self._thread.join(JOIN_S)
        self.sender.close()

    def _run(self) -> None:
        while not self._ended:
            self._wakened.clear()  # before looking: what changes meanwhile is sent in the next round
            self.status = self._publish()
            self._wakened.wait(self.config.interval_s if self.status.problem is None else
                               min(RETRY_S, self.config.interval_s))

    def _publish(self) -> PublishStatus:
        before, cameras = self.status, self.status.cameras
        try:
            cameras = published_cameras(self._active(), self.config, self._fit, self._fields)
            packet = geometry_packet(cameras, self._fields, self._passed_on())
            if self._ended or packet is None:
                return PublishStatus(before.packets, b"", before.last_s, 0, None, cameras)
            self.sender.send(packet)
            return PublishStatus(before.packets + 1, packet, time.monotonic(), 0, None, cameras)
        except TouchlineError as error:
            problem = error
        except Exception:
            log.exception("geometry could not be published")
            problem = Unavailable(say("publishing.failed", "The geometry cannot be published."), TRIES_AGAIN,
                                  reason="publishing-failed")
        return PublishStatus(before.packets, before.packet, before.last_s, before.failures + 1, problem, cameras)
