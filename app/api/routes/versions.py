"""What an operator does with versions besides making them: their history, a note, and a deletion taken back."""

from typing import Annotated, Any

from fastapi import APIRouter, Query, Request
from pydantic import Field

from app.api.answers import Json
from app.api.schemas import responses
from app.api.schemas.requests import Id, IdQuery, Strict
from app.api.schemas.responses.base import Answer
from app.core.errors import TouchlineError
from app.store import Store

router = APIRouter(prefix="/calibrations", tags=["calibrations"])


class NoteChange(Strict):
    note: Annotated[str, Field(max_length=2000)]


class Activation(Answer):
    """version: null where the version was deleted since."""

    calibration: str
    version: int | None
    at: str
    by: str


class Activations(Answer):
    items: list[Activation]


@router.get("/activations", response_model=Activations)
def list_activations(request: Request, camera: Annotated[IdQuery | None, Query()] = None) -> Json:
    """What was activated for a camera, when and by whom, newest first; without a camera, for pictures from files."""
    store: Store = request.app.state.store
    history = store.calibrations.history(camera)
    versions = {id: _version(store, id) for id in {row["calibration"] for row in history}}
    return Json({"items": [{**row, "version": versions[row["calibration"]]} for row in history]})


@router.patch("/{id}", response_model=responses.Calibration)
def change_note(request: Request, id: Id, body: NoteChange) -> Json:
    """Change the note beside a version: all that is ever changed of one."""
    return Json(request.app.state.store.calibrations.annotate(id, body.note).to_json())


@router.post("/{id}/restore", response_model=responses.Calibration)
def restore_calibration(request: Request, id: Id) -> Json:
    """Take a deletion back, as often as you like: the version is there again under its number."""
    return Json(request.app.state.store.calibrations.restore(id).to_json())


def _version(store: Store, id: str) -> Any:
    try:
        return store.calibrations.get(id).version
    except TouchlineError:  # deleted, or damaged: the history says that it was, all the same
        return None
