"""How far off a lens may be at every place of the picture, in pixels, from its own covariance.

A ray held fast is seen elsewhere when the lens's parameters move. What a rotation of the camera could undo is taken
out first, over the whole picture, for a pose will undo it: the focal length alone never has an error in pixels.
"""

import numpy as np

from touchline.core.geometry import Array
from touchline.models.intrinsics import Intrinsics
from touchline.models.lens_difference import picture_grid

SURE_GRID = (24, 18)  # columns, rows over the picture: wherever its worst place is asked for, it is the same one


def lens_sensitivity(lens: Intrinsics, names: tuple[str, ...], pixels: Array) -> Array:
    """(n, 2, len(names)) px per unit of each named parameter at pixels (n, 2), rotations taken out; NaN afar."""
    rays = lens.rays(pixels)
    plane, by_ray, by_terms = lens.lens.distort_jacobian(np.array(lens.terms), rays)
    focal = lens.focal_px * np.array([1.0, lens.aspect])
    by = np.zeros((len(pixels), 2, len(names)))
    for column, name in enumerate(names):
        if name == "log_focal":
            by[..., column] = plane * focal
        elif name == "aspect":
            by[:, 1, column] = plane[:, 1] * lens.focal_px
        elif name in ("centre_x", "centre_y"):
            by[:, int(name == "centre_y"), column] = 1.0
        else:
            by[..., column] = by_terms[..., lens.lens.TERMS.index(name)] * focal
    turns = np.cross(rays[:, None, :], by_ray * focal[:, None])
    fine = np.isfinite(by).all(axis=(1, 2)) & np.isfinite(turns).all(axis=(1, 2))
    if fine.sum() >= 3:
        undo = np.linalg.lstsq(turns[fine].reshape(-1, 3), by[fine].reshape(-1, len(names)), rcond=None)[0]
        by = by - turns @ undo
    by[~fine] = np.nan
    return by


def expected_px(sensitivity: Array, covariance: Array) -> Array:
    """(n,) px: root of the expected squared error, given lens_sensitivity and the covariance of the same names."""
    with np.errstate(invalid="ignore"):
        return np.sqrt(np.maximum(np.einsum("nij,jk,nik->n", sensitivity, covariance, sensitivity), 0))


def expected_over_picture(lens: Intrinsics) -> Array:
    """(rows, columns) px over the picture, SURE_GRID."""
    pixels = picture_grid(lens.image_size, *SURE_GRID).reshape(-1, 2)
    sensitivity = lens_sensitivity(lens, lens.estimated, pixels)
    return expected_px(sensitivity, np.array(lens.covariance)).reshape(SURE_GRID[::-1])
