"""One decoder of pictures for all servers in this process: two processes for each would take half a second to start."""

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext

import pytest

from app.images import ImageDecoder, ImageLimits
from app.main import image_limits
from app.services import container
from app.settings import Settings
from tests.support.child_processes import pids_of

_standing: set[ImageDecoder] = set()


@contextmanager
def standing_decoder() -> Iterator[None]:
    """Servers with the usual limits take it instead of one of their own, as long as the context lasts."""
    with ImageDecoder(image_limits(Settings())) as decoder, pytest.MonkeyPatch.context() as patch:
        def decoder_for(limits: ImageLimits) -> AbstractContextManager[ImageDecoder]:
            return nullcontext(decoder) if limits == decoder.limits else ImageDecoder(limits)

        patch.setattr(container, "ImageDecoder", decoder_for)
        _standing.add(decoder)
        yield
        _standing.remove(decoder)


def standing_pids() -> set[int]:
    """Its processes of now: one that a hostile picture has ended is replaced."""
    return {pid for decoder in _standing for pid in pids_of(decoder)}
