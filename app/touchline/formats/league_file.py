"""What the league's own programs keep in files: a field, its markings by their rules, and cameras over it by number.

ssl-vision's settings (ssl_settings.py) and vision-processor's geometry (vision_processor.py) are read as one of these.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

from touchline.core.field import Field
from touchline.formats.camera_file import CameraFile, chosen_camera
from touchline.formats.numbers import format_error
from touchline.formats.ssl_field import field_from_wire
from touchline.ssl_protocol.ssl_vision_pb2 import (
    SSL_FieldCircularArc,
    SSL_FieldLineSegment,
    SSL_GeometryFieldSize,
    SSL_GeometryModels,
    Vector2f,
)

BALL_MODELS = "The file's ball models are not part of a calibration: open the file on the page Publishing, too."


@dataclass(frozen=True)
class LeagueFile:
    """program, title: as CameraFile has it, and for people. sent: the field.

    cameras: by number, how each is read over the file's field; its numbers may be wrong. models: reads
    those of the ball; None where there are none.
    """

    program: str
    title: str
    sent: SSL_GeometryFieldSize
    cameras: Mapping[str, Callable[[Field], CameraFile]]
    models: Callable[[], SSL_GeometryModels] | None = None

    def camera(self, entry: str | None) -> CameraFile:
        """Return the camera of that number, or the only one; BadInput where the file has none."""
        if not self.cameras:
            raise format_error(
                f"The file ({self.title}) contains a field, but no camera.",
                "Import the field on the page Field, or use a file with a camera.",
            )
        read = self.cameras[chosen_camera(self.cameras, entry, self.title)]
        found = read(field_from_wire(self.sent))
        return found if self.models is None else replace(found, notes=(*found.notes, BALL_MODELS))


@dataclass(frozen=True)
class Markings:
    """Which of the markings that both programs make of a field's dimensions there are; the borders always are."""

    halfway: bool = True
    goal_to_goal: bool = True
    penalty: bool = True
    centre_circle: bool = True

    def arcs(self, sent: SSL_GeometryFieldSize, width_mm: float) -> list[SSL_FieldCircularArc]:
        if not self.centre_circle:
            return []
        return [
            SSL_FieldCircularArc(
                name="CenterCircle",
                center=Vector2f(x=0, y=0),
                radius=sent.center_circle_radius,
                a1=0,
                a2=6.283185,  # as the league's programs write it
                thickness=width_mm,
                type="CenterCircle",
            )
        ]

    def lines(self, sent: SSL_GeometryFieldSize) -> Iterator[SSL_FieldLineSegment]:
        x, y = sent.field_length / 2, sent.field_width / 2
        x_area, y_area = x - sent.penalty_area_depth, sent.penalty_area_width / 2

        def line(name: str, x1: float, y1: float, x2: float, y2: float) -> SSL_FieldLineSegment:
            return SSL_FieldLineSegment(
                name=name,
                p1=Vector2f(x=x1, y=y1),
                p2=Vector2f(x=x2, y=y2),
                thickness=sent.line_thickness,
                type=name,
            )

        yield line("TopTouchLine", -x, y, x, y)
        yield line("BottomTouchLine", -x, -y, x, -y)
        yield line("LeftGoalLine", -x, -y, -x, y)
        yield line("RightGoalLine", x, -y, x, y)
        if self.halfway:
            yield line("HalfwayLine", 0, -y, 0, y)
        if self.goal_to_goal:
            yield line("CenterLine", -x, 0, x, 0)
        if self.penalty:
            yield line("LeftPenaltyStretch", -x_area, -y_area, -x_area, y_area)
            yield line("RightPenaltyStretch", x_area, -y_area, x_area, y_area)
            yield line("LeftFieldLeftPenaltyStretch", -x, -y_area, -x_area, -y_area)
            yield line("LeftFieldRightPenaltyStretch", -x, y_area, -x_area, y_area)
            yield line("RightFieldLeftPenaltyStretch", x_area, y_area, x, y_area)
            yield line("RightFieldRightPenaltyStretch", x_area, -y_area, x, -y_area)
