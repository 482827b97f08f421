"""Jobs that are rows of a database: they outlive their server, and what they make is kept whole or not at all."""

import json
from inspect import isfunction
from pathlib import Path
from threading import Event, Thread

import pytest
from sqlalchemy import insert, text

from tests.support import sample_jobs
from tests.support.child_processes import pids_of
from tests.support.waiting import LONG_S, ended, running, until
from touchline import capabilities
from touchline.core.errors import DiskFull, NotFound, Unavailable
from touchline.core.jobs import JobSpec
from touchline.core.records import Calibration
from touchline.core.registry import load
from touchline.jobs import JobEngine, registry
from touchline.jobs.engine import FORMER_NAMES, PACKAGES, current_name
from touchline.services.result_savers import save_new_version
from touchline.store.tables import JobRow

SAMPLES = {
    name: f"tests.support.sample_jobs:{name}"
    for name, value in vars(sample_jobs).items()
    if isfunction(value)
}


@pytest.fixture
def store(opener, tmp_path):
    with opener(tmp_path / "data") as store:
        yield store


def server(store, **settings):
    """Jobs as a server keeps them."""
    jobs = JobEngine(**{"workers": 1, "functions": SAMPLES, **settings})
    jobs.result_savers["lens"] = lambda made, about: {
        "lens": store.lenses.add({"made": made, "about": about})["id"]
    }
    jobs.open(store.jobs)
    return jobs


def killed(jobs):
    """As by SIGKILL: whatever would be said at the end is not."""
    for name in ("suspend", "requeue", "fail", "complete"):
        setattr(jobs._registry, name, lambda *args, **kwargs: False)
    jobs.close()


def test_what_waits_and_what_runs_when_the_server_is_stopped_is_done_when_it_is_back(opener, store):
    jobs = server(store)
    runs = jobs.start("sleeping", sample_jobs.sleeps_and_says, {"seconds": 0.3}, "lens", "runs")
    waits = jobs.start("adding", sample_jobs.adds, {"a": 1, "b": 2}, "lens", "waits")
    running(jobs, runs)
    jobs.close()
    assert {jobs.get(job.id).state for job in (runs, waits)} == {
        "queued"
    } and store.lenses.list().items == ()
    with opener.again(store) as again, server(again) as back:
        told = [ended(back, job) for job in (runs, waits)]
        assert [(job.state, job.attempt) for job in told] == [("done", 1), ("done", 1)]
        assert [again.lenses.get(job.result["lens"])["about"] for job in told] == ["runs", "waits"]
        assert [job.id for job in back.all()] == [waits.id, runs.id]


def test_a_server_that_is_killed_costs_an_attempt_and_the_third_is_the_last(opener, store):
    job = None
    for attempt in (1, 2, 3):
        jobs = server(store)
        job = job or jobs.start("sleeping", sample_jobs.sleeps_and_says, {"seconds": 60}, "lens")
        running(jobs, job)
        assert jobs.get(job.id).attempt == attempt
        killed(jobs)
        store = opener.again(store)
    with store, server(store) as back:
        told = ended(back, job)
        assert (told.state, told.problem["reason"]) == (
            "failed",
            "worker-died",
        ) and store.lenses.list().items == ()
        assert store.jobs.get(job.id).state == "failed"


def test_what_has_ended_can_still_be_read_after_a_restart_and_old_ones_are_forgotten(opener, store):
    with server(store, kept=3, kept_s=0) as jobs:
        told = [
            ended(jobs, jobs.start("adding", sample_jobs.adds, {"a": n, "b": 0})) for n in range(4)
        ]
        told.append(ended(jobs, jobs.start("fit", sample_jobs.refuses, {})))
    with opener.again(store) as again, server(again, kept=3, kept_s=0) as back:
        for before in told[2:]:
            now = back.get(before.id)
            assert (now.state, now.result, now.problem, now.kind, now.ended_at is not None) == (
                before.state,
                before.result,
                before.problem,
                before.kind,
                True,
            )
            assert now.to_json()["statements"] == before.to_json()["statements"] != {}
        with pytest.raises(NotFound):
            back.get(told[1].id)
        assert len(again.jobs.list()) == 3


