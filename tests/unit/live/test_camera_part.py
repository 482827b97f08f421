"""What a capability adds to a camera's process: its requests and its entries of the report; no failure ends it."""

import asyncio

import pytest

from tests.support.live_cameras import SIM, spec
from tests.support.waiting import LONG_S
from touchline.capabilities import CAPABILITIES, camera_parts
from touchline.core.registry import load
from touchline.live.camera import LiveCamera
from touchline.live.camera_part import CameraPart

PARTS = "tests.support.camera_parts"


async def when_live(*parts: str):
    """The camera, live, and its status; whoever awaits it stops it."""
    camera = LiveCamera("north", {**spec(SIM), "parts": [f"{PARTS}:{part}" for part in parts]})
    camera.start()
    async with asyncio.timeout(LONG_S):
        while camera.status()["state"] != "live":
            await asyncio.sleep(0.05)
    return camera


def test_a_part_answers_requests_and_reports():
    async def story():
        camera = await when_live("CountingPart")
        try:
            head, payload = await camera._request("newest", 20.0, after=0)
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
            head, _ = await camera._request("newest", 20.0, after=0)
            assert (await camera._request("newest", 20.0, after=head["seq"]))[0]["seq"] > head["seq"]
            async with asyncio.timeout(LONG_S):
                while not any(broken in word["text"] for word in camera.status()["words"]):
                    await asyncio.sleep(0.05)
        finally:
            await camera.stop()
    asyncio.run(story())


def test_every_part_of_the_table_is_one():
    assert all(issubclass(load(target), CameraPart) for target in camera_parts())
    assert len(camera_parts()) == sum(len(one.camera_parts) for one in CAPABILITIES.values()) > 3
