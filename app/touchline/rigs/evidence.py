"""What two cameras are compared by: matched points, markings in pictures of both, and their epipolar geometry.

The line of one view on which a point of the other must lie:

    straight:  (x', y', 1) F (x, y, 1)ᵀ = 0, cut to the picture
    bent:      the plane through both cameras and the one's ray, as the other sees it

Lenses bend epipolar lines, so two calibrations predict F only in ideal pixels: those that a pinhole of the same focal
length and middle would see. For a lens without terms both are the same.

The bent line is walked in even angles about the camera that looks, so that no lens makes its steps long: from the
other camera's own place by way of the ray, and on past where the ray ends, or it would stop amid the picture.

First-order distance after P. Sampson (1982).

Pictures are evidence of today. At even steps along every line and arc that both cameras see, the painted line is
measured across its direction where both calibrations expect it, to a few hundredths of a pixel (vision/snap.py).
A camera that was knocked after its calibration shows all of them beside their place; the other one does not.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from typing_extensions import TypedDict

from touchline.core.errors import BadInput, FitFailed
from touchline.core.field import Arc, Field, Line
from touchline.core.geometry import (
    Array,
    ImageSize,
    Indices,
    Mask,
    Pixels,
    Points,
    as_matches,
    homogeneous,
    inside_picture,
)
from touchline.core.jobs import Progress, no_progress
from touchline.core.json_values import nullable
from touchline.core.records import Calibration, observations_from_json
from touchline.evaluate.offsets import OffsetMeasurements, from_clicks, from_matches
from touchline.models import CameraModel, field_from_raw, raw_from_field
from touchline.models.ray_camera import RayCamera
from touchline.models.rotation import cross_matrix
from touchline.rigs.verdict import Source
from touchline.vision.snap import Hint, Snapped, snap

# steps of a degree at most find the part in the picture, which is then walked finely
COARSE, FINE = 181, 65
AHEAD_MM = 1000.0  # how far along a direction it is looked at; any length gives the same pixel
APART_MM = 1.0  # nearer, two cameras stand at one place and there is no such geometry

MIN_MEASURES = 6  # in pictures: fewer are chance
STEP_MM = 90.0
MAX_PLACES = 160  # of one pair: some milliseconds each
REACH_MM = 120.0  # a camera knocked further shows no line where one is expected
CLEAR_MM = 180.0  # from every other marking: nothing else may be within reach
MIN_REACH_PX, MAX_REACH_PX = 6.0, 30.0
SURE_PX = 0.5
CONFIDENT = 0.6
TINY_MM = 1.0


class PredictedGeometry(TypedDict):
    """The fundamental matrix in ideal pixels, the distance of the cameras, and by how much one is turned."""

    matrix: list[list[float]]
    baseline_mm: float
    angle_deg: float


def sampson_px(fundamental: Array, a: Points, b: Points) -> Array:
    """Return the signed first-order distance, px, of matches (n, 2) from fundamental (…, 3, 3): (…, n)."""
    xa, xb = homogeneous(a), homogeneous(b)
    in_b = xa @ np.swapaxes(fundamental, -1, -2)  # (…, n, 3): the line of each a in view b
    in_a = xb @ fundamental
    with np.errstate(all="ignore"):
        steep = in_b[..., 0] ** 2 + in_b[..., 1] ** 2 + in_a[..., 0] ** 2 + in_a[..., 1] ** 2
        return np.sum(xb * in_b, axis=-1) / np.sqrt(steep)


def epipolar_px(fundamental: Array, a: Points, b: Points) -> Array:
    """Return (n,) px: the rms of a match's distances from its two epipolar lines."""
    in_b, in_a = homogeneous(a) @ fundamental.T, homogeneous(b) @ fundamental
    with np.errstate(all="ignore"):
        miss = np.sum(homogeneous(b) * in_b, axis=1) ** 2
        return np.sqrt(
            (miss / np.sum(in_b[:, :2] ** 2, axis=1) + miss / np.sum(in_a[:, :2] ** 2, axis=1)) / 2
        )


def geometry(a: RayCamera, b: RayCamera) -> PredictedGeometry | None:
    """Predict it by two calibrations; None for two cameras at one place."""
    rotation, centre = pose_between(a, b)
    if not np.linalg.norm(centre) > APART_MM:
        return None
    matrix = _about_corner(b).T @ _fundamental(a, b) @ _about_corner(a)
    angle = float(np.degrees(np.arccos(np.clip((np.trace(rotation) - 1) / 2, -1, 1))))
    return {
        "matrix": (matrix / np.linalg.norm(matrix)).tolist(),
        "baseline_mm": float(np.linalg.norm(centre)),
        "angle_deg": angle,
    }


