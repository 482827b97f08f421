"""Multicast: an address that is checked, and sending to it and receiving from it on one interface."""

import contextlib
import errno
import fcntl
import ipaddress
import socket
import struct
import threading
from collections import deque
from dataclasses import dataclass
from typing import NamedTuple

from touchline.core.errors import BadInput, Conflict
from touchline.core.statements import Sentence, join, say
from touchline.ssl_protocol.protobuf import MAX_BYTES

GROUP, PORT = "224.5.23.2", 10006  # the league's usual ones for vision
MAX_NAME = 15  # bytes of an interface's name; Linux' IFNAMSIZ less its end
SIOCGIFADDR = 0x8915

MAX_DATAGRAM_BYTES = 65_536  # a byte more than UDP carries
QUEUE_BYTES = 1 << 20  # a burst of detections from eight cameras waits here
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


class NetworkError(Conflict):
    """The network does not carry this now; callers retry."""

    reason = "network"


@dataclass(frozen=True)
class MulticastAddress:
    """interface: an address of this machine or an interface's name; "" leaves the choice to the system.

    ttl: 0 stays on this machine, 1 in the local network, more passes routers that forward multicast.
    """

    group: str = GROUP
    port: int = PORT
    interface: str = ""
    ttl: int = 1

    def __post_init__(self) -> None:
        try:
            fine = ipaddress.IPv4Address(self.group).is_multicast
        except ValueError:
            fine = False
        if not fine:
            raise BadInput(
                say(
                    "multicast.bad-group",
                    "{group!r} is not a multicast group.",
                    group=self.group[:64],
                ),
                say(
                    "multicast.group-range",
                    "Give an address from 224.0.0.0 to 239.255.255.255, such as {group}.",
                    group=GROUP,
                ),
                reason="bad-group",
            )
        if not 1 <= self.port <= 65535:
            raise BadInput(
                say("multicast.bad-port", "{port} is not a UDP port.", port=self.port),
                say("multicast.port-range", "Give one from 1 to 65535, such as {port}.", port=PORT),
                reason="bad-port",
            )
        if not 0 <= self.ttl <= 255:
            raise BadInput(
                say("multicast.bad-ttl", "{ttl} is not a valid TTL.", ttl=self.ttl),
                say("multicast.ttl-range", "Give 1 for the local network, at most 255."),
                reason="bad-ttl",
            )
        if not _may_be_interface(self.interface):
            raise BadInput(
                say(
                    "multicast.bad-interface",
                    "{interface!r} is not a network interface.",
                    interface=self.interface[:64],
                ),
                known_interfaces(),
                reason="bad-interface",
            )

    def request(self) -> bytes:
        """Return the socket option's struct ip_mreqn: group, address, interface index; NetworkError."""
        address, index = "0.0.0.0", 0
        if _address(self.interface) is not None:
            address = self.interface
        elif self.interface:
            try:
                index = socket.if_nametoindex(self.interface)
            except OSError:
                raise self.no_interface_error() from None
        return socket.inet_aton(self.group) + socket.inet_aton(address) + struct.pack("i", index)

    def no_interface_error(self) -> NetworkError:
        what = (
            say(
                "multicast.no-interface",
                "This computer has no interface {interface}.",
                interface=self.interface,
            )
            if self.interface
            else say("multicast.no-network", "This computer has no network for multicast.")
        )
        return NetworkError(what, known_interfaces(), reason="no-interface")

    def network_error(self, error: OSError) -> NetworkError:
        """Translate a socket error into its cause and remedy."""
        if error.errno in (errno.ENODEV, errno.EADDRNOTAVAIL, errno.ENXIO):
            return self.no_interface_error()
        if error.errno in (errno.ENETUNREACH, errno.EHOSTUNREACH, errno.ENETDOWN):
            return NetworkError(
                say("multicast.no-route", "No network reaches {group}.", group=self.group),
                join(
                    say("multicast.connect", "Connect or enable the network."), known_interfaces()
                ),
                reason="no-route",
            )
        if error.errno in (errno.EPERM, errno.EACCES):
            return NetworkError(
                say(
                    "multicast.forbidden",
                    "The operating system does not permit multicast to {group}, port {port}.",
                    group=self.group,
                    port=self.port,
                ),
                say("multicast.allow-in-firewall", "Allow this program in the firewall."),
                reason="forbidden",
            )
        if error.errno == errno.EADDRINUSE:
            return NetworkError(
                say(
                    "multicast.port-taken",
                    "Another program uses port {port} exclusively.",
                    port=self.port,
                ),
                say(
                    "multicast.share-port",
                    "Close it, or configure it to share the port (SO_REUSEADDR).",
                ),
                reason="port-taken",
            )
        return NetworkError(
            say(
                "multicast.rejected",
                "The network rejects {group}, port {port}: {error}.",
                group=self.group,
                port=self.port,
                error=error.strerror or error,
            ),
            say(
                "multicast.check-interface",
                "Check the interface. Touchline tries again automatically.",
            ),
            reason="network",
        )


def interfaces() -> list[dict[str, str | None]]:
    """List this machine's interfaces: {"name", "address"}; address None without IPv4."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        return [
            {"name": name, "address": _address_of(probe, name)} for _, name in socket.if_nameindex()
        ]


def is_here(address: str) -> bool:
    """Tell whether an address is this machine's: only such a one can be bound to."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind((address, 0))
        except OSError:
            return False
        return True


def known_interfaces() -> Sentence:
    """Name the interfaces in a sentence, for an error."""
    named = [f"{i['name']} ({i['address']})" for i in interfaces() if i["address"]]
    return (
        say(
            "multicast.use-interface",
            "Use an interface of this computer: {interfaces}.",
            interfaces=named[:8],
        )
        if named
        else say("multicast.none-is-up", "Use an interface of this computer: none is up.")
    )


def _address_of(probe: socket.socket, name: str) -> str | None:
    try:
        answer = fcntl.ioctl(probe, SIOCGIFADDR, struct.pack("256s", name.encode()[:MAX_NAME]))
    except OSError:
        return None
    return socket.inet_ntoa(answer[20:24])


def _may_be_interface(text: str) -> bool:
    """Tell whether text is a unicast address or a possible interface name."""
    address = _address(text)
    if address is not None:
        return not (address.is_multicast or address.is_unspecified)
    return (
        len(text.encode("utf-8", "replace")) <= MAX_NAME
        and text.isprintable()
        and not set(text) & set(" /\0")
    )


def _address(text: str) -> ipaddress.IPv4Address | None:
    try:
        return ipaddress.IPv4Address(text)
    except ValueError:
        return None


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
                probe.connect((self.address.group, self.address.port))
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
                try:
                    self._socket.sendto(packet, (self.address.group, self.address.port))
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


class MulticastReceiver:
    """A socket that has joined a multicast group; other programs may share its port."""

    def __init__(self, address: MulticastAddress) -> None:
        """Join; NetworkError where the group cannot be joined."""
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            # some listeners share only so
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, QUEUE_BYTES)
            self._socket.setsockopt(socket.IPPROTO_IP, IP_MULTICAST_ALL, 0)
            # the group, or other groups' packets would come as well
            self._socket.bind((address.group, address.port))
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
