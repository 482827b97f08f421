"""Whether a GigE Vision camera answers at an address: one question over UDP, before a library waits for it.

GigE Vision's control protocol (GVCP): eight bytes ask who is there, and every camera answers on port 3956.
"""

import ipaddress
import socket
import struct
import time

PORT = 3956
ASK = struct.pack(">BBHHH", 0x42, 0x01, 0x0002, 0, 1)  # key, answer wanted, discovery, no payload, number
ANSWER = struct.pack(">H", 0x0003)
WAITS_S = (0.3, 0.6)  # asked twice, since UDP may lose one


def is_ip(target: str) -> bool:
    try:
        return bool(ipaddress.IPv4Address(target))  # GigE Vision has no other
    except ValueError:
        return False


def responds(ip: str) -> bool:
    """True as soon as it does; False after 0.9 s."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        try:
            line.connect((ip, PORT))
            for wait_s in WAITS_S:
                line.send(ASK)
                if _answered(line, time.monotonic() + wait_s):
                    return True
        except OSError:  # no way there, or nobody listens on that port
            pass
    return False


def _answered(line: socket.socket, until: float) -> bool:
    while (left := until - time.monotonic()) > 0:
        line.settimeout(left)
        try:
            answer = line.recv(1024)
        except TimeoutError:
            return False
        if answer[2:4] == ANSWER:
            return True
    return False
