"""Serve the application on the network: a socket, a token and uvicorn."""

import asyncio
import contextlib
import logging
import os
import secrets
import socket
from collections.abc import Callable
from pathlib import Path

import uvicorn
from starlette.types import ASGIApp

from touchline.core.errors import Conflict, Unavailable
from touchline.settings import Settings
from touchline.sources.address import without_secrets

TOKEN_BYTES = 24  # 192 bits: nobody guesses it, and it still fits on one line
BACKLOG = 1024
STOP_S = 2  # a viewer of an endless stream must not keep the server from ending


def with_token(settings: Settings, say: Callable[[str], None]) -> Settings:
    """Return the settings with an access token where one is needed: for any address but this machine's.

    It is made once, saved in the data folder for its owner alone, and printed once, when it is made.
    """
    if settings.token is not None or settings.server.is_loopback:
        return settings
    path = settings.data / "token"
    if not path.is_file():
        settings.data.mkdir(parents=True, exist_ok=True)
        token = secrets.token_urlsafe(TOKEN_BYTES)
        with open(
            os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="ascii"
        ) as file:
            file.write(token + "\n")
        say(f"Access token, shown only once: {token}\n(saved in {path})")
    token = path.read_text(encoding="ascii").strip()
    if len(token) < 16:
        raise Conflict(
            f"The token in {path} is too short.",
            "Delete that file. A new token is created at the next start.",
            reason="bad-token",
        )
    return settings.model_validate({**settings.model_dump(), "token": token})


def open_socket(host: str, port: int) -> socket.socket:
    """Return a bound socket, before anything else starts, so that a taken port is reported at once."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
        listener.listen(BACKLOG)  # from here on a client waits for its response and is not refused
    except OSError as error:
        listener.close()
        raise Unavailable(
            f"Cannot listen on {host}, port {port}: {error.strerror}.",
            "Choose another port with --port, or 0 for any free port.",
            reason="port-taken",
        ) from None
    listener.set_inheritable(False)
    return listener


def url_of(listener: socket.socket) -> str:
    """Return the address of the page for a browser on this machine."""
    host, port = listener.getsockname()[:2]
    host = {"0.0.0.0": "127.0.0.1", "::": "[::1]"}.get(host, f"[{host}]" if ":" in host else host)
    return f"http://{host}:{port}/"


class _AnnouncedServer(uvicorn.Server):
    """Calls announce() once it answers; never where the start has failed."""

    def __init__(self, config: uvicorn.Config, announce: Callable[[], None]) -> None:
        super().__init__(config)
        self._announce = announce

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        if self.started:
            self._announce()


def run(
    app: ASGIApp,
    listener: socket.socket,
    settings: Settings,
    connection: type[asyncio.Protocol],
    announce: Callable[[], None],
    *,
    log_level: str = "warning",
) -> None:
    """Serve until SIGTERM or Ctrl-C; requests in progress get STOP_S seconds. connection: uvicorn's class, or ours."""
    config = uvicorn.Config(
        app,
        log_level=log_level,
        access_log=log_level == "info",
        server_header=False,
        timeout_graceful_shutdown=STOP_S,
        timeout_keep_alive=20,
        http=connection,
        ws="websockets-sansio",
        ws_per_message_deflate=False,
    )  # JPEGs do not get smaller, only the server slower
    logging.getLogger("uvicorn.error").addFilter(_without_traceback_of_bad_bytes)
    _mask_logs()
    with contextlib.closing(listener), contextlib.suppress(KeyboardInterrupt):
        _AnnouncedServer(config, announce).run(sockets=[listener])


class MaskedFormatter(logging.Formatter):
    """Formats as another formatter, without the secrets of addresses: of a request, a camera, or in a traceback."""

    def __init__(self, inner: logging.Formatter) -> None:
        super().__init__()
        self._inner = inner

    def format(self, record: logging.LogRecord) -> str:
        return without_secrets(self._inner.format(record))


def _mask_logs() -> None:
    """Mask all that this process logs: by uvicorn's handlers, by root's, and by Python's own where there are none."""
    loggers = map(logging.getLogger, ("", "uvicorn", "uvicorn.access"))
    for handler in (
        logging.lastResort,
        *(handler for logger in loggers for handler in logger.handlers),
    ):
        if handler is not None and not isinstance(handler.formatter, MaskedFormatter):
            handler.setFormatter(MaskedFormatter(handler.formatter or logging.Formatter()))


def _without_traceback_of_bad_bytes(record: logging.LogRecord) -> bool:
    """uvicorn logs a client's text that is no UTF-8 like an error of its own, before it closes the socket (1007)."""
    if record.exc_info and isinstance(record.exc_info[1], UnicodeDecodeError):
        record.exc_info = None
    return True


def data_folder(path: Path) -> Path:
    """Create the folder if it is missing, check that it can be written, and return its full path."""
    try:
        path.mkdir(parents=True, exist_ok=True)
        probe = path / f".write-{os.getpid()}"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise Unavailable(
            f"The data folder {path} is not writable: {error.strerror}.",
            "Choose another folder with --data.",
            reason="data-folder",
        ) from None
    return path.resolve()
