"""OpenAPI descriptions of responses and bodies that are files."""

from collections.abc import Mapping
from typing import Any

from touchline.core.json_values import JsonObject

BINARY = "application/octet-stream"
Responses = dict[int | str, JsonObject]


def bytes_of(media_type: str) -> JsonObject:
    """Describe bytes as JSON Schema does (3.1), with the format that generators know (3.0)."""
    return {"schema": {"type": "string", "format": "binary", "contentMediaType": media_type}}


def files(*media_types: str) -> Responses:
    """Describe a response that is a file of one of these types."""
    return {200: {"content": {media_type: bytes_of(media_type) for media_type in media_types}}}


# Exports: bytes of any format; who needs one of the others as text or JSON asks for that format.
EXPORTED: Responses = {200: {"content": {
    **{media_type: bytes_of(media_type) for media_type in (BINARY, "application/x-protobuf")},
    **{media_type: {"schema": {"type": "string"}} for media_type in ("application/yaml", "text/csv", "text/plain")},
    "application/json": {"schema": {}}}}}
PICTURE = files("image/png", "image/jpeg")
UNCHANGED: Responses = {304: {"description": "Unchanged: If-None-Match has its ETag"}}
HTML: Responses = {200: {"content": {"text/html": {"schema": {"type": "string"}}}}}


def upload(texts: Mapping[str, Any] | None = None, *, required: bool = True) -> JsonObject:
    """Describe a multipart body with a part "file" and other parts that are texts."""
    file = {**bytes_of(BINARY)["schema"], "description": "the file's bytes"}
    return {"required": required, "content": {"multipart/form-data": {"schema": {
        "type": "object", "required": ["file"], "properties": {"file": file, **(texts or {})}}}}}
