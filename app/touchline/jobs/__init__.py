"""Long work, done by processes of its own: it can be watched, cancelled and killed, and the server answers meanwhile.

    def run(spec, progress): …                    a top-level function; plain JSON in, plain JSON out

    with JobEngine(workers=2) as jobs:
        job = jobs.start("compare", run, spec)    queued; a frozen record
        job = jobs.get(job.id)                    running 0.4 "Fitting k1 k2", later done with its result
        jobs.cancel(job.id)                       cancelled, at once

    engine.py       gives jobs to runners, by turns of callers, and once more where a worker was lost
    registry.py     the state of every job
    runner.py       what a runner is; a process of this machine seen from outside, worker_main.py: from inside
    dask_runner.py  a job on a Dask cluster; dask_task.py: what runs there

Each runner has a process and a connection of its own and does one job at a time, so that killing one touches no other's
job. (concurrent.futures.ProcessPoolExecutor shares its pipes: one worker killed while it wrote a result left the
whole pool waiting for the rest of it.)
"""

from touchline.core.jobs import ENDED, Job
from touchline.jobs.engine import JobEngine

__all__ = ["ENDED", "Job", "JobEngine"]
