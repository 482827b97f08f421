"""Told within a network namespace of its own, as its root: an interface is switched on, off and on again, and one that
was unplugged comes back under the same name with another number. What publisher and listener say is checked."""

import fcntl
import socket
import struct
import sys
from io import FileIO

from tests.support.exported import example
from tests.support.waiting import until
from touchline.league.live import GeometryListener, Publisher
from touchline.league.packet import PublishingConfig
from touchline.league.packet_camera import packet_camera

SIOCSIFFLAGS, SIOCGIFFLAGS, SIOCSIFADDR, IFF_UP = 0x8914, 0x8913, 0x8916, 1
TUNSETIFF, TAP = 0x400454CA, 0x1002
NO_TAP = 77


def switch(name: str, on: bool) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        asked = fcntl.ioctl(probe, SIOCGIFFLAGS, struct.pack("16sH14x", name.encode(), 0))
        (flags,) = struct.unpack_from("H", asked, 16)
        flags = flags | IFF_UP if on else flags & ~IFF_UP
        fcntl.ioctl(probe, SIOCSIFFLAGS, struct.pack("16sH14x", name.encode(), flags))


def plug(name: str) -> FileIO:
    """A tap that lives as long as the file that is returned is open: closing it is unplugging it."""
    try:
        tap = open("/dev/net/tun", "r+b", buffering=0)  # noqa: SIM115 — open as long as it is plugged in
        fcntl.ioctl(tap, TUNSETIFF, struct.pack("16sH22x", name.encode(), TAP))
    except OSError:
        sys.exit(NO_TAP)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        address = struct.pack(
            "16sHH4s8x", name.encode(), socket.AF_INET, 0, socket.inet_aton("10.77.0.1")
        )
        fcntl.ioctl(probe, SIOCSIFADDR, address)
    switch(name, True)
    return tap


def main(interface: str) -> None:
    plugged: list[FileIO] = []
    if interface == "eth7":
        on, off = (lambda: plugged.append(plug("eth7"))), (lambda: plugged.pop().close())
    else:
        on, off = (lambda: switch("lo", True)), (lambda: switch("lo", False))
    config = PublishingConfig(
        enabled=True, group="239.255.7.7", port=23457, interface=interface, interval_s=0.1
    )
    publisher = Publisher(config, lambda: [example("ssl", 0)], packet_camera)
    listener = GeometryListener(config.address)

    def reason() -> str:
        problem = until(lambda: publisher.status.problem)
        assert problem is not None and problem.fix and publisher.status.failures
        return problem.reason

    reasons = set()
    for _ in range(2):
        reasons.add(reason())
        on()
        heard = listener.datagrams
        until(lambda: publisher.status.problem is None)
        until(lambda: listener.datagrams, (heard + 3).__lt__, seconds=60)
        assert listener.problem is None
        off()
    reasons.add(reason())
    print(*sorted(reasons))
    assert reasons <= {"no-route", "no-interface"}, reasons
    listener.close()
    publisher.close()
    print("recovered")


if __name__ == "__main__":
    main(sys.argv[1])
