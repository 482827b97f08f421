"""What detection saves: clips, each one file; and the stage plans that come with Touchline, as YAML.

A clip is some seconds of what a camera saw, to step through and replay; clips are not part of the archive:

    uint32 length, so many bytes of JSON {"camera", "taken_at", "width", "height", "frames": [{"seq", "time_s",
    "bytes"}]}; the frames, JPEG after JPEG
"""

import json
import os
import re
import struct
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter
from typing_extensions import TypedDict

from touchline.core.errors import BadInput, DiskFull, NotFound
from touchline.core.json_values import JsonObject
from touchline.core.sentences import use_one_of
from touchline.core.statements import say
from touchline.detection.profile import ColourProfile
from touchline.detection.stages import StageConfig
from touchline.installation import shipped
from touchline.store.files import MB, make_folder, read_yaml, write_atomically
from touchline.store.integrity import content
from touchline.store.repository import StoreContext, check_etag, content_etag, new_id, timestamp

LENGTH = struct.Struct("<I")
MAX_BYTES = 1000 * MB  # all clips together; the oldest go
MAX_HEADER_BYTES = 1 << 20


@dataclass(frozen=True)
class Clip:
    """A stored clip. frames: {"seq", "time_s"} of each."""

    id: str
    camera: str
    taken_at: str
    width: int
    height: int
    frames: tuple[Mapping[str, Any], ...]

    @property
    def seconds(self) -> float:
        return self.frames[-1]["time_s"] - self.frames[0]["time_s"] if self.frames else 0.0

    @property
    def etag(self) -> str:
        return content_etag(self.to_json())

    def to_json(self) -> dict[str, Any]:
        return {
            "clip": self.id,
            "camera": self.camera,
            "taken_at": self.taken_at,
            "width": self.width,
            "height": self.height,
            "frames": len(self.frames),
            "seconds": round(self.seconds, 3),
            "fps": round((len(self.frames) - 1) / self.seconds, 2) if self.seconds > 0 else 0.0,
        }


