"""Packets out to a multicast group: one socket that is opened anew whenever the network has changed under it."""

import errno
import socket
import threading
from typing import Self

from app.core.errors import BadInput
from app.league.multicast_address import Route, is_here
from app.ssl_protocol.protobuf import MAX_BYTES

STALE = (errno.ENETUNREACH, errno.ENETDOWN, errno.EHOSTUNREACH, errno.ENODEV, errno.EADDRNOTAVAIL, errno.ENXIO)


class Group:
    """The way to everybody who listens to a route. Thread-safe: geometry and other packets share its socket.

        with Group(Route(interface="eth1")) as group:
            group.send(encode(packet))
    """

    def __init__(self, route: Route) -> None:
        """The socket is opened by the first packet."""
        self.route = route
        self._lock = threading.Lock()
        self._socket: socket.socket | None = None

    def check(self) -> None:
        """NetworkTrouble where a packet would not leave now; nothing is sent."""
        with self._opened() as probe:
            try:
                probe.connect((self.route.group, self.route.port))  # looks the route up, and says nothing to anybody
            except OSError as error:
                raise self.route.trouble(error) from None

    def send(self, packet: bytes) -> None:
        """One datagram; NetworkTrouble, with the cure, where the network does not take it now.

        A socket remembers its interface by number, and one that was unplugged comes back with another: what fails so is
        tried once more with a new socket.
        """
        if len(packet) > MAX_BYTES:
            raise BadInput(f"The packet has {len(packet)} bytes; a datagram carries at most {MAX_BYTES}.",
                           "Send fewer cameras or lines.", reason="packet-too-long")
        with self._lock:
            if self._socket is not None:
                try:
                    self._socket.sendto(packet, (self.route.group, self.route.port))
                    return
                except OSError as error:
                    self._close()
                    if error.errno not in STALE:
                        raise self.route.trouble(error) from None
            self._socket = self._opened()
            try:
                self._socket.sendto(packet, (self.route.group, self.route.port))
            except OSError as error:
                self._close()
                raise self.route.trouble(error) from None

    def sent(self, address: str, port: int) -> bool:
        """Whether a packet from there is our own, come back to this machine."""
        with self._lock:
            ours = self._socket is not None and self._socket.getsockname()[1] == port
        return ours and is_here(address)

    def close(self) -> None:
        with self._lock:
            self._close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _opened(self) -> socket.socket:
        opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            opened.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, self.route.ttl)
            opened.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 1)  # listeners on this machine hear it too
            opened.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, self.route.request())
            opened.bind(("", 0))  # a port of its own from now on, by which our own packets are known
            opened.setblocking(False)  # a full queue loses a packet, as UDP may; it never holds anybody up
        except OSError as error:
            opened.close()
            raise self.route.trouble(error) from None
        except BaseException:
            opened.close()
            raise
        return opened

    def _close(self) -> None:
        if self._socket is not None:
            self._socket.close()
            self._socket = None
