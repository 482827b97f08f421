"""Within a network namespace of its own, as its root: cameras of vision-processor are looked for without any network,
then with some of them sending to the league's groups."""

import contextlib
import time

from tests.support.network_story import switch
from tests.support.rtp_sender import H264Sender, LossyRelay, carpet
from tests.support.waiting import until
from touchline.sources import SourceContext, source_from_url
from touchline.sources.discover import network_streams
from touchline.sources.network.vision_processor import PORT, find_streams


def group_of(camera: int) -> str:
    return f"224.5.23.{100 + camera}"


def main() -> None:
    begun = time.monotonic()
    assert find_streams() == [] and time.monotonic() - begun < 30
    switch("lo", True)
    assert find_streams() == []
    with contextlib.ExitStack() as stack:
        for number in (0, 2, 15):
            url = f"rtp://{group_of(number)}:{PORT}?localaddr=127.0.0.1&ttl=0"
            stack.enter_context(contextlib.closing(H264Sender(url, gop=5)))
        until(lambda: [camera for _, camera, _ in find_streams()] == [0, 2, 15])
        relay = LossyRelay((group_of(2), PORT), address="127.0.0.2")
        stack.enter_context(contextlib.closing(relay))
        stack.enter_context(contextlib.closing(H264Sender(relay.url, carpet, gop=5)))
        until(lambda: [senders for _, _, senders in find_streams()] == [1, 2, 1])
        found = list(network_streams())
        assert [one["title"] for one in found] == [
            "Camera 0 of vision-processor",
            "Camera 2 of vision-processor, 2 senders",
            "Camera 15 of vision-processor",
        ], found
        for one in found:
            around = SourceContext()
            with contextlib.closing(
                source_from_url(one["address"] + "&open_s=30", around)
            ) as camera:
                assert camera.read().pixels.shape == (240, 320, 3)
                assert vars(camera.identity()) == one["identity"], one
    print("found")


if __name__ == "__main__":
    main()
