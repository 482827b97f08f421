"""Where clicks help: the weakest direction in the parameters, the next click's place, and where a line is expected.

The information matrix says how well each combination of parameters is known. The combination that costs most at hat
height is found as an eigenvector, named by the parameters that make it up, and weighed again with the cure in place.
"""

from dataclasses import dataclass

import numpy as np

from touchline.core.errors import BadInput
from touchline.core.field import BORDERS, ROBOT_TOP_MM, Arc, Feature, Field, Landmark, Line, Region
from touchline.core.geometry import Array, ImageSize, Points, inside_picture, with_z
from touchline.core.records import Fit, Warning
from touchline.core.statements import Sentence, say
from touchline.evaluate.offsets import same_line
from touchline.evaluate.report_types import NextClick
from touchline.evaluate.uncertainty import expected_error, grid_over
from touchline.fitting import Sensitivity, sensitivity_of
from touchline.fitting.ray_camera.problem import PARTS, TILT_SHARE
from touchline.models import CameraModel, RayModel, field_from_raw, raw_from_field
from touchline.vision.snap import Hint, Snapped, snap

WARN_MM = 5.0  # expected error, rms over the field, from which the operator is told
TAPE_MM = 30.0  # how well a height is taped

GROUPS = {
    "log_focal": "focal length",
    "aspect": "pixel aspect",
    "centre_x": "lens centre",
    "centre_y": "lens centre",
    "turn_x": "tilt",
    "turn_y": "tilt",
    "turn_z": "rotation",
    "x": "position",
    "y": "position",
    "height": "height",
}
NAMES = {
    part: say(f"parameter.{part.replace(' ', '-')}", part)
    for part in (*GROUPS.values(), "lens", "perspective")
}

CANDIDATES_PER_FEATURE = 25
CLICK_MARGIN_PX = 4.0  # clicks on the picture's very edge are rare

SAMPLES = 400
LINE_MARGIN_PX = 6.0  # a line is not looked for where its background ends with the picture
ENDS = 0.03  # of the part that is seen: corners belong to two lines
STEP_MM = 5.0
MIN_POINTS = 5  # so many tell which of them is a stray
STRAY_PX = 1.0
BEND = 3  # degree of how far a fit may be off along one line


@dataclass(frozen=True)
class WeakDirection:
    """The costliest combination of parameters, one σ of it: what it is made of and what it costs, mm rms."""

    parts: tuple[str, ...]
    carpet_mm: float
    robot_top_mm: float
    taped_robot_top_mm: float


def weakest_direction(
    fit: Fit, region: Region, hat_height_mm: float = ROBOT_TOP_MM
) -> WeakDirection | None:
    """The combination that costs most at robot-top height (on the carpet, for a model without rays)."""
    sensitivity = sensitivity_of(fit.model)
    if sensitivity is None or fit.covariance is None:
        return None
    z = hat_height_mm if isinstance(fit.model, RayModel) else 0.0
    by = sensitivity.field_jacobian(
        with_z(grid_over(region).reshape(-1, 2), z), fit.parameter_names
    )
    flat = by.reshape(-1, by.shape[-1])
    flat = flat[np.isfinite(flat).all(axis=1)]
    if not len(flat):
        return None
    root = _root(fit.covariance)
    _, vectors = np.linalg.eigh(root.T @ flat.T @ flat @ root)
    direction = root @ vectors[:, -1]
    share = np.abs(direction) * np.linalg.norm(flat, axis=0)
    strong = np.argsort(share)[::-1]
    parts: list[str] = []
    for index in strong[share[strong] > 0.3 * share.max()]:
        part = GROUPS.get(
            fit.parameter_names[index], "lens" if isinstance(fit.model, RayModel) else "perspective"
        )
        if part not in parts:
            parts.append(part)
    taped = _with_taped_height(fit.covariance, fit.parameter_names)
    return WeakDirection(
        tuple(parts),
        expected_error(fit, region).rms,
        expected_error(fit, region, z).rms,
        expected_error(fit, region, z, covariance=taped).rms,
    )


