"""A field that nobody has described, from the lines of one picture and one length: its borders, and what is in them.

Four lines tell the ratio of a field's sides only as well as they tell the camera's focal length. A circle about the
middle tells it: it is as long as it is wide. What lies in the borders is read as for a field that has them, and is made
the same on both halves and in standard names (field_tidying.py).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from touchline.core.field import Field
from touchline.core.geometry import Array, Points
from touchline.fitting.field_lines.field_tidying import scaled, tidied
from touchline.fitting.field_lines.seen_lines import SeenLines
from touchline.fitting.field_lines.unknown_borders import LENGTH_MM, Borders, bare_field, find_borders
from touchline.fitting.ray_camera.parameters import RayCameraParameters
from touchline.fitting.seen_markings import Straight, with_seen

ROUNDS, SAME_RATIO = 3, 0.002  # of a ratio from a circle: with it the camera changes
BENT_MM = 6.0  # rms about a line, from which on a chain is bent
MIN_PLACES, MIN_RADIUS_MM = 12, 100.0
MIDDLE = 0.8  # of half the field: a circle about its middle is within
ON_CIRCLE_MM, SURELY_ON_MM = 25.0, 15.0
STEP_DEG, MIN_FIRST_DEG, MIN_SEEN = 5, 60, 0.35  # of a circle: a chain's, and of all together the share
MAX_OFF_CENTRE_MM = 120.0
MAX_STRETCH = 1.4  # of a circle under a ratio of four lines


@dataclass(frozen=True, eq=False)
class ProposedField:
    """field: of the size that was given. is_ratio_known: whether a circle, or the caller, tells length against width.

    corners (4, 2) raw px: of the borders, in order.
    """

    field: Field
    is_ratio_known: bool
    corners: Points


def propose_field(seen: SeenLines, chains: Sequence[Points], length_mm: float | None, width_mm: float | None,
                  ) -> ProposedField | None:
    """Return the field that the lines form; None where they form none. length_mm, width_mm: one of them, or both.

    chains: (n, 2) raw px each, along all lines.
    """
    given = length_mm / width_mm if length_mm and width_mm else None
    for borders in find_borders(seen):
        found = _measured(borders, seen, chains, given)
        if found is not None:
            ratio, state, is_round = found
            seen_field, _ = with_seen(bare_field(ratio), _on_carpet(state, chains))
            field = tidied(seen_field)
            corners = np.array([(x, y, 0.0) for x, y in ((-1, 1), (1, 1), (1, -1), (-1, -1))])
            factor = length_mm / field.length_mm if length_mm else (width_mm or 0.0) / field.width_mm
            return ProposedField(scaled(field, factor), is_round or given is not None, state.project(
                corners * (field.length_mm / 2, field.width_mm / 2, 0.0)))
    return None


def _measured(borders: Borders, seen: SeenLines, chains: Sequence[Points], given: float | None,
              ) -> tuple[float, RayCameraParameters, bool] | None:
    """Return the ratio, the camera, and whether a circle tells that ratio; None where no camera sees the borders."""
    ratio = given or borders.ratio
    state, is_round = borders.camera(seen, ratio), False
    for _ in range(ROUNDS if given is None else 0):
        stretch = None if state is None else circle_stretch(_on_carpet(state, chains), ratio)
        if stretch is None:
            break
        ratio, is_round = ratio / stretch, True
        if abs(stretch - 1) < SAME_RATIO:
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
    within = MIDDLE * np.array([LENGTH_MM, LENGTH_MM / ratio]) / 2
    bent = [each for each in places if len(each) >= MIN_PLACES and (np.abs(each) < within).all()
            and Straight.through(each).rms_mm > BENT_MM]
    every = np.concatenate([np.empty((0, 2)), *bent])
    found = [circle for first in bent if (circle := _ellipse_from(first, every)) is not None]
    return max(found)[1] if found else None


def _ellipse_from(first: Points, every: Points) -> tuple[float, float] | None:
    """Return how much is seen of the ellipse that a chain is of, and its length over its width; None for no circle."""
    if len(np.unique(_steps(first))) * STEP_DEG < MIN_FIRST_DEG:
        return None
    centre, axes = _fitted(first, is_centred=True)
    for _ in range(ROUNDS):
        on = every[_off_mm(every, centre, axes) < ON_CIRCLE_MM]
        if len(on) < MIN_PLACES:
            return None
        centre, axes = _fitted(on)
    on = every[_off_mm(every, centre, axes) < SURELY_ON_MM]
    share = len(np.unique(_steps(on - centre))) * STEP_DEG / 360
    stretch = float(axes[0] / axes[1])
    is_circle = share > MIN_SEEN and np.linalg.norm(centre) < MAX_OFF_CENTRE_MM and axes.min() > MIN_RADIUS_MM
    return (share, stretch) if is_circle and 1 / MAX_STRETCH < stretch < MAX_STRETCH else None


def _fitted(places: Points, is_centred: bool = False) -> tuple[Array, Array]:
    """Return centre and half axes (2,) of the ellipse along the axes, by least squares; NaN where it is none."""
    unit = places / 1000
    design = unit**2 if is_centred else np.hstack([unit**2, unit])
    solved, *_ = np.linalg.lstsq(design, np.ones(len(unit)), rcond=None)
    square, linear = solved[:2], np.zeros(2) if is_centred else solved[2:]
    with np.errstate(all="ignore"):
        centre = -linear / (2 * square)
        return centre * 1000, np.sqrt((1 + np.sum(square * centre**2)) / square) * 1000


def _off_mm(places: Points, centre: Array, axes: Array) -> Array:
    with np.errstate(invalid="ignore"):
        return np.abs(np.linalg.norm((places - centre) / axes, axis=1) - 1) * axes.mean()


def _steps(arms: Points) -> Array:
    return np.degrees(np.arctan2(arms[:, 1], arms[:, 0])) // STEP_DEG
