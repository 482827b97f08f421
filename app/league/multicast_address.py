"""A multicast address: group, port, interface, and how many routers a packet may pass."""

import errno
import fcntl
import ipaddress
import socket
import struct
from dataclasses import dataclass

from app.core.errors import BadInput, Conflict

GROUP, PORT = "224.5.23.2", 10006  # the league's usual ones for vision
MAX_NAME = 15  # bytes of an interface's name; Linux' IFNAMSIZ less its end
SIOCGIFADDR = 0x8915


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
            raise BadInput(f"{self.group[:64]!r} is not a multicast group.",
                           f"Give an address from 224.0.0.0 to 239.255.255.255, such as {GROUP}.", reason="bad-group")
        if not 1 <= self.port <= 65535:
            raise BadInput(f"{self.port} is not a UDP port.", f"Give one from 1 to 65535, such as {PORT}.",
                           reason="bad-port")
        if not 0 <= self.ttl <= 255:
            raise BadInput(f"{self.ttl} is not a valid TTL.",
                           "Give 1 for the local network, at most 255.", reason="bad-ttl")
        if not _may_be_interface(self.interface):
            raise BadInput(f"{self.interface[:64]!r} is not a network interface.",
                           known_interfaces(), reason="bad-interface")

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
        named = f"no interface {self.interface}" if self.interface else "no network for multicast"
        return NetworkError(f"This computer has {named}.", known_interfaces(), reason="no-interface")

    def network_error(self, error: OSError) -> NetworkError:
        """Translate a socket error into its cause and remedy."""
        if error.errno in (errno.ENODEV, errno.EADDRNOTAVAIL, errno.ENXIO):
            return self.no_interface_error()
        if error.errno in (errno.ENETUNREACH, errno.EHOSTUNREACH, errno.ENETDOWN):
            return NetworkError(f"No network reaches {self.group}.",
                                  f"Connect or enable the network. {known_interfaces()}", reason="no-route")
        if error.errno in (errno.EPERM, errno.EACCES):
            return NetworkError(f"The operating system does not permit multicast to {self.group}, port {self.port}.",
                                  "Allow this program in the firewall.", reason="forbidden")
        if error.errno == errno.EADDRINUSE:
            return NetworkError(f"Another program uses port {self.port} exclusively.",
                                  "Close it, or configure it to share the port (SO_REUSEADDR).", reason="port-taken")
        return NetworkError(f"The network rejects {self.group}, port {self.port}: {error.strerror or error}.",
                              "Check the interface. Touchline tries again automatically.", reason="network")


def interfaces() -> list[dict[str, str | None]]:
    """List this machine's interfaces: {"name", "address"}; address None without IPv4."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        return [{"name": name, "address": _address_of(probe, name)} for _, name in socket.if_nameindex()]


def is_here(address: str) -> bool:
    """Tell whether an address is this machine's: only such a one can be bound to."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind((address, 0))
        except OSError:
            return False
        return True


def known_interfaces() -> str:
    """Name the interfaces in a sentence, for an error."""
    named = [f"{i['name']} ({i['address']})" for i in interfaces() if i["address"]]
    return f"Use an interface of this computer: {', '.join(named[:8]) or 'none is up'}."


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
    return len(text.encode("utf-8", "replace")) <= MAX_NAME and text.isprintable() and not set(text) & set(" /\0")


def _address(text: str) -> ipaddress.IPv4Address | None:
    try:
        return ipaddress.IPv4Address(text)
    except ValueError:
        return None
