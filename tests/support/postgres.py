"""A real PostgreSQL for the tests: a server of their own in a temporary folder, on a free port of this machine.

Debian's package puts its programs into /usr/lib/postgresql/VERSION/bin. The server refuses to run as root, so root
starts it as the user "postgres" (or "nobody").
"""

import os
import pwd
import shutil
import socket
import subprocess
import tempfile
import time
from contextlib import closing
from pathlib import Path

FOLDER_PREFIX = "touchline-postgres-"
START_S = 60
QUICK = (
    "fsync=off",
    "full_page_writes=off",
    "max_connections=60",
    "shared_buffers=64MB",
    "log_min_messages=fatal",
)


def programs() -> Path | None:
    """Where initdb and postgres are; None where they are not installed."""
    found = sorted(
        Path("/usr/lib/postgresql").glob("*/bin/initdb"),
        key=lambda path: int(path.parts[-3].split(".")[0]),
    )
    if found:
        return found[-1].parent
    initdb = shutil.which("initdb")
    return Path(initdb).resolve().parent if initdb else None


class PostgresServer:
    """A running server; every folder that is asked for has a schema of its own."""

    def __init__(self) -> None:
        found = programs()
        assert found is not None
        self._bin = found
        self._as = _unprivileged()
        # pytest's folders are for their owner alone
        self._home = Path(tempfile.mkdtemp(prefix=FOLDER_PREFIX))
        self._folder = self._home / "cluster"
        if self._as:
            os.chown(self._home, *self._as)
        self._run(
            "initdb",
            "-D",
            str(self._folder),
            "-U",
            "tests",
            "-A",
            "trust",
            "-E",
            "UTF8",
            "--no-sync",
            "--locale=C",
        )
        self.port = _free_port()
        self._names: dict[Path, str] = {}
        self.process: subprocess.Popen | None = None
        self.start()

    def start(self) -> None:
        """Start it, and wait until it answers."""
        options = [word for option in QUICK for word in ("-c", option)]
        self.process = subprocess.Popen(
            [
                str(self._bin / "postgres"),
                "-D",
                str(self._folder),
                "-h",
                "127.0.0.1",
                "-p",
                str(self.port),
                "-k",
                str(self._folder),
                *options,
            ],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            cwd="/",
            **self._user(),
        )
        until = time.monotonic() + START_S
        while subprocess.run(
            [str(self._bin / "pg_isready"), "-q", "-h", "127.0.0.1", "-p", str(self.port)]
        ).returncode:
            assert self.process.poll() is None, "PostgreSQL did not start"
            assert time.monotonic() < until, "PostgreSQL did not answer"
            time.sleep(0.05)

    def stop(self) -> None:
        """End it at once, as a power cut would."""
        assert self.process is not None
        self.process.send_signal(3)  # SIGQUIT: immediate shutdown
        self.process.wait(30)

    def remove(self) -> None:
        """End it and delete all of it."""
        self.stop()
        shutil.rmtree(self._home, ignore_errors=True)

    def database(self, folder: Path) -> str:
        """The address of an empty schema for that data folder, made when it is asked for first."""
        import psycopg

        address = f"//tests@127.0.0.1:{self.port}/postgres"
        name = self._names.get(folder)
        if name is None:
            name = self._names[folder] = f"t{len(self._names)}"
            with psycopg.connect(f"postgresql:{address}", autocommit=True) as connection:
                connection.execute(f"CREATE SCHEMA {name}")
        return f"postgresql+psycopg:{address}?options=-csearch_path%3D{name}"

    def _run(self, program: str, *words: str) -> None:
        subprocess.run(
            [str(self._bin / program), *words],
            check=True,
            stdout=subprocess.DEVNULL,
            cwd="/",
            **self._user(),
        )

    def _user(self) -> dict:
        return {"user": self._as[0], "group": self._as[1], "extra_groups": []} if self._as else {}


def _unprivileged() -> tuple[int, int] | None:
    """(user, group) to run it as, where we are root."""
    if os.geteuid() != 0:
        return None
    for name in ("postgres", "nobody"):
        try:
            entry = pwd.getpwnam(name)
        except KeyError:
            continue
        return entry.pw_uid, entry.pw_gid
    return None


def _free_port() -> int:
    with closing(socket.socket()) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]
