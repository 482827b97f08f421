"""What a board calibration minimises: what is observed, what is estimated, residuals and their derivatives.

    point  = place + warp_x (1 - u²) ẑ + warp_y (1 - v²) ẑ      u, v from -1 to 1 across the board
    ray    = R_view point + t_view
    pixel  = centre + focal · (1, aspect) · distort(ray)

A printed board is never flat; two numbers for its bow take most of it (D. Kogan's mrcal does the same). All views lie
side by side in padded arrays.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np

from touchline.boards.board import BoardView
from touchline.core.geometry import Array, ImageSize, Indices, Mask
from touchline.models.intrinsics import PINHOLE_PARAMETERS, Intrinsics
from touchline.models.lenses import Lens
from touchline.models.rotation import matrix_from_vector

WARP = ("warp_x", "warp_y")  # mm, at the middle against the edges
# Priors, as one σ: so wide that corners decide, and narrow enough that no unknown runs off to infinity. Shares of the
# image's width and of the board's half diagonal where they are lengths.
PRIOR_SIGMAS = {"log_focal": 2.0, "aspect": 0.5, "centre": 0.5, "p1": 0.3, "p2": 0.3, "warp": 0.05}
TERM_PRIOR_SIGMA = 10.0  # of all other terms: a rational lens has terms of a few units
# of the image's width: the residual of a corner that a lens cannot project
LOST_CORNER_SHARE = 0.25


@dataclass(frozen=True, eq=False)
class BoardObservations:
    """The corners of v views, padded to m each; present (v, m) marks what is no padding."""

    pixels: Array  # (v, m, 2) raw
    places: Array  # (v, m, 3) mm
    present: Mask  # (v, m)
    bow_shape: Array  # (v, m, 2): 1 - u², 1 - v²
    half_diagonal_mm: float  # of the board
    names: tuple[str, ...]

    @classmethod
    def of(cls, views: tuple[BoardView, ...]) -> Self:
        """Pad with each view's first corner, so that padding is finite too."""
        fullest = max(len(view.pixels) for view in views)
        every_place = np.concatenate([view.places_mm[:, :2] for view in views])
        low, high = every_place.min(axis=0), every_place.max(axis=0)
        half = np.maximum((high - low) / 2, 1e-9)
        pixels, places = np.empty((len(views), fullest, 2)), np.empty((len(views), fullest, 3))
        present = np.zeros((len(views), fullest), bool)
        for i, view in enumerate(views):
            n = len(view.pixels)
            pixels[i, :n], places[i, :n], present[i, :n] = view.pixels, view.places_mm, True
            pixels[i, n:], places[i, n:] = view.pixels[0], view.places_mm[0]
        across = (places[..., :2] - (low + high) / 2) / half  # u, v
        return cls(
            pixels,
            places,
            present,
            1 - across**2,
            float(np.linalg.norm(half)),
            tuple(view.name for view in views),
        )

    def only(self, keep: Mask | Indices) -> Self:
        """Return some of the views."""
        index = np.arange(len(self.names))[keep]
        return replace(
            self,
            pixels=self.pixels[index],
            places=self.places[index],
            present=self.present[index],
            bow_shape=self.bow_shape[index],
            names=tuple(self.names[i] for i in index),
        )

    def without(self, outliers: Mask) -> Self:
        """Return the same without some corners (v, m)."""
        return replace(self, present=self.present & ~outliers)


