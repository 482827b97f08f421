"""What is plugged in: every camera that can be found without being told its address.

Looking means running the camera makers' own libraries, which may hang or crash; so each looks in a process of its own,
all at once, and whatever has not answered by the deadline is left out.
"""

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from app.core.errors import Unavailable
from app.sources import Identity, Surroundings

DEADLINE_S = 5.0  # starting Python, then the second in which a network camera may answer; on a busy small machine
CODE = "import json, sys; sys.path[:] = json.loads(sys.argv[1]); from app.sources import discover; discover.look()"
Found = dict[str, Any]  # {"address", "title", "identity"}


def found(around: Surroundings, deadline_s: float = DEADLINE_S) -> list[Found]:
    """Every camera that shows itself: its address as a source, a title for people, its identity as JSON.

    A camera that two libraries reach is told twice, once with each address.
    """
    until = time.monotonic() + deadline_s
    lookers = [_started(name, [*given]) for name, given in _tasks(around)]
    return [*in_this_machine(), *(one for looker in lookers for one in _answer(looker, until))]


def in_this_machine() -> Iterable[Found]:
    """The webcams and capture cards that Linux knows; it is only asked, no camera is opened."""
    from app.sources.local.v4l2 import V4l2Source
    from app.sources.local.v4l2_devices import devices
    for camera in devices(V4l2Source.root):
        yield _told(camera.address, f"{camera.model}, {camera.node}", camera.identity)


def through_producer(path: str) -> Iterable[Found]:
    """The GenICam cameras behind one producer."""
    from app.sources.industrial.genicam import address_of, identity_of
    from app.sources.industrial.genicam_producers import cameras_of, harvester_of, let_go
    producer = Path(path)
    harvester = harvester_of([producer])
    cameras = cameras_of(harvester)
    names = _short_names([(camera.serial, camera.id) for camera in cameras])
    for name, camera in zip(names, cameras, strict=True):
        address = address_of(name, producer.stem)
        yield _told(address, f"{camera.title} {camera.serial}, through {producer.name}", identity_of(address, camera))
    let_go(harvester)


def through_aravis() -> Iterable[Found]:
    """The GigE Vision and USB3 Vision cameras that answer to Aravis."""
    from app.sources.industrial.aravis import address_of, aravis, identity_of, plugged_in
    cameras = plugged_in(aravis())
    for name, camera in zip(_short_names([(one.serial, one.id) for one in cameras]), cameras, strict=True):
        address = address_of(name)
        yield _told(address, f"{camera.vendor} {camera.model} {camera.serial}, through Aravis",
                    identity_of(address, camera))


LOOKERS: dict[str, Callable[..., Iterable[Found]]] = {"genicam": through_producer, "aravis": through_aravis}


def look() -> None:
    """In the child: print what one of them finds, as a line of JSON."""
    # A maker's library that prints shall not print into the answer.
    answer = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    _, _, name, *given = sys.argv
    try:
        cameras = list(LOOKERS[name](*given))
    except Unavailable:  # its library is not installed: then there is nothing to find with it
        cameras = []
    answer.write(json.dumps(cameras))
    answer.close()
    os._exit(0)  # a library that cannot end its own threads need not


def _tasks(around: Surroundings) -> list[tuple[str, tuple[str, ...]]]:
    from app.sources.industrial.genicam_producers import producers_in
    return [*(("genicam", (str(path),)) for path in producers_in(around.producers).values()), ("aravis", ())]


def _started(name: str, given: list[str]) -> subprocess.Popen[bytes]:
    environment = {k: v for k, v in os.environ.items() if not k.startswith("TOUCHLINE_TOKEN")}
    return subprocess.Popen([sys.executable, "-P", "-c", CODE, json.dumps(sys.path), name, *given], env=environment,
                            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                            start_new_session=True)


def _answer(looker: subprocess.Popen[bytes], until: float) -> list[Found]:
    with looker:
        try:
            raw, _ = looker.communicate(timeout=max(0.0, until - time.monotonic()))
            return json.loads(raw)
        except (subprocess.TimeoutExpired, ValueError):  # it hangs; it died without an answer
            return []
        finally:
            looker.kill()


def _short_names(names: list[tuple[str, str]]) -> list[str]:
    """Of (serial, id) the serial where it is the only one of its kind, else the id."""
    serials = [serial for serial, _ in names]
    return [serial if serial and serials.count(serial) == 1 else id for serial, id in names]


def _told(address: str, title: str, identity: Identity) -> Found:
    return {"address": address, "title": " ".join(title.split()), "identity": asdict(identity)}
