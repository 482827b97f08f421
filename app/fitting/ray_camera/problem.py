"""Residuals of clicks: how far they lie, in pixels, from the curves and points they were made on.

A click on a line or arc has one residual: its distance, across, from the projected curve at the nearest place. Where
along the curve it was made is found anew at every evaluation and costs no unknown: at the nearest place, moving along
the curve changes the distance by nothing (orthogonal distance regression, P. Boggs and J. Rogers 1990).
"""

from dataclasses import dataclass
from dataclasses import field as member

import numpy as np

from app.core.field import Arc, Field, Landmark, Line, Region
from app.core.geometry import Array
from app.core.records import Observations
from app.fitting.linear import Incidences, line_through
from app.fitting.ray_camera.parameters import RayCameraParameters

FOOT_STEPS = 1  # from the last evaluation's place, which was nearly right; the first one takes more
FIRST_FOOT_STEPS = 12


@dataclass(frozen=True, eq=False)
class ScalarPrior:
    """A parameter by name, its value and σ: one more residual. wide: it only keeps an unknown from diverging."""

    name: str
    value: float
    sigma: float
    wide: bool = False


@dataclass(eq=False)
class ClickResiduals:
    """Clicks on curves and on marks as arrays. Places along the curves are carried over between evaluations."""

    pixels: Array  # (n, 2), curves first, then spots
    owners: Array  # (n, 2) observation, point
    base: Array  # curves (c, 3): a place on the line, or the arc's centre
    along: Array  # curves (c, 2): the line's direction; an arc's is found from its angle
    radius: Array  # curves (c,): 0 for a line
    line_of: Array  # curves (c,): which offset moves it, -1 none
    marks: Array  # (s, 3) field mm
    line_names: tuple[str, ...]
    places: Array = member(default_factory=lambda: np.empty(0))  # along each curve: mm or radians

    @property
    def curves(self) -> int:
        return len(self.base)

    def only(self, keep: Array) -> "ClickResiduals":
        """Return some of the clicks; keep (n,) bool."""
        curves, spots = keep[:self.curves], keep[self.curves:]
        return ClickResiduals(self.pixels[keep], self.owners[keep], self.base[curves], self.along[curves],
                          self.radius[curves], self.line_of[curves], self.marks[spots], self.line_names,
                          self.places[curves] if len(self.places) else self.places)

    def residuals(self, state: RayCameraParameters) -> tuple[Array, Array]:
        """Return signed distances (c + 2 s,) px and their derivatives by every parameter of the state."""
        parameters = len(state.names)
        lines = len(state.offsets_mm)
        with np.errstate(all="ignore"):
            points, tangents, normals = self._nearest(state)
            pixel, by_point, by = state.project_jacobian(points)
            along = np.einsum("nij,nj->ni", by_point, tangents)
            along /= np.linalg.norm(along, axis=1, keepdims=True)
            across = np.stack([-along[:, 1], along[:, 0]], axis=1)
            r = np.einsum("ni,ni->n", across, self.pixels[:self.curves] - pixel)
            j = np.zeros((len(r), parameters))
            j[:, :parameters - lines] = -np.einsum("ni,nik->nk", across, by)
            moved = np.flatnonzero(self.line_of >= 0)
            if lines and moved.size:
                j[moved, parameters - lines + self.line_of[moved]] = -np.einsum(
                    "ni,nij,nj->n", across[moved], by_point[moved], normals[moved])
            if len(self.marks):
                pixel, _, by = state.project_jacobian(self.marks)
                r = np.concatenate([r, (self.pixels[self.curves:] - pixel).ravel()])
                spots = np.zeros((2 * len(self.marks), parameters))
                spots[:, :parameters - lines] = -by.reshape(2 * len(self.marks), -1)
                j = np.concatenate([j, spots])
        return r, j

    def _nearest(self, state: RayCameraParameters) -> tuple[Array, Array, Array]:
        """Return the places on the curves nearest to the clicks: points, unit tangents and normals, (c, 3) each."""
        first = len(self.places) != self.curves
        places = begin = self._first_places(state) if first else self.places
        clicks = self.pixels[:self.curves]
        for _ in range(FIRST_FOOT_STEPS if first else FOOT_STEPS):
            points, tangents, _ = self._curve(places, state)
            pixel, by_point, _ = state.project_jacobian(points)
            along = np.einsum("nij,nj->ni", by_point, tangents)
            step = np.einsum("ni,ni->n", clicks - pixel, along) / np.einsum("ni,ni->n", along, along)  # mm
            step = np.where(np.isfinite(step), step, 0.0)
            places = places + np.where(self.radius > 0, step / np.where(self.radius > 0, self.radius, 1), step)
            if np.abs(step).max(initial=0.0) < 1e-7:
                break
        # A state from which a curve cannot be seen must not change the next start.
        self.places = np.where(np.isfinite(pixel).all(axis=1), places, begin)
        return self._curve(places, state)

    def _first_places(self, state: RayCameraParameters) -> Array:
        """Return where the clicks fall on the carpet, along each curve."""
        arm = state.unproject(self.pixels[:self.curves], self.base[:, 2]) - self.base[:, :2]
        places = np.where(self.radius > 0, np.arctan2(arm[:, 1], arm[:, 0]), np.einsum("ni,ni->n", arm, self.along))
        return np.where(np.isfinite(places), places, 0.0)

    def _curve(self, places: Array, state: RayCameraParameters) -> tuple[Array, Array, Array]:
        arc = (self.radius > 0)[:, None]
        cos_sin = np.stack([np.cos(places), np.sin(places)], axis=1)
        tangent = np.where(arc, np.stack([-cos_sin[:, 1], cos_sin[:, 0]], axis=1), self.along)
        normal = np.where(arc, cos_sin, np.stack([-self.along[:, 1], self.along[:, 0]], axis=1))
        offset = np.where(self.line_of >= 0, np.append(state.offsets_mm, 0.0)[self.line_of], 0.0)
        out = np.where(arc[:, 0], self.radius, 0.0) + offset
        xy = self.base[:, :2] + normal * out[:, None] + np.where(arc, 0.0, self.along * places[:, None])
        flat = np.zeros((len(places), 1))
        return (np.concatenate([xy, self.base[:, 2:]], axis=1), np.concatenate([tangent, flat], axis=1),
                np.concatenate([normal, flat], axis=1))