def _root(covariance: Array) -> Array:
    values, vectors = np.linalg.eigh((covariance + covariance.T) / 2)
    return vectors * np.sqrt(np.maximum(values, 0))


def _with_taped_height(covariance: Array, names: tuple[str, ...]) -> Array:
    """The covariance if the height were known to TAPE_MM: one measurement more (Sherman–Morrison)."""
    if "height" not in names:
        return covariance
    column = covariance[:, names.index("height")]
    return covariance - np.outer(column, column) / (TAPE_MM**2 + column[names.index("height")])


def observability_warnings(
    fit: Fit, region: Region, hat_height_mm: float = ROBOT_TOP_MM
) -> list[Warning]:
    """Warn where the weak direction costs more than WARN_MM on the carpet or at robot-top height."""
    weak = weakest_direction(fit, region, hat_height_mm)
    if weak is None or max(weak.carpet_mm, weak.robot_top_mm) <= WARN_MM:
        return []
    rays = isinstance(fit.model, RayModel)
    cost = say("cost.carpet", "{mm:mm} mm on the carpet", mm=weak.carpet_mm)
    if rays:
        cost = say(
            "cost.robot-tops",
            "{mm:mm} mm on the carpet, {tops_mm:mm} mm at robot-top height ({height_mm:g} mm)",
            mm=weak.carpet_mm,
            tops_mm=weak.robot_top_mm,
            height_mm=hat_height_mm,
        )
    if weak.taped_robot_top_mm < 0.7 * weak.robot_top_mm and {"focal length", "height"} & set(
        weak.parts
    ):
        return [
            Warning(
                "height-unknown",
                say(
                    "warning.height-unknown",
                    "The points cannot separate height and focal length. Expected error: {cost}.",
                    cost=cost,
                ),
                say(
                    "warning.height-unknown.fix",
                    "Measure and enter the camera height (± {cm:.0f} cm is enough). This reduces the "
                    "error at robot tops from {mm:mm} to {measured_mm:mm} mm. Four points at a known height, "
                    "or a board calibration of the lens, also help.",
                    cm=TAPE_MM / 10,
                    mm=weak.robot_top_mm,
                    measured_mm=weak.taped_robot_top_mm,
                ),
            )
        ]
    return [
        Warning(
            "weakly-determined",
            _not_determined(weak.parts, cost),
            say(
                "warning.weakly-determined.board.fix",
                "Add points all over the image, first at the suggested next point, or "
                "use a lens from a board calibration.",
            )
            if rays
            else say(
                "warning.weakly-determined.fix",
                "Add points all over the image, first at the suggested next point, or use a "
                "lens model.",
            ),
        )
    ]


def _not_determined(parts: tuple[str, ...], cost: Sentence) -> Sentence:
    *others, last = (NAMES[part] for part in parts)
    if not others:
        return say(
            "warning.weakly-determined.one",
            "The points do not determine {part} well. Expected error: {cost}.",
            part=last,
            cost=cost,
        )
    return say(
        "warning.weakly-determined",
        "The points do not determine {parts} and {last} well. Expected error: {cost}.",
        parts=others,
        last=last,
        cost=cost,
    )


