"""Export to and import from other programs' files.

Export: the camera that the format can hold, written, read back by our own reader, and its error in millimetres.
Import: the reader that recognises the file, then a calibration where the file holds a pose, else a lens.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import count
from typing import Any, TypeGuard

import numpy as np

from touchline.core.errors import BadInput, NotFound, TouchlineError
from touchline.core.field import QUARTER_TURNS, Field, Region
from touchline.core.field_json import field_from_json
from touchline.core.geometry import ImageSize, inside_picture
from touchline.core.jobs import Progress, no_progress
from touchline.core.json_values import IMPORTED
from touchline.core.quarter_turn import QuarterTurn, turn_in_words
from touchline.core.records import Calibration, Fit, Observations, Warning
from touchline.core.statements import named, say, stated
from touchline.evaluate.approximation import ApproximationError, approximation_error
from touchline.evaluate.report import report
from touchline.fitting.contract import corrected_rectangle
from touchline.formats import FORMATS, camera_file, ssl_settings, ssl_vision, vision_processor
from touchline.formats.approximation import exact_camera, export_camera
from touchline.formats.camera_file import LENSES_WITH_FISHEYE, CameraFile, required_size
from touchline.formats.document import parse
from touchline.formats.league_file import LeagueFile
from touchline.formats.numbers import format_error
from touchline.formats.program_forms import PROGRAMS
from touchline.formats.ssl_field import field_from_wire, field_to_wire
from touchline.formats.vision_processor_start import AreaCorners
from touchline.installation import __version__
from touchline.models import model_of, parameters_json
from touchline.models.contract import RECTANGLE_FIELDS
from touchline.ssl_protocol.protobuf import decode
from touchline.ssl_protocol.ssl_vision_pb2 import (
    SSL_GeometryData,
    SSL_GeometryFieldSize,
    SSL_GeometryModels,
    SSL_WrapperPacket,
)
from touchline.workflows.calibration_request import CalibrationRequest
from touchline.workflows.turning import turned_calibration

EXACT_MM = 1e-6  # less is rounding
NO_OPTIONS = dict.fromkeys(
    ("n_rectangles_x", "n_rectangles_y", "w_max_rectangle_px", "h_max_rectangle_px")
)
MAX_TABLE_POINTS = 3000  # of another program's table, which is fitted at once: some seconds
# the note of a calibration that is fitted to a file's points, and its model where none is stated
POINTS = ("Fitted to imported points.", "polynomial")
CORNERS = ("Fitted to the four corners of an imported config.yml.", "homography")
GRID = 41  # places each way by which a region is told from what a camera sees


@dataclass(frozen=True)
class ExportedFile:
    """A file to be sent. loss: the error that its reader will have; None where it is exact."""

    data: bytes
    name: str
    media_type: str
    loss: ApproximationError | None = None


@dataclass(frozen=True)
class ImportOptions:
    """What the caller states about an imported file, beside what it holds itself; None where nothing is stated."""

    field: str | None = None
    region: str | None = None
    rotate: int | None = None
    image_size: ImageSize | None = None
    camera: str | None = None
    camera_id: int | None = None  # of a packet with several
    model: str | None = (
        None  # to fit to a table of points, or of a lens that the file does not state
    )
    entry: str | None = None  # the camera of a file with several
    turn: int = 0  # by which the pictures were turned clockwise since the file; image_size is the one afterwards

    @property
    def size_in_file(self) -> ImageSize | None:
        """Return the size of the pictures before they were turned."""
        size = self.image_size  # the one before swaps likewise
        return None if size is None else QuarterTurn(self.turn, size).size_after


def export(
    calibration: Calibration,
    format: str,
    approximate: bool = False,
    camera_id: int | None = None,
    progress: Progress = no_progress,
) -> ExportedFile:
    """Write the calibration as a file of that format; Conflict where that takes `approximate`."""
    kind = FORMATS[format]
    name = f"{calibration.camera or calibration.field['name']}-v{calibration.version}{kind.suffix}"
    if kind.read is None or not kind.lenses:
        return ExportedFile(kind.write(calibration, progress), name, kind.media_type)
    camera = export_camera(calibration, kind, approximate, camera_id)
    data = kind.write(calibration, camera)
    field = field_from_json(calibration.field)
    back = kind.read(data).camera({name: getattr(camera.camera, name) for name in RECTANGLE_FIELDS})
    loss = approximation_error(
        model_of(calibration),
        back,
        field.region(calibration.region, calibration.rotate),
        field.hat_height_mm,
    )
    exact = camera.loss is None and loss.worst_at_any_height_mm < EXACT_MM
    return ExportedFile(data, name, kind.media_type, None if exact else loss)


def formats(calibration: Calibration) -> list[dict[str, Any]]:
    """List every format, whether it holds this calibration exactly, and its error where it must approximate; JSON."""
    model = model_of(calibration)
    return [_format(calibration, model, name) for name in FORMATS]


def _format(calibration: Calibration, model: Any, name: str) -> dict[str, Any]:
    kind = FORMATS[name]
    entry = stated(
        {
            "format": name,
            "title": named(f"format.{name}", kind.title),
            "holds": named(f"format.{name}.holds", kind.holds),
            "suffix": kind.suffix,
            "reads": kind.read is not None,
            "exact": True,
            "loss": None,
            "problem": None,
        }
    )
    if not kind.lenses:
        return entry
    exact = exact_camera(model, kind.lenses, kind.square_pixels) is not None
    try:
        loss = export(calibration, name, approximate=True).loss
    except TouchlineError as refused:
        return {
            **entry,
            "exact": exact,
            "problem": stated({"what": refused.what, "fix": refused.fix}),
        }
    return {**entry, "exact": exact, "loss": None if loss is None else loss.to_json()}


def read_file(
    data: bytes, options: ImportOptions = ImportOptions()
) -> Calibration | CameraFile | Observations | AreaCorners:
    """Read a file. Its bytes alone say what it is; the caller states what they do not."""
    entry = options.entry
    if entry is None and options.camera_id is not None:
        entry = str(options.camera_id)
    for kind in FORMATS.values():
        if kind.read is not None and kind.recognises is not None and kind.recognises(data):
            return kind.read(data, entry) if kind.lenses else kind.read(data)
    document = parse(data)
    if (settings := ssl_settings.league_file(document)) is not None:
        return settings.camera(entry)
    lens = options.model if options.model in LENSES_WITH_FISHEYE else None
    return camera_file.camera_of(document, data, options.entry, lens, options.size_in_file)


def league_field(data: bytes) -> SSL_GeometryFieldSize | None:
    """Return the field of a geometry packet, a geometry.yml or settings of ssl-vision; None for another file."""
    found = _league_file(data)
    if isinstance(found, LeagueFile):
        return found.sent
    return None if found is None else found.field


def ball_models(data: bytes) -> SSL_GeometryModels | None:
    """Return the ball models of such a file; None where it has none, BadInput where they are wrong."""
    found = _league_file(data)
    if isinstance(found, LeagueFile):
        return None if found.models is None else found.models()
    return found.models if found is not None and found.HasField("models") else None


def _league_file(data: bytes) -> LeagueFile | SSL_GeometryData | None:
    if ssl_vision.recognises(data):
        packet = decode(SSL_WrapperPacket, data)
        if not packet.HasField("geometry"):
            raise format_error("The packet contains no field.", "Use a packet with geometry.")
        return packet.geometry
    for kind in (vision_processor, ssl_settings):
        if kind.recognises(data) and (found := kind.league_file(parse(data))) is not None:
            return found
    return None


def calibration_from_file(
    found: CameraFile | Observations | AreaCorners,
    options: ImportOptions,
    fields: Mapping[str, Field],
) -> Calibration:
    """Make a calibration of another program's file; points are fitted. The store gives its id and date."""
    if isinstance(found, CameraFile):
        return _of_camera(found.turned(options.turn, options.image_size), options, fields)
    if isinstance(found, AreaCorners):
        return _of_corners(found, options, fields)
    if options.field is None or options.region is None or options.image_size is None:
        raise BadInput(
            say(
                "import.table-without-field",
                "The table contains points, but not their field, covered area and image size.",
            ),
            say(
                "import.enter-field",
                "Enter them. From a program, send field, region and image_size (as WIDTHxHEIGHT).",
            ),
            reason="no-field",
        )
    if sum(len(observation.points) for observation in found) > MAX_TABLE_POINTS:
        raise BadInput(
            say(
                "import.too-many-points",
                "The table has more than {most} points.",
                most=MAX_TABLE_POINTS,
            ),
            say("import.fewer-points", "Use a few hundred. More points do not improve the fit."),
            reason="too-many-points",
        )
    field = _known(fields, options.field)
    region = field.region(options.region, options.rotate)
    return _fitted(found, field, region, required_size(options.size_in_file), options, POINTS)


