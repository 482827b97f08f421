"""The thread that listens to game controllers."""

import time
from collections.abc import Callable
from dataclasses import replace

from touchline.network.address import MulticastAddress
from touchline.network.listener import MulticastListener
from touchline.referee.received import GameController, RefereeMessage
from touchline.ssl_protocol.protobuf import decode
from touchline.ssl_protocol.referee_pb2 import RefereePacket


class RefereeListener(MulticastListener[GameController]):
    """Keeps the newest message of each sender. after_each: called on the thread, several times a second."""

    NAME = "referee listener"

    def __init__(
        self, address: MulticastAddress, after_each: Callable[[], None] = lambda: None
    ) -> None:
        self.after_each = after_each  # type: ignore[method-assign]
        super().__init__(address)

    def first(self, address: str, port: int, now_s: float) -> GameController:
        return GameController(address, port, now_s)

    def is_useful(self, sender: GameController) -> bool:
        return sender.message is not None

    def accept(self, sender: GameController, data: bytes) -> GameController:
        message, now_s = RefereeMessage.of(decode(RefereePacket, data)), time.monotonic()
        return replace(
            sender,
            message=message,
            message_s=now_s,
            since_s=sender.since_s if sender.is_current(now_s) else now_s,
        )
