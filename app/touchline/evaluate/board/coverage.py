"""Where a board was held, how it was tilted, and which view more would help most."""

from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from touchline.core.geometry import Array, ImageSize, Points
from touchline.core.statements import Sentence, say, stated
from touchline.evaluate.board.lens_uncertainty import SURE_GRID, expected_px, lens_sensitivity
from touchline.fitting.board.fit import BoardFit, shared_covariance
from touchline.fitting.board.parameters import WARP, BoardObservations
from touchline.fitting.board.problem import BoardProblem
from touchline.models.lens_difference import picture_grid
from touchline.models.rotation import matrix_from_vector

CELLS = (8, 6)  # of the picture, columns and rows
FACE_ON_DEG = 12.0  # less is hardly a tilt: a board tells the focal length by its foreshortening, 1 - cos
LEANS = ("left", "right", "top", "bottom")
PLACES = (("left", "", "right"), ("top", "", "bottom"))
NEXT_TILT_DEG = 35.0
NEXT_SHARE = 0.35  # of the picture's width that the suggested board fills
NEXT_CORNERS = 12  # fewer inside the picture are no view


def cell_counts(pixels: Points, size: ImageSize) -> Array:
    """(rows, columns): how many corners (n, 2) px lie in each cell of the picture."""
    counts, *_ = np.histogram2d(pixels[:, 1], pixels[:, 0], bins=(CELLS[1], CELLS[0]),
                                range=((-0.5, size.height - 0.5), (-0.5, size.width - 0.5)))
    return counts.astype(int)


def tilts(fit: BoardFit) -> tuple[Array, tuple[str, ...]]:
    """Per used view: degrees between the board's face and the line of sight, and which edge is nearer, "" face on.

    Edges as the picture shows them.
    """
    middle = np.nanmean(np.where(fit.observations.present[..., None], fit.state.rays(fit.observations), np.nan), axis=1)
    sight = middle / np.linalg.norm(middle, axis=1, keepdims=True)
    normal = fit.state.rotations[:, :, 2]
    normal = normal * np.sign(np.sum(normal * sight, axis=1, keepdims=True))  # away from the camera
    degrees = np.degrees(np.arccos(np.clip(np.sum(normal * sight, axis=1), -1, 1)))
    across = normal - np.sum(normal * sight, axis=1, keepdims=True) * sight
    # Where the far side's normal points right, the right edge is nearer.
    leans = []
    for tilt, (x, y, _) in zip(degrees, across, strict=True):
        leans.append(edge_towards(x, y) if tilt > FACE_ON_DEG else "")
    return degrees, tuple(leans)


def edge_towards(x: float, y: float) -> str:
    """Name the edge of the picture that a direction points to."""
    return ("right" if x > 0 else "left") if abs(x) > abs(y) else ("bottom" if y > 0 else "top")


@dataclass(frozen=True)
class NextView:
    """The view that would lower the worst expected error most, of those that were considered."""

    text: str
    place_px: tuple[float, float]
    tilt_deg: float
    nearer: str
    worst_before_px: float
    worst_after_px: float

    def to_json(self) -> dict[str, Any]:
        return stated({**vars(self), "place_px": list(self.place_px)})


def next_view(fit: BoardFit) -> NextView | None:
    """Try a board at nine places of the picture, face on and tilted four ways: what would each tell?"""
    names = fit.solution.names
    of_lens = np.array([name not in WARP for name in names])
    pixels = picture_grid(fit.lens.image_size, *SURE_GRID).reshape(-1, 2)
    sensitivity = np.zeros((len(pixels), 2, len(names)))
    sensitivity[..., of_lens] = lens_sensitivity(fit.lens, tuple(np.array(names)[of_lens]), pixels)
    covariance = shared_covariance(fit.solution)
    before = _worst(sensitivity, covariance)
    information = np.linalg.pinv(covariance, rcond=1e-15, hermitian=True)
    tried, gains = _candidates(fit)
    best = None
    for (place, spot, nearer), gain in zip(tried, gains, strict=True):
        after = _worst(sensitivity, np.linalg.pinv(information + gain, rcond=1e-15, hermitian=True))
        if np.isfinite(after) and (best is None or after < best.worst_after_px):
            best = NextView(view_instruction(place, nearer), (float(spot[0]), float(spot[1])),
                            NEXT_TILT_DEG if nearer else 0.0, nearer, before, after)
    return best


