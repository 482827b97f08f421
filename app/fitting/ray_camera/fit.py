"""Fitting a camera with a lens: linear start, robust refinement, strays named, then plain least squares on the rest."""

from abc import abstractmethod
from collections.abc import Iterable, Mapping
from typing import Any, ClassVar

from app.core.errors import FitFailed
from app.core.field import Field, Region
from app.core.geometry import Array, ImageSize
from app.core.options import Option, read_options
from app.core.progress import Progress, no_progress
from app.core.records import Fit, Observations
from app.fitting.clicks import check_inside_picture, inlier_masks, name_strays
from app.fitting.contract import Fitter, Sensitivity
from app.fitting.corrected_rectangle import rectangles
from app.fitting.ray_camera.distortion_prior import bent_lens, with_bend
from app.fitting.ray_camera.initial import start_states
from app.fitting.ray_camera.lens_prior import held_lens, with_lens
from app.fitting.ray_camera.options import RAY_OPTIONS
from app.fitting.ray_camera.parameters import RayState
from app.fitting.ray_camera.problem import gather, incidences
from app.fitting.ray_camera.search import Found, Task, best_start, cleared, first_bend, significantly_better, solve
from app.fitting.ray_camera.setup import ladder_of, leanings_for, read_leanings, task_of
from app.fitting.sensitivity import ParameterSensitivity
from app.models import parameters_json
from app.models.ray_camera import RayCamera


class RayFitter(Fitter):
    """What the fitters of all cameras with a lens have in common; a member names its MODEL, OPTIONS and terms."""

    MODEL: ClassVar[type[RayCamera]]
    OPTIONS: ClassVar[tuple[Option, ...]] = RAY_OPTIONS

    @classmethod
    @abstractmethod
    def start_terms(cls, k1: float) -> Array:
        """Return the lens's terms whose leading behaviour is r_d = r (1 + k1 r²)."""

    @classmethod
    def term_sets(cls) -> tuple[tuple[str, ...], ...]:
        """Return the sets of lens terms that "auto" tries, simplest first; a lens without a choice has one."""
        return (cls.MODEL.LENS.TERMS,)

    @classmethod
    def points_needed(cls, options: Mapping[str, Any] | None = None) -> str:
        return (f"{8 + len(cls.term_sets()[0])} points or more on at least four lines, not all parallel; "
                "nine on each of the four borders are good.")

    @classmethod
    def sensitivity(cls, model: RayCamera) -> Sensitivity:
        return ParameterSensitivity(RayState.of(model))

    @classmethod
    def fit(cls, observations: Observations, field: Field, region: Region, image_size: ImageSize,
            options: Mapping[str, Any] | None = None, progress: Progress = no_progress) -> Fit:
        """Fit to points anywhere along lines and arcs, to landmarks, and to points at known heights.

        Options: OPTIONS; also "start" (parameters), which begins near a known answer, and "leanings" (σ by term), which
        an earlier fit chose.
        """
        given = dict(options or {})
        start, leanings = given.pop("start", None), read_leanings(cls.MODEL.LENS, given.pop("leanings", None))
        settings = read_options(cls.OPTIONS, given)
        check_inside_picture(observations, image_size)
        problem = gather(observations, field, region, with_offsets=settings["line_sigma_mm"] > 0)
        bent = bent_lens(cls.MODEL.NAME, settings, image_size)
        held = None if bent else held_lens(cls.MODEL.NAME, settings, image_size)
        width_px, height_px, n_x, n_y = rectangles(settings, region, image_size)
        if start is None:
            height = settings["height_mm"]["value"] if settings["height_mm"] else None
            starts = start_states(cls.MODEL.LENS, cls.start_terms, problem, incidences(observations, field, region),
                                  image_size, height)
        else:
            starts = [RayState.of(cls.MODEL.from_parameters(start), len(problem.line_names))]
        if held is not None:
            starts = [with_lens(state, held) for state in starts]
        if bent is not None:
            starts = [with_bend(state, bent) for state in starts]
        ladder = ladder_of(cls.MODEL.LENS, cls.term_sets(), settings, held, bent)
        best, refusal, tried, leant = None, None, {}, {}
        first = task_of(starts[0], problem, first_bend(ladder), settings, image_size, held, bent)
        # a known answer is only spoilt by a rough search
        begin = best_start(first, starts) if start is None else starts[0]
        for rung, terms in enumerate(ladder):
            progress(0.1 + 0.8 * rung / len(ladder), f"Fitting {' '.join(terms) or 'without distortion'}")
            lean = leanings or leanings_for(best, terms)
            task = task_of(starts[0], problem, terms, settings, image_size, held, bent, lean)
            near = begin if best is None or not best.terms else best.minimum.state
            try:
                found = _first_solved(task, [near, begin, *starts], terms, settings)
            except FitFailed as refused:  # a lens too simple or too free for these clicks; the others may do
                refusal = refused
                continue
            tried[" ".join(terms)] = found
            if best is None or (lean and not leanings) or significantly_better(best, found):
                best, leant = found, lean
        if best is None:
            raise refusal
        state = best.minimum.state
        model = cls.MODEL(**state.parameters(), width_px=width_px, height_px=height_px, n_rectangles_x=n_x,
                          n_rectangles_y=n_y, region=region, image_size=image_size)
        if not model.plausible():
            raise FitFailed("The clicks lead to a camera that cannot be: "
                            f"{model.position_mm[2] / 1000:.3g} m above the carpet with a focal length of "
                            f"{model.focal_px:.3g} px.",
                            "Check which line each click belongs to, and the region; then click more points.",
                            reason="implausible-camera")
        inliers = inlier_masks(observations, problem.owners, best.inliers)
        choices = {"start": parameters_json(model), "click_sigma_px": best.sigma_px}
        if "terms" in {o.name for o in cls.OPTIONS}:
            choices = {"terms": list(best.terms), **choices, "leanings": leant}
        notes = {
            "terms": {"chosen": best.terms, "tried": {
                t: {"rms_px": f.rms_px, "parameters": int(f.task.free.sum())} for t, f in tried.items()}},
            "click_sigma_px": best.sigma_px, "degrees_of_freedom": best.freedom,
            "parameters": int(best.task.free.sum()),
            "line_offsets_mm": dict(zip(problem.line_names, map(float, state.offsets_mm), strict=True)),
            "choices": choices,
        }
        warnings = tuple(name_strays(observations, problem.owners, best.inliers, best.pixels))
        names = tuple(name for name, free in zip(best.task.names, best.task.free, strict=True) if free)
        return Fit(model, inliers, (True,) * len(observations), warnings, notes, covariance=best.covariance,
                   parameter_names=names)


def _first_solved(task: Task, starts: Iterable[RayState], terms: tuple[str, ...], settings: Mapping[str, Any]) -> Found:
    """From the first start that leads anywhere: some see no click at all once their lens is another."""
    for start in starts:
        try:
            return solve(task, start if task.held else cleared(start, terms), settings)
        except FitFailed as refused:
            refusal = refused
    raise refusal
