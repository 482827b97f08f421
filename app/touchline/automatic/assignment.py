"""From one picture to the field's lines by name, a fit, and its verification.

lines = detect_lines(pixels)                 ridges along bright lines, as chains of points
found = points_on_lines(lines, field, region, search(lines.seen, …))
                                             which line is which; points on each, as an operator would click
result, found = calibrate(found, …)          the same models, outlier rejection and verdicts as for clicks
verify(found, lines, region)                 whether the picture shows what that camera expects
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.automatic.matching import FINE_STEPS, CameraCandidate
from touchline.automatic.refinement import (
    FINER_CAPTURE_PX,
    MAX_FINER_POINTS,
    explained_points,
    outer_mm,
    refine_camera,
    with_brown_conrady,
)
from touchline.automatic.search import SearchResult
from touchline.automatic.seen_lines import SeenLines
from touchline.core import opencv
from touchline.core.errors import FitFailed
from touchline.core.field import Arc, Field, Line, Region
from touchline.core.geometry import (
    Array,
    ImageSize,
    Points,
    inside_picture,
    root_mean_square,
    with_z,
)
from touchline.core.jobs import Progress, no_progress
from touchline.core.json_values import JsonObject
from touchline.core.records import Fit, Observation, Observations
from touchline.core.statements import say
from touchline.evaluate.verification import MARKING_FOUND, MIN_AHEAD, Verification
from touchline.fitting import FITTERS
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

# of the picture for which CAPTURE_PX is given, and of that in a small one
NOMINAL_WIDTH_PX, MIN_SCALE = 1280, 0.8
CAPTURE_PX = 4.0  # about the expected place of a line
MAX_POINTS = 240  # in all: more cost time and tell nothing new
MIN_STEP_PX = 6.0  # from one point to the next
CLEARANCE_PX = 4.0  # of other paint
# of a blur that lets so many times as many places show a line
BLUR_SIGMA_PX, MIN_BLUR_GAIN = 0.6, 1.1
MIN_MARKING_POINTS = 3  # points of a marking that are worth naming it
MIN_WIDTH_SHARE = 0.8  # of a marking, for its paint's width to be known
MIN_SURE_SHARE = 0.95  # of the expected lines
# of the places where a line was found: fewer in the second measuring, and the first stands
MIN_REMEASURED_HITS = 0.9
# along each side of an area; share of it that one camera shows more than another
AREA_CELLS, MIN_AREA_GAIN = 10, 0.05
MIN_LINES = 3  # straight ones, for a match
# between the region's corners as two cameras see them, which are then the same
MAX_SAME_LINE_OFFSET_PX = 12.0
# of the diagonal: a line of that length on the carpet wants an explanation
MIN_UNEXPLAINED_LENGTH = 0.05
CHAIN_STEP = 4  # px along those chains
MAX_CHAINS_SHOWN, MAX_CHAIN_POINTS = 60, 12


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
        return [
            chain[np.unique(np.linspace(0, len(chain) - 1, MAX_CHAIN_POINTS).round().astype(int))]
            .round(1)
            .tolist()
            for chain in self.chains[:MAX_CHAINS_SHOWN]
        ]


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
        clear, hit = (
            np.bincount(self.expected.marking[of], minlength=count)
            for of in (self.expected.clear, self.hits)
        )
        return {
            number: width
            for number, width in self.widths.items()
            if hit[number] > MIN_WIDTH_SHARE * clear[number]
        }


def detect_lines(pixels: NDArray[np.uint8]) -> DetectedLines:
    """Detect the painted lines of a picture."""
    found = painted_lines(opencv.to_grey(pixels))
    return DetectedLines(found.gray, found.chains, found.along)


def points_on_lines(
    lines: DetectedLines,
    field: Field,
    region: Region,
    searched: SearchResult,
) -> LineAssignment | None:
    """Measure points on each line that the best of the cameras sees; None where there is none.

    Of several that score alike, the best is the only one that the measured lines do not contradict, if just one is.
    """
    if not searched.candidates:
        return None
    best, *others = (
        _with_more_of_area(each, field, region, lines.size) for each in searched.candidates
    )
    rivals = [
        each
        for each in others
        if each.value > (1 - MIN_AHEAD) * best.value and not _are_twins(best, each, region)
    ]
    measured = [
        _points_of(lines, field, region, SearchResult((each,), searched.lines))
        for each in (best, *rivals)
    ]
    proven = [
        found
        for found in measured
        if found is not None and not verify(found, lines, region).doubts()
    ]
    if rivals and len(proven) == 1:
        return proven[0]
    return None if measured[0] is None else replace(measured[0], searched=searched)


def turn_deg(state: RayCameraParameters, region: Region) -> float:
    """Return how far the region is turned clockwise in the picture from how it stands when corrected; NaN unseen."""
    sides = np.array([region.width_mm, region.height_mm])
    ends = state.project(
        with_z(region.field_from_region(np.array([[0.4, 0.5], [0.6, 0.5]]) * sides))
    )
    right = ends[1] - ends[0]
    return float(np.degrees(np.arctan2(right[1], right[0])))


def half_turned(candidate: CameraCandidate) -> CameraCandidate:
    """Return the camera that sees the same over the field turned by 180° about its centre."""
    turn, state = np.array([-1.0, -1.0, 1.0]), candidate.refined.state
    turned = replace(
        state,
        camera_from_field=state.camera_from_field * turn,
        position_mm=state.position_mm * turn,
    )
    return replace(candidate, refined=replace(candidate.refined, state=turned))


def _with_more_of_area(
    candidate: CameraCandidate, field: Field, region: Region, size: ImageSize
) -> CameraCandidate:
    """Return the camera, or what sees the same over the field turned by 180°, if that has more of the area in sight."""
    if not is_half_turn_symmetric(field):
        return candidate
    u, v = (
        np.linspace(0.05, 0.95, AREA_CELLS) * side for side in (region.width_mm, region.height_mm)
    )
    cells = with_z(region.field_from_region(np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)))
    turned = half_turned(candidate)
    share, share_turned = (
        float(inside_picture(one.refined.state.project(cells), size, 0).mean())
        for one in (candidate, turned)
    )
    if share_turned < share + MIN_AREA_GAIN:
        return candidate
    return replace(
        turned, turn_deg=turn_deg(turned.refined.state, region), region_seen=share_turned
    )


def _points_of(
    lines: DetectedLines, field: Field, region: Region, searched: SearchResult
) -> LineAssignment | None:
    """Measure points where the best camera expects lines, by the Brown–Conrady lens first, which fits most of them."""
    state, seen = searched.candidates[0].refined.state, lines.seen
    coarse = FieldPattern.of(field, field.length_mm / FINE_STEPS)
    finer = refine_camera(
        with_brown_conrady(state, coarse, seen.size),
        coarse,
        seen,
        FINER_CAPTURE_PX,
        MAX_FINER_POINTS,
    )
    found = None if finer is None else _measured(lines, finer.state, field, region, searched)
    # of a fisheye, the other lens may see further out
    if found is None or found.share < MIN_SURE_SHARE:
        other = _measured(
            lines, state, field, region, searched, NO_WIDTHS if found is None else found.sure_widths
        )
        found = max(
            (each for each in (found, other) if each), key=lambda each: each.share, default=None
        )
    return found


def _measured(
    lines: DetectedLines,
    state: RayCameraParameters,
    field: Field,
    region: Region,
    searched: SearchResult,
    widths: Mapping[int, float] = NO_WIDTHS,
) -> LineAssignment | None:
    """Measure points across each line where that camera expects it; None where none is found.

    widths: of markings, as far as they are known.
    """
    pattern = fine_pattern(field)
    places = sample_lines_evenly(
        state.project, pattern, lines.size, MAX_POINTS, MIN_STEP_PX, CLEARANCE_PX
    )
    if not places.clear.any():
        return None
    profiles = _profiles(lines, places, widths)
    hits = profiles.found & places.clear
    hits &= ~strays(profiles.middle, hits, places.marking)
    points = places.places + np.where(hits, profiles.middle, 0.0)[:, None] * places.normals
    observations = []
    for number, marking in enumerate(pattern.markings):
        on_marking = hits & (places.marking == number)
        if on_marking.sum() >= MIN_MARKING_POINTS:
            observations.append(
                Observation(field.observed_name(marking.name, region), "line", points[on_marking])
            )
        else:
            hits = hits & ~on_marking
    rms_px = root_mean_square(profiles.middle[hits]) if hits.any() else np.inf
    if not observations:
        return None
    return LineAssignment(
        tuple(observations), state, searched, places, hits, field, rms_px, profiles.widths
    )


def _profiles(lines: DetectedLines, places: LineSamples, widths: Mapping[int, float]) -> Profiles:
    """Measure across the lines, and where too few are found, in the blurred picture too."""
    capture_px = CAPTURE_PX * max(lines.size.width / NOMINAL_WIDTH_PX, MIN_SCALE)

    def across(gray: NDArray[np.uint8]) -> Profiles:
        return across_lines(
            gray, places.places, places.normals, places.width_px, places.marking, capture_px, widths
        )

    profiles = across(lines.gray)
    if profiles.found[places.clear].mean() >= MIN_SURE_SHARE:
        return profiles
    # Lines of one pixel without soft edges, and sharpened ones, have no bar's profile.
    blurred = across(np.asarray(cv2.GaussianBlur(lines.gray, (0, 0), BLUR_SIGMA_PX), np.uint8))
    is_better = (
        blurred.found[places.clear].sum() > MIN_BLUR_GAIN * profiles.found[places.clear].sum()
    )
    return blurred if is_better else profiles


def calibrate(
    found: LineAssignment,
    lines: DetectedLines,
    field: Field,
    region: Region,
    models: Sequence[str],
    options: Mapping[str, Any],
    progress: Progress = no_progress,
) -> tuple[CalibrationResult, LineAssignment]:
    """Fit and evaluate the found points as clicks are; return the calibration, and the points that it rests on.

    Of several models it is the one that the points make most probable; FitFailed where none can be fitted. A model with
    rays starts from the camera that was found, and measures the lines once more, where itself sees them: the search's
    own lens may miss those near the picture's edge.
    """
    first = _most_probable(found, field, region, lines.size, models, options)
    start: JsonObject = {}
    if isinstance(first.model, RayCamera):
        painted = field.as_painted(first.notes, region)
        again = _measured(
            lines,
            RayCameraParameters.of(first.model),
            painted,
            region,
            found.searched,
            found.widths,
        )
        if again is not None and again.hits.sum() >= MIN_REMEASURED_HITS * found.hits.sum():
            found = again
        start = {name: first.notes["choices"][name] for name in ("start", "start_lines_mm")}
    result = calibration.calibrate(
        found.observations,
        field,
        region,
        lines.size,
        first.model.NAME,
        {**options, **start},
        progress,
    )
    return result, found


def _most_probable(
    found: LineAssignment,
    field: Field,
    region: Region,
    size: ImageSize,
    models: Sequence[str],
    options: Mapping[str, Any],
) -> Fit:
    fits, refused = [], []
    for name in models:
        try:
            fits.append(_fitted(found, field, region, size, name, options))
        except FitFailed as refusal:
            refused.append(refusal)
    if not fits:
        raise refused[0]
    return max(fits, key=lambda fit: fit.notes.get("log_evidence", -np.inf))


def _fitted(
    found: LineAssignment,
    field: Field,
    region: Region,
    size: ImageSize,
    model: str,
    options: Mapping[str, Any],
) -> Fit:
    start = _start(found.state, model, region, size)
    if start is not None:
        try:
            return FITTERS[model].fit(
                found.observations, field, region, size, {**options, "start": start}
            )
        except FitFailed:
            # a lens with one term less may not see as far as this picture shows: then it starts as
            # for clicks
            pass
    return FITTERS[model].fit(found.observations, field, region, size, options)


def _start(
    state: RayCameraParameters, name: str, region: Region, size: ImageSize
) -> JsonObject | None:
    """Return the found camera as parameters of that model; None for a model without such a start."""
    model_class = MODELS[name]
    if not issubclass(model_class, RayCamera):
        return None
    k1 = float(state.terms[0])
    terms = (
        state.terms if model_class.LENS is state.lens else lens_fitter(model_class).start_terms(k1)
    )
    start = replace(state, lens=model_class.LENS, terms=np.asarray(terms, float))
    model = model_class(
        **start.parameters(),
        width_px=100.0,
        height_px=100.0,
        n_rectangles_x=1,
        n_rectangles_y=1,
        region=region,
        image_size=size,
    )
    return parameters_json(model) if model.plausible() else None


def verify(found: LineAssignment, lines: DetectedLines, region: Region) -> Verification:
    """Compare what the camera expects with what the picture shows; independent of the model fitted afterwards."""
    markings = found.field.markings
    length_px = np.where(found.expected.clear, found.expected.length_px, 0.0)
    expected_px, found_px = (
        np.asarray(
            np.bincount(found.expected.marking, weights=px, minlength=len(markings)), np.float64
        )
        for px in (length_px, length_px * found.hits)
    )
    explained, unexplained = _explained(found, lines)
    best, *others = found.searched.candidates
    rival = max(
        (
            each.value / max(best.value, 1e-9)
            for each in others
            if not _are_twins(best, each, region)
        ),
        default=0.0,
    )
    shown = [
        marking
        for marking, px, of_px in zip(markings, found_px, expected_px, strict=True)
        if px >= max(MARKING_FOUND * of_px, 1e-9)
    ]
    return Verification(
        tuple(marking.name for marking in markings),
        expected_px,
        found_px,
        explained,
        unexplained,
        found.rms_px,
        rival,
        float(np.hypot(*lines.size)),
        _is_rectangle(shown),
    )


def _is_rectangle(found: Sequence[Line | Arc]) -> bool:
    """Return whether the markings are no more than two parallel lines and two across them."""
    lines = [marking for marking in found if isinstance(marking, Line)]
    levels = [
        {round(line.start[axis]) for line in lines if abs(line.start[axis] - line.end[axis]) < 1.0}
        for axis in (0, 1)
    ]
    return len(lines) == len(found) and max(map(len, levels)) <= 2


def _are_twins(one: CameraCandidate, other: CameraCandidate, region: Region) -> bool:
    """Whether the other is the same camera over the field turned by 180°."""
    corners = np.array([(x, y, 0.0) for x in region.x_mm for y in region.y_mm])
    apart = one.refined.state.project(corners) - other.refined.state.project(corners * (-1, -1, 1))
    return bool(np.abs(apart).max() < MAX_SAME_LINE_OFFSET_PX)


def _explained(found: LineAssignment, lines: DetectedLines) -> tuple[float, float]:
    """Px of long chains on the field's carpet that lie along markings, and that do not."""
    size = lines.size
    min_length_px = MIN_UNEXPLAINED_LENGTH * np.hypot(*size)
    long = [
        (chain[::CHAIN_STEP], along[::CHAIN_STEP])
        for chain, along in zip(lines.chains, lines.along, strict=True)
        if np.linalg.norm(chain[-1] - chain[0]) > min_length_px
    ]
    if not long:
        return 0.0, 0.0
    points, along = (np.concatenate(part) for part in zip(*long, strict=True))
    pattern = FieldPattern.of(found.field, found.field.length_mm / FINE_STEPS)
    explained, unexplained = explained_points(
        found.state, pattern, outer_mm(found.field), points, along, size
    )
    return float(CHAIN_STEP * explained), float(CHAIN_STEP * unexplained)


