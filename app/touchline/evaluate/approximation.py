"""Approximates a model by another kind of camera; the error of that in millimetres.

    minimise Σ |G (pixel' - pixel)|²,   G = how the place on the field moves with the pixel, mm/px

over a grid of the region on the carpet and, where the model has rays, at robot-top height: what a robot's pattern is
seen at. Pose, focal length and centre are free: a lens with one term borrows from them what it lacks itself.
"""

from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from touchline.core.errors import Conflict, FitFailed
from touchline.core.field import Region
from touchline.core.geometry import Array, Points, inside_picture, root_mean_square, with_z
from touchline.fitting.least_squares import Minimum, minimise
from touchline.fitting.linear import (
    Incidences,
    focal_from_vanishing_points,
    homography_from_lines,
    pose_from_homography,
)
from touchline.fitting.ray_camera.fit import lens_fitter
from touchline.fitting.ray_camera.parameters import RayCameraParameters
from touchline.models import CameraModel, RayModel, field_from_raw, raw_from_field
from touchline.models.contract import RECTANGLE_FIELDS
from touchline.models.ray_camera import RayCamera

GRID = (25, 19)  # columns, rows over the region: the figures
FIT_GRID = (15, 13)
HALF_PX = 0.5
# the weight of what the picture shows beyond the region, so that a rich lens stays sane there
OUTSIDE = 0.005
# radii in focal lengths at which the other lens's bend is looked up for a start
BENDS = (0.05, 0.4, 0.8)
FIRST_STEPS, STEPS = 8, 60  # from every start; onwards from the best
FOCALS = (0.7, 1.0, 1.4)  # of the picture's width, tried where the carpet tells none
# The carpet alone hardly tells focal length, centre and height apart. What is guessed stays near its start, unless
# moving it by its σ gains a millimetre.
GUESS_MM = 1.0


@dataclass(frozen=True)
class ApproximationError:
    """How far a camera puts things from where the model puts them: field mm over the region, as far as it is in view.

    hat: the same at robot-top height; None where the model has no rays to say it.
    """

    rms_mm: float
    worst_mm: float
    worst_place: tuple[float, float]
    hat_rms_mm: float | None
    hat_worst_mm: float | None
    hat_height_mm: float

    @property
    def worst_at_any_height_mm(self) -> float:
        return max(self.worst_mm, self.hat_worst_mm or 0.0)

    def to_json(self) -> dict[str, Any]:
        return {**vars(self), "worst_place": list(self.worst_place)}


def approximation_error(
    model: CameraModel, other: RayCamera, region: Region, hat_height_mm: float
) -> ApproximationError:
    """Return the error of `other` in place of the model; Conflict where it does not reach what the model sees."""
    places, pixels = _seen(model, region, GRID, 0.0)
    errors = _length(other.unproject(pixels) - places)
    worst = int(np.argmax(errors))
    robot_top_rms_mm = robot_top_worst_mm = None
    if isinstance(model, RayModel):
        robot_top_places, robot_top_pixels = _seen(model, region, GRID, hat_height_mm)
        hat = _length(other.unproject(robot_top_pixels, hat_height_mm) - robot_top_places)
        robot_top_rms_mm, robot_top_worst_mm = root_mean_square(hat), float(hat.max(initial=0.0))
    x_mm, y_mm = places[worst].tolist()
    return ApproximationError(
        root_mean_square(errors),
        float(errors[worst]),
        (x_mm, y_mm),
        robot_top_rms_mm,
        robot_top_worst_mm,
        hat_height_mm,
    )


