"""Whether a lens reaches as far as the field does: where it would fold back, no place can be told."""

import numpy as np

from touchline.core.field import Region
from touchline.core.geometry import Array, inside_picture, with_z
from touchline.core.records import Warning
from touchline.core.statements import say
from touchline.evaluate.fit.uncertainty import grid_over
from touchline.models import CameraModel
from touchline.models.ray_camera import RayCamera

MARGIN = 0.01  # of the picture's diagonal: so much further out the lens must still reach
HALVINGS = 20


def reach_warnings(model: CameraModel, region: Region, hat_height_mm: float) -> list[Warning]:
    """Warn where the lens ends at or before a place of the region, on the carpet or at hat height, in the picture."""
    if not isinstance(model, RayCamera):
        return []
    flat = grid_over(region).reshape(-1, 2)
    ends = _ends(model, np.concatenate([with_z(flat), with_z(flat, hat_height_mm)])).reshape(2, -1)
    share = float(np.mean(ends.any(axis=0)))
    if not share:
        return []
    return [Warning("lens-ends", say(
        "warning.lens-ends", "The fitted lens folds back inside the image. {share:.0f} % of the field, up to robot-top "
        "height, is at its limit or beyond and has no position.", share=100 * share), say(
        "warning.lens-ends.fix", "Use the fisheye model, or add points near the corners of the image."))]


def _ends(model: RayCamera, places: Array) -> Array:
    """Return for each of the places (n, 3) mm whether the picture shows where it is, and the lens does not reach it."""
    size, middle = model.image_size, np.array(model.centre_px)
    rays = (places - np.array(model.position_mm)) @ model.camera_from_field.T
    reached = np.isfinite(model.pixels_from_rays(rays)).all(axis=1)
    if not reached.all():  # of a ray that is not, as far towards it as the lens reaches
        low, high = reached.astype(float), np.ones(len(rays))
        for _ in range(HALVINGS):
            share = (low + high) / 2
            fine = np.isfinite(model.pixels_from_rays(_bent(rays, share))).all(axis=1)
            low, high = np.where(fine, share, low), np.where(fine, high, share)
        rays = _bent(rays, low)
    pixels = model.pixels_from_rays(rays)
    with np.errstate(all="ignore"):
        outwards = (pixels - middle) / np.linalg.norm(pixels - middle, axis=1, keepdims=True)
    further = np.clip(pixels + outwards * MARGIN * np.hypot(*size), 0, np.array(tuple(size)) - 1.0)
    beyond = ~np.isfinite(model.rays(further)).all(axis=1)
    return inside_picture(pixels, size) & (rays[:, 2] > 0) & (~reached | beyond)


def _bent(rays: Array, share: Array) -> Array:
    """Return rays (n, 3) turned towards the axis, their tangents a share (n,) of what they were."""
    return rays * np.stack([share, share, np.ones_like(share)], axis=1)
