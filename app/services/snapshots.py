"""Saved pictures, as jobs read them in their own process."""

from collections.abc import Iterable, Sequence
from typing import Any

from app.core.errors import Conflict
from app.core.geometry import ImageSize
from app.store import Snapshot, Store


def job_picture(store: Store, id: str, name: str) -> dict[str, Any]:
    """Return where a job finds a snapshot's file, and its checksum; NotFound."""
    snapshot = store.snapshots.get(id)
    return {"name": name, "path": str(store.snapshots.path(snapshot)), "sha256": snapshot.sha256}


def job_pictures(store: Store, ids: Iterable[str]) -> list[dict[str, Any]]:
    """Return the same for several, called "picture 1" and so on."""
    return [job_picture(store, id, f"picture {number}") for number, id in enumerate(ids, 1)]


def check_one_size(snapshots: Sequence[Snapshot], image_size: ImageSize | None, fix: str) -> None:
    """Refuse pictures of several sizes, or of another one than was given."""
    sizes = {snapshot.size for snapshot in snapshots} | ({image_size} if image_size is not None else set())
    if len(sizes) > 1:
        names = sorted(f"{size.width} × {size.height} px" for size in sizes)
        raise Conflict("The pictures are not all of one size: " + " and ".join(names) + ".", fix,
                       reason="size-mismatch")
