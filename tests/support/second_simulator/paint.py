"""A field as somebody painted it: every marking beside its place, of a width of its own, worn and interrupted."""

from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core.field import Arc, Field, Line
from touchline.core.geometry import as_pair

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PaintErrors:
    """line_sigma_mm: of each line's place, and of an arc's radius and of its centre each way. wear: 0 to 1.

    gross_mm: how far one line, or one arc's centre, is off besides.

    gaps: interruptions of a marking, of 0.5 to 3 % of the field each. width_mm: of the paint; None as the rules say.
    """

    line_sigma_mm: float = 0.0
    gross_mm: float = 0.0
    slope_sigma: float = 0.0
    wear: float = 0.0
    gaps: float = 0.0
    width_mm: float | None = None


@dataclass(frozen=True, eq=False)
class PaintedField:
    """markings: as painted, in the field's order. offsets_mm: across each line (along its normal) or of radius.

    centres_mm: how far each arc's centre is off.
    """

    markings: tuple[Line | Arc, ...]
    offsets_mm: dict[str, float]
    centres_mm: dict[str, tuple[float, float]]
    gaps: tuple[tuple[tuple[float, float], ...], ...]  # along each, mm from its start
    wear: float

    def as_json(self) -> dict[str, Any]:
        return {
            "offsets_mm": self.offsets_mm,
            "centres_mm": self.centres_mm,
            "wear": self.wear,
            "markings": [m.to_json() for m in self.markings],
        }


def painted(field: Field, errors: PaintErrors, rng: np.random.Generator) -> PaintedField:
    """Paint a field's lines and arcs. Lines that lie on one another, as region borders do, are painted once."""
    markings: list[Line | Arc] = []
    offsets: dict[str, float] = {}
    centres: dict[str, tuple[float, float]] = {}
    gross = rng.integers(len(field.markings)) if errors.gross_mm else -1
    for number, marking in enumerate(field.markings):
        off, gross_mm = (
            rng.normal(0, errors.line_sigma_mm),
            errors.gross_mm if number == gross else 0.0,
        )
        width = errors.width_mm or marking.width_mm
        if isinstance(marking, Arc):
            towards = rng.uniform(-np.pi, np.pi)
            aside = rng.normal(0, errors.line_sigma_mm, 2) + gross_mm * np.array(
                [np.cos(towards), np.sin(towards)]
            )
            offsets[marking.name], centres[marking.name] = float(off), as_pair(aside)
            markings.append(
                replace(
                    marking,
                    centre=as_pair(np.add(marking.centre, aside)),
                    radius_mm=marking.radius_mm + off,
                    width_mm=width,
                )
            )
            continue
        off += gross_mm * rng.choice([-1, 1])
        offsets[marking.name] = float(off)
        start, end = np.array(marking.start), np.array(marking.end)
        along = (end - start) / np.linalg.norm(end - start)
        normal = np.array([-along[1], along[0]])
        turn = rng.normal(0, errors.slope_sigma) * np.linalg.norm(end - start) / 2
        markings.append(
            replace(
                marking,
                start=as_pair(start + normal * (off - turn)),
                end=as_pair(end + normal * (off + turn)),
                width_mm=width,
            )
        )
    gaps = tuple(
        tuple(
            (float(at), float(at + rng.uniform(0.005, 0.03) * field.length_mm))
            for at in rng.uniform(0, m.length_mm, rng.poisson(errors.gaps))
        )
        for m in markings
    )
    return PaintedField(tuple(markings), offsets, centres, gaps, errors.wear)


def coverage(
    paint: PaintedField,
    x: Array,
    y: Array,
    steps: tuple[Array, Array, Array, Array],
    texture: Array,
    texture_mm: float,
) -> NDArray[np.float32]:
    """Return how much of each sample (h, w) is paint, 0 to 1.

    steps: x and y by one sample to the right and down (x_u, x_v, y_u, y_v), mm: the box of a sample is integrated
    across each edge. texture: unit noise that says where the paint is worn.
    """
    covered = np.zeros(x.shape, np.float32)
    for marking, gaps in zip(paint.markings, paint.gaps, strict=True):
        reach = marking.width_mm
        if isinstance(marking, Arc):
            cx, cy = marking.centre
            radius = np.hypot(x - cx, y - cy)
            rows, columns = np.nonzero(np.abs(radius - marking.radius_mm) < reach + 60)
            if not len(rows):
                continue
            box = np.s_[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
            px, py, r = x[box] - cx, y[box] - cy, np.maximum(radius[box], 1e-6)
            away = r - marking.radius_mm
            slope = _slope(px / r, py / r, box, steps)
            angle = np.degrees(np.arctan2(py, px))
            middle, half = (
                (marking.start_deg + marking.end_deg) / 2,
                abs(marking.end_deg - marking.start_deg) / 2,
            )
            off_deg = np.abs((angle - middle + 180) % 360 - 180)
            along = np.radians(angle - marking.start_deg) % (2 * np.pi) * marking.radius_mm
            ends = (
                np.ones_like(away)
                if half >= 180
                else _ramp(np.radians(half - off_deg) * marking.radius_mm, slope)
            )
        else:
            start, end = np.array(marking.start), np.array(marking.end)
            length = float(np.linalg.norm(end - start))
            (tx, ty) = (end - start) / length
            away = (x - start[0]) * -ty + (y - start[1]) * tx
            along = (x - start[0]) * tx + (y - start[1]) * ty
            rows, columns = np.nonzero(
                (np.abs(away) < reach + 60) & (along > -60) & (along < length + 60)
            )
            if not len(rows):
                continue
            box = np.s_[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
            away, along = away[box], along[box]
            slope, slope_along = _slope(-ty, tx, box, steps), _slope(tx, ty, box, steps)
            # A marking's corner is filled: lines are painted to the outer edge of those they meet.
            half = marking.width_mm / 2
            ends = _ramp(along + half, slope_along) * _ramp(length + half - along, slope_along)
        half = marking.width_mm / 2
        share = (_ramp(away + half, slope) - _ramp(away - half, slope)) * ends
        for begin, stop in gaps:
            share = share * (1 - ((along > begin) & (along < stop)))
        np.maximum(covered[box], share, out=covered[box])
    if paint.wear:
        worn = cv2.remap(
            texture.astype(np.float32),
            (x / texture_mm % (texture.shape[1] - 2)).astype(np.float32),
            (y / texture_mm % (texture.shape[0] - 2)).astype(np.float32),
            cv2.INTER_LINEAR,
        )
        covered *= 1 - np.clip((worn - (1.6 - 1.6 * paint.wear)) * 2, 0, 0.85)
    return covered


def _slope(
    nx: Array | float, ny: Array | float, box: tuple, steps: tuple[Array, Array, Array, Array]
) -> Array:
    x_u, x_v, y_u, y_v = (s[box] for s in steps)
    return np.maximum(np.abs(nx * x_u + ny * y_u) + np.abs(nx * x_v + ny * y_v), 1e-6)


def _ramp(distance: Array, slope: Array) -> Array:
    """Return the share of a sample on the positive side of an edge."""
    return np.clip(distance / slope + 0.5, 0, 1)
