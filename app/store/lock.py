"""A lock for one server a data folder: two would overwrite each other's work without noticing."""

import fcntl
import os
from pathlib import Path

from app.core.errors import Unavailable


class FolderLock:
    """Locked until close(), or until the process ends, however it does."""

    def __init__(self, folder: Path) -> None:
        path = folder / "lock"
        self._handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
        try:
            fcntl.flock(self._handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            owner = os.read(self._handle, 20).decode("ascii", "replace").strip()
            os.close(self._handle)
            raise Unavailable(f"The data folder {folder} is in use by another Touchline (process "
                              f"{owner or 'unknown'}).",
                              "Stop that process, or choose another folder with --data.",
                              reason="data-folder-in-use") from None
        os.ftruncate(self._handle, 0)
        os.pwrite(self._handle, f"{os.getpid()}\n".encode(), 0)

    def close(self) -> None:
        if self._handle >= 0:
            os.close(self._handle)
            self._handle = -1
