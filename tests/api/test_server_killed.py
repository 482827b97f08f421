"""kill -9 of the real server while calibrations are saved over HTTP: what it has acknowledged is there, byte for byte.

Once in every run; the figure of the manual is  pytest -m long tests/api/test_server_killed.py -s  (1,000 kills).
"""

import json
import os
import random
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing, suppress
from http.client import HTTPException
from threading import Thread

import pytest

from tests.support.servers import ROOT, Line, form
from tests.support.tiers import long
from touchline.store.store import Store

LONGEST_S = 0.1  # a save over HTTP takes some ten ms


@pytest.fixture(scope="module")
def exported(standing, standing_calibration):
    return standing.get(f"/api/v1/calibrations/{standing_calibration['id']}/export/json").json()


@pytest.fixture
def zygote(tmp_path):
    environment = {
        **os.environ,
        "OPENBLAS_NUM_THREADS": "1",
        "PYTHONPATH": f"{ROOT}{os.pathsep}{ROOT / 'app'}",
    }
    process = subprocess.Popen(
        [sys.executable, "-m", "tests.support.server_zygote", str(tmp_path / "data")],
        text=True,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env=environment,
    )
    process.folder = tmp_path / "data"
    yield process
    process.stdin.close()
    process.wait(20)
    process.stdout.close()


@pytest.mark.parametrize("kills", [1, long(8)])
def test_a_killed_server_has_lost_nothing_that_it_acknowledged(zygote, exported, kills):
    killed_servers_lose_nothing(zygote, exported, kills)


@pytest.mark.long
def test_a_thousand_killed_servers_have_lost_nothing_that_they_acknowledged(zygote, exported):
    killed_servers_lose_nothing(zygote, exported, kills=1000)


def killed_servers_lose_nothing(zygote, exported, kills):
    chance = random.Random(2026)
    kept, inside, unacknowledged = {}, 0, 0  # kept: id to the bytes that were acknowledged
    for life in range(kills):
        acknowledged, was_inside = one_life(zygote, exported, chance.uniform(0, LONGEST_S), kept)
        kept |= acknowledged
        inside += was_inside
        if life % 50 == 49 or life == kills - 1:
            unacknowledged = everything_is_there(zygote.folder, kept)
    print(
        f"{kills} kills of the server, {inside} inside a save; {len(kept)} saves acknowledged, 0 lost; "
        f"{unacknowledged} had been saved and not yet acknowledged, all of them whole"
    )
    assert inside >= kills // 2 and kept  # a single kill may fall between two saves


def one_life(zygote, exported, seconds, kept):
    """Start a server, save one calibration after the other, kill it after so long."""
    zygote.stdin.write("go\n")
    zygote.stdin.flush()
    word, pid = zygote.stdout.readline().split()
    assert word == "pid"
    url = zygote.stdout.readline().split()[-1].rstrip("/")
    zygote.stdout.readline()  # where it keeps everything
    acknowledged, sent = {}, []

    with closing(Line(url)) as line:
        assert line.ask("GET", "/health")[0] == 200  # it answers when it is up
        for id in list(kept)[-3:]:
            status, _, content = line.ask("GET", f"/calibrations/{id}")
            assert status == 200 and content == kept[id]

    def save(line):
        data, headers = form(
            json.dumps({**exported, "camera": None, "note": f"{pid} {len(sent)}"}).encode()
        )
        sent.append(data)
        status, _, content = line.ask("POST", "/calibrations/import", data, headers)
        assert status == 201, content
        acknowledged[json.loads(content)["id"]] = content

    def save_on():
        with closing(Line(url)) as line, suppress(OSError, HTTPException):
            while True:
                save(line)

    with closing(Line(url)) as line:
        save(line)  # the first one of a process takes many times as long
    saver = Thread(target=save_on)
    saver.start()
    time.sleep(seconds)
    was_inside = len(sent) > len(acknowledged)
    os.kill(int(pid), signal.SIGKILL)
    saver.join(60)
    assert not saver.is_alive()
    assert zygote.stdout.readline() == f"end {-signal.SIGKILL}\n", "the server failed by itself"
    return acknowledged, was_inside


def everything_is_there(folder, kept):
    """Every acknowledged one, and nothing half-written; how many there are besides."""
    with closing(sqlite3.connect(folder / "touchline.db")) as connection:
        assert connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)
    with Store(folder) as store:
        assert store.damaged == ()
        found, cursor = {}, None
        while True:
            page = store.calibrations.list(limit=200, cursor=cursor)
            found |= {one.id: one for one in page.items}
            cursor = page.next_cursor
            if cursor is None:
                break
    for id, content in kept.items():
        assert found[id].to_json() == json.loads(content)
    versions = [one.version for one in found.values()]
    assert len(versions) == len(set(versions))
    return len(found) - len(kept)
