"""Operators who work at the same time, over HTTP, against a plain model: nobody overwrites anybody, nothing is lost.

Short in every run. The figure of the manual (1,000 runs of 30 steps):

    pytest -m long tests/unit/store/test_store_operators.py
"""

import json
from concurrent.futures import ThreadPoolExecutor
from itertools import count

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    precondition,
    rule,
    run_state_machine_as_test,
)

from tests.support.pictures import encoded, gradient
from tests.support.servers import ROOT, Line, an_export, form, served

TASK = json.loads((ROOT / "tests" / "clicks" / "ssl_2008_half.json").read_text())
WHO = st.integers(0, 3)  # of two to four operators; the number is taken modulo how many there are
PICK = st.integers(0, 10**6)
number = count(1)  # every run has a camera of its own


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    with served(tmp_path_factory.mktemp("data")) as url:
        yield url, an_export(url, TASK)


def machine(url, exported):
    class Operators(RuleBasedStateMachine):
        """Each operator knows the draft that they opened last; the model knows what everybody was promised."""

        @initialize(operators=st.integers(2, 4))
        def arrive(self, operators):
            self.lines = [Line(url) for _ in range(operators)]
            self.camera = f"c{next(number)}"
            data, headers = form(encoded("png", gradient(32, 24)))
            status, _, content = self.lines[0].ask("POST", "/snapshots", data, headers)
            assert status == 201
            self.snapshot = json.loads(content)["id"]
            self.opened = [None] * operators  # the ETag that each has
            self.draft, self.etag = None, None  # what the server must have
            self.versions = {}  # id: the bytes that were promised
            self.deleted, self.active, self.last = set(), None, 0

        def who(self, number):
            return number % len(self.lines)

        @rule(who=WHO)
        def open_the_draft(self, who):
            who = self.who(who)
            status, headers, draft = self.lines[who].json("GET", f"/drafts/{self.snapshot}")
            assert status == 200
            assert self.etag is None or headers["ETag"] == self.etag
            assert self.draft is None or content_of(draft) == self.draft
            self.opened[who] = headers["ETag"]
            self.etag, self.draft = headers["ETag"], content_of(draft)

        @rule(who=WHO, points=st.lists(st.tuples(st.floats(0, 700), st.floats(0, 500)), max_size=3))
        def save_the_draft(self, who, points):
            who = self.who(who)
            self.saved(who, self.put(who, points))

        @rule(
            points=st.lists(st.tuples(st.floats(0, 700), st.floats(0, 500)), min_size=1, max_size=2)
        )
        @precondition(lambda self: self.etag is not None)
        def all_save_at_the_same_moment(self, points):
            self.opened = [self.etag] * len(self.lines)
            with ThreadPoolExecutor(len(self.lines)) as threads:
                answers = list(
                    threads.map(
                        lambda who: self.put(who, [*points, (who, who)]), range(len(self.lines))
                    )
                )
            winners = [who for who, (status, _, _, _) in enumerate(answers) if status == 200]
            assert len(winners) == 1 and all(status in (200, 412) for status, _, _, _ in answers)
            self.saved(winners[0], answers[winners[0]])

        def put(self, who, points):
            body = {
                "field": "table",
                "observations": [
                    {"feature": "left", "kind": "line", "points": [list(point) for point in points]}
                ],
            }
            headers = {
                "X-Operator": f"operator {who}",
                **({"If-Match": self.opened[who]} if self.opened[who] else {}),
            }
            return *self.lines[who].json("PUT", f"/drafts/{self.snapshot}", body, headers), body

        def saved(self, who, answer):
            status, headers, told, body = answer
            if self.opened[who] is None:
                assert status == 428
            elif self.opened[who] != self.etag:
                assert (
                    status == 412
                    and content_of(told["current"]) == self.draft
                    and headers["ETag"] == self.etag
                )
            else:
                assert (
                    status == 200
                    and told["observations"][0]["points"] == body["observations"][0]["points"]
                )
                assert told["updated_by"] == f"operator {who}"
                self.opened[who] = self.etag = headers["ETag"]
                self.draft = content_of(told)

        @rule(who=WHO, note=st.text(max_size=8))
        def save_a_calibration(self, who, note):
            data, headers = form(json.dumps({**exported, "camera": None, "note": note}).encode())
            status, _, content = self.lines[self.who(who)].ask(
                "POST", "/calibrations/import", data, headers
            )
            assert status == 201, content
            kept = json.loads(content)
            assert kept["id"] not in self.versions
            self.versions[kept["id"]] = self.bytes_of(who, kept["id"])

        @rule(who=WHO, pick=PICK)
        @precondition(lambda self: self.versions)
        def look_at_a_calibration(self, who, pick):
            id = sorted(self.versions)[pick % len(self.versions)]
            if id in self.deleted:
                assert self.lines[self.who(who)].ask("GET", f"/calibrations/{id}")[0] == 404
            else:
                assert self.bytes_of(who, id) == self.versions[id]

        @rule(who=WHO, pick=PICK)
        @precondition(lambda self: set(self.versions) - self.deleted)
        def activate(self, who, pick):
            there = sorted(set(self.versions) - self.deleted)
            id = there[pick % len(there)]
            status, _, told = self.lines[self.who(who)].json("POST", f"/calibrations/{id}/activate")
            assert status == 200 and told["active"]
            self.active = id

        @rule(who=WHO, pick=PICK)
        @precondition(lambda self: set(self.versions) - self.deleted)
        def delete(self, who, pick):
            there = sorted(set(self.versions) - self.deleted)
            id = there[pick % len(there)]
            status = self.lines[self.who(who)].ask("DELETE", f"/calibrations/{id}")[0]
            assert status == (409 if id == self.active else 204)
            if status == 204:
                self.deleted.add(id)

        def bytes_of(self, who, id):
            status, _, content = self.lines[self.who(who)].ask("GET", f"/calibrations/{id}")
            assert status == 200
            assert (b'"active":true' in content) == (id == self.active)
            return content.replace(b'"active":true', b'"active":false')

        def teardown(self):
            if not hasattr(self, "lines"):
                return
            for id, content in self.versions.items():
                if id not in self.deleted:
                    assert self.bytes_of(0, id) == content
            for line in self.lines:
                line.close()

    return Operators


def content_of(draft):
    return {
        key: draft[key] for key in ("field", "region", "rotate", "model", "options", "observations")
    }


def at_work(server, runs, steps, always_the_same=False):
    run_state_machine_as_test(
        lambda: machine(*server)(),
        settings=settings(
            max_examples=runs,
            stateful_step_count=steps,
            derandomize=always_the_same,
            deadline=None,
            database=None,
            print_blob=True,
            suppress_health_check=list(HealthCheck),
        ),
    )


def test_operators_at_the_same_time_lose_nothing(server):
    at_work(server, runs=4, steps=15, always_the_same=True)


@pytest.mark.long
def test_a_thousand_runs_of_operators_at_the_same_time_lose_nothing(server):
    at_work(server, runs=1000, steps=30)
