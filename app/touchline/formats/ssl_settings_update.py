"""ssl-vision's settings with another geometry: its field, ball models and cameras, and all else as it was in the file.

ssl-vision reads a number up to a sign that is not its system's, so the file's decimal sign is used. It writes six
decimals and reads any number of them: here a number has as many as the packet's needs, and ssl-vision then sends the
same packet. At its start it makes the markings of its dimensions, and of those only changes the ones in its settings.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from xml.sax.saxutils import escape, quoteattr

import numpy as np

from touchline.core.errors import Conflict
from touchline.core.statements import Sentence, say
from touchline.formats.document import parse
from touchline.formats.league_file import Markings
from touchline.formats.numbers import DECIMAL_COMMA, NUMBER, format_error
from touchline.formats.ssl_settings import (
    BOUNDARIES,
    CHIP,
    DIMENSIONS,
    GOAL_BOUNDARY,
    MAX_CAMERAS,
    OTHER_DIMENSIONS,
    SSL_NUMBERS,
    STRAIGHT,
    USES_OPENCV,
    league_file,
)
from touchline.formats.xml_edit import Element, XmlEdit
from touchline.ssl_protocol.ssl_vision_pb2 import (
    SSL_FieldCircularArc,
    SSL_FieldLineSegment,
    SSL_FieldShapeType,
    SSL_GeometryCameraCalibration,
    SSL_GeometryFieldSize,
    SSL_GeometryModels,
)

WIRE_NAMES = (
    *("focal_length", "principal_point_x", "principal_point_y", "distortion"),
    *("q0", "q1", "q2", "q3", "tx", "ty", "tz"),
)
CAMERA_NUMBERS = dict(zip(WIRE_NAMES, SSL_NUMBERS, strict=True))
IMAGE_SIZE = {"pixel_image_width": "Image width", "pixel_image_height": "Image height"}
LINES, ARCS = "Field Lines", "Field Arcs"
COUNTS = {LINES: "Number of Line Segments", ARCS: "Number of Arcs"}
CENTRE_LINE, CENTRE_LINE_NAME = "Center Line", "CenterLine"
TOTAL = "Total Number of Cameras"  # ssl-vision sends those with a number below it
Value = float | str | bool


@dataclass(frozen=True)
class UpdatedSettings:
    """The file, the numbers of the cameras that were replaced in it, and what its operator should know."""

    data: bytes
    cameras: tuple[int, ...]
    notes: tuple[Sentence, ...]


def updated_settings(
    data: bytes,
    field: SSL_GeometryFieldSize,
    cameras: Sequence[SSL_GeometryCameraCalibration],
    models: SSL_GeometryModels | None = None,
) -> UpdatedSettings:
    """Return the settings with this field, these cameras and ball models, by the message's numbers.

    BadInput where the file is not ssl-vision's settings or damaged; Conflict where it has none of the cameras, or its
    version takes no such value. Only settings that the file has are replaced: others its version does not know.
    """
    if league_file(parse(data)) is None:
        raise format_error(
            "The file is not the settings of ssl-vision.",
            "Use the file robocup-ssl.xml of ssl-vision.",
        )
    return _Update(data).update(field, cameras, models)


class _Update:
    def __init__(self, data: bytes) -> None:
        self._edit = XmlEdit(data)
        self._has_comma = self._find_comma()
        self._absent: list[str] = []  # settings of ours that the file lacks

    def update(
        self,
        field: SSL_GeometryFieldSize,
        cameras: Sequence[SSL_GeometryCameraCalibration],
        models: SSL_GeometryModels | None,
    ) -> UpdatedSettings:
        settings = self._edit.root.child("Global", "Field Configuration")
        assert settings is not None  # as league_file() has seen
        calibrators = self._calibrators()
        found = [one for one in cameras if one.camera_id in calibrators]
        if not found:
            raise _no_camera(calibrators, cameras)
        were_opencv = [
            one.camera_id
            for one in found
            for calibrator in calibrators[one.camera_id]
            if self._set_camera(calibrator, one)
        ]
        made = self._set_field(settings, field)
        if models is not None:
            self._set_models(settings, models)
        numbers = tuple(sorted(one.camera_id for one in found))
        notes = [
            _replaced(numbers, models),
            *_about_cameras(calibrators, cameras),
        ]
        total = self._whole(settings.child(TOTAL))
        if total is not None and (above := [number for number in numbers if number >= total]):
            notes.append(
                say(
                    "ssl-settings.above-total",
                    "SSL-Vision sends only cameras with numbers below its setting {setting}, "
                    "{total}. Increase it there for: {numbers}.",
                    setting=TOTAL,
                    total=total,
                    numbers=above,
                )
            )
        if were_opencv:
            notes.append(
                say(
                    "ssl-settings.was-opencv",
                    "These cameras had OpenCV's lens model and now have SSL-Vision's: {numbers}.",
                    numbers=sorted(set(were_opencv)),
                )
            )
        if made:
            notes.append(
                say(
                    "ssl-settings.makes-itself",
                    "At each start SSL-Vision adds these markings, which the field has not: {names}.",
                    names=made,
                )
            )
        if self._absent:
            notes.append(
                say(
                    "ssl-settings.absent",
                    "This version of SSL-Vision has no such settings, so they were not written: "
                    "{names}.",
                    names=self._absent,
                )
            )
        return UpdatedSettings(self._edit.result(), numbers, tuple(notes))

    def _find_comma(self) -> bool:
        """Tell whether the file's numbers have a decimal comma: most of them, where someone has mixed both."""
        numbers = [
            self._edit.text(one)
            for one in self._edit.root.below()
            if one.attributes.get("type") == "double"
        ]
        commas = sum(DECIMAL_COMMA.fullmatch(text) is not None for text in numbers)
        return commas > sum("." in text for text in numbers)

    def _calibrators(self) -> dict[int, list[Element]]:
        """Return every camera calibrator of the file by its camera number."""
        found: dict[int, list[Element]] = {}
        for i in range(MAX_CAMERAS):
            calibrator = self._edit.root.child(f"Thread {i}", "Camera Calibrator")
            if calibrator is None or calibrator.child("Camera Parameters") is None:
                continue
            index = self._whole(calibrator.child("Calibration Parameters", "camera index"))
            found.setdefault(i if index is None else index, []).append(calibrator)
        return found

    def _whole(self, element: Element | None) -> int | None:
        """Return an element's whole number, 0 or more; None where it has none."""
        text = "" if element is None else self._edit.text(element)
        return int(text) if text.isascii() and text.isdigit() and len(text) < 10 else None

    def _set_camera(self, calibrator: Element, sent: SSL_GeometryCameraCalibration) -> bool:
        """Write one camera; tell whether it was of OpenCV's model."""
        parameters = calibrator.child("Camera Parameters")
        assert parameters is not None  # as _calibrators() has seen
        for wire, called in CAMERA_NUMBERS.items():
            if parameters.child(called) is None:
                raise format_error(
                    f"Camera {sent.camera_id} of the file has no setting {called!r}.",
                    "Save the settings with ssl-vision again.",
                )
            self._set(parameters, called, getattr(sent, wire), f"camera {sent.camera_id}")
        about = calibrator.child("Calibration Parameters")
        for wire, called in IMAGE_SIZE.items():
            if about is not None and sent.HasField(wire):
                self._set(about, called, getattr(sent, wire), f"camera {sent.camera_id}")
        chosen = parameters.child(USES_OPENCV)
        was_opencv = chosen is not None and self._edit.text(chosen) == "true"
        if was_opencv:
            self._set(parameters, USES_OPENCV, False)
        return was_opencv

    def _set_field(self, settings: Element, field: SSL_GeometryFieldSize) -> list[str]:
        """Write the field; return the names of the markings that ssl-vision adds to it."""
        called = {name: called for name, (called, _) in DIMENSIONS.items()} | OTHER_DIMENSIONS
        touch = next((name for name in BOUNDARIES if settings.child(name)), BOUNDARIES[0])
        called["boundary_width"] = touch
        if settings.child(GOAL_BOUNDARY) or field.boundary_width_goal_line != field.boundary_width:
            called["boundary_width_goal_line"] = GOAL_BOUNDARY
        for wire, title in called.items():
            if field.HasField(wire):
                self._set(settings, title, getattr(field, wire))
        names = [line.name for line in field.field_lines]
        if settings.child(CENTRE_LINE):
            self._set(settings, CENTRE_LINE, CENTRE_LINE_NAME in names)
        self._set_list(settings, LINES, {one.name: _line(one) for one in field.field_lines})
        self._set_list(settings, ARCS, {one.name: _arc(one) for one in field.field_arcs})
        makes = Markings()
        given = {*names, *(arc.name for arc in field.field_arcs)}
        made = [line.name for line in makes.lines(field)]
        made += [arc.name for arc in makes.arcs(field, 0)]
        return [name for name in made if name not in given]

    def _set_list(
        self, settings: Element, title: str, markings: Mapping[str, Mapping[str, Value]]
    ) -> None:
        """Write lines or arcs: those of the file by their names, and those that it lacks after them."""
        parent = settings.child(title)
        if parent is None:
            self._absent.append(title)
            return
        known: set[str] = set()
        for element in parent.children:
            values = markings.get(element.name)
            has = {child.name for child in element.children}
            if values is None or element.name in known or has != {*values}:
                self._edit.remove(element)
                continue
            known.add(element.name)
            for name, value in values.items():
                self._set(element, name, value)
        self._edit.append(
            parent,
            [
                (parent.line_break or b"\n") + b"\t" + self._marking(name, values).encode()
                for name, values in markings.items()
                if name not in known
            ],
        )
        if settings.child(COUNTS[title]):
            self._set(settings, COUNTS[title], len(markings))

    def _set_models(self, settings: Element, models: SSL_GeometryModels) -> None:
        for member, called, names in (
            ("straight_two_phase", "Straight Two-Phase", STRAIGHT),
            ("chip_fixed_loss", "Chip fix loss", CHIP),
        ):
            if not models.HasField(member):
                continue
            parent = settings.child("Models", called)
            if parent is None:
                self._absent.append(called)
                continue
            for wire, title in names.items():
                value = getattr(getattr(models, member), wire)
                self._set(parent, title, value, "the ball", np.float64)

    def _set(
        self,
        parent: Element,
        name: str,
        value: Value,
        of: str = "the field",
        sent_as: type[np.floating] = np.float32,
    ) -> None:
        """Write one setting; Conflict where its limits exclude the value, to which ssl-vision would then limit it."""
        found = parent.all(name)
        if not found:
            self._absent.append(name)
        for element in found:
            if isinstance(value, (str, bool)):
                self._edit.set_text(element, value if isinstance(value, str) else _truth(value))
                continue
            low, high = (
                self._number(element.attributes.get(end, "")) for end in ("minval", "maxval")
            )
            if (low is not None and value < low) or (high is not None and value > high):
                raise Conflict(
                    say(
                        "ssl-settings.out-of-range",
                        "SSL-Vision limits {setting} to {low} … {high}; {of} has {value:g}.",
                        setting=name,
                        low="−∞" if low is None else low,
                        high="∞" if high is None else high,
                        of=of,
                        value=value,
                    ),
                    say(
                        "ssl-settings.publish-instead",
                        "Publish the geometry with Touchline instead.",
                    ),
                    reason="format-cannot-hold",
                )
            present = self._number(self._edit.text(element))
            if present is None or sent_as(present) != sent_as(value):
                kind = element.attributes.get("type")
                self._edit.set_text(element, self._digits(kind, sent_as(value)))

    def _number(self, text: str) -> float | None:
        text = text.replace(",", ".") if self._has_comma else text
        return float(text) if len(text) < 400 and NUMBER.fullmatch(text) else None

    def _digits(self, kind: str | None, value: np.floating) -> str:
        """Return a number as ssl-vision writes it, with more than six decimals where it needs them."""
        if kind == "int":
            return str(round(float(value)))
        text = np.format_float_positional(value, unique=True, min_digits=6)
        return text.replace(".", ",") if self._has_comma else text

    def _marking(self, name: str, values: Mapping[str, Value]) -> str:
        """Return a line or arc that the file lacks, as an element."""
        parts = "".join(
            f"<Var name={quoteattr(each)} {_kind(each, value)}>{self._shown(value)}</Var>"
            for each, value in values.items()
        )
        return f'<Var name={quoteattr(name)} type="list">{parts}</Var>'

    def _shown(self, value: Value) -> str:
        return (
            escape(value) if isinstance(value, str) else self._digits("double", np.float32(value))
        )


