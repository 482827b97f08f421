"""Linear estimates from points anywhere along the field's lines and from landmarks.

A click p on a field line l satisfies lᵀ G p = 0, where G = field_from_plane is a homography: one linear equation a
click, wherever along the line it is; a landmark is two lines. Direct linear transformation, normalised after
R. Hartley, "In defense of the eight-point algorithm" (1997); the lens in the same stroke after A. Fitzgibbon (2001);
focal length from orthogonal vanishing points, B. Caprile and V. Torre (1990), Z. Zhang (2000); R. Tsai (1987).
"""

from dataclasses import dataclass

import numpy as np

from touchline.core.errors import FitFailed
from touchline.core.geometry import Array
from touchline.core.statements import say
from touchline.models.rotation import nearest_rotation

BENDS = np.concatenate([[0.0], -np.geomspace(0.002, 1.2, 40), np.geomspace(0.002, 0.5, 20)])
MIN_ROWS = 8
NOT_DETERMINED = say(
    "refused.lines", "The marked lines do not determine the position of the field in the image."
)
MORE_LINES = say(
    "refused.lines.fix",
    "Mark points on at least four lines, two in each direction, along their whole length.",
)
CHECK_LINES = say("refused.check-lines.fix", "Check the line of each point and the covered area.")
DEGENERATE = 1e-7  # of the design matrix's largest singular value


@dataclass(frozen=True, eq=False)
class Incidences:
    """Clicks and the field lines they lie on: pixels (n, 2) px, lines (n, 3) with unit normals in field mm."""

    pixels: Array
    lines: Array


@dataclass(frozen=True, eq=False)
class PlaneEstimate:
    """field_from_plane (3, 3) for (undistorted) pixels about the picture's centre, bend in px⁻², rms in mm."""

    field_from_plane: Array
    bend: float
    rms_mm: float


def line_through(start: Array, end: Array) -> Array:
    """Return the line (a, b, c), a² + b² = 1, through two points: a x + b y + c = 0."""
    direction = (end - start) / np.linalg.norm(end - start)
    normal = np.array([-direction[1], direction[0]])
    return np.array([*normal, -normal @ start])


def homography_from_lines(
    incidences: Incidences, centre: Array, bends: Array = BENDS
) -> PlaneEstimate:
    """Return the homography and the one-term bend under which the clicks fall best on their lines.

    bends: values of k r², r the distance to the picture's furthest click, that are tried; (0,) leaves the lens out.
    Raises FitFailed where the lines do not determine a homography (too few, or all parallel).
    """
    rows = len(incidences.pixels)
    if rows < MIN_ROWS:
        raise FitFailed(
            say(
                "refused.measurements",
                "The points give {n} measurements; a fit needs {unknowns}.",
                n=rows,
                unknowns=MIN_ROWS,
            ),
            say(
                "refused.measurements.lines.fix",
                "Mark at least {n} more points, on four lines that are not all parallel.",
                n=MIN_ROWS - rows,
            ),
            reason="too-few-points",
        )
    about = incidences.pixels - centre
    reach = float(np.linalg.norm(about, axis=1).max())
    plane = about / reach
    spots, unit = _normaliser(incidences.lines)
    lines = incidences.lines @ np.linalg.inv(unit)  # lines transform with the inverse of the points
    lines = lines / np.linalg.norm(lines[:, :2], axis=1, keepdims=True)
    rr = np.sum(plane**2, axis=1)
    # (b, n, 3)
    lifted = np.stack([np.concatenate([plane, (1 + b * rr)[:, None]], axis=1) for b in bends])
    design = (lines[None, :, :, None] * lifted[:, :, None, :]).reshape(len(bends), rows, 9)
    values, vectors = np.linalg.eigh(np.swapaxes(design, 1, 2) @ design)
    g = vectors[:, :, 0].reshape(-1, 3, 3)
    with np.errstate(all="ignore"):
        depth = np.einsum("bj,bnj->bn", g[:, 2], lifted)
        miss = np.einsum("nj,bjk,bnk->bn", lines, g, lifted) / depth
        error = np.sqrt(np.mean(np.where(np.isfinite(miss), miss, 1e3) ** 2, axis=1))
        # the horizon cuts the clicks
        error = np.where((np.abs(np.sign(depth).sum(axis=1)) == rows), error, np.inf)
    best = int(np.argmin(error))
    # the picture would fall onto one line
    flattened = np.linalg.svd(g[best], compute_uv=False)[-1] < DEGENERATE
    if flattened or values[best, 1] < DEGENERATE * values[best, -1]:
        raise FitFailed(NOT_DETERMINED, MORE_LINES, reason="lines-not-enough")
    if not np.isfinite(error[best]):
        raise FitFailed(
            say(
                "refused.behind",
                "No camera position matches the marked lines: some would be behind the camera.",
            ),
            CHECK_LINES,
            reason="no-camera",
        )
    field_from_plane = np.linalg.inv(unit) @ g[best] * np.sign(depth[best, 0])
    field_from_plane = field_from_plane @ np.diag([1 / reach, 1 / reach, 1.0])
    return PlaneEstimate(
        field_from_plane, float(bends[best] / reach**2), float(error[best] * spots)
    )


