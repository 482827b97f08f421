"""What straight lines tell of a lens, known before a field is clicked: how it bends, at whatever focal length.

Straight lines leave the focal length open, and the terms of a camera's lens go with it (plumb_line.py). So what is
known is no lens that could be put in, but a condition on terms and focal length together:

    term · (unit / f)^power = its value ± σ,    one for each term, all with one covariance

The clicks then find the focal length, and terms that they would guess badly come from the lines.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from app.core.errors import BadInput
from app.core.geometry import Array, ImageSize
from app.fitting.ray_camera.parameters import RayState
from app.models.plumb_line import LENSES, PlumbLens

FAST = 1e-3  # of its σ: how well a bend is known that is to be held fast
LEAST = 1e-9  # of its scale: a direction in which the lens is surer than that counts as this sure
CENTRE = ("centre_x", "centre_y")


@dataclass(frozen=True, eq=False)
class BentLens:
    """A lens from straight lines, with how well it is known: names of terms (per unit), perhaps of the centre (px)."""

    bend: PlumbLens
    names: tuple[str, ...]
    covariance: Array

    def to_json(self) -> dict[str, Any]:
        return {**self.bend.to_json(), "names": list(self.names), "covariance": self.covariance.tolist()}

    @classmethod
    def from_json(cls, value: Any) -> Self:
        """Read what to_json wrote; BadInput for anything else."""
        bend = PlumbLens.from_json(value)
        try:
            names, covariance = tuple(value["names"]), np.array(value["covariance"], float)
            known = (*LENSES[bend.name][1], *CENTRE)
            fine = (len(set(names)) == len(names) > 0 and set(names) <= set(known) and np.isfinite(covariance).all()
                    and covariance.shape == (len(names), len(names)) and (np.diag(covariance) >= 0).all())
            if not fine:
                raise ValueError
        except (KeyError, TypeError, ValueError, OverflowError):
            raise BadInput("It is not known how well this lens from straight lines is known.",
                           "Give one as POST /motion keeps it.", reason="bad-lens") from None
        return cls(bend, names, (covariance + covariance.T) / 2)

    @property
    def terms(self) -> tuple[str, ...]:
        return tuple(name for name in self.names if name not in CENTRE)


@dataclass(frozen=True, eq=False)
class BendPrior:
    """The same as residuals of a fit: rows (k, k), rows @ (what is found per unit - values) has σ 1."""

    names: tuple[str, ...]
    values: Array
    rows: Array
    powers: Array  # of each: 0 for the centre
    unit_px: float

    def residuals(self, found: Mapping[str, float]) -> Array:
        return self.rows @ (np.array([found[name] for name in self.names]) * self._scale(found) - self.values)

    def jacobian(self, names: list[str], found: Mapping[str, float]) -> Array:
        scale = self._scale(found)
        by = np.zeros((len(self.names), len(names)))
        by[np.arange(len(self.names)), [names.index(name) for name in self.names]] = scale
        by[:, names.index("log_focal")] -= self.powers * scale * np.array([found[name] for name in self.names])
        return self.rows @ by

    def _scale(self, found: Mapping[str, float]) -> Array:
        return (self.unit_px / np.exp(found["log_focal"])) ** self.powers


def bent_lens(model: str, settings: Mapping[str, Any], image_size: ImageSize) -> BentLens | None:
    """The lens from straight lines that the options hand over, None for any other; BadInput if it is not this model's,
    or of another picture."""
    given = settings.get("lens")
    if given is None or "unit" not in given.get("lens", {}):
        return None
    lens = BentLens.from_json(given["lens"])
    if lens.bend.name != model:
        raise BadInput(f"The held lens is {lens.bend.name}, the model to fit is {model}.",
                       f"Fit {lens.bend.name}, or hold another lens.", reason="bad-option")
    size = lens.bend.image_size
    if size != image_size:
        raise BadInput(f"The held lens is of pictures of {size.width} × {size.height} px, this one has "
                       f"{image_size.width} × {image_size.height} px.",
                       "Hold a lens that was found at this size.", reason="bad-option")
    return lens


def bend_prior(lens: BentLens, settings: Mapping[str, Any]) -> BendPrior:
    """What is known of it; held fast, or as well as it is known."""
    own = dict(zip(lens.bend.lens.TERMS, lens.bend.terms, strict=True)) | dict(
        zip(CENTRE, lens.bend.centre_px, strict=True))
    scale = np.sqrt(np.maximum(np.diag(lens.covariance), 1e-300))
    values, vectors = np.linalg.eigh(lens.covariance / np.outer(scale, scale))
    rows = (vectors / np.sqrt(np.maximum(values, LEAST))).T / scale
    powers = LENSES[lens.bend.name][1]
    return BendPrior(lens.names, np.array([own[name] for name in lens.names]),
                     rows if settings.get("lens_sigma") == "own" else rows / FAST,
                     np.array([powers.get(name, 0) for name in lens.names], float), lens.bend.unit_px)


def with_bend(state: RayState, lens: BentLens) -> RayState:
    """The state with the lens that bends so at its focal length."""
    told = lens.bend.terms_for(float(np.exp(state.log_focal)))
    return replace(state, terms=np.array([told.get(name, 0.0) for name in state.lens.TERMS]),
                   centre_px=np.array(lens.bend.centre_px))
