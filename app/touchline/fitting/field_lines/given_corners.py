"""Cameras from the four corners of a covered area, as an operator or a program gives them, a few pixels off.

Four points give a homography, and it the focal length, but nothing of the lens: cameras are made for a series of bends,
each of which straightens the picture its own way. What they come to is decided on the lines.
"""

import numpy as np

from touchline.core.errors import BadInput
from touchline.core.field import Region
from touchline.core.geometry import Array, ImageSize, Points
from touchline.core.statements import say
from touchline.fitting.field_lines.blind_distortion import UndistortedPlane
from touchline.fitting.field_lines.four_lines import FOCALS, square_maps
from touchline.fitting.field_lines.refinement import initial_camera
from touchline.fitting.ray_camera.parameters import RayCameraParameters

BENDS = (0.0, -0.15, -0.3, -0.5, -0.75, 0.15)  # from none to a fisheye's, and a pincushion's
ROOM = 0.15  # about the area, of how far its corners lie from its middle: a strong barrel's sides bulge
USUAL_FOCAL, USUAL = 1.5, 1e-3  # half diagonals, where the corners tell no focal length; weight of that


def check_corners(corners: Points) -> None:
    """Raise BadInput where corners (4, 2) px do not run clockwise about a convex area."""
    edges = np.roll(corners, -1, axis=0) - corners
    following = np.roll(edges, -1, axis=0)
    if (edges[:, 0] * following[:, 1] - edges[:, 1] * following[:, 0] <= 0).any():
        raise BadInput(say("corners.order", "The corners do not run clockwise around the covered area."), say(
            "corners.order.fix", "Give the top left, top right, bottom right and bottom left corner of the covered "
                                 "area, as it is when corrected."), reason="bad-corners")


def about(corners: Points) -> Points:
    """Return an outline (4, 2) px of the area and some carpet about it, where its lines may lie."""
    middle = corners.mean(axis=0)
    return np.asarray(middle + (1 + ROOM) * (corners - middle))


def cameras_from_corners(corners: Points, region: Region, size: ImageSize) -> list[RayCameraParameters]:
    """Return a camera for each bend under which the corners can be those of the region seen from above.

    corners (4, 2) raw px, clockwise: top left, top right, bottom right, bottom left of the region as it stands when
    corrected.
    """
    sides = np.array([region.width_mm, region.height_mm])
    origin, right, down = region.field_from_region(np.array([[0, 0], [1, 0], [0, 1]]) * sides)
    field_from_square = np.eye(3)
    field_from_square[:2] = np.column_stack([right - origin, down - origin, origin])
    square_from_field = np.linalg.inv(field_from_square)
    found = []
    for bend in BENDS:
        plane = UndistortedPlane.of(size, bend)
        flat = plane.undistorted_from_raw(corners)
        homography = square_maps(flat[None])[0] @ square_from_field
        if not np.isfinite(homography).all():
            continue
        start = initial_camera(homography, _focal(homography), plane, size)
        if start is not None:
            found.append(start)
    return found


def _focal(homography: Array) -> float:
    """Return the focal length, half diagonals, under which right angles and lengths on the carpet come out best."""
    one, two = homography[:, 0], homography[:, 1]
    p = FOCALS**2
    n1, n2 = (np.sqrt((c[:2] ** 2).sum() + p * c[2] ** 2) for c in (one, two))
    off = np.abs((one[:2] @ two[:2] + p * one[2] * two[2]) / (n1 * n2)) + np.abs(np.log(n1 / n2))
    return float(FOCALS[np.argmin(off + USUAL * np.abs(np.log(FOCALS / USUAL_FOCAL)))])
