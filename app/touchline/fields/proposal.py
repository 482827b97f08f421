"""A field that nobody has described, proposed from the lines of one picture and a length that was measured.

Its borders come first: of all quadrilaterals of lines, those that are painted along all four sides, and within which
the lines are the same on both sides of both axes, as they are on every field. Half of a field or an area of it encloses
less.

Four lines tell the ratio of a field's sides only as well as they tell the camera's focal length. A circle about the
middle tells it: it is as long as it is wide. What lies in the borders is read as for a field that has them, and is made
the same on both halves and in standard names (tidying.py).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from touchline.automatic.assignment import detect_lines
from touchline.automatic.hypotheses import (
    FOCALS,
    MAX_COSINE,
    harmonic_mean,
    initial_camera,
    project,
    sides_by_focal,
)
from touchline.automatic.refinement import refine_camera
from touchline.automatic.seen_lines import SeenLines
from touchline.core.errors import BadInput, FitFailed
from touchline.core.field import LINE_SIGMA_MM, Field, FieldJson, Line, Region
from touchline.core.geometry import Array, Mask, Points, homogeneous, inside_picture
from touchline.core.jobs import Progress, no_progress
from touchline.core.sentences import DETECTING_LINES
from touchline.core.statements import Stated, say, stated
from touchline.fields.seen_markings import Straight, with_seen
from touchline.fields.tidying import scaled, tidied
from touchline.fitting.field_pattern import FieldPattern
from touchline.fitting.ray_camera.parameters import RayCameraParameters

NAME, TITLE = "new-field", "New field"
LINE_SIGMA_SHARE = 0.002  # of the length: what is read from a picture is no more exact
LENGTH_MM = 6000.0  # of a field of unknown size
LINE_MM = 20.0  # of its lines
FIELD_STEPS = 60  # samples along a line as long as the field

MAX_RATIO = 3.0  # of length to width
USUAL_FOCAL, LOG_FOCAL_SIGMA = 1.8, 0.7  # half diagonals: where the borders tell nothing
COSINE_SIGMA, LOG_RATIO_SIGMA = 0.02, 0.02  # of a right angle's cosine, and of the ratio
MIN_PAINTED, MIN_IN_PICTURE = 0.5, 0.6  # of each side: goals interrupt it, and robots
SIDE_SAMPLES = 40
BEYOND_SHARE, BEYOND_SAMPLES = 0.15, 8  # of a side, past its end
MAX_GOING_ON = 1  # of eight ends: by chance
MAX_COMPARED, MAX_TRIED = 300, 3  # quadrilaterals
MAX_MIRRORED_POINTS = 600  # on lines, of which it is seen whether they are on both halves
INSIDE_SHARE = 0.98  # of the size: what lies within that is inside

MAX_ROUNDS, SAME_STRETCH = 3, 0.002  # of a ratio from a circle: with it the camera changes
MIN_BENT_MM = 6.0  # rms about a line, from which on a chain is bent
MIN_PLACES, MIN_RADIUS_MM = 12, 100.0
CIRCLE_SHARE = 0.8  # of half the field: a circle about its middle is within
MAX_OFF_CIRCLE_MM, MAX_SURE_CIRCLE_MM = 25.0, 15.0
# of a circle: a chain's, and of all together the share
ANGLE_STEP_DEG, MIN_FIRST_DEG, MIN_CIRCLE_SEEN = 5, 60, 0.35
MAX_OFF_CENTRE_MM = 120.0
MAX_STRETCH = 1.4  # of a circle under a ratio of four lines


class ProposedFieldJson(Stated):
    """The field. corners: of its borders, raw px, null beyond the lens. sentence: how far its size is known."""

    field: FieldJson
    is_ratio_known: bool
    corners: list[list[float | None]]
    sentence: str


def proposed_field(
    pixels: NDArray[np.uint8],
    length_mm: float | None,
    width_mm: float | None,
    progress: Progress = no_progress,
) -> ProposedFieldJson:
    """Return the field that the lines form, of that length between the goal lines or that width, or of both.

    BadInput where neither is given, or a width that is more than the length; FitFailed where no four lines are borders.
    """
    if not (length_mm or width_mm):
        raise BadInput(
            say("field.no-length", "A field's size needs a length."),
            say("field.no-length.fix", "Give length_mm, width_mm, or both."),
            reason="no-length",
        )
    if length_mm and width_mm and width_mm > length_mm:
        raise BadInput(
            say("field.width-over-length", "The width is more than the length."),
            say("field.width-over-length.fix", "Give the longer side as length_mm."),
            reason="bad-size",
        )
    progress(0.0, DETECTING_LINES)
    lines = detect_lines(pixels)
    progress(0.6, say("progress.finding-borders", "Finding the borders"))
    found = field_from_lines(lines.seen, lines.chains, length_mm, width_mm)
    if found is None:
        raise FitFailed(
            say("field.no-borders", "No four lines in the image form the borders of a field."),
            say(
                "field.no-borders.fix",
                "Take an image that shows all four borders, or add a field in the editor.",
            ),
            reason="no-borders",
        )
    size = {"length": found.field.length_mm / 1000, "width": found.field.width_mm / 1000}
    sentence = (
        say("field.proposed", "The lines form a field of {length:.2f} × {width:.2f} m.", **size)
        if found.is_ratio_known
        else say(
            "field.proposed-roughly",
            "The lines form a field of about {length:.2f} × {width:.2f} m. No centre "
            "circle was measured: its width may be several per cent off.",
            **size,
        )
    )
    sigma_mm = max(LINE_SIGMA_MM, float(round(LINE_SIGMA_SHARE * found.field.length_mm)))
    return stated(
        ProposedFieldJson(
            field=replace(found.field, name=NAME, title=TITLE, line_sigma_mm=sigma_mm).to_json(),
            is_ratio_known=found.is_ratio_known,
            corners=found.corners.round(1).tolist(),
            sentence=sentence,
        )
    )


@dataclass(frozen=True, eq=False)
class ProposedField:
    """field: of the size that was given. is_ratio_known: whether a circle, or the caller, tells length against width.

    corners (4, 2) raw px: of the borders, in order.
    """

    field: Field
    is_ratio_known: bool
    corners: Points


@dataclass(frozen=True, eq=False)
class Borders:
    """plane_from_field (3, 3): from a field of unit sides about its centre to the undistorted plane.

    ratio: of its length to its width, as far as four lines tell it.
    """

    plane_from_field: Array
    ratio: float

    def camera(self, seen: SeenLines, ratio: float) -> RayCameraParameters | None:
        """Return the camera over a field of that ratio, LENGTH_MM long; None where it does not lead to the borders."""
        focal, *_ = _focals_and_ratios(self.plane_from_field[None], np.array([ratio]))
        start = initial_camera(
            self.plane_from_field @ np.diag([1 / LENGTH_MM, ratio / LENGTH_MM, 1.0]),
            float(focal[0]),
            seen.plane,
            seen.size,
        )
        pattern = FieldPattern.of(bare_field(ratio), LENGTH_MM / FIELD_STEPS)
        refined = None if start is None else refine_camera(start, pattern, seen)
        return None if refined is None else refined.state


def field_from_lines(
    seen: SeenLines,
    chains: Sequence[Points],
    length_mm: float | None,
    width_mm: float | None,
) -> ProposedField | None:
    """Return the field that the lines form; None where they form none. length_mm, width_mm: one of them, or both.

    chains: (n, 2) raw px each, along all lines.
    """
    given_ratio = length_mm / width_mm if length_mm and width_mm else None
    corners = np.array([(x, y, 0.0) for x, y in ((-1, 1), (1, 1), (1, -1), (-1, -1))])
    for borders in find_borders(seen):
        measured = _measured(borders, seen, chains, given_ratio)
        if measured is None:
            continue
        ratio, state, is_round = measured
        with_markings, _ = with_seen(bare_field(ratio), _on_carpet(state, chains))
        field = tidied(with_markings)
        half_mm = (field.length_mm / 2, field.width_mm / 2, 0.0)
        factor = length_mm / field.length_mm if length_mm else (width_mm or 0.0) / field.width_mm
        return ProposedField(
            scaled(field, factor),
            is_round or given_ratio is not None,
            state.project(corners * half_mm),
        )
    return None


def _measured(
    borders: Borders,
    seen: SeenLines,
    chains: Sequence[Points],
    given_ratio: float | None,
) -> tuple[float, RayCameraParameters, bool] | None:
    """Return the ratio, the camera, and whether a circle tells that ratio; None where no camera sees the borders."""
    ratio = given_ratio or borders.ratio
    state, is_round = borders.camera(seen, ratio), False
    for _ in range(MAX_ROUNDS if given_ratio is None else 0):
        stretch = None if state is None else circle_stretch(_on_carpet(state, chains), ratio)
        if stretch is None:
            break
        ratio, is_round = ratio / stretch, True
        if abs(stretch - 1) < SAME_STRETCH:
            break
        state = borders.camera(seen, ratio)
    return None if state is None else (ratio, state, is_round)


def _on_carpet(state: RayCameraParameters, chains: Sequence[Points]) -> list[Points]:
    places = (state.unproject(chain, np.zeros(len(chain))) for chain in chains)
    return [each for each in places if np.isfinite(each).all()]


def circle_stretch(places: Sequence[Points], ratio: float) -> float | None:
    """Return how much longer a circle about the middle is than wide; None where none is seen.

    places: chains on a field of that ratio, mm. Of every bent chain a centred ellipse is fitted, then one to all chains
    on it; the one of which most is seen counts.
    """
    max_mm = CIRCLE_SHARE * np.array([LENGTH_MM, LENGTH_MM / ratio]) / 2
    bent = [
        each
        for each in places
        if len(each) >= MIN_PLACES
        and (np.abs(each) < max_mm).all()
        and Straight.through(each).rms_mm > MIN_BENT_MM
    ]
    bent_places = np.concatenate([np.empty((0, 2)), *bent])
    found = [circle for first in bent if (circle := _ellipse_from(first, bent_places)) is not None]
    return max(found)[1] if found else None


def _ellipse_from(first: Points, bent: Points) -> tuple[float, float] | None:
    """Return how much is seen of the ellipse that a chain is of, and its length over its width; None for no circle."""
    if len(np.unique(_angle_steps(first))) * ANGLE_STEP_DEG < MIN_FIRST_DEG:
        return None
    centre, axes = _fitted_ellipse(first, is_centred=True)
    for _ in range(MAX_ROUNDS):
        on_circle = bent[_ellipse_distance_mm(bent, centre, axes) < MAX_OFF_CIRCLE_MM]
        if len(on_circle) < MIN_PLACES:
            return None
        centre, axes = _fitted_ellipse(on_circle)
    on_circle = bent[_ellipse_distance_mm(bent, centre, axes) < MAX_SURE_CIRCLE_MM]
    share = len(np.unique(_angle_steps(on_circle - centre))) * ANGLE_STEP_DEG / 360
    stretch = float(axes[0] / axes[1])
    is_circle = (
        share > MIN_CIRCLE_SEEN
        and np.linalg.norm(centre) < MAX_OFF_CENTRE_MM
        and axes.min() > MIN_RADIUS_MM
    )
    return (share, stretch) if is_circle and 1 / MAX_STRETCH < stretch < MAX_STRETCH else None


def _fitted_ellipse(places: Points, is_centred: bool = False) -> tuple[Array, Array]:
    """Return centre and half axes (2,) mm of the ellipse along the axes, by least squares; NaN where it is none.

    a x² + b y² + c x + d y = 1, without c and d where it is centred; in metres, so that all columns are of one size.
    """
    metres = places / 1000
    design = metres**2 if is_centred else np.hstack([metres**2, metres])
    solved, *_ = np.linalg.lstsq(design, np.ones(len(metres)), rcond=None)
    square, linear = solved[:2], np.zeros(2) if is_centred else solved[2:]
    with np.errstate(all="ignore"):
        centre = -linear / (2 * square)
        return centre * 1000, np.sqrt((1 + np.sum(square * centre**2)) / square) * 1000


def _ellipse_distance_mm(places: Points, centre: Array, axes: Array) -> Array:
    with np.errstate(invalid="ignore"):
        return np.abs(np.linalg.norm((places - centre) / axes, axis=1) - 1) * axes.mean()


def _angle_steps(arms: Points) -> Array:
    return np.degrees(np.arctan2(arms[:, 1], arms[:, 0])) // ANGLE_STEP_DEG


def bare_field(ratio: float) -> Field:
    """Return a field of that ratio, LENGTH_MM long, that has its borders alone."""
    x, y = LENGTH_MM / 2, LENGTH_MM / 2 / ratio
    lines = {
        name: Line(name, start, end, LINE_MM)
        for name, start, end in (
            ("touch-line-top", (-x, y), (x, y)),
            ("touch-line-bottom", (-x, -y), (x, -y)),
            ("goal-line-left", (-x, -y), (-x, y)),
            ("goal-line-right", (x, -y), (x, y)),
        )
    }
    return Field("", "", 2 * x, 2 * y, lines, {}, {}, {"full": Region("full", (-x, x), (-y, y))})


def find_borders(seen: SeenLines) -> Sequence[Borders]:
    """Return the likeliest borders, the best first; none where no four lines can be those of a field."""
    maps = seen.quadrilaterals
    if not len(maps):
        return ()
    _, ratio, cosine = _focals_and_ratios(maps)
    possible = (cosine < MAX_COSINE) & (ratio >= 1) & (ratio < MAX_RATIO)
    maps, ratio = maps[possible] @ _centred(maps[possible]), ratio[possible]
    painted, drawn, is_border = _sides(maps, seen)
    order = np.flatnonzero(is_border)[np.argsort(-painted[is_border], kind="stable")][:MAX_COMPARED]
    if not len(order):
        return ()
    symmetric_px, inside_px = np.transpose(
        [_symmetric_inside(maps[index], seen) for index in order]
    )
    explained_px = painted[order] + symmetric_px
    # As a share of what these borders have, and of what the best of them have: half a field explains itself, but less.
    value = harmonic_mean(
        explained_px / (drawn[order] + inside_px), explained_px / explained_px.max()
    )
    best = np.argsort(-value, kind="stable")[:MAX_TRIED]
    return tuple(Borders(maps[index], float(ratio[index])) for index in order[best])


def _focals_and_ratios(maps: Array, given_ratio: Array | None = None) -> tuple[Array, Array, Array]:
    """Return (n,) focal lengths in half diagonals under which maps (n, 3, 3) show a right angle as one, and a ratio.

    Beside them the ratio of the sides, and the cosine that is left of the angle. Where the lines do not tell a focal
    length, it is a usual one.
    """
    ratio, cosine = sides_by_focal(maps)
    cost = (cosine / COSINE_SIGMA) ** 2 + (np.log(FOCALS / USUAL_FOCAL) / LOG_FOCAL_SIGMA) ** 2
    if given_ratio is not None:
        cost = cost + (np.log(ratio / given_ratio[:, None]) / LOG_RATIO_SIGMA) ** 2
    best = cost.argmin(axis=1)
    row = np.arange(len(maps))
    return FOCALS[best], ratio[row, best], np.abs(cosine[row, best])


def _centred(maps: Array) -> Array:
    """Return (n, 3, 3) from unit sides about the centre to the unit square, y against the picture's from above."""
    up = -np.sign(np.linalg.det(maps))
    result = np.tile(
        np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.5], [0.0, 0.0, 1.0]]), (len(maps), 1, 1)
    )
    result[:, 1, 1] = up
    return result


