"""Where two cameras put the same thing, and their disagreement as a smooth vector field over the carpet.

    offset = (place by camera b − place by camera a) · normal, mm on the carpet

Along a line the offset is not observable, so a line gives one direction, its normal; a landmark and a match give both.
A thing a little above the carpet counts as one on it: whether a camera was moved or turned, that is right to the
share height / camera height. What is higher than MAX_HEIGHT_MM is left out.

    d(p) = Σ c_k q_k(p),   d(p_i) · n_i = offset_i,   q_k the small motions of a plane's picture:

of degree 0 a shift; of degree 1 also a turn and a scale, as of a camera that was turned or raised; of degree 2 also a
stretch, a shear and two tilts: a small homography, 8 in all. Free polynomials would say more than is known: lines tell
of one direction, and what they tell of it must hold for the other one too.

The lowest degree is taken whose error on points left out is within chance of the least. Stray measures count little
(Tukey's biweight). A weak prior keeps unknown what was not measured: where and in which direction d is known is told by
its covariance, and nothing else is drawn.
"""

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from typing import Self

import numpy as np

from touchline.core.errors import FitFailed
from touchline.core.field import Arc, Field, Landmark, Line, Region
from touchline.core.geometry import Array, Indices, Mask, Points, as_matches, root_mean_square
from touchline.core.records import Observations
from touchline.models import CameraModel, RayModel, field_from_raw

MAX_HEIGHT_MM = 400.0
SAME_MM = 1.0  # two cameras may call one line by two names: a border of theirs, or the field's

PRIOR_MM = 300.0  # one standard deviation of any disagreement
MIN_MEASURES = (1, 10, 20)  # of degree 0, 1 and 2
WITHIN_CHANCE = 1.1
NOISE_MM = 0.3  # the least that a measure may claim
KNOWN_MM = 5.0  # one standard deviation: a worse known disagreement is not known
KNOWN_SHARE = 0.3  # of the disagreement itself, where that is large
CUT = 4.7  # Tukey's, times the scale
ROUNDS = 10


@dataclass(frozen=True, eq=False)
class OffsetMeasurements:
    """places (n, 2) mm; normals (n, 2), length 1; offset_mm (n,); own_a_mm, own_b_mm (n,): how far each camera alone
    puts it from where the field has it, NaN where the field says nothing; z_mm (n,) above the carpet; thing (n,): which
    of the things that were measured it is of, a match by its number in the order given."""

    places: Points
    normals: Points
    offset_mm: Array
    own_a_mm: Array
    own_b_mm: Array
    z_mm: Array
    thing: Indices

    def __len__(self) -> int:
        return len(self.offset_mm)

    @classmethod
    def of_lines(cls, feet: Points, normals: Points, own_a: Array, own_b: Array) -> Self:
        """Places of the field's own markings, and each camera's distance from them along the normal."""
        fine = np.isfinite(own_a) & np.isfinite(own_b)
        return cls(
            feet[fine],
            normals[fine],
            (own_b - own_a)[fine],
            own_a[fine],
            own_b[fine],
            np.zeros(fine.sum()),
            np.arange(fine.sum()),
        )

    @classmethod
    def of_places(
        cls, at_a: Points, at_b: Points, truth: Points | None = None, z_mm: float | Array = 0.0
    ) -> Self:
        """The same things at z_mm, one or (n,), as placed by both, (n, 2) mm: two directions each."""
        fine = np.isfinite(at_a).all(axis=1) & np.isfinite(at_b).all(axis=1)
        at_a, at_b, z = at_a[fine], at_b[fine], np.broadcast_to(z_mm, fine.shape)[fine]
        places, normals = (
            np.repeat((at_a + at_b) / 2, 2, axis=0),
            np.tile(np.eye(2), (len(at_a), 1)),
        )
        nothing = np.full(2 * len(at_a), np.nan)
        own_a, own_b = (
            nothing if truth is None else (at - truth[fine]).reshape(-1) for at in (at_a, at_b)
        )
        return cls(
            places,
            normals,
            (at_b - at_a).reshape(-1),
            own_a,
            own_b,
            np.repeat(z, 2),
            np.repeat(np.flatnonzero(fine), 2),
        )

    @classmethod
    def together(cls, parts: list["OffsetMeasurements"]) -> Self:
        """Concatenate parts; FitFailed nothing-shared where there is nothing."""
        names = [member.name for member in fields(cls)]
        if not sum(map(len, parts)):
            raise FitFailed(
                "The two cameras have no lines or points in common.",
                "Check with images that show field lines where both cameras look, mark the same lines in "
                "both, or give matched points.",
                reason="nothing-shared",
            )
        first = np.cumsum([0, *(part.thing.max(initial=-1) + 1 for part in parts)])
        parts = [
            replace(part, thing=part.thing + number)
            for part, number in zip(parts, first, strict=False)
        ]
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))

    def by_thing(self, each: Array) -> tuple[Indices, Array]:
        """Return each thing that was measured, and the root of the sum of squares of its entries of each (n,)."""
        things, index = np.unique(self.thing, return_inverse=True)
        return things, np.sqrt(np.bincount(index, each**2, len(things)))

    def at_height(self, z_mm: float) -> Self:
        """Return those within a third of a height."""
        near = np.abs(self.z_mm - z_mm) <= z_mm / 3
        return replace(
            self, **{member.name: getattr(self, member.name)[near] for member in fields(self)}
        )


