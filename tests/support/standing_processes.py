"""One decoder of pictures and one process for fits, for all servers in this process: each would take a second more."""

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from threading import Lock
from typing import Any

import pytest

from tests.support.child_processes import pids_of
from touchline.images import ImageDecoder, ImageLimits
from touchline.jobs.runner import ProcessRunner
from touchline.main import FITS, image_limits
from touchline.services import container, fit_processes
from touchline.settings import Settings

_standing: set[ImageDecoder | ProcessRunner] = set()


class StandingRunner(ProcessRunner):
    """Serves several servers, one job after the other, and outlives them."""

    def __init__(self) -> None:
        super().__init__(fit_processes.MEMORY_BYTES, FITS, nice=0)
        self._turn = Lock()

    def warm(self) -> None:
        with self._turn:
            super().warm()

    def run_to_text(self, *job: Any) -> bytes:
        with self._turn:
            return super().run_to_text(*job)

    def end(self) -> None:
        pass

    def close(self) -> None:
        pass

    def end_for_good(self) -> None:
        super().end()
        super().close()


@contextmanager
def standing_processes() -> Iterator[None]:
    """Servers with the usual limits take them instead of some of their own, as long as the context lasts."""
    with ImageDecoder(image_limits(Settings())) as decoder, pytest.MonkeyPatch.context() as patch:
        runner = StandingRunner()

        def decoder_for(limits: ImageLimits) -> AbstractContextManager[ImageDecoder]:
            return nullcontext(decoder) if limits == decoder.limits else ImageDecoder(limits)

        def runner_for(memory_bytes: int, modules: tuple[str, ...], nice: int) -> ProcessRunner:
            return runner if modules == FITS else ProcessRunner(memory_bytes, modules, nice)

        patch.setattr(container, "ImageDecoder", decoder_for)
        patch.setattr(fit_processes, "ProcessRunner", runner_for)
        _standing.update((decoder, runner))
        yield
        _standing.difference_update((decoder, runner))
        runner.end_for_good()


def standing_pids() -> set[int]:
    """Its processes of now: one that a hostile picture has ended is replaced."""
    found: set[int] = set()
    for one in _standing:
        found |= {*pids_of(one)} if isinstance(one, ImageDecoder) else {one.pid or 0}
    return found
