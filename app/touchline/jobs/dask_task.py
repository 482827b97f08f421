"""One job on a worker of a Dask cluster: begun once, reported by events, ended at its next report when cancelled.

Text goes in and text comes out; only `do` is known to Dask, by its name, so that scheduler and workers need the same
Touchline and another version can still say that it is one. Events of a job, all with its "key": {"kind": "begun",
"worker": address} and {"kind": "progress", "fraction", "message"}.
"""

import json
import time

from touchline.core.errors import Cancelled
from touchline.core.json_values import finite_json
from touchline.core.statements import stated
from touchline.installation import __version__
from touchline.jobs.worker_main import execute

MIN_INTERVAL_S = 0.05  # between two reports of progress; more often nobody sees
SHARE = (
    "Make the server's data folder available to every worker under the same path, such as a shared folder, or "
    "set jobs.engine to local. If it is available, upload the image again."
)


def do(request_text: str) -> str:
    """Do {"key", "topic", "version", "run", "spec"}; return {"lost": true}, {"result"} or {"problem"}."""
    import cv2
    from distributed import Event, get_worker

    request = json.loads(request_text)
    if request["version"] != __version__:
        detail = f"The cluster's workers have Touchline {__version__}, the server has {request['version']}."
        return json.dumps(
            {
                "problem": {
                    "reason": "cluster-differs",
                    "title": "Cluster differs",
                    "status": 503,
                    "detail": detail,
                    "fix": "Install the same version on all machines and restart the workers.",
                }
            }
        )
    # Dask gives the job of a lost worker to the next one by itself. How often it may lose one is for the server to
    # count, so whoever finds it begun says so and does nothing. (The name of one whose worker dies stays behind on
    # the scheduler, some fifty bytes.)
    key, worker, begun = request["key"], get_worker(), Event(request["key"])
    if begun.is_set():
        begun.clear()
        return json.dumps({"lost": True})
    begun.set()
    worker.log_event(request["topic"], {"key": key, "kind": "begun", "worker": worker.address})
    reported_at, reported = 0.0, ""

    def progress(fraction: float, message: str) -> None:
        nonlocal reported_at, reported
        task = worker.state.tasks.get(key)
        if task is None or task.state == "cancelled":  # also where the server that asked has gone
            raise Cancelled("The job was cancelled.", "Start it again.")
        now = time.monotonic()
        if message != reported or now - reported_at >= MIN_INTERVAL_S:
            reported_at, reported = now, message
            # plain for Dask's own encoding
            said = stated({"message": message}) | {"message": str(message)}
            worker.log_event(
                request["topic"],
                {"key": key, "kind": "progress", "fraction": float(fraction), **said},
            )

    cv2.setNumThreads(1)
    is_done, value = execute(request["run"], request["spec"], progress)
    begun.clear()
    if not is_done and value["reason"] == "damaged-file":
        value = {**value, "reason": "no-shared-folder", "title": "No shared folder", "fix": SHARE}
    return json.dumps(finite_json({"result" if is_done else "problem": value}), allow_nan=False)
