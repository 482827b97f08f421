"""The camera that a format can hold: the calibration's own where it knows the lens, else the nearest and its error."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import lru_cache

from touchline.core.errors import Conflict
from touchline.core.field import Region
from touchline.core.records import Calibration
from touchline.evaluate.fit.approximation import ApproximationError, approximate_camera, approximation_error
from touchline.formats import Format
from touchline.models import CameraModel
from touchline.models.ray_camera import RayCamera, lens_model
from touchline.models.restored import Restored

NO_WORSE = 1.05  # a lens with fewer terms is preferred unless richer ones are nearer by more than this
NO_WORSE_MM = 1e-6
TERM_LADDER = (("k1", "k2"), ("k1", "k2", "p1", "p2"), ("k1", "k2", "p1", "p2", "k3"))  # before a lens's all


@dataclass(frozen=True)
class ExportCamera:
    """The camera to write. loss: of an approximation, else None. camera_id: for formats that number cameras."""

    camera: RayCamera
    loss: ApproximationError | None = None
    camera_id: int | None = None


def export_camera(calibration: Calibration, format: Format, approximate: bool,
                  camera_id: int | None = None) -> ExportCamera:
    """Return the camera as the format can hold it; Conflict where that takes `approximate`."""
    model, field, region = Restored.of(calibration)
    own = exact_camera(model, format.lenses, format.square_pixels)
    if own is not None:
        return ExportCamera(own, None, camera_id)
    if not approximate:
        raise _cannot_hold(model, format)
    camera, loss = nearest_camera(model, tuple(format.lenses.items()), format.square_pixels, region,
                                  field.hat_height_mm)
    return ExportCamera(camera, loss, camera_id)


def exact_camera(model: CameraModel, lenses: Mapping[str, tuple[str, ...]], square: bool) -> RayCamera | None:
    """Return the model as a camera with exactly one of these lenses; None where there is none."""
    if not isinstance(model, RayCamera) or (square and model.aspect != 1):
        return None
    terms = dict(zip(model.LENS.TERMS, model.lens_terms, strict=True))
    if model.NAME in lenses and not any(v for name, v in terms.items() if name not in lenses[model.NAME]):
        return model
    plain = next((name for name in lenses if name != "fisheye"), None)
    if plain is None or model.NAME == "fisheye" or any(terms.values()):
        return None
    family = lens_model(plain)  # without distortion, all lenses but the fisheye are one
    return family(**{**{f.name: getattr(model, f.name) for f in fields(model)},
                     "lens_terms": (0.0,) * len(family.LENS.TERMS)})


@lru_cache(maxsize=64)
def nearest_camera(model: CameraModel, lenses: tuple[tuple[str, tuple[str, ...]], ...], square: bool, region: Region,
            hat_height_mm: float) -> tuple[RayCamera, ApproximationError]:
    """Return the nearest camera with one of these lenses and as few terms as suffice, and its error."""
    found = []
    for name, terms in lenses:
        family = lens_model(name)
        for chosen in dict.fromkeys([*(rung for rung in TERM_LADDER if set(rung) < set(terms)), terms]):
            try:
                camera = approximate_camera(model, family, chosen, region, hat_height_mm, square=square)
                found.append((camera, approximation_error(model, camera, region, hat_height_mm)))
            except Conflict:
                continue
    if not found:
        raise Conflict("No lens of this format is close to this calibration over its covered area.",
                       "Fit brown-conrady to the same points, and export that version.", reason="no-approximation")
    best = min(loss.worst_at_any_height_mm for _, loss in found)
    return next((c, loss) for c, loss in found if loss.worst_at_any_height_mm <= NO_WORSE * best + NO_WORSE_MM)


def _cannot_hold(model: CameraModel, format: Format) -> Conflict:
    known = ", ".join(format.lenses)
    if not isinstance(model, RayCamera):
        return Conflict(f"{format.title} requires a physical lens model. {model.TITLE} is not one.",
                        f"Fit {next(iter(format.lenses))} to the same points, or use approximate=true: the nearest "
                        "camera over the covered area, with its error in mm.", reason="format-cannot-hold")
    why = "pixels that are not square" if format.square_pixels and model.NAME in format.lenses else "this lens"
    return Conflict(f"{format.title} cannot represent {why} ({model.TITLE}, {', '.join(model.LENS.TERMS)}).",
                    f"Fit {known} to the same points, or use approximate=true: the nearest lens over the covered "
                    "area, with its error in mm.", reason="format-cannot-hold")
