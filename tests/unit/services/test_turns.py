"""Whose turn is next: of addresses in turn, of a series only the newest, and of a crowd not its newest."""

import asyncio
from collections.abc import Awaitable, Callable

import pytest

from touchline.core.errors import Busy, Cancelled, TouchlineError
from touchline.services.fit_processes import MAX_WAITING, QueuePlace, Turns


class Queue:
    """One place that is taken, and callers who wait for it: who has had it, and who was refused, by name."""

    def __init__(self) -> None:
        self.turns, self.had, self.refused = Turns(1), [], {}
        self.free, self.tasks = asyncio.Event(), {}
        self.waiting: dict[str, QueuePlace] = {}

    async def ask(self, name: str, address: str, series: str | None = None) -> None:
        self.waiting[name] = turn = QueuePlace(address, series)

        async def wait() -> None:
            try:
                async with self.turns.take(turn):
                    self.had.append(name)
                    await self.free.wait()
            except TouchlineError as error:
                self.refused[name] = error

        self.tasks[name] = asyncio.create_task(wait())
        await asyncio.sleep(0)  # until it is in the queue

    async def end(self) -> list[str]:
        self.free.set()
        await asyncio.gather(*self.tasks.values(), return_exceptions=True)
        return self.had


def within(story: Callable[[Queue], Awaitable[None]]) -> Queue:
    async def told() -> Queue:
        queue = Queue()
        await queue.ask("first", "z")
        await story(queue)
        await queue.end()
        assert queue.turns._free == 1 and not queue.turns._waiting
        return queue

    return asyncio.run(told())


def test_addresses_take_turns_however_many_one_sends():
    async def story(queue):
        for i in range(4):
            await queue.ask(f"a{i}", "a")
        await queue.ask("b0", "b")
        await queue.ask("c0", "c")

    assert within(story).had == ["first", "a0", "b0", "c0", "a1", "a2", "a3"]


def test_a_newer_request_of_a_series_has_the_place_of_the_older_one():
    async def story(queue):
        await queue.ask("old", "a", "window")
        await queue.ask("other", "a")
        await queue.ask("of another address", "b", "window")
        await queue.ask("new", "a", "window")

    queue = within(story)
    assert queue.had == ["first", "new", "of another address", "other"]
    assert {name: error.reason for name, error in queue.refused.items()} == {"old": "superseded"}


def test_one_that_is_under_way_is_answered_however_many_come():
    async def told():
        queue = Queue()
        for name in ("under way", "old", "new"):
            await queue.ask(name, "a", "window")
        return await queue.end(), [*queue.refused]

    assert asyncio.run(told()) == (["under way", "new"], ["old"])


def test_who_leaves_has_no_turn():
    async def story(queue):
        for name in ("a0", "a1", "a2"):
            await queue.ask(name, "a")
        queue.tasks["a0"].cancel()
        queue.waiting["a1"].end(Cancelled("The caller has gone.", "Ask again."))

    assert within(story).had == ["first", "a2"]


@pytest.mark.parametrize("leaves", ["task", "turn"])
def test_a_place_that_was_given_to_one_who_has_just_left_goes_on(leaves):
    async def told():
        queue = Queue()
        await queue.ask("first", "z")
        await queue.ask("gone", "a")
        await queue.ask("next", "a")
        queue.free.set()
        while not queue.waiting["gone"].begun.done():
            await asyncio.sleep(0)
        if leaves == "task":
            queue.tasks["gone"].cancel()
        else:
            queue.waiting["gone"].end(Cancelled("The caller has gone.", "Ask again."))
        await queue.end()
        return queue.had[-1], queue.turns._free

    assert asyncio.run(told()) == ("next", 1)


def test_in_a_crowd_the_address_with_the_most_is_refused():
    async def story(queue):
        for i in range(MAX_WAITING):
            await queue.ask(f"a{i}", "a")
        await queue.ask("b0", "b")

    queue = within(story)
    assert [*queue.refused] == [f"a{MAX_WAITING - 1}"] and isinstance(
        queue.refused[f"a{MAX_WAITING - 1}"], Busy
    )
    assert queue.had[:3] == ["first", "a0", "b0"]


def test_a_crowd_of_single_requests_refuses_one():
    async def story(queue):
        for i in range(MAX_WAITING + 1):
            await queue.ask(f"{i}", f"address {i}")

    assert len(within(story).refused) == 1
