"""Who is on the field at a moment, and where: robots on smooth rounds, a ball, goals, people who stand in the way."""

from dataclasses import dataclass

import numpy as np

from app.field import Field, Region
from app.sources.sim.things import Ball, Spot, Tall, box, capsule, cut, disc

YELLOW, BLUE = (40.0, 214.0, 246.0), (210.0, 96.0, 24.0)  # BGR
PINK, LIME = (190.0, 92.0, 250.0), (92.0, 232.0, 110.0)
ORANGE = (30.0, 112.0, 250.0)
HULL, HAT = (34.0, 33.0, 32.0), (20.0, 20.0, 20.0)
WHITE, SKIN, HAIR = (215.0, 220.0, 222.0), (140.0, 170.0, 214.0), (28.0, 34.0, 42.0)
# The four outer dots of the butterfly, mm ahead and to the left of the hat's middle.
DOTS = ((35.0, 54.8), (-54.8, 35.0), (-54.8, -35.0), (35.0, -54.8))


@dataclass(frozen=True)
class Play:
    """robots: of both teams together. people: who stand at the region's edge and hide lines."""

    robots: int = 8
    people: int = 0
    seed: int = 1


@dataclass(frozen=True)
class RobotTruth:
    """Where a robot is: mm, radians, and the height of its hat."""

    team: str
    number: int
    x_mm: float
    y_mm: float
    angle: float
    z_mm: float


