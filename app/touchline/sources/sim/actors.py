"""What moves over time on a simulated field, robots, ball and people, and their shapes part by part.

Every position is a smooth function of time alone, so that any frame can be rendered at any time. Robots
keep to their own part of the region and never meet; the ball rolls under whatever is in its way, and is hidden then.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import atan2, cos, hypot, pi, sin

import numpy as np
from numpy.typing import NDArray

from touchline.core.field import Field, Region
from touchline.core.geometry import as_pair, as_triple
from touchline.core.ssl_pattern import DOT_MM, DOTS_MM, GREEN, TEAM_DOT_MM
from touchline.sources.sim.solids import (
    Ball,
    Box,
    Capsule,
    Colour,
    CutDisc,
    Disc,
    Prism,
    Solid,
    Spot,
)

_KICK_S = 2.5  # from one kick to the next
_KICKS = 64  # then they come again, from where the ball is by then
_SLOWING = 0.25  # of its speed that a ball loses in a second
_WAYPOINTS = 9  # of a person's walk
_ROUNDING_MM = 300.0  # people cut corners by this

YELLOW, BLUE = (40.0, 214.0, 246.0), (210.0, 96.0, 24.0)  # BGR
PINK, LIME = (190.0, 92.0, 250.0), (92.0, 232.0, 110.0)
ORANGE = (30.0, 112.0, 250.0)
HULL, HAT = (34.0, 33.0, 32.0), (20.0, 20.0, 20.0)
WHITE, SKIN, HAIR, JEANS = (
    (215.0, 220.0, 222.0),
    (140.0, 170.0, 214.0),
    (28.0, 34.0, 42.0),
    (96.0, 66.0, 48.0),
)
# A small robot's colour beside its team's, by its number.
PURPLE, CYAN, RED = (214.0, 52.0, 120.0), (222.0, 214.0, 60.0), (44.0, 30.0, 222.0)
OWN_COLOURS = (LIME, PINK, CYAN, PURPLE, RED)
_STRIDE_MM = 1300.0  # two steps


@dataclass(frozen=True)
class Motion:
    """robots: of both teams together. people: who walk about and hide lines, at walk_mm_s; at 0 they stand at the edge.

    speed_mm_s: of the robots; a tenth of the region's diagonal a second if None. The ball is three times as fast.
    shuffled: numbers are drawn out of 0 to 15 for each team, not counted from 0. ball: it rolls where there are no
    robots, too. blue_mm, yellow_mm: how high the team's robots are; as on the field if None.
    """

    robots: int = 8
    people: int = 0
    seed: int = 1
    speed_mm_s: float | None = None
    walk_mm_s: float = 1200.0
    shuffled: bool = False
    ball: bool = False
    blue_mm: float | None = None
    yellow_mm: float | None = None

    @property
    def has_ball(self) -> bool:
        return self.ball or self.robots > 0

    def speed_in(self, region: Region) -> float:
        return (
            0.1 * hypot(region.width_mm, region.height_mm)
            if self.speed_mm_s is None
            else self.speed_mm_s
        )


@dataclass(frozen=True)
class RobotTruth:
    """Where a robot is: mm, radians, the height of its hat, mm/s; and how much of the hat the camera sees, 0…1."""

    team: str
    number: int
    x_mm: float
    y_mm: float
    angle: float
    z_mm: float
    vx_mm_s: float = 0.0
    vy_mm_s: float = 0.0
    seen: float = 1.0

    @property
    def name(self) -> str:
        return f"{self.team} {self.number}"


@dataclass(frozen=True)
class PersonTruth:
    """Where somebody stands, which way they look, and how far they have walked."""

    x_mm: float
    y_mm: float
    angle: float
    walked_mm: float


@lru_cache(maxsize=16)
def _orbits(play: Motion, region: Region, radius_mm: float) -> tuple[NDArray, ...]:
    """Return of each robot the centre of its part of the region (n, 2), its ellipse (n, 2), how far that drifts (n, 2);
    its speed in radians a second (n,) and phase (n,); those of the drift (n, 2), (n, 2).
    """
    rng, n = np.random.default_rng([play.seed, 1]), play.robots
    columns = int(np.ceil(np.sqrt(n * region.width_mm / region.height_mm)))
    rows = -(-n // columns)
    part = np.array([region.width_mm / columns, region.height_mm / rows])
    i = np.arange(n)
    reach = np.maximum(part / 2 - 1.3 * radius_mm, 0)
    orbit = reach * rng.uniform(0.35, 0.75, (n, 2))
    turn = (
        rng.uniform(0.7, 1.3, n)
        * rng.choice([-1, 1], n)
        * play.speed_in(region)
        / np.maximum(orbit.mean(axis=1), radius_mm)
    )
    return (
        (np.stack([i % columns, i // columns], axis=1) + 0.5) * part,
        orbit,
        reach - orbit,
        turn,
        rng.uniform(0, 2 * pi, n),
        turn[:, None] * rng.uniform(0.1, 0.2, (n, 2)),
        rng.uniform(0, 2 * pi, (n, 2)),
    )


def robots_at(play: Motion, field: Field, region: Region, time_s: float) -> list[RobotTruth]:
    """Return the robots: each follows an ellipse that drifts slowly within its own part of the region."""
    if not play.robots:
        return []
    size = robot_size(field)
    middle, orbit, wander, turn, start, slow_turn, slow_start = _orbits(
        play, region, size["radius_mm"]
    )
    phase, slow = start + turn * time_s, slow_start + slow_turn * time_s
    place = (
        middle + orbit * np.stack([np.cos(phase), np.sin(phase)], axis=1) + wander * np.sin(slow)
    )
    speed = turn[:, None] * orbit * np.stack(
        [-np.sin(phase), np.cos(phase)], axis=1
    ) + wander * slow_turn * np.cos(slow)
    at, to = region.field_from_region(place), region.field_from_region(place + speed)
    moves = to - at
    angle = np.where(np.hypot(*moves.T) > 0, np.arctan2(moves[:, 1], moves[:, 0]), phase % (2 * pi))
    numbers = _numbers(play)
    return [
        RobotTruth(
            "yellow" if i % 2 else "blue",
            numbers[i],
            *as_pair(at[i]),
            float(angle[i]),
            (play.yellow_mm if i % 2 else play.blue_mm) or size["height_mm"],
            *as_pair(moves[i]),
        )
        for i in range(play.robots)
    ]


@lru_cache(maxsize=16)
def _numbers(play: Motion) -> tuple[int, ...]:
    """Return each robot's number; they alternate between the teams."""
    if not play.shuffled:
        return tuple(i // 2 for i in range(play.robots))
    rng = np.random.default_rng([play.seed, 9])
    drawn = [rng.permutation(16) for _ in range(2)]
    return tuple(int(drawn[i % 2][i // 2 % 16]) for i in range(play.robots))


def robot_size(field: Field) -> dict[str, float]:
    return field.extras.get("robot", {"radius_mm": 90.0, "height_mm": 150.0})


def ball_at(play: Motion, field: Field, region: Region, time_s: float) -> Spot:
    """Return the ball's position: kicked now and then, it rolls straight, slows down, and bounces off the edges."""
    ways, moves = _kicks(play.seed, 3 * play.speed_in(region))
    rounds, left_s = divmod(time_s, _KICKS * _KICK_S)
    kick = min(int(left_s / _KICK_S), _KICKS - 1)
    rolled = rounds * moves[-1] + moves[kick] + ways[kick] * _rolled_s(left_s - kick * _KICK_S)
    size = np.array([region.width_mm, region.height_mm])
    room = 0.96 * size
    start = np.random.default_rng([play.seed, 2]).uniform(0.2, 0.8, 2) * room
    # A ball that bounces off an edge is one that goes straight on in the edge's mirror.
    x, y = region.field_from_region(
        0.02 * size + room - np.abs((start + rolled) % (2 * room) - room)
    )
    return float(x), float(y)


def _rolled_s(time_s: float) -> float:
    """Return the distance after a kick, over the initial speed."""
    return time_s - _SLOWING * time_s * time_s / 2


@lru_cache(maxsize=16)
def _kicks(seed: int, speed_mm_s: float) -> tuple[NDArray, NDArray]:
    """Return the velocity after each kick, (n, 2) mm/s, and the ball's way until then, (n + 1, 2) mm."""
    rng = np.random.default_rng([seed, 6])
    angle, speed = rng.uniform(0, 2 * pi, _KICKS), speed_mm_s * rng.uniform(0.3, 1, _KICKS)
    ways = speed[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return ways, np.concatenate([np.zeros((1, 2)), np.cumsum(ways * _rolled_s(_KICK_S), axis=0)])


def people_at(play: Motion, region: Region, time_s: float) -> list[PersonTruth]:
    """Return the people: each starts at an edge, facing in, and walks from edge to edge and along them."""
    found = []
    for i in range(play.people):
        corners, ends, pace, inward = _walk(region, play.seed, i)
        if play.walk_mm_s == 0:
            found.append(PersonTruth(*as_pair(corners[0]), inward, 0.0))
            continue
        walked = pace * play.walk_mm_s * time_s
        near = walked + np.linspace(-_ROUNDING_MM, _ROUNDING_MM, 9)
        path = np.stack(
            [np.interp(near, ends, corners[:, k], period=ends[-1]) for k in (0, 1)], axis=1
        )
        (x, y), (dx, dy) = path.mean(axis=0), path[-1] - path[0]
        found.append(PersonTruth(float(x), float(y), atan2(dy, dx), float(walked)))
    return found


def _at_edge(region: Region, side: int, along: float) -> NDArray:
    u, v = ((along, -0.01), (along, 1.01), (-0.01, along), (1.01, along))[side]
    return np.array([u * region.width_mm, v * region.height_mm])


@lru_cache(maxsize=64)
def _walk(region: Region, seed: int, person: int) -> tuple[NDArray, NDArray, float, float]:
    """Return a closed walk: its corners (n, 2) mm in the field, their distances along it, the pace, the heading."""
    rng = np.random.default_rng([seed, 3, person])
    side, along = int(rng.integers(4)), float(rng.uniform(0.15, 0.85))
    stops = [(side, along)]
    for i in range(_WAYPOINTS):
        # now and then along an edge
        side = side if i % 3 == 2 else int((side + rng.integers(1, 4)) % 4)
        stops.append((side, float(rng.uniform(0.05, 0.95))))
    corners = np.stack(
        [region.field_from_region(_at_edge(region, *stop)) for stop in [*stops, stops[0]]]
    )
    ends = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    inward = atan2(np.mean(region.y_mm) - corners[0, 1], np.mean(region.x_mm) - corners[0, 0])
    return corners, ends, float(rng.uniform(0.8, 1.2)), inward + float(rng.uniform(-0.5, 0.5))


def moving(
    play: Motion, field: Field, region: Region, time_s: float, eye: tuple[float, float, float]
) -> list[Solid]:
    """Return everything that moves, in drawing order: what is farther from the camera first."""
    robots = robots_at(play, field, region, time_s)
    people = people_at(play, region, time_s)
    groups: list[tuple[Spot, list[Solid]]] = [
        ((r.x_mm, r.y_mm), [_robot(r, robot_size(field))]) for r in robots
    ]
    drawn = (
        np.random.default_rng([play.seed, 8, i]).uniform(40, 190, 3) for i in range(play.people)
    )
    shirts = [as_triple(colour) for colour in drawn]
    groups += [
        ((p.x_mm, p.y_mm), _person(p, f"person {i}", shirts[i])) for i, p in enumerate(people)
    ]
    groups.sort(key=lambda group: -np.hypot(group[0][0] - eye[0], group[0][1] - eye[1]))
    ball: list[Solid] = [
        Ball("ball", ball_at(play, field, region, time_s), ball_radius_mm(field), ORANGE)
    ]
    return (ball if play.has_ball else []) + [thing for _, things in groups for thing in things]


def ball_radius_mm(field: Field) -> float:
    return field.extras.get("ball", {"radius_mm": 21.5})["radius_mm"]


def _robot(robot: RobotTruth, size: dict[str, float]) -> Prism:
    """A round robot with a flat front and the five-dot pattern; a cube with two coloured halves if it is small."""
    at, radius = (robot.x_mm, robot.y_mm), size["radius_mm"]
    team = YELLOW if robot.team == "yellow" else BLUE
    spot = _beside(at, robot.angle)
    if radius < 70:
        half = radius / float(np.sqrt(2))
        mine = OWN_COLOURS[robot.number % len(OWN_COLOURS)]
        patches = (
            (Box(spot(0, half / 2), (0.85 * half, 0.36 * half), robot.angle), team),
            (Box(spot(0, -half / 2), (0.85 * half, 0.36 * half), robot.angle), mine),
        )
        cube = Box(at, (half, half), robot.angle)
        return Prism(robot.name, cube, at, radius, 2, robot.z_mm, HAT, HULL, patches, 0.35)
    scale = radius / 90
    dots = [(Disc(at, TEAM_DOT_MM / 2 * scale), team)]
    for (ahead, left), green in zip(DOTS_MM, GREEN[robot.number % len(GREEN)], strict=True):
        dots.append(
            (Disc(spot(ahead * scale, left * scale), DOT_MM / 2 * scale), LIME if green else PINK)
        )
    body = CutDisc(at, radius, robot.angle, 0.8 * radius)
    return Prism(robot.name, body, at, radius, 3, robot.z_mm, HAT, HULL, tuple(dots), 0.4)


def _beside(at: Spot, angle: float):
    c, s = cos(angle), sin(angle)
    return lambda ahead, left: (at[0] + c * ahead - s * left, at[1] + s * ahead + c * left)


def goals(field: Field) -> list[Prism]:
    """Three white walls of 20 mm behind each goal line."""
    goal = field.extras.get("goal")
    if not goal or field.extras.get("carpet") == "black":
        return []  # the small league's goals are recesses in the wall: nothing stands up
    half, depth, wall = goal["width_mm"] / 2 + 10, goal["depth_mm"], 10.0
    things = []
    for side in (-1, 1):
        front, back = side * field.length_mm / 2, side * (field.length_mm / 2 + depth + 10)
        walls = (
            ((back, -half), (back, half)),
            ((front, -half), (back, -half)),
            ((front, half), (back, half)),
        )
        for start, end in walls:
            middle = ((start[0] + end[0]) / 2, (start[1] + end[1]) / 2)
            half_size = (abs(end[0] - start[0]) / 2 + wall, abs(end[1] - start[1]) / 2 + wall)
            things.append(
                Prism(
                    "goal",
                    Box(middle, half_size, 0.0),
                    middle,
                    max(half_size) + wall,
                    0,
                    goal["height_mm"],
                    WHITE,
                    (150.0, 156.0, 158.0),
                    (),
                    0.0,
                )
            )
    return things


def _person(person: PersonTruth, name: str, shirt: Colour) -> list[Solid]:
    """Shoes, legs, shoulders, head, from the ground up; the feet take turns."""
    spot = _beside((person.x_mm, person.y_mm), person.angle)
    things: list[Solid] = []
    for left, turn in ((110.0, 1.0), (-110.0, -1.0)):
        ahead = turn * _STRIDE_MM / 4 * sin(2 * np.pi * person.walked_mm / _STRIDE_MM)
        things.append(
            Prism(
                name,
                Capsule(spot(ahead - 70, left), spot(ahead + 150, left), 48),
                spot(ahead + 40, left),
                180,
                0,
                90,
                (44.0, 44.0, 48.0),
                (30.0, 30.0, 32.0),
                (),
                0.3,
            )
        )
        knee = spot(0.7 * ahead, left * 0.9)
        things.append(Prism(name, Disc(knee, 75), knee, 80, 60, 880, JEANS, JEANS))
    dark = as_triple(0.8 * v for v in shirt)
    things.append(
        Prism(
            name, Capsule(spot(0, 190), spot(0, -190), 120), spot(0, 0), 320, 850, 1450, shirt, dark
        )
    )
    things.append(Prism(name, Disc(spot(20, 0), 95), spot(20, 0), 100, 1450, 1780, HAIR, SKIN))
    return things
