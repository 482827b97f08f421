"""Where the search for a lens from a board begins: homographies, Zhang's intrinsics, poses along rays, a scan.

Z. Zhang, "A flexible new technique for camera calibration", PAMI 2000. His closed form supposes a lens without
distortion; where the lens is strong, a scan over focal lengths, judged by how well poses fit along the rays, is what
finds the right minimum.
"""

from itertools import product

import numpy as np

from touchline.core.geometry import Array, ImageSize, Mask, homogeneous
from touchline.fitting.board.parameters import BoardObservations, BoardParameters
from touchline.fitting.ray_camera.fit import lens_fitter
from touchline.models.lenses import Lens
from touchline.models.ray_camera import RayCamera

SCAN_VIEWS = 12  # enough to tell the local minima apart
SCAN_FOCAL = np.geomspace(0.25, 6.0, 14)  # of the picture's width: 127° to 9.5° across
SCAN_BEND = (0.0, -0.15, -0.35)  # k1 of the scanned lenses, r_d = r (1 + k1 r²): none, usual, strong barrel


def homographies(observations: BoardObservations) -> Array:
    """Return H of every view, pixel ~ H (x, y, 1), (v, 3, 3), by the normalised direct linear transform."""
    flat = observations.places[..., :2]
    to_unit_p, pixels = _normalised(observations.pixels, observations.present)
    to_unit_b, places = _normalised(flat, observations.present)
    h = _null_vectors(homogeneous(pixels), places, observations.present)
    h = np.linalg.inv(to_unit_p) @ h @ to_unit_b
    return h / h[:, 2:, 2:]


def zhang_intrinsics(h: Array, image_size: ImageSize) -> tuple[float, float]:
    """Return (focal_px, aspect) of homographies, the principal point in the picture's middle; NaN where undetermined.

    Columns of K⁻¹ H are perpendicular and of one length: two linear equations in 1/fx² and 1/fy² a view.
    """
    cx, cy = image_size.centre
    shifted = h.copy()
    shifted[:, 0] -= cx * h[:, 2]
    shifted[:, 1] -= cy * h[:, 2]
    a, b = shifted[:, :, 0], shifted[:, :, 1]
    left = np.concatenate([a[:, :2] * b[:, :2], a[:, :2] ** 2 - b[:, :2] ** 2])
    right = np.concatenate([-a[:, 2] * b[:, 2], b[:, 2] ** 2 - a[:, 2] ** 2])
    scale = np.maximum(np.tile(np.sum(a[:, :2] ** 2 + b[:, :2] ** 2, axis=1), 2), 1e-300)
    inverse, *_ = np.linalg.lstsq(left / scale[:, None], right / scale, rcond=None)
    if not (inverse > 0).all():
        return float("nan"), float("nan")
    fx, fy = 1 / np.sqrt(inverse)
    return float(fx), float(fy / fx)


def poses_from_rays(rays: Array, observations: BoardObservations) -> tuple[Array, Array]:
    """Return camera_from_board of every view, (v, 3, 3) and (v, 3) mm, from unit rays (v, m, 3), also past 90°.

    ray × (r1 x + r2 y + t) = 0 is linear in the columns; the rotation nearest to them follows.
    """
    to_unit, places = _normalised(observations.places[..., :2], observations.present)
    rays = np.where(np.isfinite(rays), rays, np.nan)
    m = _null_vectors(np.nan_to_num(rays), places, observations.present & np.isfinite(rays).all(axis=-1)) @ to_unit
    length = np.sqrt(np.linalg.norm(m[:, :, 0], axis=1) * np.linalg.norm(m[:, :, 1], axis=1))
    m = m / np.maximum(length, 1e-300)[:, None, None]
    flat = np.concatenate([observations.places[..., :2], np.ones((*observations.places.shape[:2], 1))], -1)
    transformed = flat @ m.transpose(0, 2, 1)
    ahead = np.sum(np.where(observations.present, np.sum(transformed * np.nan_to_num(rays), -1), 0), axis=1)
    m = m * np.where(ahead < 0, -1.0, 1.0)[:, None, None]
    columns = np.stack([m[:, :, 0], m[:, :, 1], np.cross(m[:, :, 0], m[:, :, 1])], axis=-1)
    u, _, vt = np.linalg.svd(np.where(np.isfinite(columns).all(axis=(1, 2), keepdims=True), columns, np.eye(3)))
    u[:, :, 2] *= np.sign(np.linalg.det(u @ vt))[:, None]
    return u @ vt, m[:, :, 2]