def curve_of(feature: Line | Arc, z_mm: float = 0.0) -> tuple[tuple[float, ...], tuple[float, ...], float]:
    """Return base, along and radius of a line or arc at that height, as ClickResiduals has them."""
    if isinstance(feature, Arc):
        return (*feature.centre, z_mm), (1.0, 0.0), feature.radius_mm
    start, end = np.array(feature.start), np.array(feature.end)
    return (*start, z_mm), tuple((end - start) / np.linalg.norm(end - start)), 0.0


def gather_clicks(observations: Observations, field: Field, region: Region, with_offsets: bool) -> ClickResiduals:
    """Gather observations into arrays. with_offsets: each line may lie beside its place, by its own unknown."""
    curves, spots = [], []
    names: list[str] = []
    for i, observation in enumerate(observations):
        feature = field.feature(observation.feature, region)
        for k, pixel in enumerate(observation.points):
            if isinstance(feature, Landmark):
                spots.append((pixel, (i, k), (*feature.position, observation.z_mm)))
                continue
            if with_offsets and feature.name not in names:
                names.append(feature.name)
            line = names.index(feature.name) if with_offsets else -1
            curves.append((pixel, (i, k), *curve_of(feature, observation.z_mm), line))

    def column(rows: list, index: int, width: int, kind: type = float) -> Array:
        return np.array([row[index] for row in rows], kind).reshape(len(rows), *([width] if width else []))

    return ClickResiduals(np.concatenate([column(curves, 0, 2), column(spots, 0, 2)]),
                      np.concatenate([column(curves, 1, 2, int), column(spots, 1, 2, int)]),
                      column(curves, 2, 3), column(curves, 3, 2), column(curves, 4, 0), column(curves, 5, 0, int),
                      column(spots, 2, 3), tuple(names))


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
    return Incidences(np.concatenate([np.empty((0, 2)), *pixels]), np.concatenate([np.empty((0, 3)), *lines]))
