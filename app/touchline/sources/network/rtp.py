"""RTP packets (RFC 3550) with H.264 in them (RFC 6184): parsed, put in order, joined to the pictures they carry.

A picture (an access unit) is given in Annex B, each NAL unit behind a start code. What a network loses is counted, and
a picture that misses a part is given as not whole: decoded, it would smear all that follow up to the next key frame.
Nothing here trusts a packet: lengths are checked, and what waits is bounded.
"""

from collections.abc import Iterator
from typing import NamedTuple

MAX_UNIT = 8_000_000  # bytes of a picture; the key frame of a 50 megapixel camera has fewer
START = b"\0\0\0\1"
MPEG_TS = 33  # the payload type of a transport stream (RFC 3551); those of H.264 are 96 and above
WINDOW = 16  # packets that may overtake one that is late
LATE_TICKS = 9000  # of 90 kHz: a packet that is 0.1 s late is lost
MAX_JUMP = 2000  # of sequence numbers; beyond it the sender has started anew
STAP_A, FU_A = 24, 28
SEI, SPS, PPS, DELIMITER = 6, 7, 8, 9


class RtpPacket(NamedTuple):
    kind: int  # the payload type
    sequence: int
    timestamp: int
    ssrc: int
    marker: bool
    payload: bytes

    @property
    def first_nal(self) -> int:
        """The type of the NAL unit that it begins with; 0 where none begins."""
        first = self.payload[0] & 31
        inner = self.payload[3:4] if first == STAP_A else self.payload[1:2]
        if not inner or self.payload[0] & 0x80:
            return 0
        if first == FU_A:
            return inner[0] & 31 if inner[0] & 0x80 else 0
        return inner[0] & 31 if first == STAP_A else first

    @property
    def carries_video(self) -> bool:
        """Whether it may be H.264, or is a transport stream."""
        first = self.payload[0]
        return self.kind == MPEG_TS or (
            self.kind >= 96
            and not first & 0x80
            and (0 < first & 31 <= STAP_A or first & 31 == FU_A)
        )


class AccessUnit(NamedTuple):
    """One coded picture. whole: no part of it was lost. follows: nothing was lost right before it."""

    data: bytes
    whole: bool = True
    follows: bool = True


def read_rtp(data: bytes) -> RtpPacket | None:
    """Parse a datagram; None for what is no RTP: too short, of another version, or RTCP on the same port (RFC 5761)."""
    if len(data) < 13 or data[0] >> 6 != 2 or 192 <= data[1] <= 223:
        return None
    start = 12 + 4 * (data[0] & 15)
    if data[0] & 16:
        start += 4 + 4 * int.from_bytes(data[start + 2 : start + 4], "big")
    end = len(data) - (data[-1] if data[0] & 32 else 0)
    if start >= end:
        return None
    return RtpPacket(
        data[1] & 127,
        int.from_bytes(data[2:4], "big"),
        int.from_bytes(data[4:8], "big"),
        int.from_bytes(data[8:12], "big"),
        data[1] > 127,
        data[start:end],
    )


class ReorderBuffer:
    """One sender's packets in the order of their numbers. received, lost: so many of them so far."""

    def __init__(self) -> None:
        self.received = self.lost = 0
        self._next = -1  # -1: none yet
        self._late = 0  # one after the other
        self._waiting: dict[int, RtpPacket] = {}

    def push(self, packet: RtpPacket) -> Iterator[tuple[RtpPacket, bool]]:
        """Yield what can be passed on now, and of each packet whether others were lost right before it."""
        self.received += 1
        ahead = 0 if self._next < 0 else (packet.sequence - self._next) & 0xFFFF
        self._late = self._late + 1 if ahead >= 0x8000 else 0
        if 0 < self._late < WINDOW:
            return
        anew = self._next < 0 or self._late > 0 or ahead > MAX_JUMP
        if anew:
            self._waiting, self._next, self._late = {}, packet.sequence, 0
        self._waiting[packet.sequence] = packet
        while self._waiting:
            missing = min((number - self._next) & 0xFFFF for number in self._waiting)
            if missing and not self._is_overdue(packet):
                return
            self.lost += missing
            found = self._waiting.pop((self._next + missing) & 0xFFFF)
            self._next = (found.sequence + 1) & 0xFFFF
            yield found, missing > 0 or anew
            anew = False

    def _is_overdue(self, newest: RtpPacket) -> bool:
        """Whether what is missing will not come any more, after so many others."""
        return len(self._waiting) >= WINDOW or any(
            LATE_TICKS < (newest.timestamp - other.timestamp) & 0xFFFFFFFF < 1 << 31
            for other in self._waiting.values()
        )


class H264Depacketiser:
    """push() takes packets in order, and yields each picture once it has ended."""

    def __init__(self) -> None:
        self._timestamp: int | None = None  # of the picture that has begun
        self._unit, self._whole, self._follows = bytearray(), True, True
        self._sliced = (
            False  # whether a part of the picture itself has come, not only what describes it
        )
        self._in_fragment = False

    def push(self, packet: RtpPacket, lost: bool) -> Iterator[AccessUnit]:
        if self._timestamp is not None and packet.timestamp != self._timestamp:
            # without its marked last packet: lost, or a sender that marks none
            yield self._end(whole=not lost)
        if self._timestamp is None:
            self._timestamp, self._follows, self._sliced = packet.timestamp, not lost, False
        if lost and (self._sliced or not _begins_picture(packet)):
            self._whole = False
        self._sliced |= packet.first_nal in (1, 5)
        if lost:
            self._in_fragment = False
        if not self._add(packet.payload) or len(self._unit) > MAX_UNIT:
            self._whole = False
            self._unit.clear()
        if packet.marker:
            yield self._end()

    def _end(self, whole: bool = True) -> AccessUnit:
        whole = whole and self._whole and not self._in_fragment
        unit = AccessUnit(bytes(self._unit), whole, self._follows)
        self._timestamp, self._whole, self._in_fragment = None, True, False
        self._unit.clear()
        return unit

    def _add(self, payload: bytes) -> bool:
        """Add the payload's NAL units, or its part of one; False where it is damaged."""
        kind = payload[0] & 31
        if kind == FU_A:
            return self._add_fragment(payload)
        if self._in_fragment:
            return False
        if kind == STAP_A:
            at = 1
            while at + 2 < len(payload):
                end = at + 2 + int.from_bytes(payload[at : at + 2], "big")
                if end > len(payload) or end == at + 2:
                    return False
                self._unit += START + payload[at + 2 : end]
                at = end
            return at == len(payload)
        self._unit += START + payload
        return 0 < kind < STAP_A

    def _add_fragment(self, payload: bytes) -> bool:
        begins, ends = (
            (bool(payload[1] & bit) for bit in (0x80, 0x40)) if len(payload) > 2 else (True,) * 2
        )
        if begins == self._in_fragment or (begins and ends):
            return False
        if begins:
            self._unit += START + bytes([payload[0] & 0xE0 | payload[1] & 31])
        self._unit += payload[2:]
        self._in_fragment = not ends
        return True


def _begins_picture(packet: RtpPacket) -> bool:
    """Whether no part of its picture can have come before it: what describes it, or a slice at macroblock 0.

    Parameters that are lost are known already, or decoding fails.
    """
    first = packet.first_nal
    if first in (SEI, SPS, PPS, DELIMITER):
        return True
    header = 2 if packet.payload[0] & 31 == FU_A else 1
    return (
        first in (1, 5)
        and bool(packet.payload[header : header + 1])
        and packet.payload[header] > 127
    )
