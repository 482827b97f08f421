"""What Touchline can do, subject by subject, in one table: routes, jobs, commands, parts of a camera's process, claims.

A package that is installed beside Touchline adds its own by an entry point of the group `touchline.capabilities`: its
name, and where its Capability is. Everything is named as "module:attribute" and imported where it is used, so that a
command starts without the server's packages.
"""

import logging
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from dataclasses import field as member
from functools import cache
from typing import TYPE_CHECKING, Any

from touchline.core.registry import load

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

GROUP = "touchline.capabilities"
log = logging.getLogger("touchline")


@dataclass(frozen=True)
class Capability:
    """What one subject adds.

    routes: routers of FastAPI, below /api/v1; where two paths match a request, the first one in the table wins.
    page_routes: routers beside /api/v1, for the page alone. jobs: functions of (spec, progress), plain JSON in and out,
    by the name with which a job is stored: once released, it stays. savers: functions of (services, what the job's
    function returned, context) that store it and return the job's result, by the name that a job gives.
    commands: of the shell, each with the first line of its help.
    camera_parts: subclasses of CameraPart, of which each camera's process has one. camera_feeds: subclasses of
    CameraFeed, their other half in the server, by the part. claims: async functions of (services, calibration,
    is_abandoned) that return what they claim of a version, and what they tried to refute it.
    site_claims: functions of (services) that return what they claim of the whole site now, called in a worker thread.
    running: subclasses of RunningPart, each started and closed with the server; services.part() returns it.
    saved_rows: functions of (row), by the table, that raise where the row is none that this version can read; those of
    packages beside are not asked.
    """

    routes: tuple[str, ...] = ()
    page_routes: tuple[str, ...] = ()
    jobs: Mapping[str, str] = member(default_factory=dict)
    savers: Mapping[str, str] = member(default_factory=dict)
    commands: Mapping[str, tuple[str, str]] = member(default_factory=dict)
    camera_parts: tuple[str, ...] = ()
    camera_feeds: Mapping[str, str] = member(default_factory=dict)
    claims: tuple[str, ...] = ()
    site_claims: tuple[str, ...] = ()
    running: tuple[str, ...] = ()
    saved_rows: Mapping[str, str] = member(default_factory=dict)