def from_matches(
    a: CameraModel, b: CameraModel, pixels_a: Points, pixels_b: Points, z_mm: float | Array
) -> OffsetMeasurements:
    """The same things in both pictures, (n, 2) raw px each, at z_mm above the carpet: (n,) or one for all, NaN unknown.

    Those above the carpet need rays in both; without, FitFailed no-rays where there is nothing else.
    """
    pixels_a, pixels_b = as_matches(pixels_a, pixels_b)
    z = np.broadcast_to(np.asarray(z_mm, float), len(pixels_a))
    z = np.where((z >= 0) & (z <= MAX_HEIGHT_MM), z, np.nan)
    at_a, at_b = (np.full((len(z), 2), np.nan) for _ in range(2))
    low, up = z == 0, np.isfinite(z) & (z != 0)
    at_a[low], at_b[low] = field_from_raw(a, pixels_a[low]), field_from_raw(b, pixels_b[low])
    if up.any() and isinstance(a, RayModel) and isinstance(b, RayModel):
        at_a[up], at_b[up] = a.unproject(pixels_a[up], z[up]), b.unproject(pixels_b[up], z[up])
    elif up.any() and not low.any():
        raise FitFailed(
            f"This lens model cannot locate a point {z[up][0]:g} mm above the carpet.",
            "Calibrate both cameras with a physical lens model.",
            reason="no-rays",
        )
    return OffsetMeasurements.of_places(at_a, at_b, z_mm=z)


def from_clicks(
    a: CameraModel,
    seen_a: Observations,
    region_a: Region,
    b: CameraModel,
    seen_b: Observations,
    region_b: Region,
    field: Field,
) -> OffsetMeasurements:
    """Lines, arcs and landmarks that were clicked in both pictures, on the carpet.

    It rests on the clicks that the calibrations were made from: what has moved since, it cannot see.
    """
    parts = []
    for feature, places_a, places_b in _shared_clicks(
        a, seen_a, region_a, b, seen_b, region_b, field
    ):
        if isinstance(feature, Landmark):
            at_a, at_b = (places.mean(axis=0, keepdims=True) for places in (places_a, places_b))
            parts.append(OffsetMeasurements.of_places(at_a, at_b, np.array([feature.position])))
        else:
            parts.append(_along_marking(feature, places_a, places_b))
    return OffsetMeasurements.together(parts)


