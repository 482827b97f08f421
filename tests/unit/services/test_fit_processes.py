"""Fits in processes that are there beforehand: lost ones, equal ones, those nobody waits for, and refusals."""

import asyncio
import json
import os
import signal
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from tests.support import sample_jobs
from tests.support.waiting import gone, until, until_async
from touchline.core.errors import Cancelled, TouchlineError
from touchline.services.fit_processes import FitProcesses

MODULES = ("tests.support.sample_jobs",)


async def never() -> bool:
    return False


def within(story: Callable[[FitProcesses], Awaitable[Any]]) -> Any:
    """Tell the story with one process."""

    async def told() -> Any:
        fits = FitProcesses(60.0, MODULES, processes=1)
        async with fits.running():
            await until_async(lambda: fits._runners[0].pid)
            await until_async(lambda: fits._idle)
            return await story(fits)

    return asyncio.run(told())


def test_the_process_is_there_before_the_first_fit_and_gone_at_the_end():
    async def story(fits):
        before = fits._runners[0].pid
        found = json.loads(await fits.run(sample_jobs.adds, {"a": 1, "b": 2}, "a", never))
        return before, found

    pid, found = within(story)
    assert found == {"sum": 3, "pid": pid}
    until(lambda: gone(pid))


def test_equal_requests_are_computed_once():
    async def story(fits):
        specs = [{"a": 1, "b": 2}] * 5 + [{"a": 2, "b": 2}]
        found = await asyncio.gather(
            *(fits.run(sample_jobs.adds, spec, f"{i}", never) for i, spec in enumerate(specs))
        )
        return [json.loads(text)["sum"] for text in found], fits._runners[0]._number

    assert within(story) == ([3, 3, 3, 3, 3, 4], 2)


@pytest.mark.parametrize("begun", [False, True])
def test_a_process_that_is_killed_costs_nobody_an_answer(begun):
    async def story(fits):
        pid = fits._runners[0].pid
        asked = asyncio.create_task(
            fits.run(sample_jobs.sleeps_and_says, {"seconds": 0.3}, "a", never)
        )
        if begun:
            await until_async(lambda: fits._runners[0]._has_begun)
        os.kill(pid, signal.SIGKILL)
        return json.loads(await asked), fits._runners[0].pid != pid

    assert within(story) == ({"slept": 0.3}, True)


def test_a_fit_that_always_kills_its_process_is_refused():
    async def story(fits):
        with pytest.raises(TouchlineError) as refused:
            await fits.run(sample_jobs.dies, {"how": "SIGSEGV"}, "a", never)
        return refused.value, json.loads(
            await fits.run(sample_jobs.adds, {"a": 1, "b": 2}, "a", never)
        )["sum"]

    error, after = within(story)
    assert (error.status, error.reason, after) == (503, "worker-died", 3)


def test_a_refusal_is_what_it_was_in_the_process():
    async def story(fits):
        with pytest.raises(TouchlineError) as refused:
            await fits.run(sample_jobs.refuses, {}, "a", never)
        return refused.value

    error = within(story)
    assert (error.status, error.reason, error.what, error.fix, error.details) == (
        422,
        "too-few-points",
        "The left border has 2 points.",
        "Click two more.",
        {"feature": "left"},
    )


def test_nothing_is_computed_for_those_who_have_left():
    async def story(fits):
        has_left = False

        async def left():
            return has_left

        long = {"seconds": 600}
        asked = [
            asyncio.create_task(fits.run(sample_jobs.sleeps_and_says, {**long, "i": i}, "a", left))
            for i in range(20)
        ]
        await until_async(lambda: fits._runners[0]._has_begun)
        has_left = True
        after = json.loads(await fits.run(sample_jobs.adds, {"a": 1, "b": 2}, "a", never))
        ended = await asyncio.gather(*asked, return_exceptions=True)
        return after["sum"], {type(one) for one in ended}, fits._runners[0]._number

    assert within(story) == (3, {Cancelled}, 2)


def test_a_newer_request_of_a_series_takes_the_place_of_one_that_waits():
    async def story(fits):
        asked = [
            asyncio.create_task(fits.run(sample_jobs.adds, {"a": i, "b": 2}, "a", never, "window"))
            for i in range(4)
        ]
        found = await asyncio.gather(*asked, return_exceptions=True)
        return json.loads(found[-1])["sum"], [
            one.reason for one in found if isinstance(one, Cancelled)
        ]

    assert within(story) == (5, ["superseded"] * 2)


def test_who_waits_when_the_server_stops_is_told():
    async def told():
        fits = FitProcesses(60.0, MODULES, processes=1)
        async with fits.running():
            asked = asyncio.create_task(
                fits.run(sample_jobs.sleeps_and_says, {"seconds": 600}, "a", never)
            )
            await until_async(lambda: fits._runners[0]._has_begun)
        with pytest.raises(TouchlineError) as refused:
            await asked
        return refused.value.reason

    assert asyncio.run(told()) == "shutting-down"
