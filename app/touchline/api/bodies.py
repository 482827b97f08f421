"""Read bodies of calls that take more than one kind: JSON or an uploaded file, JSON or binary points."""

import json
from typing import TypeVar

import numpy as np
from fastapi import Request
from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel, ValidationError
from starlette.datastructures import UploadFile

from touchline.core.errors import BadInput, ImageTooLarge
from touchline.core.geometry import Points, as_points
from touchline.core.statements import say

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
        raise RequestValidationError([{"type": "json_invalid", "loc": ("body",), "msg": "JSON decode error",
                                       "input": None}]) from None
    try:
        return schema.model_validate(value)
    except ValidationError as error:
        raise RequestValidationError([{**e, "loc": ("body", *e["loc"])} for e in error.errors()]) from None


async def uploaded_file(request: Request, max_bytes: int,
                        names: tuple[str, ...] = TEXTS) -> tuple[bytes, dict[str, str]]:
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
                raise BadInput(f"The part {name} is a file.", f"Send {name} as text.", reason="bad-request")
            texts[name] = text
        data = await file.read(max_bytes + 1)
    if len(data) > max_bytes:
        raise ImageTooLarge(say("upload.too-large", "The file has more than {most_mb:.0f} MB.",
                                most_mb=max_bytes / 1e6), say("upload.smaller", "Send a smaller image."))
    return data, texts


async def binary_points(request: Request) -> Points:
    """Return (n, 2) points from little-endian float64 pairs."""
    data = await request.body()
    if len(data) % 16:
        raise BadInput(f"{len(data)} bytes are not pairs of float64 values.",
                       "Send 16 bytes per point: x and y, little-endian.",
                       reason="bad-points")
    return as_points(np.frombuffer(data, "<f8").reshape(-1, 2))
