"""GenTL producers: the makers' libraries (*.cti) through which GenICam cameras are reached, and what is behind them.

A producer is program code of a camera's maker, so it is only ever taken from the folders that the machine's operator
has named; an address from the browser may pick one of those by its file name, no more.
"""

import signal
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import Any

from touchline.core.common_sentences import install_package, use_one_of
from touchline.core.errors import BadInput, NotFound, Unavailable
from touchline.core.statements import say
from touchline.sources.industrial.camera import DiscoveredCamera
from touchline.sources.industrial.features import Node, finite_range

LOOK_MS = 500  # how long a producer may look for cameras on each of its networks
MAX_CAMERAS = 64
FIX = say("industrial.install-producer", "Install the camera vendor's software, and enter its folder in "
          "GENICAM_GENTL64_PATH or in the settings.")

# A producer can be opened once in a process. Each live camera has a process of its own.
_in_use: set[Path] = set()
_lock = threading.Lock()
MAX_CHOICES = 200


def producers_in(places: Sequence[Path]) -> dict[str, Path]:
    """Return producers by file name without .cti; the first of a name wins. places: files and folders."""
    found: dict[str, Path] = {}
    for place in places:
        try:
            files = sorted(place.glob("*.cti")) if place.is_dir() else [place] * (place.suffix == ".cti")
        except OSError:
            continue
        for file in files:
            if file.is_file():
                found.setdefault(file.stem, file.resolve())
    return found


def select_producers(places: Sequence[Path], name: str) -> list[Path]:
    """Return the producer of this name, or all where it is ""; NotFound lists those there are."""
    found = producers_in(places)
    if not found:
        raise Unavailable(say("industrial.no-producer", "No GenTL producer is installed on this machine."), FIX,
                          reason="no-producer")
    if not name:
        return list(found.values())
    if name not in found:
        raise NotFound(say("industrial.unknown-producer", "There is no GenTL producer {producer!r} on this machine.",
                           producer=name[:60]), use_one_of(found), reason="unknown-producer")
    return [found[name]]


def open_harvester(producers: Sequence[Path]) -> Any:
    """A Harvester that knows the cameras behind these producers; let_go() of it before another can have them."""
    try:
        from harvesters.core import Harvester
    except ImportError:
        raise Unavailable(say("industrial.no-harvesters", "GenICam cameras need the Python package harvesters."),
                          install_package("harvesters"), reason="no-genicam") from None
    with _lock:
        if taken := _in_use.intersection(producers):
            raise Unavailable(say("industrial.producer-in-use", "The producer {producer} is used by another camera of "
                                  "this process.", producer=min(taken).stem),
                              say("industrial.close-that-camera", "Close that camera first."), reason="camera-busy")
        _in_use.update(producers)
    harvester = Harvester()
    harvester.timeout_for_update = LOOK_MS
    for path in producers:
        harvester.add_file(str(path))
    harvester.update()
    return harvester


def close_harvester(harvester: Any) -> None:
    """Close its producers, and whatever was opened through them."""
    files = {Path(file) for file in harvester.files}
    try:
        harvester.reset()
    finally:
        with _lock:
            _in_use.difference_update(files)


def list_cameras(harvester: Any) -> list[DiscoveredCamera]:
    """Return the cameras that are plugged in."""
    return [DiscoveredCamera(_text(info, "id_"), _text(info, "serial_number"), _text(info, "user_defined_name"),
                             _text(info, "vendor"), _text(info, "model"), info)
            for info in harvester.device_info_list[:MAX_CAMERAS]]


def _text(info: Any, name: str) -> str:
    """Return a camera's own text, printable; "" where its producer does not know it."""
    from genicam import gentl
    try:
        value = getattr(info, name)
    except gentl.GenericException:
        return ""
    return "".join(c for c in str(value or "") if c.isprintable())[:100].strip()


@contextmanager
def preserve_sigint() -> Iterator[None]:
    """Restore the SIGINT handler that harvesters replaces when it opens a camera."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.getsignal(signal.SIGINT)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


class GenApiNodes:
    """Nodes over a genapi NodeMap."""

    def __init__(self, node_map: Any) -> None:
        from genicam import genapi  # comes with harvesters, which is optional
        self._map, self._genapi = node_map, genapi
        modes = genapi.EAccessMode
        self._readable, self._writable = (modes.RO, modes.RW), (modes.WO, modes.RW)

    def get(self, name: str) -> Node | None:
        node = getattr(self._map, name, None)
        try:
            access = node.get_access_mode() if node is not None else None
            return self._described(node, access in self._writable) if access in self._readable else None
        except self._genapi.GenericException:  # it went away between the two questions
            return None

    def set(self, name: str, value: Any) -> None:
        node = getattr(self._map, name, None)
        if node is None:
            raise BadInput(f"The camera has no setting {name}.", "Use another setting.", reason="bad-control")
        try:
            if isinstance(node, self._genapi.ICommand):
                node.execute()
            else:
                node.value = value
        except (self._genapi.GenericException, TypeError, OverflowError) as error:
            said = " ".join(str(error).split(" : ")[0].split())[:200]  # without where in its own code GenApi says it
            raise BadInput(f"The camera refuses {name} = {value}.",
                           f"Camera message: {said.rstrip('.')}." if said else "Use another value.",
                           reason="bad-control") from None

    def _described(self, node: Any, writable: bool) -> Node | None:
        if isinstance(node, self._genapi.IEnumeration):
            names = (entry.symbolic for entry in node.entries if entry.get_access_mode() in self._readable)
            return Node("choice", node.value, writable, choices=tuple(islice(names, MAX_CHOICES)))
        if isinstance(node, self._genapi.IBoolean):
            return Node("bool", node.value, writable)
        if isinstance(node, self._genapi.IInteger):
            return Node("int", node.value, writable, finite_range(node.min, node.max), node.inc, node.unit)
        if isinstance(node, self._genapi.IFloat):
            return Node("float", node.value, writable, finite_range(node.min, node.max), 0.0, node.unit)
        return None
