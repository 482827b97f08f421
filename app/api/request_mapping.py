"""From a checked request to what is computed with: names become fields, ids become snapshots and lenses."""

from collections.abc import Iterable, Mapping
from typing import Any

from app.api.schemas.requests import FitRequest
from app.core.errors import BadInput, Conflict
from app.core.geometry import ImageSize
from app.core.records import observations_from_json
from app.services.container import Services
from app.services.lens_options import lens_option
from app.workflows.calibration_request import CalibrationRequest


def fit_task(services: Services, body: FitRequest, models: Iterable[str]) -> CalibrationRequest:
    """Return the task that a fit's body describes, to be fitted by `models`; say which name or size does not fit."""
    field = services.fields[body.field]
    region = field.region(body.region, body.rotate)
    snapshot = services.store.snapshots.get(body.snapshot) if body.snapshot is not None else None
    size = image_size(body.image_size)
    if snapshot is None and size is None:
        raise BadInput("Neither a snapshot nor a picture size is given.", 'Send "snapshot" or "image_size".',
                       reason="no-image-size")
    if snapshot is not None and size is not None and size != snapshot.size:
        raise Conflict(f"The snapshot is {snapshot.size.width} × {snapshot.size.height} px, not {size.width} × "
                       f"{size.height} px.", "Leave image_size out.", reason="size-mismatch")
    observations = observations_from_json([form.model_dump() for form in body.observations])
    task = CalibrationRequest(
        observations, field, region, snapshot.size if snapshot else size, body.model, with_lens(services, body.options),
        camera=body.camera or (snapshot.camera if snapshot else None), snapshot=snapshot.id if snapshot else None,
        image_sha256=snapshot.sha256 if snapshot else None, note=body.note)
    task.check_names(models)
    return task


def with_lens(services: Services, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return a fit's options with the lens itself where its id is given, so that the calibration contains it."""
    lens = options.get("lens")
    return {**options, "lens": lens_option(services.store, lens)} if isinstance(lens, str) else dict(options)


def image_size(size: list[int] | None) -> ImageSize | None:
    return None if size is None else ImageSize.of(size)
