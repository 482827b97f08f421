"""What is known of a camera in the picture turned by quarters: Σ' = J Σ Jᵀ, J the new parameters by the old ones.

A pair of parameters that is one vector in the picture turns by R. Sideways the focal lengths change places:
log f' = log f + log a and a' = 1 / a, where a is the aspect. Nothing else changes: neither the radial terms, nor the
place of the camera, nor a homography's Δ, which acts on the field's side.
"""

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from touchline.core.geometry import Array
from touchline.core.quarter_turn import QuarterTurn

Pairs: TypeAlias = Sequence[tuple[str, str]]

# of every camera: px, and rad about the camera's own axes
VECTORS: Pairs = (("centre_x", "centre_y"), ("turn_x", "turn_y"))
FOCAL = ("log_focal", "aspect")


def turned_covariance(
    names: Sequence[str], covariance: Array, turn: QuarterTurn, vectors: Pairs, aspect: float
) -> tuple[tuple[str, ...], Array]:
    """Return names and covariance (k, k) in the turned picture. vectors: pairs of the lens's terms, as in VECTORS.

    Where only one of a pair was estimated, the other one is afterwards. aspect: of the camera before the turn.
    """
    blocks = {pair: turn.matrix for pair in (*VECTORS, *vectors)}
    if turn.is_sideways:
        blocks[FOCAL] = np.array([[1.0, 1 / aspect], [0.0, -1 / aspect**2]])
    partner = {name: pair[1 - k] for pair in blocks for k, name in enumerate(pair)}
    every = list(dict.fromkeys(n for name in names for n in (name, partner.get(name, name))))
    place = {name: k for k, name in enumerate(every)}
    by = np.eye(len(every))
    for pair, block in blocks.items():
        if pair[0] in place:
            rows = [place[name] for name in pair]
            by[np.ix_(rows, rows)] = block
    by = by[:, [place[name] for name in names]]
    known = np.any(by, axis=1)
    moved = by[known] @ np.reshape(covariance, (len(names), len(names))) @ by[known].T
    return tuple(every[k] for k in np.flatnonzero(known)), moved


def turned_terms(names: Sequence[str], turn: QuarterTurn, vectors: Pairs) -> list[str]:
    """Return which terms of a lens bend the turned picture, where these ones bent the one before."""
    if not turn.is_sideways:
        return list(names)
    partner = {name: pair[1 - k] for pair in vectors for k, name in enumerate(pair)}
    moved = [partner.get(name, name) for name in names]
    return list(names) if set(moved) == set(names) else moved
