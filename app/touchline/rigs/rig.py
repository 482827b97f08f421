"""A rig: cameras above one field, the calibration grid that all share, and what is wrong with each of them.

W_max_rectangle, H_max_rectangle and N_rectangles are equal for all cameras of a rig, Eq. (3) and (7): only then do
equal corrected coordinates of two cameras mean equal distances on the carpet. They belong to the rig.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, Self

import numpy as np
from typing_extensions import TypedDict

from touchline.core.errors import BadInput, Conflict
from touchline.core.field import Field, FieldJson, Region
from touchline.core.field_json import FIELD_CHANGED_FIX, changes_in_words, field_from_json
from touchline.core.geometry import ImageSize, Pixels
from touchline.core.json_values import JsonObject, PointJson
from touchline.core.options import read_options
from touchline.core.records import Calibration
from touchline.core.sentences import CALIBRATE_AGAIN_FOR_SIZE, camera_not_calibrated
from touchline.core.statements import Sentence, say
from touchline.fitting.contract import RECTANGLE_OPTIONS, corrected_rectangle
from touchline.rigs.verdict import RigTrouble, camera_trouble

NAMES = ("w_max_rectangle_px", "h_max_rectangle_px", "n_rectangles_x", "n_rectangles_y")
SAME = 1e-6  # relative: what a product and a quotient of doubles leave
MAX_CAMERAS = 16


class RectangleOptions(TypedDict):
    """As a fit takes them."""

    w_max_rectangle_px: float
    h_max_rectangle_px: float
    n_rectangles_x: int
    n_rectangles_y: int


@dataclass(frozen=True)
class Rectangles:
    """How large a rectangle is in the corrected picture, px, and how many there are each way."""

    w_max_px: float
    h_max_px: float
    n_x: int
    n_y: int

    @classmethod
    def of_parameters(cls, parameters: Mapping[str, Any]) -> Self | None:
        """Read those that a model was made with; None for parameters without a corrected rectangle."""
        try:
            n_x, n_y = int(parameters["n_rectangles_x"]), int(parameters["n_rectangles_y"])
            return cls(
                float(parameters["width_px"]) / n_x, float(parameters["height_px"]) / n_y, n_x, n_y
            )
        except (KeyError, TypeError, ValueError, ZeroDivisionError):
            return None

    @classmethod
    def of_rig(cls, given: Mapping[str, Any]) -> Self | None:
        """Read a rig's rectangles; None where none are given. BadInput where only some are, or they are invalid."""
        values = [given.get(name) for name in NAMES]
        if all(value is None for value in values):
            return None
        if any(value is None for value in values):
            raise BadInput(
                "Some of the calibration rectangles of the rig are missing.",
                f"Give all of {', '.join(NAMES)}, or none.",
                reason="bad-rectangles",
            )
        read = read_options(RECTANGLE_OPTIONS, dict(zip(NAMES, values, strict=True)))
        return cls(*(read[name] for name in NAMES))

    def check(self, region: Region, image_size: ImageSize) -> None:
        """BadInput where they make no corrected picture."""
        corrected_rectangle(self.options(), region, image_size)

    def options(self) -> RectangleOptions:
        return {
            "w_max_rectangle_px": self.w_max_px,
            "h_max_rectangle_px": self.h_max_px,
            "n_rectangles_x": self.n_x,
            "n_rectangles_y": self.n_y,
        }

    def same_as(self, other: "Rectangles") -> bool:
        return (self.n_x, self.n_y) == (other.n_x, other.n_y) and bool(
            np.allclose(
                (self.w_max_px, self.h_max_px), (other.w_max_px, other.h_max_px), rtol=SAME, atol=0
            )
        )


def most_common(each: Sequence[Rectangles]) -> Rectangles | None:
    """Return the rectangles that most cameras have, the first of a tie; None of none."""
    if not each:
        return None
    votes = Counter(next(i for i, known in enumerate(each) if known.same_as(one)) for one in each)
    return each[max(votes, key=lambda i: (votes[i], -i))]


