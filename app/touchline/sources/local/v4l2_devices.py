"""Cameras plugged into this machine, as Linux lists them in /sys: their identity and their port."""

import re
from dataclasses import dataclass
from pathlib import Path

from touchline.core.errors import BadInput, NotFound
from touchline.core.statements import say
from touchline.sources import Identity

NAMED = re.compile(r"/dev/(video\d{1,3}|v4l/by-(?:id|path)/[A-Za-z0-9_.:+,@%-]{1,200})")
# What makers of cheap cameras write where a serial number should stand; the same on every piece.
NO_SERIALS = {"sn0001", "0123456789", "123456789", "12345678", "1234567890", "0123456789abcdef", "200901010001",
              "01.00.00", "aabbccdd", "default", "none", "unknown"}


@dataclass(frozen=True)
class VideoDevice:
    """One camera. node: /dev/videoN. serial: "" where it has none of its own. port: the plug, not the camera."""

    node: str
    model: str
    serial: str = ""
    port: str = ""
    links: tuple[str, ...] = ()  # lasting names, /dev/v4l/by-id/… first

    @property
    def address(self) -> str:
        """The most lasting address: by identity, by port, and only then by number."""
        lasting = self.links[0] if self.links and (self.serial or "by-path" in self.links[0]) else None
        return f"v4l2://{lasting or next((link for link in self.links if 'by-path' in link), self.node)}"

    @property
    def identity(self) -> Identity:
        return Identity(self.address, self.serial, self.port, self.model)


def list_devices(root: Path = Path("/")) -> tuple[VideoDevice, ...]:
    """Return every camera that gives pictures, by number. root: contains dev and sys."""
    found = sorted((root / "sys/class/video4linux").glob("video*"), key=lambda path: int(path.name[5:] or 0))
    links = {path: Path(path).resolve() for kind in ("by-id", "by-path")
             for path in sorted(map(str, (root / "dev/v4l" / kind).glob("*")))}
    nodes = [path for path in found if _text(path / "index") in ("", "0")]  # the others carry a camera's metadata
    usb = [_usb_device(path) for path in nodes]
    serials = [_text(place / "serial") if place else "" for place in usb]
    return tuple(_device(root, path, place, serial if _own(serial) and serials.count(serial) == 1 else "", links)
                 for path, place, serial in zip(nodes, usb, serials, strict=True))


def find_device(target: str, root: Path = Path("/")) -> VideoDevice:
    """Find the camera named 0, /dev/video0 or /dev/v4l/by-…/NAME; BadInput for another path, NotFound if it is off."""
    path = f"/dev/video{target}" if re.fullmatch(r"[0-9]{1,3}", target) else target
    if not NAMED.fullmatch(path) or "/../" in path or path.endswith("/.."):
        raise BadInput(say("v4l2.not-an-address", "The address does not name a camera on this machine."),
                       say("v4l2.address-form", "Use v4l2://0, or v4l2:///dev/v4l/by-id/NAME with a name from that "
                           "folder."), reason="bad-source")
    known = list_devices(root)
    try:
        node = "/" + str((root / path[1:]).resolve().relative_to(root.resolve()))
    except ValueError:
        node = ""
    for device in known:
        if device.node == node:
            return device
    there = [f"{device.address} ({device.model})" for device in known]
    raise NotFound(say("v4l2.not-found", "There is no camera {name!r} on this machine.", name=target),
                   say("v4l2.connected", "Connected cameras: {cameras}.", cameras=there)
                   if there else say("v4l2.none-connected", "Connected cameras: none."), reason="unknown-camera")


def _device(root: Path, path: Path, usb: Path | None, serial: str, links: dict[str, Path]) -> VideoDevice:
    here = (root / "dev" / path.name).resolve()
    ours = tuple("/" + str(Path(link).relative_to(root)) for link, target in links.items() if target == here)
    by_path = next((Path(link).name for link in ours if "/by-path/" in link), "")
    product = ":".join(filter(None, (_text(usb / "idVendor"), _text(usb / "idProduct")))) if usb else ""
    model = " ".join(filter(None, (_text(path / "name"), f"({product})" if product else "")))
    port = by_path or (usb.name if usb else (path / "device").resolve().name)
    return VideoDevice(f"/dev/{path.name}", model, serial, port, ours)


def _usb_device(path: Path) -> Path | None:
    """The USB device that a video node belongs to: the nearest folder above that names its maker."""
    place = (path / "device").resolve()
    return next((one for one in (place, *place.parents) if (one / "idVendor").is_file()), None)


def _own(serial: str) -> bool:
    """Tell whether a serial number can be unique."""
    return len(set(serial.strip("0"))) > 1 and serial.lower() not in NO_SERIALS


def _text(path: Path) -> str:
    """Read a line of the kernel's; "" where there is none."""
    try:
        return " ".join(path.read_text("utf-8", "replace").split())[:100]
    except OSError:
        return ""
