"""Where one more click would lower the worst expected error most, and by how much."""

import numpy as np

from touchline.core.field import BORDERS, Arc, Field, Line, Region
from touchline.core.geometry import Array, ImageSize, Points, inside_picture, with_z
from touchline.core.records import Fit
from touchline.evaluate.fit.report_types import NextClick
from touchline.evaluate.fit.uncertainty import expected_error, grid_over
from touchline.fitting import Sensitivity, sensitivity_of
from touchline.fitting.ray_camera.problem import PARTS, TILT_SHARE
from touchline.models import RayModel

CANDIDATES_PER_FEATURE = 25
MARGIN_PX = 4.0  # clicks on the picture's very edge are rare


def next_best_click(fit: Fit, field: Field, region: Region, image_size: ImageSize, click_sigma_px: float,
                    ) -> NextClick | None:
    """The best of many places along all the field's lines and arcs: {"feature", "point" px, "worst_mm",
    "worst_mm_then", "z_mm"}, or None for a model that does not know its error.

    A click adds one row j to the information: Σ' = Σ - Σ jᵀ j Σ / (σ² + j Σ jᵀ), so each candidate costs one product.
    Where lines may lie beside their places, j has the offsets of its line or arc in, or σ² that of one without clicks.
    """
    sensitivity = sensitivity_of(fit.model)
    if sensitivity is None or fit.covariance is None:
        return None
    names, points, rows, line_px = _candidates(fit, sensitivity, field, region, image_size)
    known = np.isfinite(rows).all(axis=1) & np.isfinite(line_px) if len(rows) else np.zeros(0, bool)
    if not known.any():
        return None
    names, points = [n for n, k in zip(names, known, strict=True) if k], points[known]
    rows, line_px = rows[known], line_px[known]
    z = field.hat_height_mm if isinstance(fit.model, RayModel) else 0.0
    by = sensitivity.field_jacobian(with_z(grid_over(region).reshape(-1, 2), z), fit.parameter_names)
    before = expected_error(fit, region, z).sigma_mm.ravel() ** 2
    finite = np.isfinite(before)
    by, before = by[finite], before[finite]
    spread = rows @ fit.covariance  # (c, p)
    own = np.einsum("cp,cp->c", spread, rows) + click_sigma_px**2 + line_px**2
    gain = np.einsum("nip,cp->nic", by, spread) ** 2
    then = before[:, None] - gain.sum(axis=1) / own
    worst = then.max(axis=0)
    best = int(np.argmin(worst))
    return {"feature": names[best], "point": points[best].tolist(), "z_mm": z,
            "worst_mm": float(np.sqrt(before.max())), "worst_mm_then": float(np.sqrt(max(worst[best], 0.0)))}


def _candidates(fit: Fit, sensitivity: Sensitivity, field: Field, region: Region, image_size: ImageSize,
                ) -> tuple[list[str], Points, Array, Array]:
    """Names, places (c, 2) px, rows (c, p), and σ px by which the lines of these may lie beside their places (c,)."""
    shapes: list[Line | Arc] = [*map(region.border, BORDERS), *(
        line for line in field.lines.values() if field.observed_name(line.name, region) == line.name),  # else a border
        *field.arcs.values()]
    offsets = {f"line_{i}": name for i, name in enumerate(fit.notes.get("offset_names", ()))}
    column_of = {offsets[name]: k for k, name in enumerate(fit.parameter_names) if name in offsets}
    samples = [shape.sample(2 * CANDIDATES_PER_FEATURE + 1) for shape in shapes]
    places, ahead = (np.concatenate(each) for each in (
        [along[1::2] for along in samples], [along[2::2] - along[1::2] for along in samples]))
    normals = np.concatenate([shape.normals(along[1::2]) for shape, along in zip(shapes, samples, strict=True)])
    lever = TILT_SHARE * np.concatenate([np.linspace(-1, 1, len(along))[1::2] for along in samples])
    owners = np.repeat(np.arange(len(shapes)), [len(along) // 2 for along in samples])
    pixels = _pixels(fit, places)
    visible = inside_picture(pixels, image_size, MARGIN_PX)
    places, ahead, normals, pixels = (each[visible] for each in (places, ahead, normals, pixels))
    lever, owners = lever[visible], owners[visible]
    rows = sensitivity.click_jacobian(places, ahead, fit.parameter_names)
    px_per_mm = _across(_pixels(fit, places + ahead) - pixels, _pixels(fit, places + normals) - pixels)
    for part, by in zip(PARTS, (np.ones_like(lever), lever, normals[:, 0], normals[:, 1]), strict=True):
        for number, shape in enumerate(shapes):
            if (shape.name, part) in column_of:
                own = owners == number
                rows[own, column_of[shape.name, part]] = (px_per_mm * by)[own]
    learned_mm = list(fit.notes.get("line_sigmas_mm", {}).values())
    # where no click tells how far a line lies beside its place, nor an arc's radius and centre
    unknown_mm = np.array([0.0 if not learned_mm or (shape.name, "across") in column_of else
                           np.median(learned_mm) * (np.sqrt(2) if isinstance(shape, Arc) else 1.0) for shape in shapes])
    return [shapes[number].name for number in owners], pixels, rows, px_per_mm * unknown_mm[owners]


def _pixels(fit: Fit, places: Points) -> Points:
    return fit.model.raw_from_corrected(fit.model.corrected_from_field(places))


def _across(ahead: Points, moved: Points) -> Array:
    """How far (n,) something moves across a line that runs ahead (n, 2)."""
    return (ahead[:, 0] * moved[:, 1] - ahead[:, 1] * moved[:, 0]) / np.linalg.norm(ahead, axis=1)
