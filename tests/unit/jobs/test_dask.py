"""Jobs on a real Dask cluster, scheduler and two workers: done, refused, cancelled, killed, and the scheduler gone."""

import os
import signal
import subprocess
import sys
import time

import pytest
from starlette.testclient import TestClient

from tests.support import sample_jobs
from tests.support.board_views import SIZE, views_of
from tests.support.child_processes import pids_of
from tests.support.dask_cluster import ENVIRONMENT, DaskCluster, dask_cluster
from tests.support.paths import ROOT, TESTS
from tests.support.pictures import encoded, gradient
from tests.support.tiers import long
from tests.support.waiting import ended, until
from touchline.boards.request import BoardCalibrationRequest, run_pictures, run_views
from touchline.core.errors import BadInput
from touchline.jobs import JobEngine
from touchline.jobs.dask_task import do
from touchline.main import create_app
from touchline.settings import Settings


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    with dask_cluster(tmp_path_factory.mktemp("dask")) as cluster:
        yield cluster


@pytest.fixture(scope="module")
def standing(cluster):
    with JobEngine(workers=2, engine=cluster.address) as jobs:
        yield jobs


def said(jobs, job, message):
    until(lambda: jobs.get(job.id).message == message)


def test_a_job_is_done_by_a_worker_of_the_cluster_and_says_how_far_it_has_come(standing, cluster):
    done = ended(standing, standing.start("adding", sample_jobs.adds, {"a": 2, "b": 3}))
    assert (done.state, done.result["sum"], done.progress, done.attempt) == ("done", 5, 1.0, 1), (
        done
    )
    assert (
        done.result["pid"] in [worker.pid for worker in cluster.workers] and pids_of(standing) == ()
    )
    slow = standing.start("sleeping", sample_jobs.sleeps_and_says, {"seconds": 1.0})
    seen = []
    until(lambda: seen.append(standing.get(slow.id).progress) or standing.get(slow.id).ended)
    assert (
        seen == sorted(seen)
        and len(set(seen)) > 4
        and standing.get(slow.id).result == {"slept": 1.0}
    )


def test_refusals_mistakes_and_nan_come_back_as_from_a_process_of_this_machine(standing, caplog):
    refused = ended(standing, standing.start("fit", sample_jobs.refuses, {}))
    assert refused.state == "failed" and refused.attempt == 1
    assert refused.problem == {
        "reason": "too-few-points",
        "title": "Too few points",
        "status": 422,
        "feature": "left",
        "detail": "The left border has 2 points.",
        "fix": "Click two more.",
    }
    broken = ended(standing, standing.start("fit", sample_jobs.breaks, {}))
    assert broken.problem["reason"] == "unexpected" and "KeyError" in caplog.text
    assert "KeyError" not in str(broken.problem)
    exits = ended(standing, standing.start("dying", sample_jobs.dies, {"how": "SystemExit"}))
    assert (exits.state, exits.problem["reason"], exits.attempt) == ("failed", "unexpected", 1)
    nan = ended(standing, standing.start("nan", sample_jobs.answers_nan, {}))
    assert nan.result == {"value": None, "list": [1.0, None]}


def test_equal_jobs_are_done_each_for_itself_and_the_lens_is_the_one_found_here(standing):
    """Dask would merge equal calls into one."""
    spec = {
        "task": BoardCalibrationRequest(None, options={"terms": ["k1"]}).to_json(),
        "views": [view.to_json() for view in views_of(count=4)],
        "image_size": list(SIZE),
    }
    jobs = [standing.start("board", run_views, spec) for _ in range(2)]
    here = run_views(spec, lambda fraction, message: None)
    for job in jobs:
        found = ended(standing, job)
        assert found.state == "done", found.problem
        assert found.result["lens"] == here["lens"]
        assert found.result["report"] == here["report"]


def test_a_cancelled_job_that_listens_frees_its_worker_and_the_next_one_is_done(cluster):
    with JobEngine(workers=2, engine=cluster.address) as jobs:
        pair = [
            jobs.start("sleeping", sample_jobs.sleeps_and_says, {"seconds": 600}) for _ in range(2)
        ]
        for job in pair:
            said(jobs, job, "sleeping")
        for job in pair:
            assert jobs.cancel(job.id).state == "cancelled"
        # both workers are free
        more = [jobs.start("adding", sample_jobs.adds, {"a": 1, "b": n}) for n in range(2)]
        assert [ended(jobs, job).result["sum"] for job in more] == [1, 2]
        assert {jobs.get(job.id).state for job in pair} == {"cancelled"}


