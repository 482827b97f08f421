"""What a page sends to its 3-D scene: what is shown, and how it is viewed."""

import json
from typing import Annotated, Literal

from pydantic import Field, StringConstraints, ValidationError

from app.core.errors import BadInput
from app.services.value_types import Strict

MAX_MESSAGE = 20_000  # characters
MAX_CAMERAS = 16
SceneName = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$")]
Layer = Literal["pictures", "rays", "arrows", "footprints", "labels", "moved", "things"]


class SceneShow(Strict):
    """calibrations, or a rig by its name, or a lens from a board; before: an older version to see what moved."""

    calibrations: Annotated[list[SceneName], Field(min_length=1, max_length=MAX_CAMERAS)] | None = None
    rig: SceneName | None = None
    lens: SceneName | None = None
    before: SceneName | None = None
    live: bool = True
    fps: Annotated[float, Field(ge=0.1, le=5)] = 5.0  # of live pictures; a slow viewer that gets too many shows none


class SceneSet(Strict):
    """How the scene is viewed: see app/scene/view_state.py."""

    layers: Annotated[list[Layer], Field(max_length=16)] | None = None
    hidden: Annotated[list[SceneName], Field(max_length=MAX_CAMERAS)] | None = None
    sheet: Literal["none", "carpet", "hat"] | None = None
    scale: Annotated[float, Field(ge=0.1, le=1000)] | None = None
    dark: bool | None = None
    view: Literal["free", "above", "camera"] | None = None
    through: Annotated[str, Field(max_length=64)] | None = None


class SceneMessage(Strict):
    """One message: either, or both."""

    show: SceneShow | None = None
    set: SceneSet | None = None


def parse_message(text: str) -> SceneMessage:
    """Return the message; BadInput for anything else."""
    try:
        if len(text) > MAX_MESSAGE:
            raise ValueError("too long")
        return SceneMessage.model_validate(json.loads(text))
    except (ValidationError, ValueError, RecursionError):
        raise BadInput("This is not what can be said to a scene.", 'Say {"show": {"calibrations": [id]}} or {"set": '
                       '{"view": "above"}}.', reason="bad-request") from None
