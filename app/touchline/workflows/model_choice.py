"""Which model: all of them on the same points, ranked, and the one that "auto" stands for."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from itertools import chain
from typing import Any, NamedTuple

from touchline.core.errors import FitFailed, ProblemJson
from touchline.core.field import Field, Region
from touchline.core.geometry import ImageSize
from touchline.core.jobs import Progress, no_progress, subprogress
from touchline.core.records import Observations
from touchline.core.statements import say
from touchline.evaluate.comparison import Comparison, FittedModel, compare_models, parameter_count
from touchline.evaluate.difference import OWN, freer_lens
from touchline.evaluate.report_types import ModelChoice, SavedReport
from touchline.fitting import FITTERS, known_options
from touchline.models import MODELS
from touchline.workflows.calibration import CalibrationResult, calibrate

AUTO = "auto"
# of the first that can be fitted, the most probable
LADDER = (("brown-conrady", "fisheye"), ("division",))


class Refused(ProblemJson):
    model: str
    title: str


class Ranking(Comparison):
    failed: list[Refused]


class Ranked(NamedTuple):
    """The comparison as plain JSON, and the calibrations by model that it rests on."""

    ranking: Ranking
    calibrations: Mapping[str, CalibrationResult]


def is_removed(name: str) -> bool:
    """Whether a model can be read and is fitted no more."""
    return name in MODELS and name not in FITTERS


def refuse_removed(name: str) -> None:
    """FitFailed for a model that is fitted no more."""
    if is_removed(name):
        raise FitFailed(
            say("models.removed", "{model} is no longer fitted.", model=MODELS[name].TITLE),
            say("models.removed.fix", "Use another model, or the automatic choice."),
            reason="model-removed",
        )


def compare(
    observations: Observations,
    field: Field,
    region: Region,
    image_size: ImageSize,
    models: tuple[str, ...] | None = None,
    options: Mapping[str, Any] | None = None,
    progress: Progress = no_progress,
) -> Ranked:
    """Fit several models (all, if none are named) to the same observations and rank them.

    options: those that a model does not know are not given to it. A model that cannot be fitted is listed under
    "failed" with its reason and fix; FitFailed where none can.
    """
    names = tuple(models or FITTERS)
    freer = cache(lambda: freer_lens(observations, field, region, image_size, options))
    fitted: list[FittedModel] = []
    failed: list[Refused] = []
    for index, name in enumerate(names):
        title = MODELS[name].TITLE
        part = subprogress(progress, index / len(names), (index + 1) / len(names), f"{title}:")
        try:
            refuse_removed(name)
            result = calibrate(
                observations,
                field,
                region,
                image_size,
                name,
                known_options(name, options),
                part,
                freer=freer,
            )
        except FitFailed as refusal:
            failed.append({**refusal.to_json(), "model": name, "title": title})
            continue
        fitted.append(
            FittedModel(name, title, result.fit, result.report, parameter_count(result.fit))
        )
    if not fitted:
        raise FitFailed(
            say("models.none-fits", "No model could be fitted to these points."),
            failed[0]["fix"],
            reason=failed[0]["reason"],
        )
    return Ranked(
        {**compare_models(fitted, region), "failed": failed},
        {one.name: CalibrationResult(one.fit, one.report) for one in fitted},
    )


def calibrate_recommended(
    observations: Observations,
    field: Field,
    region: Region,
    image_size: ImageSize,
    options: Mapping[str, Any] | None = None,
    progress: Progress = no_progress,
) -> CalibrationResult:
    """Calibrate with the model that the comparison of all recommends; why stands in the report's "model_choice".

    Where nothing can be recommended, with the first of the ladder's lenses that was fitted, else with any model.
    """
    ranked = compare(observations, field, region, image_size, None, options, progress)
    found = ranked.ranking
    wanted = (found["recommended"] or "", *chain(*LADDER), *ranked.calibrations)
    result = next(ranked.calibrations[name] for name in wanted if name in ranked.calibrations)
    choice = ModelChoice(
        recommended=found["recommended"], reason=found["reason"], ranking=found["ranking"]
    )
    report: SavedReport = {**result.report, "model_choice": choice}
    return replace(result, report=report)


def not_compared() -> ModelChoice:
    """Return the choice of the most probable lens, made before the models were compared."""
    return ModelChoice(
        recommended=None,
        reason=say(
            "comparison.not-made", "The most probable lens. The models have not been compared."
        ),
        ranking=[],
    )


def calibrate_most_probable(
    observations: Observations,
    field: Field,
    region: Region,
    image_size: ImageSize,
    options: Mapping[str, Any] | None = None,
    progress: Progress = no_progress,
    *,
    cross_validate: bool = True,
) -> CalibrationResult:
    """Calibrate with the lens that most likely is recommended in the end, at once: while points are moved.

    Where no lens can be fitted, the first of the ladder says what is missing.
    """
    lens = freer_lens(observations, field, region, image_size, options)
    name = LADDER[0][0] if lens is None else lens.model.NAME
    mine = known_options(name, options)
    return calibrate(
        observations,
        field,
        region,
        image_size,
        name,
        mine,
        progress,
        cross_validate=cross_validate,
        fitted=None if {*mine} & {*OWN} else lens,
    )