def test_one_that_somebody_waited_for_and_one_that_was_cancelled_are_not_done_again(opener, store):
    jobs = server(store)
    cancelled = jobs.start("sleeping", sample_jobs.sleeps_and_says, {"seconds": 60})
    waited = jobs.start("sleeping", sample_jobs.sleeps_and_says, {"seconds": 60}, durable=False)
    running(jobs, cancelled)
    jobs.cancel(cancelled.id)
    running(jobs, waited)
    jobs.close()
    assert jobs.get(waited.id).state == "cancelled"
    with opener.again(store) as again, server(again) as back:
        assert [(job.id, job.state) for job in back.all()] == [
            (cancelled.id, "cancelled")
        ] and pids_of(back) == ()


def test_what_a_job_made_is_kept_with_its_end_or_not_at_all(opener, store, monkeypatch):
    jobs = server(store)
    save = type(store.jobs).save

    def no_end(self, job):
        if job.state == "done":
            raise DiskFull("The job was not saved: the disk is full.", "Free some space.")
        save(self, job)

    monkeypatch.setattr(type(store.jobs), "save", no_end)
    lost = ended(jobs, jobs.start("adding", sample_jobs.adds, {"a": 1, "b": 2}, "lens"))
    assert (lost.state, lost.problem["reason"]) == (
        "failed",
        "disk-full",
    ) and store.lenses.list().items == ()
    assert store.jobs.get(lost.id).state == "failed"
    monkeypatch.undo()

    def broken(made, about):
        store.lenses.add({"made": made})
        raise DiskFull("The lens was not saved: the disk is full.", "Free some space.")

    jobs.result_savers["broken"] = broken
    full = ended(jobs, jobs.start("adding", sample_jobs.adds, {"a": 1, "b": 2}, "broken"))
    assert (full.state, full.problem["reason"]) == (
        "failed",
        "disk-full",
    ) and store.lenses.list().items == ()
    assert store.jobs.get(full.id).state == "failed"
    fine = ended(jobs, jobs.start("adding", sample_jobs.adds, {"a": 1, "b": 2}, "lens"))
    assert fine.state == "done" and len(store.lenses.list().items) == 1
    jobs.close()


def test_a_stop_while_a_result_is_saved_does_not_queue_the_job_again(store):
    jobs, suspended = registry.JobRegistry(kept=3, kept_s=60), []
    jobs.open(store.jobs)
    job = jobs.add("adding", JobSpec("tests.support.sample_jobs:adds", {"a": 1, "b": 2}))
    assert jobs.begin(job.id) and jobs.complete(
        job.id, lambda: suspended.append(jobs.suspend(job.id))
    )
    assert suspended == [False] and jobs.get(job.id).state == store.jobs.get(job.id).state == "done"


def test_a_part_that_failed_spoils_the_whole_whoever_catches_it(store):
    with pytest.raises(Unavailable), store.jobs.transaction():
        store.lenses.add({"made": 1})
        with pytest.raises(DiskFull), store._database.writing("The rest"):
            raise DiskFull("The disk is full.", "Free some space.")
    assert store.lenses.list().items == ()
    store.lenses.add({"made": 2})
    assert len(store.lenses.list().items) == 1


def test_an_end_that_the_database_does_not_take_is_told_at_once_and_written_later(
    store, monkeypatch
):
    with server(store) as jobs:
        refused = jobs.start("fit", sample_jobs.refuses, {})
        save = type(store.jobs).save

        def full(self, job):
            if job.state == "failed":
                raise DiskFull("The job was not saved: the disk is full.", "Free some space.")
            save(self, job)

        monkeypatch.setattr(type(store.jobs), "save", full)
        assert ended(jobs, refused).state == "failed"
        monkeypatch.setattr(type(store.jobs), "save", save)
        jobs.cancel(jobs.start("sleeping", sample_jobs.sleeps_and_says, {"seconds": 60}).id)
        until(lambda: store.jobs.get(refused.id).state == "failed")


