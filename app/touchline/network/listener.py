"""A thread that listens to a multicast group to which anybody may send.

Everything is bounded: how many senders are remembered, how much time their packets may take, how long a packet is. What
is no whole packet is counted and ignored.
"""

import logging
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar, Generic, TypeVar

from touchline.core.errors import BadInput, TouchlineError, Unavailable
from touchline.core.sentences import TRIES_AGAIN
from touchline.core.statements import say
from touchline.network.address import MulticastAddress
from touchline.network.multicast import Datagram, MulticastReceiver

log = logging.getLogger("touchline")
RETRY_S = 1.0  # after a failure
JOIN_S = 5.0
MAX_SENDERS = 32
RECEIVE_S = 0.25
# of silence: an interface that came back, or a switch that lost us, needs a new join
REJOIN_S = 5.0
# of one core's time for decoding: all senders together, and one
CPU_SHARE, CPU_SHARE_PER_SENDER = 0.2, 0.05
PAUSE_S = 0.002  # between packets that are skipped: a flood must not occupy the process
FORGET_S = 600.0


@dataclass(frozen=True)
class RemoteSender:
    """One sender, and how many of its packets were read, refused and skipped. last_s: time.monotonic()."""

    address: str
    port: int
    last_s: float
    packets: int = 0
    refused: int = 0
    refusal: str = ""  # why the last of the refused was
    skipped: int = 0

    @property
    def id(self) -> str:
        return f"{self.address}-{self.port}"


Sender = TypeVar("Sender", bound=RemoteSender)


class _Budget:
    """A token bucket of CPU time: a share of each second, at most one second's in advance."""

    def __init__(self, share: float) -> None:
        self._share, self._left, self._at = share, share, time.monotonic()

    def has(self) -> bool:
        now = time.monotonic()
        self._left = min(self._share, self._left + (now - self._at) * self._share)
        self._at = now
        return self._left > 0

    def spend(self, seconds: float) -> None:
        self._left -= seconds


class MulticastListener(ABC, Generic[Sender]):
    """Listens until it is closed. own: recognises our own packets by address and port."""

    NAME: ClassVar[str]  # of the thread

    def __init__(
        self,
        address: MulticastAddress,
        own: Callable[[str, int], bool] = lambda address, port: False,
    ) -> None:
        self.address = address
        self.problem: TouchlineError | None = None
        self.since_s = time.monotonic()
        self.datagrams = self.own = 0
        self._is_own = own
        self._senders: dict[tuple[str, int], Sender] = {}
        self._budgets: dict[tuple[str, int], _Budget] = {}
        self._budget = _Budget(CPU_SHARE)
        self._lock = threading.Lock()
        self._ended = threading.Event()
        self.joined = threading.Event()
        self._thread = threading.Thread(target=self._run, name=self.NAME, daemon=True)
        self._thread.start()

    @abstractmethod
    def first(self, address: str, port: int, now_s: float) -> Sender:
        """Return a sender of which nothing has been read yet."""

    @abstractmethod
    def accept(self, sender: Sender, data: bytes) -> Sender:
        """Return the sender after a packet; BadInput where it is none."""

    @abstractmethod
    def is_useful(self, sender: Sender) -> bool:
        """Tell whether it has sent what is listened for: others are forgotten first."""

    def after_each(self) -> None:
        """Do what is due several times a second: what follows from a packet costs no more than that in a flood."""

    @property
    def senders(self) -> tuple[Sender, ...]:
        """Everybody who sent lately, with each one's newest packet; a new one once its first packet was read."""
        with self._lock:
            return tuple(sender for sender in self._senders.values() if sender.packets)

    def get(self, id: str) -> Sender | None:
        return next((sender for sender in self.senders if sender.id == id), None)

    def close(self) -> None:
        self._ended.set()
        if threading.current_thread() is not self._thread:
            self._thread.join(JOIN_S)

    def _run(self) -> None:
        while not self._ended.is_set():
            try:
                self._listen()
            except TouchlineError as refused:
                self.problem = refused
            except OSError as error:
                self.problem = self.address.network_error(error)
            except Exception:
                log.exception("the group could not be listened to")
                self.problem = Unavailable(
                    say("receiving.failed", "The multicast group cannot be received."),
                    TRIES_AGAIN,
                    reason="absorbing-failed",
                )
            self._ended.wait(RETRY_S)

    def _listen(self) -> None:
        receiver = MulticastReceiver(self.address)
        try:
            self.problem = None
            self.joined.set()
            last_s = done_s = time.monotonic()
            while not self._ended.is_set():
                datagram = receiver.receive(RECEIVE_S)
                now = time.monotonic()
                if datagram is not None:
                    self._receive(datagram)
                    last_s = now
                elif now - last_s > REJOIN_S:
                    # before the old one goes, so that nothing is missed
                    fresh = MulticastReceiver(self.address)
                    receiver.close()
                    receiver, last_s = fresh, now
                if now - done_s >= RECEIVE_S:
                    self.after_each()
                    done_s = now
        finally:
            receiver.close()

    def _receive(self, datagram: Datagram) -> None:
        self.datagrams += 1
        if self._is_own(datagram.address, datagram.port):
            self.own += 1
            return
        key, now = (datagram.address, datagram.port), time.monotonic()
        before = self._senders.get(key) or self._add(key, now)
        before = replace(before, packets=before.packets + 1, last_s=now)
        budget = self._budgets[key]
        if budget.has() and self._budget.has():
            begun = time.thread_time()  # CPU time, so that a busy machine ignores nobody
            after = self._read(before, datagram.data)
            spent = time.thread_time() - begun
            budget.spend(spent)
            self._budget.spend(spent)
        else:
            after = replace(before, skipped=before.skipped + 1)
            self._ended.wait(PAUSE_S)
        with self._lock:
            self._senders[key] = after

    def _read(self, sender: Sender, data: bytes) -> Sender:
        try:
            if not data:
                raise BadInput(
                    say("packet.empty", "The packet is empty."),
                    say("packet.send", "Send a packet."),
                    reason="bad-protobuf",
                )
            return self.accept(sender, data)
        except BadInput as refused:
            return replace(sender, refused=sender.refused + 1, refusal=refused.what)

    def _add(self, key: tuple[str, int], now: float) -> Sender:
        """Add a sender; evict the silent, else those of no use, else who was silent longest."""
        with self._lock:
            for other, sender in list(self._senders.items()):
                if now - sender.last_s > FORGET_S:
                    self._forget(other)
            while len(self._senders) >= MAX_SENDERS:
                self._forget(min(self._senders, key=self._worth))
            self._senders[key] = self.first(*key, now)
            self._budgets[key] = _Budget(CPU_SHARE_PER_SENDER)
            return self._senders[key]

    def _worth(self, key: tuple[str, int]) -> tuple[bool, float]:
        """Order senders by what it costs to forget them, the least first."""
        sender = self._senders[key]
        return self.is_useful(sender), sender.last_s

    def _forget(self, key: tuple[str, int]) -> None:
        del self._senders[key], self._budgets[key]
