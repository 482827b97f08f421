"""How a scene is looked at: what the page may set, and nothing of it is ever kept."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

LAYERS = ("pictures", "rays", "arrows", "footprints", "labels", "moved", "things")
SHEETS = ("none", "carpet", "hat")
VIEWS = ("free", "above", "camera")


@dataclass(frozen=True)
class Look:
    """layers: those that are seen. sheet: which expected error. scale: of residuals and of what moved, None for one at
    which they are well seen. hidden: cameras. view and through: from where it is looked at, and by which camera."""

    layers: frozenset[str] = frozenset(LAYERS) - {"rays", "things"}
    sheet: str = "none"
    scale: float | None = None
    dark: bool = True
    hidden: frozenset[str] = frozenset()
    view: str = "free"
    through: str = ""

    def changed(self, given: Mapping[str, Any]) -> Self:
        """With what was given; api/scene_schemas.py has looked at it."""
        sets = {name: frozenset(given[name]) for name in ("layers", "hidden") if given.get(name) is not None}
        plain = {name: given[name] for name in ("sheet", "scale", "dark", "view", "through")
                 if given.get(name) is not None}
        return replace(self, **plain, **sets)
