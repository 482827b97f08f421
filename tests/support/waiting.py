"""Waiting for what is meant: a condition, the end of a process, the end of a job."""

import asyncio
import itertools
import time
from collections.abc import Callable, Collection, Iterator
from pathlib import Path
from typing import TypeVar

Found = TypeVar("Found")

LONG_S = 90.0  # on a machine on which everything takes ten times as long
FIRST_PAUSE_S, PAUSE_GROWTH, MAX_PAUSE_S = 0.002, 1.5, 0.1


def until(
    look: Callable[[], Found], holds: Callable[[Found], object] = bool, seconds: float = LONG_S
) -> Found:
    """Look again and again until what is found holds, and return it."""
    for pause in _pauses(seconds):
        if holds(found := look()):
            return found
        time.sleep(pause)
    raise AssertionError(f"after {seconds:.0f} s still: {found}")


async def until_async(look: Callable[[], Found], seconds: float = LONG_S) -> Found:
    """Look again and again, while other tasks run, until something is found, and return it."""
    for pause in _pauses(seconds):
        if found := look():
            return found
        await asyncio.sleep(pause)
    raise AssertionError(f"after {seconds:.0f} s still: {found}")


def _pauses(seconds: float) -> Iterator[float]:
    """Yield how long to pause after each look, until the time is over; at least one look is taken after that."""
    end, over = time.monotonic() + seconds, False
    for step in itertools.count():
        if over:
            return
        over = time.monotonic() >= end
        yield min(FIRST_PAUSE_S * PAUSE_GROWTH ** min(step, 20), MAX_PAUSE_S)


def gone(pid: int) -> bool:
    """Whether a process has ended, reaped or not."""
    return _state(pid) == "Z"


def stopped(pid: int) -> bool:
    """Whether a process stands still, as after Ctrl-Z."""
    return _state(pid) == "T"


def _state(pid: int) -> str:
    """As the system names it in a letter; "Z", ended, also for one that has been reaped."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except (FileNotFoundError, ProcessLookupError):  # reaped before or between opening and reading
        return "Z"


def ended(jobs, job, seconds: float = LONG_S):
    """An engine's job, once it has ended."""
    return until(lambda: jobs.get(job.id), lambda now: now.ended, seconds)


def running(jobs, job):
    """An engine's job, once it runs and has said how far it is."""
    return until(
        lambda: jobs.get(job.id), lambda now: now.state == "running" and now.message != "Starting"
    )


def receive_until(socket, wanted: Callable[[dict], object], seconds: float = LONG_S) -> list[dict]:
    """Everything that a WebSocket's client receives until a message is wanted, and that one."""
    end = time.monotonic() + seconds
    received: list[dict] = []
    while not received or not wanted(received[-1]):
        assert time.monotonic() < end, f"after {seconds:.0f} s still: {received[-1]}"
        received.append(socket.receive_json())
    return received


def jobs_so_far(server) -> set[str]:
    """The ids of all jobs: those of tests before this one too."""
    return {job["id"] for job in server.api("GET", "/jobs").json()["items"]}


def newest_job(
    server, kind: str, state: str, seconds: float = LONG_S, besides: Collection[str] = ()
) -> dict:
    """The newest job, once it is of this kind and in this state and none of those that were there before."""
    # of a new server there is none
    return until(
        lambda: next(iter(server.api("GET", "/jobs").json()["items"]), {}),
        lambda job: (
            (job.get("kind"), job.get("state")) == (kind, state) and job["id"] not in besides
        ),
        seconds,
    )
