"""Receive packets of a multicast group, each with its sender's address."""

import socket
from typing import NamedTuple

from app.league.multicast_address import MulticastAddress

MAX_DATAGRAM_BYTES = 65_536  # a byte more than UDP carries
QUEUE_BYTES = 1 << 20  # a burst of detections from eight cameras waits here
IP_MULTICAST_ALL = 49  # Linux: 0 gives a socket only the groups that it joined itself


class Datagram(NamedTuple):
    data: bytes
    address: str
    port: int


class MulticastReceiver:
    """A socket that has joined a multicast group; other programs may share its port."""

    def __init__(self, address: MulticastAddress) -> None:
        """Join; NetworkError where the group cannot be joined."""
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)  # some listeners share only so
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, QUEUE_BYTES)
            self._socket.setsockopt(socket.IPPROTO_IP, IP_MULTICAST_ALL, 0)
            self._socket.bind((address.group, address.port))  # the group, or other groups' packets would come as well
            self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, address.request())
        except OSError as error:
            self._socket.close()
            raise address.network_error(error) from None
        except BaseException:
            self._socket.close()
            raise

    def receive(self, timeout_s: float) -> Datagram | None:
        """Return the next datagram, or None after the timeout. OSError when the network is gone."""
        self._socket.settimeout(timeout_s)
        try:
            data, (address, port) = self._socket.recvfrom(MAX_DATAGRAM_BYTES)
        except TimeoutError:
            return None
        return Datagram(data, address, port)

    def close(self) -> None:
        self._socket.close()