def calibrated_epipolar_px(camera_a: RayCamera, camera_b: RayCamera, a: Points, b: Points) -> Array:
    """Return (n,) ideal px: how far matches (n, 2) raw px are from the epipolar lines of two calibrations.

    It sees only errors across those lines: two cameras that err alike, or along them, pass. NaN beyond a lens.
    Raises FitFailed no-baseline where both cameras stand at the same place.
    """
    a, b = as_matches(a, b)
    if not np.linalg.norm(pose_between(camera_a, camera_b)[1]) > APART_MM:
        raise FitFailed(
            "Both calibrations have the same camera position.",
            "Compare two different cameras.",
            reason="no-baseline",
        )
    return epipolar_px(
        _fundamental(camera_a, camera_b), ideal_px(camera_a, a), ideal_px(camera_b, b)
    )


def _fundamental(a: RayCamera, b: RayCamera) -> Array:
    """Return F (3, 3) of ideal pixels about the principal points: E = [t]× R between the inverse focal lengths."""
    rotation, centre = pose_between(a, b)
    essential = cross_matrix(centre / np.linalg.norm(centre)) @ rotation
    f = (
        np.diag([1 / b.focal_px, 1 / b.focal_px, 1])
        @ essential
        @ np.diag([1 / a.focal_px, 1 / a.focal_px, 1])
    )
    return f / np.linalg.norm(f)


def pose_between(camera_a: RayCamera, camera_b: RayCamera) -> tuple[Array, Array]:
    """Return b_from_a (3, 3) and camera a's centre in b's frame, mm, from their calibrations."""
    b_from_a = camera_b.camera_from_field @ camera_a.camera_from_field.T
    return b_from_a, camera_b.camera_from_field @ (
        np.array(camera_a.position_mm) - np.array(camera_b.position_mm)
    )


def ideal_px(camera: RayCamera, raw: Points) -> Points:
    """Map raw px (n, 2) to the pixels of a pinhole of the same focal length, about its centre; NaN out of reach."""
    rays = camera.rays(raw)
    with np.errstate(all="ignore"):
        return camera.focal_px * rays[..., :2] / np.where(rays[..., 2:] > 0, rays[..., 2:], np.nan)


def _about_corner(camera: RayCamera) -> Array:
    """From pixels of the picture to pixels about the principal point."""
    x, y = camera.centre_px
    return np.array([[1.0, 0, -x], [0, 1, -y], [0, 0, 1]])


def epipolar_segments(fundamental: Array, points_a: Points, size_b: ImageSize) -> Array:
    """Return (n, 2, 2) px: where the lines of points_a (n, 2) enter and leave picture b; NaN for one that misses it.

    For lines in picture a give the transposed matrix and points of b.
    """
    low, high = np.full(2, -0.5), np.array(tuple(size_b)) - 0.5
    middle = (low + high) / 2
    with np.errstate(all="ignore"):
        lines = homogeneous(points_a) @ np.asarray(fundamental, float).T
        lines = lines / np.linalg.norm(lines[:, :2], axis=1, keepdims=True)
        normal = lines[:, :2]
        foot = middle - (normal @ middle + lines[:, 2])[:, None] * normal
        along = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
        # a side that the line runs along bounds nothing, or everything
        to = np.where(
            along[:, :, None] == 0,
            np.where((foot >= low) & (foot <= high), np.inf, np.nan)[:, :, None]
            * np.array([-1, 1]),
            (np.stack([low, high], axis=1) - foot[:, :, None]) / along[:, :, None],
        )
        first, last = to.min(axis=2).max(axis=1), to.max(axis=2).min(axis=1)
        ends = foot[:, None] + np.stack([first, last], axis=1)[:, :, None] * along[:, None]
        return np.where((first < last)[:, None, None], ends, np.nan)


