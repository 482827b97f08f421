"""serve, demo, archive, restore, restore-backup: the dashboard on a port, and its data as one file and back.

Other commands, too, read here what a server on this machine has stored, while it does not run.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from touchline import main
from touchline.cli.console import FileTrouble, say
from touchline.core.errors import Unavailable
from touchline.services.open_store import open_store
from touchline.settings import Settings, load_settings
from touchline.store.archive import restore_into
from touchline.store.store import Store

ConfigOption = Annotated[
    Path | None,
    typer.Option(
        "--config", metavar="FILE", help="Settings file, in the format of configs/touchline.yaml."
    ),
]
FromOption = Annotated[
    Path | None,
    typer.Option("--data", metavar="DIR", help="The data folder of a server that is not running."),
]
ToOption = Annotated[Path, typer.Option("--data", metavar="DIR", help="An empty or new folder.")]

# What straight lines look like before anybody has calibrated: a hall's cameras hang nearly straight, two of them share
# half a field, and another league plays on a black table.
DEMO_CAMERAS = (
    {
        "id": "overhead",
        "name": "Overhead camera, barrel lens",
        "source": "sim://ssl-div-b?region=half&lens=strong&tilt=5&roll=1.5&height=5000&robots=7&fps=10",
        "field": "ssl-div-b",
        "region": "half",
    },
    {
        "id": "east",
        "name": "East camera, tilted",
        "source": "sim://ssl-div-b?cameras=2&camera=1&lens=half&tilt=8&fps=10",
        "field": "ssl-div-b",
        "region": "half-right",
    },
    {
        "id": "table",
        "name": "Table camera, pincushion lens",
        "source": "sim://vsss-3v3?lens=pincushion&fps=10",
        "field": "vsss-3v3",
        "region": "full",
    },
)


@contextmanager
def stored(data: Path | None, config: Path | None) -> Iterator[tuple[Store, Settings]]:
    """Open the data folder of the options --data and --config; FileTrouble where there is none."""
    settings = load_settings(config, data=data)
    if not settings.data.is_dir():
        raise FileTrouble(
            f"There is no data folder {settings.data}.",
            "Give the data folder of the server with --data.",
        )
    with open_store(settings) as store:
        yield store, settings


def archive(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The zip file to write.")],
    data: FromOption = None,
    config: ConfigOption = None,
    passwords: Annotated[
        bool, typer.Option("--passwords", help="Include the passwords of cameras, in clear.")
    ] = False,
) -> None:
    """Write all saved data to one zip file."""
    with stored(data, config) as (store, settings), file.open("xb") as out:
        try:
            for piece in store.archive(settings.own_fields, passwords=passwords):
                out.write(piece)
        except BaseException:  # Ctrl-C as well: half an archive is none
            file.unlink()
            raise
    say(f"{file}: {file.stat().st_size / 1e6:.1f} MB")


def restore(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="A zip file from archive or GET /archive.")
    ],
    data: ToOption,
    config: ConfigOption = None,
) -> None:
    """Restore an archive to an empty folder and an empty database."""
    settings = load_settings(config, data=data)
    database = settings.database.get_secret_value() if settings.database else None
    counts = restore_into(file, settings.data, database)
    say(
        f"{settings.data}: {counts['calibrations']} calibrations, {counts['snapshots']} images, "
        f"{counts['drafts']} drafts, {counts['lenses']} lenses, {counts['cameras']} cameras"
    )


def restore_backup(data: FromOption = None, config: ConfigOption = None) -> None:
    """Restore the newest backup without damage. The current database moves to quarantine."""
    with stored(data, config) as (store, settings):
        done = store.restore_backup()
    say(
        f"{settings.data}: the backup of {done.made_at} (change {done.backup}) was restored. {done.newer_changes} "
        f"can only be found in {done.file}."
    )


DataOption = Annotated[
    Path | None, typer.Option("--data", metavar="DIR", help="Folder for all saved data.")
]
PortOption = Annotated[
    int | None, typer.Option("--port", min=0, max=65535, help="TCP port; 0 selects any free port.")
]
HostOption = Annotated[
    str | None, typer.Option("--host", help="Address to listen on. 127.0.0.1 requires no token.")
]
OpenOption = Annotated[
    bool, typer.Option("--open/--no-browser", help="Open the page in a browser.")
]
LogOption = Annotated[bool, typer.Option("--verbose", "-v", help="Log every request.")]


def serve(
    host: HostOption = None,
    port: PortOption = None,
    data: DataOption = None,
    config: ConfigOption = None,
    open_page: OpenOption = False,
    verbose: LogOption = False,
) -> None:
    """Serve the dashboard and REST."""
    main.serve(
        load_settings(config, data=data, server=_server(host, port)),
        open_page=open_page,
        verbose=verbose,
    )


def demo(
    port: PortOption = None,
    data: DataOption = None,
    open_page: OpenOption = False,
    verbose: LogOption = False,
) -> None:
    """Serve a simulated field camera behind a real lens model, ready to calibrate."""
    settings = load_settings(
        data=data or _cache() / "touchline" / "demo",
        cameras=list(DEMO_CAMERAS),
        server=_server(None, port),
    )
    main.serve(settings, open_page=open_page, verbose=verbose)


def _cache() -> Path:
    """Return the folder for what may be lost; Unavailable for a user without a home, as in a container."""
    try:
        return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    except RuntimeError:
        raise Unavailable(
            "This user has no home folder, where the demo would save its data.",
            "Choose a folder with --data.",
            reason="data-folder",
        ) from None


def _server(host: str | None, port: int | None) -> dict[str, Any] | None:
    given = {"host": host, "port": port}
    return {name: value for name, value in given.items() if value is not None} or None
