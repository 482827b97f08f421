"""An operator's clicks on the reference camera, and how far a fit is from the truth: for tests and benchmarks."""

import numpy as np

from tests.support.reference_camera import SIZE, reference_camera, reference_field
from tests.support.sim_clicks import border_observations, known_grid, rms_mm
from touchline.core.geometry import as_triple
from touchline.core.records import Fit, Observation
from touchline.fitting import FITTERS
from touchline.models import field_from_raw
from touchline.models.ray_camera import BrownConrady
from touchline.models.rotation import vector_from_matrix

FIELD = reference_field()
REGION = FIELD.regions["full"]
TAPE_SIGMA_MM = 30.0


def taped(camera, rng) -> dict:
    """The camera's height as a tape tells it."""
    return {
        "value": camera.position_mm[2] + float(rng.normal(0, TAPE_SIGMA_MM)),
        "sigma": TAPE_SIGMA_MM,
    }


def fitted(
    camera,
    seed: int,
    model: str = "brown-conrady",
    noise_px: float = 0.3,
    tape: bool = True,
    extra: tuple[Observation, ...] = (),
    **options,
) -> Fit:
    """36 clicks anywhere along the four borders, and what else is given."""
    rng = np.random.default_rng(seed)
    observations = (*border_observations(camera, REGION, 9, noise_px, rng, anywhere=True), *extra)
    if tape:
        options["height_mm"] = taped(camera, rng)
    return FITTERS[model].fit(observations, FIELD, REGION, SIZE, options)


def carpet_and_hat_mm(fit: Fit, camera) -> tuple[float, float]:
    """Field error rms over a 21 × 17 grid, on the carpet and 150 mm above it."""
    raw, truth = known_grid(camera, REGION, 21, 17)
    hat, _ = known_grid(camera, REGION, 21, 17, 150.0)
    return rms_mm(field_from_raw(fit.model, raw), truth), rms_mm(
        fit.model.unproject(hat, 150.0), truth
    )


def true_camera(camera) -> BrownConrady:
    """The simulated camera as a model of ours."""
    lens = camera.lens
    terms = (lens.k1, lens.k2, lens.p1, lens.p2, lens.k3, 0.0, 0.0, 0.0)
    return BrownConrady(
        lens_terms=terms,
        focal_px=camera.focal_px[0],
        aspect=1.0,
        centre_px=camera.centre_px,
        rotation=as_triple(vector_from_matrix(np.array(camera.camera_from_field))),
        position_mm=camera.position_mm,
        width_px=1280.0,
        height_px=960.0,
        n_rectangles_x=10,
        n_rectangles_y=8,
        region=REGION,
        image_size=SIZE,
    )


__all__ = [
    "FIELD",
    "REGION",
    "SIZE",
    "carpet_and_hat_mm",
    "fitted",
    "reference_camera",
    "taped",
    "true_camera",
]
