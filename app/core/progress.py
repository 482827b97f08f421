"""How long work reports its progress: a callable that takes the finished share (0 to 1) and a message.

Cancelling makes the call raise.
"""

from collections.abc import Callable

Progress = Callable[[float, str], None]


def no_progress(fraction: float, message: str) -> None:
    """Ignore progress."""
