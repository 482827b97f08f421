"""How a scene is viewed: what the page may set; never stored."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

LAYERS = ("pictures", "rays", "arrows", "footprints", "labels", "moved", "things")
VIEWS = ("free", "above", "camera")


@dataclass(frozen=True)
class ViewState:
    """layers: the visible ones. sheet: which expected error. scale: of arrows, None for a well visible one. hidden:
    cameras left out. view: the viewpoint; through: its camera, for the view "camera"."""

    layers: frozenset[str] = frozenset(LAYERS) - {"rays", "things"}
    sheet: str = "none"
    scale: float | None = None
    dark: bool = True
    hidden: frozenset[str] = frozenset()
    view: str = "free"
    through: str = ""

    def changed(self, given: Mapping[str, Any]) -> Self:
        """Return the state with these changes, which the API schema has validated."""
        changes = {name: value for name, value in given.items() if value is not None}
        layers, hidden = (frozenset(changes.pop(name, getattr(self, name))) for name in ("layers", "hidden"))
        return replace(self, layers=layers, hidden=hidden, **changes)