def robots_at(play: Play, field: Field, region: Region, time_s: float) -> list[RobotTruth]:
    """Each robot goes round an ellipse of its own, none through another's middle."""
    rng = np.random.default_rng([play.seed, 1])
    size = _robot(field)
    columns = int(np.ceil(np.sqrt(play.robots * region.width_mm / region.height_mm))) if play.robots else 1
    rows = -(-play.robots // columns)
    found = []
    for i in range(play.robots):
        cell = np.array([(i % columns + 0.5) / columns, (i // columns + 0.5) / max(rows, 1)])
        half = np.array([region.width_mm / columns, region.height_mm / max(rows, 1)]) / 2
        room = np.maximum(half - 1.3 * size["radius_mm"], 0)
        orbit = room * rng.uniform(0.35, 0.75, 2)
        shift = (room - orbit) * rng.uniform(-1, 1, 2)
        speed = rng.uniform(0.25, 0.6) * rng.choice([-1, 1])
        phase = rng.uniform(0, 2 * np.pi) + speed * time_s
        place = cell * (region.width_mm, region.height_mm) + shift + orbit * (np.cos(phase), np.sin(phase))
        ahead = place + orbit * (-np.sin(phase), np.cos(phase)) * np.sign(speed)
        x, y = region.field_from_region(place)
        dx, dy = region.field_from_region(ahead) - (x, y)
        found.append(RobotTruth("yellow" if i % 2 else "blue", i // 2, float(x), float(y),
                                float(np.arctan2(dy, dx)), size["height_mm"]))
    return found


def ball_at(play: Play, field: Field, region: Region, time_s: float) -> Spot:
    """The ball rolls to and fro along a slow curve."""
    phase = np.random.default_rng([play.seed, 2]).uniform(0, 2 * np.pi)
    u = 0.5 + 0.36 * np.sin(0.31 * time_s + phase)
    v = 0.5 + 0.32 * np.sin(0.23 * time_s + 2 * phase)
    x, y = region.field_from_region(np.array([u * region.width_mm, v * region.height_mm]))
    return float(x), float(y)


def moving(play: Play, field: Field, region: Region, time_s: float) -> list[Tall | Ball]:
    """The robots and the ball at a time."""
    things: list[Tall | Ball] = []
    if play.robots:
        things.append(Ball(ball_at(play, field, region, time_s),
                           field.extras.get("ball", {"radius_mm": 21.5})["radius_mm"], ORANGE))
    return things + [_robot_thing(robot, _robot(field)) for robot in robots_at(play, field, region, time_s)]


def standing(play: Play, field: Field, region: Region) -> list[Tall]:
    """What does not move: goals, and people at the region's edge."""
    return _goals(field) + _people(play, region)


def _robot(field: Field) -> dict[str, float]:
    return field.extras.get("robot", {"radius_mm": 90.0, "height_mm": 150.0})


def _robot_thing(robot: RobotTruth, size: dict[str, float]) -> Tall:
    """A round robot with a flat front and the five-dot pattern; a cube with two coloured halves if it is small."""
    at, radius = (robot.x_mm, robot.y_mm), size["radius_mm"]
    team = YELLOW if robot.team == "yellow" else BLUE
    c, s = np.cos(robot.angle), np.sin(robot.angle)

    def spot(ahead: float, left: float) -> Spot:
        return at[0] + c * ahead - s * left, at[1] + s * ahead + c * left
    if radius < 70:
        half = radius / np.sqrt(2)
        mine = PINK if robot.number % 2 else LIME
        patches = ((box(spot(0, half / 2), (0.85 * half, 0.36 * half), robot.angle), team),
                   (box(spot(0, -half / 2), (0.85 * half, 0.36 * half), robot.angle), mine))
        return Tall(box(at, (half, half), robot.angle), at, radius, 2, robot.z_mm, HAT, HULL, patches, 0.35)
    scale = radius / 90
    dots = [(disc(at, 25 * scale), team)]
    for i, (ahead, left) in enumerate(DOTS):  # the number's bits choose the colours
        dots.append((disc(spot(ahead * scale, left * scale), 20 * scale), LIME if robot.number >> i & 1 else PINK))
    body = cut(disc(at, radius), at, robot.angle, 0.8 * radius)
    return Tall(body, at, radius, 3, robot.z_mm, HAT, HULL, tuple(dots), 0.4)


def _goals(field: Field) -> list[Tall]:
    """Three white walls of 20 mm behind each goal line."""
    goal = field.extras.get("goal")
    if not goal or field.extras.get("carpet") == "black":
        return []  # the small league's goals are recesses in the wall: nothing stands up
    half, depth, wall = goal["width_mm"] / 2 + 10, goal["depth_mm"], 10.0
    things = []
    for side in (-1, 1):
        front, back = side * field.length_mm / 2, side * (field.length_mm / 2 + depth + 10)
        walls = (((back, -half), (back, half)), ((front, -half), (back, -half)), ((front, half), (back, half)))
        for start, end in walls:
            middle = ((start[0] + end[0]) / 2, (start[1] + end[1]) / 2)
            half_size = (abs(end[0] - start[0]) / 2 + wall, abs(end[1] - start[1]) / 2 + wall)
            things.append(Tall(box(middle, half_size, 0.0), middle, max(half_size) + wall, 0, goal["height_mm"],
                               WHITE, (150.0, 156.0, 158.0), (), 0.0))
    return things


def _people(play: Play, region: Region) -> list[Tall]:
    """Each stands with both feet near a border, looking in: shoes, legs, shoulders, head."""
    rng = np.random.default_rng([play.seed, 3])
    things = []
    for _ in range(play.people):
        side, along = rng.integers(4), rng.uniform(0.15, 0.85)
        u, v = ((along, -0.01), (along, 1.01), (-0.01, along), (1.01, along))[side]
        x, y = region.field_from_region(np.array([u * region.width_mm, v * region.height_mm]))
        inward = np.arctan2(np.mean(region.y_mm) - y, np.mean(region.x_mm) - x) + rng.uniform(-0.5, 0.5)
        c, s = np.cos(inward), np.sin(inward)

        def spot(ahead: float, left: float, x=x, y=y, c=c, s=s) -> Spot:
            return float(x + c * ahead - s * left), float(y + s * ahead + c * left)
        shirt = tuple(float(v) for v in rng.uniform(40, 190, 3))
        at, jeans = spot(0, 0), (96.0, 66.0, 48.0)
        for left in (110, -110):
            things.append(Tall(capsule(spot(-70, left), spot(150, left), 48), spot(40, left), 180, 0, 90,
                               (44.0, 44.0, 48.0), (30.0, 30.0, 32.0), (), 0.3))
            things.append(Tall(disc(spot(0, left * 0.9), 75), spot(0, left * 0.9), 80, 60, 880, jeans, jeans))
        things.append(Tall(capsule(spot(0, 190), spot(0, -190), 120), at, 320, 850, 1450, shirt,
                           tuple(0.8 * v for v in shirt)))
        things.append(Tall(disc(spot(20, 0), 95), spot(20, 0), 100, 1450, 1780, HAIR, SKIN))
    return things
