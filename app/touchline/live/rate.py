"""How often: which frames are due for a stream of so many a second, and how many came."""

from collections import deque

EARLY_SHARE = 0.25  # of the interval: a frame so much too early is still taken, or every second would be lost
RATE_FRAMES = 20  # over so many intervals the rate is measured


class Rate:
    """Takes frames no more often than wanted. Moments are of any one clock, s."""

    def __init__(self) -> None:
        self._due_s = 0.0

    def is_due(self, moment_s: float, interval_s: float) -> bool:
        """Return whether a frame of this moment is taken; the next one is due an interval later."""
        if moment_s < self._due_s - EARLY_SHARE * interval_s:
            return False
        self._due_s = max(self._due_s, moment_s - interval_s) + interval_s
        return True


class MeasuredRate:
    """The newest moments, from which the rate follows."""

    def __init__(self) -> None:
        self._moments_s: deque[float] = deque(maxlen=RATE_FRAMES + 1)

    def add(self, moment_s: float) -> None:
        self._moments_s.append(moment_s)

    def clear(self) -> None:
        self._moments_s.clear()

    @property
    def interval_s(self) -> float:
        """The mean time between two; 0 before the second."""
        count = len(self._moments_s) - 1
        return (self._moments_s[-1] - self._moments_s[0]) / count if count > 0 else 0.0
