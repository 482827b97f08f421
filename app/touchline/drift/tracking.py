"""Find the field's lines again after the picture has moved since its camera was calibrated."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from touchline.core.field import Field
from touchline.core.geometry import Array, ImageSize, Indices, Mask, Pixels, Points, inside_picture
from touchline.evaluate.field_lines.expected import expected_lines, lines_in
from touchline.evaluate.field_lines.motion import find_motion
from touchline.fitting.field_pattern import FieldPattern, LineSamples, fine_pattern
from touchline.fitting.image_motion import MotionField, estimate_motion
from touchline.models import CameraModel
from touchline.vision.patches import LinePatches
from touchline.vision.profiles import NO_WIDTHS, across_lines, strays

MAX_PLACES = 240
MIN_APART_PX, MIN_CLEAR_PX = 6.0, 5.0
MAX_MODEL_ERROR_PX = 6.0  # so far beside its place a line may be, in a picture that is
# so wide; in a small one as in one of so much of it
REFERENCE_WIDTH_PX, MIN_WIDTH_RATIO = 1280, 0.7
LINE_SIGMA_PX = 0.1  # of a line's middle
MAX_STEPS = 4
MIN_POINTS, MIN_SHARE = 20, 0.25
# robots and people leave 0.55 of each marking, and mostly 0.85
MIN_MARKING_PLACES, MIN_MARKING_SHARE = 8, 0.5
IMAGE_MARGIN_PX = 1


@dataclass(frozen=True, eq=False)
class TrackedLines:
    """Where lines are now: points (n, 2) px, the places (n, 2) px where they were, normals (n, 2), markings (n,).

    share: of the places that should show a line. moved_px: how far the picture moved there, 95 % of them no further.
    missing: of the places that lie in the picture, the share that is on markings hardly seen anywhere.
    """

    points: Points
    places: Points
    normals: Points
    marking: Indices
    share: float
    pattern: FieldPattern
    moved_px: float
    missing: float


def track_lines(
    gray: Pixels, model: CameraModel, field: Field, before: Pixels | None = None
) -> TrackedLines | None:
    """Find the lines again; None where too few are seen, near their places or a little further away.

    gray: (h, w), with its lines bright. before: likewise the picture in which the calibration was made, which shows the
    lines more exactly than the model.
    """
    size, pattern = ImageSize(gray.shape[1], gray.shape[0]), fine_pattern(field)
    flow = MotionField(model, (size.width, size.height))
    lines = expected_lines(model, pattern, size, MAX_PLACES, MIN_APART_PX, MIN_CLEAR_PX)
    lines = lines.of(lines.clear & np.all(np.isfinite(flow.at(lines.places)), axis=(1, 2)))
    if len(lines.places) < MIN_POINTS:
        return None
    reach_px = MAX_MODEL_ERROR_PX * max(size.width / REFERENCE_WIDTH_PX, MIN_WIDTH_RATIO)
    widths, seen = NO_WIDTHS, []
    if before is not None and before.shape == gray.shape:
        then, widths_then = lines_in(before, lines, reach_px)
        if len(then.places) >= MIN_POINTS:
            lines, widths = then, widths_then
            painted_px = lines.width_px * [widths[int(number)] for number in lines.marking]
            seen = [LinePatches.of([before], lines.places, lines.normals, painted_px)]
    tracker = _Tracker(gray, flow, lines, widths, reach_px, size)
    # As paint should look, and as it looked: where many lines are alike, either may be led astray.
    q = tracker.find_motion(
        [LinePatches.painted(lines.places, lines.normals, lines.width_px), *seen]
    )
    if q is None:
        return None
    found, points, middle_px = tracker.look(q)
    if found.sum() < MIN_POINTS:
        return None
    found &= ~strays(middle_px, found, lines.marking)
    is_inside = inside_picture(points, size, IMAGE_MARGIN_PX)
    shift_px = np.linalg.norm(flow.shifts(lines.places[found], q), axis=1)
    return TrackedLines(
        points[found],
        lines.places[found],
        lines.normals[found],
        lines.marking[found],
        float(found.mean()),
        pattern,
        float(np.nanpercentile(shift_px, 95)),
        _missing(found[is_inside], lines.marking[is_inside]),
    )


@dataclass(frozen=True, eq=False)
class _Tracker:
    """Looks for lines where they were, moved by a motion q (4,); see fitting.image_motion.

    widths: of each marking's paint, as a share of what is expected. reach_px: how far beside its place a line may be.
    """

    gray: Pixels
    flow: MotionField
    lines: LineSamples
    widths: Mapping[int, float]
    reach_px: float
    size: ImageSize

    def look(self, q: Array) -> tuple[Mask, Points, Array]:
        """Return (n,) whether a line is seen, points (n, 2) px on it, and (n,) px how far beside the moved place."""
        lines = self.lines
        moved = lines.places + np.nan_to_num(self.flow.shifts(lines.places, q))
        profiles = across_lines(
            self.gray,
            moved,
            lines.normals,
            lines.width_px,
            lines.marking,
            self.reach_px,
            self.widths,
        )
        points = moved + np.where(profiles.found, profiles.middle, 0.0)[:, None] * lines.normals
        return (
            profiles.found & inside_picture(points, self.size, IMAGE_MARGIN_PX),
            points,
            profiles.middle,
        )

    def find_motion(self, appearances: Iterable[LinePatches]) -> Array | None:
        """Return the motion q (4,) of the picture; None where too few lines are seen.

        appearances: of the lines, in which they are searched for further away.
        """
        across = np.einsum("ni,nik->nk", self.lines.normals, self.flow.at(self.lines.places))
        elsewhere = [find_motion(patches, across, self.gray) for patches in appearances]
        q = max(
            [np.zeros(4), *(guess for guess in elsewhere if guess is not None)],
            key=lambda guess: int(self.look(guess)[0].sum()),
        )
        for _ in range(MAX_STEPS):
            found, _, middle_px = self.look(q)
            if found.sum() < max(MIN_POINTS, MIN_SHARE * len(across)):
                return None
            sigma_px = np.full(int(found.sum()), LINE_SIGMA_PX)
            motion = estimate_motion(across[found], middle_px[found], sigma_px).compose(q)
            is_settled = float(np.abs(motion.q - q).max()) < LINE_SIGMA_PX
            q = motion.q
            if is_settled:
                break
        return q


def _missing(found: Mask, marking: Indices) -> float:
    """Return the share of places that are on markings of which hardly anything was found."""
    numbers, of, counts = np.unique(marking, return_inverse=True, return_counts=True)
    hardly_seen = np.bincount(of, found, len(numbers)) < MIN_MARKING_SHARE * counts
    return float(counts[hardly_seen & (counts >= MIN_MARKING_PLACES)].sum() / max(counts.sum(), 1))
