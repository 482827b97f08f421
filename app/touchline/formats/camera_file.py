"""A camera read from a file, checked, and in OpenCV's numbers, which ROS, mrcal, Kalibr and PhotonVision follow."""

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from touchline.core.errors import BadInput, Conflict
from touchline.core.field import Field
from touchline.core.geometry import MAX_SIDE_PX, MIN_SIDE_PX, Array, ImageSize
from touchline.formats.approximation import CameraPose, Metadata, checked_pose
from touchline.formats.numbers import format_error, integer, matrix, number
from touchline.models.intrinsics import Intrinsics
from touchline.models.lenses.brown_conrady import TERMS
from touchline.models.lenses.kannala_brandt import TERMS as FISHEYE_TERMS
from touchline.models.ray_camera import RayCamera, lens_model
from touchline.models.rotation import matrix_from_vector

LENSES = {"brown-conrady": TERMS}
LENSES_WITH_FISHEYE = {**LENSES, "fisheye": FISHEYE_TERMS}

MAX_FOCAL_PX = 1e6
NO_METADATA = Metadata()


def intrinsics_of(camera: RayCamera) -> tuple[float, float, float, float]:
    """Return fx, fy, cx, cy in px."""
    return camera.focal_px, camera.focal_px * camera.aspect, *camera.centre_px


def matrix_of(camera: RayCamera) -> tuple[float, ...]:
    """Return the camera matrix, row by row."""
    fx, fy, cx, cy = intrinsics_of(camera)
    return fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0


def read_intrinsics(value: Any, at: str) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return focal lengths and centre, px, of a camera matrix {rows, cols, data} without skew."""
    fx, skew, cx, zero, fy, cy, *last = matrix(value, at, 3, 3)
    if abs(skew) > 1e-9 * abs(fx) or zero != 0 or last != [0, 0, 1]:
        raise format_error(
            f"{at} is not a camera matrix without skew.", "Use [fx, 0, cx, 0, fy, cy, 0, 0, 1]."
        )
    return (fx, fy), (cx, cy)


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

    format: the reader's NAME. model: a name in MODELS, whose lens has these terms. image_size: None where the file does
    not tell. pose: only with a known field, which metadata or field names.
    """

    format: str
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
        if self.image_size is None:
            raise BadInput(
                "The file does not state the image size.",
                "Enter it: image_size, as WIDTHxHEIGHT in pixels.",
                reason="no-image-size",
            )
        return self.image_size

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


def checked_size(width: Any, height: Any) -> ImageSize:
    return ImageSize(
        integer(width, "The image width", MIN_SIDE_PX, MAX_SIDE_PX),
        integer(height, "The image height", MIN_SIDE_PX, MAX_SIDE_PX),
    )
