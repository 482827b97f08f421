"""Recognise a heard field among those that are known, by its geometry: names, order and widths of lines say nothing."""

from collections.abc import Iterable

import numpy as np

from touchline.core.field import Field
from touchline.core.geometry import Array, Mask
from touchline.ssl_protocol.ssl_vision_pb2 import SSL_GeometryFieldSize

SAME_MM = 0.5  # they send whole millimetres, and floats of four bytes
WHOLE_TURN = 2 * np.pi - 1e-3  # some send 6.283185


def known_field(sent: SSL_GeometryFieldSize, known: Iterable[Field]) -> Field | None:
    """Return the field of the same size whose markings are those of the message, or None.

    Either may lack markings that the other has: programs leave out what a hall has not painted. Of several the one
    counts that has the most in common, then the one with the same goal.
    """
    found = []
    for field in known:
        if (round(field.length_mm), round(field.width_mm)) == (sent.field_length, sent.field_width):
            ours, theirs = _markings(field), _sent_markings(sent)
            alone = [sum(_alone(a, b).sum() for a, b in zip(one, other, strict=True))
                     for one, other in ((ours, theirs), (theirs, ours))]
            if min(alone) == 0:
                goal_mm = field.extras.get("goal", {}).get("width_mm", 0)
                found.append(((sum(alone), round(goal_mm) != sent.goal_width), field))
    return min(found, key=lambda one: one[0])[1] if found else None


def markings_alone(of: SSL_GeometryFieldSize, among: SSL_GeometryFieldSize) -> list[str]:
    """Return the names of the markings that one message has and another has not at their place."""
    names = ([line.name for line in of.field_lines], [arc.name for arc in of.field_arcs])
    pairs = zip(names, _sent_markings(of), _sent_markings(among), strict=True)
    return [name for given, one, other in pairs for name, alone in zip(given, _alone(one, other), strict=True) if alone]


def _alone(of: Array, among: Array) -> Mask:
    """Tell which rows of `of` are near no row of `among`."""
    if not len(of) or not len(among):
        return np.ones(len(of), bool)
    apart_mm: Array = np.abs(of[:, None] - among[None]).max(axis=-1).min(axis=1)
    return apart_mm > SAME_MM


def _sent_markings(sent: SSL_GeometryFieldSize) -> tuple[Array, Array]:
    return (_lines([(line.p1.x, line.p1.y, line.p2.x, line.p2.y) for line in sent.field_lines]),
            _arcs([(arc.center.x, arc.center.y, arc.radius, arc.a1, arc.a2) for arc in sent.field_arcs]))


def _markings(field: Field) -> tuple[Array, Array]:
    return (_lines([(*line.start, *line.end) for line in field.lines.values()]),
            _arcs([(*arc.centre, arc.radius_mm, *np.radians((arc.start_deg, arc.end_deg))) for arc in
                   field.arcs.values()]))


def _lines(ends: list[tuple[float, ...]]) -> Array:
    """Lines as their middles and half their lengths (n, 4) mm: the same from either end."""
    x0, y0, x1, y1 = np.array(ends, float).reshape(-1, 4).T
    turned = (x1 < x0 - SAME_MM) | ((np.abs(x1 - x0) <= SAME_MM) & (y1 < y0))
    sign = np.where(turned, -1.0, 1.0)
    return np.stack([(x0 + x1) / 2, (y0 + y1) / 2, sign * (x1 - x0) / 2, sign * (y1 - y0) / 2], axis=-1)


def _arcs(arcs: list[tuple[float, ...]]) -> Array:
    """Arcs as centre, radius, and both ends relative to it (n, 7) mm; of a whole circle the ends do not count."""
    x, y, radius, start, end = np.array(arcs, float).reshape(-1, 5).T
    part = np.where(np.abs(end - start) < WHOLE_TURN, radius, 0.0)
    return np.stack([x, y, radius, part * np.cos(start), part * np.sin(start), part * np.cos(end), part * np.sin(end)],
                    axis=-1)
