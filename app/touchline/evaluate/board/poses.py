"""How a board was held before a camera whose lens is not known yet, and how to hold it next.

A pose is described by the image of the board's four outermost corners, its quad: where it is, how large, which edge
is nearer. A focal length as long as the picture is wide is assumed: good enough to say "tilt it more", and no fit rests
on it. Once a lens is known, coverage.py says better which view would help most.
"""

from collections import Counter
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any, Self

import cv2
import numpy as np

from touchline.core.board import Board, BoardView
from touchline.core.errors import BadInput
from touchline.core.geometry import Array, ImageSize
from touchline.core.statements import stated
from touchline.evaluate.board.coverage import (
    LEANS,
    NEXT_SHARE,
    NEXT_TILT_DEG,
    PLACES,
    board_rotation,
    cell_counts,
    edge_towards,
    view_instruction,
)

MIN_CORNERS = 6  # that tell where the rest of a board is
FACE_ON_DEG = 15.0  # less is hardly a tilt; coarser than for a known lens, since the focal length is assumed
EACH_LEAN = 2  # views with each edge nearer, and as many that face the camera
BLOCK_SHARE = 0.6  # of the cells of a ninth of the picture in which corners were seen: then it is covered
RIM = 1.3  # squares around the inner corners: the outer squares, and some white
ENOUGH_VIEWS = 12  # views; fewer leave the worst place of a lens twice as doubtful
SAME_PLACE, SAME_SIZE, SAME_LEAN = 0.08, 0.25, 0.25  # of the picture's width; of its logarithm; of the tilt's tangent


@dataclass(frozen=True)
class BoardPose:
    """One quad (4, 2) px, the board's corners in the order (0, 0), (1, 0), (1, 1), (0, 1); size: of the picture."""

    quad: Array
    size: ImageSize

    @classmethod
    def of(cls, view: BoardView, board: Board, size: ImageSize) -> Self | None:
        """Return the pose; None where too little of the board is seen."""
        if len(view.pixels) < MIN_CORNERS:
            return None
        found, _ = cv2.findHomography(view.places_mm[:, :2], np.asarray(view.pixels), 0)
        if found is None:
            return None
        quad = _through(np.asarray(found, np.float64), board.places_mm[_outline(board), :2])
        return cls(quad, size) if _is_quad(quad) else None

    @classmethod
    def from_points(cls, points: Any, size: ImageSize) -> Self:
        """Read four points from JSON; BadInput where they are no quad."""
        quad = np.array(points, dtype=np.float64)
        if quad.shape != (4, 2) or not _is_quad(quad):
            raise BadInput("The outline of a view does not have four corners.",
                           "Send the four corners as they were reported for the view.",
                           reason="bad-view")
        return cls(quad, size)

    @cached_property
    def centre(self) -> Array:
        return self.quad.mean(axis=0)

    @cached_property
    def share(self) -> float:
        """How much of the picture's width its longer side fills."""
        return float(np.linalg.norm(self.quad - np.roll(self.quad, 1, axis=0), axis=1).max() / self.size.width)

    @cached_property
    def leaning(self) -> Array:
        """(2,): towards the nearer edge in the picture; its length is the tangent of the tilt to the line of sight."""
        # A board that faces who looks at it from the side has its outer edge nearer to the picture's plane.
        total = -(self.centre - (np.array(tuple(self.size)) - 1) / 2) / self.size.width
        for first in (0, 1):
            near, far = (self.quad[[k, (k + 1) % 4]] for k in (first, first + 2))
            across = near.mean(axis=0) - far.mean(axis=0)
            extent = np.linalg.norm(across)
            # A board seen under the angle s leans by t: its edges are as 1 + s sin t / 2 to 1 - s sin t / 2.
            ratio = np.log(np.linalg.norm(near[1] - near[0]) / np.linalg.norm(far[1] - far[0]))
            total += across / extent * ratio * self.size.width / extent
        return total

    @property
    def nearer(self) -> str:
        """Which edge, as the picture shows it; "" where it faces the camera."""
        x, y = self.leaning
        if np.degrees(np.arctan(np.hypot(x, y))) < FACE_ON_DEG:
            return ""
        return edge_towards(x, y)

    def moved_px(self, before: "BoardPose") -> float:
        """How far a corner has moved at most; whichever way round the board was found."""
        apart = np.linalg.norm(self.quad[:, None] - before.quad[None], axis=-1)
        return float(apart.min(axis=1).max())

    def is_like(self, other: "BoardPose") -> bool:
        """Whether it adds nothing to the other."""
        return bool(np.linalg.norm(self.centre - other.centre) < SAME_PLACE * self.size.width
                    and abs(np.log(self.share / other.share)) < SAME_SIZE
                    and np.linalg.norm(self.leaning - other.leaning) < SAME_LEAN)

    def corners(self, board: Board) -> Array:
        """(n, 2) px: where its inner corners are about."""
        places = board.places_mm[:, :2].astype(np.float32)
        found = cv2.getPerspectiveTransform(places[_outline(board)], self.quad.astype(np.float32))
        return _through(np.asarray(found, np.float64), places.astype(np.float64))


