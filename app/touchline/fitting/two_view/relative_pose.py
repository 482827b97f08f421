"""The relative pose of two cameras with known lenses, from matches: a rotation and a direction.

    E = [t]× R,   x_b = R x_a + t in the cameras' frames; pictures do not determine the length of t

First from F by way of the focal lengths, of the four solutions the one that puts the points before both cameras
(cheirality: H. Longuet-Higgins 1981); then R and the direction of t alone are refined on Sampson's distances. Between
calibrated cameras R and t are known in millimetres, and matches only check them.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from touchline.core.errors import FitFailed
from touchline.core.geometry import Array, Mask, Points, as_matches, homogeneous
from touchline.fitting.two_view.consensus import TAIL, minimise_weighted
from touchline.fitting.two_view.epipolar import epipolar_px, sampson_jacobian
from touchline.fitting.two_view.fundamental_matrix import fundamental_matrix
from touchline.models.ray_camera import RayCamera
from touchline.models.rotation import cross_matrix, matrix_from_vector, nearest_rotation

IN_FRONT_SHARE = 0.8  # of the good matches; noise alone puts a few far ones behind
ROUNDS = 12
MAX_SIGMA_DEG = 20.0  # a direction known no better is not known


@dataclass(frozen=True, eq=False)
class RelativePose:
    """b_from_a (3, 3), direction (3,) of camera a's centre in camera b's frame; good (n,), epipolar_px (n,) ideal px.

    Ideal pixels are those that a pinhole of the same focal length would see. rotation_sigma_deg, direction_sigma_deg:
    one σ, from the good matches' own scatter.
    """

    b_from_a: Array
    direction: Array
    good: Mask
    epipolar_px: Array
    sigma_px: float
    rotation_sigma_deg: float
    direction_sigma_deg: float

    @property
    def essential(self) -> Array:
        return cross_matrix(self.direction) @ self.b_from_a


def relative_pose(camera_a: RayCamera, camera_b: RayCamera, a: Points, b: Points) -> RelativePose:
    """Estimate camera_a's pose in camera_b's frame from matches (n, 2) raw px; only the cameras' lenses are used.

    Raises FitFailed as fundamental_matrix does, and cheirality where no pose puts the points before both cameras.
    """
    a, b = as_matches(a, b)
    ideal_a, ideal_b = ideal_px(camera_a, a), ideal_px(camera_b, b)
    visible = np.all(np.isfinite(ideal_a) & np.isfinite(ideal_b), axis=1)
    found = fundamental_matrix(ideal_a[visible], ideal_b[visible])
    good_a, good_b = ideal_a[visible][found.good], ideal_b[visible][found.good]
    start = _in_front(found.fundamental, camera_a.focal_px, camera_b.focal_px, good_a, good_b)
    state = _refine(start, good_a, good_b, found.sigma_px)
    fundamental = state.fundamental()
    residuals, jacobian = state.residuals(good_a, good_b)
    sigma = float(np.sqrt(np.sum(residuals**2) / max(len(residuals) - 5, 1)))
    covariance = sigma**2 * np.linalg.pinv(jacobian.T @ jacobian, hermitian=True)
    rotation_sigma, direction_sigma = (float(np.degrees(np.sqrt(np.trace(c))))
                                       for c in (covariance[:3, :3], covariance[3:, 3:]))
    if not max(rotation_sigma, direction_sigma) < MAX_SIGMA_DEG:
        raise FitFailed("The matches determine the relative pose of the cameras only within "
                        f"{max(rotation_sigma, direction_sigma):.0f}°.",
                        "Match points at more places and more heights.", reason="not-determined")
    good = np.zeros(len(visible), bool)
    good[np.flatnonzero(visible)[found.good]] = True
    miss = np.full(len(visible), np.nan)
    miss[visible] = epipolar_px(fundamental, ideal_a[visible], ideal_b[visible])
    return RelativePose(state.rotation, state.direction, good, miss, sigma, rotation_sigma, direction_sigma)


def pose_between(camera_a: RayCamera, camera_b: RayCamera) -> tuple[Array, Array]:
    """Return b_from_a (3, 3) and camera a's centre in b's frame, mm, from their calibrations."""
    b_from_a = camera_b.camera_from_field @ camera_a.camera_from_field.T
    return b_from_a, camera_b.camera_from_field @ (np.array(camera_a.position_mm) - np.array(camera_b.position_mm))


def calibrated_epipolar_px(camera_a: RayCamera, camera_b: RayCamera, a: Points, b: Points) -> Array:
    """Return (n,) ideal px: how far matches (n, 2) raw px are from the epipolar lines of two calibrations.

    It sees only errors across those lines: two cameras that err alike, or along them, pass. NaN beyond a lens.
    Raises FitFailed no-baseline where both cameras stand at the same place.
    """
    a, b = as_matches(a, b)
    rotation, centre = pose_between(camera_a, camera_b)
    if not np.linalg.norm(centre) > 1.0:  # mm
        raise FitFailed("Both calibrations have the same camera position.", "Compare two different cameras.",
                        reason="no-baseline")
    state = RelativePoseParameters(rotation, centre / np.linalg.norm(centre), camera_a.focal_px, camera_b.focal_px)
    return epipolar_px(state.fundamental(), ideal_px(camera_a, a), ideal_px(camera_b, b))


def ideal_px(camera: RayCamera, raw: Points) -> Points:
    """Map raw px (n, 2) to the pixels of a pinhole of the same focal length, about its centre; NaN out of reach."""
    rays = camera.rays(raw)
    with np.errstate(all="ignore"):
        return camera.focal_px * rays[..., :2] / np.where(rays[..., 2:] > 0, rays[..., 2:], np.nan)


@dataclass(frozen=True, eq=False)
class RelativePoseParameters:
    """R and the direction of t as a fit moves them; pixels about the centre."""

    rotation: Array
    direction: Array
    focal_a: float
    focal_b: float

    def fundamental(self) -> Array:
        f = self._pixels(cross_matrix(self.direction) @ self.rotation)
        return f / np.linalg.norm(f)

    def _pixels(self, essential: Array) -> Array:
        return np.diag([1 / self.focal_b, 1 / self.focal_b, 1]) @ essential @ np.diag(
            [1 / self.focal_a, 1 / self.focal_a, 1])

    def _sideways(self) -> Array:
        """Return (2, 3): two unit vectors across the direction."""
        return np.linalg.svd(self.direction[None])[2][1:]

    def retract(self, delta: Array) -> Self:
        """Apply delta (5,): a turn before R, and two angles of the direction."""
        ahead = self.direction + delta[3:] @ self._sideways()
        return replace(self, rotation=matrix_from_vector(delta[:3]) @ self.rotation,
                       direction=ahead / np.linalg.norm(ahead))

    def residuals(self, a: Points, b: Points) -> tuple[Array, Array]:
        """Return Sampson's distance (n,) px and its derivatives (n, 5)."""
        across = cross_matrix(self.direction)
        by = [self._pixels(across @ cross_matrix(e) @ self.rotation) for e in np.eye(3)]
        by += [self._pixels(cross_matrix(side) @ self.rotation) for side in self._sideways()]
        return sampson_jacobian(self._pixels(across @ self.rotation), np.stack(by), a, b)