class ClipRepository:
    """The clips of a folder. Thread-safe."""

    def __init__(self, store: StoreContext) -> None:
        self.folder, self._quota = store.folder / "clips", store.quota
        self._clock, self._failures = store.clock, store.database.failures

    def add(self, camera: str, head: Mapping[str, Any], jpegs: bytes) -> Clip:
        """Save one. head: width, height and frames with their bytes, in the order of the JPEGs."""
        header = {
            "camera": camera,
            "taken_at": timestamp(self._clock),
            "width": head["width"],
            "height": head["height"],
            "frames": list(head["frames"]),
        }
        text = json.dumps(header, allow_nan=False, separators=(",", ":")).encode("ascii")
        if len(text) > MAX_HEADER_BYTES or len(jpegs) > MAX_BYTES:
            raise DiskFull(
                say("clip.too-large", "The clip is too large."),
                say("clip.fewer-seconds", "Record fewer seconds."),
                reason="clip-too-large",
            )
        with self._failures.noted("The clip"):
            self._quota.check_free()
            make_folder(self.folder)
            self._free_space(len(jpegs))
            id = new_id()
            before_ns = max((path.stat().st_mtime_ns for path in self._files()), default=0)
            write_atomically(path := self._path(id), LENGTH.pack(len(text)) + text + jpegs)
            # the clock was set back: the newest would be the first to go
            if path.stat().st_mtime_ns <= before_ns:
                os.utime(path, ns=(before_ns + 1, before_ns + 1))
        return self.get(id)

    def all(self) -> tuple[Clip, ...]:
        """Return all, newest first, without those that cannot be read."""
        found = []
        for path in self._files()[::-1]:
            with suppress(NotFound):
                found.append(self.get(path.stem))
        return tuple(found)

    def get(self, id: str) -> Clip:
        """Return one; NotFound."""
        header, _ = self._header(id)
        return Clip(
            id,
            header["camera"],
            header["taken_at"],
            header["width"],
            header["height"],
            tuple(header["frames"]),
        )

    def frame(self, id: str, number: int) -> bytes:
        """Return the JPEG of a frame, counted from 0; NotFound."""
        header, begin = self._header(id)
        sizes = [frame["bytes"] for frame in header["frames"]]
        if not 0 <= number < len(sizes):
            raise NotFound(
                say("clip.unknown-frame", "The clip has no frame {frame}.", frame=number),
                say("clip.frames", "Request a frame from 0 to {last}.", last=len(sizes) - 1),
                reason="unknown-frame",
            )
        try:
            with self._path(id).open("rb") as file:
                file.seek(begin + list(accumulate(sizes, initial=0))[number])
                return file.read(sizes[number])
        except OSError:
            raise _unknown(id) from None

    def delete(self, id: str, etag: str | None = None) -> None:
        """Delete the one with that ETag (None: whichever); NotFound, or Stale."""
        check_etag(
            etag,
            self.get(id).etag,
            say("stale.clip", "This is another clip than the one you opened."),
            "stale-clip",
            {"clip": id},
        )
        with self._failures.noted("The deletion"):
            self._path(id).unlink(missing_ok=True)

    def _header(self, id: str) -> tuple[dict[str, Any], int]:
        if re.fullmatch(r"[0-9a-f]{16}", id) is None:
            raise _unknown(id)
        try:
            with self._path(id).open("rb") as file:
                (length,) = LENGTH.unpack(file.read(LENGTH.size))
                if length > MAX_HEADER_BYTES:
                    raise ValueError
                header = json.loads(file.read(length))
            if not all(
                type(frame["bytes"]) is int
                and frame["bytes"] > 0
                and type(frame["seq"]) is int
                and type(frame["time_s"]) is float
                for frame in header["frames"]
            ):
                raise ValueError
            if not all(name in header for name in ("camera", "taken_at", "width", "height")):
                raise ValueError
            return header, LENGTH.size + length
        except (OSError, ValueError, KeyError, TypeError, struct.error, BadInput):
            raise _unknown(id) from None

    def _free_space(self, size_bytes: int) -> None:
        files = self._files()
        sizes = [path.stat().st_size for path in files]
        while files and sum(sizes) + size_bytes > MAX_BYTES:
            files.pop(0).unlink(missing_ok=True)
            sizes.pop(0)

    def _files(self) -> list[Path]:
        """Return the files, oldest first."""
        known = []
        for path in self.folder.glob("*.clip"):
            with suppress(OSError):
                known.append((path.stat().st_mtime_ns, path))
        return [path for _, path in sorted(known)]

    def _path(self, id: str) -> Path:
        return self.folder / f"{id}.clip"


def _unknown(id: str) -> NotFound:
    return NotFound(
        say("clip.unknown", "There is no clip {id!r}.", id=id[:40]),
        "List them with GET /api/v1/clips.",
        reason="unknown-clip",
    )


def load_plans() -> dict[str, StageConfig]:
    """Load every plan that comes with Touchline, by name, in order."""
    plans = [load_plan(path) for path in sorted((shipped("configs") / "stages").glob("*.yaml"))]
    if not plans:
        raise NotFound(
            "The detection plans of Touchline are not installed.",
            "Install Touchline again.",
            reason="no-stages",
        )
    return {plan.name: plan for plan in plans}


def load_plan(path: Path) -> StageConfig:
    """Load the plan of one file."""
    return read_yaml(path, StageConfig.from_json, f"The plan {path.name}", "no-stages")


def named_plan(name: str) -> StageConfig:
    """Return a plan that comes with Touchline; NotFound."""
    plans = load_plans()
    if name not in plans:
        raise NotFound(
            say("plan.unknown", "There is no detection plan called {name!r}.", name=name[:40]),
            use_one_of(plans),
            reason="unknown-stages",
        )
    return plans[name]


class _Settings(TypedDict):
    on: bool
    plan: JsonObject
    colours: str | None
    profile: JsonObject | None
    publish: bool


class _Preset(TypedDict):
    updated_at: str
    updated_by: str
    etag: str
    preset: JsonObject


PRESET, SETTINGS = TypeAdapter(_Preset), TypeAdapter(_Settings)


def read_preset(row: Any) -> object:
    """Read a saved row of colours or of a camera's settings; raise where this version cannot."""
    preset = PRESET.validate_python(content(row))["preset"]
    if row.key.startswith("colours:"):
        return ColourProfile.from_json(preset)
    settings = SETTINGS.validate_python(preset)
    if settings["profile"] is not None:
        ColourProfile.from_json(settings["profile"])
    return StageConfig.from_json(settings["plan"])
