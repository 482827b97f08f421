"""What processes of ours share that serve one socket: reading whole messages, and little memory."""

import resource
import socket


def read_exactly(line: socket.socket, length: int) -> bytes:
    """So many bytes; ConnectionResetError when the other end has gone."""
    data = bytearray()
    while len(data) < length:
        part = line.recv(min(length - len(data), 1 << 20))
        if not part:
            raise ConnectionResetError
        data += part
    return bytes(data)


def confine(memory_bytes: int) -> None:
    """No more addresses than that, as far as the system allows, and no core dump."""
    for what, most in ((resource.RLIMIT_AS, memory_bytes), (resource.RLIMIT_CORE, 0)):
        _, hard = resource.getrlimit(what)
        limit = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(what, (limit, limit))
