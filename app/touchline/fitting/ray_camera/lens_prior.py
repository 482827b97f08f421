"""A lens as a prior, known before the field is clicked: fixed, with its covariance, or from straight lines alone.

It comes from a board ({"name", "lens"}, a PinholeLens with its covariance), or taken over from another calibration
({"name", "parameters"}, and the "covariance" of its report, whose part on the lens is independent of the pose). The
field then fixes the pose.

Straight lines leave the focal length open, and the terms of a camera's lens depend on it (distortion.py). So what is
known is not a lens but a condition on terms and focal length together:

    term · (unit / f)^power = its value ± σ,    one for each term, all with one covariance

The clicks then determine the focal length, and the lines the terms.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from touchline.core.errors import BadInput
from touchline.core.geometry import Array, ImageSize
from touchline.core.quarter_turn import QuarterTurn
from touchline.fitting.ray_camera.parameters import RayCameraParameters
from touchline.models import model_from_json
from touchline.models.distortion import LINE_LENSES, Distortion
from touchline.models.intrinsics import PINHOLE_PARAMETERS, Intrinsics
from touchline.models.lenses import Lens
from touchline.models.ray_camera import RayCamera
from touchline.models.turned_covariance import turned_covariance

MIN_VARIANCE = 1e-9  # of its scale: a lower bound of the variance in every direction
# and so much of the focal length's: lenses that bend alike lie on a curve, which is a line nearby
BENDS_ALIKE = 1.0

FIXED_SIGMA = 1e-3  # of its σ, for a distortion that is to be fixed
CENTRE = ("centre_x", "centre_y")


@dataclass(frozen=True, eq=False)
class GaussianPrior:
    """Parameters by name, their mean, and the whitening of their errors: rows (k, k), rows @ (x - values) has σ 1.

    Values of terms are those that bend the picture likewise at the focal length unit_px: where that is known badly,
    what is known of a lens is how it bends, and its terms go along with the focal length.
    """

    names: tuple[str, ...]
    values: Array
    rows: Array
    lens: type[Lens]
    unit_px: float

    @classmethod
    def of(
        cls,
        names: tuple[str, ...],
        values: Array,
        covariance: Array,
        lens: type[Lens],
        unit_px: float,
        least: float = MIN_VARIANCE,
    ) -> Self:
        # unit diagonal first: focal lengths and k3 are known to very different digits
        scale = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
        variances, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
        return cls(
            names,
            values,
            (vectors / np.sqrt(np.maximum(variances, least))).T / scale,
            lens,
            unit_px,
        )

    def residuals(self, found: Mapping[str, float]) -> Array:
        terms, _, _ = self._terms(found)
        now = {**found, **dict(zip(self.lens.TERMS, terms, strict=True))}
        return self.rows @ (np.array([now[name] for name in self.names]) - self.values)

    def jacobian(self, names: list[str], found: Mapping[str, float]) -> Array:
        _, by_terms, by_scale = self._terms(found)
        by = np.zeros((len(self.names), len(names)))
        columns = [names.index(term) for term in self.lens.TERMS]
        for row, name in enumerate(self.names):
            if name in self.lens.TERMS:
                term = self.lens.TERMS.index(name)
                by[row, columns] = by_terms[term]
                by[row, names.index("log_focal")] = -by_scale[term]
            else:
                by[row, names.index(name)] = 1.0
        return self.rows @ by

    def _terms(self, found: Mapping[str, float]) -> tuple[Array, Array, Array]:
        terms = np.array([found[term] for term in self.lens.TERMS])
        return self.lens.at_scale(terms, float(np.log(self.unit_px) - found["log_focal"]))


def refuse_other_camera(
    held: str, size: ImageSize, model: str, image_size: ImageSize, made: str
) -> None:
    """Raise BadInput where the held lens is of another model or of another picture size than the fit."""
    if held != model:
        raise _other_model(held, model)
    if size != image_size:
        raise BadInput(
            f"The chosen lens is for images of {size}; this image has {image_size}.",
            f"Use a lens that was {made} at this size.",
            reason="bad-option",
        )


def _other_model(held: str, model: str) -> BadInput:
    return BadInput(
        f"The chosen lens is {held}, but the model to fit is {model}.",
        f"Fit {held}, or use another lens.",
        reason="bad-option",
    )


def read_lens(model: str, settings: Mapping[str, Any], image_size: ImageSize) -> Intrinsics | None:
    """Read the lens in the options; BadInput if it is not this model's, or of another picture size."""
    given = settings.get("lens")
    if given is None:
        return None
    if "lens" in given:
        lens = Intrinsics.from_json(given["lens"])
    else:
        camera = model_from_json(given["name"], given["parameters"])
        if not isinstance(camera, RayCamera):
            raise _other_model(camera.NAME, model)
        lens = camera_intrinsics(camera, given.get("covariance"))
    refuse_other_camera(lens.model, lens.image_size, model, image_size, "calibrated")
    if settings.get("lens_sigma") == "own" and not lens.estimated:
        raise BadInput(
            "The uncertainty of the lens is unknown: "
            + (
                "that calibration used a fixed lens itself."
                if given.get("covariance")
                else "it has no covariance."
            ),
            "Use a lens from a board, or from a calibration whose own points determined the lens, or fix the lens "
            '(lens_sigma "0").',
            reason="lens-sigma-unknown",
        )
    return lens


