"""Discover every camera that can be found without its address.

This runs the camera makers' own libraries, which may hang or crash; so each runs in a process of its own, all at once,
and what has not answered by the deadline is left out.
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
from app.sources import Identity, SourceContext

DEADLINE_S = 5.0  # starting Python, then the second in which a network camera may answer; on a busy small machine
CODE = "import json, sys; sys.path[:] = json.loads(sys.argv[1]); from app.sources import discover; discover.main()"
Discovered = dict[str, Any]  # {"address", "title", "identity"}


def discover_cameras(context: SourceContext, deadline_s: float = DEADLINE_S) -> list[Discovered]:
    """Return every camera found: its address as a source, a title for people, its identity as JSON.

    A camera that two libraries reach is listed twice, once with each address.
    """
    until = time.monotonic() + deadline_s
    finders = [_start(name, [*given]) for name, given in _tasks(context)]
    return [*v4l2_cameras(), *(one for finder in finders for one in _answer(finder, until))]


def v4l2_cameras() -> Iterable[Discovered]:
    """Yield the webcams and capture cards that Linux lists; no camera is opened."""
    from app.sources.local.v4l2 import V4l2Source
    from app.sources.local.v4l2_devices import list_devices
    for camera in list_devices(V4l2Source.root):
        yield _discovered(camera.address, f"{camera.model}, {camera.node}", camera.identity)


def genicam_cameras(path: str) -> Iterable[Discovered]:
    """Yield the GenICam cameras behind one producer."""
    from app.sources.industrial.genicam import address_of
    from app.sources.industrial.genicam_producers import close_harvester, list_cameras, open_harvester
    producer = Path(path)
    harvester = open_harvester([producer])
    cameras = list_cameras(harvester)
    names = _short_names([(camera.serial, camera.id) for camera in cameras])
    for name, camera in zip(names, cameras, strict=True):
        address = address_of(name, producer.stem)
        yield _discovered(address, f"{camera.title} {camera.serial}, through {producer.name}",
                          camera.identity(address))
    close_harvester(harvester)


def aravis_cameras() -> Iterable[Discovered]:
    """Yield the GigE Vision and USB3 Vision cameras that answer to Aravis."""
    from app.sources.industrial.aravis import address_of, aravis, discover_cameras
    cameras = discover_cameras(aravis())
    for name, camera in zip(_short_names([(one.serial, one.id) for one in cameras]), cameras, strict=True):
        address = address_of(name)
        yield _discovered(address, f"{camera.vendor} {camera.model} {camera.serial}, through Aravis",
                    camera.identity(address))


FINDERS: dict[str, Callable[..., Iterable[Discovered]]] = {"genicam": genicam_cameras, "aravis": aravis_cameras}


def main() -> None:
    """In the child process: print what one finder finds, as a line of JSON."""
    # What a maker's library prints must not end up in the answer.
    answer = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    _, _, name, *given = sys.argv
    try:
        cameras = list(FINDERS[name](*given))
    except Unavailable:  # its library is not installed: then there is nothing to find with it
        cameras = []
    answer.write(json.dumps(cameras))
    answer.close()
    os._exit(0)  # a library that cannot end its own threads need not


def _tasks(context: SourceContext) -> list[tuple[str, tuple[str, ...]]]:
    from app.sources.industrial.genicam_producers import producers_in
    return [*(("genicam", (str(path),)) for path in producers_in(context.producers).values()), ("aravis", ())]


def _start(name: str, given: list[str]) -> subprocess.Popen[bytes]:
    environment = {k: v for k, v in os.environ.items() if not k.startswith("TOUCHLINE_TOKEN")}
    return subprocess.Popen([sys.executable, "-P", "-c", CODE, json.dumps(sys.path), name, *given], env=environment,
                            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                            start_new_session=True)


def _answer(finder: subprocess.Popen[bytes], until: float) -> list[Discovered]:
    with finder:
        try:
            raw, _ = finder.communicate(timeout=max(0.0, until - time.monotonic()))
            return json.loads(raw)
        except (subprocess.TimeoutExpired, ValueError):  # it hangs; it died without an answer
            return []
        finally:
            finder.kill()


def _short_names(names: list[tuple[str, str]]) -> list[str]:
    """Return of each (serial, id) the serial where it is unique, else the id."""
    serials = [serial for serial, _ in names]
    return [serial if serial and serials.count(serial) == 1 else id for serial, id in names]


def _discovered(address: str, title: str, identity: Identity) -> Discovered:
    return {"address": address, "title": " ".join(title.split()), "identity": asdict(identity)}
