"""Publishing without a server: its settings in a folder, and the calibrations that a test has."""

import threading
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

from touchline.core.field import Field
from touchline.core.records import Calibration
from touchline.league.packet import NO_FIELDS
from touchline.league.service import PublishingService
from touchline.services.container import Services
from touchline.settings import PublishSettings
from touchline.store.files import RecentFailures


def publishing_of(
    folder: Path,
    active: Callable[[], Sequence[Calibration]],
    fields: Mapping[str, Field] = NO_FIELDS,
    **settings: Any,
) -> PublishingService:
    """Return it as yet not started. folder: of its files; active: returns the active calibrations."""
    return PublishingService(
        cast(
            Services,
            SimpleNamespace(
                settings=SimpleNamespace(
                    data=folder, publish=PublishSettings(**{"listen_first_s": 0, **settings})
                ),
                store=SimpleNamespace(failures=RecentFailures(), references=threading.RLock()),
                cameras=SimpleNamespace(active_calibrations=active),
                fields=fields,
            ),
        )
    )
