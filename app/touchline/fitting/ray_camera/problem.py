"""Residuals of clicks, in px, from the curves and points they were made on; and how far lines lie from their places.

Offsets of lines: the clicks tell each line's offset o with information S about b (all other unknowns eliminated). With
o ~ N(0, D):

    log p(clicks | σ) = -½ log|D| - ½ log|S + D⁻¹| + ½ bᵀ (S + D⁻¹)⁻¹ b,   D = diag(σ² / w)

σ is averaged over its posterior (D. MacKay 1992, "Bayesian interpolation": the evidence). The weights w are those of
Student's t with TAIL degrees of freedom (K. Lange, R. Little, J. Taylor 1989), so that one line painted wrong does
not speak for the others. They are means of the precision given the offset; the variance that stands for how well a line
is known has the mean of the precision's inverse, which is (TAIL + 1) / (TAIL - 1) times as large.

A click on a line or arc has one residual: its distance, across, from the projected curve at the nearest place. Where
along the curve it was made is found by one step at every evaluation and costs no unknown: at the nearest place, moving
along the curve changes the distance by nothing (orthogonal distance regression, P. Boggs and J. Rogers 1990).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from dataclasses import field as member
from functools import cached_property
from typing import Protocol, Self, TypeVar

import numpy as np

from touchline.core.field import Arc, Field, Landmark, Line, Region
from touchline.core.geometry import Array, Indices, Mask
from touchline.core.json_values import MAX_OFFSET_MM
from touchline.core.records import Observations
from touchline.fitting.contract import first_of_each_place
from touchline.fitting.linear import Incidences, line_through

SIGMAS_MM = np.geomspace(0.05, 30.0, 28)
SIGMA_SPREAD = 0.7  # σ of the logarithm of σ; its mean square is what the field says
TAIL = 4.0
SPREAD = (TAIL + 1) / (TAIL - 1)  # the precision has gamma's distribution
ROUNDS = 4

# for the first places: what remains of a last step is far less
FOOT_STEPS, NEAR_ENOUGH_MM = 12, 1.0
# of a marking's offset, mm; "across" an arc is its radius
PARTS = ("across", "tilt", "centre_x", "centre_y")
# how far a line's end lies off by its tilt, of how far the line does as a whole: each end is
# measured
TILT_SHARE = 0.4


def line_sigmas_mm(
    jacobian: Array,
    columns: Sequence[int],
    offsets_mm: Array,
    prior_sigmas_mm: Array,
    usual_mm: float,
    kind: Mask,
) -> Array:
    """Return σ (n,) mm of each line's offset.

    jacobian: (rows, parameters) of whitened residuals at their minimum, with the offsets' priors in it; columns: those
    of the offsets. offsets_mm, prior_sigmas_mm (n,): at that minimum. kind (n,): which share one σ. Lines that are
    straight may well lie beside their places: tilts must not speak for offsets.
    """
    lines = np.asarray(columns)
    others = np.setdiff1d(np.arange(jacobian.shape[1]), lines)
    scale = np.linalg.norm(jacobian, axis=0)
    scale[scale == 0] = 1.0
    information = (jacobian / scale).T @ (jacobian / scale)
    by_others = information[np.ix_(lines, others)]
    schur = (
        information[np.ix_(lines, lines)]
        - by_others
        @ np.linalg.pinv(information[np.ix_(others, others)], rcond=1e-12, hermitian=True)
        @ by_others.T
    )
    schur = schur * np.outer(scale[lines], scale[lines]) - np.diag(prior_sigmas_mm**-2.0)
    values, vectors = np.linalg.eigh((schur + schur.T) / 2)
    # rounding must not make information negative
    schur = (vectors * np.maximum(values, 0)) @ vectors.T
    pull = schur @ offsets_mm + offsets_mm / prior_sigmas_mm**2
    # so that a line of which nothing is known has what the field says
    usual_mm = usual_mm / np.sqrt(SPREAD)
    weights, sigma = np.ones(len(lines)), np.full(len(lines), usual_mm)
    for _ in range(ROUNDS):
        for one in np.unique(kind):
            sigma[kind == one] = _posterior_sigma(
                schur + np.diag(np.where(kind == one, 0.0, weights / sigma**2)),
                pull,
                weights,
                kind == one,
                usual_mm,
            )
        posterior = np.linalg.inv(schur + np.diag(weights / sigma**2))
        # or it runs away
        second_moment = np.minimum((posterior @ pull) ** 2 + np.diag(posterior), MAX_OFFSET_MM**2)
        weights = (TAIL + 1) / (TAIL + second_moment / sigma**2)
    return sigma * np.sqrt(SPREAD / weights)


def _posterior_sigma(
    information: Array, pull: Array, weights: Array, own: Mask, usual_mm: float
) -> float:
    """Return the σ that is shared by `own`. information: without what σ says of these, and with the others' precision.

    The others are eliminated. In the eigenvectors of what is left, scaled by the weights, each σ costs one sum.
    """
    others = ~own
    by_others = np.linalg.solve(
        information[np.ix_(others, others)], information[np.ix_(others, own)]
    ).T
    left = information[np.ix_(own, own)] - by_others @ information[np.ix_(others, own)]
    root = np.sqrt(weights[own])
    values, vectors = np.linalg.eigh(left / np.outer(root, root))
    pulls = (pull[own] - by_others @ pull[others]) / root @ vectors
    total = np.maximum(values, 0.0) + SIGMAS_MM[:, None] ** -2
    log_p = (
        0.5 * np.sum(pulls**2 / total - np.log(total * SIGMAS_MM[:, None] ** 2), axis=1)
        - 0.5 * (np.log(SIGMAS_MM / usual_mm) / SIGMA_SPREAD + SIGMA_SPREAD) ** 2
    )
    p = np.exp(log_p - log_p.max())
    return float(np.sqrt(p @ SIGMAS_MM**2 / p.sum()))


Offsets = Mapping[str, Mapping[str, float]]  # mm by marking and part


class CameraState(Protocol):
    """A camera's parameters as a fit moves them, whatever the camera: see RayCameraParameters."""

    @property
    def names(self) -> tuple[str, ...]: ...

    @property
    def lens_names(self) -> tuple[str, ...]: ...

    @property
    def offsets_mm(self) -> Array: ...

    def values(self) -> dict[str, float]: ...

    def retract(self, delta: Array, free: Mask) -> Self: ...

    def project_jacobian(self, points: Array) -> tuple[Array, Array, Array]: ...

    def unproject(self, pixels: Array, z_mm: Array) -> Array: ...


