"""A camera read from a file, checked, and in OpenCV's numbers, which ROS, mrcal, Kalibr and PhotonVision follow."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from touchline.core.errors import BadInput, Conflict
from touchline.core.field import Field
from touchline.core.geometry import Array, ImageSize, as_triple
from touchline.core.json_values import JsonObject
from touchline.core.quarter_turn import QuarterTurn, turn_in_words
from touchline.core.statements import say
from touchline.formats.approximation import (
    CameraPose,
    Metadata,
    checked_pose,
    metadata_from_comment,
    metadata_from_json,
)
from touchline.formats.document import FileContent, parse
from touchline.formats.numbers import flat_numbers, format_error, number, numbers
from touchline.formats.other_lenses import stated_as_fisheye
from touchline.formats.program_forms import PROGRAMS, cameras_in
from touchline.formats.stated_camera import StatedCamera, stated_camera
from touchline.models.intrinsics import Intrinsics
from touchline.models.lenses.brown_conrady import TERMS
from touchline.models.lenses.kannala_brandt import TERMS as FISHEYE_TERMS
from touchline.models.ray_camera import RayCamera, lens_model
from touchline.models.rotation import matrix_from_vector, vector_from_matrix

LENSES = {"brown-conrady": TERMS}
LENSES_WITH_FISHEYE = {**LENSES, "fisheye": FISHEYE_TERMS}

MAX_FOCAL_PX = 1e6
MM_PER_M = 1000.0  # of mrcal's lengths
MAX_LISTED = 8  # in a sentence
NO_METADATA = Metadata()
NEAR = 0.1  # of the shorter side
BORDER = np.linspace(0, 1, 17)  # places along a side of the image where its lens is tried


def intrinsics_of(camera: RayCamera) -> tuple[float, float, float, float]:
    """Return fx, fy, cx, cy in px."""
    return camera.focal_px, camera.focal_px * camera.aspect, *camera.centre_px


def matrix_of(camera: RayCamera) -> tuple[float, ...]:
    """Return the camera matrix, row by row."""
    fx, fy, cx, cy = intrinsics_of(camera)
    return fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0


def translation_of(camera: RayCamera) -> Array:
    """Return the translation in mm that, with the rotation, takes field coordinates to the camera."""
    return np.asarray(
        -matrix_from_vector(np.array(camera.rotation)) @ np.array(camera.position_mm), np.float64
    )


def pose_from_field(rotation: tuple[float, ...], translation_mm: Array) -> CameraPose:
    """Return the pose of rotation and translation from field coordinates to the camera."""
    number(float(np.linalg.norm(rotation)), "The camera's rotation", 0, 10)
    return checked_pose(rotation, -matrix_from_vector(np.array(rotation)).T @ translation_mm)


def lens_terms(camera: RayCamera) -> tuple[float, ...]:
    """Return the four terms of a fisheye, else the first five or eight that leave out zeros alone."""
    return camera.lens_terms if camera.NAME == "fisheye" else trim_terms(camera.lens_terms)


def trim_terms(terms: tuple[float, ...], counts: tuple[int, ...] = (5, 8)) -> tuple[float, ...]:
    """Return the fewest terms, one of `counts`, that leave out zeros alone."""
    return next(terms[:n] for n in counts if not any(terms[n:]))


def lens_from_terms(
    terms: tuple[float, ...], at: str, fisheye: bool = False
) -> tuple[str, tuple[float, ...]]:
    """Return the model's name and all its terms; BadInput for terms that our lens lacks, such as thin prism."""
    if fisheye:
        return "fisheye", terms
    if any(terms[len(TERMS) :]):
        raise format_error(
            f"{at} has terms beyond k6 (thin prism or tilt), which are not supported.",
            "Calibrate with at most eight terms.",
        )
    return "brown-conrady", (*terms[: len(TERMS)], *(0.0,) * (len(TERMS) - len(terms)))


