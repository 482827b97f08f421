"""What a process uses, and what it leaves to others."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.waiting import until
from touchline.processes.start import ChildProcess, Program

# Many pieces too small to be the system's own mappings, freed but for the last, which holds the heap's end.
STORY = """
from touchline.processes.limits import return_memory

def held_mb():
    with open("/proc/self/statm") as text:
        return int(text.read().split()[1]) * 4096 / 1e6

pieces = [bytearray(100_000) for _ in range(500)]
full = held_mb()
del pieces[:-1]
kept = held_mb()
return_memory()
print(full - kept, kept - held_mb())
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the GNU C library's way")
def test_what_was_freed_goes_back_to_the_system():
    told = subprocess.run(
        [sys.executable, "-c", STORY], capture_output=True, text=True, check=True
    ).stdout.split()
    assert float(told[0]) < 5 and float(told[1]) > 40  # MB


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the GNU C library's way")
def test_the_threads_of_a_child_have_one_arena_of_which_all_can_be_returned():
    child = ChildProcess(Program("touchline.live.worker_main:main"), {})
    try:
        # empty for a moment, after the program was loaded and before the kernel has laid its memory out
        environment = until(Path(f"/proc/{child.pid}/environ").read_bytes)
        assert b"MALLOC_ARENA_MAX=1\0" in environment
    finally:
        child.close()
