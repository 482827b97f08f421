"""What the version before has written opens: its data folder with a job that waits, and its archive."""

import json
import re
import zipfile
from math import isclose

import pytest
from fastapi.testclient import TestClient

from tests.support.paths import TESTS
from tests.support.waiting import until
from touchline.main import create_app
from touchline.settings import Settings
from touchline.store.archive import restore_into

HERE = "http://127.0.0.1:8000"
API = "/api/v1"
FORMER = TESTS / "golden" / "former_version"
KNOWN = json.loads((FORMER / "answers.json").read_text())
WORDED = ("sentence", "words")  # what operators read of it: told anew with each answer
NUMBER = re.compile(r"[−-]?\d+(?:\.\d+)?")


@pytest.fixture(params=["folder", "archive"], scope="module")
def restored(request, tmp_path_factory):
    """The data folder, as it was written or as the archive brings it; jobs are not archived."""
    tmp_path = tmp_path_factory.mktemp(request.param)
    if request.param == "archive":
        restore_into(FORMER / "archive.zip", tmp_path / "data", None)
    else:
        with zipfile.ZipFile(FORMER / "data.zip") as source:
            source.extractall(tmp_path / "data")
    with TestClient(create_app(Settings(data=tmp_path / "data")), base_url=HERE) as client:
        yield request.param, client


def test_everything_is_answered_as_the_version_before_answered_it(restored):
    origin, client = restored
    for path, known in KNOWN["answers"].items():
        if path != "/jobs":
            assert without_new(client.get(API + path).json(), known) == known, path
    store = client.app.state.services.store
    assert (
        store.damaged == ()
        and store.identities.get(store.calibrations.active("west").id)["serial"] == "A1"
    )
    assert [lens["lens"]["focal_px"] for lens in store.lenses.list().items] == [500.5]
    if origin == "folder":
        finished = KNOWN["answers"]["/jobs"]["items"][0]
        now = client.get(f"{API}/jobs/{finished['id']}").json()
        # its row was dated a moment before its answer
        assert {**now, "ended_at": finished["ended_at"]} == finished


def states_the_same(now, known):
    """Both are sentences, with the same numbers in any order."""
    return (
        isinstance(now, str)
        and isinstance(known, str)
        and now != ""
        and sorted(NUMBER.findall(now)) == sorted(NUMBER.findall(known))
    )


def without_new(now, known):
    """An answer without the members that objects have gained since, numbers as they were but for a processor's
    rounding, and sentences that may be worded anew but state the same numbers; nothing may be renamed or lost."""
    if isinstance(now, dict) and isinstance(known, dict):
        return {
            key: known[key]
            if key in WORDED and states_the_same(value, known[key])
            else without_new(value, known[key])
            for key, value in now.items()
            if key in known
        }
    if isinstance(now, list) and isinstance(known, list) and len(now) == len(known):
        return [without_new(a, b) for a, b in zip(now, known, strict=True)]
    return (
        known
        if isinstance(now, float) and isinstance(known, float) and isclose(now, known, rel_tol=1e-6)
        else now
    )


def test_numbers_go_on_where_the_version_before_had_come_to_and_a_deletion_is_taken_back(restored):
    _, client = restored
    back = client.post(f"{API}/calibrations/{KNOWN['deleted']}/restore").json()
    assert back["id"] == KNOWN["deleted"] and back["version"] == 3


def test_a_job_that_waited_is_done(restored):
    origin, client = restored
    if origin == "archive":
        return  # jobs are not archived
    ended = until(
        lambda: client.get(f"{API}/jobs/{KNOWN['queued']}").json(), lambda job: job["ended_at"]
    )
    assert ended["state"] == "done", ended
    made, before = (
        client.get(f"{API}/calibrations/{job['result']['calibration']}").json()
        for job in (ended, KNOWN["answers"]["/jobs"]["items"][0])
    )
    assert without_new(made["model"], before["model"]) == before["model"]
    assert made["observations"] == before["observations"]
