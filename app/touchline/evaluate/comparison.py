"""Every model on the same clicks, ranked by what it would miss inside the field, and one of them recommended.

    field error² = held-out error² + (distance to the reference, rms over the field)²

A model made of borders predicts borders well and knows nothing between them; its held-out error alone would flatter it.
So each is also held against the reference: the camera model that the clicks make most probable (log_evidence of its
fit) among those that can bend as real lenses do, or the one with rays whose held-out error is least. Where no such
model could be fitted, the second part is missing, and the ranking says so.

Recommended is the reference where its field error is within chance of the least. Where a model without a lens is as
good, or the reference is not, it is the model with the fewest parameters within chance. Where only borders were
clicked, it is a camera with rays: held-out points of borders know nothing of the inside.
"""

from dataclasses import dataclass

import numpy as np

from touchline.core.field import BORDERS, Region
from touchline.core.records import Fit
from touchline.core.statements import Sentence, join, say, stated
from touchline.evaluate.difference import EXPLAINS, EXPLAINS_PX, MIN_TERMS, difference_mm
from touchline.evaluate.report import expected_figures
from touchline.evaluate.report_types import FitReport, ModelChoice, RankedModel
from touchline.evaluate.residuals import rms
from touchline.models import RayModel
from touchline.models.ray_camera import RayCamera

WITHIN_CHANCE = 1.15  # held-out errors of a few dozen clicks are known to about this factor
SAME_MM = 0.3
UNKNOWN = "weakly-determined"  # the warning of a fit whose inside is a guess
# of those that are not recommended while there are others
LENS_ENDS, CONTRADICTED = "lens-ends", "another-lens"
_NOTHING = say(
    "comparison.nothing", "No model could be cross-validated. Add points, also inside the field."
)
BENDS = {"homography": False, "fisheye": True}  # a fisheye bends lines without any terms


@dataclass(frozen=True, eq=False)
class FittedModel:
    """One fitted model. parameters: how many numbers it found."""

    name: str
    title: str
    fit: Fit
    report: FitReport
    parameters: int


class Comparison(ModelChoice):
    no_significant_distortion: bool | None


def compare_models(candidates: list[FittedModel], region: Region) -> Comparison:
    reference = _reference(candidates)
    rows = sorted((_row(c, reference, region) for c in candidates), key=_field_mm)
    known = [row for row in rows if row["field_mm"] is not None]
    straight = _no_significant_distortion(candidates, known)
    # then held-out points say nothing of the inside: only a camera's rays do
    if _only_borders(candidates):
        rays = {c.name for c in candidates if isinstance(c.fit.model, RayModel)}
        known = [row for row in known if row["model"] in rays]
    if not known:
        return stated(
            Comparison(
                ranking=rows, recommended=None, no_significant_distortion=None, reason=_NOTHING
            )
        )
    close = [
        row for row in known if _field_mm(row) <= WITHIN_CHANCE * _field_mm(known[0]) + SAME_MM
    ]
    # not one that another lens on the same points contradicts, or that ends before the field does
    fine = [row for row in close if not {LENS_ENDS, CONTRADICTED} & {*row["warnings"]}]
    close = fine or [row for row in known if reference and row["model"] == reference.name] or close
    simplest = min(close, key=lambda row: (row["parameters"], _field_mm(row)))
    chosen = next(
        (row for row in close if not straight and reference and row["model"] == reference.name),
        simplest,
    )
    return stated(
        Comparison(
            ranking=rows,
            recommended=chosen["model"],
            no_significant_distortion=straight,
            reason=_sentence(chosen, known, straight, reference),
        )
    )


def parameter_count(fit: Fit) -> int:
    """How many numbers the fit found: a border's coefficients, or all free parameters."""
    if "parameters" in fit.notes:  # a spline's are not those that its covariance is of
        return int(fit.notes["parameters"])
    degrees = fit.notes.get("degree")
    if degrees is not None:  # four curves and the relation's two scales and bends
        return sum(d["degree"] + 1 for d in degrees.values()) + fit.notes["relation"]["degree"] - 1
    return len(fit.parameter_names)


def _warns(candidate: FittedModel, reason: str) -> bool:
    return any(warning["reason"] == reason for warning in candidate.report["warnings"])


def _only_borders(candidates: list[FittedModel]) -> bool:
    return all(
        row["feature"] in BORDERS for c in candidates for row in c.report["per_feature"] if row["n"]
    )


