"""What a child process may use, so that strangers' bytes harm nobody but itself."""

import resource


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
