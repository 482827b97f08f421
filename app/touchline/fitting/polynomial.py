"""Fitting the paper's model: rows first, then columns on the horizontally corrected clicks, then millimetres."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np
from numpy.polynomial import polynomial

from touchline.core.errors import BadInput, FitFailed
from touchline.core.field import BORDERS, Arc, Field, Landmark, Line, Region
from touchline.core.geometry import Array, ImageSize, Mask, Points
from touchline.core.jobs import Progress, no_progress
from touchline.core.options import Option, read_options
from touchline.core.records import Fit, Observation, Observations, Warning
from touchline.core.sentences import the_border
from touchline.core.statements import capitalised, say
from touchline.fitting.border import CurveFit, fit_curve
from touchline.fitting.contract import (
    COMMON_OPTIONS,
    Fitter,
    check_inside_picture,
    corrected_rectangle,
    outlier_warning,
)
from touchline.models import CameraModel
from touchline.models.polynomial import MAX_DEGREE, Polynomial

# of the field: a known point further off than this was clicked on another mark
MISTAKE_SHARE = 0.02
MAX_AUTO_DEGREE = 3  # what section III-B used; more follows the clicks

Place = tuple[int, int]  # (observation, point)
# share of I_width or I_height, share of the field, and whose
_Known = tuple[float, float, int, int]

MIN_HULL_SHARE = 0.01  # of the picture; clicks that enclose less are on one line
# of a border's length; a curve past its last click is not accepted further
EXTRAPOLATED_SHARE = 0.08


class Relation(NamedTuple):
    """u = across[0] + across[1]·x_c; v = Σ down[k] (y_c / I_height)^k; and how they came about."""

    across_mm: tuple[float, float]
    down_mm: tuple[float, ...]
    notes: dict[str, Any]
    used: tuple[bool, ...]
    outliers: set[Place]


def relate(
    model: Polynomial, observations: Observations, field: Field, wanted: int | Literal["auto"]
) -> Relation:
    """Fit the relation of a model whose borders are fitted.

    Landmarks give both coordinates; a line along or across the region gives one; arcs, slanted lines and points above
    the carpet give none and only check. wanted: the polynomial's degree; "auto" takes what the known rows support.
    """
    region = model.region
    used, across, down = [], [], []  # rows of (corrected, mm, observation, point)
    for i, observation in enumerate(observations):
        if observation.feature in BORDERS:
            used.append(True)
            continue
        feature = field.feature(observation.feature, region)
        knows_u, knows_v, u, v = _known_coordinates(feature, observation, region)
        corrected = model.corrected_from_raw(observation.points)
        for k, (x_c, y_c) in enumerate(corrected):
            if knows_u and np.isfinite(x_c):
                across.append((x_c / model.width_px, u / region.width_mm, i, k))
            if knows_v and np.isfinite(y_c):
                down.append((y_c / model.height_px, v / region.height_mm, i, k))
        used.append(bool((knows_u or knows_v) and observation.z_mm == 0))
    # the two borders are known rows
    levels = 2 + len({round(row[1], 6) for row in down if 0.02 < row[1] < 0.98})
    degree = min(MAX_AUTO_DEGREE, levels - 1) if wanted == "auto" else wanted
    if degree > levels - 1:
        raise FitFailed(
            say(
                "refused.relation",
                "A relation of degree {degree} requires known points at {needed} heights inside "
                "the field; there are {n}.",
                degree=degree,
                needed=degree - 1,
                n=levels - 2,
            ),
            say(
                "refused.relation.fix",
                "Mark landmarks or lines across the field, or choose degree 1.",
            ),
            reason="too-few-points",
        )
    (a, b), outliers_across = _fit_curve(across, 1)
    down_coefficients, outliers_down = _fit_curve(down, degree)
    slope = polynomial.polyval(np.linspace(0, 1, 64), polynomial.polyder(down_coefficients))
    if not (b > 0 and np.all(slope > 0)):
        raise FitFailed(
            say("refused.order", "The known points are not in the correct order in the image."),
            say("refused.order.fix", "Check the landmark or line of each point."),
            reason="bad-order",
        )
    notes = {
        "degree": degree,
        "known_across": len(across),
        "known_down": len(down),
        "reason": "Only the borders are known: linear in both directions."
        if not (across or down)
        else f"{len(across)} known columns and {len(down)} known rows inside the field.",
    }
    scale = region.width_mm / model.width_px
    return Relation(
        (float(a * region.width_mm), float(b * scale)),
        tuple(float(c * region.height_mm) for c in down_coefficients),
        notes,
        tuple(used),
        outliers_across | outliers_down,
    )


def _known_coordinates(
    feature: Line | Arc | Landmark, observation: Observation, region: Region
) -> tuple[bool, bool, float, float]:
    """Return whether a feature fixes u and v of the points on it, and their values."""
    if observation.z_mm != 0 or isinstance(feature, Arc):
        return False, False, 0.0, 0.0
    if isinstance(feature, Landmark):
        u, v = region.region_from_field(np.asarray(feature.position))
        return True, True, float(u), float(v)
    (u0, v0), (u1, v1) = region.region_from_field(np.array([feature.start, feature.end]))
    return abs(u1 - u0) < 1e-6, abs(v1 - v0) < 1e-6, float(u0), float(v0)


def _fit_curve(rows: list[_Known], degree: int) -> tuple[Array, set[Place]]:
    """Fit mm share over pixel share by least squares, the two borders known; return gross mistakes too.

    Each border counts as one point: enough to fix the ends when little else is known, too little to bend the
    relation away from many known points (measured under a strong lens: 25 mm so, 31 mm with heavy borders).
    """
    if not rows:
        return np.pad(np.array([0.0, 1.0]), (0, degree - 1)), set()
    data = np.array([row[:2] for row in rows])
    keep = np.ones(len(rows), bool)
    while True:
        s = np.concatenate([data[keep, 0], [0.0, 1.0]])
        value = np.concatenate([data[keep, 1], [0.0, 1.0]])
        coefficients = np.linalg.lstsq(polynomial.polyvander(s, degree), value, rcond=None)[0]
        error = np.abs(data[:, 1] - polynomial.polyval(data[:, 0], coefficients))
        spread = np.median(error[keep]) if keep.sum() > 3 else 0.0
        worst = np.argmax(np.where(keep, error, -1))
        if error[worst] < max(5 * spread, MISTAKE_SHARE) or keep.sum() <= max(1, 0.75 * len(rows)):
            break
        keep[worst] = False
    return coefficients, {rows[i][2:] for i in np.flatnonzero(~keep)}


@dataclass(frozen=True, eq=False)
class _Border:
    """All clicks on one border, gathered from its observations."""

    name: str
    points: Points
    owners: tuple[tuple[int, int], ...]  # (observation, point) of each


class PolynomialFitter(Fitter):
    MODEL: ClassVar[type[CameraModel]] = Polynomial
    OPTIONS: ClassVar[tuple[Option, ...]] = (
        Option(
            "degree", "int-or-auto", "auto", "Degree of the curve of each border.", (1, MAX_DEGREE)
        ),
        Option(
            "relation_degree",
            "int-or-auto",
            "auto",
            "Degree of the relation from corrected rows to millimetres; above 1 it requires known points inside the "
            "field.",
            (1, 5),
        ),
        *COMMON_OPTIONS,
    )
    NEEDS_EVERY_BORDER: ClassVar[bool] = True

    @classmethod
    def points_needed(cls) -> str:
        return "3 points on each of the four borders. Nine are recommended."

    @classmethod
    def fit(
        cls,
        observations: Observations,
        field: Field,
        region: Region,
        image_size: ImageSize,
        options: Mapping[str, Any] | None = None,
        progress: Progress = no_progress,
    ) -> Fit:
        """Fit to clicks on the four borders, and to known points inside where there are any.

        "degree" may also be a mapping with one entry a border. Landmarks and lines parallel to a border refine the
        relation to millimetres when there are enough of them; arcs and other lines only check.
        """
        degrees = _degrees(options)
        settings = read_options(
            cls.OPTIONS, {k: v for k, v in (options or {}).items() if k != "degree"}
        )
        borders = {name: _border_clicks(name, observations) for name in BORDERS}
        _check_clicks(borders, image_size)
        robust = settings["robust"]
        progress(0.1, "Fitting the left and right borders")
        rows = (-0.5, image_size.height - 0.5)
        fits = {
            name: fit_curve(
                borders[name].points[:, 1],
                borders[name].points[:, 0],
                degrees[name],
                rows,
                name,
                robust=robust,
            )
            for name in ("left", "right")
        }
        clicked = np.concatenate([b.points[:, 1] for b in borders.values()])
        _refuse_crossing("left", "right", fits, (float(clicked.min()), float(clicked.max())))
        width_px, height_px, n_x, n_y = corrected_rectangle(settings, region, image_size)

        progress(0.4, "Fitting the top and bottom borders")
        # clicked on the raw picture, carried over to the horizontally corrected one
        for name in ("top", "bottom"):
            x, y = borders[name].points[:, 0], borders[name].points[:, 1]
            x_initial = fits["left"].curve(y)
            x_c = (x - x_initial) * width_px / (fits["right"].curve(y) - x_initial)  # Eq. (4)
            fits[name] = fit_curve(x_c, y, degrees[name], (0.0, width_px), name, robust=robust)
        _refuse_crossing("top", "bottom", fits, (0.0, width_px))

        left, right, top, bottom = (fits[name].curve for name in BORDERS)
        straight = Polynomial(
            left,
            right,
            top,
            bottom,
            width_px,
            height_px,
            n_x,
            n_y,
            (0.0, region.width_mm / width_px),
            (0.0, region.height_mm),
            region,
            image_size,
        )
        x_c = np.linspace(0, width_px, 64)
        _refuse_crossing(
            "left",
            "right",
            fits,
            (float(straight.top(x_c).min()), float(straight.bottom(x_c).max())),
        )
        progress(0.7, "Converting pixels to millimetres")
        across, down, relation, used, mistaken = relate(
            straight, observations, field, settings["relation_degree"]
        )
        model = replace(straight, across_mm=across, down_mm=down)
        inliers = _inliers(observations, borders, fits, mistaken)
        warnings = (
            *_outlier_warnings(observations, borders, fits, inliers),
            *_extrapolation_warnings(borders, fits, straight),
        )
        notes = {
            "degree": {n: {"degree": f.curve.degree, "reason": f.reason} for n, f in fits.items()},
            "held_out_px": {n: f.held_out_rms for n, f in fits.items()},
            "relation": relation,
            "choices": {
                "degree": {n: f.curve.degree for n, f in fits.items()},
                "relation_degree": relation["degree"],
            },
        }
        return Fit(model, inliers, used, warnings, notes)


def _degrees(options: Mapping[str, Any] | None) -> dict[str, Any]:
    degree = (options or {}).get("degree")
    option = next(o for o in PolynomialFitter.OPTIONS if o.name == "degree")
    if isinstance(degree, Mapping):
        unknown = set(degree) - set(BORDERS)
        if unknown:
            raise BadInput(
                f"Unknown border: {sorted(map(str, unknown))[0]!r}.",
                f"Use one of: {', '.join(BORDERS)}.",
                reason="bad-option",
            )
        return {name: option.read(degree.get(name)) for name in BORDERS}
    return dict.fromkeys(BORDERS, option.read(degree))


def _border_clicks(name: str, observations: Observations) -> _Border:
    chosen = [(i, o) for i, o in enumerate(observations) if o.feature == name]
    points = np.concatenate([np.empty((0, 2)), *(o.points for _, o in chosen)])
    return _Border(name, points, tuple((i, k) for i, o in chosen for k in range(len(o.points))))


def _check_clicks(borders: Mapping[str, _Border], image_size: ImageSize) -> None:
    for border in borders.values():
        if not len(border.points):
            raise FitFailed(
                say(
                    "refused.no-points",
                    "{line} has no points.",
                    line=capitalised(the_border(border.name)),
                ),
                say(
                    "refused.no-points.fix",
                    "Mark points along {line}.",
                    line=the_border(border.name),
                ),
                reason="too-few-points",
                feature=border.name,
            )
        check_inside_picture((Observation(border.name, "line", border.points),), image_size)
    points = np.concatenate([b.points for b in borders.values()])
    spread = np.linalg.svd((points - points.mean(axis=0)) / np.sqrt(len(points)), compute_uv=False)
    # a rectangle's area
    if 12 * spread[0] * spread[1] < MIN_HULL_SHARE * image_size.width * image_size.height:
        raise FitFailed(
            say("refused.one-line", "The points of all four borders are nearly on one line."),
            say("refused.one-line.fix", "Mark each border along its own line."),
            reason="collinear-points",
        )


def _refuse_crossing(
    first: str, second: str, fits: Mapping[str, CurveFit], span: tuple[float, float]
) -> None:
    position = np.linspace(*span, 256)
    gap = fits[second].curve(position) - fits[first].curve(position)
    if gap.max() <= 0:
        raise FitFailed(
            say(
                f"refused.swapped.{first}",
                f"The {first} border is on the wrong side of the {second} border.",
            ),
            say(
                f"refused.swapped-fix.{first}",
                f"Swap the points of the {first} and {second} borders, or rotate the covered area.",
            ),
            reason="borders-swapped",
            feature=first,
        )
    if gap.min() < 0.02 * gap.max():
        at, values = (
            position[np.argmin(gap)],
            "near row" if first == "left" else "near corrected column",
        )
        raise FitFailed(
            say(
                f"refused.cross.{first}",
                f"The {first} and {second} borders cross {values} {{at:.0f}}.",
                at=at,
            ),
            say(
                "refused.cross-fix",
                "Check the points of both. Mark points nearer to the corners, or choose a lower "
                "degree.",
            ),
            reason="borders-cross",
            feature=first,
        )


def _inliers(
    observations: Observations,
    borders: Mapping[str, _Border],
    fits: Mapping[str, CurveFit],
    mistaken: set[Place],
) -> tuple[Mask, ...]:
    result = tuple(np.ones(len(o.points), bool) for o in observations)
    for name, border in borders.items():
        for (i, k), fine in zip(border.owners, fits[name].inliers, strict=True):
            result[i][k] = fine
    for i, k in mistaken:
        result[i][k] = False
    return result


def _outlier_warnings(
    observations: Observations,
    borders: Mapping[str, _Border],
    fits: Mapping[str, CurveFit],
    inliers: tuple[Mask, ...],
) -> list[Warning]:
    found = [
        outlier_warning(
            observations,
            i,
            k,
            say(
                "outlier.curve",
                "is {px:px} px from the curve through the other points",
                px=abs(residual),
            ),
        )
        for name, border in borders.items()
        for (i, k), fine, residual in zip(
            border.owners, fits[name].inliers, fits[name].residuals, strict=True
        )
        if not fine
    ]
    where = say("outlier.disagrees", "does not agree with the other points")
    fix = say("outlier.disagrees.fix", "Check that it is on the correct mark.")
    return found + [
        outlier_warning(observations, i, k, where, fix)
        for i, observation in enumerate(observations)
        if observation.feature not in BORDERS
        for k in np.flatnonzero(~inliers[i]).tolist()
    ]


def _extrapolation_warnings(
    borders: Mapping[str, _Border], fits: Mapping[str, CurveFit], model: Polynomial
) -> list[Warning]:
    """Return a warning for each curve that is extrapolated within the field."""
    found = []
    columns = np.array([0.0, model.width_px])
    left, right = zip(model.top(columns).tolist(), model.bottom(columns).tolist(), strict=True)
    rows = {
        "left": left,
        "right": right,
        "top": (0.0, model.width_px),
        "bottom": (0.0, model.width_px),
    }
    for name, border in borders.items():
        points = border.points[fits[name].inliers]
        position = (
            points[:, 1] if name in ("left", "right") else model.corrected_from_raw(points)[:, 0]
        )
        position = position[np.isfinite(position)]
        if not position.size:
            raise FitFailed(
                say(
                    "refused.crossed",
                    "{line} is where the adjacent borders have already crossed.",
                    line=capitalised(the_border(name)),
                ),
                say(
                    "refused.crossed.fix",
                    "Check the points of all four borders, or choose a lower degree.",
                ),
                reason="borders-cross",
                feature=name,
            )
        low, high = rows[name]
        ends = ("top", "bottom") if name in ("left", "right") else ("left", "right")
        for gap, end in ((position.min() - low, ends[0]), (high - position.max(), ends[1])):
            if gap > EXTRAPOLATED_SHARE * (high - low):
                found.append(
                    Warning(
                        "border-extrapolated",
                        say(
                            "warning.extrapolated",
                            "{line} has no point in the last {share:.0f} % towards {end}. Its "
                            "curve is extrapolated there.",
                            line=capitalised(the_border(name)),
                            share=100 * gap / (high - low),
                            end=the_border(end),
                        ),
                        say(
                            f"warning.extrapolated-fix.{name}-{end}",
                            f"Add a point on the {name} border near the {end} corner.",
                        ),
                        name,
                    )
                )
    return found