ROUTES = "touchline.api.routes"
SAVERS = "touchline.services.result_savers"
CALIBRATION = "touchline.workflows.calibration_request"
CAPABILITIES: Mapping[str, Capability] = {
    "server": Capability(
        routes=(f"{ROUTES}.server_state:router",),
        commands={
            "serve": ("touchline.cli.server:serve", "Serve the dashboard and REST."),
            "demo": (
                "touchline.cli.server:demo",
                "Serve a simulated field camera behind a real lens model, ready to calibrate.",
            ),
            "call": (
                "touchline.cli.call:call",
                "Make calls of the REST interface, in this process or to a running server.",
            ),
            "archive": ("touchline.cli.archive:archive", "Write all saved data to one zip file."),
            "restore": (
                "touchline.cli.archive:restore",
                "Restore an archive to an empty folder and an empty database.",
            ),
            "restore-backup": (
                "touchline.cli.archive:restore_backup",
                "Restore the newest backup without damage. The current database moves to quarantine.",
            ),
        },
    ),
    "cameras": Capability(
        routes=(
            f"{ROUTES}.cameras:router",
            f"{ROUTES}.streams:router",
            f"{ROUTES}.cameras:events_router",
        )
    ),
    "snapshots": Capability(routes=(f"{ROUTES}.snapshots:router",)),
    "fields": Capability(routes=("touchline.fields.routes:router",)),
    "automatic": Capability(
        routes=("touchline.automatic.routes:router",),
        jobs={"automatic.detect": "touchline.automatic.recognition:run_auto"},
        savers={"found-lines": "touchline.automatic.service:save_found_lines"},
        commands={
            "auto": (
                "touchline.automatic.commands:auto",
                "Detect the field lines in an image and calibrate from them, if all checks pass.",
            )
        },
    ),
    "drift": Capability(
        routes=("touchline.drift.routes:router",),
        jobs={
            "drift.check": "touchline.drift.check:run_check",
            "drift.reregister": "touchline.drift.reregister:run_register",
        },
        savers={"registered": "touchline.drift.service:save_registered"},
        camera_parts=("touchline.drift.live:DriftPart",),
        claims=("touchline.drift.service:line_claims",),
        commands={
            "check": (
                "touchline.drift.commands:check",
                "Compare the field lines with a calibration. Exit code 5 if it is below --enough.",
            )
        },
    ),
    "calibration": Capability(
        routes=(
            f"{ROUTES}.fit:router",
            f"{ROUTES}.calibrations:router",
            f"{ROUTES}.judging:router",
            f"{ROUTES}.judging:claims_router",
            f"{ROUTES}.using:router",
        ),
        jobs={
            "calibration.fit": f"{CALIBRATION}:run_fit",
            "calibration.compare": f"{CALIBRATION}:run_compare",
            "calibration.preview": f"{CALIBRATION}:run_preview",
            "calibration.attempt": f"{CALIBRATION}:run_attempt",
            "calibration.refit": "touchline.workflows.calibration_request:run_refit",
        },
        savers={"calibration": f"{SAVERS}:calibration", "calibrations": f"{SAVERS}:calibrations"},
        claims=("touchline.services.claims:own_claims",),
        commands={
            "calibrate": (
                "touchline.cli.calibration:calibrate",
                "Calibrate one image from points.",
            ),
            "correct": ("touchline.cli.calibration:correct", "Correct one image."),
            "transform": (
                "touchline.cli.calibration:transform",
                "Convert pixels to field millimetres, or back.",
            ),
            "export": (
                "touchline.cli.exports:export",
                "Write a calibration in the format of another program.",
            ),
            "import": ("touchline.cli.exports:import_file", "Read a file of another program."),
            "turn": (
                "touchline.cli.exports:turn",
                "Turn a calibration or a lens with the images of its camera.",
            ),
        },
    ),
    "jobs": Capability(routes=(f"{ROUTES}.jobs:router",)),
    "lenses": Capability(routes=(f"{ROUTES}.lenses:router",)),
    "boards": Capability(
        routes=("touchline.boards.routes:router", "touchline.boards.routes:live"),
        jobs={
            "board.pictures": "touchline.boards.request:run_pictures",
            "board.views": "touchline.boards.request:run_views",
        },
        savers={"lens": "touchline.boards.service:save_lens"},
        camera_parts=("touchline.boards.live:BoardPart",),
        commands={
            "board": (
                "touchline.boards.commands:board",
                "Calibrate a lens from images of a board, for calibrate --lens.",
            )
        },
    ),
    "straight": Capability(
        routes=(
            "touchline.straight.routes:router",
            "touchline.straight.routes:lenses",
            "touchline.straight.routes:rolls",
        ),
        jobs={
            "straight.measure": "touchline.straight.straightness:run_straightness",
            "straight.rolls": "touchline.straight.rolling:run_motion",
        },
        savers={"motion": "touchline.straight.service:save_motion"},
        camera_parts=("touchline.straight.live:RollPart",),
        saved_rows={"rolls": "touchline.straight.service:read_roll"},
    ),
    "rigs": Capability(
        routes=("touchline.rigs.routes:router", "touchline.rigs.routes:pairs"),
        jobs={
            "rig.check": "touchline.rigs.check:run_check",
            "rig.pair": "touchline.rigs.check:run_pair",
        },
        savers={"rig-check": "touchline.rigs.service:save_check"},
        claims=("touchline.rigs.service:neighbour_claims",),
        site_claims=("touchline.rigs.service:site_claims",),
    ),
    "league": Capability(
        routes=("touchline.league.routes:router", "touchline.league.routes:packets"),
        claims=("touchline.league.service:packet_claims",),
        site_claims=("touchline.league.service:site_claims",),
        running=("touchline.league.service:PublishingService",),
    ),
    "referee": Capability(
        routes=("touchline.referee.routes:router",),
        running=("touchline.referee.service:RefereeService",),
    ),
    "report": Capability(
        routes=("touchline.report.routes:router",),
        commands={
            "report": (
                "touchline.report.commands:report",
                "Show or write the report of one calibration. Exit code 0 if it is good enough.",
            )
        },
    ),
    "detection": Capability(
        routes=tuple(
            f"touchline.detection.routes:{name}"
            for name in ("router", "colours", "clips", "tracks")
        ),
        camera_parts=("touchline.detection.live:DetectionPart",),
        camera_feeds={
            "touchline.detection.live:DetectionPart": "touchline.detection.service:DetectionFeed"
        },
        saved_rows={"presets": "touchline.detection.store:read_preset"},
    ),
    "scene": Capability(
        routes=("touchline.scene.routes:router",),
        page_routes=("touchline.scene.routes:viser_proxy",),
    ),
}


