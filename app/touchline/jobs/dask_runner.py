"""Jobs on a Dask cluster: the connection that all runners share, and one job at a time with its scheduler.

Which worker does a job, and how much memory it may take, is the cluster's affair. A job that is cancelled, or out of
time, stops at its next report of progress; one that reports none is abandoned, and what it returns is thrown away.
"""

import importlib.util
import json
import math
import queue
import re
import secrets
import socket
import time
from collections.abc import Callable
from concurrent.futures import CancelledError
from dataclasses import dataclass, field
from threading import Lock, Thread
from typing import Any

from touchline.core.errors import BadInput, TouchlineError, Unavailable
from touchline.core.sentences import install_package
from touchline.core.statements import join, say, sentence_in
from touchline.installation import __version__
from touchline.jobs.dask_task import do
from touchline.jobs.runner import JobFailed, JobStopped, JobTimeout, Report, WorkerDied

ADDRESS = re.compile(r"dask(?P<tls>\+tls)?://(?P<host>[^/:\[\]]+):(?P<port>\d{1,5})")
CONNECT_S = 10.0  # a scheduler that is started anew is back by then
HANDSHAKE_S = 30.0  # one that answers may be busy
CONNECT_POLL_S = 0.2
CLOSE_S = 2.0

POLL_S = 0.05  # how often we look whether a job is still wanted
WAITING_NOTICE_S = 0.5  # before it is event that a job waits for a worker
ANSWER_S = 30.0  # for a result to come over from the worker


@dataclass(frozen=True, eq=False)
class SubmittedJob:
    """A job on the cluster. inbox: its events, dicts with "kind"."""

    client: Any
    future: Any
    inbox: "queue.SimpleQueue[dict[str, Any]]" = field(default_factory=queue.SimpleQueue)


class DaskCluster:
    """Thread-safe. address: dask://host:port, or dask+tls://host:port with certificates from Dask's own settings."""

    def __init__(self, address: str) -> None:
        found = ADDRESS.fullmatch(address)
        if found is None or int(found["port"]) > 65535:
            raise BadInput(
                f"{address!r} is not the address of a scheduler.",
                "Enter it as dask://host:port.",
                reason="bad-settings",
            )
        if importlib.util.find_spec("distributed") is None:
            raise Unavailable(
                "Jobs on a cluster need the Python package distributed.",
                join(install_package("distributed"), "Or set jobs.engine to local."),
                reason="no-dask",
            )
        self._host, self._port, self._tls = found["host"], int(found["port"]), bool(found["tls"])
        self._client: Any = None
        self._inboxes: dict[str, queue.SimpleQueue[dict[str, Any]]] = {}
        self._lock = Lock()
        self._closed = False

    def submit(self, run: str, spec: Any, is_wanted: Callable[[], bool]) -> SubmittedJob:
        """Give a job to the cluster. Unavailable without a scheduler; JobStopped where nobody wants it any more."""
        client = self._connected(is_wanted)
        key, topic = f"touchline-{secrets.token_hex(8)}", f"touchline-{client.id}"
        inbox = self._inboxes[key] = queue.SimpleQueue()
        # With every job, for a scheduler that was started anew has forgotten its subscribers.
        client.subscribe_topic(topic, self._on_event)
        client.subscribe_topic("all", self._on_cluster_event)
        request = {"key": key, "topic": topic, "version": __version__, "run": run, "spec": spec}
        future = client.submit(do, json.dumps(request, allow_nan=False), key=key, pure=False)
        future.add_done_callback(lambda _: inbox.put({"kind": "ended"}))
        return SubmittedJob(client, future, inbox)

    def release(self, job: SubmittedJob) -> None:
        """Forget its result: a job that still runs is cancelled, without waiting for anything."""
        self._inboxes.pop(job.future.key, None)
        job.future.release()

    def disconnect(self, client: Any) -> None:
        """Drop a connection that broke; the next job makes another."""
        with self._lock:
            if self._client is client:
                self._client = None
        Thread(target=client.close, kwargs={"timeout": CLOSE_S}, daemon=True).start()

    def end(self) -> None:
        """Make no more connections; whoever waits for one gets JobStopped."""
        self._closed = True

    def close(self) -> None:
        self.end()
        with self._lock:
            client, self._client = self._client, None
        if client is not None:
            client.close(timeout=CLOSE_S)

    def _connected(self, is_wanted: Callable[[], bool]) -> Any:
        with self._lock:
            if self._client is not None and self._client.status == "running":
                return self._client
            if self._client is not None:
                Thread(target=self._client.close, kwargs={"timeout": CLOSE_S}, daemon=True).start()
            self._client = None
            self._client = self._connect(lambda: is_wanted() and not self._closed)
            return self._client

    def _connect(self, is_wanted: Callable[[], bool]) -> Any:
        """A plain connection is tried first: it can be given up at once, which Dask's own cannot."""
        until = time.monotonic() + CONNECT_S
        while True:
            if not is_wanted():
                raise JobStopped
            try:
                socket.create_connection((self._host, self._port), timeout=1.0).close()
                return self._new_client()
            # Dask's handshake raises both where a busy scheduler answers late
            except (OSError, AssertionError):
                if time.monotonic() > until:
                    raise self._unreachable() from None
                time.sleep(CONNECT_POLL_S)

    def _new_client(self) -> Any:
        from distributed import Client, Security

        try:
            security = Security(require_encryption=True) if self._tls else None
            # Asked here, since a client that has failed leaves the thread of its loop behind.
            if (
                security is not None
                and security.get_connection_args("client")["ssl_context"] is None
            ):
                raise ValueError("no certificate is set.")
            return Client(
                f"{'tls' if self._tls else 'tcp'}://{self._host}:{self._port}",
                timeout=HANDSHAKE_S,
                security=security,
                set_as_default=False,
                name="touchline",
            )
        except (RuntimeError, TypeError, ValueError) as error:
            raise Unavailable(
                f"Dask refuses to connect to {self._host}:{self._port}: {str(error)[:200]}",
                "Correct Dask's TLS settings: the files of the certificates and the key.",
                reason="no-scheduler",
            ) from None

    def _unreachable(self) -> TouchlineError:
        return Unavailable(
            say(
                "cluster.no-scheduler",
                "The cluster's scheduler at {host}:{port} is not responding.",
                host=self._host,
                port=self._port,
            ),
            say(
                "cluster.start-scheduler",
                "Start it: dask scheduler --port {port}, then workers; or "
                "set jobs.engine to local.",
                port=self._port,
            ),
            reason="no-scheduler",
        )

    def _on_event(self, event: tuple[float, dict[str, Any]]) -> None:
        message = event[1]
        inbox = self._inboxes.get(message.get("key", ""))
        if inbox is not None and (
            message["kind"] != "progress" or math.isfinite(message["fraction"])
        ):
            inbox.put(message)

    def _on_cluster_event(self, event: tuple[float, dict[str, Any]]) -> None:
        if event[1].get("action") == "remove-worker":
            for inbox in list(self._inboxes.values()):
                inbox.put({"kind": "gone", "worker": event[1].get("worker")})