def _of_corners(
    found: AreaCorners, options: ImportOptions, fields: Mapping[str, Field]
) -> Calibration:
    """Make a calibration without a lens of the corners from which another program's calibration starts."""
    if options.field is None:
        raise _no_field()
    size = required_size(options.size_in_file or found.image_size)
    field = _known(fields, options.field)
    named = options.region
    region = found.region(field) if named is None else field.region(named, options.rotate)
    return _fitted(found.observations(region), field, region, size, options, CORNERS)


def _fitted(
    points: Observations,
    field: Field,
    region: Region,
    size: ImageSize,
    options: ImportOptions,
    of: tuple[str, str],
) -> Calibration:
    """Fit imported points. of: the note, and the model where the caller states none."""
    note, model = of
    request = CalibrationRequest(
        points, field, region, size, options.model or model, camera=options.camera, note=note
    )
    request.check_names((request.model,))
    return turned_as_stated(request.record(request.run()), options)


def turned_as_stated(calibration: Calibration, options: ImportOptions) -> Calibration:
    """Return a calibration for pictures that were turned since, as the caller states."""
    if not options.turn:
        return calibration
    about = f"The file was {turn_in_words(options.turn)}."
    return turned_calibration(calibration, options.turn, about)


def _no_field() -> BadInput:
    return BadInput(
        say("import.no-field", "The file does not state the field of the camera."),
        say("import.enter-field-name", "Select it. From a program, send it as field."),
        reason="no-field",
    )


