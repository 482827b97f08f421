"""REST of long work: calibrations and comparisons as jobs, watched, cancelled, and answered to who waits."""

import contextlib
import json
import os
import random
import signal
import socket
import subprocess
import sys
import threading
import time
from http.client import IncompleteRead
from pathlib import Path
from urllib.request import Request, urlopen

import pytest
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from tests.support import sample_jobs
from tests.support.child_processes import pids_of
from tests.support.paths import ROOT
from tests.support.refusals import API, refusal
from tests.support.rest_jobs import accepted, finished
from tests.support.tiers import long
from tests.support.waiting import until
from touchline.core.jobs import Caller
from touchline.jobs.engine import MAX_QUEUED

CAL = f"{API}/calibrations"


@pytest.fixture
def engine(client):
    return client.app.state.services.jobs


def test_a_calibration_made_by_a_job_is_the_one_that_is_made_at_once(standing, task):
    client = standing
    body = {**task, "camera": "north", "model": "homography", "options": {}}
    at_once = client.post(CAL, json=body).json()
    job = accepted(client.post(f"{CAL}?job=true", json=body))
    told = finished(client, job)
    assert told["state"] == "done" and told["progress"] == 1 and told["problem"] is None
    made = client.get(f"{CAL}/{told['result']['calibration']}").json()
    same = (
        "model",
        "report",
        "observations",
        "options",
        "field_definition",
        "corrected_size",
        "software",
    )
    assert {key: made[key] for key in same} == {key: at_once[key] for key in same}
    assert made["version"] == 2 and made["parent"] == at_once["id"]
    assert [item["id"] for item in client.get(f"{CAL}?camera=north").json()["items"]] == [
        made["id"],
        at_once["id"],
    ]


def test_a_comparison_by_a_job_is_the_one_that_is_waited_for(standing, task):
    client = standing
    before = client.get(CAL).json()
    body = {**task, "models": ["homography"]}
    told = finished(client, accepted(client.post(f"{CAL}/compare?job=true", json=body)))
    assert (
        told["state"] == "done"
        and told["result"] == client.post(f"{CAL}/compare", json=body).json()
    )
    assert client.get(CAL).json() == before
    kinds = [job["kind"] for job in client.get(f"{API}/jobs").json()["items"]]
    assert kinds[:2] == ["comparison", "comparison"]


def test_what_a_job_refuses_is_the_problem_that_the_call_would_have_answered(standing, task):
    client = standing
    before = client.get(CAL).json()
    task["observations"] = task["observations"][:1]
    told = finished(client, accepted(client.post(f"{CAL}?job=true", json=task)))
    at_once = refusal(client.post(CAL, json=task), 422)
    assert told["state"] == "failed" and told["result"] is None and told["problem"] == at_once
    assert client.get(CAL).json() == before
    refusal(client.post(f"{CAL}?job=true", json={**task, "field": "no-such"}), 404, "unknown-field")
    refusal(client.post(f"{CAL}?job=perhaps", json=task), 422)


@pytest.mark.parametrize(
    "path, change, status, reason",
    [
        ("", {"model": "no-such"}, 404, "unknown-camera-model"),
        ("/compare", {"models": ["polynomial", "no-such"]}, 404, "unknown-camera-model"),
        (
            "",
            {"observations": [{"feature": "no-such", "points": [[1, 2]]}]},
            422,
            "unknown-feature",
        ),
        (
            "/compare",
            {"observations": [{"feature": "no-such", "points": [[1, 2]]}]},
            422,
            "unknown-feature",
        ),
    ],
)
def test_a_name_that_nobody_knows_is_refused_before_a_job_begins(
    standing, clicks, path, change, status, reason
):
    before = standing.get(f"{API}/jobs").json()["items"]
    for how in ("?job=true", ""):
        refusal(standing.post(f"{CAL}{path}{how}", json={**clicks(), **change}), status, reason)
    assert standing.get(f"{API}/jobs").json()["items"] == before


