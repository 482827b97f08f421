"""What a test leaves behind: child processes, threads, files in the project's folder, and memory."""

import sys
import threading
import time
from pathlib import Path
from types import ModuleType

from tests.support.paths import ROOT
from tests.support.postgres import FOLDER_PREFIX
from tests.support.standing_processes import standing_pids
from touchline.processes.limits import return_memory
from touchline.processes.start import REAPER

CACHES = (
    ".",
    "__pycache__",  # of hatch_build.py, which lies there
    # the page's libraries and the type checker, fetched by the first test that needs them
    "build",
)
# Dask's, and those of Playwright's loop: as long as Python runs
OF_LIBRARIES = ("Dask-Callback-Thread", "asyncio_")


def leftovers() -> set[str]:
    """Everything that could have been left, each in a few words. Caches, most with a dot before, do not count."""
    threads = {
        f"thread {thread.ident}: {thread.name}"
        for thread in threading.enumerate()
        # whose process counts itself
        if not thread.name.startswith((*OF_LIBRARIES, REAPER))
    }
    files = {f"file {path}" for path in ROOT.iterdir() if not path.name.startswith(CACHES)}
    return _children() | threads | files


def forget_cached(module: ModuleType) -> None:
    """Empty the caches of a file of tests and of the helpers: the renderings in them take a hundred MB each."""
    helpers = [helper for name, helper in sys.modules.items() if name.startswith("tests.support.")]
    for place in (module, *helpers):
        for value in list(vars(place).values()):
            if hasattr(value, "cache_clear"):
                value.cache_clear()
    return_memory()


def _children() -> set[str]:
    """Direct children: what one of them has started ends with it, or is looked for by a test of its own."""
    found = set()
    for thread in Path("/proc/self/task").iterdir():
        for pid in _read(thread / "children").split():
            words = words_of(Path("/proc", pid))
            # those that serve all tests
            if words and FOLDER_PREFIX not in words and int(pid) not in standing_pids():
                found.add(f"process {pid}: {words[:100]}")
    return found


def words_of(process: Path) -> str:
    """A process's command line; nothing of one that has ended. One that was born a moment ago has none yet."""
    while True:
        words = _read(process / "cmdline").replace("\0", " ")
        if words or _read(process / "stat").rpartition(")")[2].split()[:1] in ([], ["Z"], ["X"]):
            return words
        time.sleep(0.001)


def _read(path: Path) -> str:
    """What the system says of a thread or a process; nothing once it has ended."""
    try:
        return path.read_text(errors="replace")
    except OSError:
        return ""
