"""Jobs in real processes: progress, results, refusals, cancelling, dying, and nothing left behind."""

import os
import random
import signal
import subprocess
import sys
import threading
import time

import pytest

from tests.support import sample_jobs
from tests.support.child_processes import pids_of
from tests.support.paths import ROOT
from tests.support.tiers import long
from tests.support.waiting import ended, gone, running, until
from touchline.core.errors import Busy, NotFound, Unavailable
from touchline.core.jobs import Caller
from touchline.jobs import JobEngine
from touchline.jobs.engine import MAX_QUEUED, MAX_QUEUED_EACH, FairQueue, check_room


@pytest.fixture(scope="module")
def standing():
    with JobEngine(workers=2) as jobs:
        yield jobs


@pytest.fixture(scope="module")
def single():
    """An engine with one worker, which waits for work."""
    with JobEngine(workers=1) as jobs:
        ended(jobs, jobs.start("adding", sample_jobs.adds, {"a": 1, "b": 1}))
        yield jobs


@pytest.fixture
def jobs(single):
    """That engine; a test leaves it with nothing to do."""
    yield single
    assert all(job.ended for job in single.all())


def test_a_job_is_done_in_a_process_of_its_own_and_says_how_far_it_has_come(standing):
    job = standing.start("adding", sample_jobs.adds, {"a": 2, "b": 3})
    assert job.state == "queued" and job.kind == "adding"
    done = ended(standing, job)
    assert (done.state, done.result["sum"], done.progress, done.problem) == ("done", 5, 1.0, None)
    assert done.result["pid"] != os.getpid() and done.ended_at >= done.created_at
    slow = standing.start("sleeping", sample_jobs.sleeps_and_says, {"seconds": 0.6})
    seen = []
    until(lambda: seen.append(standing.get(slow.id).progress) or standing.get(slow.id).ended)
    assert (
        seen == sorted(seen)
        and len(set(seen)) > 4
        and standing.get(slow.id).result == {"slept": 0.6}
    )


def test_a_refusal_comes_back_as_a_problem_with_its_fix(standing):
    failed = ended(standing, standing.start("fit", sample_jobs.refuses, {}))
    assert failed.state == "failed" and failed.result is None
    assert failed.problem == {
        "reason": "too-few-points",
        "title": "Too few points",
        "status": 422,
        "feature": "left",
        "detail": "The left border has 2 points.",
        "fix": "Click two more.",
    }


def test_a_mistake_of_ours_is_a_failed_job_whose_trace_is_in_the_log_alone(standing, caplog):
    failed = ended(standing, standing.start("fit", sample_jobs.breaks, {}))
    assert (
        failed.state == "failed"
        and failed.problem["reason"] == "unexpected"
        and failed.problem["fix"]
    )
    assert "KeyError" in caplog.text and "KeyError" not in str(failed.problem)


DEATHS = {
    "SIGKILL": "worker-died",
    "SIGSEGV": "worker-died",
    "null pointer": "worker-died",
    "exit 0": "worker-died",
    "SystemExit": "unexpected",
    "10 GB": "job-needs-memory",
}


@pytest.mark.parametrize(
    "how", [long(how) if how in ("SIGSEGV", "null pointer") else how for how in DEATHS]
)
def test_a_job_that_kills_each_worker_has_failed_after_three_with_a_fix_and_the_next_one_is_done(
    standing, how
):
    failed = ended(standing, standing.start("dying", sample_jobs.dies, {"how": how}))
    assert failed.state == "failed" and failed.problem["fix"].endswith(".")
    assert failed.problem["reason"] == DEATHS[how]
    assert failed.attempt == (3 if DEATHS[how] == "worker-died" else 1)
    assert (
        ended(standing, standing.start("adding", sample_jobs.adds, {"a": 1, "b": 1})).result["sum"]
        == 2
    )