@pytest.mark.parametrize("model", ["no-such", "polynomial"])
def test_a_lens_that_a_board_cannot_tell_is_refused_before_a_job_begins(standing, model):
    before = standing.get(f"{API}/jobs").json()["items"]
    view = {"image_points": [[0, 0], [1, 0]], "object_points": [[0, 0, 0], [1, 0, 0]]}
    answer = standing.post(
        f"{CAL}/board", json={"views": [view], "image_size": [640, 480], "model": model}
    )
    assert answer.status_code in (404, 422) and answer.json()["fix"]
    assert standing.get(f"{API}/jobs").json()["items"] == before


def test_a_comparison_looks_only_at_the_models_that_it_names(standing, clicks):
    body = {**clicks(), "model": "no-such", "models": ["homography"]}
    assert standing.post(f"{CAL}/compare", json=body).status_code == 200


def test_a_job_is_cancelled_as_often_as_one_likes_and_an_unknown_one_is_404(standing):
    client = standing
    job = client.app.state.services.jobs.start(
        "sleeping", sample_jobs.sleeps_and_says, {"seconds": 30}
    )
    for _ in range(3):
        answer = client.delete(f"{API}/jobs/{job.id}")
        assert answer.status_code == 200 and answer.json()["state"] == "cancelled"
    assert client.get(f"{API}/jobs/{job.id}").json()["ended_at"]
    for call in (client.get, client.delete):
        refusal(call(f"{API}/jobs/nobody"), 404, "unknown-job")
    refusal(client.get(f"{API}/jobs/nobody/events"), 404, "unknown-job")


@pytest.mark.parametrize("times", [2, long(15)])
def test_cancelled_at_random_times_a_version_is_there_whole_or_not_at_all(client, task, times):
    rng = random.Random(3)
    # starts the process
    finished(client, accepted(client.post(f"{CAL}?job=true", json={**task, "camera": "north"})))
    start = time.monotonic()
    finished(client, accepted(client.post(f"{CAL}?job=true", json={**task, "camera": "north"})))
    wait_s, made = time.monotonic() - start, 2
    for _ in range(times):
        job = accepted(client.post(f"{CAL}?job=true", json={**task, "camera": "north"}))
        time.sleep(rng.uniform(0, 2) * wait_s)
        client.delete(f"{API}/jobs/{job['id']}")
        told = finished(client, job)
        assert told["state"] in ("done", "cancelled"), told
        done = told["state"] == "done"
        made += done
        # stays about as long as such a job takes, however busy the machine is by then
        wait_s *= 0.6 if done else 1.6
        if done:
            assert client.get(f"{CAL}/{told['result']['calibration']}").status_code == 200
    assert times < 15 or 2 < made < 17
    items = client.get(f"{CAL}?limit=100").json()["items"]
    assert [item["version"] for item in items] == list(range(made, 0, -1))
    data = client.app.state.services.settings.data
    # where a copy may be under way
    assert not [path for path in data.rglob("*.tmp") if path.parent.name != "backups"]


@pytest.mark.long
def test_a_job_whose_worker_is_killed_is_tried_again_and_has_failed_after_three(
    client, engine, task
):
    job = engine.start("sleeping", sample_jobs.sleeps_and_says, {"seconds": 30})
    for attempt in (1, 2, 3):
        until(
            lambda: client.get(f"{API}/jobs/{job.id}").json(),
            lambda told, attempt=attempt: (
                (told["message"], told["attempt"]) == ("sleeping", attempt)
            ),
        )
        os.kill(pids_of(engine)[0], signal.SIGKILL)
    told = finished(client, {"id": job.id}, 30)
    assert told["state"] == "failed" and told["problem"]["type"] == "/problems/worker-died"
    assert told["problem"]["fix"] and told["attempt"] == 3
    body = {**task, "models": ["division"]}
    assert client.post(f"{CAL}/compare", json=body).json()["recommended"] == "division"