def _normaliser(lines: Array) -> tuple[float, Array]:
    """Return a similarity that centres and scales the feet of the origin on the lines, and its length."""
    feet = -lines[:, :2] * lines[:, 2:]
    middle = feet.mean(axis=0)
    length = max(float(np.linalg.norm(feet - middle, axis=1).mean()), 1e-6)
    return length, np.array(
        [[1 / length, 0, -middle[0] / length], [0, 1 / length, -middle[1] / length], [0, 0, 1.0]]
    )


def focal_from_vanishing_points(plane_from_field: Array) -> float | None:
    """Return the focal length, px, from the field's two orthogonal directions; None where they do not determine it.

    Their images are vanishing points v, w about the principal point with v·w + f² = 0, and both directions have the
    same length: two equations in 1/f². Straight from above both points lie at infinity: undetermined.
    """
    h1, h2 = plane_from_field[:, 0], plane_from_field[:, 1]
    by = np.array(
        [h1[0] * h2[0] + h1[1] * h2[1], h1[0] ** 2 + h1[1] ** 2 - h2[0] ** 2 - h2[1] ** 2]
    )
    one = np.array([h1[2] * h2[2], h1[2] ** 2 - h2[2] ** 2])
    if not by @ by > 0:
        return None
    inverse_square = -(by @ one) / (by @ by)
    return float(1 / np.sqrt(inverse_square)) if inverse_square > 1e-12 else None


def pose_from_homography(plane_from_field: Array, focal_px: float | Array) -> tuple[Array, Array]:
    """Return camera_from_field (…, 3, 3) and positions (…, 3), mm, of a homography of the carpet about the principal
    point, for focal lengths (…).

    The camera stands above the carpet and the field before it; a mirrored homography gives no such pose: FitFailed.
    """
    focal = np.asarray(focal_px)[..., None]
    columns = (
        plane_from_field
        / np.concatenate([focal, focal, np.ones_like(focal, float)], axis=-1)[..., None]
    )
    lengths = np.linalg.norm(columns[..., :2], axis=-2)
    facing = np.where(columns[..., 2, 2] < 0, -1.0, 1.0)
    columns = columns * (facing / np.sqrt(lengths[..., 0] * lengths[..., 1]))[..., None, None]
    r1, r2, t = np.moveaxis(columns, -1, 0)
    rotation = nearest_rotation(np.stack([r1, r2, np.cross(r1, r2)], axis=-1))
    position = -(np.swapaxes(rotation, -1, -2) @ t[..., None])[..., 0]
    if (position[..., 2] <= 0).any():
        raise mirrored_error()
    return rotation, position


def mirrored_error() -> FitFailed:
    return FitFailed(
        say("refused.mirrored", "The field is mirrored in the image."),
        say(
            "refused.mirrored.fix",
            "Check which border is left and which is right. Flip a mirrored image before you use "
            "it.",
        ),
        reason="mirrored",
    )


