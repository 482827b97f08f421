"""Who else publishes geometry in the group: the newest whole packet of each sender, whatever strangers send.

Anybody may send here, so everything is bounded: how many senders are remembered, how much time their packets may take,
how long a packet is. What is no whole packet is counted and left.
"""

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from app.core.errors import BadInput, TouchlineError, Unavailable
from app.league.multicast_address import Route
from app.league.multicast_receiver import Datagram, Ear
from app.ssl_protocol.messages import Geometry
from app.ssl_protocol.protobuf import decode, optional

log = logging.getLogger("touchline")
MAX_SENDERS = 32
MAX_CAMERAS = 64  # of one sender; the league has at most eight
HEAR_S = 0.25
REJOIN_S = 5.0  # of silence: an interface that came back, or a switch that forgot us, wants the group joined anew
RETRY_S = 1.0
SHARE, OF_ONE = 0.2, 0.05  # of a core's time for reading packets: all of them, and one sender's
PAUSE_S = 0.002  # between packets that are left unread: a flood shall not have the whole process
FORGET_S = 600.0
JOIN_S = 5.0


@dataclass(frozen=True)
class _Packet:
    """The part of an SSL_WrapperPacket that matters here: detections are passed over unread."""

    geometry: Geometry | None = optional(2, Geometry)  # noqa: RUF009 — only describes a field
    source: int | None = optional(3, "enum")


@dataclass(frozen=True)
class Heard:
    """One sender. data: the newest whole packet with geometry, as it came; times are time.monotonic()."""

    address: str
    port: int
    last_s: float
    packets: int = 0
    geometries: int = 0
    refused: int = 0
    why: str = ""  # the newest refusal
    skipped: int = 0
    source: int = 0
    geometry: Geometry | None = None
    data: bytes = b""
    geometry_s: float = 0.0
    geometry_at: float = 0.0  # unix s, for people

    @property
    def id(self) -> str:
        return f"{self.address}-{self.port}"


class _Budget:
    """So many seconds of work in a second, at most one second's ahead."""

    def __init__(self, share: float) -> None:
        self._share, self._left, self._at = share, share, time.monotonic()

    def has(self) -> bool:
        now = time.monotonic()
        self._left = min(self._share, self._left + (now - self._at) * self._share)
        self._at = now
        return self._left > 0

    def spend(self, seconds: float) -> None:
        self._left -= seconds


class Absorber:
    """A thread that listens until it is closed. own: whether a packet from that address and port is our own."""

    def __init__(self, route: Route, own: Callable[[str, int], bool] = lambda address, port: False) -> None:
        self.route = route
        self.problem: TouchlineError | None = None
        self.datagrams = self.own = 0
        self._is_own = own
        self._heard: dict[tuple[str, int], Heard] = {}
        self._budgets: dict[tuple[str, int], _Budget] = {}
        self._budget = _Budget(SHARE)
        self._lock = threading.Lock()
        self._ended = threading.Event()
        self.joined = threading.Event()
        self._thread = threading.Thread(target=self._run, name="absorber", daemon=True)
        self._thread.start()

    @property
    def heard(self) -> tuple[Heard, ...]:
        """Everybody who was heard of late, the newest word of each."""
        with self._lock:
            return tuple(self._heard.values())

    def get(self, id: str) -> Heard | None:
        return next((sender for sender in self.heard if sender.id == id), None)

    def close(self) -> None:
        self._ended.set()
        self._thread.join(JOIN_S)

    def _run(self) -> None:
        while not self._ended.is_set():
            try:
                self._listen()
            except TouchlineError as refused:
                self.problem = refused
            except OSError as error:
                self.problem = self.route.trouble(error)
            except Exception:
                log.exception("the group could not be listened to")
                self.problem = Unavailable("The group could not be listened to.",
                                           "It is tried again; the server's log says why.", reason="absorbing-failed")
            self._ended.wait(RETRY_S)

    def _listen(self) -> None:
        ear = Ear(self.route)
        try:
            self.problem = None
            self.joined.set()
            at = time.monotonic()
            while not self._ended.is_set():
                datagram = ear.hear(HEAR_S)
                now = time.monotonic()
                if datagram is not None:
                    self._take(datagram)
                    at = now
                elif now - at > REJOIN_S:
                    fresh = Ear(self.route)  # before the old one goes, so that nothing is missed
                    ear.close()
                    ear, at = fresh, now
        finally:
            ear.close()

    def _take(self, datagram: Datagram) -> None:
        self.datagrams += 1
        if self._is_own(datagram.address, datagram.port):
            self.own += 1
            return
        key, now = (datagram.address, datagram.port), time.monotonic()
        before = self._heard.get(key) or self._newcomer(key, now)
        before = replace(before, packets=before.packets + 1, last_s=now)
        budget = self._budgets[key]
        if budget.has() and self._budget.has():
            begun = time.thread_time()  # the processor's, so that a busy machine makes nobody unheard
            after = self._read(before, datagram.data)
            spent = time.thread_time() - begun
            budget.spend(spent)
            self._budget.spend(spent)
        else:
            after = replace(before, skipped=before.skipped + 1)
            self._ended.wait(PAUSE_S)
        with self._lock:
            self._heard[key] = after

    def _read(self, sender: Heard, data: bytes) -> Heard:
        try:
            if not data:
                raise BadInput("The packet is empty.", "Send a packet.", reason="bad-protobuf")
            packet = decode(_Packet, data)
            if packet.geometry is None:
                return replace(sender, source=sender.source if packet.source is None else packet.source)
            if len(packet.geometry.calib) > MAX_CAMERAS:
                raise BadInput(f"The packet has {len(packet.geometry.calib)} cameras.", "Send fewer.",
                               reason="bad-protobuf")
        except BadInput as refused:
            return replace(sender, refused=sender.refused + 1, why=refused.what)
        return replace(sender, geometries=sender.geometries + 1, geometry=packet.geometry, data=data,
                       source=packet.source or 0, geometry_s=time.monotonic(), geometry_at=time.time())

    def _newcomer(self, key: tuple[str, int], now: float) -> Heard:
        """Room for one more: the silent are forgotten, else those without geometry, else who was silent longest."""
        with self._lock:
            for other, sender in list(self._heard.items()):
                if now - sender.last_s > FORGET_S:
                    self._forget(other)
            while len(self._heard) >= MAX_SENDERS:
                self._forget(min(self._heard, key=lambda k: (self._heard[k].geometry is not None,
                                                             self._heard[k].last_s)))
            self._heard[key] = Heard(*key, now)
            self._budgets[key] = _Budget(OF_ONE)
            return self._heard[key]

    def _forget(self, key: tuple[str, int]) -> None:
        del self._heard[key], self._budgets[key]
