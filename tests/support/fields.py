"""Small worlds for tests: fields built around a region, and what a model sees of them, exactly or as a hand clicks."""

import numpy as np

from touchline.core.field import BORDERS, Arc, Field, Landmark, Line, Region
from touchline.core.records import Observation, Observations
from touchline.models import CameraModel, raw_from_field

FULL = Region("full", (-2000.0, 2000.0), (-1500.0, 1500.0), 0)
HALF = Region("half", (0.0, 2000.0), (-1500.0, 1500.0), 90)
ACROSS = np.linspace(-0.8, 0.8, 5)


def plain_field(region: Region = FULL) -> Field:
    """A field with the region, five lines each way across it, a circle and a 5 × 5 grid of landmarks."""
    x0, x1, y0, y1 = *region.x_mm, *region.y_mm
    cx, cy, hx, hy = (x0 + x1) / 2, (y0 + y1) / 2, (x1 - x0) / 2, (y1 - y0) / 2
    lines = [Line(f"at-x-{i}", (cx + a * hx, y0), (cx + a * hx, y1)) for i, a in enumerate(ACROSS)]
    lines += [Line(f"at-y-{i}", (x0, cy + a * hy), (x1, cy + a * hy)) for i, a in enumerate(ACROSS)]
    marks = [
        Landmark(f"mark-{i}-{j}", (cx + a * hx, cy + b * hy))
        for i, a in enumerate(ACROSS)
        for j, b in enumerate(ACROSS)
    ]
    return Field(
        "plain",
        "A plain field",
        float(x1 - x0),
        float(y1 - y0),
        {line.name: line for line in lines},
        {"circle": Arc("circle", (cx, cy), 0.3 * hy)},
        {m.name: m for m in marks},
        {region.name: region},
        line_sigma_mm=0.0,
    )


def seen(
    model: CameraModel,
    region: Region,
    per_border: int = 9,
    *,
    noise_px: float = 0.0,
    rng: np.random.Generator | None = None,
    ends: float = 0.02,
) -> Observations:
    """The four borders as the model sees them, clicked per_border times each from end to end."""
    t = np.linspace(ends, 1 - ends, per_border)[:, None]
    found = []
    for name in BORDERS:
        line = region.border(name)
        places = np.asarray(line.start) * (1 - t) + np.asarray(line.end) * t
        found.append(
            Observation(name, "line", jittered(raw_from_field(model, places), noise_px, rng))
        )
    return tuple(found)


def marks_seen(model: CameraModel, field: Field, **noise) -> Observations:
    """Every landmark of the field as the model sees it."""
    return tuple(
        Observation(
            m.name, "landmark", jittered(raw_from_field(model, np.array([m.position])), **noise)
        )
        for m in field.landmarks.values()
    )


def jittered(points, noise_px: float = 0.0, rng: np.random.Generator | None = None):
    return (
        points
        if not noise_px
        else points + (rng or np.random.default_rng(0)).normal(0, noise_px, points.shape)
    )


def grid(width: float, height: float, columns: int = 21, rows: int = 17):
    """(rows, columns, 2) points over a rectangle from (0, 0) to (width, height)."""
    return np.stack(
        np.meshgrid(np.linspace(0, width, columns), np.linspace(0, height, rows)), axis=-1
    )
