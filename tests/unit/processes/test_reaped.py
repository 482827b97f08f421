"""A child process that is killed is gone at once, not when its part is used again."""

import asyncio
import os
import signal
import threading
import time
from pathlib import Path

from tests.support import sample_jobs
from tests.support.child_processes import pids_of
from tests.support.live_cameras import live, pid_of
from tests.support.waiting import until, until_async
from touchline.images import ImageDecoder
from touchline.jobs import JobEngine
from touchline.scene.service import SceneRegistry


def is_gone(pid: int) -> bool:
    """Not even a zombie is left."""
    return not Path(f"/proc/{pid}").exists()


def kill(*pids: int) -> None:
    assert pids
    for pid in pids:
        os.kill(pid, signal.SIGKILL)


def test_killed_decoders_that_nobody_uses_are_gone():
    with ImageDecoder(workers=2) as decoder:
        kill(*(pids := pids_of(decoder)))
        until(lambda: all(map(is_gone, pids)))


def test_a_killed_worker_that_has_nothing_to_do_is_gone():
    with JobEngine(workers=1) as jobs:
        job = jobs.start("adding", sample_jobs.adds, {"a": 1, "b": 1})
        until(lambda: jobs.get(job.id).ended)
        kill(*(pids := pids_of(jobs)))
        until(lambda: all(map(is_gone, pids)))


def test_the_killed_process_of_a_camera_is_gone():
    async def story():
        async with live("sim://table?size=320x256") as camera:
            await until_async(lambda: camera.status()["state"] == "live")
            kill(pid := pid_of(camera))
            await until_async(lambda: is_gone(pid))

    asyncio.run(story())


def test_the_killed_process_of_a_scene_that_is_still_open_is_gone():
    async def story():
        async with SceneRegistry().scene() as (_, scene):
            kill(scene.pid)
            await until_async(lambda: is_gone(scene.pid))

    asyncio.run(story())


def test_one_that_ends_while_it_is_ended_is_no_error():
    for _ in range(20):
        with ImageDecoder(workers=1) as decoder:
            kill(*(pids := pids_of(decoder)))
        assert all(map(is_gone, pids))


def test_who_has_waited_for_a_process_leaves_no_thread_of_it(monkeypatch):
    def late(*of):
        try:
            return waitid(*of)
        finally:
            time.sleep(0.2)  # as on a busy machine

    waitid = os.waitid
    monkeypatch.setattr(os, "waitid", late)
    before = threading.active_count()
    with ImageDecoder(workers=2) as decoder:
        pids_of(decoder)
    assert threading.active_count() == before
