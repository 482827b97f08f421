"""What fitters share: their contract, their options, the corrected rectangle, and what they say of single clicks."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, Protocol

import numpy as np

from touchline.core.errors import BadInput, FitFailed
from touchline.core.field import Field, Region
from touchline.core.geometry import Array, ImageSize, Indices, Mask, Points, inside_picture
from touchline.core.jobs import Progress, no_progress
from touchline.core.options import Option
from touchline.core.records import Fit, Observations, Warning
from touchline.core.statements import Sentence, say
from touchline.models import CameraModel

DEFAULT_RECTANGLES = 10  # between the far apart borders, unless the rig says otherwise
MAX_CORRECTED_PX = 50e6

RECTANGLE_OPTIONS: tuple[Option, ...] = (
    Option(
        "w_max_rectangle_px",
        "float",
        None,
        "Width of the widest calibration rectangle; the same for all cameras of a rig. Empty: from the field and "
        "the image.",
        (1, 10_000),
        "px",
    ),
    Option(
        "h_max_rectangle_px",
        "float",
        None,
        "Height of the highest calibration rectangle.",
        (1, 10_000),
        "px",
    ),
    Option(
        "n_rectangles_x",
        "int",
        None,
        "Rectangles between the left and the right border.",
        (1, 1000),
    ),
    Option(
        "n_rectangles_y",
        "int",
        None,
        "Rectangles between the top and the bottom border.",
        (1, 1000),
    ),
)

LINE_SIGMA = Option(
    "line_sigma_mm",
    "float",
    None,
    "How far the painted lines may be from their nominal position. Empty: estimated from the image, "
    "starting from the field's own value; 0 treats them as exact.",
    (0, 200),
    "mm",
)
CLICK_SIGMAS_PX = (0.01, 20)
CLICK_SIGMA = Option(
    "click_sigma_px",
    "float",
    None,
    "How accurate the points are. Empty: estimated from the points.",
    CLICK_SIGMAS_PX,
    "px",
)
COMMON_OPTIONS: tuple[Option, ...] = (
    *RECTANGLE_OPTIONS,
    Option("robust", "bool", True, "List outliers and exclude them from the fit."),
)

RAY_OPTIONS: tuple[Option, ...] = (
    Option(
        "height_mm",
        "value-and-sigma",
        None,
        "The measured camera height above the carpet, and its uncertainty. It separates focal length and height.",
        (100, 50_000),
        "mm",
    ),
    Option(
        "lens",
        "calibration",
        None,
        "A calibration or board calibration whose lens is used; the field determines the pose.",
    ),
    Option(
        "lens_sigma",
        "choice",
        None,
        "0 fixes that lens; own allows its own uncertainty.",
        choices=("0", "own"),
    ),
    LINE_SIGMA,
    CLICK_SIGMA,
    Option(
        "centre_sigma_px",
        "float",
        None,
        "How far the principal point may be from the image centre. Empty: 1.2 % of the width; 0 fixes it there.",
        (0, 500),
        "px",
    ),
    Option(
        "aspect_sigma",
        "float",
        None,
        "How far the pixel aspect ratio may be from 1. Empty: 0.002, or 0 for SSL; 0 fixes it.",
        (0, 0.2),
        "",
    ),
    *COMMON_OPTIONS,
)

TERMS_OPTION = Option(
    "terms",
    "terms-or-auto",
    "auto",
    "Which terms to estimate; auto uses the terms that the points support.",
)

SAME_PLACE_PX = 0.5  # two clicks closer than this are one
MAX_CLICKED = 1000  # more come from a detector, whose spacing is its own
DRAG = say("warning.outlier.fix", "Drag it onto the line, or remove it.")


def corrected_rectangle(
    settings: Mapping[str, Any], region: Region, image_size: ImageSize
) -> tuple[float, float, int, int]:
    """Return I_width and I_height with their numbers of rectangles, Eq. (3) and (7).

    Defaults depend on the field and the picture size alone, never on the clicks, so that cameras of one rig agree:
    the region, square-pixelled, as large as fits into the picture.
    """
    longer = max(region.width_mm, region.height_mm)
    n_x = settings["n_rectangles_x"] or max(1, round(DEFAULT_RECTANGLES * region.width_mm / longer))
    n_y = settings["n_rectangles_y"] or max(
        1, round(DEFAULT_RECTANGLES * region.height_mm / longer)
    )
    px_per_mm = min(image_size.width / region.width_mm, image_size.height / region.height_mm)
    w_max, h_max = settings["w_max_rectangle_px"], settings["h_max_rectangle_px"]
    width = w_max * n_x if w_max else round(region.width_mm * px_per_mm)  # Eq. (3)
    height = h_max * n_y if h_max else round(region.height_mm * px_per_mm)  # Eq. (7)
    if (
        width < 16
        or height < 16
        or width > 16000
        or height > 16000
        or width * height > MAX_CORRECTED_PX
    ):
        raise BadInput(
            f"The corrected image would be {width:.0f} × {height:.0f} px.",
            "Choose sizes and numbers of rectangles that result in 16 to 16 000 px per side and at most 50 "
            "megapixels.",
            reason="bad-corrected-size",
        )
    return float(width), float(height), n_x, n_y


class Sensitivity(Protocol):
    """How one camera's view moves with its parameters: what expected error and the next best click are made of.

    names: parameters that a covariance of this model may have, as in Fit.parameter_names; lines' own offsets come
    beside them and move nothing.
    """

    @property
    def names(self) -> tuple[str, ...]: ...

    def field_jacobian(self, points_field_xyz: Array, names: tuple[str, ...]) -> Array:
        """Differentiate the place where a pixel's ray meets the plane by named parameters: (n, 2, len(names)) mm.

        points_field_xyz (n, 3): the places. NaN where the camera does not see the place, or sees the plane edge-on.
        """

    def click_jacobian(self, places: Points, along: Points, names: tuple[str, ...]) -> Array:
        """Differentiate a click's distance from a curve by named parameters: (n, len(names)) px.

        The curve passes places (n, 2) mm in the directions along (n, 2).
        """


class Fitter(ABC):
    """Finds the parameters of one camera model from observations; a class without state."""

    MODEL: ClassVar[type[CameraModel]]
    OPTIONS: ClassVar[tuple[Option, ...]]
    # made of borders: none of them can be left out to check it
    NEEDS_EVERY_BORDER: ClassVar[bool] = False

    @classmethod
    @abstractmethod
    def points_needed(cls) -> str:
        """Say in a sentence how few points do."""

    @classmethod
    @abstractmethod
    def fit(
        cls,
        observations: Observations,
        field: Field,
        region: Region,
        image_size: ImageSize,
        options: Mapping[str, Any] | None = None,
        progress: Progress = no_progress,
    ) -> Fit:
        """Find the parameters; FitFailed says what is missing."""

    @classmethod
    def sensitivity(cls, model: CameraModel) -> Sensitivity | None:
        """Return how the model's view moves with its parameters; None where it has no common parameters."""
        return None