def _kind(name: str, value: Value) -> str:
    if not isinstance(value, str):
        return 'type="double" minval="" maxval=""'
    return f'type="{"stringenum" if name == "Type" else "string"}"'


def _line(line: SSL_FieldLineSegment) -> dict[str, Value]:
    return {
        **_called(line.name, line.type),
        "P1.x": line.p1.x,
        "P1.y": line.p1.y,
        "P2.x": line.p2.x,
        "P2.y": line.p2.y,
        "Line thickness": line.thickness,
    }


def _arc(arc: SSL_FieldCircularArc) -> dict[str, Value]:
    return {
        **_called(arc.name, arc.type),
        "Center.x": arc.center.x,
        "Center.y": arc.center.y,
        "Radius": arc.radius,
        "Start angle": arc.a1,
        "End angle": arc.a2,
        "Line thickness": arc.thickness,
    }


def _called(name: str, kind: int) -> dict[str, Value]:
    return {"Name": name, "Type": SSL_FieldShapeType.Name(kind)}


def _truth(value: bool) -> str:
    return "true" if value else "false"


def _no_camera(
    calibrators: Iterable[int], cameras: Iterable[SSL_GeometryCameraCalibration]
) -> Conflict:
    return Conflict(
        say(
            "ssl-settings.no-camera",
            "The file has none of the published cameras: it has {has}, and {ours} are published.",
            has=sorted(calibrators),
            ours=sorted(one.camera_id for one in cameras),
        ),
        say(
            "ssl-settings.change-numbers",
            "Change the camera numbers on the page Publishing, or use the file of the computer "
            "that has these cameras.",
        ),
        reason="no-such-camera",
    )


def _replaced(numbers: Sequence[int], models: SSL_GeometryModels | None) -> Sentence:
    if models is None:
        return say(
            "ssl-settings.replaced",
            "Replaced: the field, and the cameras with these numbers: {numbers}.",
            numbers=numbers,
        )
    return say(
        "ssl-settings.replaced-models",
        "Replaced: the field, the ball models, and the cameras with these numbers: {numbers}.",
        numbers=numbers,
    )


def _about_cameras(
    calibrators: Mapping[int, object], cameras: Sequence[SSL_GeometryCameraCalibration]
) -> Iterator[Sentence]:
    """Say which cameras of the file are as they were, and which are not in it."""
    ours = {one.camera_id for one in cameras}
    if others := sorted({*calibrators} - ours):
        yield say(
            "ssl-settings.unchanged",
            "Unchanged, as they are not published: the cameras with these numbers: {numbers}.",
            numbers=others,
        )
    if absent := sorted(ours - {*calibrators}):
        yield say(
            "ssl-settings.not-in-file",
            "Not in the file: the cameras with these numbers: {numbers}. Change their numbers on "
            "the page Publishing, or also update the file of the computer that has them.",
            numbers=absent,
        )
