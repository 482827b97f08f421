"""A disk that fails on demand, below everything: the operating system's calls of files.py and SQLite's own.

SQLite writes from C, out of a test's sight. Its file layer (the "VFS") is a table of functions, though, so here a copy
of that table stands in front of the real one, and its write, truncate and sync ask us first.
"""

import ctypes
import errno
import os
import threading
from contextlib import contextmanager

CALLS = ("open", "write", "fsync", "close", "replace")
FULL = (errno.ENOSPC, errno.EDQUOT)
SQLITE_OK, SQLITE_FULL = 0, 13
# What unix's file layer makes of an error that is not ENOSPC: SQLITE_IOERR and what was tried.
SQLITE_IOERR = {
    "sqlite write": 10 | 3 << 8,
    "sqlite truncate": 10 | 6 << 8,
    "sqlite sync": 10 | 4 << 8,
}


class Disk:
    """Every call of a save, written down; the one numbered fail_at fails, and where the disk is full all later ones."""

    def __init__(self, fail_at=None, code=errno.EIO):
        self.calls, self.fail_at, self.code = [], fail_at, code
        self.thread = threading.get_ident()
        for name in CALLS:
            setattr(self, name, self._watched(name))

    def __getattr__(self, name):
        return getattr(os, name)

    def fails(self, name):
        """Whether this call, which is written down, shall fail."""
        self.calls.append(name)
        number = len(self.calls) - 1
        if self.fail_at is None or number < self.fail_at:
            return False
        return number == self.fail_at or (self.code in FULL and name in ("write", "sqlite write"))

    def _watched(self, name):
        def call(*args, **more):
            if threading.get_ident() == self.thread and self.fails(name):
                if name == "close":
                    os.close(*args)  # the system lets go of the handle even then
                raise OSError(self.code, os.strerror(self.code))
            return getattr(os, name)(*args, **more)

        return call

    def sqlite_fails(self, name):
        """The code for SQLite, or SQLITE_OK."""
        if threading.get_ident() != self.thread or not self.fails(name):
            return SQLITE_OK
        return SQLITE_FULL if self.code == errno.ENOSPC else SQLITE_IOERR[name]


class _Methods(ctypes.Structure):
    _fields_ = [
        ("version", ctypes.c_int),
        ("close", ctypes.c_void_p),
        ("read", ctypes.c_void_p),
        ("write", ctypes.c_void_p),
        ("truncate", ctypes.c_void_p),
        ("sync", ctypes.c_void_p),
        ("others", ctypes.c_void_p * 13),
    ]


class _Vfs(ctypes.Structure):
    _fields_ = [
        ("version", ctypes.c_int),
        ("file_size", ctypes.c_int),
        ("longest_path", ctypes.c_int),
        ("next", ctypes.c_void_p),
        ("name", ctypes.c_char_p),
        ("data", ctypes.c_void_p),
        ("open", ctypes.c_void_p),
        ("others", ctypes.c_void_p * 15),
    ]


WRITE = ctypes.CFUNCTYPE(
    ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int, ctypes.c_int64
)
TRUNCATE = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_int64)
SYNC = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_int)
OPEN = ctypes.CFUNCTYPE(
    ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p
)


class FailingSqlite:
    """SQLite's default file layer for every database that this process opens from now on, until remove()."""

    def __init__(self):
        self.disk = None  # the Disk that is asked, if any
        import _sqlite3  # noqa: F401  the library that Python uses must be there before it is looked for

        self._library = ctypes.CDLL("libsqlite3.so.0")
        self._library.sqlite3_vfs_find.restype = ctypes.POINTER(_Vfs)
        self._library.sqlite3_vfs_find.argtypes = [ctypes.c_char_p]
        self._real = self._library.sqlite3_vfs_find(None)
        self._tables = {}  # address of a real table of functions: (our copy, the functions in it)
        self._real_open = OPEN(self._real.contents.open)
        self._open = OPEN(self._opened)
        self._ours = _Vfs.from_buffer_copy(self._real.contents)
        self._ours.name = b"failing"
        self._ours.next = None
        self._ours.open = ctypes.cast(self._open, ctypes.c_void_p)
        assert self._library.sqlite3_vfs_register(ctypes.byref(self._ours), 1) == SQLITE_OK

    def remove(self):
        self._library.sqlite3_vfs_register(self._real, 1)
        self._library.sqlite3_vfs_unregister(ctypes.byref(self._ours))

    def _opened(self, _, name, file, flags, out_flags):
        code = self._real_open(ctypes.addressof(self._real.contents), name, file, flags, out_flags)
        methods = ctypes.cast(file, ctypes.POINTER(ctypes.c_void_p))
        if code == SQLITE_OK and methods[0]:
            methods[0] = ctypes.addressof(self._copy_of(methods[0])[0])
        return code

    def _copy_of(self, address):
        if address not in self._tables:
            real = _Methods.from_address(address)
            copy = _Methods.from_buffer_copy(real)
            kept = [
                self._asked("sqlite write", WRITE, real.write),
                self._asked("sqlite truncate", TRUNCATE, real.truncate),
                self._asked("sqlite sync", SYNC, real.sync),
            ]
            copy.write, copy.truncate, copy.sync = (
                ctypes.cast(function, ctypes.c_void_p) for function in kept
            )
            self._tables[address] = (copy, kept)
        return self._tables[address]

    def _asked(self, name, kind, address):
        real = kind(address)

        def call(*args):
            code = self.disk.sqlite_fails(name) if self.disk is not None else SQLITE_OK
            return code or real(*args)

        return kind(call)


def can_fail():
    """Whether Python's SQLite is the system's library, whose file layer can be stood in front of."""
    try:
        ctypes.CDLL("libsqlite3.so.0")
    except OSError:
        return False
    import _sqlite3

    with open(_sqlite3.__file__, "rb") as file:
        return b"libsqlite3.so.0" in file.read()


@contextmanager
def failing(monkeypatch_context, sqlite, disk):
    """Within the block, that disk is the one that everything is saved to."""
    with monkeypatch_context() as patch:
        patch.setattr("touchline.store.files.os", disk)
        sqlite.disk = disk
        try:
            yield disk
        finally:
            sqlite.disk = None
