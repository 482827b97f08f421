"""Detections on a field at one moment, each with its confidence; and from pixels to places at a height.

A detection's pixel is raw. Its place is in field mm at its own height z_mm; None without a calibration. They leave as
JSON, and as the Small Size League's SSL_DetectionFrame: one packet a frame and camera.

    locator = FieldLocator.of(model)                    any camera model; one without rays knows the carpet only
    places, mm_per_px = locator.spread(pixels, z_mm)    (n, 2) mm, and (n, 2, 2): how the place moves with the pixel
"""

from dataclasses import dataclass
from functools import cached_property
from math import degrees, isfinite, radians
from typing import Any, Literal, Self, get_args

import numpy as np
from numpy.typing import NDArray

from touchline.core.errors import BadInput
from touchline.core.geometry import MAX_COORDINATE, Array, ImageSize, Points
from touchline.models import RayModel
from touchline.ssl_protocol.protobuf import build, encode
from touchline.ssl_protocol.ssl_vision_pb2 import (
    SSL_DetectionBall,
    SSL_DetectionFrame,
    SSL_DetectionRobot,
    SSL_Source,
    SSL_WrapperPacket,
)

Kind = Literal["ball", "robot", "marker"]
Covariance = tuple[tuple[float, float], tuple[float, float]]
_KEYS = {
    "kind",
    "team",
    "id",
    "pixel",
    "x_mm",
    "y_mm",
    "z_mm",
    "orientation_deg",
    "confidence",
    "covariance_mm2",
    "orientation_sigma_deg",
    "area_px",
    "on_carpet",
}
_FORM = "Give the result of to_json of a detection."
MAX_PER_KIND = 100  # of a kind: a datagram must hold them

_STEP_PX = 1.0
_GRID = (33, 25)


@dataclass(frozen=True)
class Detection:
    """One detected thing.

    kind: "marker" is a patch of a team's colour of which nothing more is known. id: a robot's number, None where its
    pattern is not readable. pixel: of its middle, raw. covariance_mm2: of x_mm and y_mm. on_carpet: the place is where
    the line of sight meets the carpet, as the model has no rays; what is higher stands elsewhere.
    """

    kind: Kind
    pixel: tuple[float, float]
    team: str | None = None
    id: int | None = None
    x_mm: float | None = None
    y_mm: float | None = None
    z_mm: float = 0.0
    orientation_rad: float | None = None  # counter-clockwise from field x
    confidence: float = 1.0
    covariance_mm2: Covariance | None = None
    orientation_sigma_rad: float | None = None
    area_px: float = 0.0
    on_carpet: bool = False

    def to_json(self) -> dict[str, Any]:
        return {
            "kind": self.kind,
            "team": self.team,
            "id": self.id,
            "pixel": list(self.pixel),
            "x_mm": self.x_mm,
            "y_mm": self.y_mm,
            "z_mm": self.z_mm,
            "orientation_deg": _degrees(self.orientation_rad),
            "confidence": self.confidence,
            "covariance_mm2": None
            if self.covariance_mm2 is None
            else [list(row) for row in self.covariance_mm2],
            "orientation_sigma_deg": _degrees(self.orientation_sigma_rad),
            "area_px": self.area_px,
            "on_carpet": self.on_carpet,
        }

    @classmethod
    def from_json(cls, value: Any) -> Self:
        """Read what to_json wrote; BadInput for anything else."""
        if not isinstance(value, dict) or set(value) != _KEYS:
            raise _refused("This is not a detection.")
        kind, team, number = value["kind"], value["team"], value["id"]
        if kind not in get_args(Kind) or not isinstance(team, str | None):
            raise _refused("The kind of a detection is unknown.")
        if (
            not (number is None or (type(number) is int and 0 <= number < 256))
            or type(value["on_carpet"]) is not bool
        ):
            raise _refused("The id of a detection is not a valid number.")
        covariance = None
        if value["covariance_mm2"] is not None:
            first, second = _pair(value["covariance_mm2"])
            covariance = _pair_of_numbers(first), _pair_of_numbers(second)
        return cls(
            kind,
            _pair_of_numbers(value["pixel"]),
            team,
            number,
            _number(value["x_mm"]),
            _number(value["y_mm"]),
            _number(value["z_mm"], False),
            _radians(value["orientation_deg"]),
            _number(value["confidence"], False),
            covariance,
            _radians(value["orientation_sigma_deg"]),
            _number(value["area_px"], False),
            value["on_carpet"],
        )


