"""Jobs on places: a queue, as many threads as places, another try after a lost worker, and what is said at the end."""

import logging
import queue
import secrets
from collections.abc import Callable
from dataclasses import dataclass, replace
from threading import Lock, Thread
from typing import Any, Self

from app.errors import BadInput, Busy, TouchlineError, Unavailable
from app.jobs.dask_cluster import Cluster
from app.jobs.dask_place import DaskPlace
from app.jobs.job import Book, Job, problem_of
from app.jobs.place import JobFailed, OutOfTime, Place, Stopped, WorkerDied
from app.jobs.worker import Worker
from app.models import Progress

Run = Callable[[Any, Progress], Any]
Keep = Callable[[Any], Any]
log = logging.getLogger("touchline")

WAITING = 20  # queued jobs; more would wait for so long that nobody waits for them
MEMORY_BYTES = 2 << 30
ATTEMPTS = 3  # a worker may be lost by chance twice; a job that has lost three is itself to blame


@dataclass(frozen=True, eq=False)
class _Order:
    """A job on its way to a worker."""

    id: str
    run: str
    spec: Any
    keep: Keep | None
    attempt: int = 1


class Jobs:
    """Long work in processes of its own; thread-safe. Close it, or use it as a context: no process is left then.

    workers: jobs done at once; processes start with the first jobs. wall_s: the longest that a job may take. kept:
    how many ended jobs can still be read. modules: what each process imports before its first job. engine: local,
    or the address of a cluster, to which so many jobs as `workers` are given at once.
    """

    def __init__(self, workers: int = 2, *, engine: str = "local", wall_s: float = 600.0, kept: int = 100,
                 memory_bytes: int = MEMORY_BYTES, modules: tuple[str, ...] = ()) -> None:
        self._wall_s = wall_s
        self._book = Book(kept)
        self._orders: queue.Queue[_Order | None] = queue.Queue()
        self._places = _places(engine, workers, memory_bytes, modules)
        self._threads: list[Thread] = []
        self._lock = Lock()
        self._closed = False

    def start(self, kind: str, run: Run, spec: Any, keep: Keep | None = None) -> Job:
        """Queue a job. run: a top-level function; spec: plain JSON for it.

        keep: called here with what run returned, when that is whole and still wanted; the job's result is what it
        returns. From then on the job cannot be cancelled, so that what is kept is kept whole or not at all.
        """
        with self._lock:
            if self._closed:
                raise Unavailable("The server is shutting down.", "Try again when it is back.", reason="shutting-down")
            if sum(job.state == "queued" for job in self._book.all()) >= WAITING:
                raise Busy(f"{WAITING} jobs are waiting already.", "Wait for some to end, or cancel some.",
                           reason="too-many-jobs")
            job = self._book.add(kind)
            self._orders.put(_Order(job.id, f"{run.__module__}:{run.__qualname__}", spec, keep))
            if not self._threads:
                self._threads = [Thread(target=self._serve, args=(place,), daemon=True) for place in self._places]
                for thread in self._threads:
                    thread.start()
        return job

    def get(self, id: str) -> Job:
        """A job as it is now; NotFound."""
        return self._book.get(id)

    def all(self) -> tuple[Job, ...]:
        """Newest first."""
        return self._book.all()

    def cancel(self, id: str) -> Job:
        """It is cancelled at once, whatever its worker does; a job that has ended stays as it ended."""
        self._book.get(id)
        self._book.cancel(id)
        return self._book.get(id)

    @property
    def pids(self) -> tuple[int, ...]:
        """The processes that stand ready or work."""
        return tuple(pid for place in self._places if (pid := place.pid) is not None)

    def close(self) -> None:
        """Cancel what is queued or runs, and end every process."""
        with self._lock:
            self._closed = True
        for job in self._book.all():
            self._book.cancel(job.id, "The server was stopped")
        for place in self._places:
            place.end()
        for _ in self._threads:
            self._orders.put(None)
        for thread in self._threads:
            thread.join()
        for place in self._places:
            place.drop()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _serve(self, place: Place) -> None:
        while (order := self._orders.get()) is not None:
            if not self._book.change(order.id, state="running", message="Starting"):
                continue  # cancelled while it waited
            try:
                result = place.run(order.run, order.spec, lambda fraction, message, id=order.id: self._report(
                    id, fraction, message), lambda id=order.id: not self._book.ended(id), self._wall_s)
                self._end(order, result)
            except Stopped:
                pass  # the book has said so already
            except WorkerDied as error:
                if order.attempt < ATTEMPTS:
                    self._again(replace(order, attempt=order.attempt + 1))
                else:
                    self._fail(order, error)
            except Exception as error:
                self._fail(order, error)

    def _again(self, order: _Order) -> None:
        """Nothing of a job is kept before its end, so it may be done once more from its beginning."""
        if self._book.change(order.id, state="queued", attempt=order.attempt, progress=0.0,
                             message=f"Its worker was lost; waiting for attempt {order.attempt} of {ATTEMPTS}"):
            self._orders.put(order)

    def _fail(self, order: _Order, error: Exception) -> None:
        self._book.change(order.id, state="failed", message="Failed", problem=self._problem(error))

    def _report(self, id: str, fraction: float, message: str) -> None:
        self._book.change(id, progress=min(max(fraction, 0.0), 1.0), message=message[:500])

    def _end(self, order: _Order, result: Any) -> None:
        if order.keep is not None:
            if not self._book.hold(order.id):
                return
            result = order.keep(result)
        self._book.change(order.id, state="done", progress=1.0, message="Done", result=result)

    def _problem(self, error: Exception) -> dict[str, Any]:
        if isinstance(error, JobFailed) and "detail" in error.problem:
            return error.problem
        return problem_of(self._known(error))

    def _known(self, error: Exception) -> TouchlineError:
        """What a job's end means to who wants it, and what to do."""
        if isinstance(error, TouchlineError):
            return error
        if isinstance(error, WorkerDied):
            return Unavailable(f"The process that did this job ended before the job did, {ATTEMPTS} times.", "Give it "
                               "less at once; on a cluster, look at the memory limit and the log of its workers.",
                               reason="worker-died")
        if isinstance(error, OutOfTime):
            return BadInput(f"The job took longer than {self._wall_s:g} s.", "Give it less at once.",
                               reason="job-too-long")
        if isinstance(error, JobFailed) and error.problem["reason"] == "job-needs-memory":
            return BadInput("The job needs more memory than it gets.", "Give it less at once: fewer or smaller "
                               "pictures.", reason="job-needs-memory")
        id = secrets.token_hex(4)
        log.error("unexpected error %s in a job: %s", id,
                  error.problem.get("trace") if isinstance(error, JobFailed) else repr(error))
        return Unavailable(f"Something broke here that should not (error {id}).",
                           f"Try again; if it stays, report it with the log around error {id}.", reason="unexpected")


def _places(engine: str, count: int, memory_bytes: int, modules: tuple[str, ...]) -> list[Place]:
    if engine == "local":
        return [Worker(memory_bytes, modules) for _ in range(count)]
    cluster = Cluster(engine)
    return [DaskPlace(cluster) for _ in range(count)]