@pytest.mark.long
def test_a_job_that_does_not_listen_is_abandoned_and_its_result_thrown_away(cluster):
    with JobEngine(workers=1, engine=cluster.address) as jobs:
        kept = []
        jobs.result_savers["list"] = lambda made, about: kept.append(made)
        job = jobs.start("computing", sample_jobs.computes_in_silence, {"seconds": 3}, "list")
        said(jobs, job, "Starting")
        time.sleep(0.3)
        assert jobs.cancel(job.id).state == "cancelled"
        assert (
            ended(jobs, jobs.start("adding", sample_jobs.adds, {"a": 1, "b": 1})).result["sum"] == 2
        )
        time.sleep(3)
        assert jobs.get(job.id).state == "cancelled" and kept == []


def test_a_job_that_takes_too_long_is_ended_and_its_worker_goes_on(cluster):
    with JobEngine(workers=1, engine=cluster.address, wall_s=1.0) as jobs:
        late = ended(jobs, jobs.start("sleeping", sample_jobs.sleeps_and_says, {"seconds": 600}))
        assert (late.state, late.problem["reason"], late.attempt) == ("failed", "job-too-long", 1)


SERVER = """
import time
from tests.support import sample_jobs
from touchline.jobs import JobEngine
jobs = JobEngine(workers=2, engine={address!r})
pair = [jobs.start("sleeping", sample_jobs.sleeps_and_says, {{"seconds": 600}}) for _ in range(2)]
while any(jobs.get(job.id).message != "sleeping" for job in pair):
    time.sleep(0.01)
print("both run", flush=True)
{end}
"""


