"""The game controller while the server runs: its settings, the listener that follows them, and the heights of robots.

Other heights reach the processes of the cameras at once. They stay for some minutes after the last message.
"""

import asyncio
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Self

from touchline.core.json_values import JsonObject, read
from touchline.core.records import Warning
from touchline.core.statements import say
from touchline.installation import shipped
from touchline.league.service import SERVER, PublishingService
from touchline.network.address import MulticastAddress, interfaces
from touchline.network.multicast import MulticastReceiver
from touchline.referee.heights import (
    NOTHING,
    TEAMS,
    Heights,
    Team,
    TeamByHand,
    TeamHeight,
    checked_height,
    checked_heights,
    checked_name,
    folded,
    merged_table,
    read_heights,
    team_height,
)
from touchline.referee.live import RefereeListener
from touchline.referee.received import GameController, choose, others
from touchline.services.container import Services
from touchline.services.running_part import RunningPart
from touchline.services.saved_settings import SavedSettings
from touchline.settings import REFEREE_GROUP, REFEREE_PORT
from touchline.store.repository import check_etag

FILE = "referee.json"


@dataclass(frozen=True)
class RefereeConfig:
    """All settings: those of the settings file, and what a page sets of the teams.

    blue, yellow: by hand; they win over the game controller. heights: own entries of the table.
    """

    enabled: bool | None = None
    group: str = REFEREE_GROUP
    port: int = REFEREE_PORT
    interface: str = ""
    blue: TeamByHand = NOTHING
    yellow: TeamByHand = NOTHING
    heights: Heights = field(default_factory=dict)

    def __post_init__(self) -> None:
        MulticastAddress(self.group, self.port, self.interface)  # which checks its parts
        checked_heights(self.heights)
        for team in (self.blue, self.yellow):
            if team.name is not None:
                checked_name(team.name)
            if team.height_mm is not None:
                checked_height(team.height_mm)

    def to_json(self) -> JsonObject:
        return {**vars(self), "blue": vars(self.blue), "yellow": vars(self.yellow)}

    @classmethod
    def from_json(cls, value: Any) -> Self:
        """Read what to_json wrote; BadInput for anything else."""
        return read(
            cls,
            value,
            "The game controller's configuration",
            "Enter its settings again.",
            "bad-referee",
        )