def approximate_camera(
    model: CameraModel,
    family: type[RayCamera],
    terms: tuple[str, ...],
    region: Region,
    hat_height_mm: float,
    *,
    square: bool = False,
) -> RayCamera:
    """Fit the camera of that family nearest to the model over the region. terms: of its lens, those that are free.

    square: with square pixels. Raises Conflict where nothing comes near.
    """
    points, pixels, weights = _samples(model, region, hat_height_mm)
    starts = [
        start.with_only_terms(terms) for start in _starts(model, family, points, pixels, square)
    ]
    # a lens may see what another cannot hold, such as places behind it
    with np.errstate(all="ignore"):
        held = np.all([np.isfinite(start.project(points)).all(axis=1) for start in starts], axis=0)
    points, pixels, weights = points[held], pixels[held], weights[held]
    free = np.array(
        [
            name in terms if name in family.LENS.TERMS else name != "aspect"
            for name in starts[0].names
        ]
    )
    prior = (
        np.zeros(len(free)) if isinstance(model, RayCamera) else _guesses(starts[0], len(points))
    )
    known = np.diag(prior)[prior > 0][:, free]

    def search(
        start: RayCameraParameters, begin: RayCameraParameters, steps: int
    ) -> Minimum[RayCameraParameters]:
        def evaluate(state: RayCameraParameters) -> tuple[Array, Array]:
            with np.errstate(all="ignore"):
                found, _, by = state.project_jacobian(points)
                residuals = np.einsum("nij,nj->ni", weights, found - pixels)
                jacobian = np.einsum("nij,njk->nik", weights, by)[..., free]
            moved = (_about(state) - _about(start)) * prior
            return (
                np.concatenate([residuals.ravel(), moved[prior > 0]]),
                np.concatenate([jacobian.reshape(-1, int(free.sum())), known]),
            )

        return minimise(
            begin,
            evaluate,
            lambda s, delta: s.retract(delta, free),
            max_steps=steps,
            tolerance=1e-9,
        )

    tried = [(search(start, start, FIRST_STEPS), start) for start in starts]
    near, start = min(tried, key=lambda found: found[0].cost)
    best = search(start, near.state, STEPS) if np.isfinite(near.cost) else near
    # both make the same corrected picture
    rectangle = {name: getattr(model, name) for name in RECTANGLE_FIELDS}
    found = family(**best.state.parameters(), **{**rectangle, "region": region})
    if not np.isfinite(best.cost) or not found.plausible():
        raise Conflict(
            f"No {family.TITLE} lens is close to this calibration over its covered area.",
            "Fit a physical lens model to the same points, and export that.",
            reason="no-approximation",
        )
    return found


def _guesses(start: RayCameraParameters, samples: int) -> Array:
    """What one unit of each parameter away from its start costs, mm, where the carpet alone is known: see GUESS_MM."""
    sigma = {
        "log_focal": 0.3,
        "centre_x": 0.02 * np.exp(start.log_focal),
        "centre_y": 0.02 * np.exp(start.log_focal),
        **dict.fromkeys(start.lens.TERMS, 1.0),
    }
    return np.array(
        [
            GUESS_MM * np.sqrt(samples) / sigma[name] if name in sigma else 0.0
            for name in start.names
        ]
    )


def _about(state: RayCameraParameters) -> Array:
    """Return the parameters that the prior is about, in the order of names; the pose as zeros."""
    return np.concatenate(
        [[state.log_focal, state.aspect], state.centre_px, state.terms, np.zeros(6)]
    )


def _samples(
    model: CameraModel, region: Region, hat_height_mm: float
) -> tuple[Array, Points, Array]:
    """Field points (n, 3) mm, the pixels (n, 2) that they must be seen at, and what a pixel is worth (n, 2, 2) mm."""
    heights = (0.0, hat_height_mm) if isinstance(model, RayModel) else (0.0,)
    parts = [(*_seen(model, region, FIT_GRID, z), z, 1.0) for z in heights]
    if isinstance(model, RayModel):
        pixels = _grid(np.zeros(2), np.array(tuple(model.image_size), float) - 1, FIT_GRID)
        parts.append((_place(model, pixels, 0.0), pixels, 0.0, OUTSIDE))
    points, targets, weights = [], [], []
    for places, pixels, z, weight in parts:
        step = np.array([[HALF_PX, 0.0], [0.0, HALF_PX]])
        worth = np.stack(
            [_place(model, pixels + s, z) - _place(model, pixels - s, z) for s in step], axis=-1
        )
        fine = np.isfinite(worth).all(axis=(-2, -1)) & np.isfinite(places).all(axis=-1)
        # towards the horizon a pixel is worth kilometres
        fine &= (
            np.abs(worth).max(axis=(-2, -1))
            < 20 * np.median(np.abs(worth[fine]).max(axis=(-2, -1)))
            if fine.any()
            else False
        )
        points.append(with_z(places, z)[fine])
        targets.append(pixels[fine])
        weights.append(weight * worth[fine])
    return np.concatenate(points), np.concatenate(targets), np.concatenate(weights)