@dataclass(frozen=True, eq=False)
class BoardParameters:
    """A lens, the bow of the board and a pose for each view.

    The focal length is its logarithm, so that it stays positive; rotations are matrices, updated from the left.
    """

    lens: type[Lens]
    log_focal: float
    aspect: float
    centre_px: Array
    terms: Array
    warp_mm: Array
    rotations: Array  # (v, 3, 3) camera_from_board
    translations_mm: Array  # (v, 3)

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the shared parameters in order: what a free mask refers to."""
        return (*PINHOLE_PARAMETERS, *self.lens.TERMS, *WARP)

    @property
    def shared(self) -> Array:
        """Return the values of names."""
        return np.array([self.log_focal, self.aspect, *self.centre_px, *self.terms, *self.warp_mm])

    def with_shared(self, values: Array) -> Self:
        """Return the same poses with other values of names."""
        n = 4 + len(self.terms)
        return replace(
            self,
            log_focal=float(values[0]),
            aspect=float(values[1]),
            centre_px=np.array(values[2:4]),
            terms=np.array(values[4:n]),
            warp_mm=np.array(values[n:]),
        )

    def only(self, keep: Mask | Indices) -> Self:
        """Return the state of some of the views."""
        return replace(
            self, rotations=self.rotations[keep], translations_mm=self.translations_mm[keep]
        )

    def with_poses_of(self, full: Self, keep: Mask | Indices) -> Self:
        """Return this state of some of the views, with the other views' poses from `full`."""
        rotations, translations = full.rotations.copy(), full.translations_mm.copy()
        rotations[keep], translations[keep] = self.rotations, self.translations_mm
        return replace(self, rotations=rotations, translations_mm=translations)

    def retract(self, shared_step: Array, free: Mask, pose_steps: Array) -> Self:
        """Apply a step: shared_step of the free shared parameters, pose_steps (v, 6) a rotation and a shift each."""
        full = np.zeros(len(free))
        full[free] = shared_step
        # of the logarithm: no step changes the focal length more than e-fold
        full[0] = np.clip(full[0], -1, 1)
        turned = matrix_from_vector(pose_steps[:, :3]) @ self.rotations
        return replace(
            self.with_shared(self.shared + full),
            rotations=turned,
            translations_mm=self.translations_mm + pose_steps[:, 3:],
        )

    def camera_points(self, observations: BoardObservations) -> Array:
        """Return the corners in the camera's frame, mm (v, m, 3)."""
        return (
            self._board_points(observations) @ self.rotations.transpose(0, 2, 1)
            + self.translations_mm[:, None]
        )

    def project(self, observations: BoardObservations) -> Array:
        """Return the corners' raw pixels (v, m, 2)."""
        return (
            self.lens.distort(self.terms, self.camera_points(observations)) * self._focal
            + self.centre_px
        )

    def project_jacobian(
        self, observations: BoardObservations, free: Mask
    ) -> tuple[Array, Array, Array]:
        """Return pixels (v, m, 2), derivatives by the free ones of names (v, m, 2, n), and by the pose (v, m, 2, 6)."""
        arms = self._board_points(observations) @ self.rotations.transpose(0, 2, 1)
        plane, by_ray, by_terms = self.lens.distort_jacobian(
            self.terms, arms + self.translations_mm[:, None]
        )
        focal = self._focal
        by_ray = by_ray * focal[:, None]
        # the board's z, along which a bow moves corners
        normal = self.rotations[:, None, None, :, 2]
        by_shared = np.zeros((*plane.shape, int(free.sum())), by_terms.dtype)
        for column, index in enumerate(np.flatnonzero(free)):
            name, into = self.names[index], by_shared[..., column]
            if name == "log_focal":
                into[...] = plane * focal
            elif name == "aspect":
                into[..., 1] = plane[..., 1] * focal[0]
            elif name in ("centre_x", "centre_y"):
                into[..., int(name == "centre_y")] = 1.0
            elif name in WARP:
                into[...] = (
                    np.sum(by_ray * normal, axis=-1)
                    * observations.bow_shape[..., WARP.index(name), None]
                )
            else:
                into[...] = by_terms[..., index - 4] * focal
        return plane * focal + self.centre_px, by_shared, _by_pose(arms, by_ray)

    def lens_of(
        self,
        model: str,
        image_size: ImageSize,
        estimated: tuple[str, ...] = (),
        covariance: Array | None = None,
    ) -> Intrinsics:
        """Return the lens alone."""
        rows = () if covariance is None else tuple(tuple(map(float, row)) for row in covariance)
        return Intrinsics(
            model,
            tuple(map(float, self.terms)),
            float(np.exp(self.log_focal)),
            float(self.aspect),
            (float(self.centre_px[0]), float(self.centre_px[1])),
            image_size,
            estimated,
            rows,
        )

    def _board_points(self, observations: BoardObservations) -> Array:
        """Return the corners of the bowed board in its own frame, mm (v, m, 3)."""
        points = observations.places.astype(np.result_type(self.warp_mm, float))
        points[..., 2] = points[..., 2] + observations.bow_shape @ self.warp_mm
        return points

    @property
    def _focal(self) -> Array:
        return np.exp(self.log_focal) * np.array([1.0, self.aspect])