def test_events_tell_every_change_until_the_end(standing):
    client = standing
    job = client.app.state.services.jobs.start(
        "sleeping", sample_jobs.sleeps_and_says, {"seconds": 0.3}
    )
    with client.stream("GET", f"{API}/jobs/{job.id}/events") as answer:
        assert answer.headers["content-type"].startswith("text/event-stream")
        told = [
            json.loads(line.removeprefix("data: "))
            for line in answer.iter_lines()
            if line.startswith("data: ")
        ]
    assert len(told) >= 4 and told[-1] == client.get(f"{API}/jobs/{job.id}").json()
    assert told[-1]["state"] == "done" and told[-1]["result"] == {"slept": 0.3}
    progress = [event["progress"] for event in told]
    assert progress == sorted(progress) and progress[-1] == 1
    # of an ended job: its end, at once
    with client.stream("GET", f"{API}/jobs/{job.id}/events") as again:
        assert sum(line.startswith("data: ") for line in again.iter_lines()) == 1


def socket_to(client, path):
    return client.websocket_connect(path, headers={"host": "127.0.0.1:8000"})


def test_a_page_hears_a_job_and_all_jobs_by_websocket(standing):
    client = standing
    with socket_to(client, f"{API}/jobs/stream") as all_jobs:
        before = all_jobs.receive_json()["items"]
        job = client.app.state.services.jobs.start(
            "sleeping", sample_jobs.sleeps_and_says, {"seconds": 0.3}
        )
        with socket_to(client, f"{API}/jobs/{job.id}/stream") as line:
            told = []
            with pytest.raises(WebSocketDisconnect) as end:
                while True:
                    told.append(line.receive_json())
        assert end.value.code == 1000 and told[-1] == client.get(f"{API}/jobs/{job.id}").json()
        assert len(told) >= 3 and told[-1]["result"] == {"slept": 0.3}
        progress = [state["progress"] for state in told]
        assert progress == sorted(progress) and progress[-1] == 1
        while (items := all_jobs.receive_json()["items"])[0]["state"] != "done":
            pass
        assert [item["id"] for item in items] == [job.id, *(item["id"] for item in before)]
        assert {item["result"] for item in items} == {None}
    with socket_to(client, f"{API}/jobs/nobody/stream") as line:
        refused = line.receive_json()
        assert refused["type"] == "/problems/unknown-job" and refused["fix"]
        with pytest.raises(WebSocketDisconnect) as end:
            line.receive_json()
        assert end.value.code == 4404


def test_too_many_jobs_are_429_and_not_an_error_of_the_server(client, engine, task):
    for _ in range(22):
        engine.start(
            "sleeping",
            sample_jobs.sleeps_and_says,
            {"seconds": 60},
            caller=Caller("testclient", "testclient"),
        )
        if sum(job.state == "queued" for job in engine.all()) >= 20:
            break
    refusal(client.post(f"{CAL}?job=true", json=task), 429, "too-many-jobs")
    refusal(client.post(f"{CAL}/compare", json=task), 429, "too-many-jobs")
    assert (
        client.post(
            f"{CAL}?job=true", json=task, headers={"X-Operator": "Somebody else"}
        ).status_code
        == 202
    )


def test_a_caller_that_changes_its_name_at_every_request_leaves_places_for_another_address(
    client, engine, task
):
    for n in range(4):  # no worker is free
        engine.start(
            "sleeping", sample_jobs.sleeps_and_says, {"seconds": 600}, caller=Caller(f"{n}")
        )
    answers = (
        client.post(f"{CAL}?job=true", json=task, headers={"X-Operator": f"operator {n}"})
        for n in range(MAX_QUEUED)
    )
    refusal(next(answer for answer in answers if answer.status_code != 202), 429, "too-many-jobs")
    another = TestClient(client.app, base_url=str(client.base_url), client=("192.0.2.7", 50_000))
    accepted(another.post(f"{CAL}?job=true", json=task))