def camera_intrinsics(camera: RayCamera, covariance: Mapping[str, Any] | None = None) -> Intrinsics:
    """Return a camera's lens without its pose. covariance: of its fit, {"names", "matrix"}, as a report has it."""
    estimated, part = (
        _lens_covariance(camera, covariance) if covariance is not None else ((), np.empty((0, 0)))
    )
    return Intrinsics(
        camera.NAME,
        camera.lens_terms,
        camera.focal_px,
        camera.aspect,
        camera.centre_px,
        camera.image_size,
        estimated,
        tuple(tuple(map(float, row)) for row in part),
    )


def _lens_covariance(
    camera: RayCamera, covariance: Mapping[str, Any]
) -> tuple[tuple[str, ...], Array]:
    """Return names and part (k, k) of a fit's covariance that are the lens's own; BadInput for no covariance."""
    try:
        names, matrix = tuple(covariance["names"]), np.array(covariance["matrix"], float)
        fine = (
            matrix.shape == (len(names), len(names))
            and np.isfinite(matrix).all()
            and len(set(names)) == len(names)
        )
        own = [
            i for i, name in enumerate(names) if name in (*PINHOLE_PARAMETERS, *camera.LENS.TERMS)
        ]
        part = (matrix[np.ix_(own, own)] + matrix[np.ix_(own, own)].T) / 2 if fine else None
        if part is None or (np.diag(part) < 0).any():
            raise ValueError
    except (KeyError, TypeError, ValueError, IndexError, OverflowError):
        raise BadInput(
            "The covariance of the lens is invalid.",
            "Send the JSON that Touchline exported.",
            reason="bad-parameters",
        ) from None
    return tuple(names[i] for i in own), part


def with_lens(state: RayCameraParameters, lens: Intrinsics) -> RayCameraParameters:
    """Return the state with that lens and the same pose."""
    return replace(
        state,
        log_focal=float(np.log(lens.focal_px)),
        aspect=lens.aspect,
        centre_px=np.array(lens.centre_px),
        terms=np.array(lens.terms),
    )


def lens_prior(lens: Intrinsics, settings: Mapping[str, Any]) -> GaussianPrior | None:
    """Return the joint prior of a lens that is not fixed; the aspect is always fixed."""
    if settings.get("lens_sigma") != "own":
        return None
    chosen = [i for i, name in enumerate(lens.estimated) if name != "aspect"]
    names = tuple(lens.estimated[i] for i in chosen)
    by = np.eye(len(names))
    if "log_focal" in names:
        _, _, by_scale = lens.lens.at_scale(np.array(lens.terms), 0.0)
        scales = dict(zip(lens.lens.TERMS, by_scale, strict=True))
        by[:, names.index("log_focal")] -= [scales.get(n, 0.0) for n in names]
    covariance = by @ np.array(lens.covariance)[np.ix_(chosen, chosen)] @ by.T
    least = MIN_VARIANCE
    if "log_focal" in names:
        least = max(
            least, BENDS_ALIKE * covariance[names.index("log_focal"), names.index("log_focal")]
        )
    return GaussianPrior.of(
        names,
        np.array([lens.values[name] for name in names]),
        covariance,
        lens.lens,
        lens.focal_px,
        least,
    )


