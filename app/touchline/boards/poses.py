"""How a board was held before a camera whose lens is not known yet, and how to hold it next.

A pose is described by the image of the board's four outermost corners, its quad: where it is, how large, which edge
is nearer. A focal length as long as the image is wide is assumed: good enough to say "tilt it more", and no fit rests
on it. Once a lens is known, uncertainty.py says better which view would help most.
"""

from collections import Counter
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from typing import Any, Self

import cv2
import numpy as np

from touchline.boards.board import Board, BoardView
from touchline.core.errors import BadInput
from touchline.core.geometry import Array, ImageSize, Points, homogeneous
from touchline.core.json_values import JsonObject
from touchline.core.statements import Sentence, say, stated
from touchline.models.rotation import matrix_from_vector

CELLS = (8, 6)  # of the image, columns and rows
EDGES = ("left", "right", "top", "bottom")
COLUMN_NAMES, ROW_NAMES = ("left", "", "right"), ("top", "", "bottom")  # of a ninth of the image
NEXT_TILT_DEG = 35.0
NEXT_SHARE = 0.35  # of the image's width that the suggested board fills

MIN_CORNERS = 6  # that show where the rest of a board is
# less is hardly a tilt; coarser than for a known lens, since the focal length is assumed
MIN_TILT_DEG = 15.0
MIN_VIEWS_PER_EDGE = 2  # views with each edge nearer, and as many that face the camera
# of the cells of a ninth of the image that have corners: then it is covered
MIN_COVERED_SHARE = 0.6
MIN_VIEWS = 12  # fewer leave the worst place of a lens twice as doubtful
RIM_SQUARES = 1.3  # around the inner corners: the outer squares, and some white
# of the image's width; of its logarithm; of the tilt's tangent
SAME_PLACE, SAME_SIZE, SAME_TILT = 0.08, 0.25, 0.25

STILL_S = 0.4  # longer than anybody's hand turns round in
MAX_STILL_SHARE = 0.003  # of the image's width, within STILL_S: 2 px of 640
MAX_VIEWS = 100
NO_BOARD = say("board.not-detected", "No board detected. Show the whole board in good light.")
HOLD_STILL = say("board.hold-still", "Hold the board still.")
OTHER_POSE = say("board.other-pose", "This pose is already captured. Move or tilt the board.")


@dataclass
class BoardCapture:
    """What was seen so far of one board before a live camera, in images of one size.

    A view is worth a picture once it is still for STILL_S and like none that was taken.
    """

    board: Board
    size: ImageSize
    poses: list["BoardPose"] = field(default_factory=list)
    # all within MAX_STILL_SHARE of the newest
    _still: list[tuple[float, "BoardPose"]] = field(default_factory=list)
    _coverage: "PoseHistory | None" = None

    def update(self, quad: Any, now_s: float) -> JsonObject:
        """Return whether it is still, whether it is new, and in words what hinders a picture ("" nothing)."""
        pose = None if quad is None else BoardPose.from_points(quad, self.size)
        if pose is None:
            self._still.clear()
            return {"still": False, "new": False, "hint": NO_BOARD}
        self._still = [
            (then, other)
            for then, other in self._still
            if pose.moved_px(other) <= MAX_STILL_SHARE * self.size.width
        ]
        still = bool(self._still) and now_s - self._still[0][0] >= STILL_S
        self._still.append((now_s, pose))
        new = not any(pose.is_similar(other) for other in self.poses)
        return {
            "still": still,
            "new": new,
            "hint": "" if still and new else HOLD_STILL if new else OTHER_POSE,
        }

    def add_view(self, quad: Any) -> None:
        """Note that this view was taken."""
        if len(self.poses) < MAX_VIEWS:
            self.poses.append(BoardPose.from_points(quad, self.size))
        self._coverage = None
        self._still.clear()

    @property
    def is_full(self) -> bool:
        return len(self.poses) >= MAX_VIEWS

    @property
    def coverage(self) -> "PoseHistory":
        if self._coverage is None:
            self._coverage = pose_history(self.poses, self.board, self.size)
        return self._coverage


