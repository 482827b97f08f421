"""archive, restore, restore-backup: everything as one file, a data folder made of it, and a way back to a backup.

Other commands, too, read here what a server on this machine has stored, while it does not run.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from touchline.cli.console import FileTrouble, say
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