def state_with_poses(lens: type[Lens], terms: Array, focal_px: float, aspect: float, centre_px: Array,
                     observations: BoardObservations) -> BoardParameters:
    """Return the state of a roughly known lens, with every pose straight from its rays."""
    with np.errstate(all="ignore"):
        plane = (observations.pixels - centre_px) / (focal_px * np.array([1.0, aspect]))
        rays = lens.undistort(terms, plane)
        rays = rays / np.linalg.norm(rays, axis=-1, keepdims=True)
    rotations, shifts = poses_from_rays(rays, observations)
    return BoardParameters(lens, float(np.log(focal_px)), aspect, np.array(centre_px, float), np.array(terms, float),
                      np.zeros(2), rotations, shifts)


def start_states(model: type[RayCamera], observations: BoardObservations, image_size: ImageSize, bend: bool,
                 best: int = 4) -> list[BoardParameters]:
    """Return Zhang's lens and the best of the scan, each with all poses; bend: whether the lens may distort."""
    lens, centre = model.LENS, np.array(image_size.centre)
    few = observations.only(np.unique(np.linspace(0, len(observations.pixels) - 1, SCAN_VIEWS).astype(int)))
    bends = [_terms(model, k1, bend) for k1 in (SCAN_BEND if bend else (0.0,))]
    tried = list(product(SCAN_FOCAL * image_size.width, bends))
    focal, aspect = zhang_intrinsics(homographies(observations), image_size)
    if 0.05 * image_size.width < focal < 100 * image_size.width and 0.5 <= aspect <= 2:
        tried += [(focal, terms) for terms in bends]
    order = np.argsort([_misfit(state_with_poses(lens, terms, f, 1.0, centre, few), few) for f, terms in tried])
    return [state_with_poses(lens, terms, f, 1.0, centre, observations)
            for f, terms in (tried[i] for i in order[:best])]


def _terms(model: type[RayCamera], k1: float, bend: bool) -> Array:
    return lens_fitter(model).start_terms(k1) if bend else np.zeros(len(model.LENS.TERMS))


def _misfit(state: BoardParameters, observations: BoardObservations) -> float:
    """Return the median distance of the corners, px; what a lens cannot project counts as far."""
    with np.errstate(all="ignore"):
        away = np.linalg.norm(state.project(observations) - observations.pixels, axis=-1)[observations.present]
    return float(np.median(np.where(np.isfinite(away), away, 1e6)))


def _normalised(points: Array, present: Mask) -> tuple[Array, Array]:
    """Return transforms (v, 3, 3) that centre each view's points and scale them to √2 (Hartley), and the points."""
    count = np.maximum(present.sum(axis=1), 1)[:, None]
    middle = np.sum(points * present[..., None], axis=1) / count
    away = np.linalg.norm(points - middle[:, None], axis=-1)
    scale = np.sqrt(2) / np.maximum(np.sum(away * present, axis=1) / count[:, 0], 1e-12)
    transform = np.zeros((len(points), 3, 3))
    transform[:, 0, 0] = transform[:, 1, 1] = scale
    transform[:, :2, 2] = -scale[:, None] * middle
    transform[:, 2, 2] = 1
    return transform, (points - middle[:, None]) * scale[:, None, None]


def _null_vectors(rays: Array, places: Array, present: Mask) -> Array:
    """Return M (v, 3, 3) with ray × M (x, y, 1) = 0 in the least-squares sense, of unit size."""
    p = homogeneous(places) * present[..., None]
    # Σ [ray]×ᵀ[ray]× ⊗ p pᵀ, 9 × 9 a view: all views in one product
    cross2 = np.sum(rays**2, -1)[..., None, None] * np.eye(3) - rays[..., :, None] * rays[..., None, :]
    outer = p[..., :, None] * p[..., None, :]
    v = len(places)
    normal = (cross2.reshape(v, -1, 9).transpose(0, 2, 1) @ outer.reshape(v, -1, 9)).reshape(v, 3, 3, 3, 3)
    normal = normal.transpose(0, 1, 3, 2, 4).reshape(v, 9, 9)
    _, vectors = np.linalg.eigh(normal)
    return vectors[:, :, 0].reshape(v, 3, 3)
