"""A real server in a process of its own, started by the shell's own command, and plain HTTP to it."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from http.client import HTTPConnection
from pathlib import Path
from typing import IO
from urllib.parse import urlsplit

from tests.support.installed import clean_environment
from tests.support.paths import ROOT

API = "/api/v1"
BOUNDARY = "b0undary"


@contextmanager
def served(
    data: Path, *words: str, log: IO | None = None, python: Path | None = None, project: Path = ROOT
) -> Iterator[str]:
    """The address of a server on that data folder; its log goes there, else to where the test's own goes.

    python: of an environment in which Touchline is installed, instead of this one and the project's sources. project: a
    copy of the project, with other sources.
    """
    environment = {**os.environ, "PYTHONPATH": f"{project / 'app'}"} if project != ROOT else None
    process = subprocess.Popen(
        [
            python or sys.executable,
            "-c",
            "from touchline.cli import main; main()",
            "serve",
            "--port",
            "0",
            "--data",
            str(data),
            *words,
        ],
        cwd=data if python else project,
        env=clean_environment() if python else environment,
        stdout=subprocess.PIPE,
        stderr=log,
        text=True,
    )
    assert process.stdout is not None
    try:
        yield process.stdout.readline().split()[-1].rstrip("/")
        assert process.poll() is None, "the server has died"
    finally:
        process.send_signal(signal.SIGTERM)
        process.wait(20)
        process.stdout.close()


class Line:
    """One caller's connection: kept open, opened anew where the server has closed it."""

    def __init__(self, url: str) -> None:
        self.place = urlsplit(url).netloc
        self._line = HTTPConnection(self.place, timeout=60)

    def ask(self, method: str, path: str, body: bytes | None = None, headers: dict | None = None):
        """(status, headers, bytes) of the answer."""
        try:
            self._line.request(method, API + path, body, headers or {})
            answer = self._line.getresponse()
        except OSError:
            self._line.close()
            self._line = HTTPConnection(self.place, timeout=60)
            self._line.request(method, API + path, body, headers or {})
            answer = self._line.getresponse()
        return answer.status, answer.headers, answer.read()

    def json(self, method: str, path: str, value=None, headers: dict | None = None):
        """(status, headers, parsed JSON)."""
        body = None if value is None else json.dumps(value).encode()
        status, told, content = self.ask(
            method, path, body, {"Content-Type": "application/json", **(headers or {})}
        )
        return status, told, json.loads(content) if content else None

    def close(self) -> None:
        self._line.close()


def form(data: bytes) -> tuple[bytes, dict]:
    """A file as multipart, with its header."""
    head = f'--{BOUNDARY}\r\nContent-Disposition: form-data; name="file"; filename="f"\r\n\r\n'.encode()
    return (
        head + data + f"\r\n--{BOUNDARY}--\r\n".encode(),
        {"Content-Type": f"multipart/form-data; boundary={BOUNDARY}"},
    )


def an_export(url: str, task: dict) -> dict:
    """A calibration that the server has made and written, to be imported again under other names."""
    with closing(Line(url)) as line:
        status, _, made = line.json("POST", "/calibrations", {**task, "options": {"degree": 2}})
        assert status == 201, made
        status, _, content = line.ask("GET", f"/calibrations/{made['id']}/export/json")
        assert status == 200
        return json.loads(content)
