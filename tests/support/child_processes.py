"""The child processes behind what runs jobs and what decodes pictures."""

from app.images import ImageDecoder
from app.jobs import JobEngine


def pids_of(owner: JobEngine | ImageDecoder) -> tuple[int, ...]:
    """The processes that stand ready or work; none of a cluster's."""
    if isinstance(owner, ImageDecoder):
        return tuple(worker.pid for worker in owner._all)
    found = (getattr(runner, "pid", None) for runner in owner._runners)
    return tuple(pid for pid in found if pid is not None)