def _starts(
    model: CameraModel, family: type[RayCamera], points: Array, pixels: Points, square: bool
) -> list[RayCameraParameters]:
    if not isinstance(model, RayCamera):
        return _seen_from(model, family, points, pixels)
    own = RayCameraParameters.of(model)
    if square:
        own = own.with_square_pixels()
    bends = [0.0]
    for r in BENDS:
        distorted = model.LENS.distort(np.array(model.lens_terms), np.array([r, 0.0, 1.0]))[0]
        bends.append((float(distorted) / r - 1) / r**2)
    return [
        replace(own, lens=family.LENS, terms=lens_fitter(family).start_terms(b))
        for b in dict.fromkeys(bends)
        if np.isfinite(b)
    ]


def _seen_from(
    model: CameraModel, family: type[RayCamera], points: Array, pixels: Points
) -> list[RayCameraParameters]:
    """Where a camera could stand that shows the carpet as a model without rays does, for some focal lengths."""
    one, zero = np.ones(len(points)), np.zeros(len(points))
    lines = np.concatenate(
        [np.stack([one, zero, -points[:, 0]], 1), np.stack([zero, one, -points[:, 1]], 1)]
    )
    centre = np.array(model.image_size.centre)
    found = homography_from_lines(Incidences(np.concatenate([pixels, pixels]), lines), centre)
    plane_from_field = np.asarray(np.linalg.inv(found.field_from_plane), np.float64)
    vanishing = focal_from_vanishing_points(plane_from_field)
    states = []
    for focal in (
        *(model.image_size.width * f for f in FOCALS),
        *([] if vanishing is None else [vanishing]),
    ):
        with suppress(FitFailed):
            rotation, position = pose_from_homography(plane_from_field, focal)
            k1 = float(np.clip(found.bend * focal**2, -1.0, 0.5))
            terms = lens_fitter(family).start_terms(k1)
            states.append(
                RayCameraParameters(
                    family.LENS,
                    float(np.log(focal)),
                    1.0,
                    centre,
                    terms,
                    rotation,
                    position,
                    np.empty(0),
                )
            )
    if not states:
        raise Conflict(
            "No physical lens model reproduces this calibration.",
            "Fit a physical lens model to the same points, and export that.",
            reason="no-approximation",
        )
    return states


def _seen(
    model: CameraModel, region: Region, grid: tuple[int, int], z_mm: float
) -> tuple[Points, Points]:
    """Places (n, 2) mm of the region, at z_mm, that the picture shows, and their pixels; all where it shows none.

    Without the last half pixel before a lens folds back, where rounding decides what is seen.
    """
    corner = np.array([region.width_mm, region.height_mm])
    places = region.field_from_region(_grid(np.zeros(2), corner, grid))
    pixels = (
        model.project(with_z(places, z_mm))
        if z_mm and isinstance(model, RayModel)
        else raw_from_field(model, places)
    )
    reached = np.isfinite(pixels).all(axis=1)
    if isinstance(model, RayModel):
        for step in HALF_PX * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]]):
            reached &= np.isfinite(model.unproject(pixels + step, z_mm)).all(axis=1)
    inside = reached & inside_picture(pixels, model.image_size)
    chosen = inside if inside.sum() >= 12 else reached
    if not chosen.any():
        raise Conflict(
            "The calibration does not cover its own area.",
            "Calibrate the camera again.",
            reason="no-approximation",
        )
    return places[chosen], pixels[chosen]


def _place(model: CameraModel, pixels: Points, z_mm: float) -> Points:
    return (
        model.unproject(pixels, z_mm)
        if isinstance(model, RayModel)
        else field_from_raw(model, pixels)
    )


def _grid(low: Array, high: Array, grid: tuple[int, int]) -> Points:
    x, y = (np.linspace(a, b, n) for a, b, n in zip(low, high, grid, strict=True))
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


def _length(vectors: Points) -> Array:
    length = np.linalg.norm(vectors, axis=-1)
    if not np.isfinite(length).all():
        raise Conflict(
            "The camera in this format does not reach the whole covered area.",
            "Fit another physical lens model to the same points, and export that version.",
            reason="no-approximation",
        )
    return length
