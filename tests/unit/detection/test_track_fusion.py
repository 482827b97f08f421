"""The tracks of a rig, while one of its cameras sends what cannot be read."""

import asyncio
import json
from types import SimpleNamespace

import pytest

from tests.support.waiting import LONG_S, until_async
from touchline.detection import service
from touchline.detection.service import OFF, DetectionFeed, TrackFusion
from touchline.processes.framing import encode_body

SEEN = {"seq": 1, "time_s": 1.0, "calibration": "c", "items": []}


@pytest.mark.parametrize(
    "broken",
    [
        b"",
        b"\0",
        encode_body(SEEN)[:-3],
        encode_body([1]),
        encode_body({}),
        encode_body(SEEN | {"items": 3}),
        encode_body(SEEN | {"time_s": "soon"}),
        encode_body(SEEN | {"items": [{}]}),
        encode_body(SEEN | {"items": [None]}),
    ],
    ids=range(9),
)
def test_a_message_that_cannot_be_read_is_told_and_the_next_one_counts(broken, monkeypatch):
    monkeypatch.setattr(service, "RETRY_S", 0.01)

    async def story():
        feed = DetectionFeed(SimpleNamespace(part=lambda kind: None), "north", lambda: None)
        feed.follow(OFF | {"on": True})
        fusion = TrackFusion(["north"], lambda name: SimpleNamespace(feeds={feed.NAME: feed}))

        async def told(viewer):
            (camera,) = json.loads(await viewer.next(LONG_S))["cameras"]
            return camera

        with fusion.listening() as viewer:
            await until_async(lambda: feed.viewers)
            for one in feed.viewers:
                one.offer(broken, 0.0)
            while (await told(viewer))["problem"] is None:
                pass
            await until_async(lambda: feed.viewers)
            for one in feed.viewers:
                one.offer(encode_body(SEEN), 0.0)
            while (await told(viewer))["problem"] is not None:
                pass

    asyncio.run(asyncio.wait_for(story(), LONG_S))
