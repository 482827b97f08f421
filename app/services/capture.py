"""Snapshots taken from a live camera."""

from collections.abc import Awaitable, Callable

from app.core.errors import Cancelled
from app.services.container import Services
from app.services.live import take_frame
from app.store import Snapshot

FRAME_INTERVAL_S = 1 / 3  # between the frames of a background: who walks by needs some seconds to leave


async def take_snapshot(services: Services, id: str, is_abandoned: Callable[[], Awaitable[bool]], frames: int = 1,
                        over_s: float | None = None, purpose: str = "picture") -> Snapshot:
    """Take and save one frame, or what most of several agree on; nothing is saved if the caller has gone meanwhile."""
    over_s = FRAME_INTERVAL_S * (frames - 1) if over_s is None else over_s
    frame = await take_frame(services.live.get(id), frames=frames, over_s=over_s)
    if await is_abandoned():
        raise Cancelled("Nobody waits for this picture any more.", "Take it again.")
    return await services.run_in_thread(frame.save, services.store, purpose)
