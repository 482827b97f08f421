"""Jobs on places: a queue, as many threads as places, another try after a lost worker, and what is said at the end."""

import logging
import queue
import secrets
from collections.abc import Callable
from functools import partial
from threading import Lock, Thread
from typing import Any, Self

from app.core.errors import BadInput, Busy, TouchlineError, Unavailable
from app.core.progress import Progress
from app.jobs.dask_cluster import DaskCluster
from app.jobs.dask_runner import DaskRunner
from app.jobs.job import Job, JobSpec, problem_of
from app.jobs.registry import JobRegistry, JobTable
from app.jobs.runner import JobFailed, JobRunner, JobStopped, JobTimeout, WorkerDied
from app.jobs.worker import Worker

Run = Callable[[Any, Progress], Any]
ResultSaver = Callable[[Any, Any], Any]  # what run returned, and what was said about it -> the job's result
log = logging.getLogger("touchline")

MAX_QUEUED = 20  # queued jobs; more would wait for so long that nobody waits for them
MEMORY_BYTES = 2 << 30
MAX_ATTEMPTS = 3  # a worker may be lost by chance twice; a job that has lost three is itself to blame


class JobEngine:
    """Long work in processes of its own; thread-safe. Close it, or use it as a context: no process is left then.

    workers: jobs done at once; processes start with the first jobs. wall_s: the longest that a job may take. kept:
    how many ended jobs can still be read. modules: what each process imports before its first job, and whose functions
    a kept job may name. engine: local, or the address of a cluster, to which so many jobs as `workers` are given at
    once. keepers: by name, what keeps the results that are worth keeping.
    """

    def __init__(self, workers: int = 2, *, engine: str = "local", wall_s: float = 600.0, kept: int = 100,
                 memory_bytes: int = MEMORY_BYTES, modules: tuple[str, ...] = (),
                 keepers: dict[str, ResultSaver] | None = None) -> None:
        self._wall_s = wall_s
        self._modules = modules
        self.result_savers = {} if keepers is None else keepers
        self._book = JobRegistry(kept)
        # (Not a SimpleQueue: two items put at once into one may leave one of two threads asleep.)
        self._line: queue.Queue[tuple[str, JobSpec] | None] = queue.Queue()
        self._places = _places(engine, workers, memory_bytes, modules)
        self._threads: list[Thread] = []
        self._lock = Lock()
        self._closed = False

    def open(self, rows: JobTable) -> None:
        """Keep jobs in these rows from now on, and go on with those that are there and have not ended."""
        with self._lock:
            for job, order in self._book.open(rows):
                if job.attempt > MAX_ATTEMPTS:
                    self._fail(job.id, WorkerDied())
                elif (order is None or order.run.partition(":")[0] not in self._modules
                      or not self._knows(order.keep)):
                    self._fail(job.id, Unavailable("This version of Touchline does not know what this job was to do.",
                                                   "Ask for it again.", reason="job-lost"))
                else:
                    self._line.put((job.id, order))
            if not self._line.empty():
                self._begin()

    def start(self, kind: str, run: Run, spec: Any, keep: str | None = None, about: Any = None, *,
              durable: bool = True) -> Job:
        """Queue a job. run: a top-level function; spec: plain JSON for it.

        keep: the name of a keeper, called here with what run returned and `about` (plain JSON) when that is whole and
        still wanted; the job's result is what it returns. From then on the job cannot be cancelled, and what is kept is
        kept together with the job's end, whole or not at all. durable: false for who waits for the answer.
        """
        order = JobSpec(f"{run.__module__}:{run.__qualname__}", spec, keep, about, durable)
        if not self._knows(keep):
            raise KeyError(keep)
        with self._lock:
            if self._closed:
                raise Unavailable("The server is shutting down.", "Try again when it is back.", reason="shutting-down")
            if sum(job.state == "queued" for job in self._book.all()) >= MAX_QUEUED:
                raise Busy(f"{MAX_QUEUED} jobs are waiting already.", "Wait for some to end, or cancel some.",
                           reason="too-many-jobs")
            job = self._book.add(kind, order)
            self._line.put((job.id, order))
            self._begin()
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

    @property
    def closed(self) -> bool:
        """Whether nothing will change any more."""
        return self._closed

    def close(self) -> None:
        """End every process. What is queued or runs is cancelled, or done when its rows are opened again."""
        with self._lock:
            self._closed = True
        for job in self._book.all():
            self._book.put_off(job.id)
        for place in self._places:
            place.end()
        for _ in self._threads:
            self._line.put(None)
        for thread in self._threads:
            thread.join()
        for place in self._places:
            place.drop()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _knows(self, keep: str | None) -> bool:
        return keep is None or keep in self.result_savers

    def _begin(self) -> None:
        if not self._threads:
            self._threads = [Thread(target=self._serve, args=(place, f"place {n}"), daemon=True)
                             for n, place in enumerate(self._places, 1)]
            for thread in self._threads:
                thread.start()

    def _serve(self, place: JobRunner, name: str) -> None:
        while (item := self._line.get()) is not None:
            id, order = item
            try:
                if self._closed or not self._book.begin(id, name):
                    continue  # cancelled while it waited
                made = place.run(order.run, order.spec, partial(self._report, id), partial(self._wanted, id),
                                 self._wall_s)
                self._book.done(id, partial(self._kept, order, made))
            except JobStopped:
                pass  # the book has said so already
            except WorkerDied as error:
                if not self._closed:
                    self._again(id, order, error)
            except Exception as error:
                self._fail(id, error)

    def _again(self, id: str, order: JobSpec, error: WorkerDied) -> None:
        """Nothing of a job is kept before its end, so it may be done once more from its beginning."""
        attempt = self._book.get(id).attempt + 1
        if attempt > MAX_ATTEMPTS:
            self._fail(id, error)
        elif self._book.again(id, f"Its worker was lost; waiting for attempt {attempt} of {MAX_ATTEMPTS}"):
            self._line.put((id, order))

    def _fail(self, id: str, error: Exception) -> None:
        self._book.fail(id, self._problem(error))

    def _report(self, id: str, fraction: float, message: str) -> None:
        self._book.report(id, min(max(fraction, 0.0), 1.0), message[:500])

    def _wanted(self, id: str) -> bool:
        self._book.beat(id)
        return not self._book.ended(id)

    def _kept(self, order: JobSpec, made: Any) -> Any:
        return made if order.keep is None else self.result_savers[order.keep](made, order.about)

    def _problem(self, error: Exception) -> dict[str, Any]:
        if isinstance(error, JobFailed) and "detail" in error.problem:
            return error.problem
        return problem_of(self._known(error))

    def _known(self, error: Exception) -> TouchlineError:
        """What a job's end means to who wants it, and what to do."""
        if isinstance(error, TouchlineError):
            return error
        if isinstance(error, WorkerDied):
            return Unavailable(f"The process that did this job ended before the job did, {MAX_ATTEMPTS} times.",
                               "Give it less at once; on a cluster, look at the memory limit and the log of its "
                               "workers.",
                               reason="worker-died")
        if isinstance(error, JobTimeout):
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


def _places(engine: str, count: int, memory_bytes: int, modules: tuple[str, ...]) -> list[JobRunner]:
    if engine == "local":
        return [Worker(memory_bytes, modules) for _ in range(count)]
    cluster = DaskCluster(engine)
    return [DaskRunner(cluster) for _ in range(count)]
