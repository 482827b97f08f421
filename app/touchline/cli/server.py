"""serve and demo: the dashboard and REST on a port of this machine."""

import os
from pathlib import Path
from typing import Annotated, Any

import typer

from touchline import main
from touchline.cli.archive import ConfigOption
from touchline.core.errors import Unavailable
from touchline.settings import load_settings

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
