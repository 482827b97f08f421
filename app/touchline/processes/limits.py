"""What a child process may use, so that strangers' bytes harm nobody but itself, and what it leaves to others."""

import ctypes
import os
import resource
import threading
from contextlib import suppress


def limit(memory_bytes: int, *, sealed: bool = False) -> None:
    """Allow this process so much address space, as far as the system does, and no core dump.

    sealed: from here on it writes no file, and opens and starts nothing.
    """
    limits = {resource.RLIMIT_AS: memory_bytes, resource.RLIMIT_CORE: 0}
    if sealed:
        limits |= {resource.RLIMIT_FSIZE: 0, resource.RLIMIT_NOFILE: 3}
    for what, most in limits.items():
        _, hard = resource.getrlimit(what)
        value = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(what, (value, value))


def give_way(nice: int) -> None:
    """Lower the priority of this thread alone by a niceness, where the system can: on Linux."""
    with suppress(OSError, AttributeError):
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), nice)


def return_memory() -> None:
    """Give back to the system what was freed, where the C library keeps it for later: the GNU one does."""
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