def _program(found: CameraFile) -> str:
    known = PROGRAMS.get(found.program)
    return FORMATS[found.program].title if known is None else known[0]


def is_lens(found: object) -> TypeGuard[CameraFile]:
    """Whether a file holds a lens without a pose."""
    return isinstance(found, CameraFile) and found.pose is None


def lens_record_from_file(found: CameraFile, options: ImportOptions) -> dict[str, Any]:
    """Return a lens record like one from a board; its error is not known."""
    lens = found.turned(options.turn, options.image_size).at_size(options.image_size)
    known = lens.lens()
    note = " ".join([f"Imported from {_program(found)}.", *lens.notes])
    return {
        "camera": options.camera or found.metadata.camera,
        "note": note,
        "model": known.model,
        "lens": known.to_json(),
        "board": None,
        "image_size": list(known.image_size),
        "snapshots": None,
        "software": f"touchline {__version__}",
        "report": {
            "rms_px": None,
            "views": [],
            "warnings": [],
            "verdict": {"level": "unknown", "sentence": IMPORTED},
        },
    }


def _of_camera(
    given: CameraFile, options: ImportOptions, fields: Mapping[str, Field]
) -> Calibration:
    found = given.at_size(options.image_size)
    field = _field(found, options, fields)
    region = _region(found, options, field)
    view = _view(found, region)
    camera = found.camera(view)
    judged = report(Fit(camera, (), (), (_UNKNOWN,)), (), field, region, None)
    note = " ".join([f"Imported from {_program(found)}.", *found.notes])
    return Calibration(
        id="imported",
        version=1,
        camera=options.camera or found.metadata.camera,
        field=field.to_json(),
        region=region.name,
        rotate=region.rotate_deg,
        model_name=camera.NAME,
        model_parameters=parameters_json(camera),
        image_size=camera.image_size,
        corrected_size=camera.corrected_size,
        observations=(),
        options={},
        report=judged,
        created_at="",
        software=f"touchline {__version__}",
        note=note,
    )


