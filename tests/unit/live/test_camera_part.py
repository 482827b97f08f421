"""What a capability adds to a camera's process: its requests and its entries of the report; no failure ends it."""

import asyncio
from functools import partial

import pytest

from tests.support.camera_parts import EchoFeed, FailingFeed, NeverMade
from tests.support.live_cameras import SIM, spec
from tests.support.waiting import LONG_S
from touchline.capabilities import CAPABILITIES, camera_feeds, camera_parts
from touchline.core.registry import load
from touchline.live.camera import LiveCamera
from touchline.live.camera_feed import CameraFeed
from touchline.live.camera_part import CameraPart
from touchline.processes.framing import decode_body

PARTS = "tests.support.camera_parts"


async def when_live(*parts: str, feeds=()):
    """The camera, live; whoever awaits it stops it. feeds: by their part's place, made without services."""
    made = {number: partial(feed, None) for number, feed in dict(feeds).items()}
    camera = LiveCamera(
        "north", {**spec(SIM), "parts": [f"{PARTS}:{part}" for part in parts]}, feeds=made
    )
    camera.start()
    async with asyncio.timeout(LONG_S):
        while camera.status()["state"] != "live":
            await asyncio.sleep(0.05)
    return camera


def test_a_part_answers_requests_and_reports():
    async def story():
        camera = await when_live("CountingPart")
        try:
            head, payload = await camera.request("newest", 20.0, after=0)
            assert head["seq"] > 0 and payload == b"bytes"
            async with asyncio.timeout(LONG_S):
                while not camera._supervisor.status.values.get("counted"):
                    await asyncio.sleep(0.05)
            assert camera.status()["words"] == []
        finally:
            await camera.stop()

    asyncio.run(story())


@pytest.mark.parametrize("broken", ["NeverStarted", "AlwaysFailing", "NotThere"])
def test_the_picture_goes_on_whatever_a_part_does(broken):
    async def story():
        camera = await when_live(broken, "CountingPart")
        try:
            head, _ = await camera.request("newest", 20.0, after=0)
            assert (await camera.request("newest", 20.0, after=head["seq"]))[0]["seq"] > head["seq"]
            async with asyncio.timeout(LONG_S):
                while not any(broken in word["text"] for word in camera.status()["words"]):
                    await asyncio.sleep(0.05)
        finally:
            await camera.stop()

    asyncio.run(story())


def test_a_part_follows_its_feed_and_whoever_listens_there_gets_what_it_sends():
    async def story():
        camera = await when_live("CountingPart", "EchoingPart", feeds={1: EchoFeed})
        try:
            with camera.feeds["echo"].listening() as viewer:
                async with asyncio.timeout(LONG_S):
                    while decode_body(await viewer.next())[0] != {"followed": {"viewers": 1}}:
                        pass
                    while not camera.feeds["echo"].echoed:  # from the report of the process
                        await asyncio.sleep(0.05)
        finally:
            await camera.stop()

    asyncio.run(story())


def test_the_picture_goes_on_whatever_a_feed_does(caplog):
    async def story():
        camera = await when_live(
            "EchoingPart", "CountingPart", feeds={0: FailingFeed, 1: NeverMade}
        )
        try:
            camera.refresh()
            with camera.feeds["failing"].listening():  # which asks for its settings
                head, _ = await camera.request("newest", 20.0, after=0)
            assert (await camera.request("newest", 20.0, after=head["seq"]))[0]["seq"] > head["seq"]
        finally:
            await camera.stop()

    asyncio.run(story())
    assert {record.getMessage() for record in caplog.records} >= {
        "camera north: the feed 'failing' failed",
        "camera north: the feed 'feed of part 1' failed",
    }


def test_every_part_of_the_table_is_one_and_every_feed_is_one_of_a_part():
    assert all(issubclass(load(target), CameraPart) for target in camera_parts())
    assert len(camera_parts()) == sum(len(one.camera_parts) for one in CAPABILITIES.values()) > 3
    assert all(issubclass(feed, CameraFeed) for feed in camera_feeds().values())
    assert (
        sorted(camera_feeds())
        == sorted(
            camera_parts().index(part) for one in CAPABILITIES.values() for part in one.camera_feeds
        )
        != []
    )