def epipolar_curves(camera_a: RayCamera, camera_b: RayCamera, points_a: Points) -> Array:
    """Return (n, FINE, 2) px: where picture b can show what is at points_a (n, 2) raw px; NaN beyond the lens.

    The ends lie a step outside the picture where the line goes on; a line that is nowhere in it is all NaN.
    """
    start = np.array(camera_a.position_mm) - np.array(camera_b.position_mm)
    with np.errstate(all="ignore"):
        start = start / np.linalg.norm(start)
        away = directions(camera_a, points_a)
        across = away - (away @ start)[:, None] * start
        across = across / np.linalg.norm(across, axis=1, keepdims=True)

        def seen(share: Array) -> Array:
            turn = np.pi * share[..., None]
            ahead = np.cos(turn) * start + np.sin(turn) * across[:, None]
            return camera_b.project(np.array(camera_b.position_mm) + AHEAD_MM * ahead)

        share = np.broadcast_to(np.linspace(0, 1, COARSE), (len(away), COARSE))
        inside = inside_picture(seen(share), camera_b.image_size)
        first = np.maximum(inside.argmax(axis=1) - 1, 0)
        last = np.minimum(COARSE - inside[:, ::-1].argmax(axis=1), COARSE - 1)
        fine = (first[:, None] + np.linspace(0, 1, FINE) * (last - first)[:, None]) / (COARSE - 1)
        return np.where(np.any(inside, axis=1)[:, None, None], seen(fine), np.nan)


def directions(camera: RayCamera, raw: Points) -> Array:
    """Return unit rays (n, 3) of raw px (n, 2) in the field frame; NaN beyond the lens."""
    with np.errstate(all="ignore"):
        rays = camera.rays(raw) @ camera.camera_from_field
        return rays / np.linalg.norm(rays, axis=1, keepdims=True)


@dataclass(frozen=True, eq=False)
class Matches:
    """a, b (n, 2) raw px, heights_mm (n,), NaN where not known; which (n,): their place among the count given."""

    a: Points
    b: Points
    heights_mm: Array
    which: Indices
    count: int

    @classmethod
    def of(cls, points_a: Any, points_b: Any, z_mm: float | Sequence[float | None]) -> Self:
        """Read them; a point that is None is not marked yet, and such a match counts only in the numbering.

        z_mm above the carpet: of all, or of each, None where it is not known. BadInput bad-matches.
        """
        count = len(points_a)
        which = np.arange(count)
        if isinstance(points_a, list) and isinstance(points_b, list) and len(points_b) == count:
            pairs = zip(points_a, points_b, strict=True)
            which = np.array(
                [i for i, (p, q) in enumerate(pairs) if p is not None and q is not None], np.intp
            )
            points_a, points_b = ([points[i] for i in which] for points in (points_a, points_b))
        return cls(*as_matches(points_a, points_b), _heights(z_mm, count)[which], which, count)

    def in_given_order(self, values: Array) -> list[float | None]:
        """Put a value of each into the order in which the matches were given."""
        all_values = np.full(self.count, np.nan)
        all_values[self.which] = values
        return nullable(all_values)

    def numbers(self, chosen: Mask | Sequence[int]) -> list[int]:
        return self.which[chosen].tolist()


def _heights(z_mm: float | Sequence[float | None], count: int) -> Array:
    """(count,) mm, NaN where it is not known."""
    if not isinstance(z_mm, Sequence):
        return np.full(count, float(z_mm))
    if len(z_mm) != count:
        raise BadInput(
            f"There are {len(z_mm)} heights for {count} matches.",
            "Send one height for all, or one for each match (null if it is unknown).",
            reason="bad-matches",
        )
    return np.array([np.nan if z is None else float(z) for z in z_mm])


def best_evidence(
    both: tuple[Calibration, Calibration],
    models: tuple[CameraModel, CameraModel],
    field: Field,
    matches: Matches | None,
    pictures: tuple[Pixels | None, Pixels | None] = (None, None),
    progress: Progress = no_progress,
) -> tuple[OffsetMeasurements, Source, list[str]]:
    """Return the best evidence there is, where it is from, and notes; FitFailed nothing-shared where there is none.

    Matches count as far as their heights are known, and come first: a few of them do not take the place of the lines
    that pictures show, they add what lines do not tell.
    """
    parts: list[OffsetMeasurements] = []
    notes: list[str] = []
    beyond = 0 if matches is None else len(matches.a)  # so that a line has no match's number
    if matches is not None and np.isfinite(matches.heights_mm).any():
        parts.append(from_matches(*models, matches.a, matches.b, matches.heights_mm))
    by_matches = bool(sum(map(len, parts)))
    if pictures[0] is not None and pictures[1] is not None:
        found = from_pictures(models[0], pictures[0], models[1], pictures[1], field, progress)
        if len(found) >= MIN_MEASURES:
            found = replace(found, thing=found.thing + beyond)
            return (
                OffsetMeasurements.together([*parts, found]),
                "matches" if by_matches else "pictures",
                notes,
            )
        notes.append("The images show too few lines in the area that both cameras cover.")
    if parts:
        return OffsetMeasurements.together(parts), "matches", notes
    a, b = both
    return (
        from_clicks(
            models[0],
            observations_from_json(a.observations),
            field.region(a.region, a.rotate),
            models[1],
            observations_from_json(b.observations),
            field.region(b.region, b.rotate),
            field,
        ),
        "clicks",
        notes,
    )