def tsai_two_stage(pixels: Array, field_mm: Array) -> tuple[Array, Array, float, float]:
    """Estimate pose, focal length and k1 from landmarks on the carpet by Tsai's radial alignment constraint.

    pixels (n, 2) about the principal point, field_mm (n, 2), n ≥ 5. A radial lens moves a point along its radius, so
    the pixel's direction is that of the undistorted point: linear in the pose's first two rows (stage one); then
    f, the distance and k1 (stage two). Returns camera_from_field, position mm, focal_px, k1 (r_d = r (1 + k1 r²)).
    Raises FitFailed straight from above, where stage two is undetermined.
    """
    if len(pixels) < 5:
        raise FitFailed(
            say("refused.two-stage", "The two-stage method requires five landmarks."),
            say("refused.two-stage.fix", "Mark more landmarks."),
            reason="too-few-points",
        )
    u, v = pixels[:, 0], pixels[:, 1]
    x, y = field_mm[:, 0], field_mm[:, 1]
    unit = max(float(np.abs(field_mm).max()), 1.0)
    design = np.stack([v * x / unit, v * y / unit, v, -u * x / unit, -u * y / unit], axis=1)
    a1, a2, a3, a4, a5 = np.linalg.lstsq(design, u, rcond=None)[0] / np.array(
        [unit, unit, 1, unit, unit]
    )
    c = np.array([[a1, a2], [a4, a5]])  # the rotation's upper left 2 × 2, divided by t_y
    square, det = float(np.sum(c**2)), float(np.linalg.det(c))
    if abs(det) < 1e-18:
        raise FitFailed(
            say("refused.landmarks", "The landmarks are on one line."),
            say("refused.landmarks.fix", "Mark landmarks spread over the field."),
            reason="collinear-points",
        )
    t_y = np.sqrt((square - np.sqrt(max(square**2 - 4 * det**2, 0.0))) / (2 * det**2))
    furthest = int(np.argmax(u**2 + v**2))
    signs = (
        np.array(
            [a1 * x[furthest] + a2 * y[furthest] + a3, a4 * x[furthest] + a5 * y[furthest] + 1]
        )
        * t_y
    )
    if signs @ np.array([u[furthest], v[furthest]]) < 0:
        t_y = -t_y
    r11, r12, r21, r22, t_x = a1 * t_y, a2 * t_y, a4 * t_y, a5 * t_y, a3 * t_y
    r13, r23 = np.sqrt(max(1 - r11**2 - r12**2, 0.0)), np.sqrt(max(1 - r21**2 - r22**2, 0.0))
    if r11 * r21 + r12 * r22 > 0:
        r23 = -r23
    for flip in (1.0, -1.0):
        first, second = np.array([r11, r12, flip * r13]), np.array([r21, r22, flip * r23])
        rotation = nearest_rotation(np.stack([first, second, np.cross(first, second)]))
        depth = field_mm @ rotation[2, :2]
        side = np.concatenate([field_mm @ rotation[0, :2] + t_x, field_mm @ rotation[1, :2] + t_y])
        observed = np.concatenate([u, v])
        rr = np.tile(u**2 + v**2, 2) / np.mean(u**2 + v**2)
        # seen · (depth + t_z) = f · side · (1 + k r_d²): linear in f, f·k and t_z
        design = np.stack([side, side * rr, -observed], axis=1)
        (f, fk, t_z), _, rank, spread = np.linalg.lstsq(
            design, observed * np.tile(depth, 2), rcond=None
        )
        if rank == 3 and spread[-1] > 1e-9 * spread[0] and f > 0 and t_z > 0:
            translation = np.array([t_x, t_y, t_z])
            k1 = fk / f * f**2 / float(np.mean(u**2 + v**2))
            return rotation, -rotation.T @ translation, float(f), float(k1)
    raise FitFailed(
        say(
            "refused.height",
            "A camera that looks straight down cannot separate focal length and height.",
        ),
        say("refused.height.fix", "Enter the camera height."),
        reason="height-unknown",
    )
