"""A real Dask cluster on this machine: a scheduler and workers, each a process of its own on a free port."""

import os
import socket
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

from tests.support.paths import ROOT

ENVIRONMENT = os.environ | {
    "PYTHONPATH": str(ROOT),
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "PYTHONWARNINGS": "ignore",
}


class DaskCluster:
    """Processes are started and killed one by one; a worker without its nanny stays dead."""

    def __init__(self, folder: Path, kind: str = "tcp") -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self._folder = folder
        self._host = f"{kind}://127.0.0.1"
        self._url = f"{self._host}:{self.port}"
        self.environment: dict[str, str] = {}
        self.scheduler: subprocess.Popen | None = None
        self.workers: list[subprocess.Popen] = []

    @property
    def address(self) -> str:
        return f"dask://127.0.0.1:{self.port}"

    def start_scheduler(self) -> None:
        self.scheduler = self._start(
            "scheduler",
            "--host",
            self._host,
            "--port",
            str(self.port),
            "--no-dashboard",
            "--no-jupyter",
        )

    def start_workers(self, count: int) -> None:
        self.workers += [
            self._start(
                "worker",
                self._url,
                "--host",
                self._host,
                "--nthreads",
                "1",
                "--no-dashboard",
                "--no-nanny",
                "--local-directory",
                str(self._folder),
            )
            for _ in range(count)
        ]

    def until_there(self, count: int, seconds: float = 90.0) -> None:
        """Wait for so many workers, so that a test does not measure their start."""
        from distributed import Client

        with Client(self._url, timeout=seconds, set_as_default=False) as client:
            client.wait_for_workers(count, timeout=seconds)

    def end(self) -> None:
        for process in (*self.workers, self.scheduler):
            if process is not None:
                process.kill()
                process.wait()

    def _start(self, what: str, *words: str) -> subprocess.Popen:
        with (self._folder / f"{what}-{time.monotonic_ns()}.log").open("w") as log:
            return subprocess.Popen(
                [sys.executable, "-m", f"distributed.cli.dask_{what}", *words],
                env=ENVIRONMENT | self.environment,
                cwd=self._folder,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
            )


@contextmanager
def dask_cluster(folder: Path, workers: int = 2):
    cluster = DaskCluster(folder)
    try:
        cluster.start_scheduler()
        cluster.start_workers(workers)
        if workers:
            cluster.until_there(workers)
        yield cluster
    finally:
        cluster.end()
