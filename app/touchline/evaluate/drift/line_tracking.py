"""Finds the field's lines again after the picture has moved since its camera was calibrated."""

from dataclasses import dataclass

import numpy as np

from touchline.core.field import Field
from touchline.core.geometry import Array, ImageSize, Indices, Mask, Pixels, Points, inside_picture
from touchline.evaluate.drift.expected import expected_lines
from touchline.evaluate.drift.search import best_motion
from touchline.fitting.field_pattern import FieldPattern, fine_pattern
from touchline.fitting.image_motion import MotionField, estimate_motion
from touchline.models import CameraModel
from touchline.vision.patches import LinePatches
from touchline.vision.profiles import NO_WIDTHS, across_lines, strays

PLACES = 240
APART_PX, CLEAR_PX = 6.0, 5.0
CAPTURE_PX = 6.0  # in a picture of 1280 px: a model may be off by so much
SIGMA_PX = 0.1  # of a line's middle
LOOKS = 4
MIN_POINTS, MIN_SHARE = 20, 0.25
MIN_PLACES, MIN_SEEN = 8, 0.5  # on a marking; robots and people leave 0.55 of each, and mostly 0.85


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


def track_lines(gray: Pixels, model: CameraModel, field: Field, before: Pixels | None = None) -> TrackedLines | None:
    """Find the lines again; None where too few are seen, near their places or a little further away.

    before: the grey picture in which the calibration was made, which shows the lines more exactly than the model.
    """
    size = ImageSize(gray.shape[1], gray.shape[0])
    pattern = fine_pattern(field)
    places = expected_lines(model, pattern, size, PLACES, APART_PX, CLEAR_PX)
    flow = MotionField(model, (size.width, size.height))
    some = places.clear & np.all(np.isfinite(flow.at(places.places)), axis=(1, 2))
    if some.sum() < MIN_POINTS:
        return None
    at, normals, width, marking = (a[some] for a in (places.places, places.normals, places.width_px, places.marking))
    capture = CAPTURE_PX * max(size.width / 1280, 0.7)
    widths, seen = NO_WIDTHS, None
    if before is not None and before.shape == gray.shape:
        then = across_lines(before, at, normals, width, marking, capture)
        if then.found.sum() >= MIN_POINTS:
            at = at + np.where(then.found, then.middle, 0.0)[:, None] * normals
            at, normals, width, marking = (a[then.found] for a in (at, normals, width, marking))
            widths = then.widths
            as_painted = width * [widths[int(name)] for name in marking]
            seen = LinePatches.of([before], at, normals, as_painted)
    across = np.einsum("ni,nik->nk", normals, flow.at(at))

    def look(q: Array) -> tuple[Mask, Points, Array]:
        moved = at + np.nan_to_num(flow.shifts(at, q))
        profiles = across_lines(gray, moved, normals, width, marking, capture, widths)
        points = moved + np.where(profiles.found, profiles.middle, 0.0)[:, None] * normals
        return profiles.found & inside_picture(points, size, 1), points, profiles.middle
    # As paint should look, and as it looked: where many lines are alike either may be led astray.
    likenesses = (LinePatches.painted(at, normals, width), *([] if seen is None else [seen]))
    elsewhere = [best_motion(patches, across, gray) for patches in likenesses]
    guesses = [np.zeros(4), *(motion for motion in elsewhere if motion is not None)]
    q = max(guesses, key=lambda guess: int(look(guess)[0].sum()))
    for _ in range(LOOKS):
        found, points, middle = look(q)
        if found.sum() < max(MIN_POINTS, MIN_SHARE * len(at)):
            return None
        motion = estimate_motion(across[found], middle[found], np.full(int(found.sum()), SIGMA_PX)).compose(q)
        near = float(np.abs(motion.q - q).max()) < SIGMA_PX
        q = motion.q
        if near:
            break
    found, points, middle = look(q)
    if found.sum() < MIN_POINTS:
        return None
    found &= ~strays(middle, found, marking)
    inside = inside_picture(points, size, 1)
    shift = np.linalg.norm(flow.shifts(at[found], q), axis=1)
    return TrackedLines(points[found], at[found], normals[found], marking[found], float(found.mean()), pattern,
                        float(np.nanpercentile(shift, 95)), _missing(found[inside], marking[inside]))


def _missing(found: Mask, marking: Indices) -> float:
    """Return the share of places that are on markings of which less than MIN_SEEN was found."""
    names, of, counts = np.unique(marking, return_inverse=True, return_counts=True)
    hardly = np.bincount(of, found, len(names)) < MIN_SEEN * counts
    return float(counts[hardly & (counts >= MIN_PLACES)].sum() / max(counts.sum(), 1))
