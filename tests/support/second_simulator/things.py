"""What else is in the picture: carpet and floor, light and shade, walls, goals with nets, robots, people, cables."""

from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from tests.support.second_simulator.opencv_camera import OpenCvCamera
from tests.support.second_simulator.scene_spec import SceneSpec
from touchline.core.field import Field

Array = NDArray[np.float64]
CARPET, FLOOR = np.array([0.05, 0.16, 0.045]), np.array([0.12, 0.13, 0.14])  # linear light, BGR
ROBOT_MM = {"ssl": (90, 150), "vss": (56, 75), "tab": (56, 75)}  # radius, height
SHIFT = 4  # bits below the pixel in OpenCV's drawing


def floor_colours(
    x: Array, y: Array, field: Field, spec: SceneSpec, rng: np.random.Generator
) -> Array:
    """Return the colour of carpet and floor, lit and shaded, (h, w, 3) linear light."""
    apron = 0.05 * field.length_mm + 60
    half_x, half_y = field.length_mm / 2 + apron, field.width_mm / 2 + apron
    carpet = (np.abs(x) < half_x) & (np.abs(y) < half_y)
    texture = cv2.GaussianBlur(rng.normal(0, 1, (700, 700)), (0, 0), 1.2)
    texture = (texture / texture.std()).astype(np.float32)
    scale = field.length_mm / 900
    grain = cv2.remap(
        texture,
        (x / scale % 690).astype(np.float32),
        (y / scale % 690).astype(np.float32),
        cv2.INTER_LINEAR,
    )
    tint = CARPET * rng.uniform(0.7, 1.3, 3)
    if spec.field.startswith("vsss"):
        tint = np.array([0.02, 0.02, 0.022]) * rng.uniform(0.8, 1.6)  # a black table
    colour = np.where(carpet[..., None], tint, FLOOR * rng.uniform(0.5, 1.5))
    colour *= 1 + 0.06 * grain[..., None]
    if spec.things.seams:
        apart = rng.uniform(0.2, 0.45) * field.width_mm
        away = np.abs((y + rng.uniform(0, apart)) % apart - apart / 2)
        colour *= np.where((away < 2.5) & carpet, 1.25, 1.0)[..., None]
    return colour


def _lighting(x: Array, y: Array, field: Field, spec: SceneSpec, rng: np.random.Generator) -> Array:
    gain = np.full(x.shape, 0.75)
    for _ in range(3):  # lamps
        gain += 0.35 * np.exp(
            -(
                (x - rng.uniform(-1, 1) * field.length_mm / 2) ** 2
                + (y - rng.uniform(-1, 1) * field.width_mm / 2) ** 2
            )
            / (0.35 * field.length_mm) ** 2
        )
    for _ in range(spec.things.shade):  # the edge of a shadow, sharp to a few mm
        angle, depth = rng.uniform(0, 2 * np.pi), rng.uniform(0.4, 0.75)
        away = (x - rng.uniform(-0.3, 0.3) * field.length_mm) * np.cos(angle) + (
            y - rng.uniform(-0.3, 0.3) * field.width_mm
        ) * np.sin(angle)
        gain *= 1 - (1 - depth) * np.clip(away / rng.uniform(4, 40) + 0.5, 0, 1)
    return gain