@dataclass(frozen=True)
class RigMember:
    """One of its cameras. region, rotate: None for those of its calibration; calibration: the active one.

    picture: {"name", "path", "sha256"} of a stored image to check it by, None without.
    """

    camera: str
    title: str
    region: str | None = None
    rotate: int | None = None
    calibration: Calibration | None = None
    picture: Mapping[str, Any] | None = None

    @property
    def rectangles(self) -> Rectangles | None:
        return (
            None
            if self.calibration is None
            else Rectangles.of_parameters(self.calibration.model_parameters)
        )

    def has_size(self, pixels: Pixels) -> bool:
        """Return whether a picture has the size that its calibration is for."""
        return self.calibration is not None and (pixels.shape[1], pixels.shape[0]) == tuple(
            self.calibration.image_size
        )

    def to_json(self) -> JsonObject:
        return {
            "camera": self.camera,
            "title": self.title,
            "region": self.region,
            "rotate": self.rotate,
            "calibration": None if self.calibration is None else self.calibration.to_json(),
            "picture": self.picture,
        }

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> Self:
        calibration = value["calibration"]
        return cls(
            value["camera"],
            value["title"],
            value["region"],
            value["rotate"],
            None if calibration is None else Calibration.from_json(calibration),
            value["picture"],
        )


@dataclass(frozen=True)
class Rig:
    """Cameras above one field. given: its own rectangles, None where it has those of most of its cameras."""

    name: str
    title: str
    field: Field
    given: Rectangles | None
    cameras: tuple[RigMember, ...]

    @property
    def rectangles(self) -> Rectangles | None:
        """The rectangles that all its cameras should have."""
        return self.given or most_common(
            [own for camera in self.cameras if (own := camera.rectangles) is not None]
        )

    @cached_property
    def field_json(self) -> FieldJson:
        return self.field.to_json()

    @cached_property
    def titles(self) -> dict[str, str]:
        return {camera.camera: camera.title for camera in self.cameras}

    def compared(self) -> dict[str, Calibration]:
        """Return the calibrations that speak of the field as it is now, by camera."""
        return {
            camera.camera: camera.calibration
            for camera in self.cameras
            if camera.calibration is not None
            and camera.calibration.field["name"] == self.field.name
            and not camera.calibration.field_changes(self.field_json)
        }

    def to_json(self) -> JsonObject:
        """Return it as from_json reads it: what a job in another process needs."""
        return {
            "name": self.name,
            "title": self.title,
            "field": self.field_json,
            "rectangles": {} if self.given is None else self.given.options(),
            "cameras": [camera.to_json() for camera in self.cameras],
        }

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> Self:
        return cls(
            value["name"],
            value["title"],
            field_from_json(value["field"]),
            Rectangles.of_rig(value["rectangles"]),
            tuple(map(RigMember.from_json, value["cameras"])),
        )


class Range(TypedDict):
    """A part of the field: its smallest and largest x and y, mm."""

    x: PointJson
    y: PointJson


class CameraOfRig(TypedDict):
    """area: what it covers of the field; null where neither the rig nor its calibration names that."""

    camera: str
    title: str
    region: str | None
    area: Range | None
    rotate: int | None
    calibration: str | None
    version: int | None
    model: str | None
    rectangles: RectangleOptions | None
    troubles: list[RigTrouble]


class RigStatus(TypedDict):
    """rectangles: those that all cameras should have; calibration: the active one."""

    rectangles: RectangleOptions | None
    rectangles_from: Literal["rig", "cameras"] | None
    cameras: list[CameraOfRig]


def rig_status(rig: Rig) -> RigStatus:
    """Return the state of each camera, and what is wrong with it in this rig."""
    wanted = rig.rectangles
    return {
        "rectangles": wanted.options() if wanted else None,
        "rectangles_from": "rig" if rig.given else "cameras" if wanted else None,
        "cameras": [_status(rig, camera, wanted) for camera in rig.cameras],
    }