def _worst(sensitivity: Array, covariance: Array) -> float:
    return float(np.nanmax(expected_px(sensitivity, covariance)))


def _candidates(fit: BoardFit) -> tuple[list[tuple[str, Array, str]], Array]:
    """(place, its pixel, nearer edge) of every view that could be taken, and its information (k, n, n)."""
    size = np.array(tuple(fit.lens.image_size))
    fullest = int(np.argmax(fit.observations.present.sum(axis=1)))
    present = fit.observations.present[fullest]
    places = fit.observations.places[fullest][present]
    middle = (places.min(axis=0) + places.max(axis=0)) / 2
    distance = np.ptp(places[:, 0]) * fit.lens.focal_px / (NEXT_SHARE * size[0])
    tried, rotations, shifts = [], [], []
    for (i, across), (j, down), nearer in product(enumerate(PLACES[0]), enumerate(PLACES[1]), ("", *LEANS)):
        spot = np.array([0.22 + 0.28 * i, 0.22 + 0.28 * j]) * size
        ray = fit.lens.rays(spot)
        if not np.isfinite(ray).all():
            continue
        rotation = board_rotation(ray, nearer)
        tried.append((f"{down} {across}".strip(), spot, nearer))
        rotations.append(rotation)
        shifts.append(ray * distance - rotation @ middle)
    k = len(tried)
    state = replace(fit.state, rotations=np.array(rotations), shifts_mm=np.array(shifts))
    observations = BoardObservations(np.zeros((k, len(places), 2)), np.tile(places, (k, 1, 1)),
                                     np.ones((k, len(places)), bool),
                                     np.tile(fit.observations.bow[fullest][present], (k, 1, 1)),
                                     fit.observations.size_mm, ("",) * k)
    with np.errstate(all="ignore"):
        pixels = state.project(observations)
        inside = np.all((pixels > 0) & (pixels < size - 1), axis=-1)
    observations = replace(observations, pixels=np.nan_to_num(pixels), present=inside)
    problem = BoardProblem(observations, fit.solution.problem.free, fit.lens.image_size, max(fit.sigma_px, 1e-6))
    _, shared, own = problem.linearise(state)
    shared, own = shared.reshape(k, -1, shared.shape[-1]), own.reshape(k, -1, 6)
    enough = inside.sum(axis=1) >= NEXT_CORNERS
    shared, own = shared[enough], own[enough]
    own_t = own.transpose(0, 2, 1)
    reduced = shared - own @ np.linalg.solve(own_t @ own, own_t @ shared)
    return [t for t, ok in zip(tried, enough, strict=True) if ok], reduced.transpose(0, 2, 1) @ reduced


def board_rotation(ray: Array, nearer: str) -> Array:
    """camera_from_board (3, 3) of a board that faces along the unit ray, tilted with that edge nearer."""
    return matrix_from_vector(rotation_to(ray)) @ matrix_from_vector(lean_vector(nearer))


def rotation_to(ray: Array) -> Array:
    """The rotation vector that brings (0, 0, 1) to the unit ray."""
    axis = np.array([-ray[1], ray[0], 0.0])
    sine = np.linalg.norm(axis)
    return axis / sine * np.arctan2(sine, ray[2]) if sine > 1e-9 else np.zeros(3)


def lean_vector(nearer: str) -> Array:
    """A board's rotation vector with that edge nearer."""
    angle = np.radians(NEXT_TILT_DEG)
    return {"": np.zeros(3), "right": np.array([0, angle, 0]), "left": np.array([0, -angle, 0]),
            "top": np.array([angle, 0, 0]), "bottom": np.array([-angle, 0, 0])}[nearer]


def view_instruction(place: str, nearer: str) -> Sentence:
    """How to hold a board, in a sentence. place: such as "top left", "" in the middle; nearer: its edge, "" face on."""
    where = (say(f"place.{place.replace(' ', '-')}", f"at the {place} of the image") if place else
             say("place.middle", "in the middle of the image"))
    how = (say(f"board.nearer-{nearer}", f"tilted about {{deg:.0f}}° with its {nearer} edge nearer", deg=NEXT_TILT_DEG)
           if nearer else say("board.facing", "facing the camera"))
    return say("board.hold", "Hold the board {where}, {how}. It should fill about a third of the image width.",
               where=where, how=how)
