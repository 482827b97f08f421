"""What tests leave behind is seen from its first moment on, or a test would be blamed for what was there before."""

import subprocess
import sys
from pathlib import Path

from tests.support.leftovers import leftovers, words_of

SLEEP = "import time; time.sleep(60)"


def test_a_process_has_its_name_from_its_first_moment_until_its_end():
    for _ in range(50):
        before = leftovers()
        with subprocess.Popen([sys.executable, "-c", SLEEP]) as process:
            assert words_of(Path("/proc", str(process.pid))).endswith(f"{SLEEP} ")
            assert [text.split(":")[0] for text in leftovers() - before] == [
                f"process {process.pid}"
            ]
            process.kill()
        assert leftovers() == before and words_of(Path("/proc", str(process.pid))) == ""
