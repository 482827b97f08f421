"""The pictures named in a job's spec: untrusted files, checked by their hash and decoded in a child process."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Any

from touchline.core.records import Frame
from touchline.images import ImageDecoder
from touchline.store.files import read_checked

Read = Callable[[], Frame]
Pictures = Sequence[tuple[str, Read]]  # each one's name, and how to read it


@contextmanager
def job_pictures(pictures: Iterable[Mapping[str, Any]]) -> Iterator[Pictures]:
    """Name each of [{"name", "path", "sha256"}, …] and how to read it, one at a time, while the child runs."""
    with ImageDecoder(workers=1) as decoder:
        yield [(one["name"], partial(_read, decoder, one)) for one in pictures]


def _read(decoder: ImageDecoder, picture: Mapping[str, Any]) -> Frame:
    return decoder.frame_from_bytes(read_checked(**picture))