def marking_places(field: Field) -> tuple[Points, Points, Array]:
    """Places (n, 2) mm on the markings, clear of the others, their normals (n, 2) and the markings' widths (n,) mm."""
    shapes: list[Line | Arc] = [*field.lines.values(), *field.arcs.values()]
    drawn = [shape.sample(max(2, round(shape.length_mm / 20))) for shape in shapes]
    # spots that are painted, where a line crosses none
    marks = [
        np.array([field.landmarks[m["at"]].position])
        for m in field.extras.get("marks", ())
        if m.get("at") in field.landmarks
    ]
    found = [(np.empty((0, 2)), np.empty((0, 2)), np.empty(0))]
    for index, shape in enumerate(shapes):
        places = shape.sample(max(3, round(shape.length_mm / STEP_MM) + 1))
        normals = shape.normals(places)
        others = [points for other, points in enumerate(drawn) if other != index]
        away = np.min(
            [
                np.linalg.norm(places[:, None] - points, axis=-1).min(axis=1)
                for points in (*others, *marks)
            ],
            axis=0,
            initial=np.inf,
        )
        ends = 0.0 if isinstance(shape, Arc) else CLEAR_MM  # a line's end is a corner, or nothing
        to_end = np.minimum(
            *(np.linalg.norm(places - end, axis=1) for end in (places[0], places[-1]))
        )
        clear = (away > CLEAR_MM) & (to_end >= ends)
        found.append((places[clear], normals[clear], np.full(int(clear.sum()), shape.width_mm)))
    spots, across, widths = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return spots, across, widths


def from_pictures(
    a: CameraModel,
    pixels_a: Pixels,
    b: CameraModel,
    pixels_b: Pixels,
    field: Field,
    progress: Progress = no_progress,
) -> OffsetMeasurements:
    """Markings that both pictures show where both see the carpet. No evidence at all is no error here."""
    places, normals, widths = marking_places(field)
    visible = _inside(a, pixels_a, places) & _inside(b, pixels_b, places)
    which = np.flatnonzero(visible)
    which = which[np.linspace(0, len(which) - 1, min(len(which), MAX_PLACES)).round().astype(int)]
    own = np.full((2, len(which)), np.nan)
    for number, index in enumerate(which):
        if number % 16 == 0:
            progress(number / len(which), "Detecting lines visible to both cameras")
        for side, (model, pixels) in enumerate(((a, pixels_a), (b, pixels_b))):
            own[side, number] = _off_mm(model, pixels, places[index], normals[index], widths[index])
            if np.isnan(own[side, number]):
                break
    return OffsetMeasurements.of_lines(places[which], normals[which], *own)


def _inside(model: CameraModel, pixels: Pixels, places: Points) -> Mask:
    return inside_picture(
        raw_from_field(model, places), ImageSize(pixels.shape[1], pixels.shape[0]), 2
    )


def _off_mm(
    model: CameraModel, pixels: Pixels, place: Points, normal: Points, width_mm: float
) -> float:
    """How far beside the place, along the normal, this camera sees the marking; NaN where it sees none."""
    along = np.array([normal[1], -normal[0]])
    raw = raw_from_field(
        model, np.stack([place, place + TINY_MM * along, place + TINY_MM * normal])
    )
    tangent, scale = raw[1] - raw[0], float(np.linalg.norm(raw[2] - raw[0]))  # px, px a mm
    if not (np.isfinite(raw).all() and scale > 0):
        return float("nan")
    reach = float(np.clip(REACH_MM * scale, MIN_REACH_PX, MAX_REACH_PX))
    found = snap(
        pixels,
        raw[0],
        Hint(reach, width_mm * scale, float(np.arctan2(tangent[1], tangent[0]) % np.pi)),
    )
    if not isinstance(found, Snapped) or found.sigma_px > SURE_PX or found.confidence < CONFIDENT:
        return float("nan")
    return float((field_from_raw(model, np.array(found.point)) - place) @ normal)
