"""Runs the tests:  .venv/bin/python -m tests [CAPABILITY …] [--merge | --all | --within MINUTES] [of pytest …]

Without a word the default tier. CAPABILITY: all tests of rigs, boards, … and the rules of the code's structure.
--merge: the merge tier too; what it took is written to tests/seconds.tsv. --all: the long tests too. --within: the
default tier, then as much of the merge tier as there is time for since the start; where TOUCHLINE_CHANGED_SINCE names a
commit, of what changed since. Other arguments go to pytest.

Brings its own browser where it can, and says what it does. Two runs of pytest, because Playwright keeps an event loop
in the main thread: everything without a browser, and the page in a real Chromium; one story in Firefox and WebKit,
where those are installed. The few stories of the default tier run beside the rest, others after it. No test is run
twice: one that fails now and then shows a race, in the page or in the test. Races are looked for with late answers
(tests/support/late_answers.py).
"""

import argparse
import compileall
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from itertools import takewhile
from pathlib import Path
from tempfile import TemporaryFile

from tests.support.capabilities import CAPABILITIES, files_of, files_touched
from tests.support.tiers import BROWSER

ROOT = Path(__file__).parents[1]
NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
# of each worker: there is one for each core
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
NO_TESTS = 5  # pytest's exit code where nothing was selected
STRUCTURE = "tests/project/test_architecture.py"
DEFAULT, MERGE, ALL = ("not merge", "not long"), ("not long",), ()
COLLECTING_S = 60  # of both runs, before the first test starts
REST = ("merge", "not long")  # of the merge tier, after the default one


def main() -> int:
    """Exit code 0 where all runs passed."""
    started_s = time.time()
    asked, words = arguments().parse_known_args()
    capabilities = list(takewhile(CAPABILITIES.__contains__, words))
    runs = Runs(words[len(capabilities) :])
    if capabilities:
        return runs.both(ALL if asked.all else MERGE, [*files_of(*capabilities), STRUCTURE])
    if asked.merge or asked.all:
        return runs.both(ALL if asked.all else MERGE, measured=not words)
    if code := runs.beside():
        return code
    return 0 if asked.within is None else runs.rest(started_s + 60 * asked.within)


def arguments() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m tests",
        allow_abbrev=False,
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    tier = parser.add_mutually_exclusive_group()
    tier.add_argument("--merge", action="store_true")
    tier.add_argument("--all", action="store_true")
    tier.add_argument("--within", type=float, metavar="MINUTES")
    return parser


class Runs:
    """Runs of pytest: what needs no browser, then what needs one."""

    def __init__(self, words: Sequence[str]) -> None:
        """words: arguments of pytest."""
        self.words = words
        self.chromium = find_chromium() or install_from_packages() or install_with_playwright()
        if self.chromium is None:
            say(
                "There is no Chromium, and none could be installed. Install one, such as: apt-get install chromium. Or "
                "set TOUCHLINE_CHROMIUM to the path of a Chromium or Chrome. The tests without a browser run now."
            )
        else:
            say(f"Browser for the tests of the page: {self.chromium}{version_of(self.chromium)}")
        self.environment = {
            **ONE_THREAD,
            **os.environ,
            **({"TOUCHLINE_CHROMIUM": self.chromium} if self.chromium else {}),
        }
        # Workers, and the servers that they start, read compiled modules: a third of the time to start.
        self.environment.pop("PYTHONDONTWRITEBYTECODE", None)
        compileall.compile_dir(ROOT / "app", quiet=1, workers=0)

    def beside(self) -> int:
        """Exit code of the default tier: browsers wait most of the time, so their run is told after the other one."""
        if self.chromium is None or self.words:
            return self.both(DEFAULT)
        say("1 of 2: everything without a browser, and meanwhile the page in a real one")
        with TemporaryFile() as told:
            with subprocess.Popen(
                self.command(("e2e", *DEFAULT), ["-n", "1"], [BROWSER]),
                cwd=ROOT,
                env=self.environment,
                stdout=told,
                stderr=subprocess.STDOUT,
            ) as page:
                first = self.pytest(("not e2e", *DEFAULT), self.at_once(), ["--ignore", BROWSER])
            say("2 of 2: the page in a real browser")
            told.seek(0)
            print(told.read().decode(errors="replace"), flush=True)
        return first or page.returncode

    def both(
        self,
        tier: Sequence[str],
        files: Sequence[str] = (),
        measured: bool = False,
        until_s: Sequence[float] = (),
    ) -> int:
        """Exit code of one tier, of these files or of those that pytest's arguments name, else of all.

        measured: whether the seconds are written. until_s: when the one run and the other start no further test.
        """
        named = any((ROOT / word.partition("::")[0]).exists() for word in self.words)
        pages = [path for path in files if path.startswith(BROWSER)]
        others = [path for path in files if path not in pages]
        say("1 of 2: everything without a browser")
        first = 0
        if others or not files:
            where = others or ([] if named else ["--ignore", BROWSER])
            first = self.pytest(
                ("not e2e", *tier), self.at_once(spare=1), where, measured, until_s[:1]
            )
        if self.chromium is None:
            return first or 1
        say("2 of 2: the page in a real browser")
        if pages or not files:
            where = pages or ([] if named else [BROWSER])
            return (
                self.pytest(("e2e", *tier), self.at_once(), where, measured, until_s[1:]) or first
            )
        return first

    def rest(self, end_s: float) -> int:
        """Exit code of as much of the merge tier as a change asks for and the time allows."""
        commit = os.environ.get("TOUCHLINE_CHANGED_SINCE", "")
        changed = subprocess.run(
            ["git", "diff", "--name-only", commit, "--"], cwd=ROOT, capture_output=True, text=True
        )
        files = (
            files_touched(changed.stdout.splitlines())
            if commit and changed.returncode == 0
            else None
        )
        left_s = end_s - time.time()
        if files == []:
            say("The default tests cover what has changed.")
            return 0
        if left_s < COLLECTING_S:
            say("No time is left for the merge tier.")
            return 0
        what = "everything" if files is None else f"{len(files)} files that the change asks for"
        say(f"The merge tier, as far as {left_s / 60:.1f} min allow: {what}")
        return self.both(REST, files or (), until_s=[end_s - left_s / 2, end_s])

    def at_once(self, spare: int = 0) -> list[str]:
        """One worker for each core, unless an argument says otherwise; one without tests left takes some of another's.

        spare: so many more, where tests wait for sockets and processes most of the time.
        """
        if any(word.startswith("-n") for word in self.words):
            return []
        return ["-n", str(min(4, (os.cpu_count() or 1) + spare)), "--dist", "worksteal"]

    def command(
        self, marks: Sequence[str], workers: Sequence[str], files: Sequence[str]
    ) -> list[str]:
        return [
            sys.executable,
            "-m",
            "pytest",
            "-m",
            " and ".join(marks),
            *workers,
            *self.words,
            *files,
        ]

    def pytest(
        self,
        marks: Sequence[str],
        workers: Sequence[str],
        files: Sequence[str],
        measured: bool = False,
        until_s: Sequence[float] = (),
    ) -> int:
        """One run; a run with nothing to do has passed."""
        plugin = ["-p", "tests.support.seconds"] if measured else []
        until = {"TOUCHLINE_TESTS_UNTIL": str(until_s[0])} if until_s else {}
        command = self.command(marks, [*workers, *plugin], files)
        code = subprocess.run(command, cwd=ROOT, env=self.environment | until).returncode
        return 0 if code == NO_TESTS else code


