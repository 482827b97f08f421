"""Long work, done by processes of its own: it can be watched, cancelled and killed, and the server answers meanwhile.

    def run(spec, progress): …                    a top-level function; plain JSON in, plain JSON out

    with Jobs(workers=2) as jobs:
        job = jobs.start("compare", run, spec)    queued; a frozen record
        job = jobs.get(job.id)                    running 0.4 "Fitting k1 k2", later done with its result
        jobs.cancel(job.id)                       cancelled, at once

`job.py` is what a job is and the book in which jobs are kept; `engine.py` gives jobs to places, and once more where
a worker was lost; `place.py` is what a place is; `doing.py` is a job's function done. `worker.py` is a place: a process
of this machine seen from outside, `child.py` from inside. `dask_place.py` is another: room on a Dask cluster, reached
through `dask_cluster.py`; `dask_task.py` is what runs there.

Each local worker has a process and a line of its own and does one job at a time, so that killing one touches no other's
job. (concurrent.futures.ProcessPoolExecutor shares its lines: one worker killed while it wrote a result left the
whole pool waiting for the rest of it.)
"""

from app.jobs.engine import JobEngine
from app.jobs.job import ENDED, Job

__all__ = ["ENDED", "Job", "JobEngine"]
