"""Clips: some seconds of what a camera saw, each one file; to step through and replay, not part of the archive.

    uint32 length, so many bytes of JSON {"camera", "taken_at", "width", "height", "frames": [{"seq", "time_s",
    "bytes"}]}; the frames, JPEG after JPEG
"""

import json
import os
import re
import struct
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path
from typing import Any

from app.core.errors import BadInput, DiskFull, NotFound
from app.store.files import keeping, make_folder, write_whole
from app.store.repository import Clock, new_id, stamp
from app.store.space import MB, Space

LENGTH = struct.Struct("<I")
MOST_BYTES = 1000 * MB  # all clips together; the oldest go
MOST_HEAD = 1 << 20


@dataclass(frozen=True)
class Clip:
    """One that is kept. frames: {"seq", "time_s"} of each."""

    id: str
    camera: str
    taken_at: str
    width: int
    height: int
    frames: tuple[Mapping[str, Any], ...]

    @property
    def seconds(self) -> float:
        return self.frames[-1]["time_s"] - self.frames[0]["time_s"] if self.frames else 0.0

    def to_json(self) -> dict[str, Any]:
        return {"clip": self.id, "camera": self.camera, "taken_at": self.taken_at, "width": self.width,
                "height": self.height, "frames": len(self.frames), "seconds": round(self.seconds, 3),
                "fps": round((len(self.frames) - 1) / self.seconds, 2) if self.seconds > 0 else 0.0}


class Clips:
    """The folder of clips. Files are whole or not there."""

    def __init__(self, folder: Path, space: Space, clock: Clock) -> None:
        self._folder, self._space, self._clock = folder / "clips", space, clock

    def add(self, camera: str, head: Mapping[str, Any], jpegs: bytes) -> Clip:
        """Keep one. head: width, height and frames with their bytes, in the order of the JPEGs."""
        self._space.check_free()
        told = {"camera": camera, "taken_at": stamp(self._clock), "width": head["width"], "height": head["height"],
                "frames": list(head["frames"])}
        text = json.dumps(told, allow_nan=False, separators=(",", ":")).encode("ascii")
        if len(text) > MOST_HEAD or len(jpegs) > MOST_BYTES:
            raise DiskFull("The clip is too large.", "Record fewer seconds.", reason="clip-too-large")
        with keeping("The clip"):
            make_folder(self._folder)
            self._make_room(len(jpegs))
            id = new_id()
            write_whole(self._path(id), LENGTH.pack(len(text)) + text + jpegs)
        return self.get(id)

    def all(self) -> tuple[Clip, ...]:
        """Newest first; one that cannot be read is left out."""
        found = []
        for path in self._files()[::-1]:
            with suppress(NotFound):
                found.append(self.get(path.stem))
        return tuple(found)

    def get(self, id: str) -> Clip:
        """One; NotFound."""
        told, _ = self._head(id)
        return Clip(id, told["camera"], told["taken_at"], told["width"], told["height"], tuple(told["frames"]))

    def frame(self, id: str, number: int) -> bytes:
        """The JPEG of a frame, counted from 0; NotFound."""
        told, begin = self._head(id)
        sizes = [frame["bytes"] for frame in told["frames"]]
        if not 0 <= number < len(sizes):
            raise NotFound(f"The clip has no frame {number}.", f"Ask for 0 to {len(sizes) - 1}.",
                           reason="unknown-frame")
        try:
            with self._path(id).open("rb") as file:
                file.seek(begin + list(accumulate(sizes, initial=0))[number])
                return file.read(sizes[number])
        except OSError:
            raise _unknown(id) from None

    def remove(self, id: str) -> None:
        """Forget one; NotFound."""
        self._head(id)
        with keeping("The deletion"):
            self._path(id).unlink(missing_ok=True)

    def _head(self, id: str) -> tuple[dict[str, Any], int]:
        if re.fullmatch(r"[0-9a-f]{16}", id) is None:
            raise _unknown(id)
        try:
            with self._path(id).open("rb") as file:
                (length,) = LENGTH.unpack(file.read(LENGTH.size))
                if length > MOST_HEAD:
                    raise ValueError
                told = json.loads(file.read(length))
            if not all(type(frame["bytes"]) is int and frame["bytes"] > 0 and type(frame["seq"]) is int
                       and type(frame["time_s"]) is float for frame in told["frames"]):
                raise ValueError
            if not all(name in told for name in ("camera", "taken_at", "width", "height")):
                raise ValueError
            return told, LENGTH.size + length
        except (OSError, ValueError, KeyError, TypeError, struct.error, BadInput):
            raise _unknown(id) from None

    def _make_room(self, size_bytes: int) -> None:
        files = self._files()
        sizes = [path.stat().st_size for path in files]
        while files and sum(sizes) + size_bytes > MOST_BYTES:
            files.pop(0).unlink(missing_ok=True)
            sizes.pop(0)

    def _files(self) -> list[Path]:
        """Oldest first."""
        if not self._folder.is_dir():
            return []
        return _by_age([path for path in self._folder.iterdir() if path.suffix == ".clip"])

    def _path(self, id: str) -> Path:
        return self._folder / f"{id}.clip"


def _by_age(paths: Sequence[Path]) -> list[Path]:
    known = []
    for path in paths:
        with suppress(OSError):
            known.append((os.stat(path).st_mtime_ns, path))
    return [path for _, path in sorted(known)]


def _unknown(id: str) -> NotFound:
    return NotFound(f"There is no clip {id[:40]!r}.", "List them with GET /api/v1/clips.", reason="unknown-clip")