def _by_pose(arms: Array, by_ray: Array) -> Array:
    """Return derivatives of pixels by a turn and a shift of the pose, (v, m, 2, 6).

    arms (v, m, 3) mm: corners from the board's origin, turned into the camera's frame; by_ray (v, m, 2, 3). A turn ω
    after the rotation moves a corner by ω × arm: d pixel / d ω = arm × (d pixel / d ray), row by row.
    """
    by_pose = np.empty((*by_ray.shape[:-1], 6), by_ray.dtype)
    ax, ay, az = (arms[..., None, i] for i in range(3))
    bx, by, bz = (by_ray[..., i] for i in range(3))
    by_pose[..., 0] = ay * bz - az * by
    by_pose[..., 1] = az * bx - ax * bz
    by_pose[..., 2] = ax * by - ay * bx
    by_pose[..., 3:] = by_ray
    return by_pose


class BlockLinearisation(NamedTuple):
    """Residuals and their derivatives, all in σ, 0 where there is no corner."""

    residuals: Array  # (v, m, 2)
    by_shared: Array  # (v, m, 2, n)
    by_pose: Array  # (v, m, 2, 6)


@dataclass(frozen=True, eq=False)
class BoardProblem:
    """What is minimised: distances of corners from their projections in σ, and wide priors.

    free: which shared parameters are estimated, by BoardParameters.names.
    """

    observations: BoardObservations
    free: Mask
    image_size: ImageSize
    sigma_px: float

    def linearise(self, state: BoardParameters) -> BlockLinearisation:
        """Return residuals and derivatives in σ, 0 where there is no corner; beyond the horizon there is no slope."""
        with np.errstate(all="ignore"):
            pixels, by_shared, by_pose = state.project_jacobian(self.observations, self.free)
            residuals = pixels - self.observations.pixels
            lost = ~(
                np.isfinite(residuals).all(axis=-1)
                & np.isfinite(by_shared).all(axis=(-2, -1))
                & np.isfinite(by_pose).all(axis=(-2, -1))
            )
        if lost.any():  # beyond this lens's horizon: a large residual without a direction
            residuals[lost], by_shared[lost], by_pose[lost] = (
                LOST_CORNER_SHARE * self.image_size.width,
                0,
                0,
            )
        weight = np.where(self.observations.present, 1 / self.sigma_px, 0.0)[..., None]
        residuals *= weight
        by_shared *= weight[..., None]
        by_pose *= weight[..., None]
        return BlockLinearisation(residuals, by_shared, by_pose)

    def residuals_px(self, state: BoardParameters) -> Array:
        """Return residuals (v, m, 2) px, observed − projected; NaN where no corner is, or it cannot be projected."""
        with np.errstate(all="ignore"):
            residuals = self.observations.pixels - state.project(self.observations)
            return np.where(self.observations.present[..., None], residuals, np.nan)

    def prior(self, state: BoardParameters) -> tuple[Array, Array]:
        """Return the mean and 1/σ of the prior of each free parameter."""
        width, means, weights = self.image_size.width, [], []
        for name in state.names:
            if name == "log_focal":
                mean, sigma = float(np.log(width)), PRIOR_SIGMAS[name]
            elif name == "aspect":
                mean, sigma = 1.0, PRIOR_SIGMAS[name]
            elif name.startswith("centre"):
                mean, sigma = (
                    self.image_size.centre[name == "centre_y"],
                    PRIOR_SIGMAS["centre"] * width,
                )
            elif name in WARP:
                mean, sigma = 0.0, PRIOR_SIGMAS["warp"] * self.observations.half_diagonal_mm
            else:
                mean, sigma = 0.0, PRIOR_SIGMAS.get(name, TERM_PRIOR_SIGMA)
            means.append(mean)
            weights.append(1 / sigma)
        return np.array(means)[self.free], np.array(weights)[self.free]


def free_mask(
    state: BoardParameters, terms: tuple[str, ...], *, aspect: bool, centre: bool, warp: bool
) -> Mask:
    """Return which of state.names are estimated."""
    free = (
        "log_focal",
        *terms,
        *(("aspect",) if aspect else ()),
        *(("centre_x", "centre_y") if centre else ()),
        *(WARP if warp else ()),
    )
    return np.array([name in free for name in state.names])
