"""The pictures named in a job's spec: untrusted files, checked by their hash and decoded in a child process."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from touchline.core.errors import Conflict
from touchline.core.jobs import Progress, no_progress
from touchline.core.records import Frame
from touchline.core.sentences import ONE_CAMERA
from touchline.core.statements import say
from touchline.images import ImageDecoder
from touchline.store.files import read_checked
from touchline.vision.background import Background

Read = Callable[[], Frame]
Pictures = Sequence[tuple[str, Read]]  # each one's name, and how to read it


@contextmanager
def job_pictures(pictures: Iterable[Mapping[str, Any]]) -> Iterator[Pictures]:
    """Name each of [{"name", "path", "sha256"}, …] and how to read it, one at a time, while the child runs."""
    with ImageDecoder(workers=1) as decoder:
        yield [(one["name"], partial(_read, decoder, one)) for one in pictures]


def _read(decoder: ImageDecoder, picture: Mapping[str, Any]) -> Frame:
    return decoder.frame_from_bytes(read_checked(**picture))


def median_frame(pictures: Pictures, progress: Progress = no_progress) -> Frame:
    """Return the median of several pictures of one camera, in which robots and people vanish; a single one as it is."""
    first, count = pictures[0][1](), len(pictures)
    if count == 1:
        return first
    background = Background(first.pixels.shape, count)
    for number, (_, load) in enumerate(pictures):
        progress(
            number / count,
            say(
                "progress.reading",
                "Reading image {number} of {count}",
                number=number + 1,
                count=count,
            ),
        )
        frame = first if number == 0 else load()
        if frame.size != first.size:
            raise Conflict(
                say(
                    "image.differs-from-first",
                    "Image {image} is {size}, the first image is {size2}.",
                    image=number + 1,
                    size=frame.size,
                    size2=first.size,
                ),
                ONE_CAMERA,
                reason="size-mismatch",
            )
        background.add(frame.pixels)
    return replace(first, pixels=np.ascontiguousarray(background.picture))
