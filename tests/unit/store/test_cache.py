"""A cache keeps to its size, counts what is there now, and drops what was used least recently."""

import pytest

from touchline.services.answer_cache import OWN_BYTES, AnswerCache, CachedAnswer
from touchline.store.repository import LruCache


def test_what_was_used_least_recently_goes_first_and_a_value_counts_once():
    cache = LruCache[str, str](10, len)
    for key, value in (("a", "xxxx"), ("b", "xxxx"), ("a", "xx"), ("c", "xxxx")):
        assert cache.put(key, value) == value
    assert (cache.get("a"), cache.get("b"), cache.get("c"), cache.size) == (
        "xx",
        "xxxx",
        "xxxx",
        10,
    )
    cache.get("a")
    cache.put("d", "x")
    assert (cache.get("a"), cache.get("b"), cache.size) == ("xx", None, 7)
    cache.put("e", "x" * 20)  # the newest stays
    assert (cache.get("a"), cache.get("d"), cache.size) == (None, None, 20)
    assert cache.get_or_make("e", lambda: pytest.fail("made again")) == "x" * 20
    assert cache.get_or_make("f", lambda: "x") == "x" and cache.size == 1


def test_the_answers_in_memory_stay_within_their_bound():
    answers = AnswerCache(100_000)
    for number in range(1000):
        answers.put(("overlay", number), CachedAnswer.of(bytes(number)))
        assert answers.size <= 100_000
    there = [number for number in range(1000) if answers.get(("overlay", number)) is not None]
    assert there and there == list(range(there[0], 1000))
    assert answers.size == sum(number + OWN_BYTES for number in there)
