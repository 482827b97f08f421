"""Whether a lens reaches as far as the field does: where it would fold back, no place can be told."""

import numpy as np

from app.core.field import Region
from app.core.geometry import Array, inside_picture, with_z
from app.core.records import Warning
from app.evaluate.fit.uncertainty import grid_over
from app.models import CameraModel
from app.models.ray_camera import RayCamera

MARGIN = 0.01  # of the picture's diagonal: so much further out the lens must still reach
HALVINGS = 20


def reach_warnings(model: CameraModel, region: Region, hat_height_mm: float) -> list[Warning]:
    """Warn where the lens ends at or before a place of the region, on the carpet or at hat height, in the picture."""
    if not isinstance(model, RayCamera):
        return []
    flat = grid_over(region).reshape(-1, 2)
    ends = [_ends(model, with_z(flat, z_mm)) for z_mm in (0.0, hat_height_mm)]
    share = float(np.mean(np.any(ends, axis=0)))
    if not share:
        return []
    return [Warning("lens-ends", "The lens that was found folds back inside the picture: "
                    f"{100 * share:.0f} % of the field, up to hat height, lies at its edge or beyond, where no place "
                    "can be told.", "Use the fisheye model, or click more points near the picture's corners.")]


def _ends(model: RayCamera, places: Array) -> Array:
    """Return for each of the places (n, 3) mm whether the picture shows where it is, and the lens does not reach it."""
    terms, size = np.array(model.lens_terms), model.image_size
    rays = (places - np.array(model.position_mm)) @ model.camera_from_field.T
    with np.errstate(all="ignore"):
        reached = np.isfinite(model.LENS.distort(terms, rays)).all(axis=1)
        # of a ray that is not, how far towards it the lens reaches
        low, high = np.zeros(len(rays)), np.ones(len(rays))
        for _ in range(0 if reached.all() else HALVINGS):
            middle = (low + high) / 2
            fine = np.isfinite(model.LENS.distort(terms, rays * np.stack([middle, middle, np.ones_like(middle)], 1)))
            low, high = np.where(fine.all(axis=1), middle, low), np.where(fine.all(axis=1), high, middle)
        share = np.where(reached, 1.0, low)
        plane = model.LENS.distort(terms, rays * np.stack([share, share, np.ones_like(share)], axis=1))
        pixels = plane * (model.focal_px * np.array([1, model.aspect])) + np.array(model.centre_px)
        arm = pixels - np.array(model.centre_px)
        further = pixels + arm / np.linalg.norm(arm, axis=1, keepdims=True) * MARGIN * np.hypot(*size)
        further = np.clip(further, 0, np.array(tuple(size)) - 1.0)
        beyond = ~np.isfinite(model.rays(further)).all(axis=1)
    return inside_picture(pixels, size) & (rays[:, 2] > 0) & (~reached | beyond)
