"""Read the picture size out of RTP packets before any decoder sees them: JPEG, H.264 and H.265.

FFmpeg under OpenCV keeps the first size for good and bends whatever comes later to it; here the change is seen first.
RFC 3550 (RTP), 2435 (JPEG), 6184 (H.264), 7798 (H.265); ITU-T H.264 7.3.2.1, H.265 7.3.2.2.
"""

from collections.abc import Callable, Iterator

Size = tuple[int, int]  # width, height in px as coded, before any cropping window


class SizeMonitor:
    """Watches every packet of one stream. size: the newest, or None; sizes: the reader of the codec's, or None."""

    def __init__(self, codec: str) -> None:
        self.sizes = {"JPEG": jpeg_sizes, "H264": h264_sizes, "H265": h265_sizes}.get(codec.upper())
        self._known: dict[int, Size] = {}
        self._pictures = 0
        self.size: Size | None = None

    def changed(self, packet: bytes) -> bool:
        """Whether this packet begins pictures of another size than those before it."""
        payload = _payload(packet)
        if self.sizes is None or not payload:
            return False
        other = False
        for number, size in self.sizes(payload):
            # A stream may carry the parameter sets of two sizes from its start and use only one: no change.
            first_seen_late = number not in self._known and self._pictures > 0 and size not in self._known.values()
            other |= self._known.get(number, size) != size or first_seen_late
            self._known[number] = self.size = size
        self._pictures += packet[1] >> 7  # the marker bit: the last packet of a picture
        return other


def jpeg_sizes(payload: bytes) -> Iterator[tuple[int, Size]]:
    """The size that every JPEG packet repeats in eights of px; 0 where it is too large for that."""
    if len(payload) >= 8:
        yield 0, (payload[6] * 8, payload[7] * 8)


def h264_sizes(payload: bytes) -> Iterator[tuple[int, Size]]:
    """Number and size of every sequence parameter set in a packet, alone or among others (STAP-A)."""
    for unit in _units(payload, 24, payload[0] & 31, 1):
        if unit and unit[0] & 31 == 7 and (found := _read(h264_sps, unit)):
            yield found


def h265_sizes(payload: bytes) -> Iterator[tuple[int, Size]]:
    """The same of H.265, alone or in an aggregation packet."""
    for unit in _units(payload, 48, payload[0] >> 1 & 63, 2):
        if len(unit) > 2 and unit[0] >> 1 & 63 == 33 and (found := _read(h265_sps, unit)):
            yield found


def h264_sps(bits: "_Bits") -> tuple[int, Size]:
    """Number and size out of an H.264 sequence parameter set."""
    bits.take(8)
    profile = bits.take(8)
    bits.take(16)
    number = bits.exp_golomb()
    chroma = 1
    if profile in (100, 110, 122, 244, 44, 83, 86, 118, 128, 138, 139, 134, 135):
        chroma = bits.exp_golomb()
        if chroma == 3:
            bits.take(1)
        bits.exp_golomb(), bits.exp_golomb()  # bit depths
        bits.take(1)
        if bits.take(1):
            for i in range(8 if chroma != 3 else 12):
                if bits.take(1):
                    _skip_scaling_list(bits, 16 if i < 6 else 64)
    bits.exp_golomb()
    order = bits.exp_golomb()
    if order == 0:
        bits.exp_golomb()
    elif order == 1:
        bits.take(1)
        bits.exp_golomb(), bits.exp_golomb()
        for _ in range(min(bits.exp_golomb(), 255)):
            bits.exp_golomb()
    bits.exp_golomb()
    bits.take(1)
    width, height = bits.exp_golomb() + 1, bits.exp_golomb() + 1
    return number, (width * 16, height * 16 * (2 - bits.take(1)))


def h265_sps(bits: "_Bits") -> tuple[int, Size]:
    """Number and size out of an H.265 sequence parameter set."""
    bits.take(16 + 4)
    layers = bits.take(3)
    bits.take(1 + 88 + 8)  # general profile, tier and level
    present = [(bits.take(1), bits.take(1)) for _ in range(layers)]
    if layers:
        bits.take(2 * (8 - layers))
    for profile, level in present:
        bits.take(88 * profile + 8 * level)
    number = bits.exp_golomb()
    if bits.exp_golomb() == 3:
        bits.take(1)
    return number, (bits.exp_golomb(), bits.exp_golomb())


class _Bits:
    """Bits of a parameter set, the bytes that only keep start codes apart taken out. IndexError at its end."""

    def __init__(self, unit: bytes) -> None:
        data = unit.replace(b"\0\0\3", b"\0\0")
        self._value, self._left = int.from_bytes(data, "big"), 8 * len(data)

    def take(self, count: int) -> int:
        if count > self._left:
            raise IndexError
        self._left -= count
        return self._value >> self._left & (1 << count) - 1

    def exp_golomb(self) -> int:
        zeros = 0
        while not self.take(1):
            zeros += 1
            if zeros > 32:
                raise IndexError
        return (1 << zeros) - 1 + self.take(zeros)


def _read(reader: Callable[["_Bits"], tuple[int, Size]], unit: bytes) -> tuple[int, Size] | None:
    try:
        return reader(_Bits(unit[:1024]))
    except IndexError:
        return None  # cut short: no size


def _skip_scaling_list(bits: _Bits, count: int) -> None:
    last = following = 8
    for _ in range(count):
        if following:
            code = bits.exp_golomb()
            following = (last + ((code + 1) // 2 if code % 2 else -code // 2)) % 256
        last = following or last


def _units(payload: bytes, aggregated: int, kind: int, header: int) -> Iterator[bytes]:
    """The units of a packet: itself, or those that an aggregation packet holds, each behind its length."""
    if kind != aggregated:
        yield payload
        return
    at = header
    while at + 2 < len(payload):
        length = int.from_bytes(payload[at:at + 2], "big")
        yield payload[at + 2:at + 2 + length]
        at += 2 + length


def _payload(packet: bytes) -> bytes:
    """What an RTP packet carries; b"" for what is none."""
    if len(packet) < 12 or packet[0] >> 6 != 2:
        return b""
    start = 12 + 4 * (packet[0] & 15)
    if packet[0] & 16:  # a header extension
        if len(packet) < start + 4:
            return b""
        start += 4 + 4 * int.from_bytes(packet[start + 2:start + 4], "big")
    return packet[start:]
