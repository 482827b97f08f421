"""Where packets go and come from: a multicast group, a port, the interface, and how many routers they may pass."""

import errno
import fcntl
import ipaddress
import socket
import struct
from dataclasses import dataclass

from app.core.errors import BadInput, Conflict

GROUP, PORT = "224.5.23.2", 10006  # where the league's vision is by custom
MAX_NAME = 15  # bytes of an interface's name; Linux' IFNAMSIZ less its end
SIOCGIFADDR = 0x8915


class NetworkTrouble(Conflict):
    """The network, as it is now, does not carry what was asked. It is tried again; nothing of ours is broken."""

    reason = "network"


@dataclass(frozen=True)
class Route:
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
            raise BadInput(f"{self.group[:64]!r} is no multicast group.",
                           f"Give an address from 224.0.0.0 to 239.255.255.255, such as {GROUP}.", reason="bad-group")
        if not 1 <= self.port <= 65535:
            raise BadInput(f"{self.port} is no UDP port.", f"Give one from 1 to 65535, such as {PORT}.",
                           reason="bad-port")
        if not 0 <= self.ttl <= 255:
            raise BadInput(f"{self.ttl} is no TTL.", "Give 1 for the local network, at most 255.", reason="bad-ttl")
        if not _may_be_interface(self.interface):
            raise BadInput(f"{self.interface[:64]!r} is no interface.", known_interfaces(), reason="bad-interface")

    def request(self) -> bytes:
        """The interface as the system's calls want it (struct ip_mreqn, the group first); NetworkTrouble."""
        address, index = "0.0.0.0", 0
        if _address(self.interface) is not None:
            address = self.interface
        elif self.interface:
            try:
                index = socket.if_nametoindex(self.interface)
            except OSError:
                raise self.no_interface() from None
        return socket.inet_aton(self.group) + socket.inet_aton(address) + struct.pack("i", index)

    def no_interface(self) -> NetworkTrouble:
        named = f"no interface {self.interface}" if self.interface else "no network for multicast"
        return NetworkTrouble(f"This machine has {named} now.", known_interfaces(), reason="no-interface")

    def trouble(self, error: OSError) -> NetworkTrouble:
        """What a refusal of the system means here, and what cures it."""
        if error.errno in (errno.ENODEV, errno.EADDRNOTAVAIL, errno.ENXIO):
            return self.no_interface()
        if error.errno in (errno.ENETUNREACH, errno.EHOSTUNREACH, errno.ENETDOWN):
            return NetworkTrouble(f"No route leads to {self.group}.",
                                  f"Plug in or switch on the network. {known_interfaces()}", reason="no-route")
        if error.errno in (errno.EPERM, errno.EACCES):
            return NetworkTrouble(f"The system forbids multicast to {self.group}, port {self.port}.",
                                  "Let this program through the firewall.", reason="forbidden")
        if error.errno == errno.EADDRINUSE:
            return NetworkTrouble(f"Another program keeps port {self.port} to itself.",
                                  "End it, or let it share the port (SO_REUSEADDR).", reason="port-taken")
        return NetworkTrouble(f"The network refuses {self.group}, port {self.port}: {error.strerror or error}.",
                              "Check the interface; it is tried again.", reason="network")

    def to_json(self) -> dict[str, object]:
        return {"group": self.group, "port": self.port, "interface": self.interface, "ttl": self.ttl}


def interfaces() -> list[dict[str, str | None]]:
    """This machine's interfaces: {"name", "address"}; None for one without an IPv4 address."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        return [{"name": name, "address": _address_of(probe, name)} for _, name in socket.if_nameindex()]


def is_here(address: str) -> bool:
    """Whether an address is this machine's: only such a one can be bound to."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind((address, 0))
        except OSError:
            return False
        return True


def known_interfaces() -> str:
    """In words, for a refusal."""
    named = [f"{i['name']} ({i['address']})" for i in interfaces() if i["address"]]
    return f"Name one of this machine's interfaces: {', '.join(named[:8]) or 'none is up'}."


def _address_of(probe: socket.socket, name: str) -> str | None:
    try:
        told = fcntl.ioctl(probe, SIOCGIFADDR, struct.pack("256s", name.encode()[:MAX_NAME]))
    except OSError:
        return None
    return socket.inet_ntoa(told[20:24])


def _may_be_interface(text: str) -> bool:
    """An address that is a host's, or what the system would take for a name."""
    address = _address(text)
    if address is not None:
        return not (address.is_multicast or address.is_unspecified)
    return len(text.encode("utf-8", "replace")) <= MAX_NAME and text.isprintable() and not set(text) & set(" /\0")


def _address(text: str) -> ipaddress.IPv4Address | None:
    try:
        return ipaddress.IPv4Address(text)
    except ValueError:
        return None
