"""An MPEG transport stream (ISO/IEC 13818-1) with H.264 in it, as FFmpeg sends it over UDP: its pictures.

Packets of 188 bytes; each stream counts its own to 15, by which a loss is noticed. Tables say which stream is video.
"""

from collections.abc import Iterator

from touchline.sources.network.rtp import MAX_UNIT, AccessUnit

PACKET = 188
SYNC = 0x47
H264 = 0x1B


def is_transport_stream(data: bytes) -> bool:
    return len(data) >= PACKET and len(data) % PACKET == 0 and set(data[::PACKET]) == {SYNC}


class TransportStream:
    """push() takes a datagram, and yields each picture once the next one begins."""

    def __init__(self) -> None:
        self._tables: int | None = None  # the number (PID) of the packets with the program's table
        self._video: int | None = None  # and with its video
        self._count: int | None = None
        self._unit: bytearray | None = None  # None before the first beginning
        self._whole = True

    def push(self, data: bytes, lost: bool = False) -> Iterator[AccessUnit]:
        self._whole &= not lost
        for at in range(0, len(data) - PACKET + 1, PACKET):
            packet = data[at : at + PACKET]
            pid = int.from_bytes(packet[1:3], "big") & 0x1FFF
            start = 5 + packet[4] if packet[3] & 0x20 else 4
            if packet[0] != SYNC or not packet[3] & 0x10 or start >= PACKET:
                continue  # no payload
            begins, payload = bool(packet[1] & 0x40), packet[start:]
            if pid == 0 and begins:
                self._read_programs(payload)
            elif pid == self._tables and begins:
                self._read_streams(payload)
            elif pid == self._video:
                yield from self._add(payload, begins, packet[3] & 15)

    def _add(self, payload: bytes, begins: bool, count: int) -> Iterator[AccessUnit]:
        if self._count is not None and count == self._count:
            return  # a packet may be sent twice
        if self._count is not None and count != (self._count + 1) & 15:
            self._whole = False
        self._count = count
        if begins:
            # a loss right before a beginning is counted as the former picture's
            if self._unit is not None:
                yield AccessUnit(bytes(self._unit), self._whole)
            self._unit, self._whole = bytearray(), True
            payload = payload[9 + payload[8] :] if len(payload) > 8 else b""
        if self._unit is not None:
            self._unit += payload
            if len(self._unit) > MAX_UNIT:
                self._unit = None
                yield AccessUnit(b"", whole=False)

    def _read_programs(self, payload: bytes) -> None:
        table = _section(payload)
        for at in range(8, len(table) - 3, 4):
            if (
                table[at : at + 2] != b"\0\0"
            ):  # 0: not a program, but where the network is described
                self._tables = int.from_bytes(table[at + 2 : at + 4], "big") & 0x1FFF
                return

    def _read_streams(self, payload: bytes) -> None:
        table = _section(payload)
        at = 12 + (int.from_bytes(table[10:12], "big") & 0xFFF)
        while at + 5 <= len(table):
            if table[at] == H264:
                self._video = int.from_bytes(table[at + 1 : at + 3], "big") & 0x1FFF
                return
            at += 5 + (int.from_bytes(table[at + 3 : at + 5], "big") & 0xFFF)


def _section(payload: bytes) -> bytes:
    """Return a table without its checksum."""
    start = 1 + payload[0]
    length = int.from_bytes(payload[start + 1 : start + 3], "big") & 0xFFF
    return payload[start : start + 3 + length - 4]