def next_best_click(
    fit: Fit,
    field: Field,
    region: Region,
    image_size: ImageSize,
    click_sigma_px: float,
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
    by = sensitivity.field_jacobian(
        with_z(grid_over(region).reshape(-1, 2), z), fit.parameter_names
    )
    before = expected_error(fit, region, z).sigma_mm.ravel() ** 2
    finite = np.isfinite(before)
    by, before = by[finite], before[finite]
    spread = rows @ fit.covariance  # (c, p)
    own = np.einsum("cp,cp->c", spread, rows) + click_sigma_px**2 + line_px**2
    gain = np.einsum("nip,cp->nic", by, spread) ** 2
    then = before[:, None] - gain.sum(axis=1) / own
    worst = then.max(axis=0)
    best = int(np.argmin(worst))
    return {
        "feature": names[best],
        "point": points[best].tolist(),
        "z_mm": z,
        "worst_mm": float(np.sqrt(before.max())),
        "worst_mm_then": float(np.sqrt(max(worst[best], 0.0))),
    }


def _candidates(
    fit: Fit,
    sensitivity: Sensitivity,
    field: Field,
    region: Region,
    image_size: ImageSize,
) -> tuple[list[str], Points, Array, Array]:
    """Names, places (c, 2) px, rows (c, p), and σ px by which the lines of these may lie beside their places (c,)."""
    shapes: list[Line | Arc] = [
        *map(region.border, BORDERS),
        *(
            # else a border
            line
            for line in field.lines.values()
            if field.observed_name(line.name, region) == line.name
        ),
        *field.arcs.values(),
    ]
    offsets = {f"line_{i}": name for i, name in enumerate(fit.notes.get("offset_names", ()))}
    column_of = {offsets[name]: k for k, name in enumerate(fit.parameter_names) if name in offsets}
    samples = [shape.sample(2 * CANDIDATES_PER_FEATURE + 1) for shape in shapes]
    places, ahead = (
        np.concatenate(each)
        for each in (
            [along[1::2] for along in samples],
            [along[2::2] - along[1::2] for along in samples],
        )
    )
    normals = np.concatenate(
        [shape.normals(along[1::2]) for shape, along in zip(shapes, samples, strict=True)]
    )
    lever = TILT_SHARE * np.concatenate([np.linspace(-1, 1, len(along))[1::2] for along in samples])
    owners = np.repeat(np.arange(len(shapes)), [len(along) // 2 for along in samples])
    pixels = _pixels(fit, places)
    visible = inside_picture(pixels, image_size, CLICK_MARGIN_PX)
    places, ahead, normals, pixels = (each[visible] for each in (places, ahead, normals, pixels))
    lever, owners = lever[visible], owners[visible]
    rows = sensitivity.click_jacobian(places, ahead, fit.parameter_names)
    px_per_mm = _across(
        _pixels(fit, places + ahead) - pixels, _pixels(fit, places + normals) - pixels
    )
    for part, by in zip(
        PARTS, (np.ones_like(lever), lever, normals[:, 0], normals[:, 1]), strict=True
    ):
        for number, shape in enumerate(shapes):
            if (shape.name, part) in column_of:
                own = owners == number
                rows[own, column_of[shape.name, part]] = (px_per_mm * by)[own]
    learned_mm = list(fit.notes.get("line_sigmas_mm", {}).values())
    # where no click tells how far a line lies beside its place, nor an arc's radius and centre
    unknown_mm = np.array(
        [
            0.0
            if not learned_mm or (shape.name, "across") in column_of
            else np.median(learned_mm) * (np.sqrt(2) if isinstance(shape, Arc) else 1.0)
            for shape in shapes
        ]
    )
    return [shapes[number].name for number in owners], pixels, rows, px_per_mm * unknown_mm[owners]


def _pixels(fit: Fit, places: Points) -> Points:
    return fit.model.raw_from_corrected(fit.model.corrected_from_field(places))


def _across(ahead: Points, moved: Points) -> Array:
    """How far (n,) something moves across a line that runs ahead (n, 2)."""
    return (ahead[:, 0] * moved[:, 1] - ahead[:, 1] * moved[:, 0]) / np.linalg.norm(ahead, axis=1)


def line_hints(
    model: CameraModel,
    feature: Feature,
    field: Field,
    region: Region,
    points: Points,
    reach_px: float,
) -> list[Hint]:
    """For each click (n, 2) px on a line or arc, which way the line runs there and how wide it should look."""
    if isinstance(feature, Landmark):
        return [Hint(reach_px)] * len(points)
    places = feature.nearest(field_from_raw(model, points))
    ahead, aside = feature.tangents(places), feature.normals(places)
    width_mm = _width_mm(feature, field)
    before, after = (raw_from_field(model, places + sign * STEP_MM * ahead) for sign in (-1, 1))
    near, far = (raw_from_field(model, places + sign * width_mm / 2 * aside) for sign in (-1, 1))
    angles = np.arctan2(*(after - before).T[::-1])
    widths = np.linalg.norm(far - near, axis=1)
    return [
        Hint(
            reach_px,
            float(width) if np.isfinite(width) and width > 0.2 else None,
            float(angle) if np.isfinite(angle) else None,
        )
        for angle, width in zip(angles, widths, strict=True)
    ]


def snap_along(
    pixels: np.ndarray,
    model: CameraModel,
    name: str,
    field: Field,
    region: Region,
    count: int,
    reach_px: float,
) -> list[Snapped]:
    """Up to `count` points of a line or arc, evenly over what the picture shows of it; fewer where it is hidden."""
    feature = field.feature(name, region)
    if isinstance(feature, Landmark):
        raise BadInput(
            f"{name} is a single landmark. Points can only be found along lines and arcs.",
            "Click the landmark itself.",
            reason="not-a-line",
        )
    size = ImageSize(pixels.shape[1], pixels.shape[0])
    places = spread_evenly(raw_from_field(model, feature.sample(SAMPLES)), size, count)
    hints = line_hints(model, feature, field, region, places, reach_px)
    found = [snap(pixels, place, hint) for place, hint in zip(places, hints, strict=True)]
    snapped_at = np.array([isinstance(f, Snapped) for f in found], bool)
    snapped = [f for f in found if isinstance(f, Snapped)]
    steps = np.array([f.point for f in snapped]).reshape(-1, 2) - places[snapped_at]
    aside = np.array([[-np.sin(f.angle_rad), np.cos(f.angle_rad)] for f in snapped]).reshape(-1, 2)
    flips = np.ones(len(aside))  # normals turn with an arc, not over
    for i in range(1, len(aside)):
        flips[i] = flips[i - 1] * (1 if aside[i] @ aside[i - 1] >= 0 else -1)
    fits = _together(np.flatnonzero(snapped_at), flips * np.sum(aside * steps, axis=1))
    return [f for f, ok in zip(snapped, fits, strict=True) if ok]


def spread_evenly(pixels: Points, size: ImageSize, count: int) -> Points:
    """(≤ count, 2) places evenly along what a picture shows of a polyline (n, 2) px, clear of its ends."""
    inside = inside_picture(pixels, size, LINE_MARGIN_PX)
    visible = pixels[inside]
    if len(visible) < 2:
        return np.empty((0, 2))
    step = np.linalg.norm(np.diff(visible, axis=0), axis=1)
    step[np.diff(np.flatnonzero(inside)) > 1] = 0.0  # nothing lies in a gap
    travelled = np.concatenate([[0.0], np.cumsum(step)])
    wanted = np.linspace(ENDS, 1 - ENDS, count) * travelled[-1]
    return np.stack([np.interp(wanted, travelled, visible[:, axis]) for axis in (0, 1)], axis=1)


def _width_mm(feature: Line | Arc, field: Field) -> float:
    """As painted: a region's border is as wide as the line that it lies on."""
    if isinstance(feature, Arc) or feature.name not in BORDERS or feature.name in field.lines:
        return feature.width_mm
    return next(
        (line.width_mm for line in field.lines.values() if same_line(line, feature)),
        feature.width_mm,
    )


def _together(place: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """Which points were moved as their neighbours were: a fit is off smoothly, a robot's edge is not."""
    ok = np.ones(len(moved), bool)
    if len(moved) < MIN_POINTS:
        return ok
    for _ in range(5):
        curve = np.polynomial.Polynomial.fit(place[ok], moved[ok], min(BEND, int(ok.sum()) - 3))
        off = np.abs(moved - curve(place))
        limit = max(STRAY_PX, 4 * float(np.median(off[ok])))
        worst = int(np.argmax(np.where(ok, off, 0)))
        if off[worst] <= limit or ok.sum() <= MIN_POINTS:
            break
        ok[worst] = False
    return ok
