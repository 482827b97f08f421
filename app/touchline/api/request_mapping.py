"""From a checked request to what is computed with: names become fields, ids become snapshots and lenses."""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from typing import Any

from touchline.api.schemas.requests import FitRequest
from touchline.core.errors import BadInput, Conflict, NotFound
from touchline.core.geometry import ImageSize
from touchline.core.records import observations_from_json
from touchline.services.container import Services
from touchline.store.store import Store
from touchline.workflows.calibration_request import CalibrationRequest


def fit_task(services: Services, body: FitRequest, models: Iterable[str]) -> CalibrationRequest:
    """Return the task that a fit's body describes, to be fitted by `models`; say which name or size does not fit."""
    field = services.fields[body.field]
    region = field.region(body.region, body.rotate)
    snapshot = services.store.snapshots.get(body.snapshot) if body.snapshot is not None else None
    given = image_size(body.image_size)
    size = given if snapshot is None else snapshot.size
    if size is None:
        raise BadInput("The request has neither a snapshot nor an image size.", 'Send "snapshot" or "image_size".',
                       reason="no-image-size")
    if given is not None and given != size:
        raise Conflict(f"The snapshot is {size}, not {given}.", "Omit image_size.", reason="size-mismatch")
    observations = observations_from_json([form.model_dump() for form in body.observations])
    task = CalibrationRequest(
        observations, field, region, size, body.model, with_lens(services, body.options),
        camera=body.camera or (snapshot.camera if snapshot else None), snapshot=snapshot.id if snapshot else None,
        image_sha256=snapshot.sha256 if snapshot else None, note=body.note)
    task.check_names(models)
    return task


def with_lens(services: Services, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return a fit's options with the lens itself where its id is given, so that the calibration contains it."""
    lens = options.get("lens")
    return {**options, "lens": _lens_option(services.store, lens)} if isinstance(lens, str) else dict(options)


def _lens_option(store: Store, id: str) -> dict[str, Any]:
    with suppress(NotFound):
        return {"id": id, **store.calibrations.get(id).lens_option()}
    with suppress(NotFound):
        lens = store.lenses.get(id)
        return {"id": id, "name": lens["model"], "lens": lens["lens"]}
    raise NotFound(f"There is no calibration or lens {id!r}.",
                   "List them with GET /api/v1/calibrations and GET /api/v1/lenses.", reason="unknown-lens")


def image_size(size: list[int] | None) -> ImageSize | None:
    return None if size is None else ImageSize.of(size)


def pictures_of_one_size(services: Services, ids: Sequence[str], size: ImageSize | None,
                         fix: str) -> Sequence[dict[str, str]]:
    """Return snapshots as jobs read them; Conflict where they are of several sizes, or of another than was given."""
    sizes = {services.store.snapshots.get(id).size for id in ids} | ({size} if size is not None else set())
    if len(sizes) > 1:
        raise Conflict(f"The images have different sizes: {' and '.join(sorted(map(str, sizes)))}.", fix,
                       reason="size-mismatch")
    return services.store.snapshots.all_for_job(ids)
