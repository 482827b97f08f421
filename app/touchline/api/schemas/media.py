"""OpenAPI descriptions of responses and bodies that are files."""

from collections.abc import Mapping
from typing import Any

BINARY = "application/octet-stream"
BYTES = {"schema": {"type": "string", "format": "binary"}}
Responses = dict[int | str, dict[str, Any]]


def files(*media_types: str) -> Responses:
    """Describe a response that is a file of one of these types."""
    return {200: {"content": {media_type: BYTES for media_type in media_types}}}


PICTURE = files("image/png", "image/jpeg")
UNCHANGED: Responses = {304: {"description": "Unchanged: If-None-Match has its ETag"}}
HTML: Responses = {200: {"content": {"text/html": {"schema": {"type": "string"}}}}}


def upload(texts: Mapping[str, Any] | None = None, *, required: bool = True) -> dict[str, Any]:
    """Describe a multipart body with a part "file" and other parts that are texts."""
    return {"required": required, "content": {"multipart/form-data": {"schema": {
        "type": "object", "required": ["file"], "properties": {"file": BYTES["schema"], **(texts or {})}}}}}
