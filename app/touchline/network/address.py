"""A multicast address: group, port, interface, and how many routers a packet may pass."""

import errno
import fcntl
import ipaddress
import socket
import struct
from dataclasses import dataclass

from touchline.core.errors import BadInput, Conflict
from touchline.core.statements import Sentence, join, say

GROUP, PORT = "224.5.23.2", 10006  # the league's usual ones for vision
MAX_BROADCAST_PREFIX = 30  # bits; networks of one or two addresses have none for all
MAX_NAME = 15  # bytes of an interface's name; Linux' IFNAMSIZ less its end
SIOCGIFADDR, SIOCGIFNETMASK = 0x8915, 0x891B


class NetworkError(Conflict):
    """The network does not carry this now; callers retry."""

    reason = "network"


@dataclass(frozen=True)
class MulticastAddress:
    """interface: an address of this machine or an interface's name; "" leaves the choice to the system.

    ttl: 0 stays on this machine, 1 in the local network, more passes routers that forward multicast. broadcast: to
    all of the interface's network in place of the group.
    """

    group: str = GROUP
    port: int = PORT
    interface: str = ""
    ttl: int = 1
    broadcast: bool = False

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

    def destination(self) -> tuple[str, int]:
        """Return where packets go: the group, or the broadcast address of the interface's network; NetworkError."""
        return (self._broadcast_address() if self.broadcast else self.group), self.port

    def meets(self, other: "MulticastAddress") -> bool:
        """Tell whether who listens to one of them receives packets to the other as well."""
        one, another = _device(self.interface), _device(other.interface)
        return (
            self.port == other.port
            and (self.group == other.group or self.broadcast or other.broadcast)
            and (one == another or "" in (one, another))
        )

    def _broadcast_address(self) -> str:
        """Return that of the interface, or of the one through which multicast would leave."""
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            own = self.interface
            if not own:
                try:
                    probe.connect((self.group, self.port))  # looks up the route and sends nothing
                except OSError as error:
                    raise self.network_error(error) from None
                own = probe.getsockname()[0]
            for one in interfaces():
                if own in (one["name"], one["address"]) and one["address"]:
                    mask = _ioctl(probe, SIOCGIFNETMASK, str(one["name"]))
                    network = ipaddress.IPv4Interface(f"{one['address']}/{mask}").network
                    if network.prefixlen > MAX_BROADCAST_PREFIX:
                        break
                    return str(network.broadcast_address)
        if not any(own in (one["name"], one["address"]) for one in interfaces()):
            raise self.no_interface_error()
        raise NetworkError(
            say(
                "multicast.no-broadcast",
                "The network of the interface {interface} has no broadcast address.",
                interface=own,
            ),
            say("multicast.no-broadcast.fix", "Send to the group, or use another interface."),
            reason="no-broadcast",
        )

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
            {"name": name, "address": _ioctl(probe, SIOCGIFADDR, name)}
            for _, name in socket.if_nameindex()
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


def _ioctl(probe: socket.socket, request: int, name: str) -> str | None:
    """Ask for an interface's address or netmask; None without IPv4."""
    try:
        answer = fcntl.ioctl(probe, request, struct.pack("256s", name.encode()[:MAX_NAME]))
    except OSError:
        return None
    return socket.inet_ntoa(answer[20:24])


def _device(interface: str) -> str:
    """Return the name of the interface that has that name or address; the text itself where none has."""
    return next(
        (str(one["name"]) for one in interfaces() if interface and one["address"] == interface),
        interface,
    )


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
