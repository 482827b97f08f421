"""The lens that a fit takes over, from a calibration or from pictures of a board."""

from contextlib import suppress
from typing import Any

from app.core.errors import NotFound
from app.store import Store


def lens_option(store: Store, id: str) -> dict[str, Any]:
    """Return a fit's option `lens` by the id of the calibration or of the board's lens that has it; NotFound."""
    with suppress(NotFound):
        calibration = store.calibrations.get(id)
        return {"id": id, **calibration.lens_option()}
    with suppress(NotFound):
        lens = store.lenses.get(id)
        return {"id": id, "name": lens["model"], "lens": lens["lens"]}
    raise NotFound(f"There is no calibration or lens {id!r} whose lens could be held.",
                   "List them with GET /api/v1/calibrations and GET /api/v1/lenses.", reason="unknown-lens")