@pytest.mark.parametrize("how", ["SIGSTOP", long("closed line")])
def test_a_worker_that_answers_no_more_is_ended_when_its_time_is_up(how):
    with JobEngine(workers=1, wall_s=6) as jobs:
        failed = ended(jobs, jobs.start("hanging", sample_jobs.dies, {"how": how}))
        assert failed.state == "failed" and failed.problem["reason"] in (
            "job-too-long",
            "worker-died",
        )
        assert (
            ended(jobs, jobs.start("adding", sample_jobs.adds, {"a": 1, "b": 1})).result["sum"] == 2
        )


def test_a_worker_killed_from_outside_while_idle_is_replaced(jobs):
    first = ended(jobs, jobs.start("adding", sample_jobs.adds, {"a": 1, "b": 1})).result["pid"]
    os.kill(first, signal.SIGKILL)
    until(lambda: gone(first))
    second = ended(jobs, jobs.start("adding", sample_jobs.adds, {"a": 1, "b": 2})).result
    assert second["sum"] == 3 and second["pid"] != first


@pytest.mark.parametrize("times", [2, long(20)])
def test_a_job_given_to_a_process_that_is_just_dying_is_done_by_a_new_one(jobs, times):
    """A killed process cannot be waited for while its last threads end: it looks alive for a moment."""
    for n in range(times):
        pid = ended(jobs, jobs.start("adding", sample_jobs.adds, {"a": 1, "b": 1})).result["pid"]
        os.kill(pid, signal.SIGKILL)
        again = ended(jobs, jobs.start("adding", sample_jobs.adds, {"a": n, "b": 2}))
        assert again.state == "done" and again.result["sum"] == n + 2 and again.result["pid"] != pid


def test_a_flood_of_words_harms_nobody_and_nan_is_null(standing):
    assert (
        ended(standing, standing.start("flood", sample_jobs.dies, {"how": "flood"})).result
        == "flooded"
    )
    found = ended(standing, standing.start("nan", sample_jobs.answers_nan, {})).result
    assert found == {"value": None, "list": [1.0, None]}
    assert (
        len(
            ended(
                standing, standing.start("much", sample_jobs.answers_much, {"bytes": 20_000_000})
            ).result
        )
        == 2e7
    )


def test_a_worker_uses_one_thread_for_arithmetic_and_knows_no_token(monkeypatch):
    monkeypatch.setenv("TOUCHLINE_TOKEN", "a secret of sixteen letters")
    with JobEngine(workers=1) as jobs:
        found = ended(jobs, jobs.start("threads", sample_jobs.says_its_threads, {})).result
    assert found == {"threads": 2, "token": None}  # the job, and the one that listens for the end


def test_cancelling_is_immediate_and_idempotent_and_the_worker_goes_on(jobs):
    job = jobs.start("sleeping", sample_jobs.sleeps_and_says, {"seconds": 30})
    running(jobs, job)
    (pid,) = pids_of(jobs)
    assert jobs.cancel(job.id).state == "cancelled"
    assert jobs.cancel(job.id) == jobs.get(job.id)
    start = time.monotonic()
    other = ended(jobs, jobs.start("adding", sample_jobs.adds, {"a": 1, "b": 1}))
    # not after the 30 s of the other
    assert other.result == {"sum": 2, "pid": pid} and time.monotonic() - start < 20


def test_a_cancelled_job_that_does_not_listen_is_killed_long_before_its_end(jobs):
    job = jobs.start("computing", sample_jobs.computes_in_silence, {"seconds": 60})
    until(lambda: pids_of(jobs) and jobs.get(job.id).state == "running")
    time.sleep(0.5)  # so that it computes by now
    (pid,) = pids_of(jobs)
    start = time.monotonic()
    assert jobs.cancel(job.id).state == "cancelled"
    until(lambda: gone(pid))
    assert time.monotonic() - start < 20  # a second on a quiet machine
    assert ended(jobs, jobs.start("adding", sample_jobs.adds, {"a": 1, "b": 1})).result["sum"] == 2
    assert jobs.get(job.id).state == "cancelled" and jobs.get(job.id).problem is None


