"""What a page may say on the line of a scene: what is shown, and how it is looked at."""

import json
from typing import Annotated, Literal

from pydantic import Field, StringConstraints, ValidationError

from app.api.schemas.requests import Strict
from app.core.errors import BadInput

LONGEST_WORD = 20_000  # characters
MOST_CAMERAS = 16
Word = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$")]
Layer = Literal["pictures", "rays", "arrows", "footprints", "labels", "moved", "things"]


class SceneShow(Strict):
    """calibrations, or a rig by its name, or a lens from a board; before: an older version to see what moved."""

    calibrations: Annotated[list[Word], Field(min_length=1, max_length=MOST_CAMERAS)] | None = None
    rig: Word | None = None
    lens: Word | None = None
    before: Word | None = None
    live: bool = True
    fps: Annotated[float, Field(ge=0.1, le=5)] = 5.0  # of live pictures; a slow viewer that gets too many shows none


class SceneSet(Strict):
    """See app/scene/view_state.py."""

    layers: Annotated[list[Layer], Field(max_length=16)] | None = None
    hidden: Annotated[list[Word], Field(max_length=MOST_CAMERAS)] | None = None
    sheet: Literal["none", "carpet", "hat"] | None = None
    scale: Annotated[float, Field(ge=0.1, le=1000)] | None = None
    dark: bool | None = None
    view: Literal["free", "above", "camera"] | None = None
    through: Annotated[str, Field(max_length=64)] | None = None


class SceneWord(Strict):
    """One message: either, or both."""

    show: SceneShow | None = None
    set: SceneSet | None = None


def read_word(text: str) -> SceneWord:
    """BadInput for anything else."""
    try:
        if len(text) > LONGEST_WORD:
            raise ValueError("too long")
        return SceneWord.model_validate(json.loads(text))
    except (ValidationError, ValueError, RecursionError):
        raise BadInput("This is not what can be said to a scene.", 'Say {"show": {"calibrations": [id]}} or {"set": '
                       '{"view": "above"}}.', reason="bad-request") from None