def candidates_json(searched: SearchResult, region: Region) -> list[JsonObject]:
    """Each with its evidence; "turned": whether it is the first one with the field turned by 180°."""
    first = searched.candidates[0] if searched.candidates else None
    return [
        {
            **_candidate_json(each),
            "turned": first is not None and each is not first and _are_twins(first, each, region),
        }
        for each in searched.candidates
    ]


def _candidate_json(candidate: CameraCandidate) -> JsonObject:
    state = candidate.refined.state
    return {
        "found": candidate.found,
        "explained": candidate.explained,
        "turn_deg": candidate.turn_deg,
        "region_seen": candidate.region_seen,
        "height_mm": float(state.position_mm[2]),
        "position_mm": [float(v) for v in state.position_mm],
        "focal_px": float(np.exp(state.log_focal)),
        "rms_px": candidate.refined.rms_px,
    }


def no_match_error(searched: SearchResult) -> FitFailed:
    """Return the error that says why no camera was found."""
    lines = len(searched.lines)
    if lines < MIN_LINES:
        found = (
            say("automatic.no-line", "No line detected in the image."),
            say("automatic.one-line", "Only 1 straight line detected in the image."),
            say("automatic.two-lines", "Only 2 straight lines detected in the image."),
        )
        return FitFailed(
            found[lines],
            say(
                "automatic.sharper-image",
                "Use a sharper or brighter image that shows more field lines, or mark points.",
            ),
            reason="no-lines",
        )
    return FitFailed(
        say(
            "automatic.no-match",
            "{lines} lines were detected, but they match no camera pose above this "
            "field and covered area.",
            lines=lines,
        ),
        say("automatic.check-field", "Check the field type and the covered area, or mark points."),
        reason="no-match",
    )