def first_of_each_place(points: Points) -> Indices:
    """Return for each point (n, 2) px the number of the first one at its place, its own in most cases.

    A second click on one place says nothing new: it neither counts in a fit nor harms it.
    """
    first = np.arange(len(points))
    if len(points) > MAX_CLICKED:
        return first
    apart = points[:, None] - points
    near = np.tril(np.einsum("ijk,ijk->ij", apart, apart) < SAME_PLACE_PX**2, -1)
    for k in np.flatnonzero(near.any(axis=1)):
        firsts = np.flatnonzero(near[k] & (first == np.arange(len(points))))
        first[k] = firsts[0] if firsts.size else k
    return first


def check_inside_picture(observations: Observations, image_size: ImageSize) -> None:
    """Raise FitFailed for a click that no picture of that size can have."""
    for o in observations:
        outside = np.flatnonzero(~inside_picture(o.points, image_size, -1))
        if outside.size:
            x, y = o.points[outside[0]]
            raise FitFailed(
                say(
                    "refused.outside",
                    "Point {n} of {line}, ({x:.6g}, {y:.6g}), is outside the image of {size}.",
                    n=int(outside[0]) + 1,
                    line=o.label,
                    x=x,
                    y=y,
                    size=str(image_size),
                ),
                say("refused.outside.fix", "Remove it, or choose the image that it belongs to."),
                reason="outside-picture",
                feature=str(o.feature),
                index=int(outside[0]),
            )


def inlier_masks(observations: Observations, owners: Indices, inliers: Mask) -> tuple[Mask, ...]:
    """Return a mask of the points of each observation; owners (n, 2): observation and point of each of the inliers.

    A second click on one place is what the first one is.
    """
    masks = tuple(np.ones(len(o.points), bool) for o in observations)
    for (i, k), fine in zip(owners, inliers, strict=True):
        masks[i][k] = fine
    return tuple(
        mask[first_of_each_place(o.points)] for mask, o in zip(masks, observations, strict=True)
    )


def outlier_warnings(
    observations: Observations, owners: Indices, inliers: Mask, pixels: Array
) -> list[Warning]:
    """Return a warning for each click that was left out; pixels: how far off it is."""
    return [
        outlier_warning(
            observations,
            i,
            k,
            say("outlier.predicted", "is {px:px} px from its predicted position", px=abs(px)),
        )
        for (i, k), fine, px in zip(owners, inliers, pixels, strict=True)
        if not fine
    ]


def outlier_warning(
    observations: Observations, i: int, k: int, where: Sentence, fix: Sentence = DRAG
) -> Warning:
    """Return the warning for point k of observation i; where: what is wrong with it, as a verb."""
    observation = observations[i]
    return Warning(
        "stray-click",
        say(
            "warning.outlier",
            "Point {n} of {line} {where} and was excluded from the fit.",
            n=int(k) + 1,
            line=observation.label,
            where=where,
        ),
        fix,
        str(observation.feature),
        int(k),
    )


def elevated_point_warnings(observations: Observations, who: Sentence) -> list[Warning]:
    """Return a warning for each observation that a model without rays cannot use; who: "a homography"."""
    return [
        Warning(
            "above-the-carpet",
            say(
                "warning.above-carpet",
                "The points on {line} are {mm:g} mm above the carpet. {who} describes only the carpet, "
                "so they were excluded.",
                line=o.label,
                mm=o.z_mm,
                who=who,
            ),
            say("warning.above-carpet.fix", "Fit a physical lens model to use them."),
            str(o.feature),
        )
        for o in observations
        if o.z_mm != 0 and len(o.points)
    ]
