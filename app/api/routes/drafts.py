"""/drafts: an operator's work in progress, so that a reload loses nothing and nobody overwrites another's."""

from fastapi import APIRouter, WebSocket
from starlette.responses import Response

from app.api.dependencies import MAX_NAME, IfMatch, IfMatchNeeded, OperatorDep, ServicesDep
from app.api.responses import Json, versioned
from app.api.schemas import requests, responses
from app.api.schemas.requests import Id
from app.api.sockets import send_stream

router = APIRouter(prefix="/drafts", tags=["drafts"])


@router.get("/{snapshot}", response_model=responses.Draft)
def read_draft(services: ServicesDep, snapshot: Id) -> Json:
    """Return the draft that was saved last, or an empty one; its ETag goes into the next PUT's If-Match."""
    draft = services.store.drafts.get(snapshot)
    return versioned(draft.to_json(), draft.etag)


@router.put("/{snapshot}", response_model=responses.Draft)
def save_draft(services: ServicesDep, by: OperatorDep, snapshot: Id, body: requests.DraftBody,
               if_match: IfMatch = None) -> Response:
    """Replace the draft that If-Match names: 428 without it, 412 with the `current` draft if somebody was faster."""
    services.store.snapshots.get(snapshot)
    if if_match is None:
        raise IfMatchNeeded("The request does not say which draft it was made from.")
    draft = services.store.drafts.save(snapshot, body.model_dump(), if_match, by)
    services.presence.saved(snapshot, draft.etag, by)
    return versioned(draft.to_json(), draft.etag)


@router.websocket("/{snapshot}/stream")
async def watch_draft(socket: WebSocket, services: ServicesDep, snapshot: str, name: str = "") -> None:
    """Send who else has this picture open, and the ETag of the draft as soon as somebody has saved it, as JSON.

    {"others": [name, …], "etag": "…" | null, "by": name | null}, now and after every change; with name=, what others
    read of you.
    """
    await send_stream(socket, services.presence.changes(snapshot[:MAX_NAME], name.strip()[:MAX_NAME]))