def test_a_job_that_waits_is_cancelled_without_ever_running(jobs):
    first = jobs.start("sleeping", sample_jobs.sleeps_and_says, {"seconds": 30})
    jobs.result_savers["never"] = pytest.fail
    second = jobs.start("adding", sample_jobs.adds, {"a": 1, "b": 1}, saver="never")
    assert jobs.cancel(second.id).state == "cancelled"
    jobs.cancel(first.id)
    assert ended(jobs, jobs.start("adding", sample_jobs.adds, {"a": 1, "b": 1})).state == "done"


def cancelled_at_random(jobs, times, seed=0):
    """Cancels jobs at random times, also while they are kept; what the book says must be what was kept."""
    rng = random.Random(seed)
    states = []
    for number in range(times):
        kept = []

        def keep(result, about, kept=kept):
            time.sleep(0.01)  # a disk
            kept.append(result)
            return {"kept": about}

        jobs.result_savers["list"] = keep
        job = jobs.start("sleeping", sample_jobs.sleeps_and_says, {"seconds": 0.03}, "list", number)
        time.sleep(rng.uniform(0, 0.15))
        told = jobs.cancel(job.id)
        if told.state == "running":  # it was being kept: then it ends as done, and soon
            told = ended(jobs, job)
        time.sleep(0.02)
        assert told.state in ("done", "cancelled") and jobs.get(job.id) == told, (number, told)
        assert len(kept) == (told.state == "done"), (number, told)
        states.append(told.state)
    return states


@pytest.mark.parametrize("times", [8, long(30)])
def test_cancelled_at_random_times_a_job_is_kept_whole_or_not_at_all(jobs, times):
    states = cancelled_at_random(jobs, times)
    assert times < 30 or {"done", "cancelled"} == set(states)


@pytest.mark.long
def test_cancelled_at_three_hundred_random_times_likewise():
    with JobEngine(workers=2) as jobs:
        assert {"done", "cancelled"} == set(cancelled_at_random(jobs, 300, seed=1))


def test_what_fails_while_it_is_kept_is_a_failed_job(jobs):
    def keep(result, about):
        raise Unavailable("The disk is full.", "Free some space.", reason="disk-full")

    jobs.result_savers["full"] = keep
    failed = ended(jobs, jobs.start("adding", sample_jobs.adds, {"a": 1, "b": 1}, "full"))
    assert failed.state == "failed" and failed.problem["reason"] == "disk-full"


def test_a_worker_killed_midway_is_another_attempt_and_the_other_jobs_stay_as_they_are(standing):
    pair = [
        standing.start("sleeping", sample_jobs.sleeps_and_says, {"seconds": 1.0}) for _ in range(2)
    ]
    for job in pair:
        running(standing, job)
    os.kill(pids_of(standing)[0], signal.SIGKILL)
    until(lambda: any(standing.get(job.id).attempt == 2 for job in pair))
    assert sorted((ended(standing, job).state, standing.get(job.id).attempt) for job in pair) == [
        ("done", 1),
        ("done", 2),
    ]
    assert all(standing.get(job.id).result == {"slept": 1.0} for job in pair)


def test_a_job_that_was_lost_once_waits_with_its_attempt_said_and_its_progress_at_nought(jobs):
    lost = jobs.start("sleeping", sample_jobs.sleeps_and_says, {"seconds": 30})
    running(jobs, lost)
    next_in_line = jobs.start("sleeping", sample_jobs.sleeps_and_says, {"seconds": 30})
    os.kill(pids_of(jobs)[0], signal.SIGKILL)
    waiting = until(lambda: (job := jobs.get(lost.id)).state == "queued" and job)
    assert (waiting.attempt, waiting.progress, "attempt 2 of 3" in waiting.message) == (
        2,
        0.0,
        True,
    )
    running(jobs, next_in_line)
    assert jobs.cancel(lost.id).state == "cancelled"
    jobs.cancel(next_in_line.id)
    after = ended(jobs, jobs.start("adding", sample_jobs.adds, {"a": 1, "b": 1}))
    assert after.state == "done" and jobs.get(lost.id).state == "cancelled"


