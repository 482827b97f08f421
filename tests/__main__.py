"""Runs the default tests:  .venv/bin/python -m tests

With --all those that are marked `long` as well. Brings its own browser where it can, and says what it does. Two runs
of pytest, because Playwright keeps an event loop in the main thread: first everything without a browser, then the page
in a real Chromium; one story in Firefox and WebKit, where those are installed. Other arguments go to both.

No test is run twice: one that fails now and then shows a race, in the page or in the test. Races are looked for with
late answers (tests/support/late_answers.py).
"""

import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).parents[1]
ALL = "--all"
NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}  # of each worker: there is one for each core
NO_TESTS = 5  # pytest's exit code where nothing was selected


def main() -> int:
    """Exit code 0 where both runs passed."""
    chromium = find_chromium() or install_from_packages() or install_with_playwright()
    if chromium is None:
        say("There is no Chromium, and none could be installed. Install one, such as: apt-get install chromium. "
            "Or set TOUCHLINE_CHROMIUM to the path of a Chromium or Chrome. The tests without a browser run now.")
    else:
        say(f"Browser for the tests of the page: {chromium}{version_of(chromium)}")
    environment = {**ONE_THREAD, **os.environ, **({"TOUCHLINE_CHROMIUM": chromium} if chromium else {})}
    tier = "" if ALL in sys.argv else " and not long"
    say("1 of 2: everything without a browser")
    first = pytest(f"not e2e{tier}", environment, at_once(spare=1))
    if chromium is None:
        return first or 1
    say("2 of 2: the page in a real browser")
    second = pytest(f"e2e{tier}", environment, at_once())
    return first or second


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
    if prefix and (not shutil.which("sudo") or subprocess.run(["sudo", "-n", "true"], capture_output=True).returncode):
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
    may_install = os.geteuid() == 0 or (shutil.which("sudo") is not None and
                                        subprocess.run(["sudo", "-n", "true"], capture_output=True).returncode == 0)
    say("Downloading Playwright's Chromium (playwright install chromium).")
    command = [sys.executable, "-m", "playwright", "install", *(["--with-deps"] if may_install else []), "chromium"]
    if subprocess.run(command).returncode:
        say(f"That did not work: {' '.join(command)}")
        return None
    return playwrights()


def playwrights() -> str | None:
    """The Chromium that Playwright has installed earlier, if it has."""
    ask = ("from playwright.sync_api import sync_playwright\n"
           "with sync_playwright() as p: print(p.chromium.executable_path)")
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


def at_once(spare: int = 0) -> list[str]:
    """One worker for each core, unless an argument says otherwise; one that has no test left takes some of another's.

    spare: so many more, where tests wait for sockets and processes most of the time.
    """
    if any(argument.startswith("-n") for argument in sys.argv[1:]):
        return []
    return ["-n", str(min(4, (os.cpu_count() or 1) + spare)), "--dist", "worksteal"]


def pytest(marker: str, environment: dict[str, str], more: Sequence[str] = ()) -> int:
    """One run; a run with nothing to do has passed."""
    arguments = [argument for argument in sys.argv[1:] if argument != ALL]
    command = [sys.executable, "-m", "pytest", "-m", marker, *more, *arguments]
    code = subprocess.run(command, cwd=ROOT, env=environment).returncode
    return 0 if code == NO_TESTS else code


def say(text: str) -> None:
    print(f"\n── {text}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
