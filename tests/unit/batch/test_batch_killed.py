"""A batch that is killed, interrupted, or loses a worker in the middle: no row is lost, none is wrong."""

import json
import os
import pty
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.batch_pictures import folder_of
from tests.support.dask_cluster import dask_cluster
from tests.support.paths import ROOT
from tests.support.tiers import long
from tests.support.waiting import LONG_S, gone, stopped, until
from touchline.batch import read_table
from touchline.jobs import dask_cluster as cluster_client

PICTURES, BEFORE_IT_WAITS = 4, 2
TOUCHLINE = [sys.executable, "-c", "from touchline.cli import main; main()"]
# Writes the table with each row, and stops as by Ctrl-Z once there are two: in the middle, however fast the machine.
WAITING = [sys.executable, "-c", f"""
import os, signal
from touchline.cli import main
from touchline.cli.batch import _Table

def add(table, place, row):
    table.rows[place] = row
    table.save()
    if len(table.rows) == {BEFORE_IT_WAITS}:
        os.kill(os.getpid(), signal.SIGSTOP)

_Table.add = add
main()
"""]
NEVER_THE_SAME = ("seconds",)


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    return folder_of(tmp_path_factory.mktemp("batch") / "archive", PICTURES)


@pytest.fixture(scope="module")
def whole(archive, tmp_path_factory):
    """The table of a run that nothing happened to."""
    path = tmp_path_factory.mktemp("whole") / "table.json"
    assert run(archive, path).wait(240) == 0
    return rows(path)


def words_for(archive, table, *more):
    return ["batch", str(archive), "--model", "homography", "--enough", "any", "--workers", "1", "-o", str(table),
            *more]


def run(archive, table, *words, program=TOUCHLINE, **how):
    how = {"stderr": subprocess.DEVNULL, **how}
    return subprocess.Popen([*program, *words_for(archive, table, *words)], cwd=ROOT, stdin=subprocess.DEVNULL,
                            stdout=subprocess.DEVNULL, **how)


def rows(path):
    return {row["picture"]: row for row in read_table(path.read_bytes(), path.suffix)}


def figures(table):
    return {name: {key: value for key, value in row.items() if key not in NEVER_THE_SAME}
            for name, row in table.items()}


def children_of(pid):
    """Every process below it."""
    found = [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    for thread in Path(f"/proc/{pid}/task").iterdir():
        found += [int(child) for child in (thread / "children").read_text().split()]
    below = set(found)
    return below | {deeper for child in below for deeper in children_of(child)}


def test_a_killed_run_leaves_a_whole_table_and_no_process_and_goes_on_where_it_was(archive, whole, touchline,
                                                                                         tmp_path):
    table = tmp_path / "table.csv"
    process = run(archive, table, program=WAITING)
    try:
        until(lambda: stopped(process.pid))
        below = children_of(process.pid)
    finally:
        process.kill()
        process.wait()
    assert below
    until(lambda: all(gone(pid) for pid in below))
    before = rows(table)
    assert len(before) == BEFORE_IT_WAITS
    resume = words_for(archive, table, "--resume")
    assert touchline(*resume)[0] == 0
    after = rows(table)
    assert list(after) == list(whole) and figures(after) == figures(whole)
    assert all(after[name] == row for name, row in before.items()), "a row that stood was computed again"
    again = table.read_bytes()
    assert touchline(*resume)[0] == 0 and table.read_bytes() == again


@pytest.mark.parametrize("on_a_terminal", [long(False), True])
def test_ctrl_c_ends_cleanly_with_the_table_so_far_and_a_bar_only_on_a_terminal(archive, tmp_path, on_a_terminal):
    table, told = tmp_path / "table.json", tmp_path / "stderr"
    ours, theirs = pty.openpty()
    with told.open("wb") as file:
        process = run(archive, table, program=WAITING, stderr=theirs if on_a_terminal else file,
                      start_new_session=True, env=os.environ | {"TERM": "xterm"})
    os.close(theirs)
    said = b""
    try:
        until(lambda: stopped(process.pid))
        below = children_of(process.pid)
        process.send_signal(signal.SIGINT)
        process.send_signal(signal.SIGCONT)
        while on_a_terminal and (part := read(ours)):
            said += part
        assert process.wait(LONG_S) == 130
    finally:
        process.kill()
        process.wait()
        os.close(ours)
    said = said or told.read_bytes()
    assert len(rows(table)) == BEFORE_IT_WAITS and below and all(gone(pid) for pid in below)
    last = f"Stopped after {BEFORE_IT_WAITS} of {PICTURES} images. Continue with --resume."
    assert last in said.decode() and b"Traceback" not in said
    assert (f" of {PICTURES} images \x1b" in said.decode()) == on_a_terminal
    if not on_a_terminal:
        assert said.decode() == last + "\n"
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def read(terminal):
    try:
        return os.read(terminal, 1 << 16)
    except OSError:  # its other end is closed
        return b""


@pytest.mark.long
def test_two_workers_of_a_cluster_one_killed_midway_and_every_row_is_right(archive, whole, tmp_path):
    table = tmp_path / "table.json"
    with dask_cluster(tmp_path) as cluster:
        process = run(archive, table, "--workers", "2", "--engine", cluster.address, program=WAITING)
        try:
            until(lambda: stopped(process.pid))
            cluster.workers[0].kill()
            process.send_signal(signal.SIGCONT)
            assert process.wait(240) == 0
        finally:
            process.kill()
            process.wait()
    assert figures(rows(table)) == figures(whole)


def test_a_cluster_that_is_not_there_ends_the_run_and_no_picture_is_blamed(archive, touchline, tmp_path, monkeypatch):
    monkeypatch.setattr(cluster_client, "CONNECT_S", 0.2)
    table = tmp_path / "table.json"
    code, _, told = touchline(*words_for(archive, table, "--engine", "dask://127.0.0.1:9"))
    assert code == 3 and "is not responding" in told and "fix: " in told
    assert json.loads(table.read_text())["rows"] == []