def test_a_cancelled_job_whose_worker_is_lost_is_not_tried_again(jobs):
    job = jobs.start("computing", sample_jobs.computes_in_silence, {"seconds": 30})
    until(lambda: pids_of(jobs) and jobs.get(job.id).state == "running")
    jobs.cancel(job.id)
    for pid in pids_of(jobs):
        os.kill(pid, signal.SIGKILL)
    assert ended(jobs, jobs.start("adding", sample_jobs.adds, {"a": 1, "b": 1})).result["sum"] == 2
    assert (jobs.get(job.id).state, jobs.get(job.id).attempt) == ("cancelled", 1)


def test_a_caller_has_a_share_of_the_queue_and_another_one_comes_before_the_rest_of_it():
    with JobEngine(workers=1) as jobs:
        first = jobs.start(
            "sleeping", sample_jobs.sleeps_and_says, {"seconds": 60}, caller=Caller("hall", "Anna")
        )
        running(jobs, first)
        waiting = [
            jobs.start("adding", sample_jobs.adds, {"a": 1, "b": n}, caller=Caller("hall", "Anna"))
            for n in range(MAX_QUEUED_EACH)
        ]
        with pytest.raises(Busy, match="your jobs"):
            jobs.start("adding", sample_jobs.adds, {}, caller=Caller("hall", "Anna"))
        other = jobs.start(
            "adding", sample_jobs.adds, {"a": 2, "b": 2}, caller=Caller("hall", "Ben")
        )
        jobs.cancel(first.id)
        told = [ended(jobs, job) for job in (other, *waiting)]
    assert all(job.state == "done" for job in told) and told[0].ended_at == min(
        job.ended_at for job in told
    )


