"""What a server on this machine has stored, read while it does not run; and the settings file."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from app.cli.console import FileTrouble
from app.services.open_store import open_store
from app.settings import Settings, load_settings
from app.store.store import Store

ConfigOption = Annotated[Path | None, typer.Option("--config", metavar="FILE", help="Settings file, in the format of "
                                                   "configs/touchline.yaml.")]


@contextmanager
def stored(data: Path | None, config: Path | None) -> Iterator[tuple[Store, Settings]]:
    """Open the data folder of the options --data and --config; FileTrouble where there is none."""
    settings = load_settings(config, data=data)
    if not settings.data.is_dir():
        raise FileTrouble(f"There is no data folder {settings.data}.",
                          "Give the data folder of the server with --data.")
    with open_store(settings) as store:
        yield store, settings