class RefereeService(RunningPart):
    """Listens as configured, from start() until close(). Thread-safe."""

    def __init__(self, services: Services) -> None:
        self._services, self._publishing = services, services.part(PublishingService)
        self._lock = threading.Lock()
        self._settings = SavedSettings(
            services.settings.data / FILE,
            services.settings.referee.model_dump(),
            RefereeConfig,
            services.store.failures,
            ("heights",),
        )
        self._listener: RefereeListener | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._followed: Mapping[str, float] = {}

    def start(self) -> None:
        self._loop = asyncio.get_running_loop()
        self.wake()

    def close(self) -> None:
        with self._lock:
            self._loop = None
            self._listen_to(None)

    def wake(self) -> None:
        """Follow the settings, and those of publishing."""
        with self._lock:
            self._listen_to(self._wanted_address if self._loop is not None else None)
        self._follow_heights()

    @property
    def config(self) -> RefereeConfig:
        return self._settings.config

    @property
    def etag(self) -> str:
        return self._settings.etag

    @property
    def table(self) -> Heights:
        """Every team's height by its name: what comes with Touchline, and own entries over that."""
        return merged_table(self._shipped, self.config.heights)

    @property
    def warnings(self) -> Sequence[Warning]:
        found = []
        if self._settings.is_damaged:
            found.append(
                Warning(
                    "referee-damaged",
                    say(
                        "referee.damaged",
                        "{file} in the data folder cannot be read. Team heights entered here are not used.",
                        file=FILE,
                    ),
                    say(
                        "referee.restore-settings",
                        "Enter the robot heights again, or correct the file and restart the server.",
                    ),
                )
            )
        listener, now_s = self._listener, time.monotonic()
        if listener is None:
            return found
        if (problem := listener.problem) is not None and self.config.enabled:
            found.append(Warning("referee-not-received", problem.what, problem.fix))
        chosen = choose(listener.senders, now_s)
        found += [
            Warning(
                "two-game-controllers",
                say(
                    "referee.two",
                    "Two game controllers send: {chosen} is used, {other} is ignored.",
                    chosen=chosen.address,
                    other=other.address,
                ),
                say("referee.stop-one", "Stop one of them, or enter the teams yourself."),
            )
            for other in others(listener.senders, chosen, now_s)[:1]
            if chosen is not None
        ]
        return found

    def teams(self) -> dict[Team, TeamHeight]:
        """Return both teams' heights as they count now."""
        chosen, config, table = self._chosen(), self.config, self.table
        message = chosen and chosen.message
        return {
            "blue": team_height(config.blue, message.blue if message else "", table),
            "yellow": team_height(config.yellow, message.yellow if message else "", table),
        }

    def heights(self) -> dict[str, float]:
        """Return the heights that are known, by team."""
        found = self.teams()
        return {
            team: height_mm for team in TEAMS if (height_mm := found[team].height_mm) is not None
        }

    def change(self, changes: JsonObject, etag: str | None = None) -> None:
        """Save and follow; BadInput, or NetworkError where this network does not carry it now.

        etag: of the settings that the caller saw; Stale if they are others by now. Nothing is saved or followed where
        anything is refused.
        """
        with self._lock:
            before = self.config
            check_etag(
                etag,
                self.etag,
                say(
                    "stale.referee",
                    "Another user has changed the robot heights since you opened them.",
                ),
                "stale-referee",
                before.to_json(),
            )
            saved, config = self._settings.after(changes)
            moved = (config.enabled, config.group, config.port, config.interface) != (
                before.enabled,
                before.group,
                before.port,
                before.interface,
            )
            if config.enabled and moved:
                MulticastReceiver(self._address_of(config)).close()
            self._settings.save(saved, config)
        self.wake()

    def add_file(self, data: bytes, etag: str | None = None) -> None:
        """Save what a robot-heights.yml has beside the table, as own entries; BadInput, or Stale."""
        given, known = read_heights(data), self._shipped
        same = {folded(name): height_mm for name, height_mm in known.items()}
        own = {name: mm for name, mm in given.items() if same.get(folded(name)) != mm}
        back = {name: None for name in self.config.heights if folded(name) in map(folded, given)}
        self.change({"heights": {**back, **own}}, etag)

    def status(self) -> JsonObject:
        """Return settings, table, teams and who sends, as JSON."""
        listener, now_s, chosen = self._listener, time.monotonic(), self._chosen()
        problem = None if listener is None else listener.problem
        own = {folded(name) for name in self.config.heights}
        return {
            **self.config.to_json(),
            "listening": listener is not None and listener.joined.is_set() and problem is None,
            "problem": problem and problem.to_json(),
            "teams": {team: found.to_json() for team, found in self.teams().items()},
            "table": [
                {"team": name, "height_mm": height_mm, "own": folded(name) in own}
                for name, height_mm in self.table.items()
            ],
            "controllers": [
                {**one.to_json(now_s), "chosen": chosen is not None and one.id == chosen.id}
                for one in (() if listener is None else listener.senders)
            ],
            "interfaces": interfaces(),
        }

    @cached_property
    def _shipped(self) -> Heights:
        return read_heights((shipped("configs") / "robot-heights.yml").read_bytes())

    def _chosen(self) -> GameController | None:
        listener = self._listener
        return None if listener is None else choose(listener.senders, time.monotonic())

    @property
    def _wanted_address(self) -> MulticastAddress | None:
        wanted = self.config.enabled
        if wanted is None:
            publications = self._publishing.publications.values()
            wanted = any(one.config.enabled or one.config.absorb for one in publications)
        return self._address_of(self.config) if wanted else None

    def _address_of(self, config: RefereeConfig) -> MulticastAddress:
        interface = config.interface or self._publishing.of(SERVER).config.interface
        return MulticastAddress(config.group, config.port, interface)

    def _listen_to(self, address: MulticastAddress | None) -> None:
        listener = self._listener
        if (None if listener is None else listener.address) == address:
            return
        if listener is not None:
            self._listener = None
            listener.close()
        if address is not None:
            self._listener = RefereeListener(address, self._follow_heights)

    def _follow_heights(self) -> None:
        """Let the cameras follow where the heights are others than before; of any thread."""
        loop, heights = self._loop, self.heights()
        if loop is not None and heights != self._followed:
            self._followed = heights
            loop.call_soon_threadsafe(self._refresh_cameras)

    def _refresh_cameras(self) -> None:
        for camera in self._services.live.running:
            self._services.live.refresh(camera)