def _in_front(fundamental: Array, focal_a: float, focal_b: float, a: Points, b: Points) -> RelativePoseParameters:
    """Return the one of four poses that puts most points before both cameras."""
    u, _, vt = np.linalg.svd(np.diag([focal_b, focal_b, 1]) @ fundamental @ np.diag([focal_a, focal_a, 1]))
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    best, most = None, -1.0
    for quarter in (turn, turn.T):
        rotation = u @ quarter @ vt
        rotation = nearest_rotation(rotation * np.sign(np.linalg.det(rotation)))
        for direction in (u[:, 2], -u[:, 2]):
            state = RelativePoseParameters(rotation, direction, focal_a, focal_b)
            share = float(np.mean(_both_ahead(state, a, b)))
            if share > most:
                best, most = state, share
    if best is None or most < IN_FRONT_SHARE:
        raise FitFailed(f"No pose places the matched points in front of both cameras ({100 * most:.0f} % at best).",
                        "Check the image and the lens of each camera.", reason="cheirality")
    return best


def _both_ahead(state: RelativePoseParameters, a: Points, b: Points) -> Mask:
    """Return (n,) whether the point where a match's rays pass nearest is ahead of both cameras."""
    ray_a = homogeneous(a / state.focal_a) @ state.rotation.T  # in b's frame, from `direction`
    ray_b = homogeneous(b / state.focal_b)
    # least squares of  direction + α ray_a = β ray_b
    aa, bb, ab = (np.sum(p * q, axis=1) for p, q in ((ray_a, ray_a), (ray_b, ray_b), (ray_a, ray_b)))
    at, bt = ray_a @ state.direction, ray_b @ state.direction
    with np.errstate(all="ignore"):
        slope = aa * bb - ab**2
        return ((bt * ab - at * bb) / slope > 0) & ((bt * aa - at * ab) / slope > 0)


def _refine(start: RelativePoseParameters, a: Points, b: Points, sigma: float) -> RelativePoseParameters:
    """Refine by Student-weighted least squares."""
    state = start
    for _ in range(ROUNDS):
        r = state.residuals(a, b)[0]
        state = minimise_weighted(state, a, b, np.sqrt((TAIL + 1) / (TAIL + (r / sigma) ** 2)) / sigma, max_steps=10)
    return state
