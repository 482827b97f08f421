"""What the server comes to after something was done at the page: the page's wish needs its way there."""

import time
from collections.abc import Callable, Collection
from typing import TypeVar

Seen = TypeVar("Seen")


def eventually(look: Callable[[], Seen], holds: Callable[[Seen], object], seconds: float = 60.0) -> Seen:
    """What was seen when it held; where it never does, the failure shows what was seen last."""
    end = time.monotonic() + seconds
    while not holds(seen := look()):
        assert time.monotonic() < end, f"after {seconds:.0f} s still: {seen}"
        time.sleep(0.1)
    return seen


def jobs_so_far(server) -> set[str]:
    """The ids of all jobs: those of tests before this one too."""
    return {job["id"] for job in server.api("GET", "/jobs").json()["items"]}


def newest_job(server, kind: str, state: str, seconds: float = 60.0, besides: Collection[str] = ()) -> dict:
    """The newest job, once it is of this kind and in this state and none of those that were there before."""
    return eventually(lambda: server.api("GET", "/jobs").json()["items"][0],
                      lambda job: (job["kind"], job["state"]) == (kind, state) and job["id"] not in besides, seconds)
