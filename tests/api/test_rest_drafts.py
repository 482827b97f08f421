"""Drafts: a reload loses nothing, and of two operators the slower one is told and loses nothing either."""

import pytest

from tests.support.refusals import API, refusal


@pytest.fixture
def client(standing):
    """Each test has a snapshot of its own."""
    return standing


@pytest.fixture
def draft(snapshot):
    return f"{API}/drafts/{snapshot['id']}"


def test_a_draft_is_empty_before_the_first_save(client, draft):
    answer = client.get(draft)
    assert answer.json() == {
        "field": None,
        "region": None,
        "rotate": None,
        "model": None,
        "options": {},
        "observations": [],
        "updated_at": None,
        "updated_by": None,
    }
    assert answer.headers["etag"].startswith('"') and answer.headers["cache-control"] == "no-store"


def test_a_saved_draft_comes_back_with_the_etag_of_its_saving(client, draft, task):
    body = {
        "field": "ssl-2008",
        "region": "half",
        "rotate": 90,
        "model": "polynomial",
        "options": {"degree": "auto"},
        "observations": task["observations"],
    }
    saved = client.put(draft, json=body, headers={"If-Match": client.get(draft).headers["etag"]})
    assert saved.status_code == 200 and saved.json()["updated_at"]
    read = client.get(draft)
    assert read.json() == saved.json() and read.headers["etag"] == saved.headers["etag"]
    assert [o["points"] for o in read.json()["observations"]] == [
        o["points"] for o in task["observations"]
    ]


def test_the_slower_of_two_is_told_what_stands_there_now(client, draft):
    opened = client.get(draft).headers["etag"]
    first = client.put(draft, json={"field": "ssl-2008"}, headers={"If-Match": opened})
    problem = refusal(
        second := client.put(draft, json={"field": "table"}, headers={"If-Match": opened}), 412
    )
    assert (
        problem["current"]["field"] == "ssl-2008"
        and second.headers["etag"] == first.headers["etag"]
    )
    again = client.put(draft, json={"field": "table"}, headers={"If-Match": second.headers["etag"]})
    assert again.status_code == 200 and client.get(draft).json()["field"] == "table"


def test_a_save_that_does_not_say_what_it_changes_is_refused(client, draft):
    refusal(client.put(draft, json={}), 428)
    for etag in ("*", '""', '"nope"', "x" * 100):
        refusal(client.put(draft, json={}, headers={"If-Match": etag}), 412)
    refusal(client.put(draft, json={}, headers={"If-Match": "x" * 1000}), 422)


def test_a_draft_of_an_unknown_snapshot_is_refused(client):
    refusal(client.get(f"{API}/drafts/0123456789abcdef"), 404, "unknown-snapshot")
    refusal(client.put(f"{API}/drafts/0123456789abcdef", json={}, headers={"If-Match": "x"}), 404)


@pytest.mark.parametrize(
    "body",
    [
        {"observations": [{"feature": "left", "points": [[1, 1e308]]}]},
        {"observations": 3},
        {"field": 3},
        {"more": 1},
        {"options": {"a": [1]}},
        {"observations": [{"feature": "left", "kind": "line", "points": [[1, None]]}]},
    ],
)
def test_a_draft_that_is_none_is_refused_and_the_former_stays(client, draft, body):
    etag = client.get(draft).headers["etag"]
    refusal(client.put(draft, json=body, headers={"If-Match": etag}), 422)
    assert client.get(draft).headers["etag"] == etag


def test_a_half_made_draft_may_be_kept(client, draft):
    half = {
        "field": "ssl-2008",
        "observations": [{"feature": "left", "kind": "line", "points": []}],
    }
    assert (
        client.put(
            draft, json=half, headers={"If-Match": client.get(draft).headers["etag"]}
        ).status_code
        == 200
    )
