"""One decoding process seen from outside: started, asked under a deadline, killed when it misbehaves."""

import time
from functools import partial

import numpy as np

from touchline.core.errors import Unavailable
from touchline.core.sentences import FREE_MEMORY
from touchline.core.statements import say
from touchline.images import decoder_worker
from touchline.images.limits import DeclaredImage, ImageLimits
from touchline.processes.framing import Message
from touchline.processes.start import ChildProcess, Program

START_S = 30.0  # importing OpenCV takes 0.2 s, on a busy small machine some seconds
PROGRAM = Program("touchline.images.decoder_worker:main")  # it limits itself, once its codecs are loaded


class DecoderProcess:
    """A decoding process. Not thread-safe: whoever holds it has it alone. After an exception it is dead."""

    def __init__(self, limits: ImageLimits) -> None:
        self._limits = limits
        # Room for pixels need not be zeros first.
        self._child = ChildProcess(PROGRAM, {"memory_bytes": limits.memory_bytes}, partial(np.empty, dtype=np.uint8),
                                   3 * limits.max_pixels)
        self._is_ready = False
        self.pid = self._child.pid
        self.end = self._child.end  # by any thread: whoever waits for its answer gets OSError
        self.close = self._child.close

    @property
    def is_alive(self) -> bool:
        return self._child.is_alive

    def decode(self, data: bytes, declared: DeclaredImage) -> Message:
        """Return the answer for one picture (decoder_worker.py).

        TimeoutError where none comes within the limit of time, another OSError where the process ends before it.
        """
        try:
            self._await_ready()
            connection, wall_s = self._child.connection, self._limits.wall_s
            deadline = time.monotonic() + wall_s
            request = decoder_worker.REQUEST.pack(declared.width, declared.height, wall_s)
            connection.send(decoder_worker.DECODE, 0, request, data, timeout_s=wall_s)
            answer = connection.receive(deadline - time.monotonic())
            if answer is None:
                raise TimeoutError
            lengths = {decoder_worker.DECODED: 3 * declared.width * declared.height,
                       decoder_worker.OTHER_SIZE: decoder_worker.SIZE.size}
            if len(answer.body) != lengths.get(answer.kind, 0):
                raise ConnectionResetError
            return answer
        except BaseException:
            self.close()  # an answer read by half would be taken for the next one's
            raise

    def _await_ready(self) -> None:
        try:
            if not self.is_alive:
                raise ConnectionResetError
            if not self._is_ready:
                self._child.await_ready(START_S)
                self._is_ready = True
        except OSError:
            raise Unavailable(say("image.decoder-down", "The process that decodes images does not start."),
                              FREE_MEMORY,
                              reason="decoder-down") from None