def _shared_clicks(
    a: CameraModel,
    seen_a: Observations,
    region_a: Region,
    b: CameraModel,
    seen_b: Observations,
    region_b: Region,
    field: Field,
) -> Iterator[tuple[Landmark | Line | Arc, Points, Points]]:
    """Yield what was clicked on the carpet in both pictures, and where each camera places its clicks, (n, 2) mm each.

    A region's borders count as the field's lines they lie on, whatever each camera calls them. Clicks that a camera
    cannot place are left out.
    """
    for one in seen_a:
        for other in seen_b:
            if one.z_mm or other.z_mm:
                continue
            here, there = (
                field.feature(one.feature, region_a),
                field.feature(other.feature, region_b),
            )
            if not _is_same(here, there):
                continue
            places_a, places_b = (
                places[np.isfinite(places).all(axis=1)]
                for places in (field_from_raw(a, one.points), field_from_raw(b, other.points))
            )
            if len(places_a) and len(places_b):
                yield here, places_a, places_b


def _is_same(one: Landmark | Line | Arc, other: Landmark | Line | Arc) -> bool:
    """Whether two names mean one thing of the field."""
    if isinstance(one, Landmark) and isinstance(other, Landmark):
        return np.allclose(one.position, other.position, atol=SAME_MM)
    if isinstance(one, Line) and isinstance(other, Line):
        return same_line(one, other)
    return isinstance(one, Arc) and one == other


def same_line(one: Line, other: Line) -> bool:
    """Whether two names mean one line: a region's border lies on a line of the field."""
    ends = np.array([other.start, other.end])
    return bool(np.linalg.norm(one.nearest(ends) - ends, axis=1).max() < SAME_MM)


def _along_marking(marking: Line | Arc, places_a: Points, places_b: Points) -> OffsetMeasurements:
    """Measure both cameras' distances from a marking where both have clicks along it, (n, 2) mm each."""
    return (
        _along_line(marking, places_a, places_b)
        if isinstance(marking, Line)
        else _along_arc(marking, places_a, places_b)
    )


def _along_line(line: Line, places_a: Points, places_b: Points) -> OffsetMeasurements:
    start = np.array(line.start)
    along = (np.array(line.end) - start) / line.length_mm
    across = np.array([-along[1], along[0]])
    tracks = [
        ((places - start) @ along, (places - start) @ across) for places in (places_a, places_b)
    ]
    s, off_a, off_b = _shared(tracks)
    return OffsetMeasurements.of_lines(
        start + s[:, None] * along, np.broadcast_to(across, (len(s), 2)), off_a, off_b
    )


def _along_arc(arc: Arc, places_a: Points, places_b: Points) -> OffsetMeasurements:
    centre = np.array(arc.centre)
    middle = float(np.arctan2(*(np.concatenate([places_a, places_b]).mean(axis=0) - centre)[::-1]))
    tracks = []
    for places in (places_a, places_b):
        arm = places - centre
        angle = np.arctan2(arm[:, 1], arm[:, 0])
        # cut opposite to where the clicks are
        tracks.append(
            (
                (angle - middle + np.pi) % (2 * np.pi) - np.pi,
                np.linalg.norm(arm, axis=1) - arc.radius_mm,
            )
        )
    s, off_a, off_b = _shared(tracks)
    out = np.stack([np.cos(s + middle), np.sin(s + middle)], axis=1)
    return OffsetMeasurements.of_lines(centre + arc.radius_mm * out, out, off_a, off_b)


def _shared(tracks: list[tuple[Array, Array]]) -> tuple[Array, Array, Array]:
    """Where along it both have clicks, and each one's distance from it there, in between linearly."""
    (s_a, off_a), (s_b, off_b) = (
        (s[order], off[order]) for s, off in tracks for order in (np.argsort(s),)
    )
    s = np.sort(np.concatenate([s_a, s_b]))
    s = s[(s >= max(s_a[0], s_b[0])) & (s <= min(s_a[-1], s_b[-1]))]
    return s, np.interp(s, s_a, off_a), np.interp(s, s_b, off_b)