@pytest.mark.parametrize("end", [long("jobs.close()"), "time.sleep(600)"])
def test_a_server_that_is_stopped_or_killed_leaves_the_workers_free(cluster, standing, end):
    server = subprocess.Popen(
        [sys.executable, "-c", SERVER.format(address=cluster.address, end=end)],
        cwd=ROOT,
        env=ENVIRONMENT,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert server.stdout.readline() == "both run\n"
        if "close" in end:
            assert server.wait(60) == 0
    finally:
        server.kill()
        server.communicate()
    more = [standing.start("adding", sample_jobs.adds, {"a": 1, "b": n}) for n in range(2)]
    assert [ended(standing, job).result["sum"] for job in more] == [1, 2]


@pytest.mark.long
def test_the_server_answers_the_same_with_a_cluster_as_without_and_pictures_are_read_there(
    cluster, tmp_path
):
    board = {"kind": "chessboard", "columns": 9, "rows": 6, "square_mm": 25.0}
    told = []
    for engine in ("local", cluster.address):
        settings = Settings(data=tmp_path / engine[:4], jobs={"engine": engine})
        with TestClient(create_app(settings), base_url="http://127.0.0.1:8000") as client:
            kept = client.post(
                "/api/v1/snapshots", files={"file": encoded("png", gradient(320, 240))}
            ).json()
            job = client.post(
                "/api/v1/calibrations/board", json={"snapshots": [kept["id"]], "board": board}
            ).json()
            until(
                lambda job=job, client=client: client.get(f"/api/v1/jobs/{job['id']}").json()[
                    "ended_at"
                ]
            )
            told.append(client.get(f"/api/v1/jobs/{job['id']}").json())
    assert (
        told[0]["problem"] == told[1]["problem"]
        and told[1]["problem"]["type"] == "/problems/no-board"
    )


def test_pictures_that_a_worker_cannot_read_or_that_differ_say_what_to_share(standing, tmp_path):
    spec = {
        "task": {
            "board": {"kind": "chessboard", "columns": 9, "rows": 6, "square_mm": 25.0},
            "model": "brown-conrady",
            "options": {},
        }
    }
    other = tmp_path / "other.png"
    other.write_bytes(encoded("png"))
    for path in (tmp_path / "nowhere.png", other):
        pictures = [{"name": "picture 1", "path": str(path), "sha256": "0" * 64}]
        failed = ended(
            standing, standing.start("board", run_pictures, {**spec, "pictures": pictures})
        )
        assert (
            failed.problem["reason"] == "no-shared-folder"
            and "data folder" in failed.problem["fix"]
        )
        assert failed.problem["detail"].startswith("Picture 1 ")


def test_another_version_of_touchline_on_the_workers_is_said(standing, monkeypatch):
    monkeypatch.setattr("touchline.jobs.dask_runner.__version__", "0.0.1")
    failed = ended(standing, standing.start("adding", sample_jobs.adds, {"a": 1, "b": 1}))
    assert failed.problem["reason"] == "cluster-differs" and "0.0.1" in failed.problem["detail"]


@pytest.mark.long
def test_a_worker_killed_midway_costs_an_attempt_and_every_job_of_a_batch_ends_right(tmp_path):
    with (
        dask_cluster(tmp_path) as cluster,
        JobEngine(workers=4, engine=cluster.address, kept=200) as jobs,
    ):
        slow = jobs.start("sleeping", sample_jobs.sleeps_and_says, {"seconds": 8})
        other = jobs.start("sleeping", sample_jobs.sleeps_and_says, {"seconds": 8})
        for job in (slow, other):
            said(jobs, job, "sleeping")
        os.kill(cluster.workers[0].pid, signal.SIGKILL)  # each of the two has one of them
        batch = []
        for number in range(60):
            until(lambda: sum(job.state == "queued" for job in jobs.all()) < 15)
            batch.append(jobs.start("adding", sample_jobs.adds, {"a": number, "b": 1}))
        assert [ended(jobs, job).result["sum"] for job in batch] == [
            number + 1 for number in range(60)
        ]
        assert [ended(jobs, job).result for job in (slow, other)] == [{"slept": 8}] * 2
        assert sorted(jobs.get(job.id).attempt for job in (slow, other)) == [1, 2]


@pytest.mark.long
def test_a_job_that_kills_every_worker_has_failed_after_three_and_a_fourth_worker_lives(tmp_path):
    with (
        dask_cluster(tmp_path, workers=4) as cluster,
        JobEngine(workers=1, engine=cluster.address) as jobs,
    ):
        failed = ended(jobs, jobs.start("dying", sample_jobs.dies, {"how": "SIGKILL"}))
        assert (failed.state, failed.problem["reason"], failed.attempt) == (
            "failed",
            "worker-died",
            3,
        )
        until(lambda: sum(worker.poll() is not None for worker in cluster.workers) == 3)
        assert (
            ended(jobs, jobs.start("adding", sample_jobs.adds, {"a": 1, "b": 1})).result["sum"] == 2
        )


@pytest.mark.long
def test_the_only_worker_killed_is_seen_at_once_and_the_job_waits_for_another(tmp_path):
    with (
        dask_cluster(tmp_path, workers=1) as cluster,
        JobEngine(workers=1, engine=cluster.address) as jobs,
    ):
        job = jobs.start("sleeping", sample_jobs.sleeps_and_says, {"seconds": 1})
        said(jobs, job, "sleeping")
        os.kill(cluster.workers[0].pid, signal.SIGKILL)
        until(lambda: jobs.get(job.id).attempt == 2)
        assert not jobs.get(job.id).ended
        cluster.start_workers(1)
        assert (ended(jobs, job).result, jobs.get(job.id).attempt) == ({"slept": 1}, 2)


@pytest.mark.long
def test_a_scheduler_that_is_not_there_is_a_problem_with_its_cure_and_one_that_comes_back_is_used(
    tmp_path, monkeypatch
):
    cluster = DaskCluster(tmp_path)
    monkeypatch.setattr("touchline.jobs.dask_runner.CONNECT_S", 0.5)
    with JobEngine(workers=2, engine=cluster.address) as jobs:
        failed = ended(jobs, jobs.start("adding", sample_jobs.adds, {"a": 1, "b": 1}))
        assert (failed.state, failed.problem["reason"]) == ("failed", "no-scheduler")
        assert (
            "dask scheduler" in failed.problem["fix"]
            and str(cluster.port) in failed.problem["detail"]
        )
        monkeypatch.setattr("touchline.jobs.dask_runner.CONNECT_S", 60.0)
        try:
            cluster.start_scheduler()
            waiting = jobs.start("adding", sample_jobs.adds, {"a": 1, "b": 2})
            said(jobs, waiting, "Waiting for a worker of the cluster")
            cluster.start_workers(1)
            assert ended(jobs, waiting).result["sum"] == 3
            # The scheduler dies in the middle of a job, and both are started anew.
            lost = jobs.start("sleeping", sample_jobs.sleeps_and_says, {"seconds": 2})
            said(jobs, lost, "sleeping")
            cluster.end()
            until(lambda: jobs.get(lost.id).attempt == 2)
            cluster.start_scheduler()
            cluster.start_workers(1)
            again = ended(jobs, lost)
            assert (again.state, again.result) == ("done", {"slept": 2}) and again.attempt in (
                2,
                3,
            ), again
            # And once more while nobody works.
            cluster.end()
            cluster.start_scheduler()
            cluster.start_workers(1)
            after = jobs.start("sleeping", sample_jobs.sleeps_and_says, {"seconds": 1})
            said(jobs, after, "sleeping")  # who listens is known to the new one
            assert ended(jobs, after).state == "done"
        finally:
            cluster.end()


@pytest.mark.long
def test_with_certificates_and_never_without(tmp_path, monkeypatch):
    # its own authority, its key beside it
    certificate = str(TESTS / "support" / "camera_certificate.pem")
    names = {"CA_FILE": certificate} | {
        f"{who}__{what}": certificate
        for who in ("CLIENT", "SCHEDULER", "WORKER")
        for what in ("CERT", "KEY")
    }
    cluster = DaskCluster(tmp_path, "tls")
    cluster.environment = {
        f"DASK_DISTRIBUTED__COMM__TLS__{name}": path for name, path in names.items()
    } | {"DASK_DISTRIBUTED__COMM__REQUIRE_ENCRYPTION": "true"}
    monkeypatch.setattr("touchline.jobs.dask_runner.CONNECT_S", 60.0)
    address = cluster.address.replace("dask:", "dask+tls:")
    try:
        cluster.start_scheduler()
        cluster.start_workers(1)
        with JobEngine(workers=1, engine=address) as jobs:
            refused = ended(jobs, jobs.start("adding", sample_jobs.adds, {"a": 1, "b": 1}))
            assert (
                refused.problem["reason"] == "no-scheduler"
                and "certificates" in refused.problem["fix"]
            )
        script = (
            SERVER.format(address=address, end="jobs.close()")
            .replace("workers=2", "workers=1")
            .replace("range(2)", "range(1)")
        )
        told = subprocess.run(
            [sys.executable, "-c", script],
            cwd=ROOT,
            env=ENVIRONMENT | cluster.environment,
            capture_output=True,
            text=True,
            timeout=90,
        )
        assert told.stdout == "both run\n", told.stderr
    finally:
        cluster.end()


@pytest.mark.long
def test_without_a_worker_a_job_fails_in_the_end_and_says_how_to_start_one(tmp_path):
    with (
        dask_cluster(tmp_path, workers=0) as cluster,
        JobEngine(engine=cluster.address, wall_s=1.5) as jobs,
    ):
        failed = ended(jobs, jobs.start("adding", sample_jobs.adds, {"a": 1, "b": 1}))
        assert (
            failed.problem["reason"] == "no-free-worker" and "dask worker" in failed.problem["fix"]
        )


def test_a_handshake_with_a_busy_scheduler_that_fails_is_made_again(cluster, monkeypatch):
    import distributed

    # the last: two messages in one
    connect, errors = distributed.Client, [OSError, TimeoutError, AssertionError]

    def fails_first(*arguments, **named):
        if errors:
            raise errors.pop()
        return connect(*arguments, **named)

    monkeypatch.setattr("touchline.jobs.dask_runner.POLL_S", 0.01)
    with JobEngine(engine=cluster.address) as jobs:
        monkeypatch.setattr(distributed, "Client", fails_first)
        done = ended(jobs, jobs.start("adding", sample_jobs.adds, {"a": 1, "b": 1}))
        assert done.state == "done" and done.result["sum"] == 2 and not errors


@pytest.mark.parametrize(
    "address",
    ["dask://", "dask://host", "http://host:1", "dask://host:port", "dask://host:70000", "Local"],
)
def test_an_address_that_is_none_is_refused_at_the_start(address):
    with pytest.raises(BadInput):
        JobEngine(engine=address)


def test_only_one_function_of_ours_is_known_to_dask_by_name():
    assert (do.__module__, do.__qualname__) == ("touchline.jobs.dask_task", "do")