def draw_things(
    light: NDArray[np.float32],
    x: Array,
    y: Array,
    camera: OpenCvCamera,
    field: Field,
    spec: SceneSpec,
    samples: int,
    rng: np.random.Generator,
) -> NDArray[np.float32]:
    """Draw over the carpet, from the floor up. samples: of the picture a side and pixel."""
    light *= _lighting(x, y, field, spec, rng)[..., None].astype(np.float32)

    def seen(points: Array) -> Array | None:
        pixels = camera.project(np.asarray(points, float))
        return (
            (pixels + 0.5) * samples - 0.5
            if np.isfinite(pixels).all() and np.abs(pixels).max() < 2e4
            else None
        )

    def fill(points: Array, colour: Array | float) -> None:
        pixels = seen(points)
        if pixels is not None:
            hull = cv2.convexHull(np.rint(pixels * 2**SHIFT).astype(np.int32))
            cv2.fillPoly(light, [hull], np.broadcast_to(colour, 3).tolist(), cv2.LINE_8, SHIFT)

    def stroke(points: Array, width_mm: float, colour: Array | float) -> None:
        pixels = seen(points)
        if pixels is None:
            return
        beside = seen(points + np.array([width_mm, 0, 0]))
        wide = (
            1
            if beside is None
            else max(1, round(float(np.median(np.linalg.norm(beside - pixels, axis=1)))))
        )
        cv2.polylines(
            light,
            [np.rint(pixels * 2**SHIFT).astype(np.int32)],
            False,
            np.broadcast_to(colour, 3).tolist(),
            wide,
            cv2.LINE_8,
            SHIFT,
        )

    hx, hy = field.length_mm / 2, field.width_mm / 2
    small = field.length_mm < 3000
    if spec.things.walls:
        off, high, grey = (
            rng.uniform(20, 60) if small else rng.uniform(200, 350),
            50 if small else 100,
            rng.uniform(0.02, 0.6),
        )
        for a, b in (
            ((-1, -1), (1, -1)),
            ((1, -1), (1, 1)),
            ((1, 1), (-1, 1)),
            ((-1, 1), (-1, -1)),
        ):
            ends = np.array(
                [[a[0] * (hx + off), a[1] * (hy + off)], [b[0] * (hx + off), b[1] * (hy + off)]]
            )
            places = ends[0] + np.linspace(0, 1, 30)[:, None] * (ends[1] - ends[0])
            for begin, end in pairwise(places):
                fill(np.array([[*begin, 0], [*end, 0], [*end, high], [*begin, high]]), grey)
    if spec.things.goals and spec.field != "table":
        _draw_goals(fill, stroke, field, small)
    for _ in range(spec.things.cables):
        steps = np.cumsum(rng.normal(0, 0.05, (30, 2)), axis=0) + np.linspace(-0.6, 0.6, 30)[
            :, None
        ] * rng.choice([-1, 1], 2) * rng.uniform(0.4, 1, 2)
        stroke(
            np.column_stack([steps * (hx, hy), np.full(30, 4.0)]),
            9.0,
            rng.choice([0.01, 0.25, 0.5]),
        )
    radius, high = ROBOT_MM[spec.field[:3]]
    for _ in range(spec.things.robots):
        _draw_robot(fill, rng.uniform(-1, 1, 2) * (hx, hy), radius, high, rng)
    for _ in range(spec.things.people):
        at = rng.uniform(-1, 1, 2) * (hx, hy)
        at[rng.integers(2)] *= 1.05 / max(abs(at[0] / hx), abs(at[1] / hy), 0.3)
        clothes = rng.uniform(0.01, 0.4, 3)
        tall = min(1700.0, 0.7 * spec.height_mm)
        for part, wide in ((0.5, 90.0), (1.0, 220.0)):
            _cylinder(
                fill,
                at,
                wide * (0.4 if small else 1),
                0 if part == 0.5 else tall / 2,
                tall * part,
                clothes,
            )
    for _ in range(spec.things.glare):
        at, size = rng.uniform(-0.8, 0.8, 2) * (hx, hy), rng.uniform(0.02, 0.06) * field.length_mm
        spot = np.exp(
            -((x - at[0]) ** 2 + ((y - at[1]) * rng.uniform(0.3, 1)) ** 2) / (2 * size**2)
        )
        light += (rng.uniform(0.1, 0.5) * spot[..., None]).astype(np.float32)
    return light


def _circle(at: Array, radius: float, z: float) -> Array:
    angle = np.linspace(0, 2 * np.pi, 32, endpoint=False)
    return np.column_stack(
        [at[0] + radius * np.cos(angle), at[1] + radius * np.sin(angle), np.full(32, z)]
    )


def _cylinder(fill, at: Array, radius: float, low: float, high: float, colour) -> None:
    fill(np.concatenate([_circle(at, radius, low), _circle(at, radius, high)]), colour)


def _draw_robot(fill, at: Array, radius: float, high: float, rng: np.random.Generator) -> None:
    _cylinder(fill, at, radius, 0, high, rng.uniform(0.01, 0.1))
    fill(_circle(at, radius, high), 0.012)
    fill(_circle(at, 25, high), (0.01, 0.5, 0.6) if rng.random() < 0.5 else (0.6, 0.15, 0.02))
    for angle in rng.uniform(0, 2 * np.pi, 4):
        spot = at + 0.65 * radius * np.array([np.cos(angle), np.sin(angle)])
        fill(_circle(spot, 20, high), (0.05, 0.5, 0.05) if rng.random() < 0.5 else (0.4, 0.05, 0.5))


def _draw_goals(fill, stroke, field: Field, small: bool) -> None:
    wide, deep, high = (
        (0.15 * field.length_mm, 0.05 * field.length_mm, 40) if small else (1000, 180, 160)
    )
    for side in (-1, 1):
        x0 = side * field.length_mm / 2
        x1 = x0 + side * deep
        path = np.array([[x0, -wide / 2], [x1, -wide / 2], [x1, wide / 2], [x0, wide / 2]])
        for a, b in pairwise(path):
            fill(np.array([[*a, 0], [*b, 0], [*b, high], [*a, high]]), 0.6)
        for t in np.linspace(-0.5, 0.5, 15):  # the net over it
            stroke(np.array([[x0, t * wide, high], [x1, t * wide, high]]), 3.0, 0.3)
        for t in np.linspace(0, 1, 5):
            stroke(
                np.array(
                    [[x0 + t * (x1 - x0), -wide / 2, high], [x0 + t * (x1 - x0), wide / 2, high]]
                ),
                3.0,
                0.3,
            )