@dataclass(frozen=True, eq=False)
class DistortionEstimate:
    """A lens from straight lines with its covariance; names: of terms (per unit), perhaps of the centre (px)."""

    distortion: Distortion
    names: tuple[str, ...]
    covariance: Array

    @property
    def image_size(self) -> ImageSize:
        return self.distortion.image_size

    def to_json(self) -> dict[str, Any]:
        return {
            **self.distortion.to_json(),
            "names": list(self.names),
            "covariance": self.covariance.tolist(),
        }

    def turned(self, turn_deg: int) -> Self:
        """Return the same lens for its picture turned clockwise, with what is known of it; exact."""
        turn = QuarterTurn(turn_deg, self.image_size)
        known = turned_covariance(
            self.names, self.covariance, turn, self.distortion.lens.VECTORS, aspect=1.0
        )
        return type(self)(self.distortion.turned(turn_deg), *known)

    @classmethod
    def from_json(cls, value: Any) -> Self:
        """Read what to_json wrote; BadInput for anything else."""
        bend = Distortion.from_json(value)
        try:
            names, covariance = tuple(value["names"]), np.array(value["covariance"], float)
            known = (*LINE_LENSES[bend.name][1], *CENTRE)
            fine = (
                len(set(names)) == len(names) > 0
                and set(names) <= set(known)
                and np.isfinite(covariance).all()
                and covariance.shape == (len(names), len(names))
                and (np.diag(covariance) >= 0).all()
            )
            if not fine:
                raise ValueError
        except (KeyError, TypeError, ValueError, OverflowError):
            raise BadInput(
                "The uncertainty of this lens from straight lines is unknown.",
                "Give a lens as POST /motion saves it.",
                reason="bad-lens",
            ) from None
        return cls(bend, names, (covariance + covariance.T) / 2)

    @property
    def terms(self) -> tuple[str, ...]:
        return tuple(name for name in self.names if name not in CENTRE)


def read_distortion(
    model: str, settings: Mapping[str, Any], image_size: ImageSize
) -> DistortionEstimate | None:
    """Read the lens from straight lines in the options, None for any other; BadInput if it is not this model's,
    or of another picture."""
    given = settings.get("lens")
    if given is None or "unit" not in given.get("lens", {}):
        return None
    lens = DistortionEstimate.from_json(given["lens"])
    refuse_other_camera(
        lens.distortion.name, lens.distortion.image_size, model, image_size, "found"
    )
    return lens


def distortion_prior(lens: DistortionEstimate, settings: Mapping[str, Any]) -> GaussianPrior:
    """Return the prior of an estimate: fixed, or with its covariance."""
    own = dict(zip(lens.distortion.lens.TERMS, lens.distortion.terms, strict=True)) | dict(
        zip(CENTRE, lens.distortion.centre_px, strict=True)
    )
    prior = GaussianPrior.of(
        lens.names,
        np.array([own[name] for name in lens.names]),
        lens.covariance,
        lens.distortion.lens,
        lens.distortion.unit_px,
    )
    return (
        prior
        if settings.get("lens_sigma") == "own"
        else replace(prior, rows=prior.rows / FIXED_SIGMA)
    )


def with_distortion(state: RayCameraParameters, lens: DistortionEstimate) -> RayCameraParameters:
    """Return the state with that distortion at its focal length."""
    estimate = lens.distortion.terms_for(float(np.exp(state.log_focal)))
    return replace(
        state,
        terms=np.array([estimate.get(name, 0.0) for name in state.lens.TERMS]),
        centre_px=np.array(lens.distortion.centre_px),
    )
