"""Discover every camera that can be found without its address.

The library for industrial cameras may hang or crash; so it runs in a process of its own, and where it has not answered
by the deadline, its cameras are left out.
"""

import os
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import asdict
from functools import wraps
from typing import Any

from touchline.core.errors import Unavailable
from touchline.processes.framing import ANSWER, Connection, decode_body, encode_body
from touchline.processes.start import ChildProcess, Program
from touchline.sources import Identity
from touchline.sources.industrial.camera import DiscoveredCamera
from touchline.sources.network.vision_processor import find_streams

# starting Python, then the second in which a network camera may answer; on a busy small machine
DEADLINE_S = 5.0
Discovered = dict[str, Any]  # {"address", "title", "identity"}


def discover_cameras(deadline_s: float = DEADLINE_S) -> list[Discovered]:
    """Return every camera found: its address as a source, a title for people, its identity as JSON."""
    until, found = time.monotonic() + deadline_s, []
    with ThreadPoolExecutor(1) as pool:
        streams = pool.submit(lambda: list(network_streams()))
        with suppress(OSError):  # it dies, or cannot be started, at once
            finder = Program(f"{__name__}:{aravis_cameras.__name__}")
            found = answer_of(ChildProcess(finder, {}), until)
        return [*v4l2_cameras(), *streams.result(), *found]


def answer_of(finder: ChildProcess, until: float) -> list[Discovered]:
    """Return what a child has found, and end it; nothing where it hangs until then (time.monotonic()) or dies."""
    try:
        message = finder.connection.receive(until - time.monotonic())
        return [] if message is None else decode_body(message.body)[0]["cameras"]
    except OSError:
        return []
    finally:
        finder.close()


def in_child(find: Callable[..., list[Discovered]]) -> Callable[[Connection, dict[str, Any]], None]:
    """Make what finds cameras the main function of a child process, which answers with them."""

    @wraps(find)
    def main(connection: Connection, arguments: dict[str, Any]) -> None:
        try:
            cameras = find(**arguments)
        except Unavailable:  # its library is not installed: then there is nothing to find with it
            cameras = []
        connection.send(ANSWER, 0, encode_body({"cameras": cameras}))
        os._exit(0)  # a library that cannot end its own threads need not

    return main


def v4l2_cameras() -> Iterable[Discovered]:
    """Yield the webcams and capture cards that Linux lists; no camera is opened."""
    from touchline.sources.v4l2 import V4l2Source, list_devices

    for camera in list_devices(V4l2Source.root):
        yield _discovered(camera.address, f"{camera.model}, {camera.node}", camera.identity)


def network_streams() -> Iterable[Discovered]:
    """Yield the cameras that vision-processor sends to the league's groups now; takes a second."""
    for address, camera, senders in find_streams():
        title = f"Camera {camera} of vision-processor" + f", {senders} senders" * (senders > 1)
        yield _discovered(address, title, Identity(address.partition("?")[0]))


@in_child
def aravis_cameras() -> list[Discovered]:
    """Return the GigE Vision and USB3 Vision cameras that answer to Aravis."""
    from touchline.sources.industrial.aravis import address_of, aravis, discover_cameras

    cameras = discover_cameras(aravis())
    titles = [
        f"{camera.vendor} {camera.model} {camera.serial}, through Aravis" for camera in cameras
    ]
    return _named(cameras, titles, address_of)


def _named(
    cameras: Sequence[DiscoveredCamera], titles: Sequence[str], address_of: Callable[[str], str]
) -> list[Discovered]:
    addresses = [
        address_of(name)
        for name in _short_names([(camera.serial, camera.id) for camera in cameras])
    ]
    return [
        _discovered(address, title, camera.identity(address))
        for address, title, camera in zip(addresses, titles, cameras, strict=True)
    ]


def _short_names(names: list[tuple[str, str]]) -> list[str]:
    """Return of each (serial, id) the serial where it is unique, else the id."""
    serials = [serial for serial, _ in names]
    return [serial if serial and serials.count(serial) == 1 else id for serial, id in names]


def _discovered(address: str, title: str, identity: Identity) -> Discovered:
    return {"address": address, "title": " ".join(title.split()), "identity": asdict(identity)}
