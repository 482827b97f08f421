"""Scenes as files, the last few of them: one takes a process and two seconds, and a version never changes."""

from collections import OrderedDict

MOST = 4  # of 1 MB each


class ScenePages:
    """By what they were made from, the least recently asked for forgotten first. Only for the event loop's thread."""

    def __init__(self) -> None:
        self._kept: OrderedDict[tuple[object, ...], bytes] = OrderedDict()

    def get(self, of: tuple[object, ...]) -> bytes | None:
        if of in self._kept:
            self._kept.move_to_end(of)
        return self._kept.get(of)

    def keep(self, of: tuple[object, ...], html: bytes) -> None:
        self._kept[of] = html
        while len(self._kept) > MOST:
            self._kept.popitem(last=False)