def _reference(candidates: list[FittedModel]) -> FittedModel | None:
    known = [c for c in candidates if _held_out_mm(c) < np.inf]
    # Where no camera can be where the points are (a stretched picture), none is a reference.
    most_px = EXPLAINS * min(map(_rms_px, known), default=0.0) + EXPLAINS_PX
    with_rays = [c for c in known if isinstance(c.fit.model, RayModel) and _rms_px(c) <= most_px]
    # if none is free of it, the most probable is the best guess
    for reason in (LENS_ENDS, CONTRADICTED, UNKNOWN):
        with_rays = [c for c in with_rays if not _warns(c, reason)] or with_rays
    lenses = [
        c
        for c in with_rays
        if "log_evidence" in c.fit.notes
        and isinstance(c.fit.model, RayCamera)
        and len(c.fit.model.lens_terms) >= MIN_TERMS
    ]
    if lenses:
        return max(lenses, key=lambda c: c.fit.notes["log_evidence"])
    return min(with_rays, key=_held_out_mm, default=None)


def _row(candidate: FittedModel, reference: FittedModel | None, region: Region) -> RankedModel:
    held_out = candidate.report["cv_rms_mm"]
    check = candidate.report["check_rms_mm"]
    apart = None
    if reference is not None and candidate is not reference:
        apart = rms(difference_mm(reference.fit.model, candidate.fit.model, region)[1].ravel())
    parts = [
        v for v in (max(filter(None, (held_out, check)), default=None), apart) if v is not None
    ]
    return {
        "model": candidate.name,
        "title": candidate.title,
        "parameters": candidate.parameters,
        "held_out_mm": held_out,
        "check_mm": check,
        "apart_mm": apart,
        "field_mm": float(np.hypot.reduce(parts)) if held_out is not None else None,
        "rms_px": candidate.report["rms_px"],
        **expected_figures(candidate.report),
        "verdict": candidate.report["verdict"],
        "warnings": [w["reason"] for w in candidate.report["warnings"]],
    }


def _known(value: float | None) -> float:
    """Return the figure; infinity where it is not known."""
    return np.inf if value is None else value


def _field_mm(row: RankedModel) -> float:
    return _known(row["field_mm"])


def _held_out_mm(candidate: FittedModel) -> float:
    return _known(candidate.report["cv_rms_mm"])


def _rms_px(candidate: FittedModel) -> float:
    return _known(candidate.report["rms_px"])


def _no_significant_distortion(candidates: list[FittedModel], known: list[RankedModel]) -> bool:
    """A model without any lens does as well as the best, or the best lens hardly bends a border."""

    def bends(c: FittedModel) -> bool:
        if c.name in BENDS:
            return BENDS[c.name]
        return not isinstance(c.fit.model, RayCamera) or any(c.fit.model.lens_terms)

    straight = {c.name for c in candidates if not bends(c)}
    return any(
        row["model"] in straight and _field_mm(row) <= WITHIN_CHANCE * _field_mm(known[0]) + SAME_MM
        for row in known
    )


def _sentence(
    chosen: RankedModel, known: list[RankedModel], straight: bool, reference: FittedModel | None
) -> Sentence:
    rivals = [row for row in known if row["model"] != chosen["model"]]
    better = [row for row in rivals if _field_mm(row) < _field_mm(chosen)]
    begin = "{model}: {mm:mm} mm inside the field with {n} parameters"
    values = {"model": chosen["title"], "mm": chosen["field_mm"], "n": chosen["parameters"]}
    if not rivals:
        words = say("comparison.alone", begin + ".", **values)
    else:
        other = (better or rivals)[0]
        values |= {"other": other["title"], "other_mm": other["field_mm"]}
        if not better:
            words = say(
                "comparison.best",
                begin + "; the next best is {other} with {other_mm:mm} mm.",
                **values,
            )
        elif other["parameters"] > chosen["parameters"]:
            words = say(
                "comparison.simpler",
                begin + "; {other} ({other_mm:mm} mm) is not significantly better and "
                "has more parameters.",
                **values,
            )
        else:
            words = say(
                "comparison.alike",
                begin + "; {other} ({other_mm:mm} mm) is not significantly better.",
                **values,
            )
    return join(
        say("comparison.no-distortion", "No significant distortion.") if straight else "",
        words,
        say(
            "comparison.not-compared",
            "No physical lens model fits, so the error inside the field was not compared.",
        )
        if reference is None
        else "",
    )
