"""How places on the carpet move with a thin-plate model's displacement at a lattice of nodes; see uncertainty.py."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from touchline.core.geometry import Array, Points, with_z
from touchline.fitting.thin_plate.uncertainty import NODE_NAMES, lattice, lattice_weights
from touchline.models import raw_from_field
from touchline.models.thin_plate import ThinPlate, spline_frame

HALF_MM = 0.5  # step of the derivative of the pixel by the place


@dataclass(frozen=True, eq=False)
class LatticeSensitivity:
    """contract.Sensitivity: its parameters are the displacements at the lattice's nodes, px."""

    model: ThinPlate
    names: ClassVar[tuple[str, ...]] = NODE_NAMES

    def field_jacobian(self, points_field_xyz: Array, names: tuple[str, ...]) -> Array:
        model = self.model
        places = model.corrected_from_field(np.asarray(points_field_xyz, float)[:, :2])
        mm_per_px = model.field_from_corrected(np.eye(2)) - model.field_from_corrected(np.zeros((2, 2)))
        middle, unit = spline_frame(model.base)
        reads = lattice_weights((lattice(model.width_px, model.height_px) - middle) / unit, (places - middle) / unit)
        by = (reads[:, None, :, None] * mm_per_px.T[None, :, None, :]).reshape(len(places), 2, -1)
        by[~np.isfinite(model.raw_from_corrected(places)).all(axis=1)] = np.nan
        return by[:, :, [NODE_NAMES.index(name) for name in names]]

    def click_jacobian(self, places: Points, along: Points, names: tuple[str, ...]) -> Array:
        steps = HALF_MM * np.eye(2)
        by_place = np.stack([raw_from_field(self.model, places + s) - raw_from_field(self.model, places - s)
                             for s in steps], axis=-1) / (2 * HALF_MM)
        ahead = np.einsum("nij,nj->ni", by_place, along)
        across = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1) / np.linalg.norm(ahead, axis=1, keepdims=True)
        moved = self.field_jacobian(with_z(places), names)
        return -np.einsum("ni,nij,njk->nk", across, by_place, moved)
