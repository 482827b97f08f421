"""/drafts: an operator's work in progress, so that a reload loses nothing and nobody overwrites another's."""

from typing import Annotated

from fastapi import APIRouter, Header, Request, WebSocket
from starlette.responses import Response

from app.api.answers import Json
from app.api.middleware.problems import problem, stale_problem
from app.api.operator import LONGEST, operator
from app.api.schemas import requests, responses
from app.api.schemas.requests import Id
from app.api.sockets import tell
from app.core.errors import Stale
from app.store import Draft

router = APIRouter(prefix="/drafts", tags=["drafts"])


@router.get("/{snapshot}", response_model=responses.Draft)
def read_draft(request: Request, snapshot: Id) -> Json:
    """The draft as it was saved last, or an empty one; its ETag goes into the next PUT's If-Match."""
    return _answer(request.app.state.store.drafts.get(snapshot))


@router.put("/{snapshot}", response_model=responses.Draft)
def save_draft(request: Request, snapshot: Id, body: requests.Draft,
         if_match: Annotated[str | None, Header(max_length=200)] = None) -> Response:
    """Save over the draft that If-Match names: 428 without it, 412 with the `current` draft if somebody was faster."""
    store = request.app.state.store
    store.snapshots.get(snapshot)
    if if_match is None:
        return problem(428, "if-match-needed", "If-Match needed", "The request does not say which draft it was made "
                       "from.", "Send the ETag of GET as If-Match.")
    try:
        draft = store.drafts.save(snapshot, body.model_dump(), if_match.strip().removeprefix("W/").strip('"'),
                                 operator(request))
        request.app.state.presence.saved(snapshot, draft.etag, operator(request))
    except Stale as error:
        return stale_problem(error)
    return _answer(draft)


@router.websocket("/{snapshot}/stream")
async def watch_draft(socket: WebSocket, snapshot: str, name: str = "") -> None:
    """Who else has this picture open, and the ETag of the draft as soon as somebody has saved it: JSON texts.

    {"others": [name, …], "etag": "…" | null, "by": name | null}, now and after every change; with name=, what others
    read of you.
    """
    await tell(socket, socket.app.state.presence.told(snapshot[:LONGEST], name.strip()[:LONGEST]))


def _answer(draft: Draft) -> Json:
    return Json(draft.to_json(), headers={"ETag": f'"{draft.etag}"', "Cache-Control": "no-store"})
