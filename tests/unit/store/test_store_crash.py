"""kill -9 at any moment: what was acknowledged is there, whole, and what was not is there whole or not at all."""

import json
import os
import random
import signal
import subprocess
import sys
import time

import pytest

from tests.support.paths import ROOT
from tests.support.store_writer import digest
from tests.support.tiers import long
from touchline.core.errors import NotFound
from touchline.store.snapshots import EMPTY
from touchline.store.store import Store

MAX_CALLS = 12  # of one life; the writer does nothing but save
CALL_S = 0.005  # about what the first one takes


@pytest.fixture
def writer(tmp_path):
    """The process that saves (see store_writer.py), on its folder."""
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(ROOT)}
    process = subprocess.Popen(
        [sys.executable, "-m", "tests.support.store_writer", str(tmp_path / "data")],
        text=True,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env=environment,
    )
    process.folder = tmp_path / "data"
    yield process
    process.stdin.close()
    process.wait(10)
    process.stdout.close()


@pytest.mark.parametrize("kills", [5, long(100)])
def test_a_hundred_killed_writers_lose_nothing_and_leave_nothing_half_written(writer, kills):
    killed_writers_lose_nothing(writer, kills)


@pytest.mark.long
def test_five_thousand_killed_writers_lose_nothing_and_leave_nothing_half_written(writer):
    killed_writers_lose_nothing(writer, kills=5000)


def killed_writers_lose_nothing(writer, kills):
    chance = random.Random(2026)
    expected = Expected()
    inside = acknowledged = 0
    for seed in range(kills):
        calls, interrupted = one_life(writer, seed, chance.randrange(MAX_CALLS), chance.random())
        for call in calls:
            expected.happened(call)
        expected.perhaps(interrupted)
        acknowledged += len(calls)
        inside += interrupted is not None
        with Store(writer.folder) as store:
            expected.check(
                store,
                only={call.get("id") for call in calls} if seed % 20 and seed < kills - 1 else None,
            )
    print(f"{kills} kills, {inside} inside a save, {acknowledged} acknowledged saves, 0 lost")
    # The kills must hit the saves, or this shows nothing; of a few, one.
    assert inside >= (kills / 2 if kills >= 100 else 1) and acknowledged >= kills / 4


def one_life(writer, seed, count, share):
    """Kill the writer so far into the call after so many; the acknowledged calls, and the one that was under way.

    share: of the time that the calls before took, each; so a slow machine is killed inside its saves as often.
    """
    writer.stdin.write(f"{seed}\n")
    writer.stdin.flush()
    word, pid = writer.stdout.readline().split()
    assert word == "start"
    calls, interrupted, begun, is_killed = [], None, time.monotonic(), False
    while True:
        if len(calls) == count and not is_killed:
            time.sleep(share * ((time.monotonic() - begun) / count if count else CALL_S))
            os.kill(int(pid), signal.SIGKILL)
            is_killed = True
        word, _, rest = writer.stdout.readline().partition(" ")
        if word == "end":
            assert int(rest) == -signal.SIGKILL, "the writer failed by itself"
            return calls, interrupted
        interrupted = json.loads(rest) if word == "begin" else None
        if word == "done":
            calls.append(json.loads(rest))


class Expected:
    """What must be in the store: a plain model of it, in which a call that was under way leaves two possibilities."""

    def __init__(self):
        self.snapshots, self.saved, self.deleted, self.versions = {}, {}, set(), {}
        self.drafts, self.active = {}, {}  # to the set of what is possible
        self.perhaps_deleted = set()

    def happened(self, call):
        match call["kind"]:
            case "snapshot":
                self.snapshots[call["id"]] = call
            case "draft":
                self.drafts[call["id"]] = {call["field"]}
            case "save":
                number = (call["camera"], call["version"])
                assert number not in self.versions, "a version number was given out twice"
                self.versions[number] = call["id"]
                self.saved[call["id"]] = call
            case "activate":
                self.active[call["camera"]] = {call["id"]}
            case "delete":
                self.deleted.add(call["id"])

    def perhaps(self, call):
        match call and call["kind"]:
            case "draft":
                self.drafts.setdefault(call["id"], {None}).add(call["field"])
            case "activate":
                self.active.setdefault(call["camera"], {None}).add(call["id"])
            case "delete":
                self.perhaps_deleted.add(call["id"])

    def check(self, store, only=None):
        """Everything, or the things with those ids."""
        assert store.damaged == ()
        assert not list((store.folder / "pictures").glob(".*")), (
            "the next start sweeps up what a killed writer left"
        )
        for id, call in self.snapshots.items():
            if only is None or id in only:
                assert store.snapshots.get(id).camera == call["camera"]
                assert store.snapshots.get(id).sha256 == call["sha256"] and store.snapshots.picture(
                    id
                )
        for id, possible in self.drafts.items():
            if only is None or id in only:
                draft = store.drafts.get(id)
                assert draft.body["field"] in possible and len(draft.body["options"]) in (0, 200)
                assert (draft.body == EMPTY) == (draft.revision == 0)
        for id, call in self.saved.items():
            if only is None or id in only:
                self.check_calibration(store, id, call)
        for camera, possible in self.active.items():
            active = store.calibrations.active(camera)
            assert (active and active.id) in possible
        if only is None:
            self.check_unacknowledged(store)

    def check_calibration(self, store, id, call):
        try:
            found = digest(store.calibrations.get(id))
        except NotFound:
            assert id in self.deleted | self.perhaps_deleted
        else:
            assert id not in self.deleted and found == call["sha256"]

    def check_unacknowledged(self, store):
        """Saves that were under way may have come to be: then they are whole, and their numbers are their own."""
        for one in everything(store.calibrations.list):
            assert len(one.report["residuals"]) == 500
        numbers = [(one.camera, one.version) for one in everything(store.calibrations.list)]
        assert len(numbers) == len(set(numbers))
        for one in everything(store.snapshots.list):
            assert store.snapshots.picture(one.id), "a record must have its picture"


def everything(pages):
    cursor = None
    while True:
        page = pages(limit=200, cursor=cursor)
        yield from page.items
        cursor = page.next_cursor
        if cursor is None:
            return
