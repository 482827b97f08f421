"""How a board was held before a camera whose lens is known, and which view more would help most."""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from touchline.boards.fit import BoardFit, shared_covariance
from touchline.boards.poses import (
    EDGES,
    NEXT_SHARE,
    NEXT_TILT_DEG,
    board_rotation,
    edge_towards,
    ninth_centre,
    ninth_name,
    view_instruction,
)
from touchline.boards.problem import WARP, BoardObservations, BoardProblem
from touchline.boards.uncertainty import error_pixels, expected_px, lens_sensitivity
from touchline.core.geometry import Array
from touchline.core.json_values import JsonObject
from touchline.core.statements import stated

MIN_TILT_DEG = 12.0  # less is hardly a tilt: a board shows the focal length by its foreshortening, 1 - cos
MIN_NEXT_CORNERS = 12  # fewer inside the image are no view


def tilts(fit: BoardFit) -> tuple[Array, tuple[str, ...]]:
    """Return per used view: degrees between the board's face and the line of sight; which edge is nearer, "" face on.

    Edges as the image shows them.
    """
    points = fit.state.camera_points(fit.observations)
    middle = np.nanmean(np.where(fit.observations.present[..., None], points, np.nan), axis=1)
    sight = middle / np.linalg.norm(middle, axis=1, keepdims=True)
    normal = fit.state.rotations[:, :, 2]
    normal = normal * np.sign(np.sum(normal * sight, axis=1, keepdims=True))  # away from the camera
    cosine = np.sum(normal * sight, axis=1)
    degrees = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    across = normal - cosine[:, None] * sight
    # Where the normal of the far side points right, the right edge is nearer.
    nearer = tuple(edge_towards(x, y) if tilt > MIN_TILT_DEG else ""
                   for tilt, (x, y, _) in zip(degrees, across, strict=True))
    return degrees, nearer


@dataclass(frozen=True)
class NextView:
    """The view that would lower the worst expected error most, of those that were considered."""

    text: str
    place_px: tuple[float, float]
    tilt_deg: float
    nearer: str
    worst_before_px: float
    worst_after_px: float

    def to_json(self) -> JsonObject:
        return stated({**vars(self), "place_px": list(self.place_px)})


@dataclass(frozen=True)
class Candidate:
    """A view that could be taken."""

    place: str  # such as "top left"
    pixel: Array  # (2,) of its middle
    nearer: str
    rotation: Array  # (3, 3) camera_from_board
    translation_mm: Array  # (3,)


def next_view(fit: BoardFit) -> NextView | None:
    """Compare a board at nine places of the image, face on and tilted four ways, by what each would show."""
    names = np.array(fit.solution.names)
    of_lens = np.array([name not in WARP for name in names])
    pixels = error_pixels(fit.lens)
    sensitivity = np.zeros((len(pixels), 2, len(names)))
    sensitivity[..., of_lens] = lens_sensitivity(fit.lens, tuple(names[of_lens]), pixels)
    covariance = shared_covariance(fit.solution)
    before = _worst_px(sensitivity, covariance)
    information = np.linalg.pinv(covariance, rcond=1e-15, hermitian=True)
    best = None
    for candidate, gain in zip(*_information_of(fit, _candidates(fit)), strict=True):
        after = _worst_px(sensitivity, np.linalg.pinv(information + gain, rcond=1e-15, hermitian=True))
        if np.isfinite(after) and (best is None or after < best.worst_after_px):
            x, y = candidate.pixel
            best = NextView(view_instruction(candidate.place, candidate.nearer), (float(x), float(y)),
                            NEXT_TILT_DEG if candidate.nearer else 0.0, candidate.nearer, before, after)
    return best


def _worst_px(sensitivity: Array, covariance: Array) -> float:
    return float(np.nanmax(expected_px(sensitivity, covariance)))


def _candidates(fit: BoardFit) -> list[Candidate]:
    """Return the views that could be taken: where the lens has rays."""
    size = np.array(tuple(fit.lens.image_size))
    places = _fullest_view(fit).places[0]
    middle = (places.min(axis=0) + places.max(axis=0)) / 2
    distance = np.ptp(places[:, 0]) * fit.lens.focal_px / (NEXT_SHARE * size[0])
    candidates = []
    for column, row, nearer in product(range(3), range(3), ("", *EDGES)):
        pixel = ninth_centre(column, row) * size
        ray = fit.lens.rays(pixel)
        if np.isfinite(ray).all():
            rotation = board_rotation(ray, nearer)
            candidates.append(Candidate(ninth_name(column, row), pixel, nearer, rotation,
                                        ray * distance - rotation @ middle))
    return candidates


def _information_of(fit: BoardFit, candidates: list[Candidate]) -> tuple[list[Candidate], Array]:
    """Return those that show enough corners, and what each would add to the information matrix: (k, n, n)."""
    size, k = np.array(tuple(fit.lens.image_size)), len(candidates)
    state = replace(fit.state, rotations=np.array([one.rotation for one in candidates]),
                    translations_mm=np.array([one.translation_mm for one in candidates]))
    observations = _fullest_view(fit, k)
    with np.errstate(all="ignore"):
        pixels = state.project(observations)
        inside = np.all((pixels > 0) & (pixels < size - 1), axis=-1)
    observations = replace(observations, pixels=np.nan_to_num(pixels), present=inside)
    problem = BoardProblem(observations, fit.solution.problem.free, fit.lens.image_size, max(fit.sigma_px, 1e-6))
    _, by_shared, by_pose = problem.linearise(state)
    enough = inside.sum(axis=1) >= MIN_NEXT_CORNERS
    by_shared, by_pose = by_shared.reshape(k, -1, by_shared.shape[-1])[enough], by_pose.reshape(k, -1, 6)[enough]
    by_pose_t = by_pose.transpose(0, 2, 1)
    # Its own pose, which must be estimated from it as well, takes up a part of what it shows.
    reduced = by_shared - by_pose @ np.linalg.solve(by_pose_t @ by_pose, by_pose_t @ by_shared)
    return [one for one, ok in zip(candidates, enough, strict=True) if ok], reduced.transpose(0, 2, 1) @ reduced


def _fullest_view(fit: BoardFit, times: int = 1) -> BoardObservations:
    """Return the corners of the view that has most, several times over; without pixels."""
    fullest = int(np.argmax(fit.observations.present.sum(axis=1)))
    present = fit.observations.present[fullest]
    places, bow_shape = fit.observations.places[fullest][present], fit.observations.bow_shape[fullest][present]
    return BoardObservations(np.zeros((times, len(places), 2)), np.tile(places, (times, 1, 1)),
                             np.ones((times, len(places)), bool), np.tile(bow_shape, (times, 1, 1)),
                             fit.observations.half_diagonal_mm, ("",) * times)