@dataclass(frozen=True)
class Detections:
    """All detections of one frame. frame: its number, if counted. time_s: when it was taken, unix."""

    items: tuple[Detection, ...]
    image_size: ImageSize
    camera: str | None = None
    frame: int | None = None
    time_s: float | None = None

    def of(self, kind: Kind) -> tuple[Detection, ...]:
        return tuple(item for item in self.items if item.kind == kind)

    def to_json(self) -> dict[str, Any]:
        return {
            "camera": self.camera,
            "frame": self.frame,
            "time": self.time_s,
            "image_size": list(self.image_size),
            "detections": [item.to_json() for item in self.items],
        }


def _degrees(angle: float | None) -> float | None:
    return None if angle is None else degrees(angle)


def _radians(value: Any) -> float | None:
    angle = _number(value)
    return None if angle is None else radians(angle)


def _number(value: Any, maybe: bool = True) -> Any:
    if value is None and maybe:
        return None
    if type(value) not in (int, float) or not isfinite(value) or abs(value) > MAX_COORDINATE:
        raise _refused(f"{str(value)[:40]!r} is not a valid number of a detection.")
    return float(value)


def _pair(value: Any) -> Any:
    if not isinstance(value, (list, tuple)) or len(value) != 2:
        raise _refused("A detection must have a pair of numbers here.")
    return value


def _pair_of_numbers(value: Any) -> tuple[float, float]:
    a, b = _pair(value)
    return _number(a, False), _number(b, False)


def _refused(what: str) -> BadInput:
    return BadInput(what, _FORM, reason="bad-detections")


def detection_packet(detections: Detections, camera_number: int, sent_s: float) -> bytes:
    """Return the datagram of a frame.

    sent_s: now, unix; frame and time_s of the detections must be known. Lengths in mm, angles in radians,
    counter-clockwise from field x, pixels raw. What has no place, or a team that the league has not, is left out; a
    robot whose pattern is not readable goes without a number.
    """
    placed = [
        (item, item.x_mm, item.y_mm)
        for item in detections.items
        if item.x_mm is not None and item.y_mm is not None
    ]
    robots = {
        team: [_robot(*at) for at in placed if at[0].kind == "robot" and at[0].team == team][
            :MAX_PER_KIND
        ]
        for team in ("yellow", "blue")
    }
    balls = [_ball(*at) for at in placed if at[0].kind == "ball"][:MAX_PER_KIND]
    frame = build(
        SSL_DetectionFrame,
        frame_number=(detections.frame or 0) % 2**32,
        t_capture=detections.time_s or sent_s,
        t_sent=sent_s,
        camera_id=camera_number,
        balls=balls,
        robots_yellow=robots["yellow"],
        robots_blue=robots["blue"],
    )
    return encode(SSL_WrapperPacket(detection=frame, source=SSL_Source.OTHER))


def _ball(item: Detection, x_mm: float, y_mm: float) -> SSL_DetectionBall:
    return build(
        SSL_DetectionBall,
        confidence=item.confidence,
        area=max(0, round(item.area_px)),
        x=x_mm,
        y=y_mm,
        z=item.z_mm,
        pixel_x=item.pixel[0],
        pixel_y=item.pixel[1],
    )


