"""From a checked request to what the floors below work with: names become fields, ids become snapshots."""

from collections.abc import Iterable

from fastapi import Request

from app.api.schemas.requests import FitRequest
from app.core.errors import BadInput, Conflict
from app.core.geometry import ImageSize
from app.core.records import observations_from_json
from app.services.lens_options import lens_option
from app.workflows.calibration_request import CalibrationRequest


def task_of(request: Request, body: FitRequest, models: Iterable[str]) -> CalibrationRequest:
    """The task that a fit's body describes, to be fitted by `models`; says which name or size does not fit."""
    state = request.app.state
    field = state.fields[body.field]
    region = field.region(body.region, body.rotate)
    snapshot = state.store.snapshots.get(body.snapshot) if body.snapshot is not None else None
    given = ImageSize.of(body.image_size) if body.image_size is not None else None
    if snapshot is None and given is None:
        raise BadInput("Neither a snapshot nor a picture size is given.", 'Send "snapshot" or "image_size".',
                       reason="no-image-size")
    if snapshot is not None and given is not None and given != snapshot.size:
        raise Conflict(f"The snapshot is {snapshot.size.width} × {snapshot.size.height} px, not {given.width} × "
                       f"{given.height} px.", "Leave image_size out.", reason="size-mismatch")
    options = {**body.options}
    if isinstance(options.get("lens"), str):  # by its id: the fit is given the lens itself, and keeps it
        options["lens"] = lens_option(state.store, options["lens"])
    task = CalibrationRequest(observations_from_json([o.model_dump(exclude_defaults=False) for o in body.observations]),
                              field, region, snapshot.size if snapshot else given, body.model, options,
                              camera=body.camera or (snapshot.camera if snapshot else None), snapshot=snapshot.id if
                              snapshot else None, image_sha256=snapshot.sha256 if snapshot else None, note=body.note)
    task.check_names(models)
    return task
