"""What a capability keeps running while the server serves, and what the rest of the server asks and tells it."""

from collections.abc import Sequence
from typing import Any

from touchline.core.records import Warning
from touchline.core.statements import Sentence


class RunningPart:
    """Made of Services, as all its parts are; started with the server, and closed with it. Thread-safe.

    A part overrides what it needs.
    """

    def __init__(self, _services: Any) -> None:
        """The server's Services; nothing may start yet: a script's server sends nothing."""

    def start(self) -> None:
        """Begin: the server serves."""

    def close(self) -> None:
        """End what start() began; called also where nothing was started."""

    async def aclose(self) -> None:
        self.close()

    def wake(self) -> None:
        """Note that an active calibration, a camera, a field or the settings of publishing are others now."""

    @property
    def warnings(self) -> Sequence[Warning]:
        """What an operator should see on every page."""
        return ()

    def uses_of_field(self, name: str) -> list[Sentence]:
        """Name what would miss that field: it is not deleted then."""
        return []

    def uses_of_rig(self, name: str) -> list[Sentence]:
        """Name what would miss that rig: it is not deleted then."""
        return []

    def rig_changed(self, name: str) -> None:
        """Note that a rig was saved or deleted; called in a worker thread."""
