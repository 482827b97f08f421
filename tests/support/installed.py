"""Touchline as it is installed without extras: the wheel of this checkout, in an environment of its own.

The environment lies in build/, and is made anew only where what Touchline depends on has changed; the wheel is built in
every process that asks, and installed where it differs from the one that is there.
"""

import fcntl
import hashlib
import os
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.support.paths import ROOT

PLACE = ROOT / "build" / "installed"
GENERATOR = ROOT / "build" / "generator"
GENERATOR_NEEDS = ("openapi-python-client==0.29.1", "python-dateutil")


@cache
def installed_python() -> Path:
    """Return the Python of the environment. Its working folder must not be the project's, or that is imported."""
    PLACE.mkdir(parents=True, exist_ok=True)
    with _alone():
        return _install()


def clean_environment() -> dict[str, str]:
    """Return the variables of this process without those that lead Python to other packages, and without settings."""
    return {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("PYTHON", "VIRTUAL_ENV", "TOUCHLINE_"))
    }


@contextmanager
def _alone() -> Iterator[None]:
    """One worker installs, the others wait for it."""
    with (PLACE / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def _install() -> Path:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    needs = repr((sys.version, project["dependencies"])).encode()
    folder = PLACE / hashlib.sha256(needs).hexdigest()[:12]
    python, stamp = folder / "bin" / "python", folder / "WHEEL"
    with TemporaryDirectory(prefix="touchline-wheel-") as work:
        _run(sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", work)
        (wheel,) = Path(work).glob("touchline-*.whl")
        digest = hashlib.sha256(wheel.read_bytes()).hexdigest()
        if stamp.is_file() and stamp.read_text() == digest:
            return python
        pip = (
            python_with_pip(),
            "-m",
            "pip",
            "--python",
            python,
            "install",
            "--quiet",
            "--disable-pip-version-check",
        )
        if stamp.is_file():
            stamp.unlink()
            _run(*pip, "--no-deps", "--force-reinstall", wheel)
        else:
            shutil.rmtree(folder, ignore_errors=True)
            _run(sys.executable, "-m", "venv", "--without-pip", folder)
            _run(*pip, wheel)
        stamp.write_text(digest)
    return python


@cache
def generator_python() -> Path:
    """Return the Python of an environment with a generator of clients, which wants an older typer than ours."""
    python = GENERATOR / "bin" / "python"
    PLACE.mkdir(parents=True, exist_ok=True)
    with _alone():
        if not (GENERATOR / "COMPLETE").is_file():
            shutil.rmtree(GENERATOR, ignore_errors=True)
            _run(sys.executable, "-m", "venv", "--without-pip", GENERATOR)
            _run(
                python_with_pip(),
                "-m",
                "pip",
                "--python",
                python,
                "install",
                "--quiet",
                *GENERATOR_NEEDS,
            )
            (GENERATOR / "COMPLETE").touch()
    return python


def python_with_pip() -> Path:
    """Return a Python that has pip: the one that the environment of the tests was made with, or that environment's."""
    for python in (Path(sys.base_prefix, "bin", "python3"), Path(sys.executable)):
        if (
            python.exists()
            and subprocess.run([python, "-m", "pip", "--version"], capture_output=True).returncode
            == 0
        ):
            return python
    raise AssertionError("pip is missing: install the package python3-pip")


def _run(*words: str | Path) -> None:
    done = subprocess.run(words, cwd=ROOT, env=clean_environment(), capture_output=True, text=True)
    assert done.returncode == 0, f"{' '.join(map(str, words))}\n{done.stdout}\n{done.stderr}"