State = TypeVar("State", bound=CameraState)


@dataclass(frozen=True, eq=False)
class ScalarPrior:
    """A parameter by name, its value and σ: one more residual. log_height is the logarithm of "height"."""

    name: str
    value: float
    sigma: float


@dataclass(eq=False)
class ClickResiduals:
    """Clicks on curves and on marks as arrays. Places along the curves are carried over between evaluations."""

    pixels: Array  # (n, 2), curves first, then spots
    owners: Indices  # (n, 2) observation, point
    base: Array  # curves (c, 3): a place on the line, or the arc's centre
    along: Array  # curves (c, 2): the line's direction; an arc's is found from its angle
    radius: Array  # curves (c,): 0 for a line
    half_mm: Array  # curves (c,): half of the line's length, 0 for an arc
    line_of: Indices  # curves (c,): which offset moves it across, or an arc outwards, -1 none
    tilt_of: Indices  # curves (c,): which offset tilts it, -1 none
    centre_of: Indices  # curves (c, 2): which offsets move an arc's centre along x and y, -1 none
    marks: Array  # (s, 3) field mm
    # of a state's offsets: marking and part, see PARTS
    offset_names: tuple[tuple[str, str], ...] = ()
    places: Array = member(default_factory=lambda: np.empty(0))  # along each curve: mm or radians

    @property
    def curves(self) -> int:
        return len(self.base)

    def offsets_mm(self, known_mm: Offsets) -> Array:
        """Return a state's offsets; 0 where one is not known."""
        return np.array(
            [known_mm.get(name, {}).get(part, 0.0) for name, part in self.offset_names], float
        )

    def by_marking(self, values: Array) -> dict[str, dict[str, float]]:
        """Return one value for each offset by marking and part: the inverse of offsets_mm."""
        table: dict[str, dict[str, float]] = {}
        for (name, part), value in zip(self.offset_names, values, strict=True):
            table.setdefault(name, {})[part] = float(value)
        return table

    @cached_property
    def _tilt_per_mm(self) -> Array:
        """Return how much further aside each curve is for a mm along it and a unit of tilt (c,)."""
        return np.where(
            self.tilt_of >= 0, TILT_SHARE / np.where(self.half_mm > 0, self.half_mm, 1.0), 0.0
        )

    @cached_property
    def _moves(self) -> tuple[Indices, Indices, Indices]:
        """Return which curve each offset moves, which offset that is, and which of PARTS: (k,) each."""
        moved_by = np.column_stack([self.line_of, self.tilt_of, self.centre_of])
        curve, part = np.nonzero(moved_by >= 0)
        return curve, moved_by[curve, part], part

    def only(self, keep: Mask) -> "ClickResiduals":
        """Return some of the clicks; keep (n,)."""
        curves, spots = keep[: self.curves], keep[self.curves :]
        return ClickResiduals(
            self.pixels[keep],
            self.owners[keep],
            self.base[curves],
            self.along[curves],
            self.radius[curves],
            self.half_mm[curves],
            self.line_of[curves],
            self.tilt_of[curves],
            self.centre_of[curves],
            self.marks[spots],
            self.offset_names,
            self.places[curves] if len(self.places) else self.places,
        )

    def residuals(self, state: CameraState) -> tuple[Array, Array]:
        """Return signed distances (c + 2 s,) px and their derivatives by every parameter of the state.

        They are of the curves' tangents at the places that were nearest for the state before this one, which costs one
        projection in place of two: a search ends where both are the same.
        """
        parameters = len(state.names)
        lines = len(state.offsets_mm)
        with np.errstate(all="ignore"):
            places = self.places if len(self.places) == self.curves else self._nearest(state)
            points, tangents, normals = self._curve(places, state)
            pixel, by_point, by = state.project_jacobian(points)
            along = _times(by_point[:, :, :2], tangents)
            self.places = self._nearer(places, pixel, along)
            across = _turned_left(along) / np.hypot(along[:, 0], along[:, 1])[:, None]
            r = ((self.pixels[: self.curves] - pixel) * across).sum(axis=1)
            j = np.zeros((len(r), parameters))
            j[:, : parameters - lines] = -(across[:, None, :] @ by)[:, 0]
            if lines:
                by_xy = -(across[:, None, :] @ by_point[:, :, :2])[:, 0]
                aside = (by_xy * normals).sum(axis=1)
                by_part = np.stack(
                    [aside, aside * self._lever(places), by_xy[:, 0], by_xy[:, 1]], axis=1
                )
                curve, offset, part = self._moves
                j[curve, parameters - lines + offset] = by_part[curve, part]
            if len(self.marks):
                pixel, _, by = state.project_jacobian(self.marks)
                r = np.concatenate([r, (self.pixels[self.curves :] - pixel).ravel()])
                spots = np.zeros((2 * len(self.marks), parameters))
                spots[:, : parameters - lines] = -by.reshape(2 * len(self.marks), -1)
                j = np.concatenate([j, spots])
        return r, j

    def _nearest(self, state: CameraState) -> Array:
        """Return the places (c,) on the curves nearest to the clicks."""
        places = self.first_places(state)
        for _ in range(FOOT_STEPS):
            points, tangents, _ = self._curve(places, state)
            pixel, by_point, _ = state.project_jacobian(points)
            before, places = (
                places,
                self._nearer(places, pixel, _times(by_point[:, :, :2], tangents)),
            )
            if (np.abs(places - before) < NEAR_ENOUGH_MM * self._place_per_mm).all():
                break
        return places

    def _nearer(self, places: Array, pixel: Array, along: Array) -> Array:
        """Return the places after a Newton step. pixel, along (c, 2): of them, and px per mm along the curve there."""
        mm = ((self.pixels[: self.curves] - pixel) * along).sum(axis=1) / (along**2).sum(axis=1)
        # a state from which a curve cannot be seen must not change the next start
        mm = np.where(np.isfinite(mm), mm, 0.0)
        return places + mm * self._place_per_mm

    def first_places(self, state: CameraState) -> Array:
        """Return where the clicks fall on the carpet, along each curve."""
        arm = state.unproject(self.pixels[: self.curves], self.base[:, 2]) - self.base[:, :2]
        places = np.where(
            self._is_arc, np.arctan2(arm[:, 1], arm[:, 0]), np.einsum("ni,ni->n", arm, self.along)
        )
        return np.where(np.isfinite(places), places, 0.0)

    @cached_property
    def _is_arc(self) -> Mask:
        return self.radius > 0

    @cached_property
    def _place_per_mm(self) -> Array:
        """Return what a mm along each curve is as a place: 1, or radians."""
        return 1 / np.where(self._is_arc, self.radius, 1.0)

    @cached_property
    def _left(self) -> Array:
        """Return the normals of lines (c, 2)."""
        return _turned_left(self.along)

    def _lever(self, places: Array) -> Array:
        """Return what a unit of tilt moves each curve by, there: ± TILT_SHARE at the line's ends."""
        return self._tilt_per_mm * places - TILT_SHARE

    def _curve(self, places: Array, state: CameraState) -> tuple[Array, Array, Array]:
        """Return the curves' points (c, 3) mm there, their tangents and normals (c, 2), in the field's frame."""
        known = np.append(state.offsets_mm, 0.0)  # -1 is none
        tilt = known[self.tilt_of]
        aside = known[self.line_of] + self._lever(places) * tilt + self.radius
        tangent, normal, ahead = self.along, self._left, self.along * places[:, None]
        if self._is_arc.any():
            arc = self._is_arc[:, None]
            normal = np.where(arc, np.stack([np.cos(places), np.sin(places)], axis=1), normal)
            tangent, ahead = np.where(arc, _turned_left(normal), tangent), np.where(arc, 0.0, ahead)
        points = self.base.copy()
        points[:, :2] += known[self.centre_of] + normal * aside[:, None] + ahead
        return points, tangent + normal * (self._tilt_per_mm * tilt)[:, None], normal