def test_an_address_with_many_names_leaves_half_of_the_queue_and_comes_after_one_with_fewer_jobs():
    with JobEngine(workers=1) as jobs:
        first = jobs.start(
            "sleeping", sample_jobs.sleeps_and_says, {"seconds": 60}, caller=Caller("hostile", "0")
        )
        running(jobs, first)
        waiting = [
            jobs.start(
                "adding", sample_jobs.adds, {"a": 1, "b": n}, caller=Caller("hostile", f"{n + 1}")
            )
            for n in range(MAX_QUEUED // 2)
        ]
        with pytest.raises(Busy, match=f"{MAX_QUEUED // 2} jobs from your address"):
            jobs.start("adding", sample_jobs.adds, {}, caller=Caller("hostile", "a new one"))
        other = [
            jobs.start("adding", sample_jobs.adds, {"a": 2, "b": 2}, caller=Caller("hall", "Anna"))
            for _ in range(2)
        ]
        jobs.cancel(first.id)
        told = [ended(jobs, job) for job in (*other, *waiting)]
    order = sorted(told, key=lambda job: (job.ended_at, told.index(job)))
    assert all(job.state == "done" for job in told) and {job.id for job in order[:3]} >= {
        job.id for job in other
    }


def test_behind_one_address_the_name_with_fewer_jobs_comes_first():
    queue = FairQueue()
    for place, (address, name, of_address, of_name) in enumerate(
        [
            ("hall", "Anna", 0, 0),
            ("hall", "Anna", 1, 1),
            ("hall", "Anna", 2, 2),
            ("hall", "Ben", 3, 0),
            ("office", "Cy", 0, 0),
            ("office", "Cy", 1, 1),
        ]
    ):
        queue.put(place, Caller(address, name), of_address, of_name)
    queue.end()
    assert [queue.get() for _ in range(7)] == [0, 4, 3, 5, 1, 2, None]


def test_all_callers_together_cannot_queue_without_end():
    with JobEngine(workers=1) as jobs:
        running(jobs, jobs.start("sleeping", sample_jobs.sleeps_and_says, {"seconds": 60}))
        for n in range(MAX_QUEUED):
            jobs.start("adding", sample_jobs.adds, {"a": 1, "b": n}, caller=Caller(f"address {n}"))
        with pytest.raises(Busy, match=f"{MAX_QUEUED} jobs are"):
            jobs.start("adding", sample_jobs.adds, {}, caller=Caller("one more"))


def test_addresses_that_take_all_they_can_leave_places_for_one_more():
    waiting = []
    for hostile in range(6):
        with pytest.raises(Busy):
            for name in range(MAX_QUEUED):
                check_room(caller := Caller(f"{hostile}", f"{name}"), waiting)
                waiting.append(caller)
    check_room(Caller("hall"), waiting)


def test_what_has_ended_of_late_is_not_forgotten_however_much_it_is():
    with JobEngine(workers=2, kept=5) as jobs:
        made = [
            jobs.start("adding", sample_jobs.adds, {"a": 1, "b": n}) for n in range(MAX_QUEUED_EACH)
        ]
        assert [ended(jobs, job).result["sum"] for job in made] == [
            1 + n for n in range(MAX_QUEUED_EACH)
        ]
        assert len(jobs.all()) == 5  # a list stays as short as it was


def test_too_many_waiting_jobs_are_refused_and_old_ones_are_forgotten():
    with JobEngine(workers=1, kept=5, kept_s=0) as jobs:
        first = jobs.start("sleeping", sample_jobs.sleeps_and_says, {"seconds": 60})
        running(jobs, first)
        waiting = [jobs.start("adding", sample_jobs.adds, {"a": 1, "b": n}) for n in range(20)]
        with pytest.raises(Busy):
            jobs.start("adding", sample_jobs.adds, {})
        jobs.cancel(first.id)
        last = ended(jobs, waiting[-1])
        assert [job.id for job in jobs.all()] == [
            job.id for job in reversed(waiting[-5:])
        ] and last.result["sum"] == 20
        with pytest.raises(NotFound, match="no job"):
            jobs.get(first.id)


def test_no_process_and_no_thread_is_left_after_closing_whatever_runs():
    before = threading.active_count()
    jobs = JobEngine(workers=2)
    silent = jobs.start("computing", sample_jobs.computes_in_silence, {"seconds": 30})
    talking = jobs.start("sleeping", sample_jobs.sleeps_and_says, {"seconds": 30})
    waiting = jobs.start("adding", sample_jobs.adds, {"a": 1, "b": 1})
    running(jobs, talking)
    until(lambda: len(pids_of(jobs)) == 2)
    pids, start = pids_of(jobs), time.monotonic()
    jobs.close()
    assert time.monotonic() - start < 20 and all(gone(pid) for pid in pids) and pids_of(jobs) == ()
    assert threading.active_count() == before
    assert {jobs.get(job.id).state for job in (silent, talking, waiting)} == {"cancelled"}
    with pytest.raises(Unavailable, match="shutting down"):
        jobs.start("adding", sample_jobs.adds, {})
    jobs.close()


def test_nothing_starts_before_the_first_job():
    before = threading.active_count()
    with JobEngine() as jobs:
        assert pids_of(jobs) == () and threading.active_count() == before


SERVER = """
import sys, time
sys.path.insert(0, {root!r})
from tests.support import sample_jobs
from tests.support.child_processes import pids_of
from touchline.jobs import JobEngine
jobs = JobEngine(workers=1)
job = jobs.start("computing", sample_jobs.{job}, {{"seconds": 60}})
while not pids_of(jobs) or jobs.get(job.id).state != "running":
    time.sleep(0.01)
time.sleep(0.5)
print(pids_of(jobs)[0], flush=True)
time.sleep(60)
"""


@pytest.mark.parametrize("job", ["computes_in_silence", "sleeps_and_says"])
def test_a_worker_ends_when_its_server_is_killed(job):
    server = subprocess.Popen(
        [sys.executable, "-c", SERVER.format(root=str(ROOT), job=job)],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        pid = int(server.stdout.readline())
    finally:
        server.kill()
        server.wait()
    until(lambda: gone(pid))
