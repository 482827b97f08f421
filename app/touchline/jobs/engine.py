"""Jobs on runners: a fair queue, as many threads as runners, another try after a lost worker, and how a job ends.

The queue is fair by addresses: a name is only claimed, an address is not, so names share what their address has. Of the
addresses the one with the
fewest jobs comes first, and of the names behind it the one with the fewest.
"""

import heapq
import queue
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from itertools import count
from math import inf
from threading import Lock, RLock, Thread
from typing import Any, Generic, Self, TypeVar

from touchline.core.errors import Busy, Conflict, Unavailable
from touchline.core.jobs import NOBODY, Caller, Job, JobSpec, Progress
from touchline.core.sentences import SHUTTING_DOWN, TRY_WHEN_BACK
from touchline.core.statements import Sentence, say
from touchline.jobs.dask_runner import DaskCluster, DaskRunner
from touchline.jobs.registry import START_AGAIN, JobRegistry, JobTable
from touchline.jobs.runner import (
    MAX_ATTEMPTS,
    JobRunner,
    JobStopped,
    ProcessRunner,
    WorkerDied,
    problem_of_failure,
)

PACKAGES = ("app.", "touchline.")
FORMER_NAMES = {
    "auto_task:run_auto": "automatic.detect",
    "board_task:run_pictures": "board.pictures",
    "board_task:run_views": "board.views",
    "check_pipeline:run_check": "drift.check",
    "motion_task:run_motion": "straight.rolls",
    "pair_pipeline:run_pair": "rig.pair",
    "plumb_task:run_straightness": "straight.measure",
    "register_task:run_register": "drift.reregister",
    "rig_pipeline:run_check": "rig.check",
    "rig_pipeline:run_refit": "calibration.refit",
    "task:run_compare": "calibration.compare",
    "task:run_fit": "calibration.fit",
    "workflows.automatic_request:run_auto": "automatic.detect",
    "workflows.board_request:run_pictures": "board.pictures",
    "workflows.board_request:run_views": "board.views",
    "workflows.calibration_request:run_compare": "calibration.compare",
    "workflows.calibration_request:run_fit": "calibration.fit",
    "workflows.check:run_check": "drift.check",
    "workflows.pair:run_pair": "rig.pair",
    "workflows.recognition:run_auto": "automatic.detect",
    "workflows.refit:run_refit": "calibration.refit",
    "workflows.reregister:run_register": "drift.reregister",
    "workflows.rig:run_check": "rig.check",
    "workflows.rolling_request:run_motion": "straight.rolls",
    "workflows.straight_lines_request:run_straightness": "straight.measure",
}

MAX_QUEUED = 100
MAX_QUEUED_EACH = 20  # of one name: more would wait for so long that nobody waits for them

READABLE_S = 3600.0
MEMORY_BYTES = 2 << 30


def current_name(stored: str) -> str:
    """Return the name that a stored job has in this version."""
    for package in PACKAGES:
        if stored.startswith(package):
            return FORMER_NAMES.get(stored.removeprefix(package), stored)
    return stored


Item = TypeVar("Item")


def check_room(caller: Caller, waiting: Sequence[Caller]) -> None:
    """Raise Busy where a caller has enough jobs waiting. waiting: who each waiting job is of.

    An address may have half of the places that others leave, so that there are always some for one more.
    """
    of_address = sum(one.address == caller.address for one in waiting)
    left = MAX_QUEUED - (len(waiting) - of_address)
    limits: tuple[tuple[int, int, Callable[[], Sentence]], ...] = (
        (
            len(waiting),
            MAX_QUEUED,
            lambda: say("job.too-many", "{jobs} jobs are already waiting.", jobs=len(waiting)),
        ),
        (
            waiting.count(caller),
            MAX_QUEUED_EACH,
            lambda: say(
                "job.too-many-of-yours",
                "{jobs} of your jobs are already waiting.",
                jobs=MAX_QUEUED_EACH,
            ),
        ),
        (
            of_address,
            (left + 1) // 2,
            lambda: say(
                "job.too-many-of-address",
                "{jobs} jobs from your address are already waiting.",
                jobs=of_address,
            ),
        ),
    )
    for jobs, most, what in limits:
        if jobs >= most:
            raise Busy(
                what(),
                say("job.wait-or-cancel", "Wait until some have ended, or cancel some."),
                reason="too-many-jobs",
            )


