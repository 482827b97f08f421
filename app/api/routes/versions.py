"""/calibrations: which versions were active when, a note beside a version, and a deletion undone."""

from typing import Annotated, Any

from fastapi import APIRouter, Query

from app.api.dependencies import ServicesDep
from app.api.responses import Json
from app.api.schemas import responses
from app.api.schemas.requests import Id, IdQuery
from app.core.errors import TouchlineError
from app.services.value_types import Note, Strict
from app.store import Store

router = APIRouter(prefix="/calibrations", tags=["calibrations"])


class NoteChange(Strict):
    note: Note


@router.get("/activations", response_model=responses.Activations)
def list_activations(services: ServicesDep, camera: Annotated[IdQuery | None, Query()] = None) -> Json:
    """List activations of a camera, when and by whom, newest first; without a camera, for pictures from files."""
    store = services.store
    history = store.calibrations.history(camera)
    versions = {id: _version(store, id) for id in {row["calibration"] for row in history}}
    return Json({"items": [{**row, "version": versions[row["calibration"]]} for row in history]})


@router.patch("/{id}", response_model=responses.Calibration)
def change_note(services: ServicesDep, id: Id, body: NoteChange) -> Json:
    """Change the note beside a version: nothing else of it ever changes."""
    return Json(services.store.calibrations.annotate(id, body.note).to_json())


@router.post("/{id}/restore", response_model=responses.Calibration)
def restore_calibration(services: ServicesDep, id: Id) -> Json:
    """Undo a deletion: the version is there again under its number."""
    return Json(services.store.calibrations.restore(id).to_json())


def _version(store: Store, id: str) -> Any:
    try:
        return store.calibrations.get(id).version
    except TouchlineError:  # deleted, or damaged: the history says that it was, all the same
        return None
