"""The connection to a Dask scheduler that all runners share: made when first needed, and again after it was lost."""

import importlib.util
import json
import math
import queue
import re
import secrets
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from threading import Lock, Thread
from typing import Any

from touchline.core.errors import BadInput, TouchlineError, Unavailable
from touchline.core.sentences import install_package
from touchline.core.statements import join, say
from touchline.installation import __version__
from touchline.jobs.dask_task import do
from touchline.jobs.runner import JobStopped

ADDRESS = re.compile(r"dask(?P<tls>\+tls)?://(?P<host>[^/:\[\]]+):(?P<port>\d{1,5})")
CONNECT_S = 10.0  # a scheduler that is started anew is back by then
HANDSHAKE_S = 30.0  # one that answers may be busy
POLL_S = 0.2
CLOSE_S = 2.0


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
            raise BadInput(f"{address!r} is not the address of a scheduler.", "Enter it as dask://host:port.",
                           reason="bad-settings")
        if importlib.util.find_spec("distributed") is None:
            raise Unavailable("Jobs on a cluster need the Python package distributed.",
                              join(install_package("distributed"), "Or set jobs.engine to local."), reason="no-dask")
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
            except (OSError, AssertionError):  # Dask's handshake raises both where a busy scheduler answers late
                if time.monotonic() > until:
                    raise self._unreachable() from None
                time.sleep(POLL_S)

    def _new_client(self) -> Any:
        from distributed import Client, Security
        try:
            security = Security(require_encryption=True) if self._tls else None
            # Asked here, since a client that has failed leaves the thread of its loop behind.
            if security is not None and security.get_connection_args("client")["ssl_context"] is None:
                raise ValueError("no certificate is set.")
            return Client(f"{'tls' if self._tls else 'tcp'}://{self._host}:{self._port}", timeout=HANDSHAKE_S,
                          security=security, set_as_default=False, name="touchline")
        except (RuntimeError, TypeError, ValueError) as error:
            raise Unavailable(f"Dask refuses to connect to {self._host}:{self._port}: {str(error)[:200]}",
                              "Correct Dask's TLS settings: the files of the certificates and the key.",
                              reason="no-scheduler") from None

    def _unreachable(self) -> TouchlineError:
        return Unavailable(say("cluster.no-scheduler", "The cluster's scheduler at {host}:{port} is not responding.",
                               host=self._host, port=self._port),
                           say("cluster.start-scheduler", "Start it: dask scheduler --port {port}, then workers; or "
                               "set jobs.engine to local.", port=self._port), reason="no-scheduler")

    def _on_event(self, event: tuple[float, dict[str, Any]]) -> None:
        message = event[1]
        inbox = self._inboxes.get(message.get("key", ""))
        if inbox is not None and (message["kind"] != "progress" or math.isfinite(message["fraction"])):
            inbox.put(message)

    def _on_cluster_event(self, event: tuple[float, dict[str, Any]]) -> None:
        if event[1].get("action") == "remove-worker":
            for inbox in list(self._inboxes.values()):
                inbox.put({"kind": "gone", "worker": event[1].get("worker")})
