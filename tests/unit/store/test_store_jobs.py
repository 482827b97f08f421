"""Jobs as rows: each is done by one worker at a time, and a lost worker's job is begun again by another."""

from concurrent.futures import ThreadPoolExecutor
from functools import partial

import pytest

from app.core.errors import NotFound
from app.core.jobs import WAITING
from app.core.statements import say
from app.store.jobs import JobRepository
from app.store.repository import utc_now


class Watch:
    now = 100.0

    def __call__(self):
        return self.now


@pytest.fixture
def watch():
    return Watch()


@pytest.fixture
def store(opener, tmp_path):
    with opener(tmp_path / "data") as store:
        yield store


@pytest.fixture
def jobs(store, watch):
    return JobRepository(store._database, utc_now, watch)


def test_a_job_goes_from_waiting_through_running_to_its_result(jobs):
    job = jobs.add("fit", {"points": [0.1, 1 / 3]})
    assert (job.state, job.attempt, job.spec) == ("queued", 0, {"points": [0.1, 1 / 3]})
    mine = jobs.claim("w1", lease_s=5)
    assert (mine.id, mine.state, mine.attempt, mine.worker) == (job.id, "running", 1, "w1")
    assert jobs.claim("w2", lease_s=5) is None
    assert jobs.beat(job.id, 1, 5, 0.5, "Half")
    assert (jobs.get(job.id).progress, jobs.get(job.id).message) == (0.5, "Half")
    assert jobs.finish(job.id, 1, "done", {"calibration": "x"})
    assert not jobs.finish(job.id, 1, "failed") and not jobs.beat(job.id, 1, 5)
    ended = jobs.get(job.id)
    assert ended.ended and ended.progress == 1 and ended.result == {"calibration": "x"} and ended.problem is None


def test_what_a_message_states_is_stored_with_it(opener, store, jobs):
    halfway = say("fit.progress", "Fitting {model}", model="Fisheye")

    def stated(job):
        return job.message, job.to_json().get("statements")

    def said(message):
        return str(message), {"message": list(message.statements)}

    job = jobs.add("fit", {})
    assert stated(job) == stated(jobs.get(job.id)) == said(WAITING)
    jobs.claim("w1", lease_s=5)
    for change, message in ((partial(jobs.beat, job.id, 1, 5, 0.5), halfway),
                            (partial(jobs.requeue, job.id, 1), say("job.server-stopped", "The server was stopped"))):
        assert change(message=message) and stated(jobs.get(job.id)) == said(message)
    jobs.claim("w1", lease_s=5)
    assert jobs.beat(job.id, 2, 5) and stated(jobs.get(job.id)) == said(message)
    assert jobs.beat(job.id, 2, 5, 0.5, "Half") and stated(jobs.get(job.id)) == ("Half", None)
    other = jobs.add("fit", {})
    assert jobs.finish(job.id, 2, "done", message=halfway) and stated(jobs.cancel(other.id, halfway)) == said(halfway)
    with opener.again(store) as again:
        assert [stated(job) for job in again.jobs.list()] == [said(halfway)] * 2


def test_of_many_workers_each_gets_jobs_of_its_own(jobs):
    made = {jobs.add("fit", {"n": n}).id for n in range(40)}

    def work(name):
        taken = []
        while (job := jobs.claim(name, lease_s=60)) is not None:
            taken.append(job.id)
        return taken

    with ThreadPoolExecutor(4) as threads:
        taken = [id for ids in threads.map(work, "abcd") for id in ids]
    assert len(taken) == 40 and set(taken) == made


def test_a_worker_that_is_silent_past_its_lease_loses_the_job_to_another(jobs, watch):
    job = jobs.add("fit", {})
    jobs.claim("w1", lease_s=5)
    watch.now += 4
    assert jobs.beat(job.id, 1, 5) and jobs.claim("w2", lease_s=5) is None
    watch.now += 6
    again = jobs.claim("w2", lease_s=5)
    assert (again.id, again.attempt) == (job.id, 2)
    assert not jobs.beat(job.id, 1, 5) and not jobs.finish(job.id, 1, "done")
    assert jobs.finish(job.id, 2, "done")


def test_after_a_restart_every_running_job_is_offered_again_whatever_the_clock_says(opener, store, watch):
    job = JobRepository(store._database, utc_now, watch).add("fit", {})
    JobRepository(store._database, utc_now, watch).claim("w1", lease_s=1e9)
    with opener.again(store) as again:
        other = Watch()
        other.now = -5.0  # another clock altogether
        claimed = JobRepository(again._database, utc_now, other).claim("w2", lease_s=5)
        assert (claimed.id, claimed.attempt) == (job.id, 2)


def test_cancelling_is_final_and_may_be_repeated(jobs):
    job = jobs.add("fit", {})
    jobs.claim("w1", lease_s=5)
    assert jobs.cancel(job.id).state == jobs.cancel(job.id).state == "cancelled"
    assert not jobs.finish(job.id, 1, "done") and jobs.claim("w2", lease_s=5) is None


def test_ended_jobs_are_forgotten_and_running_ones_stay(jobs):
    running = jobs.add("fit", {})
    jobs.claim("w1", lease_s=5)
    ended = [jobs.cancel(jobs.add("fit", {}).id).id for _ in range(5)]
    jobs.forget([*ended[:3], running.id])
    assert [job.id for job in jobs.list()] == [ended[4], ended[3], running.id]
    with pytest.raises(NotFound):
        jobs.get(ended[0])


@pytest.mark.parametrize("id", ["", "x\0y", "0" * 16])
def test_a_job_that_nobody_asked_for_is_unknown(jobs, id):
    with pytest.raises(NotFound):
        jobs.get(id)