_UNKNOWN = Warning(
    "imported",
    say("import.error-unknown", "This calibration was imported. Its error is unknown."),
    say("import.compare", "Mark the field lines in an image from this camera, and compare."),
)


def _field(found: CameraFile, options: ImportOptions, fields: Mapping[str, Field]) -> Field:
    if options.field is not None:
        return _known(fields, options.field)
    if found.field is not None:
        received = field_from_wire(field_to_wire(found.field), fields.values())
        free = (name for n in count(2) if (name := f"{received.name}-{n}") not in fields)
        return (
            received
            if received.name not in fields or fields[received.name] is received
            else replace(received, name=next(free))
        )
    if found.metadata.field is None:
        raise _no_field()
    return _known(fields, found.metadata.field)


def _known(fields: Mapping[str, Field], name: str) -> Field:
    if name not in fields:
        raise NotFound(
            say("import.unknown-field", "There is no field called {name!r} here.", name=name),
            say(
                "import.save-field",
                "Save the field here first, or select another. From a program, send its name as field.",
            ),
            reason="unknown-field",
        )
    return fields[name]


def _region(found: CameraFile, options: ImportOptions, field: Field) -> Region:
    """Return the region stated here or in the file; else the one nearest to what the camera sees, upright."""
    name = options.region or (
        found.metadata.region if found.metadata.region in field.regions else None
    )
    rotate = options.rotate if options.rotate is not None else found.metadata.rotate
    if name is not None:
        return field.region(name, rotate)
    x = np.linspace(-field.length_mm / 2, field.length_mm / 2, GRID)
    y = np.linspace(-field.width_mm / 2, field.width_mm / 2, GRID)
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    camera = found.camera(_view(found, next(iter(field.regions.values()))))
    pixels = camera.project(np.concatenate([places, np.zeros((len(places), 1))], axis=1))
    seen = inside_picture(pixels, camera.image_size)

    def share(region: Region) -> float:
        inside = (
            (places >= np.array([region.x_mm[0], region.y_mm[0]]))
            & (places <= np.array([region.x_mm[1], region.y_mm[1]]))
        ).all(axis=1)
        return float((inside & seen).sum() / max(1, (inside | seen).sum()))

    best = max(field.regions.values(), key=share)
    if rotate is None:
        right = camera.camera_from_field[0, :2]
        # they run to the picture's right
        tops = {turn: best.rotated(turn).border("top") for turn in QUARTER_TURNS}
        rotate = max(
            QUARTER_TURNS,
            key=lambda turn: float(np.subtract(tops[turn].end, tops[turn].start) @ right),
        )
    return best.rotated(rotate)


def _view(found: CameraFile, region: Region) -> dict[str, Any]:
    size = found.known_size
    drawn = found.metadata.rectangle or corrected_rectangle(NO_OPTIONS, region, size)
    return dict(zip(RECTANGLE_FIELDS, (*drawn, region, size), strict=True))


def size_from_text(text: str) -> ImageSize:
    """1280x1024; BadInput for anything else."""
    found = re.fullmatch(r"\s*([0-9]{1,5})\s*[x×X]\s*([0-9]{1,5})\s*", text)
    if found is None:
        raise BadInput(
            say("import.bad-image-size", "{text!r} is not an image size.", text=text[:40]),
            say("import.image-size-form", "Write it as 1280x1024."),
            reason="bad-image-size",
        )
    return ImageSize.of((int(found[1]), int(found[2])))
