"""What is true of a frame: where everything is, what the camera sees of it, and which parts of the carpet are hidden.

The truth is drawn by the same layers as the picture, with owners in place of colours: a pixel belongs to the last thing
that covers half of it.
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from touchline.core.geometry import Points
from touchline.sources.sim.actors import (
    PersonTruth,
    RobotTruth,
    ball_at,
    ball_radius_mm,
    goals,
    people_at,
    robots_at,
)
from touchline.sources.sim.draw import Scene, layers
from touchline.sources.sim.render import Rendering
from touchline.sources.sim.solids import Solid

CARPET = -1
Owners = NDArray[np.int16]  # (height, width): the number of a name, or CARPET
_TURNS = np.linspace(0, 2 * np.pi, 24, endpoint=False)
# Spots spread over a disc of radius 1, up to 0.8: the very edge belongs to whom rounding says.
_SPOTS = np.concatenate(
    [r * np.stack([np.cos(_TURNS), np.sin(_TURNS)], axis=-1) for r in (0.2, 0.5, 0.65, 0.8)]
)


@dataclass(frozen=True)
class BallTruth:
    """The ball's middle, mm; and how much of it the camera sees, 0…1."""

    x_mm: float
    y_mm: float
    z_mm: float
    radius_mm: float
    seen: float = 1.0


@dataclass(frozen=True, eq=False)
class Truth:
    """One frame's truth. owners: whose each pixel is, a number of `names` or CARPET."""

    time_s: float
    robots: tuple[RobotTruth, ...]
    ball: BallTruth | None
    people: tuple[PersonTruth, ...]
    names: tuple[str, ...]
    owners: Owners
    scene: Scene

    @property
    def hidden(self) -> NDArray[np.bool_]:
        """(height, width) where something stands between the camera and the carpet."""
        return self.owners != CARPET

    def owned_by(self, name: str) -> NDArray[np.bool_]:
        """(height, width) where this robot, person, ball or goal is seen."""
        return (
            self.owners == self.names.index(name)
            if name in self.names
            else np.zeros(self.owners.shape, bool)
        )

    def carpet_seen(self, points: NDArray) -> NDArray[np.bool_]:
        """Which field points (..., 2) mm on the carpet lie in the picture with nothing before them."""
        raw = self.scene.camera.raw_from_field(points)
        return _owner_at(self.owners, self.scene, raw) == CARPET


def robots_in(rendering: Rendering, index: int, fps: float = 25.0) -> list[RobotTruth]:
    """Return where the robots of a frame are."""
    return robots_at(rendering.motion, rendering.field, rendering.region, index / fps)


def truth_at(rendering: Rendering, time_s: float) -> Truth:
    """Return who is where, and what the camera sees of each."""
    scene, field = rendering.scene, rendering.field
    where = rendering.motion, field, rendering.region, time_s
    solids = rendering.moving(time_s)
    names = ("goal", *dict.fromkeys(solid.owner for solid in solids))
    owners = _own(_still_owners(rendering).copy(), scene, solids, names)

    def seen(name: str, x_mm: float, y_mm: float, z_mm: float, radius_mm: float) -> float:
        spots = np.column_stack([(x_mm, y_mm) + radius_mm * _SPOTS, np.full(len(_SPOTS), z_mm)])
        return float(
            (
                _owner_at(owners, scene, scene.camera.raw_from_field(spots)) == names.index(name)
            ).mean()
        )

    radius = {solid.owner: solid.reach_mm for solid in solids}
    # A robot's flat front cuts its hat at 0.8 of its radius; a small robot's cube is inside 0.7 of it.
    robots = tuple(
        replace(r, seen=seen(r.name, r.x_mm, r.y_mm, r.z_mm, 0.85 * radius[r.name]))
        for r in robots_at(*where)
    )
    ball = None
    if rendering.motion.has_ball:
        (x, y), r = ball_at(*where), ball_radius_mm(field)
        ball = BallTruth(x, y, r, r, seen("ball", x, y, r, r))
    people = people_at(rendering.motion, rendering.region, time_s)
    return Truth(time_s, robots, ball, tuple(people), names, owners, scene)


@lru_cache(maxsize=4)
def _still_owners(rendering: Rendering) -> Owners:
    """Return the owners of what never moves: the goals."""
    size = rendering.camera.image_size
    bare = np.full((size.height, size.width), CARPET, np.int16)
    return _own(bare, rendering.scene, [*goals(rendering.field)], ("goal",))


def _own(owners: Owners, scene: Scene, solids: list[Solid], names: tuple[str, ...]) -> Owners:
    """Write each pixel's owner into owners, in place."""
    for solid, window in zip(solids, scene.windows(solids), strict=True):
        if window is not None:
            for layer in layers(scene.cut(window), solid):
                owners[window][layer.part][layer.cover > 0.5] = names.index(solid.owner)
    return owners


def _owner_at(owners: Owners, scene: Scene, raw: Points) -> NDArray[np.int16]:
    """Whose the pixels (..., 2) are; -2 outside the picture."""
    inside = scene.camera.sees(raw)
    x, y = np.moveaxis(
        np.where(inside[..., None], np.rint(np.nan_to_num(raw)), 0).astype(int), -1, 0
    )
    h, w = owners.shape
    return np.where(inside, owners[np.clip(y, 0, h - 1), np.clip(x, 0, w - 1)], np.int16(-2))
