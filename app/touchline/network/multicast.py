"""Send packets to a multicast group over one socket, reopened when the network has changed; and receive packets."""

import contextlib
import errno
import socket
import threading
from collections import deque
from collections.abc import Callable, Iterator
from typing import NamedTuple

from touchline.core.errors import BadInput
from touchline.core.statements import say
from touchline.network.address import MulticastAddress, NetworkError, is_here
from touchline.ssl_protocol.protobuf import MAX_BYTES

MAX_DATAGRAM_BYTES = 65_536  # a byte more than UDP carries
# a burst of detections from eight cameras, or of a video's packets, waits here
QUEUE_BYTES = 1 << 21
IP_MULTICAST_ALL = 49  # Linux: 0 gives a socket only the groups that it joined itself
# of sockets that were opened one after the other: their last packets may still be heard
MAX_OWN_PORTS = 4
NETWORK_CHANGED = (
    errno.ENETUNREACH,
    errno.ENETDOWN,
    errno.EHOSTUNREACH,
    errno.ENODEV,
    errno.EADDRNOTAVAIL,
    errno.ENXIO,
)


class MulticastSender:
    """Sends to one multicast address. Thread-safe: geometry and detections share its socket.

    with closing(MulticastSender(MulticastAddress(interface="eth1"))) as sender:
        sender.send(encode(packet))
    """

    def __init__(self, address: MulticastAddress) -> None:
        """The socket is opened by the first packet."""
        self.address = address
        self._lock = threading.Lock()
        self._socket: socket.socket | None = None
        self._ports: deque[int] = deque(maxlen=MAX_OWN_PORTS)

    def check(self) -> None:
        """NetworkError where a packet would not leave now; nothing is sent."""
        with self._opened() as probe:
            try:
                # looks up the route and sends nothing
                probe.connect(self.address.destination())
            except OSError as error:
                raise self.address.network_error(error) from None

    def send(self, packet: bytes) -> None:
        """Send one datagram; NetworkError, with the remedy, where the network does not take it now.

        A socket remembers its interface by number, and one that was unplugged comes back with another: what fails so is
        tried once more with a new socket.
        """
        if len(packet) > MAX_BYTES:
            raise BadInput(
                say(
                    "packet.too-long",
                    "The packet has {bytes} bytes; the limit of a datagram is {most}.",
                    bytes=len(packet),
                    most=MAX_BYTES,
                ),
                say("packet.fewer-cameras-or-lines", "Send fewer cameras or lines."),
                reason="packet-too-long",
            )
        with self._lock:
            for last in (self._socket is None, True):
                self._socket = self._socket or self._opened()
                # a network with another address takes the old one's broadcasts for another's, and nobody fails
                destination = self.address.destination()
                try:
                    self._socket.sendto(packet, destination)
                    if (port := self._socket.getsockname()[1]) not in self._ports:
                        self._ports.append(port)
                    return
                except OSError as error:
                    self._close()
                    if last or error.errno not in NETWORK_CHANGED:
                        raise self.address.network_error(error) from None

    def is_own_packet(self, address: str, port: int) -> bool:
        """Tell whether a packet from this address is our own, looped back to this machine, also after it was closed."""
        with self._lock:
            ours = port in self._ports
        return ours and is_here(address)

    def close(self) -> None:
        with self._lock:
            self._close()

    def _opened(self) -> socket.socket:
        with contextlib.ExitStack() as on_error:
            opened = on_error.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            try:
                opened.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, self.address.ttl)
                # also to listeners on this machine
                opened.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 1)
                opened.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, self.address.request())
                opened.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, self.address.broadcast)
                # a port of its own from now on, by which our own packets are known
                opened.bind(("", 0))
                # a full queue loses a packet, as UDP may; it never holds anybody up
                opened.setblocking(False)
            except OSError as error:
                raise self.address.network_error(error) from None
            on_error.pop_all()
        return opened

    def _close(self) -> None:
        if self._socket is not None:
            self._socket.close()
            self._socket = None


class Datagram(NamedTuple):
    data: bytes
    address: str
    port: int


class Receiver:
    """A UDP socket that is read from."""

    _socket: socket.socket

    def receive(self, timeout_s: float) -> Datagram | None:
        """Return the next datagram, or None after the timeout. OSError when the network is gone."""
        self._socket.settimeout(timeout_s)
        try:
            data, (address, port) = self._socket.recvfrom(MAX_DATAGRAM_BYTES)
        except (TimeoutError, BlockingIOError):
            return None
        return Datagram(data, address, port)

    def fileno(self) -> int:
        return self._socket.fileno()

    def close(self) -> None:
        self._socket.close()


class MulticastReceiver(Receiver):
    """A socket that has joined a multicast group, or receives broadcasts; other programs may share its port."""

    def __init__(self, address: MulticastAddress) -> None:
        """Join; NetworkError where the group cannot be joined."""
        destination = address.destination()
        with _opening(address.network_error) as self._socket:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            # some listeners share only so
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
            # the group, or other groups' packets would come as well; the same of networks with broadcasts
            self._socket.bind(destination)
            if not address.broadcast:
                self._socket.setsockopt(
                    socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, address.request()
                )


class UnicastReceiver(Receiver):
    """A socket for what is sent to this machine. No other program's port is shared: it would lose its packets."""

    def __init__(self, host: str, port: int) -> None:
        """Bind; NetworkError where the port is in use or the address is not this machine's."""

        def explain(error: OSError) -> NetworkError:
            return NetworkError(
                say(
                    "unicast.refused",
                    "This computer cannot receive at {host}, port {port}: {error}.",
                    host=host,
                    port=port,
                    error=error.strerror or error,
                ),
                say(
                    "unicast.use-own",
                    "Enter an address of this computer, or 0.0.0.0 for all, and a free port from 1024.",
                ),
            )

        with _opening(explain) as self._socket:
            self._socket.bind((host, port))


@contextlib.contextmanager
def _opening(explain: Callable[[OSError], NetworkError]) -> Iterator[socket.socket]:
    """Open a socket that gets only the groups that it joins; closed where that fails."""
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, QUEUE_BYTES)
        opened.setsockopt(socket.IPPROTO_IP, IP_MULTICAST_ALL, 0)
        yield opened
    except OSError as error:
        opened.close()
        raise explain(error) from None
    except BaseException:
        opened.close()
        raise
