"""What network cameras do to a server: every fault is seen, the camera comes back by itself, and no other suffers."""

import asyncio
import os
import random
import threading
import time
from contextlib import contextmanager
from itertools import product

import cv2
import numpy as np
import pytest

from tests.support.live_cameras import SIM, live, pid_of
from tests.support.mjpeg_camera import MjpegCamera, coded
from tests.support.pictures import jpeg_of_many_scans, jpeg_with_size, png_bomb
from tests.support.rtsp_camera import RtspCamera
from tests.support.tiers import long
from tests.support.waiting import until_async
from touchline.live import messages, supervisor
from touchline.live.camera import LiveCamera
from touchline.live.messages import StreamSpec
from touchline.live.supervisor import CameraProcess
from touchline.processes.framing import ANSWER, Message, decode_body, encode_body
from touchline.vision.zones import ENOUGH_S, LONG_S


@contextmanager
def mjpeg():
    camera = MjpegCamera()
    try:
        yield camera
    finally:
        camera.stalled = False
        camera.close()


@contextmanager
def rtsp():
    camera = RtspCamera()
    try:
        yield camera
    finally:
        camera.stalled = False
        camera.close()


def stalls(camera):
    camera.stalled = True


def trickles(camera):
    camera.trickle = True


def goes_mute(camera):
    camera.mute = True
    camera.drop()


def is_cut(camera):
    camera.half = True


def heals(camera):
    camera.stalled = camera.trickle = camera.mute = camera.half = False
    camera.drop()


@pytest.mark.parametrize(
    ("kind", "fault"),
    [  # the others' sources see them: tests/unit/sources
        (mjpeg, stalls),
        *(
            long(*more)
            for more in (
                (mjpeg, trickles),
                (mjpeg, goes_mute),
                (mjpeg, is_cut),
                (rtsp, stalls),
                (rtsp, goes_mute),
            )
        ),
    ],
    ids=lambda part: part.__name__,
)
def test_a_fault_is_seen_the_neighbour_goes_on_and_the_camera_comes_back(kind, fault):
    async def story(far):
        async with live(far.url) as camera, live(SIM) as neighbour:
            with camera.watching(StreamSpec()) as viewer:
                await viewer.next(30)
                await until_async(
                    lambda: camera.status()["state"] == neighbour.status()["state"] == "live"
                )
                fault(far)
                told = await until_async(lambda: (s := camera.status())["state"] != "live" and s)
                seq = neighbour.status()["seq"]
                await until_async(lambda: neighbour.status()["seq"] > seq)
                heals(far)
                await until_async(lambda: camera.status()["state"] == "live")
                await viewer.next(10)
                return told, neighbour.status()

    with kind() as far:
        told, neighbour = asyncio.run(asyncio.wait_for(story(far), 100))
    assert told["state"] in ("stalled", "offline", "connecting")
    assert neighbour["state"] == "live" and neighbour["reconnects"] == 0


@pytest.mark.long
def test_a_fault_costs_the_neighbour_no_pictures():
    async def story(far):
        async with live(far.url) as camera, live(SIM) as neighbour:
            with camera.watching(StreamSpec()) as viewer:
                await viewer.next(30)
                await until_async(
                    lambda: camera.status()["state"] == neighbour.status()["state"] == "live"
                )
                seq, start = neighbour.status()["seq"], time.monotonic()
                stalls(far)
                await asyncio.sleep(4)
                return 1 - (neighbour.status()["seq"] - seq) / (25 * (time.monotonic() - start))

    with mjpeg() as far:
        lost = asyncio.run(asyncio.wait_for(story(far), 100))
    assert lost < 0.5  # on a quiet machine none; a loaded one renders fewer


GARBAGE = {
    "noise": lambda: random.Random(1).randbytes(5000),
    "nothing": lambda: b"",
    "half a picture": lambda: coded(0)[:900],
    "a bomb": lambda: png_bomb(16000, 16000),
    "a giant": lambda: jpeg_with_size(65500, 65500),
    "scans": lambda: jpeg_of_many_scans(300, 4000, 4000),
}


@pytest.mark.parametrize(
    "name", ["half a picture", *(long(name) for name in GARBAGE if name != "half a picture")]
)
def test_parts_that_are_no_pictures_are_left_out_and_the_others_shown(name):
    part = GARBAGE[name]()

    async def story(far):
        async with live(far.url) as camera:
            with camera.watching(StreamSpec()) as viewer:
                first = decode_body(await viewer.next(30))[0]["seq"]
                pid = pid_of(camera)
                far.parts = lambda n: [part, coded(n)] if n % 4 == 0 else [coded(n)]
                while decode_body(await viewer.next(20))[0]["seq"] < first + 12:
                    pass
                return pid, pid_of(camera), camera.status()

    with mjpeg() as far:
        before, after, status = asyncio.run(asyncio.wait_for(story(far), 100))
    assert before == after and status["state"] == "live"


@pytest.mark.parametrize("kind", [mjpeg, long(rtsp)])
def test_another_size_is_shown_as_it_is(kind):
    async def story(far):
        async with live(far.url) as camera:
            with camera.watching(StreamSpec()) as viewer:
                assert decode_body(await viewer.next(30))[0]["raw_width"] == 320
                far.size = (640, 480)
                if kind is rtsp:
                    far.drop()  # a camera's stream has one size from its beginning to its end
                while (head := decode_body(await viewer.next(30))[0])["raw_width"] != 640:
                    pass
                await until_async(lambda: camera.status()["width"] == 640)
                return head

    with kind() as far:
        head = asyncio.run(asyncio.wait_for(story(far), 100))
    assert (head["raw_width"], head["raw_height"], head["width"], head["height"]) == (
        640,
        480,
        640,
        480,
    )