def _robot(item: Detection, x_mm: float, y_mm: float) -> SSL_DetectionRobot:
    return build(
        SSL_DetectionRobot,
        confidence=item.confidence,
        robot_id=item.id,
        x=x_mm,
        y=y_mm,
        orientation=item.orientation_rad,
        pixel_x=item.pixel[0],
        pixel_y=item.pixel[1],
        height=item.z_mm,
    )


Jacobians = NDArray[np.float64]  # (n, 2, 2)


@dataclass(frozen=True, eq=False)
class FieldLocator:
    """model: a camera model, or None where there is no calibration: a pixel then is mm_per_px everywhere.

    eye_mm: the camera's position, given by hand for a model without rays, so that heights count.
    has_rays: the model can unproject to any height.
    """

    image_size: ImageSize
    model: Any = None
    flat_mm_per_px: float = 1.0
    eye_mm: tuple[float, float, float] | None = None
    has_rays: bool = False

    @classmethod
    def of(cls, model: Any, eye_mm: tuple[float, float, float] | None = None) -> Self:
        return cls(model.image_size, model, eye_mm=eye_mm, has_rays=isinstance(model, RayModel))

    @classmethod
    def flat(cls, image_size: ImageSize, mm_per_px: float) -> Self:
        """Without a calibration: sizes follow the given scale, and there are no field places."""
        return cls(image_size, None, mm_per_px)

    @property
    def knows_heights(self) -> bool:
        return self.has_rays or self.eye_mm is not None

    def field_from_raw(self, pixels: Points, z_mm: float | Array = 0.0) -> Points:
        """(..., 2) px to (..., 2) mm in the plane at z_mm, one or (...); on the carpet if heights are unknown; NaN out
        of reach."""
        pixels = np.asarray(pixels, float)
        if self.model is None:
            return (pixels - np.array(self.image_size.centre)) * (
                self.flat_mm_per_px,
                -self.flat_mm_per_px,
            )
        if self.has_rays:
            return self.model.unproject(pixels, z_mm)
        carpet = self.model.field_from_corrected(self.model.corrected_from_raw(pixels))
        if self.eye_mm is None:
            return carpet
        # The line of sight meets height z that share of the way from the carpet to the eye.
        return carpet + (np.array(self.eye_mm[:2]) - carpet) * (
            np.asarray(z_mm)[..., None] / self.eye_mm[2]
        )

    def spread(self, pixels: Points, z_mm: float | Array = 0.0) -> tuple[Points, Jacobians]:
        """Places of (n, 2) pixels at z_mm, one or (n,), and the derivative of (x, y) mm by (x, y) px."""
        pixels = np.asarray(pixels, float).reshape(-1, 2)
        steps = np.array([(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)]) * _STEP_PX
        found = self.field_from_raw(pixels[:, None] + steps, np.asarray(z_mm)[..., None])
        across, down = (
            (found[:, 1] - found[:, 2]) / (2 * _STEP_PX),
            (found[:, 3] - found[:, 4]) / (2 * _STEP_PX),
        )
        return found[:, 0], np.stack([across, down], axis=-1)

    def scale(self, pixels: Points) -> NDArray[np.float64]:
        """About how many mm a pixel is on the carpet, (n,), from a coarse table; NaN out of reach."""
        at = (
            np.asarray(pixels, float)
            / (np.array(tuple(self.image_size)) - 1)
            * (np.array(_GRID) - 1)
        )
        columns, rows = np.clip(np.rint(at), 0, np.array(_GRID) - 1).astype(int).T
        return self._scales[rows, columns]

    @cached_property
    def _scales(self) -> NDArray[np.float64]:
        w, h = self.image_size
        grid = np.stack(
            np.meshgrid(np.linspace(0, w - 1, _GRID[0]), np.linspace(0, h - 1, _GRID[1])), axis=-1
        )
        turns = self.spread(grid.reshape(-1, 2))[1]
        return np.sqrt(np.abs(np.linalg.det(np.nan_to_num(turns)))).reshape(_GRID[1], _GRID[0])