def _sides(maps: Array, seen: SeenLines) -> tuple[Array, Array, Mask]:
    """Return (n,) each: the length of the sides that is painted, that is in the picture, and whether they are borders.

    Borders are painted on all four sides, and end at the corners: what goes on there is of something larger.
    """
    at = (np.arange(SIDE_SAMPLES) + 0.5) / SIDE_SAMPLES - 0.5
    painted, drawn, shown = (
        each.reshape(len(maps), 4, SIDE_SAMPLES).sum(axis=2) for each in _painted(maps, at, seen)
    )
    is_painted = (painted > MIN_PAINTED * drawn).all(axis=1)
    is_in_picture = (shown > MIN_IN_PICTURE * SIDE_SAMPLES).all(axis=1)
    beyond = 0.5 + BEYOND_SHARE * (np.arange(BEYOND_SAMPLES) + 0.5) / BEYOND_SAMPLES
    count_going_on = np.zeros(len(maps), int)
    for end in (1, -1):
        further, length, _ = (
            each.reshape(len(maps), 4, BEYOND_SAMPLES).sum(axis=2)
            for each in _painted(maps, end * beyond, seen)
        )
        count_going_on += (further > MIN_PAINTED * np.maximum(length, 1e-9)).sum(axis=1)
    is_border = is_painted & is_in_picture & (count_going_on <= MAX_GOING_ON)
    return painted.sum(axis=1), drawn.sum(axis=1), is_border