def test_what_was_not_written_in_time_does_not_undo_what_came_after_it(store, monkeypatch):
    save = type(store.jobs).save

    def full(self, job):
        if job.state == "queued":
            raise DiskFull("The job was not saved: the disk is full.", "Free some space.")
        save(self, job)

    jobs = registry.JobRegistry(kept=3, kept_s=0)
    jobs.open(store.jobs)
    first, second = (
        jobs.add("adding", JobSpec("tests.support.sample_jobs:adds", {})) for _ in range(2)
    )
    assert jobs.begin(first.id)
    monkeypatch.setattr(type(store.jobs), "save", full)
    assert jobs.requeue(first.id, "Its worker was lost") and store.jobs.get(first.id).attempt == 1
    assert jobs.begin(first.id) and jobs.complete(first.id, lambda: {"sum": 3})
    monkeypatch.undo()
    assert jobs.cancel(second.id)
    assert (store.jobs.get(first.id).state, store.jobs.get(first.id).attempt) == ("done", 2)


def test_a_job_that_the_version_before_queued_finishes(store):
    """The row is as version 0.1.0 wrote it, when the function stood in another module."""
    row = json.loads(Path(__file__).with_name("queued_job_0_1_0.json").read_text())
    with store._database.writing("The job") as rows:
        rows.execute(insert(JobRow).values(**row))

    def calibration(made, about):
        return {"calibration": save_new_version(store, Calibration.from_json(made), about["by"]).id}

    with JobEngine(
        workers=1, functions=capabilities.jobs(), result_savers={"calibration": calibration}
    ) as jobs:
        jobs.open(store.jobs)
        (job,) = jobs.all()
        done = ended(jobs, job, 120)
        assert (done.state, done.problem, done.attempt) == ("done", None, 1)
        made = store.calibrations.get(done.result["calibration"])
        assert (made.model_name, made.camera) == ("polynomial", "cam0")


def test_every_name_of_earlier_versions_is_a_job_of_today():
    known = capabilities.jobs()
    for package in PACKAGES:
        assert {current_name(package + name) for name in FORMER_NAMES} <= {*known}
    assert current_name("rig.check") == "rig.check"
    assert all(callable(load(target)) for target in known.values())


def test_a_job_is_stored_by_its_name_and_goes_on_when_its_function_has_moved(opener, store):
    jobs = server(store)
    job = jobs.start("adding", sample_jobs.adds, {"a": 1, "b": 2}, "lens", "waits")
    assert store.jobs.get(job.id).spec["run"] == "adds"
    killed(jobs)
    moved = {**SAMPLES, "adds": "tests.support.sample_jobs:answers_nan"}
    with opener.again(store) as again, server(again, functions=moved) as back:
        made = again.lenses.get(ended(back, job).result["lens"])["made"]
    assert made != 3


def test_a_job_of_a_stranger_is_never_run(opener, store):
    """A data folder may come from an archive that somebody else has made."""
    store.jobs.add(
        "evil", {"run": "os:system", "spec": "true", "keep": None, "about": None, "lasts": True}
    )
    store.jobs.add(
        "odd",
        {
            "run": "tests.support.sample_jobs:adds",
            "spec": {"a": 1, "b": 1},
            "keep": "nobody",
            "about": None,
            "lasts": True,
        },
    )
    store.jobs.add("former", {"n": 1})
    torn = store.jobs.add("torn", {"run": "tests.support.sample_jobs:adds", "spec": {}})
    with store._database.writing("The damage") as rows:
        rows.execute(
            text('UPDATE jobs SET spec = \'{"run": "jobs\' WHERE id = :id'), {"id": torn.id}
        )
    with server(store) as jobs:
        assert {(job.state, job.problem["reason"]) for job in jobs.all()} == {
            ("failed", "job-lost")
        }
        assert len(jobs.all()) == 4 and pids_of(jobs) == ()
        assert {job.state for job in store.jobs.list()} == {"failed"}


def test_readers_do_not_wait_for_the_disk(store, monkeypatch):
    with server(store) as jobs:
        job = jobs.start("sleeping", sample_jobs.sleeps_and_says, {"seconds": 60})
        running(jobs, job)
        save, writing, written = type(store.jobs).save, Event(), Event()

        def slow(self, saved):
            writing.set()
            written.wait(LONG_S)
            save(self, saved)

        monkeypatch.setattr(type(store.jobs), "save", slow)
        thread = Thread(target=jobs.cancel, args=(job.id,))
        thread.start()
        assert writing.wait(LONG_S)
        states = {found.state for found in (jobs.get(job.id), *jobs.all())}
        assert states == {"running"} and thread.is_alive()
        written.set()
        thread.join()
        assert jobs.get(job.id).state == "cancelled"
