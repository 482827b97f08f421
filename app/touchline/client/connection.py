"""Where a client's requests go: to a server, or into the application inside this process, without server or port."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import httpx2

from touchline.core.errors import BadInput, TouchlineError, Unavailable
from touchline.core.jobs import error_of

HERE = "http://127.0.0.1"  # what the application is asked as, where there is no server
TIMEOUT = httpx2.Timeout(120.0, connect=10.0)  # a call that fits or compares while its caller waits may take a minute


@contextmanager
def to_server(url: str, token: str | None = None) -> Iterator[httpx2.Client]:
    """Connect to a running server. url: such as http://127.0.0.1:8000, or its /api/v1. token: its access token."""
    try:
        address = httpx2.URL(url.rstrip("/").removesuffix("/api/v1"))
    except httpx2.InvalidURL:
        address = httpx2.URL("")
    if address.scheme not in ("http", "https") or not address.host:
        raise BadInput(f"{url!r} is not the address of a server.", "Enter it as http://127.0.0.1:8000.",
                       reason="bad-address")
    with httpx2.Client(base_url=address, headers=_authorised(token), timeout=TIMEOUT) as http:
        yield http


@contextmanager
def in_process(data: Path | None = None, config: Path | None = None) -> Iterator[httpx2.Client]:
    """Start the application in this process, and end it. Conflict where a server uses that data folder.

    data: the data folder; that of the settings where it is None. Cameras sleep until a call asks for them; nothing is
    sent to the league's network or heard from it.
    """
    from starlette.testclient import TestClient

    from touchline.main import create_app
    from touchline.settings import load_settings

    settings = load_settings(config, data=data)
    token = settings.token.get_secret_value() if settings.token else None
    with TestClient(create_app(settings, serves=False), base_url=HERE, headers=_authorised(token),
                    raise_server_exceptions=False, client=("127.0.0.1", 0)) as http:
        yield http


@contextmanager
def in_temporary_folder(config: Path | None = None) -> Iterator[httpx2.Client]:
    """Start the application in this process with an empty data folder, which is removed at the end."""
    with TemporaryDirectory(prefix="touchline-") as folder, in_process(Path(folder), config) as http:
        yield http


def send(http: httpx2.Client, request: httpx2.Request, stream: bool = False) -> httpx2.Response:
    """Send a request; raise what its problem says, and Unavailable where nobody answers.

    stream: whether the body is left to be read by the caller, who closes the response then.
    """
    try:
        response = http.send(request, stream=stream)
        if response.is_success:
            return response
        response.read()
    except httpx2.TimeoutException:
        raise Unavailable(f"{request.url} did not answer in time.", "Check the server, then try again.",
                          reason="network") from None
    except httpx2.TransportError as error:
        raise Unavailable(f"{request.url.copy_with(path='/', query=None)} does not answer: {error}.",
                          "Start the server with touchline serve, or check its address.", reason="network") from None
    raise problem_in(response)


def problem_in(response: httpx2.Response) -> TouchlineError:
    """Return the error that a refusal stands for."""
    try:
        problem = response.json()
    except ValueError:
        problem = None
    if not isinstance(problem, Mapping) or "detail" not in problem:  # something between us and the server answered
        return Unavailable(f"{response.url} answered {response.status_code} {response.reason_phrase}.",
                           "Check that this is the address of a Touchline server.", reason="network")
    return error_of(_with_reason(problem))


def _with_reason(problem: Mapping[str, Any]) -> dict[str, Any]:
    """Return a problem with its reason, which is the last part of its type."""
    kind = str(problem.get("type", "")).rpartition("/")[2]
    return {**{name: value for name, value in problem.items() if name != "type"}, "reason": kind or "refused"}


def error_of_job(problem: Mapping[str, Any]) -> TouchlineError:
    """Return the error with which a job has failed."""
    return error_of(_with_reason(problem))


def _authorised(token: str | None) -> dict[str, str]:
    return {"Authorization": f"Bearer {token}"} if token else {}
