"""Shapes of robots, people, goals and the ball, part by part."""

from math import cos, sin

import numpy as np

from touchline.core.field import Field, Region
from touchline.core.geometry import as_triple
from touchline.core.ssl_pattern import DOT_MM, DOTS_MM, GREEN, TEAM_DOT_MM
from touchline.sources.sim import motion
from touchline.sources.sim.motion import Motion, PersonTruth, RobotTruth
from touchline.sources.sim.solids import Ball, Box, Capsule, Colour, CutDisc, Disc, Prism, Solid, Spot

YELLOW, BLUE = (40.0, 214.0, 246.0), (210.0, 96.0, 24.0)  # BGR
PINK, LIME = (190.0, 92.0, 250.0), (92.0, 232.0, 110.0)
ORANGE = (30.0, 112.0, 250.0)
HULL, HAT = (34.0, 33.0, 32.0), (20.0, 20.0, 20.0)
WHITE, SKIN, HAIR, JEANS = (215.0, 220.0, 222.0), (140.0, 170.0, 214.0), (28.0, 34.0, 42.0), (96.0, 66.0, 48.0)
# A small robot's colour beside its team's, by its number.
PURPLE, CYAN, RED = (214.0, 52.0, 120.0), (222.0, 214.0, 60.0), (44.0, 30.0, 222.0)
OWN_COLOURS = (LIME, PINK, CYAN, PURPLE, RED)
_STRIDE_MM = 1300.0  # two steps


def moving(play: Motion, field: Field, region: Region, time_s: float, eye: tuple[float, float, float]) -> list[Solid]:
    """Return everything that moves, in drawing order: what is farther from the camera first."""
    robots = motion.robots_at(play, field, region, time_s)
    people = motion.people_at(play, region, time_s)
    groups: list[tuple[Spot, list[Solid]]] = [((r.x_mm, r.y_mm), [_robot(r, motion.robot_size(field))]) for r in robots]
    drawn = (np.random.default_rng([play.seed, 8, i]).uniform(40, 190, 3) for i in range(play.people))
    shirts = [as_triple(colour) for colour in drawn]
    groups += [((p.x_mm, p.y_mm), _person(p, f"person {i}", shirts[i])) for i, p in enumerate(people)]
    groups.sort(key=lambda group: -np.hypot(group[0][0] - eye[0], group[0][1] - eye[1]))
    ball: list[Solid] = [Ball("ball", motion.ball_at(play, field, region, time_s), ball_radius_mm(field), ORANGE)]
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
        patches = ((Box(spot(0, half / 2), (0.85 * half, 0.36 * half), robot.angle), team),
                   (Box(spot(0, -half / 2), (0.85 * half, 0.36 * half), robot.angle), mine))
        cube = Box(at, (half, half), robot.angle)
        return Prism(robot.name, cube, at, radius, 2, robot.z_mm, HAT, HULL, patches, 0.35)
    scale = radius / 90
    dots = [(Disc(at, TEAM_DOT_MM / 2 * scale), team)]
    for (ahead, left), green in zip(DOTS_MM, GREEN[robot.number % len(GREEN)], strict=True):
        dots.append((Disc(spot(ahead * scale, left * scale), DOT_MM / 2 * scale), LIME if green else PINK))
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
        walls = (((back, -half), (back, half)), ((front, -half), (back, -half)), ((front, half), (back, half)))
        for start, end in walls:
            middle = ((start[0] + end[0]) / 2, (start[1] + end[1]) / 2)
            half_size = (abs(end[0] - start[0]) / 2 + wall, abs(end[1] - start[1]) / 2 + wall)
            things.append(Prism("goal", Box(middle, half_size, 0.0), middle, max(half_size) + wall, 0,
                               goal["height_mm"], WHITE, (150.0, 156.0, 158.0), (), 0.0))
    return things


def _person(person: PersonTruth, name: str, shirt: Colour) -> list[Solid]:
    """Shoes, legs, shoulders, head, from the ground up; the feet take turns."""
    spot = _beside((person.x_mm, person.y_mm), person.angle)
    things: list[Solid] = []
    for left, turn in ((110.0, 1.0), (-110.0, -1.0)):
        ahead = turn * _STRIDE_MM / 4 * sin(2 * np.pi * person.walked_mm / _STRIDE_MM)
        things.append(Prism(name, Capsule(spot(ahead - 70, left), spot(ahead + 150, left), 48), spot(ahead + 40, left),
                           180, 0, 90, (44.0, 44.0, 48.0), (30.0, 30.0, 32.0), (), 0.3))
        knee = spot(0.7 * ahead, left * 0.9)
        things.append(Prism(name, Disc(knee, 75), knee, 80, 60, 880, JEANS, JEANS))
    dark = as_triple(0.8 * v for v in shirt)
    things.append(Prism(name, Capsule(spot(0, 190), spot(0, -190), 120), spot(0, 0), 320, 850, 1450, shirt, dark))
    things.append(Prism(name, Disc(spot(20, 0), 95), spot(20, 0), 100, 1450, 1780, HAIR, SKIN))
    return things