class DaskRunner:
    """Runs one job at a time on the cluster. Only end() may be called by another thread than its own."""

    def __init__(self, cluster: DaskCluster) -> None:
        self._cluster = cluster
        self._closed = False

    def run(
        self, run: str, spec: Any, report: Report, is_wanted: Callable[[], bool], wall_s: float
    ) -> Any:
        """Do a job and return its result; see runner.py."""
        job = self._cluster.submit(run, spec, lambda: is_wanted() and not self._closed)
        try:
            self._follow(job, report, is_wanted, wall_s)
            return self._answer(job)
        finally:
            self._cluster.release(job)

    def end(self) -> None:
        self._closed = True
        self._cluster.end()

    def close(self) -> None:
        self._cluster.close()

    def _follow(
        self, job: SubmittedJob, report: Report, is_wanted: Callable[[], bool], wall_s: float
    ) -> None:
        """Wait until it has ended."""
        start, worker, has_said_so = time.monotonic(), None, False
        deadline = start + wall_s
        while True:
            now = time.monotonic()
            if self._closed or not is_wanted():
                raise JobStopped
            if now > deadline:
                raise (
                    JobTimeout
                    if worker
                    else Unavailable(
                        say(
                            "cluster.no-worker",
                            "No worker of the cluster was "
                            "available for the job within {seconds:g} s.",
                            seconds=wall_s,
                        ),
                        say(
                            "cluster.start-workers",
                            "Start more workers: dask worker tcp://SCHEDULER:8786 --nthreads 1.",
                        ),
                        reason="no-free-worker",
                    )
                )
            if worker is None and not has_said_so and now > start + WAITING_NOTICE_S:
                has_said_so = True
                report(0.0, "Waiting for a worker of the cluster")
            try:
                event = job.inbox.get(timeout=POLL_S)
            except queue.Empty:
                continue
            if event["kind"] == "ended":
                return
            if event["kind"] == "begun":
                worker, deadline = event["worker"], now + wall_s
                report(0.0, "Starting")
            elif event["kind"] == "progress":
                report(event["fraction"], sentence_in(event, "message"))
            elif event["kind"] == "gone" and event["worker"] == worker:
                raise WorkerDied

    def _answer(self, job: SubmittedJob) -> Any:
        from distributed import KilledWorker

        try:
            answer = json.loads(job.future.result(timeout=ANSWER_S))
        except (CancelledError, OSError):  # the scheduler is gone, or the worker with its result
            self._cluster.disconnect(job.client)
            raise WorkerDied from None
        except KilledWorker:
            raise WorkerDied from None
        except Exception as error:
            raise Unavailable(
                say(
                    "cluster.cannot-run",
                    "The cluster cannot run Touchline's jobs: {kind}: {error}",
                    kind=type(error).__name__,
                    error=str(error)[:200],
                ),
                say(
                    "cluster.same-versions",
                    "Install the same versions of Python, of Touchline and of "
                    "distributed on its scheduler and its workers.",
                ),
                reason="cluster-differs",
            ) from None
        if "lost" in answer:
            raise WorkerDied
        if "problem" in answer:
            raise JobFailed(answer["problem"])
        return answer["result"]