@cache
def capabilities() -> Mapping[str, Capability]:
    """Return those of the table, then those of packages installed beside, by name.

    A package that has none, or that takes a name which another one has, is left out and logged.
    """
    from importlib.metadata import entry_points

    found = dict(CAPABILITIES)
    for point in entry_points(group=GROUP):
        if (capability := _installed(point, found)) is not None:
            found[point.name] = capability
    return found


def jobs() -> dict[str, str]:
    """Return the function of every job by its name."""
    return {name: target for one in capabilities().values() for name, target in one.jobs.items()}


def savers() -> dict[str, str]:
    """Return every saver by its name."""
    return {name: target for one in capabilities().values() for name, target in one.savers.items()}


def commands() -> dict[str, tuple[str, str]]:
    """Return every command by its name: where it is, and the first line of its help."""
    return {
        name: command for one in capabilities().values() for name, command in one.commands.items()
    }


def camera_parts() -> tuple[str, ...]:
    """Return every part of a camera's process."""
    return tuple(target for one in capabilities().values() for target in one.camera_parts)


def camera_feeds() -> dict[int, Any]:
    """Return every feed of a camera, imported, by its part's place in camera_parts(); see loaded()."""
    places = {part: place for place, part in enumerate(camera_parts())}
    return {
        places[part]: feed
        for name, one in capabilities().items()
        for part, target in one.camera_feeds.items()
        if part in places and (feed := _loaded(name, target)) is not None
    }


def saved_rows() -> dict[str, str]:
    """Return what reads the rows of a table, by the table; our own alone: no package beside says what is damaged."""
    return {
        table: target for one in CAPABILITIES.values() for table, target in one.saved_rows.items()
    }


def find_command(name: str) -> str | None:
    """Return where a command is; None where there is none. Packages beside are looked for only where it is not ours."""
    ours = next((one.commands[name] for one in CAPABILITIES.values() if name in one.commands), None)
    found = ours or commands().get(name)
    return None if found is None else found[0]


def loaded(kind: str) -> Iterator[Any]:
    """Yield what every capability names there, such as "routes", in the order of the table.

    What a package names that cannot be imported is logged.
    """
    return (made for _, made in loaded_by_name(kind))


def loaded_by_name(kind: str) -> Iterator[tuple[str, Any]]:
    """Yield the same with the name of its capability."""
    for name, one in capabilities().items():
        for target in getattr(one, kind):
            if (made := _loaded(name, target)) is not None:
                yield name, made


def call(target: str, *values: Any) -> Any:
    """Call what "module:attribute" names, imported now."""
    return load(target)(*values)


def _loaded(name: str, target: str) -> Any | None:
    """Return what a capability of that name names; None, and logged, where a package beside cannot be imported."""
    try:
        return load(target)
    except Exception as error:  # another's code
        if name in CAPABILITIES:
            raise
        log.error("%s of %r cannot be used: %s: %s", target, name, type(error).__name__, error)
        return None


def _installed(point: "EntryPoint", found: Mapping[str, Capability]) -> Capability | None:
    try:
        made = point.load()
        if not isinstance(made, Capability):
            raise TypeError(f"it is no {Capability.__name__}")
    except Exception as error:  # another's code
        log.error(
            "The package of %r was not loaded: %s: %s", point.name, type(error).__name__, error
        )
        return None
    taken = [
        name
        for name in (point.name, *made.jobs, *made.savers, *made.commands)
        if name in _names(found)
    ]
    if taken:
        log.error("The package of %r was not loaded: the name %r is taken.", point.name, taken[0])
        return None
    return made


def _names(found: Mapping[str, Capability]) -> set[str]:
    return {
        *found,
        *(name for one in found.values() for name in (*one.jobs, *one.savers, *one.commands)),
    }
