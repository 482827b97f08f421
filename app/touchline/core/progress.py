"""How long work reports its progress: a callable that takes the finished share (0 to 1) and a message.

Cancelling makes the call raise.
"""

from collections.abc import Callable

from touchline.core.statements import join

Progress = Callable[[float, str], None]


def no_progress(fraction: float, message: str) -> None:
    """Ignore progress."""


def subprogress(progress: Progress, start: float, end: float, title: str = "") -> Progress:
    """Return the progress callback of one part of a longer work, mapped to [start, end] of the whole."""
    return lambda share, words: progress(start + share * (end - start), join(title, words))
