"""Packets in from a multicast group, each with where it came from."""

import socket
from typing import NamedTuple, Self

from app.league.multicast_address import Route

LONGEST = 65_536  # a byte more than UDP carries
QUEUE_BYTES = 1 << 20  # a burst of detections from eight cameras waits here
IP_MULTICAST_ALL = 49  # Linux: 0 gives a socket only the groups that it joined itself


class Datagram(NamedTuple):
    data: bytes
    address: str
    port: int


class Ear:
    """A socket that has joined the route's group; shares the port with everybody else who listens."""

    def __init__(self, route: Route) -> None:
        """NetworkTrouble where it cannot be joined."""
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)  # some listeners share only so
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, QUEUE_BYTES)
            self._socket.setsockopt(socket.IPPROTO_IP, IP_MULTICAST_ALL, 0)
            self._socket.bind((route.group, route.port))  # the group, or other groups' packets would come as well
            self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, route.request())
        except OSError as error:
            self._socket.close()
            raise route.trouble(error) from None
        except BaseException:
            self._socket.close()
            raise

    def hear(self, timeout_s: float) -> Datagram | None:
        """The next datagram; None when none came in time. Raises OSError when the network is gone."""
        self._socket.settimeout(timeout_s)
        try:
            data, (address, port) = self._socket.recvfrom(LONGEST)
        except TimeoutError:
            return None
        return Datagram(data, address, port)

    def close(self) -> None:
        self._socket.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
