"""A listener to a multicast group with sockets of its own, which sees how a packet came; and free groups."""

import random
import socket
import struct
import time
from typing import NamedTuple

IP_TTL, IP_PKTINFO, IP_RECVTTL = 2, 8, 12  # Linux; the socket module does not name them all
LO = "127.0.0.1"


class Came(NamedTuple):
    data: bytes
    ttl: int
    interface: str
    sender: tuple[str, int]


def free_group() -> dict:
    """A group and a port that nobody else uses; it does not leave this machine."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("", 0))
        port = probe.getsockname()[1]
    return {
        "group": f"239.255.{random.randrange(256)}.{random.randrange(1, 255)}",
        "port": port,
        "interface": LO,
        "ttl": 0,
    }


class Listener:
    """Joins a group as any other program would."""

    def __init__(self, group: str, port: int, interface: str = LO, **_) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._socket.setsockopt(socket.IPPROTO_IP, IP_RECVTTL, 1)
        self._socket.setsockopt(socket.IPPROTO_IP, IP_PKTINFO, 1)
        self._socket.bind((group, port))
        self._socket.setsockopt(
            socket.IPPROTO_IP,
            socket.IP_ADD_MEMBERSHIP,
            socket.inet_aton(group) + socket.inet_aton(interface),
        )

    def receive(self, seconds: float = 20.0) -> Came | None:
        """The next packet."""
        self._socket.settimeout(seconds)
        try:
            data, told, _, sender = self._socket.recvmsg(70_000, 1024)
        except TimeoutError:
            return None
        about = {kind: value for level, kind, value in told if level == socket.IPPROTO_IP}
        return Came(
            data,
            struct.unpack("i", about[IP_TTL])[0],
            socket.if_indextoname(struct.unpack_from("i", about[IP_PKTINFO])[0]),
            sender,
        )

    def hear_until(self, wanted, seconds: float = 20.0) -> Came:
        """The first packet that is wanted."""
        end = time.monotonic() + seconds
        while (came := self.receive(max(0.01, end - time.monotonic()))) is not None:
            if wanted(came):
                return came
        raise AssertionError("it was not heard")

    def close(self) -> None:
        self._socket.close()

    def __enter__(self):
        return self

    def __exit__(self, *_) -> None:
        self.close()


def said(
    packet: bytes,
    group: str,
    port: int,
    interface: str = LO,
    sock: socket.socket | None = None,
    **_,
) -> int:
    """A stranger's packet; the port it came from. sock: a socket of the stranger's own, to be used again."""
    out = sock or socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(interface))
    out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
    out.sendto(packet, (group, port))
    found = out.getsockname()[1]
    if sock is None:
        out.close()
    return found
