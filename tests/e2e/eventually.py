"""What the server comes to after something was done at the page: the page's wish needs its way there."""

import time
from collections.abc import Callable
from typing import TypeVar

Seen = TypeVar("Seen")


def eventually(look: Callable[[], Seen], holds: Callable[[Seen], object], seconds: float = 60.0) -> Seen:
    """What was seen when it held; where it never does, the failure shows what was seen last."""
    end = time.monotonic() + seconds
    while not holds(seen := look()):
        assert time.monotonic() < end, f"after {seconds:.0f} s still: {seen}"
        time.sleep(0.1)
    return seen


def newest_job(server, kind: str, state: str, seconds: float = 60.0) -> dict:
    """The newest job, once it is of this kind and in this state."""
    return eventually(lambda: server.api("GET", "/jobs").json()["items"][0],
                      lambda job: (job["kind"], job["state"]) == (kind, state), seconds)