@dataclass(frozen=True, eq=False)
class OffsetField:
    """d(p). coefficients (k,), covariance (k, k); good (n,): measures that were believed."""

    middle: Array
    scale_mm: float
    degree: int
    coefficients: Array
    covariance: Array
    good: Mask
    residual_mm: float

    def at(self, places: Points) -> tuple[Points, Array]:
        """(…, 2) mm and its covariance (…, 2, 2); NaN where places are."""
        q = _motions((places - self.middle) / self.scale_mm, self.degree)
        return q @ self.coefficients, q @ self.covariance @ np.swapaxes(q, -1, -2)

    def known_mm(self, places: Points) -> tuple[Array, Array]:
        """(…,) mm: how far apart, as far as it is known, NaN where not; and in how many directions it is, 0 to 2."""
        offset, covariance = self.at(places)
        fine = np.all(np.isfinite(covariance), axis=(-2, -1))
        values, vectors = np.linalg.eigh(np.where(fine[..., None, None], covariance, np.eye(2)))
        along = np.einsum("...ab,...a->...b", vectors, np.nan_to_num(offset))
        known = (np.sqrt(values) <= np.maximum(KNOWN_MM, KNOWN_SHARE * np.abs(along))) & fine[
            ..., None
        ]
        known &= np.sqrt(values) < PRIOR_MM / 10
        count = known.sum(axis=-1)
        return np.where(
            count > 0, np.sqrt(np.sum(np.where(known, along, 0.0) ** 2, axis=-1)), np.nan
        ), count


def fit_offset_field(evidence: OffsetMeasurements) -> OffsetField:
    """Fit the smooth field to the measurements."""
    middle = evidence.places.mean(axis=0)
    scale = max(float(np.linalg.norm(evidence.places - middle, axis=1).max()), 1.0)
    at = (evidence.places - middle) / scale
    tried = [
        _fitted(at, evidence, degree)
        for degree, least in enumerate(MIN_MEASURES)
        if len(evidence) >= least
    ]
    least = min(error for error, *_ in tried)
    degree = next(
        d for d, (error, *_) in enumerate(tried) if error <= WITHIN_CHANCE * least + NOISE_MM / 2
    )
    _, coefficients, covariance, good, residual = tried[degree]
    return OffsetField(middle, scale, degree, coefficients, covariance, good, residual)


def _motions(at: Points, degree: int) -> Array:
    """(…, 2, k): the shift of places (…, 2) by each small motion."""
    x, y = at[..., 0], at[..., 1]
    one, none = np.ones_like(x), np.zeros_like(x)
    both = [(one, none), (none, one)]
    if degree > 0:
        both += [(-y, x), (x, y)]
    if degree > 1:
        both += [(x, -y), (y, x), (x * x, x * y), (x * y, y * y)]
    return np.stack([np.stack(pair, axis=-1) for pair in both], axis=-1)


def _fitted(
    at: Points, evidence: OffsetMeasurements, degree: int
) -> tuple[float, Array, Array, Mask, float]:
    """(error on points left out, coefficients, covariance, good, rms residual), mm."""
    rows = np.einsum("nd,ndk->nk", evidence.normals, _motions(at, degree))
    value, n = evidence.offset_mm, len(evidence)
    prior = np.eye(rows.shape[1]) / PRIOR_MM**2
    scale = (
        max(1.4826 * float(np.median(np.abs(value - np.median(value)))), NOISE_MM)
        if n > 3
        else KNOWN_MM / 2
    )
    weight, found, covariance = np.ones(n), np.zeros(rows.shape[1]), prior
    for _ in range(ROUNDS):
        covariance = np.linalg.inv(rows.T @ (rows * (weight / scale**2)[:, None]) + prior)
        found = covariance @ (rows.T @ (weight * value / scale**2))
        residual = value - rows @ found
        free = max(n - rows.shape[1], 1)
        if n > 3:
            scale = max(1.4826 * float(np.median(np.abs(residual))) * np.sqrt(n / free), NOISE_MM)
        weight = np.clip(1 - (residual / (CUT * scale)) ** 2, 0, None) ** 2
    leverage = np.einsum("ij,jk,ik->i", rows, covariance, rows) * weight / scale**2
    out = np.abs(residual) / np.maximum(1 - leverage, 0.05)
    good = weight > 0
    error = root_mean_square(np.minimum(out, CUT * scale))
    return error, found, covariance, good, root_mean_square(residual[good]) if good.any() else error