def _painted(maps: Array, at: Array, seen: SeenLines) -> tuple[Array, Array, Mask]:
    """Return (n, 4 k) each of places so far along the sides (k,): px painted, px in the picture, and whether it is."""
    half, ones, zeros = np.full(len(at), 0.5), np.ones(len(at)), np.zeros(len(at))
    places = np.concatenate(
        [np.column_stack(side) for side in ((at, half), (at, -half), (half, at), (-half, at))]
    )
    along = np.concatenate(
        [np.column_stack(side) for side in 2 * [(ones, zeros)] + 2 * [(zeros, ones)]]
    )
    raw = project(maps, places, seen.plane)
    ahead = project(maps, places + along * (0.25 / SIDE_SAMPLES), seen.plane) - raw
    inside = inside_picture(raw, seen.size, 2) & np.isfinite(ahead).all(axis=-1)
    step = np.where(inside, 4 * np.linalg.norm(ahead, axis=-1), 0.0)
    found = seen.ridges.found(
        np.where(inside[..., None], raw, -1.0), np.where(inside[..., None], ahead, 1.0)
    )
    return step * found, step, inside


def _symmetric_inside(plane_from_field: Array, seen: SeenLines) -> tuple[float, float]:
    """Return the length of lines within the borders that are on both sides of both axes, and of all of them, px."""
    points, along = seen.sampled(MAX_MIRRORED_POINTS)
    field_from_plane = np.asarray(np.linalg.inv(plane_from_field), np.float64)
    at, ahead = (
        _mapped(field_from_plane, seen.plane.undistorted_from_raw(raw))
        for raw in (points, points + 2 * along)
    )
    inside = (np.abs(at) < INSIDE_SHARE / 2).all(axis=1) & np.isfinite(ahead).all(axis=1)
    # how well each point is found on the other side of both axes
    mirrored = np.ones(int(inside.sum()))
    for mirror in ((-1, 1), (1, -1)):
        raw, raw_ahead = (
            project(plane_from_field[None], field[inside] * mirror, seen.plane)[0]
            for field in (at, ahead)
        )
        fine = np.isfinite(raw).all(axis=1) & np.isfinite(raw_ahead).all(axis=1)
        found = seen.ridges.found(
            np.where(fine[:, None], raw, -1.0), np.where(fine[:, None], raw_ahead - raw, 1.0)
        )
        mirrored = np.minimum(mirrored, found)
    px_per_point = seen.ridges.length_px / len(points)
    return float(mirrored.sum() * px_per_point), float(inside.sum() * px_per_point)


def _mapped(matrix: Array, points: Points) -> Points:
    mapped = homogeneous(points) @ matrix.T
    with np.errstate(all="ignore"):
        return np.asarray(mapped[:, :2] / mapped[:, 2:])
