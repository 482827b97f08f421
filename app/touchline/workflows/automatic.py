"""Calibration without clicks: from one picture to the field's lines by name, a fit, and its verification.

    lines = detect_lines(pixels)                 ridges along bright lines, as chains of points
    found, _ = assign_lines(lines, field, region)    which line is which; points on each, as an operator would click
    made = calibrate(found, …)                   the same models, outlier rejection and verdicts as for clicks
    verify(found, lines, region)                 whether the picture shows what that camera expects
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core import opencv
from touchline.core.errors import FitFailed
from touchline.core.field import Arc, Field, Line, Region
from touchline.core.geometry import Array, ImageSize, Points, inside_picture, root_mean_square, with_z
from touchline.core.jobs import Progress, no_progress
from touchline.core.records import Fit, Observation, Observations
from touchline.core.statements import say
from touchline.evaluate.verification import MARKING_FOUND, MIN_AHEAD, Verification
from touchline.fitting import FITTERS
from touchline.fitting.field_lines.refinement import (
    FINER_POINTS,
    FINER_PX,
    explained_points,
    outer_mm,
    refine_camera,
    with_brown_conrady,
)
from touchline.fitting.field_lines.search import (
    FINE_STEPS,
    CameraCandidate,
    PosePrior,
    SearchResult,
    candidate_json,
    search,
)
from touchline.fitting.field_lines.seen_lines import SeenLines
from touchline.fitting.field_pattern import (
    FieldPattern,
    LineSamples,
    fine_pattern,
    is_half_turn_symmetric,
    sample_lines_evenly,
)
from touchline.fitting.ray_camera.fit import lens_fitter
from touchline.fitting.ray_camera.parameters import RayCameraParameters
from touchline.models import MODELS, parameters_json
from touchline.models.ray_camera import RayCamera
from touchline.vision.profiles import NO_WIDTHS, Profiles, across_lines, strays
from touchline.vision.ridges import painted_lines
from touchline.workflows import calibration
from touchline.workflows.calibration import CalibrationResult

SURELY_FOUND = 0.95  # of the expected lines
AREA_CELLS, CLEARLY_MORE = 10, 0.05  # of an area, along each side; of it, by which one camera shows more than another
MOSTLY = 0.8  # of a marking, for its paint's width to be known
SOFT_PX, MORE = 0.6, 1.1  # σ of a blur, where so many times as many places show a line with it as without
POINTS = 240  # in all: more cost time and tell nothing new
APART_PX = 6.0  # at least, from one to the next
CAPTURE_PX = 4.0  # about the expected place, in a picture of 1280 px
CLEAR_PX = 4.0  # of other paint
MIN_MARKING_POINTS = 3  # points of a marking that are worth naming it
LONG = 0.05  # of the diagonal: a line of that length on the carpet wants an explanation
EVERY = 4  # px along those chains
MAX_CHAINS_SHOWN = 60
MIN_HITS_KEPT = 0.9  # of the places where a line was found: fewer in the second measuring, and the first one stands
MIN_LINES = 3  # straight ones, for a match
TWIN_PX = 12.0  # between the region's corners as two cameras see them, which are then the same


@dataclass(frozen=True, eq=False)
class DetectedLines:
    """The grey picture with its lines bright, and chains (n, 2) px of these with their directions, longest first."""

    gray: NDArray[np.uint8]
    chains: tuple[Points, ...]
    along: tuple[Array, ...]

    @property
    def size(self) -> ImageSize:
        return ImageSize(self.gray.shape[1], self.gray.shape[0])

    @cached_property
    def seen(self) -> SeenLines:
        """The same, made ready for matching with fields."""
        return SeenLines.of(self.chains, self.along, self.size)

    def polylines(self) -> list[list[list[float]]]:
        """The longest chains as polylines, for drawing."""
        return [chain[np.unique(np.linspace(0, len(chain) - 1, 12).round().astype(int))].round(1).tolist()
                for chain in self.chains[:MAX_CHAINS_SHOWN]]


@dataclass(frozen=True, eq=False)
class LineAssignment:
    """observations: points on each marking. state: the camera that named them. hits: where a line was found.

    field: with its markings where they are painted, as far as that is known. rms_px: of the points about the field as
    that camera sees it. widths: of each marking, as Profiles has them.
    """

    observations: Observations
    state: RayCameraParameters
    searched: SearchResult
    expected: LineSamples
    hits: NDArray[np.bool_]
    field: Field
    rms_px: float
    widths: Mapping[int, float]

    @property
    def share(self) -> float:
        """Of the places where a line is expected and nothing is near, those where one was found."""
        return float(self.hits.sum() / max(self.expected.clear.sum(), 1))

    @property
    def sure_widths(self) -> Mapping[int, float]:
        """The widths of those markings of which most was found."""
        count = len(self.field.markings)
        clear, hit = (np.bincount(self.expected.marking[of], minlength=count)
                      for of in (self.expected.clear, self.hits))
        return {number: width for number, width in self.widths.items() if hit[number] > MOSTLY * clear[number]}


def detect_lines(pixels: NDArray[np.uint8]) -> DetectedLines:
    """Detect the painted lines of a picture."""
    found = painted_lines(opencv.to_grey(pixels))
    return DetectedLines(found.gray, found.chains, found.along)


def assign_lines(lines: DetectedLines, field: Field, region: Region, rough: PosePrior = PosePrior(),  # noqa: B008
                 progress: Progress = no_progress) -> tuple[LineAssignment | None, SearchResult]:
    """Find which line is which, and points on each; None where no camera fits."""
    searched = search(lines.seen, field, region, rough, progress)
    return points_on_lines(lines, field, region, searched), searched


def points_on_lines(lines: DetectedLines, field: Field, region: Region, searched: SearchResult,
                    ) -> LineAssignment | None:
    """Measure points on each line that the best of the cameras sees; None where there is none.

    Of several that score alike, the best is the only one that the measured lines do not contradict, if just one is.
    """
    if not searched.candidates:
        return None
    best, *others = (_as_the_area_lies(c, field, region, lines.size) for c in searched.candidates)
    rivals = [c for c in others if c.value > (1 - MIN_AHEAD) * best.value and not _twins(best, c, region)]
    alone = [_points_of(lines, field, region, SearchResult((c,), searched.lines)) for c in (best, *rivals)]
    proven = [found for found in alone if found is not None and not verify(found, lines, region).doubts()]
    if rivals and len(proven) == 1:
        return proven[0]
    return None if alone[0] is None else replace(alone[0], searched=searched)


def turn_deg(state: RayCameraParameters, region: Region) -> float:
    """Return how far the region is turned clockwise in the picture from how it stands when corrected; NaN unseen."""
    sides = np.array([region.width_mm, region.height_mm])
    ends = state.project(with_z(region.field_from_region(np.array([[0.4, 0.5], [0.6, 0.5]]) * sides)))
    right = ends[1] - ends[0]
    return float(np.degrees(np.arctan2(right[1], right[0])))


def half_turned(candidate: CameraCandidate) -> CameraCandidate:
    """Return the camera that sees the same over the field turned by 180° about its centre."""
    turn, state = np.array([-1.0, -1.0, 1.0]), candidate.refined.state
    turned = replace(state, camera_from_field=state.camera_from_field * turn, position_mm=state.position_mm * turn)
    return replace(candidate, refined=replace(candidate.refined, state=turned))


def _as_the_area_lies(candidate: CameraCandidate, field: Field, region: Region, size: ImageSize) -> CameraCandidate:
    """Return the camera, or what sees the same over the field turned by 180°, if that has more of the area in sight."""
    if not is_half_turn_symmetric(field):
        return candidate
    u, v = (np.linspace(0.05, 0.95, AREA_CELLS) * side for side in (region.width_mm, region.height_mm))
    cells = with_z(region.field_from_region(np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)))
    turned = half_turned(candidate)
    now, then = (float(inside_picture(one.refined.state.project(cells), size, 0).mean()) for one in (candidate, turned))
    if then < now + CLEARLY_MORE:
        return candidate
    return replace(turned, turn_deg=turn_deg(turned.refined.state, region), region_seen=then)


def _points_of(lines: DetectedLines, field: Field, region: Region, searched: SearchResult) -> LineAssignment | None:
    state, seen = searched.candidates[0].refined.state, lines.seen
    coarse = FieldPattern.of(field, field.length_mm / FINE_STEPS)
    finer = refine_camera(with_brown_conrady(state, coarse, seen.size), coarse, seen, FINER_PX, FINER_POINTS)
    found = None if finer is None else _measured(lines, finer.state, field, region, searched)
    if found is None or found.share < SURELY_FOUND:  # of a fisheye, the other lens may see further out
        other = _measured(lines, state, field, region, searched, NO_WIDTHS if found is None else found.sure_widths)
        found = max((each for each in (found, other) if each), key=lambda each: each.share, default=None)
    return found


def _measured(seen: DetectedLines, state: RayCameraParameters, field: Field, region: Region,
              searched: SearchResult, widths: Mapping[int, float] = NO_WIDTHS) -> LineAssignment | None:
    size = seen.size
    scale = max(size.width / 1280, 0.8)
    pattern = fine_pattern(field)
    places = sample_lines_evenly(state.project, pattern, size, POINTS, APART_PX, CLEAR_PX)
    if not places.clear.any():
        return None
    def across(gray: NDArray[np.uint8]) -> Profiles:
        return across_lines(gray, places.places, places.normals, places.width_px, places.marking, CAPTURE_PX * scale,
                            widths)
    profiles = across(seen.gray)
    if profiles.found[places.clear].mean() < SURELY_FOUND:
        # Lines of one pixel without soft edges, and sharpened ones, have no bar's profile.
        soft = across(np.asarray(cv2.GaussianBlur(seen.gray, (0, 0), SOFT_PX), np.uint8))
        profiles = soft if soft.found[places.clear].sum() > MORE * profiles.found[places.clear].sum() else profiles
    hits = profiles.found & places.clear
    hits &= ~strays(profiles.middle, hits, places.marking)
    points = places.places + np.where(hits, profiles.middle, 0.0)[:, None] * places.normals
    observations = []
    for number, marking in enumerate(pattern.markings):
        of = hits & (places.marking == number)
        if of.sum() >= MIN_MARKING_POINTS:
            observations.append(Observation(field.observed_name(marking.name, region), "line", points[of]))
        else:
            hits = hits & ~of
    rms_px = root_mean_square(profiles.middle[hits]) if hits.any() else np.inf
    if not observations:
        return None
    return LineAssignment(tuple(observations), state, searched, places, hits, field, rms_px, profiles.widths)


def calibrate(found: LineAssignment, seen: DetectedLines, field: Field, region: Region, models: Sequence[str],
              options: Mapping[str, Any], progress: Progress = no_progress) -> tuple[CalibrationResult, LineAssignment]:
    """Fit and evaluate the found points as clicks are; return the calibration, and the points that it rests on.

    Of several models it is the one that the points make most probable; FitFailed where none can be fitted. A model with
    rays starts from the camera that was found, and measures the lines once more, where itself sees them: the search's
    own lens may miss those near the picture's edge.
    """
    first, begin = _most_probable(found, field, region, seen.size, models, options), {}
    if isinstance(first.model, RayCamera):
        painted = field.as_painted(first.notes, region)
        again = _measured(seen, RayCameraParameters.of(first.model), painted, region, found.searched, found.widths)
        found = again if again is not None and again.hits.sum() >= MIN_HITS_KEPT * found.hits.sum() else found
        begin = {name: first.notes["choices"][name] for name in ("start", "start_lines_mm")}
    return calibration.calibrate(found.observations, field, region, seen.size, first.model.NAME, {**options, **begin},
                                 progress), found


def _most_probable(found: LineAssignment, field: Field, region: Region, size: ImageSize, models: Sequence[str],
                   options: Mapping[str, Any]) -> Fit:
    fits, refused = [], []
    for name in models:
        try:
            fits.append(_fitted(found, field, region, size, name, options))
        except FitFailed as refusal:
            refused.append(refusal)
    if not fits:
        raise refused[0]
    return max(fits, key=lambda fit: fit.notes.get("log_evidence", -np.inf))


def _fitted(found: LineAssignment, field: Field, region: Region, size: ImageSize, model: str,
            options: Mapping[str, Any]) -> Fit:
    begin = _start(found.state, model, region, size)
    if begin is not None:
        try:
            return FITTERS[model].fit(found.observations, field, region, size, {**options, "start": begin})
        except FitFailed:
            pass  # a lens with one term less may not see as far as this picture shows: then it begins as for clicks
    return FITTERS[model].fit(found.observations, field, region, size, options)


def _start(state: RayCameraParameters, name: str, region: Region, size: ImageSize) -> dict[str, Any] | None:
    """Return the found camera as parameters of that model; None for a model without such a start."""
    model_class = MODELS[name]
    if not issubclass(model_class, RayCamera):
        return None
    k1 = float(state.terms[0])
    terms = state.terms if model_class.LENS is state.lens else lens_fitter(model_class).start_terms(k1)
    given = replace(state, lens=model_class.LENS, terms=np.asarray(terms, float))
    begin = model_class(**given.parameters(), width_px=100.0, height_px=100.0, n_rectangles_x=1, n_rectangles_y=1,
                        region=region, image_size=size)
    return parameters_json(begin) if begin.plausible() else None


def verify(found: LineAssignment, seen: DetectedLines, region: Region) -> Verification:
    """Compare what the camera expects with what the picture shows; independent of the model fitted afterwards."""
    markings = found.field.markings
    count = len(markings)
    length = np.where(found.expected.clear, found.expected.length_px, 0.0)
    wanted, there = (np.asarray(np.bincount(found.expected.marking, weights=px, minlength=count), np.float64)
                     for px in (length, length * found.hits))
    explained, unexplained = _explained(found, seen)
    best, *others = found.searched.candidates
    rival = max((c.value / max(best.value, 1e-9) for c in others if not _twins(best, c, region)), default=0.0)
    return Verification(tuple(m.name for m in markings), wanted, there, explained, unexplained,
                        found.rms_px, rival, float(np.hypot(*seen.size)),
                        _is_rectangle([m for m, px, of in zip(markings, there, wanted, strict=True)
                                       if px >= max(MARKING_FOUND * of, 1e-9)]))


def _is_rectangle(found: Sequence[Line | Arc]) -> bool:
    """Return whether the markings are no more than two parallel lines and two across them."""
    lines = [marking for marking in found if isinstance(marking, Line)]
    levels = [{round(line.start[axis]) for line in lines if abs(line.start[axis] - line.end[axis]) < 1.0}
              for axis in (0, 1)]
    return len(lines) == len(found) and max(map(len, levels)) <= 2


def _twins(one: CameraCandidate, other: CameraCandidate, region: Region) -> bool:
    """Whether the other is the same camera over the field turned by 180°."""
    corners = np.array([(x, y, 0.0) for x in region.x_mm for y in region.y_mm])
    apart = one.refined.state.project(corners) - other.refined.state.project(corners * (-1, -1, 1))
    return bool(np.abs(apart).max() < TWIN_PX)


def _explained(found: LineAssignment, seen: DetectedLines) -> tuple[float, float]:
    """Px of long chains on the field's carpet that lie along markings, and that do not."""
    size = seen.size
    long = [(chain[::EVERY], along[::EVERY]) for chain, along in zip(seen.chains, seen.along, strict=True)
            if np.linalg.norm(chain[-1] - chain[0]) > LONG * np.hypot(*size)]
    if not long:
        return 0.0, 0.0
    points, along = (np.concatenate(part) for part in zip(*long, strict=True))
    pattern = FieldPattern.of(found.field, found.field.length_mm / FINE_STEPS)
    explained, unexplained = explained_points(found.state, pattern, outer_mm(found.field), points, along, size)
    return float(EVERY * explained), float(EVERY * unexplained)


def candidates_json(searched: SearchResult, region: Region) -> list[dict[str, Any]]:
    """Each with its evidence; "turned": whether it is the first one with the field turned by 180°."""
    first = searched.candidates[0] if searched.candidates else None
    return [{**candidate_json(c), "turned": first is not None and c is not first and _twins(first, c, region)}
            for c in searched.candidates]


def no_match_error(seen: DetectedLines, searched: SearchResult) -> FitFailed:
    """Return the error that says why no camera was found."""
    lines = len(searched.lines)
    if lines < MIN_LINES:
        found = (say("automatic.no-line", "No line detected in the image."),
                 say("automatic.one-line", "Only 1 straight line detected in the image."),
                 say("automatic.two-lines", "Only 2 straight lines detected in the image."))
        return FitFailed(found[lines], say("automatic.sharper-image", "Use a sharper or brighter image that shows more "
                                           "field lines, or mark points."), reason="no-lines")
    return FitFailed(say("automatic.no-match", "{lines} lines were detected, but they match no camera pose above this "
                         "field and covered area.", lines=lines),
                     say("automatic.check-field", "Check the field type and the covered area, or mark points."),
                     reason="no-match")