def start_server(tmp_path):
    """A real server on that folder: (url, its process)."""
    server = subprocess.Popen(
        [
            sys.executable,
            "-c",
            "from touchline.cli import main; main()",
            "serve",
            "--port",
            "0",
            "--data",
            str(tmp_path / "data"),
        ],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    return server.stdout.readline().split()[-1] + "api/v1", server


@pytest.fixture
def served(tmp_path):
    """A real server: (url, its process)."""
    url, server = start_server(tmp_path)
    try:
        yield url, server
    finally:
        server.kill()
        server.wait()


def asked(url, body=None):
    data = None if body is None else json.dumps(body).encode()
    with urlopen(Request(url, data, {"Content-Type": "application/json"}), timeout=60) as answer:
        return json.load(answer)


def children(pid):
    """Processes that stand below a process, from the system's own list."""
    below = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            text = stat.read_text()
        except OSError:
            continue
        below.setdefault(int(text.rpartition(")")[2].split()[1]), []).append(int(stat.parent.name))
    found, open_ = [], [pid]
    while open_:
        more = below.get(open_.pop(), [])
        found += more
        open_ += more
    return found


def usual_answer_s(url, border):
    """How long a fit of a border takes, by the middle one of twenty."""
    times = []
    for _ in range(20):
        start = time.monotonic()
        asked(f"{url}/fit/border", border)
        times.append(time.monotonic() - start)
    return sorted(times)[10]


BORDER = {
    "points": [[70.3, 85.4], [64.5, 190.5], [63.8, 295.5], [67.8, 400.5], [76.0, 505.6]],
    "axis": "x_of_y",
}


@pytest.mark.long
def test_a_border_is_fitted_as_fast_beside_a_comparison(served, task):
    url, _ = served
    alone_s = usual_answer_s(url, BORDER)
    job = asked(f"{url}/calibrations/compare?job=true", task)
    until(lambda: asked(f"{url}/jobs/{job['id']}")["progress"])
    # a thread's arithmetic would hold every answer up
    assert usual_answer_s(url, BORDER) < 0.05 + 5 * alone_s
    assert asked(f"{url}/jobs/{job['id']}")["state"] == "running"


def test_a_comparison_ends_when_its_caller_has_gone_and_borders_are_fitted_meanwhile(served, task):
    url, _ = served
    host, port = url.split("/")[2].split(":")
    body = json.dumps(task).encode()
    with socket.create_connection((host, int(port))) as line:
        line.sendall(
            b"POST /api/v1/calibrations/compare HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json"
            b"\r\nContent-Length: %d\r\n\r\n" % len(body) + body
        )
        until(lambda: asked(f"{url}/jobs")["items"], lambda jobs: jobs and jobs[0]["progress"])
        assert asked(f"{url}/fit/border", BORDER)["coefficients"]
        assert asked(f"{url}/jobs")["items"][0]["state"] == "running"
    ended = until(lambda: asked(f"{url}/jobs")["items"][0], lambda job: job["state"] != "running")
    assert ended["state"] == "cancelled"


def test_no_process_is_left_when_a_server_with_running_jobs_is_stopped(served, task):
    url, server = served
    job = asked(f"{url}/calibrations/compare?job=true", task)

    def watch():
        with (
            contextlib.suppress(IncompleteRead),
            urlopen(f"{url}/jobs/{job['id']}/events", timeout=60) as events,
        ):
            events.read()

    threading.Thread(target=watch, daemon=True).start()
    until(lambda: asked(f"{url}/jobs/{job['id']}")["progress"])
    below = children(server.pid)
    assert len(below) >= 3  # two that decode, one that works
    server.send_signal(signal.SIGTERM)
    _, told = server.communicate(timeout=60)
    assert "Traceback" not in told, told
    assert not [pid for pid in below if Path(f"/proc/{pid}").exists()]


@pytest.mark.long
def test_a_job_whose_server_is_killed_is_done_by_the_next_one_and_makes_one_version(
    served, task, tmp_path
):
    url, server = served
    job = asked(f"{url}/calibrations/compare?job=true", task)
    made = asked(f"{url}/calibrations?job=true", {**task, "camera": "north"})
    until(lambda: asked(f"{url}/jobs/{job['id']}")["progress"])
    server.kill()
    server.wait()
    url, again = start_server(tmp_path)
    try:
        for id in (job["id"], made["id"]):
            told = until(
                lambda id=id: asked(f"{url}/jobs/{id}"),
                lambda told: told["state"] not in ("queued", "running"),
            )
            assert told["state"] == "done", told
        assert asked(f"{url}/jobs/{job['id']}")["attempt"] == 2
        versions = asked(f"{url}/calibrations")["items"]
        assert [version["id"] for version in versions] == [
            asked(f"{url}/jobs/{made['id']}")["result"]["calibration"]
        ]
    finally:
        again.kill()
        again.wait()