@dataclass(frozen=True)
class BoardPose:
    """One quad (4, 2) px, the board's corners in the order (0, 0), (1, 0), (1, 1), (0, 1); size: of the image."""

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
        quad = _apply_homography(np.asarray(found, np.float64), board.places_mm[board.outline, :2])
        return cls(quad, size) if _is_quad(quad) else None

    @classmethod
    def from_points(cls, points: Any, size: ImageSize) -> Self:
        """Read four points from JSON; BadInput where they are no quad."""
        quad = np.array(points, dtype=np.float64)
        if quad.shape != (4, 2) or not _is_quad(quad):
            raise BadInput(
                "The outline of a view does not have four corners.",
                "Send the four corners as they were reported for the view.",
                reason="bad-view",
            )
        return cls(quad, size)

    @cached_property
    def centre(self) -> Array:
        return self.quad.mean(axis=0)

    @cached_property
    def share(self) -> float:
        """Return how much of the image's width its longer side fills."""
        return float(
            np.linalg.norm(self.quad - np.roll(self.quad, 1, axis=0), axis=1).max()
            / self.size.width
        )

    @cached_property
    def tilt(self) -> Array:
        """Return a vector (2,) towards the nearer edge in the image; its length is the tangent of the tilt."""
        # The tilt is measured against the line of sight. A board that faces the camera from the side of the image has
        # its outer edge nearer to the image plane.
        total = -(self.centre - (np.array(tuple(self.size)) - 1) / 2) / self.size.width
        for first in (0, 1):
            near, far = (self.quad[[k, (k + 1) % 4]] for k in (first, first + 2))
            across = near.mean(axis=0) - far.mean(axis=0)
            extent = np.linalg.norm(across)
            # A board seen under the angle s and tilted by t: its edges are as 1 + s sin t / 2 to 1 - s sin t / 2.
            ratio = np.log(np.linalg.norm(near[1] - near[0]) / np.linalg.norm(far[1] - far[0]))
            total += across / extent * ratio * self.size.width / extent
        return total

    @property
    def nearer(self) -> str:
        """Return which edge is nearer, as the image shows it; "" where it faces the camera."""
        x, y = self.tilt
        if np.degrees(np.arctan(np.hypot(x, y))) < MIN_TILT_DEG:
            return ""
        return edge_towards(x, y)

    def moved_px(self, before: "BoardPose") -> float:
        """Return how far a corner has moved at most; whichever way round the board was found."""
        distances = np.linalg.norm(self.quad[:, None] - before.quad[None], axis=-1)
        return float(distances.min(axis=1).max())

    def is_similar(self, other: "BoardPose") -> bool:
        """Return whether it adds nothing to the other."""
        return bool(
            np.linalg.norm(self.centre - other.centre) < SAME_PLACE * self.size.width
            and abs(np.log(self.share / other.share)) < SAME_SIZE
            and np.linalg.norm(self.tilt - other.tilt) < SAME_TILT
        )

    def corners(self, board: Board) -> Points:
        """Return about where its inner corners are, (n, 2) px."""
        places = board.places_mm[:, :2].astype(np.float32)
        found = cv2.getPerspectiveTransform(places[board.outline], self.quad.astype(np.float32))
        return _apply_homography(np.asarray(found, np.float64), places.astype(np.float64))


@dataclass(frozen=True)
class PoseHistory:
    """What views cover so far.

    cells: (rows, columns) of corners. tilts: views by nearer edge. next_view: to take; None: all is covered.
    """

    cells: Array
    tilts: dict[str, int]
    next_view: JsonObject | None

    def to_json(self) -> JsonObject:
        return {
            "cells": self.cells.tolist(),
            "share": float((self.cells > 0).mean()),
            "tilts": self.tilts,
            "wanted": self.next_view,
        }


def pose_history(poses: list[BoardPose], board: Board, size: ImageSize) -> PoseHistory:
    """Return coverage and the next view to take: where fewest corners are, tilted in the rarest way."""
    points = np.concatenate([pose.corners(board) for pose in poses]) if poses else np.zeros((0, 2))
    cells = cell_counts(points, size)
    views_by_edge = {edge: sum(pose.nearer == edge for pose in poses) for edge in ("", *EDGES)}
    tilts = {edge or "face on": count for edge, count in views_by_edge.items()}
    # By ninths of the image (column, row): in which share of their cells corners were seen.
    shares = {
        (i, j): float((block > 0).mean())
        for j, row in enumerate(np.array_split(cells, 3, axis=0))
        for i, block in enumerate(np.array_split(row, 3, axis=1))
    }
    has_gaps = min(shares.values()) < MIN_COVERED_SHARE
    if (
        not has_gaps
        and min(views_by_edge.values()) >= MIN_VIEWS_PER_EDGE
        and len(poses) >= MIN_VIEWS
    ):
        return PoseHistory(cells, tilts, None)
    # The emptiest places and the rarest tilts first; gaps in the image before tilts.
    views_at = Counter(
        tuple(np.clip(pose.centre / tuple(size) * 3, 0, 2).astype(int)) for pose in poses
    )
    places = sorted(shares, key=lambda at: (min(shares[at], MIN_COVERED_SHARE), views_at[at]))
    edges = sorted(views_by_edge, key=lambda edge: (views_by_edge[edge], edge != ""))
    order = (
        product(places, edges)
        if has_gaps
        else ((place, edge) for edge, place in product(edges, places))
    )
    for (column, row), nearer in order:
        pose = BoardPose(_quad_at(ninth_centre(column, row), nearer, board, size), size)
        if not any(pose.is_similar(other) for other in poses):
            return PoseHistory(
                cells,
                tilts,
                stated(
                    {
                        "text": view_instruction(ninth_name(column, row), nearer),
                        "outline": pose.quad.tolist(),
                        "nearer": nearer,
                        "tilt_deg": NEXT_TILT_DEG if nearer else 0.0,
                    }
                ),
            )
    return PoseHistory(cells, tilts, None)


