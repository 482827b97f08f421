"""Jobs as rows: a row says how its job stands, whoever reads it and when."""

from dataclasses import replace

import pytest

from touchline.core.errors import NotFound
from touchline.core.jobs import WAITING
from touchline.core.statements import say


@pytest.fixture
def store(opener, tmp_path):
    with opener(tmp_path / "data") as store:
        yield store


@pytest.fixture
def jobs(store):
    return store.jobs


def test_a_job_goes_from_waiting_through_running_to_its_result(jobs):
    job = jobs.add("fit", {"points": [0.1, 1 / 3]})
    assert (job.state, job.attempt, job.spec) == (
        "queued",
        1,
        {"points": [0.1, 1 / 3]},
    ) and jobs.get(job.id) == job
    running = replace(job, state="running", progress=0.5, message="Half")
    jobs.save(running)
    assert jobs.get(job.id) == running
    waits = replace(running, state="queued", attempt=2, progress=0.0)
    jobs.save(waits)
    assert jobs.get(job.id) == waits
    ended = replace(
        waits,
        state="done",
        progress=1.0,
        result={"calibration": "x"},
        ended_at="2026-01-01T00:00:00.000Z",
    )
    jobs.save(ended)
    assert jobs.get(job.id) == ended and ended.ended


def test_what_a_message_states_is_stored_with_it(opener, store, jobs):
    halfway = say("fit.progress", "Fitting {model}", model="Fisheye")

    def stated(job):
        return job.message, job.to_json().get("statements")

    def said(message):
        return str(message), {"message": list(message.statements)}

    job = jobs.add("fit", {})
    assert stated(job) == stated(jobs.get(job.id)) == said(WAITING)
    jobs.save(replace(job, message="Half"))
    assert stated(jobs.get(job.id)) == ("Half", None)
    jobs.save(replace(job, message=halfway))
    with opener.again(store) as again:
        assert [stated(job) for job in again.jobs.list()] == [said(halfway)]


def test_ended_jobs_are_forgotten_and_running_ones_stay(jobs):
    running = jobs.add("fit", {})
    jobs.save(replace(running, state="running"))
    ended = [jobs.add("fit", {}) for _ in range(5)]
    for job in ended:
        jobs.save(replace(job, state="cancelled"))
    jobs.forget([*(job.id for job in ended[:3]), running.id])
    assert [job.id for job in jobs.list()] == [ended[4].id, ended[3].id, running.id]
    with pytest.raises(NotFound):
        jobs.get(ended[0].id)


@pytest.mark.parametrize("id", ["", "x\0y", "0" * 16])
def test_a_job_that_nobody_asked_for_is_unknown(jobs, id):
    with pytest.raises(NotFound):
        jobs.get(id)