@dataclass(frozen=True)
class CameraFile:
    """One camera of a file.

    program: a name in PROGRAMS or FORMATS. model: a name in MODELS, whose lens has these terms. image_size: None where
    the file does not tell. pose: only with a known field, which metadata or field names.
    """

    program: str
    model: str
    terms: tuple[float, ...]
    focal_px: tuple[float, float]
    centre_px: tuple[float, float]
    image_size: ImageSize | None
    metadata: Metadata = NO_METADATA
    pose: CameraPose | None = None
    field: Field | None = None  # where the file describes it itself
    notes: tuple[str, ...] = ()  # what was ignored, for people

    def __post_init__(self) -> None:
        for axis, focal, centre in zip("xy", self.focal_px, self.centre_px, strict=True):
            number(focal, f"The focal length f{axis}", 1e-3, MAX_FOCAL_PX)
            number(centre, f"The centre c{axis}")
        number(self.aspect, "fy / fx", 0.5, 2)
        if len(self.terms) != len(lens_model(self.model).LENS.TERMS):
            raise format_error("The lens has too many or too few terms.", "Correct the file.")

    @property
    def aspect(self) -> float:
        return self.focal_px[1] / self.focal_px[0]

    @property
    def known_size(self) -> ImageSize:
        """Return the image size; BadInput where the file does not tell."""
        return required_size(self.image_size)

    def at_size(self, wanted: ImageSize | None) -> Self:
        """Scale to another image size: an image scaled by s has s times the focal length, and its centre likewise.

        Conflict where the file is of a picture of another shape, BadInput where nobody says the size.
        """
        old, wanted = self.image_size, wanted or self.known_size
        if wanted == old:
            return self
        if old is None:
            return replace(self, image_size=wanted)
        if old.width * wanted.height != old.height * wanted.width:
            raise Conflict(
                f"The file is for images of {old}, not of {wanted}.",
                "Use that size, or one with the same aspect ratio.",
                reason="size-mismatch",
            )
        s = wanted.width / old.width
        return replace(
            self,
            image_size=wanted,
            focal_px=(self.focal_px[0] * s, self.focal_px[1] * s),
            centre_px=(s * (self.centre_px[0] + 0.5) - 0.5, s * (self.centre_px[1] + 0.5) - 0.5),
            metadata=replace(self.metadata, rectangle=None),
            notes=(
                *self.notes,
                f"The file was for images of {old}. Focal length and centre were scaled.",
            ),
        )

    def turned(self, turn_deg: int, wanted: ImageSize | None) -> Self:
        """Turn the picture clockwise. wanted: its size afterwards, for a file that does not state its own."""
        if not turn_deg:
            return self
        size = self.image_size or (wanted and QuarterTurn(turn_deg, wanted).size_after)
        turn = QuarterTurn(turn_deg, self.at_size(size).known_size)
        focal_x, aspect, centre = turn.pinhole(self.focal_px[0], self.aspect, self.centre_px)
        terms = lens_model(self.model).LENS.turned(np.array(self.terms), turn.matrix)
        pose = self.pose
        if pose is not None:
            camera = turn.about_axis @ matrix_from_vector(np.array(pose.rotation))
            pose = replace(pose, rotation=as_triple(vector_from_matrix(camera)))
        return replace(
            self,
            terms=tuple(map(float, terms)),
            focal_px=(focal_x, focal_x * aspect),
            centre_px=centre,
            image_size=turn.size_after,
            pose=pose,
            notes=(*self.notes, f"The file was {turn_in_words(turn_deg)}."),
        )

    def lens(self) -> Intrinsics:
        """Return the lens alone, to be held fixed in a fit; BadInput where it is none."""
        return Intrinsics.from_json(
            Intrinsics(
                self.model,
                self.terms,
                self.focal_px[0],
                self.aspect,
                self.centre_px,
                self.known_size,
            ).to_json()
        )

    def camera(self, view: dict[str, Any]) -> RayCamera:
        """Return the camera with its pose. view: the fields of a TopView."""
        if self.pose is None:
            raise BadInput(
                "The file does not state the camera pose.",
                "Use its lens as a known lens when you fit the field.",
                reason="no-pose",
            )
        camera = lens_model(self.model)(
            lens_terms=self.terms,
            focal_px=self.focal_px[0],
            aspect=self.aspect,
            centre_px=self.centre_px,
            rotation=self.pose.rotation,
            position_mm=self.pose.position_mm,
            **view,
        )
        if not camera.plausible():
            raise format_error(
                "These numbers do not describe a camera above a field.",
                "Check their units: pixels, mm and radians.",
            )
        return camera


def required_size(size: ImageSize | None) -> ImageSize:
    """Return the size of the images; BadInput where neither the file nor the caller states it."""
    if size is None:
        raise BadInput(
            say("import.no-image-size", "The file does not state the image size."),
            say(
                "import.enter-image-size",
                "Enter it as WIDTHxHEIGHT in pixels. From a program, send it as image_size.",
            ),
            reason="no-image-size",
        )
    return size


def read(data: bytes) -> CameraFile:
    """Read the only camera of another program's file, as camera_of does."""
    return camera_of(parse(data), data)


