"""The child processes behind what runs jobs and what decodes pictures, and all those of a server."""

from contextlib import suppress
from pathlib import Path

from touchline.images import ImageDecoder
from touchline.jobs import JobEngine


def pids_of(owner: JobEngine | ImageDecoder) -> tuple[int, ...]:
    """The processes that stand ready or work; none of a cluster's."""
    if isinstance(owner, ImageDecoder):
        return tuple(worker.pid for worker in owner._all)
    found = (getattr(runner, "pid", None) for runner in owner._runners)
    return tuple(pid for pid in found if pid is not None)


def family(pid: int) -> dict[int, str]:
    """A process and all below it, with what each was started for."""
    found = {}
    with suppress(OSError):  # one has just ended
        found[pid] = (
            Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
        )
        for task in Path(f"/proc/{pid}/task").iterdir():
            for child in (task / "children").read_text().split():
                found |= family(int(child))
    return found