class FairQueue(Generic[Item]):
    """Thread-safe."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._numbers = count()
        # of addresses
        self._turns: queue.PriorityQueue[tuple[float, int, str | None]] = queue.PriorityQueue()
        self._waiting: dict[str, list[tuple[float, int, Item]]] = {}  # by address: a heap

    def put(self, item: Item, caller: Caller, before_of_address: int, before_of_name: int) -> None:
        """Let it wait. before_…: how many jobs that address, and that name behind it, have under way already."""
        with self._lock:
            number = next(self._numbers)
            heapq.heappush(
                self._waiting.setdefault(caller.address, []), (before_of_name, number, item)
            )
            self._turns.put((before_of_address, number, caller.address))

    def get(self) -> Item | None:
        """Wait for the next and return it; None where the queue has ended."""
        address = self._turns.get()[2]
        if address is None:
            return None
        with self._lock:
            waiting = self._waiting[address]
            item = heapq.heappop(waiting)[2]
            if not waiting:
                del self._waiting[address]
        return item

    def end(self) -> None:
        """Let one get() return None, once nothing waits any more."""
        with self._lock:
            self._turns.put((inf, next(self._numbers), None))

    @property
    def is_empty(self) -> bool:
        return self._turns.empty()


Run = Callable[[Any, Progress], Any]
# what run returned, and the job's context -> the job's result
ResultSaver = Callable[[Any, Any], Any]


class JobEngine:
    """Long work in processes of its own; thread-safe. Close it, or use it as a context: no process is left then.

    workers: jobs done at once; processes start with the first jobs. wall_s: the longest that a job may take. kept,
    kept_s: an ended job can be read as long as it is among the so many newest, or no older. functions: each as
    "module:function" by the name with which its jobs are stored; no other stored job is run, and each process imports
    them before its first job. engine: local, or the address of a cluster, to which so many jobs as `workers` are given
    at once. result_savers: by name, what stores the results that are worth storing.
    """

    def __init__(
        self,
        workers: int = 2,
        *,
        engine: str = "local",
        wall_s: float = 600.0,
        kept: int = 100,
        kept_s: float = READABLE_S,
        memory_bytes: int = MEMORY_BYTES,
        functions: Mapping[str, str] | None = None,
        result_savers: dict[str, ResultSaver] | None = None,
    ) -> None:
        self._wall_s = wall_s
        self._functions = functions or {}
        self._names = {function: name for name, function in self._functions.items()}
        modules = tuple(dict.fromkeys(function.partition(":")[0] for function in self._names))
        self.result_savers = {} if result_savers is None else result_savers
        self._registry = JobRegistry(kept, kept_s)
        self._callers: dict[str, Caller] = {}  # of jobs that have not ended
        self._queue: FairQueue[tuple[str, JobSpec]] = FairQueue()
        if engine == "local":
            self._runners: list[JobRunner] = [
                ProcessRunner(memory_bytes, modules) for _ in range(workers)
            ]
        else:
            cluster = DaskCluster(engine)
            self._runners = [DaskRunner(cluster) for _ in range(workers)]
        self._threads: list[Thread] = []
        self._lock = RLock()
        self.closed = False  # then nothing will change any more

    def open(self, table: JobTable, *, resume: bool = True) -> None:
        """Store jobs in this table from now on. Those of a table before are forgotten.

        resume: whether those in it that have not ended go on; if not, they wait until it is opened with resume.
        """
        with self._lock:
            unfinished = self._registry.open(table)
            for job, stored in unfinished if resume else ():
                spec = stored and replace(stored, run=current_name(stored.run))
                if job.attempt > MAX_ATTEMPTS:
                    self._fail(job.id, WorkerDied())
                elif spec is None or not self._is_known(spec):
                    self._fail(
                        job.id,
                        Unavailable(
                            say(
                                "job.not-supported",
                                "This version of Touchline does not support this job.",
                            ),
                            START_AGAIN,
                            reason="job-lost",
                        ),
                    )
                else:
                    self._queue.put((job.id, spec), NOBODY, 0, 0)
            if not self._queue.is_empty:
                self._start_threads()

    @contextmanager
    def idle(self) -> Iterator[None]:
        """Hold new jobs back while the block exchanges their table; Conflict while any has not ended."""
        with self._lock:
            if any(not job.ended for job in self._registry.all()):
                raise Conflict(
                    say("job.under-way", "Jobs are still running or waiting."),
                    say("job.wait-or-cancel-all", "Wait until they have ended, or cancel them."),
                    reason="jobs-under-way",
                )
            yield

    def start(
        self,
        kind: str,
        run: Run,
        spec: Any,
        saver: str | None = None,
        context: Any = None,
        *,
        durable: bool = True,
        caller: Caller = NOBODY,
    ) -> Job:
        """Queue a job. run: a top-level function; spec: plain JSON for it.

        saver: the name of a result saver, called here with what run returned and the context (plain JSON) when that is
        whole and still wanted; the job's result is what it returns. From then on the job cannot be cancelled, and what
        is saved is saved together with the job's end, whole or not at all. durable: false for who waits for the answer.
        caller: each address has a share of the queue, and each name a share of that; Busy for who has used it up.
        """
        function = f"{run.__module__}:{run.__qualname__}"
        job_spec = JobSpec(self._names.get(function, function), spec, saver, context, durable)
        if not self._can_save(saver):
            raise KeyError(saver)
        with self._lock:
            if self.closed:
                raise Unavailable(SHUTTING_DOWN, TRY_WHEN_BACK, reason="shutting-down")
            under_way = [job for job in self._registry.all() if not job.ended]
            self._callers = callers = {
                job.id: self._callers.get(job.id, NOBODY) for job in under_way
            }
            check_room(caller, [callers[job.id] for job in under_way if job.state == "queued"])
            of_address = [one for one in callers.values() if one.address == caller.address]
            job = self._registry.add(kind, job_spec)
            callers[job.id] = caller
            self._queue.put((job.id, job_spec), caller, len(of_address), of_address.count(caller))
            self._start_threads()
        return job

    def get(self, id: str) -> Job:
        """Return a job as it is now; NotFound."""
        return self._registry.get(id)

    def all(self) -> tuple[Job, ...]:
        """Return every job, newest first."""
        return self._registry.all()

    def cancel(self, id: str) -> Job:
        """Cancel a job at once, whatever its worker does; one that has ended stays as it ended."""
        self._registry.get(id)
        self._registry.cancel(id)
        return self._registry.get(id)

    def close(self) -> None:
        """End every process. What is queued or runs is cancelled, or done when its table is opened again."""
        with self._lock:
            self.closed = True
        for job in self._registry.all():
            self._registry.suspend(job.id)
        for runner in self._runners:
            runner.end()
        for _ in self._threads:
            self._queue.end()
        for thread in self._threads:
            thread.join()
        for runner in self._runners:
            runner.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _is_known(self, spec: JobSpec) -> bool:
        """Whether a stored job is one of ours: a data folder may come from a stranger's archive."""
        return spec.run in self._functions and self._can_save(spec.saver)

    def _can_save(self, saver: str | None) -> bool:
        return saver is None or saver in self.result_savers

    def _start_threads(self) -> None:
        if not self._threads:
            self._threads = [
                Thread(target=self._serve, args=(runner,), daemon=True) for runner in self._runners
            ]
            for thread in self._threads:
                thread.start()

    def _serve(self, runner: JobRunner) -> None:
        while (item := self._queue.get()) is not None:
            id, spec = item
            try:
                if self.closed or not self._registry.begin(id):
                    continue  # cancelled while it waited
                made = runner.run(
                    self._functions.get(spec.run, spec.run),
                    spec.spec,
                    partial(self._registry.report, id),
                    partial(self._is_wanted, id),
                    self._wall_s,
                )
                self._registry.complete(id, partial(self._save, spec, made))
            except JobStopped:
                pass  # the registry has said so already
            except WorkerDied as error:
                if not self.closed:
                    self._requeue(id, spec, error)
            except Exception as error:
                self._fail(id, error)

    def _requeue(self, id: str, spec: JobSpec, error: WorkerDied) -> None:
        """Nothing of a job is stored before its end, so it may be done once more from its beginning."""
        attempt = self._registry.get(id).attempt + 1
        if attempt > MAX_ATTEMPTS:
            self._fail(id, error)
        elif self._registry.requeue(
            id,
            say(
                "job.worker-lost",
                "Its worker was lost; waiting for attempt {attempt} of {attempts}",
                attempt=attempt,
                attempts=MAX_ATTEMPTS,
            ),
        ):
            # It may be to blame: the others go first.
            self._queue.put((id, spec), self._callers.get(id, NOBODY), MAX_QUEUED, MAX_QUEUED)

    def _fail(self, id: str, error: Exception) -> None:
        self._registry.fail(id, problem_of_failure(error, self._wall_s))

    def _is_wanted(self, id: str) -> bool:
        return not self._registry.ended(id)

    def _save(self, spec: JobSpec, made: Any) -> Any:
        return made if spec.saver is None else self.result_savers[spec.saver](made, spec.context)
