"""video://NAME: a video file as if it were a camera, in real time or as fast as it can be read."""

import time
from collections.abc import Generator, Mapping
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

from touchline.core.errors import BadInput, NotFound, Unavailable
from touchline.core.options import Option
from touchline.core.records import Frame
from touchline.core.statements import say
from touchline.sources import BaseSource, SourceContext
from touchline.sources.files import file_within, pictures_folder
from touchline.sources.lifecycle import require_open

if TYPE_CHECKING:
    from touchline.sources.ffmpeg import VideoDecoder

SUFFIXES = (".mp4", ".m4v", ".mov", ".avi", ".mkv", ".webm")
MP4 = (b"ftyp", b"moov", b"mdat", b"free", b"skip", b"wide")
MATROSKA = b"\x1a\x45\xdf\xa3"
MAX_LATE_S = 0.2  # what the reader is late is caught up with; more than that is not
MAX_WAIT_S = 5.0  # a jump in the film's own times is no reason to stand still


class VideoSource(BaseSource):
    """One decoder at a time; a loop opens the file anew."""

    TITLE: ClassVar = "Video file"
    HELP: ClassVar = "A video file in the pictures folder, played as a camera."
    TARGET: ClassVar = "the file's name"
    OPTIONS: ClassVar = (
        Option("loop", "bool", True, "Start again after the last frame."),
        Option(
            "pace",
            "choice",
            "real",
            "At the recorded frame rate, or as fast as possible.",
            choices=("real", "fast"),
        ),
        Option("start_s", "float", 0.0, "Start time in the video.", (0, 1e6), "s"),
        Option("fps", "float", None, "Frames per second. If not set: as recorded.", (0.1, 240)),
    )

    def __init__(self, path: Path, options: Mapping[str, Any]) -> None:
        self._path, self._options = path, options
        self._decoder: VideoDecoder | None = None
        self._pending: Frame | None = None
        self._pace = _Pace()
        self._rounds_s = 0.0  # how long the rounds so far were
        self._index = 0
        self._moment_s = 0.0  # of the newest frame, since the beginning of its round
        self._interval_s = 0.04

    @classmethod
    def open(cls, target: str, options: Mapping[str, Any], context: SourceContext) -> Self:
        path = file_within(pictures_folder(context), target, "video")
        if not _is_video(path):
            raise BadInput(
                say("video.not-supported", "{name!r} is not a supported video.", name=target),
                say("video.use-format", "Use MP4, MOV, AVI, MKV or WebM."),
                reason="unknown-video-format",
            )
        opened = cls(path, options)
        opened._pending = opened._decoded(opened._begin())
        if opened._pending is None:
            opened.close()
            raise BadInput(
                say(
                    "video.no-frames",
                    "The video {name!r} has no frames after {start_s:g} s.",
                    name=target,
                    start_s=options["start_s"],
                ),
                say("video.start-earlier", "Start earlier, or convert it to MP4 with H.264."),
                reason="undecodable-video",
            )
        return opened

    def read(self) -> Frame:
        decoder = require_open(self._decoder, "video")
        frame, self._pending = self._pending or self._decoded(decoder), None
        if frame is None and self._options["loop"]:
            self._rounds_s += self._moment_s + self._interval_s
            frame = self._decoded(self._begin())
        if frame is None:
            raise Unavailable(
                say("video.ended", "The video has ended."),
                say("video.open-again", "Open it again, or with loop=true."),
                reason="source-ended",
            )
        if self._options["pace"] == "real":
            self._pace.wait_for(self._rounds_s + self._moment_s)
        return frame

    @property
    def moment_s(self) -> float:
        """Time of the newest frame since the reading began."""
        return self._rounds_s + self._moment_s

    def close(self) -> None:
        if self._decoder is not None:
            self._decoder.close()
        self._decoder = self._pending = None

    def _begin(self) -> "VideoDecoder":
        """Open the decoder at the first frame; close the one before."""
        self.close()
        from touchline.sources.ffmpeg import VideoDecoder

        self._decoder = decoder = VideoDecoder.open(str(self._path))
        if decoder is None:
            raise BadInput(
                say(
                    "video.cannot-decode",
                    "The video {name!r} cannot be decoded.",
                    name=self._path.name,
                ),
                say("video.convert", "Convert it to MP4 with H.264."),
                reason="undecodable-video",
            )
        stated_s, fps = decoder.interval_s, self._options["fps"]
        self._interval_s = (
            1 / fps if fps else stated_s if stated_s and 0.001 <= stated_s <= 10 else 0.04
        )
        self._index = 0
        if self._options["start_s"]:
            decoder.start_at(self._options["start_s"])
        return decoder

    def _decoded(self, decoder: "VideoDecoder") -> Frame | None:
        frame = decoder.read()
        if frame is None:
            return None
        stated_s = None if decoder.moment_s is None else decoder.moment_s - self._options["start_s"]
        believable = (
            self._options["fps"] is None
            and stated_s is not None
            and (stated_s > 0 or self._index == 0)
        )
        self._moment_s = max(0.0, stated_s or 0.0) if believable else self._index * self._interval_s
        self._index += 1
        return frame


def read_video(path: str) -> Generator[tuple[float, Frame], None, None]:
    """Yield the frames of a video file, as fast as they can be read, each with its time since the first one, s.

    NotFound, or BadInput for what is no video.
    """
    file = Path(path)
    if not file.is_file():
        raise NotFound(
            say("rolls.unknown-video", "There is no video {name!r}.", name=file.name),
            say("rolls.check-path", "Check the path."),
            reason="unknown-video",
        )
    options = {"loop": False, "pace": "fast", "start_s": 0.0, "fps": None}
    with closing(
        VideoSource.open(file.name, options, SourceContext(pictures=file.parent))
    ) as video:
        while True:
            try:
                frame = video.read()
            except Unavailable as error:
                if error.reason != "source-ended":
                    raise
                return
            yield video.moment_s, frame


class _Pace:
    """Waits until a moment of the video has come."""

    def __init__(self) -> None:
        self._start: float | None = None

    def wait_for(self, moment_s: float) -> None:
        now = time.monotonic()
        if self._start is None or now - self._start - moment_s > MAX_LATE_S:
            self._start = now - moment_s
        elif self._start + moment_s - now > MAX_WAIT_S:
            self._start = now + MAX_WAIT_S - moment_s
        time.sleep(max(0.0, self._start + moment_s - now))


def _is_video(path: Path) -> bool:
    """Tell whether name and first bytes are a video's: a playlist with such a name is not even tried.

    They need not agree: many an MP4 is called .avi.
    """
    if path.suffix.lower() not in SUFFIXES:
        return False
    try:
        with path.open("rb") as file:
            head = file.read(12)
    except OSError:
        return False
    return (
        head[4:8] in MP4
        or head.startswith(MATROSKA)
        or (head[:4] == b"RIFF" and head[8:] == b"AVI ")
    )
