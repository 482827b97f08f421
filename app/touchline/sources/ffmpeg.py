"""FFmpeg, as PyAV has it, on a short leash: few protocols, few containers, deadlines.

FFmpeg would follow a playlist that calls itself a film to other files and machines; the lists below end that.
"""

import re
from collections.abc import Iterator
from contextlib import suppress
from typing import Self

import av
import numpy as np
from av.container import InputContainer
from av.video.codeccontext import VideoCodecContext
from av.video.frame import VideoFrame
from av.video.stream import VideoStream

from touchline.core.records import Frame
from touchline.images.limits import DEFAULT_LIMITS
from touchline.sources.network.rtp import MAX_UNIT, AccessUnit

# A film in one of these containers names no other file.
LEASH = {
    "protocol_whitelist": "file,tcp,rtp",
    "format_whitelist": "mov,avi,matroska,rtsp,sdp",
    "rtsp_transport": "tcp",
    "allowed_media_types": "video",
    "max_pixels": str(DEFAULT_LIMITS.max_pixels),
    "fpsprobesize": "0",
}  # no second of frames is looked at before the first is given
KEY = re.compile(rb"\x00\x00\x01[\x05\x25\x45\x65]")  # a slice of an IDR picture


def frame_of(picture: VideoFrame) -> Frame:
    """Convert a decoded picture."""
    pixels = picture.to_ndarray(format="bgr24")
    pixels.setflags(write=False)
    return Frame(np.asarray(pixels, np.uint8))


class VideoDecoder:
    """The frames of one stream, each of its own size, as they were coded: not turned. Not thread-safe.

    interval_s: between two frames, as the stream states it; None where it does not. moment_s: of the newest frame since
    the stream's beginning, stated as well.
    """

    def __init__(self, container: InputContainer, stream: VideoStream) -> None:
        self._container, self._stream = container, stream
        self._packets = container.demux(stream)
        self._frames = self._decode()
        self._from_s = 0.0
        self.interval_s = float(1 / stream.average_rate) if stream.average_rate else None
        self.moment_s: float | None = None

    @classmethod
    def open(
        cls, name: str, *, open_s: float = 2.0, read_s: float = 1.5, threads: int = 0
    ) -> Self | None:
        """Open a file's absolute path or an address of this machine; None where that fails or takes too long.

        A read then fails after read_s. threads: of the decoder, each a frame late; 0: as many as processors.
        """
        try:
            container = av.open(name, options=LEASH, timeout=(open_s, read_s))
        except (av.FFmpegError, ValueError):
            return None
        stream = next(iter(container.streams.video), None)
        if stream is None or stream.codec_context is None or not stream.width * stream.height:
            container.close()
            return None
        stream.codec_context.options = {"max_pixels": LEASH["max_pixels"]}
        stream.thread_type, stream.thread_count = "AUTO", threads
        return cls(container, stream)

    def start_at(self, moment_s: float) -> None:
        """Go to the first frame that is not before that moment, before any is read."""
        self._from_s = moment_s
        start_s = float((self._stream.start_time or 0) * (self._stream.time_base or 0))
        with suppress(av.FFmpegError):  # then it is looked for from the beginning
            self._container.seek(round((start_s + moment_s) * av.time_base))

    def read(self) -> Frame | None:
        """Return the next frame; None at the stream's end, or where none comes in time."""
        with suppress(av.FFmpegError):
            for frame in self._frames:
                self.moment_s = self._moment_of(frame)
                if self.moment_s is None or self.moment_s > self._from_s - 1e-3:
                    return frame_of(frame)
        return None

    @property
    def has_jpegs(self) -> bool:
        """Whether each picture is a JPEG, so that read_jpeg() will do."""
        return self._stream.codec_context.name == "mjpeg"

    def read_jpeg(self) -> bytes | None:
        """Return the next picture as it came; None at the stream's end, or where none comes in time."""
        with suppress(av.FFmpegError):
            return next(
                (
                    bytes(packet)
                    for packet in self._packets
                    if packet.size and not packet.is_corrupt
                ),
                None,
            )
        return None

    def close(self) -> None:
        self._container.close()

    def _decode(self) -> Iterator[VideoFrame]:
        for packet in self._packets:
            try:
                frames = self._stream.decode(packet)
            except av.FFmpegError:
                continue  # damaged, or too large; the next one may be whole
            yield from frames

    def _moment_of(self, frame: VideoFrame) -> float | None:
        if frame.pts is None or frame.time_base is None:
            return None
        return float((frame.pts - (self._stream.start_time or 0)) * frame.time_base)


class H264Decoder:
    """Decodes one sender's pictures, where packets may be lost. shown, dropped, keys: so many, and key frames, so far.

    Decoders conceal what is missing, and a picture is predicted from the one before: a lost packet smears every picture
    up to the next key frame. Those are dropped, since no calibration may be made of them.
    """

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