def camera_of(
    document: FileContent,
    data: bytes,
    entry: str | None = None,
    lens: str | None = None,
    size: ImageSize | None = None,
) -> CameraFile:
    """Read a camera of another program's file. document: its content; data: its bytes.

    entry: which, of several; lens: its model where the file states none; size: of the images, where the caller says it.

    Refused with what the file is: unknown-file, several-cameras with their names as "entries", no-such-camera,
    unstated-lens with both as "lenses", or what is wrong in it.
    """
    cameras = cameras_in(document)
    if not cameras and document.syntax == "npz" and "raw_x" in document.first:
        raise BadInput(
            say("import.remap-table", "A remap table contains no model and cannot be imported."),
            say("import.as-json", "Import the calibration as json."),
            reason="unknown-file",
        )
    if not cameras:
        raise BadInput(
            say(
                "import.no-camera",
                "The file ({syntax}) contains no camera in a form that is read.",
                syntax=document.syntax,
            ),
            say(
                "import.no-camera.fix",
                "Use a file with camera_matrix and distortion_coefficients, or of a program that the manual lists.",
            ),
            reason="unknown-file",
        )
    title = PROGRAMS[next(iter(cameras.values()))[0]][0]
    name = chosen_camera(cameras, entry, title)
    program, value = cameras[name]
    at = f"{name}." if name else ""
    stated = stated_as_fisheye(value, program, at, lens) or stated_camera(value, program, at, lens)
    if stated.lens is None:
        lenses = [
            _camera_file(stated_camera(value, program, at, model), model, value, data)
            .at_size(size)
            .lens()
            for model in LENSES_WITH_FISHEYE
        ]
        raise BadInput(
            say(
                "import.unstated-lens",
                "The file does not state its lens: four coefficients are k1, k2, p1, p2 of an ordinary lens, or k1 to "
                "k4 of a fisheye. From corner to corner, it sees {ordinary_deg:.0f}° as an ordinary lens, "
                "{fisheye_deg:.0f}° as a fisheye.",
                ordinary_deg=lenses[0].view_deg,
                fisheye_deg=lenses[1].view_deg,
            ),
            say(
                "import.unstated-lens.fix",
                "Choose the lens. From a program, send model as brown-conrady or fisheye.",
            ),
            reason="unstated-lens",
            lenses=[
                {"model": lens.model, "view_deg": lens.view_deg, "lens": lens.to_json()}
                for lens in lenses
            ],
        )
    return _camera_file(stated, stated.lens, value, data)


def chosen_camera(names: Iterable[str], entry: str | None, program: str) -> str:
    """Return the name of a file's camera that is to be read: the only one, or `entry`.

    names: of all of them, "" for a file that is one. Conflict with their names as "entries", or where there is no such.
    """
    known = [*names]
    listed = known[:MAX_LISTED] + ["…"] * (len(known) > MAX_LISTED)
    if entry is None and len(known) > 1:
        raise Conflict(
            say(
                "import.several-cameras",
                "The file ({program}) contains {count} cameras: {names}.",
                program=program,
                count=len(known),
                names=", ".join(listed),
            ),
            say(
                "import.several-cameras.fix",
                "Choose one of them. From a program, send its name as entry.",
            ),
            reason="several-cameras",
            entries=known,
        )
    if entry is not None and entry not in known:
        raise Conflict(
            f"The file contains no camera called {entry[:64]!r}.",
            f"Use one of: {', '.join(listed)}."
            if "" not in known
            else "Choose none. From a program, omit entry.",
            reason="no-such-camera",
        )
    return known[0] if entry is None else entry


def _camera_file(stated: StatedCamera, lens: str, value: JsonObject, data: bytes) -> CameraFile:
    metadata = (
        metadata_from_json(value["touchline"])
        if "touchline" in value
        else metadata_from_comment(data)
    )
    pose, notes = metadata.field_pose, list(stated.notes)
    rt = stated.extrinsics
    if metadata.field is not None and rt is not None:
        pose = pose_from_field(rt[:3], np.array(rt[3:]) * MM_PER_M)
    elif metadata.field is not None and "rotation_vector" in value:
        rotation, translation = (
            numbers(flat_numbers(value.get(name), name), name, (3,))
            for name in ("rotation_vector", "translation_vector")
        )
        pose = pose_from_field(rotation, np.array(translation))
    elif rt is not None and any(rt):
        notes.append("The extrinsics do not refer to a field and were ignored.")
    model, terms = lens_from_terms(stated.terms, "The lens", lens == "fisheye")
    found = CameraFile(
        stated.program,
        model,
        terms,
        stated.focal_px,
        stated.centre_px,
        stated.size,
        metadata,
        pose,
    )
    return replace(found, notes=(*notes, *_doubts(found)))


def _doubts(found: CameraFile) -> Iterator[str]:
    """Yield what speaks against the numbers, though they can be used."""
    if found.image_size is None:
        return
    (width, height), (cx, cy) = found.image_size, found.centre_px
    if not (0 <= cx <= width and 0 <= cy <= height):
        yield f"The principal point ({cx:.0f}, {cy:.0f}) is outside the image: check the image size."
        return
    near = NEAR * min(width, height)
    if np.hypot(cx - height / 2, cy - width / 2) < near < np.hypot(cx - width / 2, cy - height / 2):
        yield (
            f"The principal point ({cx:.0f}, {cy:.0f}) is in the middle of an image of {height} × {width} px: check "
            "whether the file states its size as height and width."
        )
    ends = np.array([0, 1])
    along, across = np.meshgrid(BORDER, ends), np.meshgrid(ends, BORDER)
    border = np.concatenate([np.stack(each, -1).reshape(-1, 2) for each in (along, across)])
    plane = (border * (width, height) - found.centre_px) / found.focal_px
    rays = lens_model(found.model).LENS.undistort(np.array(found.terms), plane)
    lost = np.mean(~np.isfinite(rays).all(axis=-1))
    if lost:
        yield f"The lens ends inside the image: {lost:.0%} of the image's edge has no line of sight."