def find_chromium() -> str | None:
    """From TOUCHLINE_CHROMIUM, on PATH, or where Playwright puts its own."""
    named = os.environ.get("TOUCHLINE_CHROMIUM")
    if named and not shutil.which(named):
        say(f"TOUCHLINE_CHROMIUM names {named}, which is no program; looking elsewhere.")
    for name in (named, *NAMES):
        path = shutil.which(name) if name else None
        if path and works(path):
            return path
    return playwrights()


def install_from_packages() -> str | None:
    """apt-get install chromium, as root or with sudo that asks nothing."""
    if not shutil.which("apt-get"):
        return None
    prefix = [] if os.geteuid() == 0 else ["sudo", "-n"]
    if prefix and (
        not shutil.which("sudo")
        or subprocess.run(["sudo", "-n", "true"], capture_output=True).returncode
    ):
        say("No Chromium here, and no right to install one from the distribution's packages.")
        return None
    say("No Chromium here: installing the distribution's (apt-get install chromium).")
    quiet = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    install = ["apt-get", "install", "-y", "-q", "--no-install-recommends", "chromium"]
    for command in (["apt-get", "update", "-q"], install):
        if prefix:
            command = [*prefix, "env", "DEBIAN_FRONTEND=noninteractive", *command]
        if subprocess.run(command, env=quiet, stdout=subprocess.DEVNULL).returncode:
            say(f"That did not work: {' '.join(command)}")
            return None
    # Ubuntu's package is a stub that points at a snap, which needs a running snapd: try it before trusting it.
    path = shutil.which("chromium")
    return path if path and works(path) else None


def install_with_playwright() -> str | None:
    """Playwright's own Chromium, with the system libraries it needs where we may install them."""
    may_install = os.geteuid() == 0 or (
        shutil.which("sudo") is not None
        and subprocess.run(["sudo", "-n", "true"], capture_output=True).returncode == 0
    )
    say("Downloading Playwright's Chromium (playwright install chromium).")
    command = [
        sys.executable,
        "-m",
        "playwright",
        "install",
        *(["--with-deps"] if may_install else []),
        "chromium",
    ]
    if subprocess.run(command).returncode:
        say(f"That did not work: {' '.join(command)}")
        return None
    return playwrights()


def playwrights() -> str | None:
    """The Chromium that Playwright has installed earlier, if it has."""
    ask = (
        "from playwright.sync_api import sync_playwright\n"
        "with sync_playwright() as p: print(p.chromium.executable_path)"
    )
    answer = subprocess.run([sys.executable, "-c", ask], capture_output=True, text=True)
    path = answer.stdout.strip()
    return path if answer.returncode == 0 and os.path.exists(path) and works(path) else None


def works(path: str) -> bool:
    """Whether it starts at all."""
    try:
        return subprocess.run([path, "--version"], capture_output=True, timeout=60).returncode == 0
    except (OSError, subprocess.TimeoutExpired):
        return False


def version_of(path: str) -> str:
    return ", " + subprocess.run([path, "--version"], capture_output=True, text=True).stdout.strip()


def say(text: str) -> None:
    print(f"\n── {text}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
