"""Read bodies of more than one kind, and look up what a checked request names: fields, snapshots, lenses."""

import json
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from typing import Any, TypeVar

import numpy as np
from fastapi import Request
from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel, ValidationError
from starlette.datastructures import UploadFile

from touchline.api.requests import FitRequest
from touchline.core.errors import BadInput, Conflict, ImageTooLarge, NotFound
from touchline.core.geometry import ImageSize, Points, as_points
from touchline.core.records import observations_from_json
from touchline.core.statements import say
from touchline.services.container import Services
from touchline.store.store import Store
from touchline.workflows.calibration_request import CalibrationRequest

TEXTS = ("camera", "purpose")
FILE_FIX = 'Send multipart/form-data with the image as the part named "file".'
Body = TypeVar("Body", bound=BaseModel)


def content_type(request: Request) -> str:
    """Return the body's media type without its parameters, in lower case."""
    return request.headers.get("content-type", "").partition(";")[0].strip().lower()


async def json_body(request: Request, schema: type[Body]) -> Body:
    """Return the JSON body, checked against its schema."""
    try:
        value = json.loads(await request.body())
    except (ValueError, RecursionError):
        raise RequestValidationError(
            [{"type": "json_invalid", "loc": ("body",), "msg": "JSON decode error", "input": None}]
        ) from None
    try:
        return schema.model_validate(value)
    except ValidationError as error:
        raise RequestValidationError(
            [{**e, "loc": ("body", *e["loc"])} for e in error.errors()]
        ) from None


async def uploaded_file(
    request: Request, max_bytes: int, names: tuple[str, ...] = TEXTS
) -> tuple[bytes, dict[str, str]]:
    """Return the part "file", and the texts of the named parts, "" if missing; under "file" the file's own name."""
    async with request.form(max_files=1, max_fields=len(names) + 2, max_part_size=4096) as form:
        file = form.get("file")
        if not isinstance(file, UploadFile):
            raise BadInput(say("upload.no-file", "No file was sent."), FILE_FIX, reason="no-file")
        for name in form:
            if name not in ("file", *names):
                raise BadInput("The form has an unknown part.", FILE_FIX, reason="bad-request")
        texts = {"file": (file.filename or "")[:200]}
        for name in names:
            text = form.get(name, "")
            if not isinstance(text, str):
                raise BadInput(
                    f"The part {name} is a file.", f"Send {name} as text.", reason="bad-request"
                )
            texts[name] = text
        data = await file.read(max_bytes + 1)
    if len(data) > max_bytes:
        raise ImageTooLarge(
            say(
                "upload.too-large",
                "The file has more than {most_mb:.0f} MB.",
                most_mb=max_bytes / 1e6,
            ),
            say("upload.smaller", "Send a smaller image."),
        )
    return data, texts


async def binary_points(request: Request) -> Points:
    """Return (n, 2) points from little-endian float64 pairs."""
    data = await request.body()
    if len(data) % 16:
        raise BadInput(
            f"{len(data)} bytes are not pairs of float64 values.",
            "Send 16 bytes per point: x and y, little-endian.",
            reason="bad-points",
        )
    return as_points(np.frombuffer(data, "<f8").reshape(-1, 2))


def fit_task(services: Services, body: FitRequest, models: Iterable[str]) -> CalibrationRequest:
    """Return the task that a fit's body describes, to be fitted by `models`; say which name or size does not fit."""
    field = services.fields[body.field]
    region = field.region(body.region, body.rotate)
    snapshot = services.store.snapshots.get(body.snapshot) if body.snapshot is not None else None
    given = image_size(body.image_size)
    size = given if snapshot is None else snapshot.size
    if size is None:
        raise BadInput(
            "The request has neither a snapshot nor an image size.",
            'Send "snapshot" or "image_size".',
            reason="no-image-size",
        )
    if given is not None and given != size:
        raise Conflict(
            f"The snapshot is {size}, not {given}.", "Omit image_size.", reason="size-mismatch"
        )
    observations = observations_from_json([form.model_dump() for form in body.observations])
    task = CalibrationRequest(
        observations,
        field,
        region,
        size,
        body.model,
        with_lens(services, body.options),
        camera=body.camera or (snapshot.camera if snapshot else None),
        snapshot=snapshot.id if snapshot else None,
        image_sha256=snapshot.sha256 if snapshot else None,
        note=body.note,
    )
    task.check_names(models)
    return task


def with_lens(services: Services, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return a fit's options with the lens itself where its id is given, so that the calibration contains it."""
    lens = options.get("lens")
    return (
        {**options, "lens": _lens_option(services.store, lens)}
        if isinstance(lens, str)
        else dict(options)
    )


def _lens_option(store: Store, id: str) -> dict[str, Any]:
    with suppress(NotFound):
        return {"id": id, **store.calibrations.get(id).lens_option()}
    with suppress(NotFound):
        lens = store.lenses.get(id)
        return {"id": id, "name": lens["model"], "lens": lens["lens"]}
    raise NotFound(
        f"There is no calibration or lens {id!r}.",
        "List them with GET /api/v1/calibrations and GET /api/v1/lenses.",
        reason="unknown-lens",
    )


def image_size(size: list[int] | None) -> ImageSize | None:
    return None if size is None else ImageSize.of(size)


def pictures_of_one_size(
    services: Services, ids: Sequence[str], size: ImageSize | None, fix: str
) -> Sequence[dict[str, str]]:
    """Return snapshots as jobs read them; Conflict where they are of several sizes, or of another than was given."""
    sizes = {services.store.snapshots.get(id).size for id in ids} | (
        {size} if size is not None else set()
    )
    if len(sizes) > 1:
        raise Conflict(
            f"The images have different sizes: {' and '.join(sorted(map(str, sizes)))}.",
            fix,
            reason="size-mismatch",
        )
    return services.store.snapshots.all_for_job(ids)