def _quad_at(spot: Array, nearer: str, board: Board, size: ImageSize) -> Array:
    """Return the quad (4, 2) px of a board that is held there and so, seen by a camera without distortion.

    spot (2,): shares of the image.
    """
    focal, size_px = float(size.width), np.array(tuple(size))
    middle = (size_px - 1) / 2
    at = (spot * size_px - middle) / focal
    ray = np.array([*at, 1.0]) / np.hypot(1.0, np.linalg.norm(at))
    places = board.places_mm[board.outline]
    places = places - places.mean(axis=0)
    distance = np.ptp(places[:, 0]) / NEXT_SHARE
    rotation = board_rotation(ray, nearer)
    rim = places + np.sign(places) * RIM_SQUARES * board.square_mm
    corners = np.concatenate([places, rim]) @ rotation.T + ray * distance
    pixels = corners[:, :2] / corners[:, 2:] * focal + middle
    # A detector needs the board's white rim as well: as far into the image as that needs.
    return pixels[:4] + (
        np.maximum(0, -pixels.min(axis=0)) + np.minimum(0, size_px - 1 - pixels.max(axis=0))
    )


def cell_counts(pixels: Points, size: ImageSize) -> Array:
    """Return how many corners (n, 2) px lie in each cell of the image, (rows, columns)."""
    counts, *_ = np.histogram2d(
        pixels[:, 1],
        pixels[:, 0],
        bins=(CELLS[1], CELLS[0]),
        range=((-0.5, size.height - 0.5), (-0.5, size.width - 0.5)),
    )
    return counts.astype(int)


def ninth_centre(column: int, row: int) -> Array:
    """Return where a view in that ninth of the image is to be held, (2,) shares of the image."""
    return np.array([0.22 + 0.28 * column, 0.22 + 0.28 * row])


def ninth_name(column: int, row: int) -> str:
    """Return such as "top left"; "" for the middle."""
    return f"{ROW_NAMES[row]} {COLUMN_NAMES[column]}".strip()


def edge_towards(x: float, y: float) -> str:
    """Return the edge of the image that a direction points to."""
    return ("right" if x > 0 else "left") if abs(x) > abs(y) else ("bottom" if y > 0 else "top")


def board_rotation(ray: Array, nearer: str) -> Array:
    """Return camera_from_board (3, 3) of a board that faces along the unit ray, tilted with that edge nearer."""
    return matrix_from_vector(rotation_to(ray)) @ matrix_from_vector(tilt_vector(nearer))


def rotation_to(ray: Array) -> Array:
    """Return the rotation vector that brings (0, 0, 1) to the unit ray."""
    axis = np.array([-ray[1], ray[0], 0.0])
    sine = np.linalg.norm(axis)
    return axis / sine * np.arctan2(sine, ray[2]) if sine > 1e-9 else np.zeros(3)


def tilt_vector(nearer: str) -> Array:
    """Return the rotation vector of a board with that edge nearer."""
    angle = np.radians(NEXT_TILT_DEG)
    return {
        "": np.zeros(3),
        "right": np.array([0, angle, 0]),
        "left": np.array([0, -angle, 0]),
        "top": np.array([angle, 0, 0]),
        "bottom": np.array([-angle, 0, 0]),
    }[nearer]


def view_instruction(place: str, nearer: str) -> Sentence:
    """Return how to hold a board. place: such as "top left", "" in the middle; nearer: its edge, "" face on."""
    where = (
        say(f"place.{place.replace(' ', '-')}", f"at the {place} of the image")
        if place
        else say("place.middle", "in the middle of the image")
    )
    how = (
        say(
            f"board.nearer-{nearer}",
            f"tilted about {{deg:.0f}}° with its {nearer} edge nearer",
            deg=NEXT_TILT_DEG,
        )
        if nearer
        else say("board.facing", "facing the camera")
    )
    return say(
        "board.hold",
        "Hold the board {where}, {how}. It should fill about a third of the image width.",
        where=where,
        how=how,
    )


def _apply_homography(homography: Array, places: Array) -> Points:
    with np.errstate(all="ignore"):
        mapped = homogeneous(places) @ homography.T
        return mapped[:, :2] / mapped[:, 2:]


def _is_quad(quad: Array) -> bool:
    """Return whether it is convex, finite and of some size."""
    if not np.isfinite(quad).all() or np.abs(quad).max() > 1e6:
        return False
    sides = np.roll(quad, -1, axis=0) - quad
    next_sides = np.roll(sides, -1, axis=0)
    turns = sides[:, 0] * next_sides[:, 1] - sides[:, 1] * next_sides[:, 0]
    return bool((turns > 1).all() or (turns < -1).all())
