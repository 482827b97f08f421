"""How requests and responses are described for the documentation: from a record, as a table of names, or as a file.

Routes send their JSON as it is; tests hold it to these descriptions.
"""

from collections.abc import Collection, Mapping
from types import GenericAlias
from typing import Annotated, Any, get_type_hints

from pydantic import BaseModel, ConfigDict, Field, create_model

from touchline import jobs
from touchline.core.json_values import JsonObject, SizeJson
from touchline.core.records import ObservationJson
from touchline.evaluate.report_types import SavedReport
from touchline.store import snapshots
from touchline.workflows.calibration import ModelParameters

BINARY = "application/octet-stream"


class Texts(BaseModel):
    """An object of texts, and what its sentences state beside them."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, str]
    statements: JsonObject = Field(default_factory=dict)


class Answer(BaseModel):
    """A JSON object to which entries may be added; none is ever renamed."""

    model_config = ConfigDict(extra="allow")


def response(
    name: str,
    base: type[Answer] = Answer,
    /,
    *,
    record: type | None = None,
    without: Collection[str] = (),
    says: bool = False,
    **types: Any,
) -> type[Answer]:
    """Describe a response: the fields of its record, a dataclass, and others by name and type; all required.

    says: whether it has sentences of its own, and so `statements` where they are known.
    """
    fields = {**(get_type_hints(record) if record is not None else {}), **types}
    described: dict[str, Any] = {
        field: (type, ...) for field, type in fields.items() if field not in without
    }
    if says:
        described["statements"] = (JsonObject, Field(default_factory=dict))
    return create_model(name, __base__=base, **described)


def described(type: Any, description: str) -> Any:
    """Return the type of a field with its description."""
    return Annotated[type, Field(description=description)]


def list_of(item: type) -> GenericAlias:
    """Return list[item], which a type checker reads only of classes that are written out."""
    return GenericAlias(list, (item,))


def page_of(name: str, item: type) -> type[Answer]:
    """Describe a page: items, newest first, and the cursor of those after them, null at the end."""
    return response(name, items=list_of(item), next_cursor=str | None)


Responses = dict[int | str, JsonObject]


def bytes_of(media_type: str) -> JsonObject:
    """Describe bytes as JSON Schema does (3.1), with the format that generators know (3.0)."""
    return {"schema": {"type": "string", "format": "binary", "contentMediaType": media_type}}


def files(*media_types: str) -> Responses:
    """Describe a response that is a file of one of these types."""
    return {200: {"content": {media_type: bytes_of(media_type) for media_type in media_types}}}


# Exports: bytes of any format; who needs one of the others as text or JSON asks for that format.
EXPORTED: Responses = {
    200: {
        "content": {
            **{
                media_type: bytes_of(media_type)
                for media_type in (BINARY, "application/x-protobuf")
            },
            **{
                media_type: {"schema": {"type": "string"}}
                for media_type in ("application/yaml", "text/csv", "text/plain")
            },
            "application/json": {"schema": {}},
        }
    }
}
PICTURE = files("image/png", "image/jpeg")
UNCHANGED: Responses = {304: {"description": "Unchanged: If-None-Match has its ETag"}}
HTML: Responses = {200: {"content": {"text/html": {"schema": {"type": "string"}}}}}


def upload(texts: Mapping[str, Any] | None = None, *, required: bool = True) -> JsonObject:
    """Describe a multipart body with a part "file" and other parts that are texts."""
    file = {**bytes_of(BINARY)["schema"], "description": "the file's bytes"}
    return {
        "required": required,
        "content": {
            "multipart/form-data": {
                "schema": {
                    "type": "object",
                    "required": ["file"],
                    "properties": {"file": file, **(texts or {})},
                }
            }
        },
    }


Job = response("Job", says=True, record=jobs.Job, without=("spec",))
ACCEPTED: Responses = {202: {"model": Job, "description": "a job: ?job=true"}}

Calibration = response(
    "Calibration",
    id=str,
    version=int,
    camera=str | None,
    field=str,
    region=str,
    rotate=int,
    model=ModelParameters,
    image_size=SizeJson,
    corrected_size=SizeJson,
    observations=list[ObservationJson],
    options=JsonObject,
    report=SavedReport,
    created_at=str,
    software=str,
    snapshot=str | None,
    image_sha256=str | None,
    parent=str | None,
    note=str,
    made_by=str,
    active=bool,
    field_definition=JsonObject,
)

LensSummary = response(
    "LensSummary",
    id=str,
    created_at=str,
    camera=str | None,
    note=str,
    model=str,
    board=JsonObject | None,
    image_size=list[int],
)
Lens = response(
    "Lens",
    LensSummary,
    lens=JsonObject,
    report=JsonObject,
    snapshots=list[str] | None,
    software=str,
)

Snapshot = response("Snapshot", record=snapshots.Snapshot)

FrameDetections = response(
    "FrameDetections",
    seq=int,
    time_s=float,
    items=list[JsonObject],
    stages=list[JsonObject],
    ms=float,
    notes=list[str],
    fps=float,
)