def _turned_left(vectors: Array) -> Array:
    return vectors[:, ::-1] * (-1.0, 1.0)


def _times(matrices: Array, vectors: Array) -> Array:
    """Return the products of matrices (n, 2, 2) and vectors (n, 2)."""
    return (matrices @ vectors[:, :, None])[:, :, 0]


def curve_of(
    feature: Line | Arc, z_mm: float = 0.0
) -> tuple[tuple[float, ...], tuple[float, ...], float]:
    """Return base, along and radius of a line or arc at that height, as ClickResiduals has them."""
    if isinstance(feature, Arc):
        return (*feature.centre, z_mm), (1.0, 0.0), feature.radius_mm
    start, end = np.array(feature.start), np.array(feature.end)
    return (*start, z_mm), tuple((end - start) / np.linalg.norm(end - start)), 0.0


def gather_clicks(
    observations: Observations, field: Field, region: Region, with_offsets: bool
) -> ClickResiduals:
    """Gather observations into arrays. with_offsets: each line and arc may lie beside its place, by unknown offsets.

    A second click on one place is left out.
    """
    curves, spots = [], []
    markings: dict[str, Line | Arc] = {}
    for i, observation in enumerate(observations):
        feature = field.feature(observation.feature, region)
        first = first_of_each_place(observation.points)
        taken = np.flatnonzero(first == np.arange(len(first)))
        if isinstance(feature, Landmark):
            spots += [
                (observation.points[k], (i, k), (*feature.position, observation.z_mm))
                for k in taken
            ]
            continue
        if taken.size:
            markings.setdefault(feature.name, feature)
        half_mm = feature.length_mm / 2 if isinstance(feature, Line) else 0.0
        curve = (*curve_of(feature, observation.z_mm), half_mm, feature.name)
        curves += [(observation.points[k], (i, k), *curve) for k in taken]
    names = (
        tuple(
            (name, part)
            for part in PARTS
            for name, marking in markings.items()
            if part == "across" or (part == "tilt") == isinstance(marking, Line)
        )
        if with_offsets
        else ()
    )
    index = {name: number for number, name in enumerate(names)}

    def column(rows: Sequence[tuple[object, ...]], index: int, width: int) -> Array:
        return np.array([row[index] for row in rows], np.float64).reshape(
            len(rows), *([width] if width else [])
        )

    moved_by = np.array(
        [[index.get((curve[6], part), -1) for part in PARTS] for curve in curves], int
    ).reshape(-1, 4)
    return ClickResiduals(
        np.concatenate([column(curves, 0, 2), column(spots, 0, 2)]),
        np.array([owner for _, owner, *_ in (*curves, *spots)], int).reshape(-1, 2),
        column(curves, 2, 3),
        column(curves, 3, 2),
        column(curves, 4, 0),
        column(curves, 5, 0),
        moved_by[:, 0],
        moved_by[:, 1],
        moved_by[:, 2:],
        column(spots, 2, 3),
        names,
    )


def line_incidences(observations: Observations, field: Field, region: Region) -> Incidences:
    """Return clicks on the carpet's straight lines and landmarks, for the linear methods, which know no arcs."""
    pixels, lines = [], []
    for observation in observations:
        feature = field.feature(observation.feature, region)
        if observation.z_mm != 0 or isinstance(feature, Arc):
            continue
        if isinstance(feature, Line):
            of_feature = [line_through(np.array(feature.start), np.array(feature.end))]
        else:
            x, y = feature.position
            of_feature = [np.array([1.0, 0.0, -x]), np.array([0.0, 1.0, -y])]
        for line in of_feature:
            pixels.append(observation.points)
            lines.append(np.tile(line, (len(observation.points), 1)))
    return Incidences(
        np.concatenate([np.empty((0, 2)), *pixels]), np.concatenate([np.empty((0, 3)), *lines])
    )
