"""Industrial cameras that were found but not opened, and how one is picked by the name in an address."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from app.core.errors import BadInput
from app.core.statements import Sentence, say
from app.sources import Identity


@dataclass(frozen=True)
class DiscoveredCamera:
    """One camera. name: set by its user, or its hardware id. handle: what its driver opens."""

    id: str
    serial: str
    name: str
    vendor: str
    model: str
    handle: Any

    @property
    def title(self) -> str:
        return " ".join(part for part in (self.vendor, self.model, self.name) if part) or self.id

    def identity(self, address: str) -> Identity:
        return Identity(address, self.serial, self.id, f"{self.vendor} {self.model}".strip())


def find_camera(cameras: Sequence[DiscoveredCamera], target: str) -> DiscoveredCamera | None:
    """Return the camera with this id, else serial number, else name. BadInput where two have the same."""
    for key in ("id", "serial", "name"):
        found = [camera for camera in cameras if getattr(camera, key) == target]
        if len(found) > 1:
            raise BadInput(say("industrial.ambiguous", "{cameras} cameras are called {name!r}.", cameras=len(found),
                               name=target),
                           say("industrial.longer-name", "Use the longer name from the list of cameras."),
                           reason="bad-source")
        if found:
            return found[0]
    return None


def known_cameras(cameras: Sequence[DiscoveredCamera]) -> Sentence:
    """List the cameras in a sentence, for an error."""
    names = [camera.serial or camera.id for camera in cameras]
    return (say("industrial.cameras", "Cameras: {names}.", names=names) if names
            else say("industrial.no-cameras", "Cameras: none. Check cables and power."))