def _status(rig: Rig, camera: RigMember, wanted: Rectangles | None) -> CameraOfRig:
    active, own = camera.calibration, camera.rectangles
    return {
        "camera": camera.camera,
        "title": camera.title,
        "region": camera.region,
        "area": _area(rig.field, camera),
        "rotate": camera.rotate,
        "calibration": None if active is None else active.id,
        "version": None if active is None else active.version,
        "model": None if active is None else active.model_name,
        "rectangles": own.options() if own else None,
        "troubles": list(_troubles(rig, camera, wanted)),
    }


def _area(field: Field, camera: RigMember) -> Range | None:
    """As it is stitched. The field may have changed since the rig was saved."""
    calibration = camera.calibration
    name = camera.region
    if name is None and calibration is not None and calibration.field["name"] == field.name:
        name = calibration.region
    region = None if name is None else field.regions.get(name)
    return None if region is None else {"x": list(region.x_mm), "y": list(region.y_mm)}


def _troubles(rig: Rig, camera: RigMember, wanted: Rectangles | None) -> Iterator[RigTrouble]:
    calibration, title, own = camera.calibration, camera.title, camera.rectangles

    def trouble(reason: str, text: str, fix: str) -> RigTrouble:
        return camera_trouble(camera.camera, reason, text, fix)

    if calibration is None:
        yield trouble(
            "not-calibrated",
            camera_not_calibrated(title),
            say("rig.calibrate-camera", "Calibrate {camera}, and activate it.", camera=title),
        )
        return
    if calibration.field["name"] != rig.field.name:
        yield trouble(
            "other-field",
            say(
                "rig.other-field",
                "{camera} is calibrated on the field {field}; the field of the rig is {wanted}.",
                camera=title,
                field=calibration.field["name"],
                wanted=rig.field.name,
            ),
            say(
                "rig.calibrate-on-field",
                "Calibrate {camera} on {field}.",
                camera=title,
                field=rig.field.name,
            ),
        )
        return
    if changes := calibration.field_changes(rig.field_json):
        yield trouble(
            "field-changed",
            say(
                "rig.field-changed",
                "{camera} was calibrated before the field was changed: {changes}.",
                camera=title,
                changes=changes_in_words(changes),
            ),
            FIELD_CHANGED_FIX,
        )
    if camera.region is not None and calibration.region != camera.region:
        yield trouble(
            "other-region",
            say(
                "rig.other-area",
                "{camera} is calibrated on {area}; its covered area in the rig is {wanted}.",
                camera=title,
                area=calibration.region,
                wanted=camera.region,
            ),
            say(
                "rig.calibrate-on-area",
                "Calibrate {camera} on {area}, or change the rig.",
                camera=title,
                area=camera.region,
            ),
        )
    if own is not None and wanted is not None and not own.same_as(wanted):
        yield trouble(
            "other-rectangles",
            say(
                "rig.other-grid",
                "{camera} is calibrated with {grid}; the rig has "
                "{wanted}. Corrected pixels of the two cameras differ in scale.",
                camera=title,
                grid=_grid(own),
                wanted=_grid(wanted),
            ),
            say(
                "rig.fit-with-grid",
                "Fit {camera} again with the shared calibration grid of the rig, then "
                "activate the new version.",
                camera=title,
            ),
        )


def _grid(rectangles: Rectangles) -> Sentence:
    return say(
        "rig.grid",
        "{n_x} × {n_y} rectangles of {width_px:.4g} × {height_px:.4g} px",
        n_x=rectangles.n_x,
        n_y=rectangles.n_y,
        width_px=rectangles.w_max_px,
        height_px=rectangles.h_max_px,
    )


def refuse_other_sizes(rig: Rig, pictures: Mapping[str, Pixels]) -> None:
    """Conflict for a picture of another size than its camera's calibration."""
    for camera in rig.cameras:
        pixels = pictures.get(camera.camera)
        if pixels is None or camera.calibration is None or camera.has_size(pixels):
            continue
        raise Conflict(
            say(
                "rig.other-image-size",
                "The image from {camera} is {size}; its calibration is for {wanted}.",
                camera=camera.title,
                size=ImageSize(pixels.shape[1], pixels.shape[0]),
                wanted=camera.calibration.image_size,
            ),
            CALIBRATE_AGAIN_FOR_SIZE,
            reason="size-mismatch",
        )
