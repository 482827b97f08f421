"""Jobs on a Dask cluster: two workers against one. Command: python -m pytest -s tests/bench/bench_dask.py

Scheduler and workers are processes of this machine, one thread each; boards are those of tests/support/board_views.py.
"""

import os
import signal
import time

import numpy as np
import pytest

from tests.support import sample_jobs
from tests.support.board_views import SIZE, TRUTH, picture_of, views_of
from tests.support.dask_cluster import dask_cluster
from tests.support.pictures import encoded
from touchline.boards.board import Board
from touchline.boards.request import BoardCalibrationRequest, run_pictures, run_views
from touchline.jobs import JobEngine

SMALL, LENSES, PICTURES = 200, 16, 200


@pytest.fixture(scope="module", params=[1, 2])
def jobs(request, tmp_path_factory):
    """So many workers, each of which has done a job, so that no import is measured."""
    workers = request.param
    with (
        dask_cluster(tmp_path_factory.mktemp("dask"), workers) as cluster,
        JobEngine(2 * workers, engine=cluster.address, kept=1000) as jobs,
    ):
        jobs.count = workers
        all_done(jobs, run_views, [board_spec(6)] * 2 * workers)
        yield jobs


def board_spec(count, seed=0):
    return {
        "task": BoardCalibrationRequest(None).to_json(),
        "image_size": list(SIZE),
        "views": [view.to_json() for view in views_of(TRUTH, count, seed=seed)],
    }


def all_done(jobs, run, specs):
    """Their results, and the seconds from the first to the last."""
    start, started = time.perf_counter(), []
    for spec in specs:
        while sum(job.state == "queued" for job in jobs.all()) >= 19:
            time.sleep(0.002)
        started.append(jobs.start("bench", run, spec))
    while not all(jobs.get(job.id).ended for job in started):
        time.sleep(0.002)
    ended = [jobs.get(job.id) for job in started]
    assert all(job.state == "done" for job in ended), [job.problem for job in ended if job.problem]
    return ended, time.perf_counter() - start


seconds: dict[tuple[str, int], float] = {}


def told(what, jobs, took):
    seconds[what, jobs.count] = took
    one = seconds.get((what, 1))
    print(
        f"\n{what}, {jobs.count} worker(s): {took:.2f} s; load {os.getloadavg()[0]:.0f}"
        + (f"; speed-up {one / took:.2f}" if one and jobs.count > 1 else "")
    )


def test_many_small_jobs(jobs):
    told(
        f"{SMALL} small jobs",
        jobs,
        all_done(jobs, sample_jobs.adds, [{"a": n, "b": 1} for n in range(SMALL)])[1],
    )


def test_lenses_from_boards(jobs):
    specs = [board_spec(40, seed) for seed in range(LENSES)]
    told(f"{LENSES} lenses of 40 views", jobs, all_done(jobs, run_views, specs)[1])


def test_pictures_of_boards(jobs, tmp_path):
    """A folder of 200 pictures in twenty jobs; they reach the workers by their path."""
    import hashlib

    board, rng, pictures = Board("chessboard", 9, 6, 25.0), np.random.default_rng(0), []
    for number in range(PICTURES // 10):
        corners = np.array([[100, 80], [540, 90], [550, 400], [95, 390]]) + rng.uniform(
            -60, 60, (4, 2)
        )
        data = encoded("png", pictured(board, corners))
        path = tmp_path / f"{number}.png"
        path.write_bytes(data)
        pictures.append(
            {"name": path.name, "path": str(path), "sha256": hashlib.sha256(data).hexdigest()}
        )
    spec = {"task": BoardCalibrationRequest(board).to_json(), "pictures": pictures[:10]}
    specs = [
        {**spec, "pictures": [pictures[(job + k) % len(pictures)] for k in range(10)]}
        for job in range(20)
    ]
    told(f"{PICTURES} pictures in 20 jobs", jobs, all_done(jobs, run_pictures, specs)[1])


def test_one_job_of_three_hundred_views(jobs):
    """A job is one worker's: a second one is free for the next lens, and does not make this one faster."""
    told("300 views in one job", jobs, all_done(jobs, run_views, [board_spec(300)])[1])


def pictured(board, corners):
    import cv2

    places = board.places_mm[:, :2].astype(np.float32)
    (x0, y0), (x1, y1) = places.min(axis=0), places.max(axis=0)
    square = np.float32([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
    return picture_of(
        board, cv2.getPerspectiveTransform(square, np.float32(corners)).astype(float), (640, 480)
    )


def test_a_job_of_three_hundred_views_whose_worker_is_killed_midway(tmp_path):
    with dask_cluster(tmp_path) as cluster, JobEngine(1, engine=cluster.address) as jobs:
        spec = board_spec(300)
        start = time.perf_counter()
        whole = all_done(jobs, run_views, [spec])[0][0]
        undisturbed = time.perf_counter() - start
        job, start = jobs.start("board", run_views, spec), time.perf_counter()
        while jobs.get(job.id).progress < 0.3:
            time.sleep(0.002)
        # Which of the two has it, the scheduler knows: its processes are told apart by the address they serve.
        os.kill(busy(cluster), signal.SIGKILL)
        while not jobs.get(job.id).ended:
            time.sleep(0.002)
        took, again = time.perf_counter() - start, jobs.get(job.id)
        print(
            f"\n300 views: {undisturbed:.2f} s; with the worker killed midway {took:.2f} s, attempt {again.attempt}"
        )
        assert (
            again.state == "done"
            and again.attempt == 2
            and again.result["lens"] == whole.result["lens"]
        )


def busy(cluster):
    from distributed import Client

    with Client(cluster.address.replace("dask", "tcp"), set_as_default=False) as client:
        (address,) = [worker for worker, keys in client.processing().items() if keys]
        return client.run(os.getpid, workers=[address])[address]
