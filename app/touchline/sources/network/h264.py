"""H.264 from a network that loses packets: after a loss nothing is shown until a picture that needs no other.

Decoders conceal what is missing, and a picture is predicted from the one before: a lost packet smears every picture up
to the next key frame. A calibration must not be made of those.
"""

import re

import av
from av.video.codeccontext import VideoCodecContext
from av.video.frame import VideoFrame

from touchline.sources.ffmpeg import LEASH
from touchline.sources.network.rtp import MAX_UNIT, AccessUnit

KEY = re.compile(rb"\x00\x00\x01[\x05\x25\x45\x65]")  # a slice of an IDR picture


class H264Decoder:
    """Decodes pictures of one sender. shown, dropped: so many so far; keys: so many key frames came, whole or not."""

    def __init__(self) -> None:
        self.shown = self.dropped = self.keys = 0
        self._synced = False
        self._codec, self._parser = _new_codec(), _new_codec()
        self._unparsed = 0

    def decode(self, unit: AccessUnit) -> list[VideoFrame]:
        """Return the pictures that are whole now: at most this one, or an earlier one that is shown later."""
        is_key = KEY.search(unit.data) is not None
        self.keys += is_key
        was_synced, self._synced = self._synced and unit.follows and unit.whole, False
        if not unit.whole or not (was_synced or is_key):
            self.dropped += 1
            return []
        if not was_synced:
            self._codec.flush_buffers()  # what was predicted from lost ones is not shown any more
        try:
            frames = self._codec.decode(av.Packet(unit.data))
        except av.FFmpegError:
            frames, damaged = [], True
        else:
            damaged = any(frame.is_corrupt for frame in frames)
        if damaged:
            self.dropped += 1
            return []
        self._synced = True
        self.shown += len(frames)
        return frames

    def parse(self, data: bytes) -> list[AccessUnit]:
        """Split a stream of bytes (Annex B) into pictures; each is known to have ended when the next one begins."""
        self._unparsed += len(data)
        if self._unparsed > MAX_UNIT:
            self._parser = _new_codec()
        try:
            packets = self._parser.parse(data)
        except av.FFmpegError:
            packets = []
        if packets or self._unparsed > MAX_UNIT:
            self._unparsed = 0
        return [AccessUnit(bytes(packet)) for packet in packets]


def _new_codec() -> VideoCodecContext:
    codec = VideoCodecContext.create("h264", "r")
    assert isinstance(codec, VideoCodecContext)
    codec.options = {"max_pixels": LEASH["max_pixels"], "err_detect": "explode"}
    codec.thread_count = 1
    return codec