@dataclass(frozen=True)
class PoseHistory:
    """What views cover so far. cells: (rows, columns) of corners; leans: views by nearer edge; wanted: next view."""

    cells: Array
    leans: dict[str, int]
    wanted: dict[str, Any] | None

    def to_json(self) -> dict[str, Any]:
        return {"cells": self.cells.tolist(), "share": float((self.cells > 0).mean()), "tilts": self.leans,
                "wanted": self.wanted}


def pose_history(poses: list[BoardPose], board: Board, size: ImageSize) -> PoseHistory:
    """Return coverage and the next view to take: where fewest corners are, tilted in the rarest way."""
    points = np.concatenate([pose.corners(board) for pose in poses]) if poses else np.zeros((0, 2))
    cells = cell_counts(points, size)
    leans = {name: sum(pose.nearer == name for pose in poses) for name in ("", *LEANS)}
    tilts = {name or "face on": count for name, count in leans.items()}
    # by ninths of the picture (column, row): in which share of its cells corners were seen
    shares = {(i, j): float((block > 0).mean()) for j, row in enumerate(np.array_split(cells, 3, axis=0))
              for i, block in enumerate(np.array_split(row, 3, axis=1))}
    bare = min(shares.values()) < BLOCK_SHARE
    if not bare and min(leans.values()) >= EACH_LEAN and len(poses) >= ENOUGH_VIEWS:
        return PoseHistory(cells, tilts, None)
    there = Counter(tuple(np.clip(pose.centre / tuple(size) * 3, 0, 2).astype(int)) for pose in poses)
    places = sorted(shares, key=lambda at: (min(shares[at], BLOCK_SHARE), there[at]))
    seldom = sorted(leans, key=lambda name: (leans[name], name != ""))
    order = product(places, seldom) if bare else ((place, name) for name, place in product(seldom, places))
    for (across, down), nearer in order:
        spot = np.array([0.22 + 0.28 * across, 0.22 + 0.28 * down])
        pose = BoardPose(_outline_at(spot, nearer, board, size), size)
        if not any(pose.is_like(other) for other in poses):
            place = f"{PLACES[1][down]} {PLACES[0][across]}".strip()
            return PoseHistory(cells, tilts, stated({
                "text": view_instruction(place, nearer), "outline": pose.quad.tolist(), "nearer": nearer,
                "tilt_deg": NEXT_TILT_DEG if nearer else 0.0}))
    return PoseHistory(cells, tilts, None)


def _outline_at(spot: Array, nearer: str, board: Board, size: ImageSize) -> Array:
    """(4, 2) px: the board's outermost corners, held there and so, seen by a plain camera."""
    focal, size_px = float(size.width), np.array(tuple(size))
    middle = (size_px - 1) / 2
    at = (spot * size_px - middle) / focal
    ray = np.array([*at, 1.0]) / np.hypot(1.0, np.linalg.norm(at))
    places = board.places_mm[_outline(board)]
    places = places - places.mean(axis=0)
    distance = np.ptp(places[:, 0]) / NEXT_SHARE
    turn = board_rotation(ray, nearer)
    rim = places + np.sign(places) * RIM * board.square_mm
    corners = np.concatenate([places, rim]) @ turn.T + ray * distance
    pixels = corners[:, :2] / corners[:, 2:] * focal + middle
    # A finder wants the board's white rim as well: as far into the picture as that needs.
    return pixels[:4] + (np.maximum(0, -pixels.min(axis=0)) + np.minimum(0, size_px - 1 - pixels.max(axis=0)))


def _outline(board: Board) -> list[int]:
    return [0, board.columns - 1, board.columns * board.rows - 1, board.columns * (board.rows - 1)]


def _through(homography: Array, places: Array) -> Array:
    with np.errstate(all="ignore"):
        mapped = np.column_stack([places, np.ones(len(places))]) @ homography.T
        return mapped[:, :2] / mapped[:, 2:]


def _is_quad(quad: Array) -> bool:
    """Convex, finite, of some size."""
    if not np.isfinite(quad).all() or np.abs(quad).max() > 1e6:
        return False
    sides = np.roll(quad, -1, axis=0) - quad
    after = np.roll(sides, -1, axis=0)
    turns = sides[:, 0] * after[:, 1] - sides[:, 1] * after[:, 0]
    return bool((turns > 1).all() or (turns < -1).all())