def test_a_picture_that_never_changes_is_not_called_live(monkeypatch):
    monkeypatch.setattr(supervisor, "FROZEN_S", 1.0)

    async def story(far):
        far.parts = lambda n: [coded(7)]
        async with live(far.url) as camera:
            frozen = await until_async(
                lambda: (s := camera.status())["state"] == "stalled" and s, seconds=30
            )
            far.parts = lambda n: [coded(n)]
            await until_async(lambda: camera.status()["state"] == "live", seconds=30)
            return frozen

    with mjpeg() as far:
        frozen = asyncio.run(asyncio.wait_for(story(far), 100))
    assert frozen["problem"]["reason"] == "frozen" and frozen["problem"]["fix"]


@pytest.mark.long
def test_a_picture_that_froze_under_a_running_clock_is_not_called_live():
    frozen_since = []

    async def story(far):
        far.parts = lambda n: [under_a_clock(n, 0 if frozen_since else n)]
        async with live(far.url) as camera:
            await asyncio.sleep(ENOUGH_S + 5)
            assert camera.status()["state"] == "live"
            frozen_since.append(time.monotonic())
            return await until_async(
                lambda: (s := camera.status())["state"] == "stalled" and s, seconds=2 * LONG_S
            )

    with mjpeg() as far:
        frozen = asyncio.run(asyncio.wait_for(story(far), 150))
    assert frozen["problem"]["reason"] == "frozen" and "small part" in frozen["problem"]["what"]


def under_a_clock(n, noise_of):
    picture = (
        np.random.default_rng(noise_of).normal(110, 5, (240, 320)).clip(0, 255).astype(np.uint8)
    )
    picture[:20, :60] = 8 * (n % 30)
    return cv2.imencode(".jpg", picture)[1].tobytes()


@pytest.mark.parametrize("pictures", [3, long(7)])
def test_a_slow_camera_is_not_called_stalled(pictures):
    async def story(far):
        async with live(far.url) as camera:
            await until_async(lambda: camera.status()["state"] == "live")
            states = set()
            await until_async(
                lambda: states.add(camera.status()["state"]) or camera.status()["seq"] >= pictures
            )
            return states, camera.status()["reconnects"]

    with mjpeg() as far:
        far.fps = 0.8  # a picture every 1.25 s, as fast as the source itself lets pass
        assert asyncio.run(asyncio.wait_for(story(far), 60)) == ({"live"}, 0)


@pytest.mark.parametrize("times", [1, long(6)])
def test_many_unpluggings_leave_nothing_behind(times):
    async def story(far):
        async with live(far.url) as camera:

            async def cycle():
                await until_async(lambda: camera.status()["state"] == "live", seconds=30)
                far.drop()
                seq = camera.status()["reopened"]
                await until_async(lambda: (camera.status()["reopened"] or 0) > seq, seconds=30)

            await cycle()
            pid = pid_of(camera)
            await until_async(lambda: camera.status()["state"] == "live", seconds=30)
            before = len(os.listdir("/proc/self/fd")), threading.active_count(), held(pid)
            for _ in range(times):
                await cycle()
            await until_async(lambda: camera.status()["state"] == "live", seconds=30)
            return (
                pid,
                pid_of(camera),
                before,
                (len(os.listdir("/proc/self/fd")), threading.active_count(), held(pid)),
            )

    def held(pid):
        return len(os.listdir(f"/proc/{pid}/fd")), len(os.listdir(f"/proc/{pid}/task"))

    with mjpeg() as far:
        pid, after_pid, before, after = asyncio.run(asyncio.wait_for(story(far), 110))
    assert pid == after_pid
    assert (
        after[0] <= before[0] + 6
        and after[2][0] <= before[2][0] + 1
        and after[2][1] <= before[2][1] + 1
    )


@pytest.mark.parametrize(
    ("kind", "body"),
    [
        (messages.FEED, b""),
        *product(
            (messages.STATUS, ANSWER), (b"", b"\x09\0\0\0{", b"\x01\0\0\0\xff", encode_body([]))
        ),
    ],
)
def test_a_process_that_sends_no_json_is_ended_and_another_started(monkeypatch, kind, body):
    started = []

    class Broken(CameraProcess):
        def __init__(self):
            started.append(self)
            self.ended = False
            self._requests = {0: asyncio.get_running_loop().create_future()}

        async def receive(self):
            await asyncio.sleep(0.01)
            if kind == ANSWER:
                self._resolve(0, body)
            return Message(kind, 0, body)

        def send(self, kind, head, payload=b"", number=0):
            pass

        async def end(self):
            self.ended = True

    async def start(spec):
        return Broken()

    monkeypatch.setattr(CameraProcess, "start", start)
    monkeypatch.setattr(supervisor, "RETRY_S", 0.01)

    async def story():
        camera = LiveCamera("test", {"source": SIM})
        camera.start()
        await until_async(lambda: len(started) > 2 and started[0].ended)
        assert camera.status()["state"] == "connecting"
        await camera.stop()

    asyncio.run(story())
