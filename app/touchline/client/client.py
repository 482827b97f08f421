"""Client: each common step of a script as one method, `call` for all others, to a server or in this process."""

import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal, Self, cast
from urllib.parse import quote

import httpx2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from touchline.client.answers import Calibration, Job, Snapshot
from touchline.core.errors import BadInput, Cancelled, NotFound, TouchlineError, Unavailable
from touchline.core.jobs import Progress, error_of, no_progress

HERE = "http://127.0.0.1"  # what the application is asked as, where there is no server
# a call that fits or compares while its caller waits may take a minute
TIMEOUT = httpx2.Timeout(120.0, connect=10.0)
API = "/api/v1"

# little-endian float64 pairs, as transform takes and answers them
POINTS = "application/octet-stream"
POLL_S = 0.05  # of a job that has just begun; each look waits a little longer
MAX_POLL_S = 1.0
SLOWER = 1.3


@contextmanager
def to_server(url: str, token: str | None = None) -> Iterator[httpx2.Client]:
    """Connect to a running server. url: such as http://127.0.0.1:8000, or its /api/v1. token: its access token."""
    try:
        address = httpx2.URL(url.rstrip("/").removesuffix("/api/v1"))
    except httpx2.InvalidURL:
        address = httpx2.URL("")
    if address.scheme not in ("http", "https") or not address.host:
        raise BadInput(
            f"{url!r} is not the address of a server.",
            "Enter it as http://127.0.0.1:8000.",
            reason="bad-address",
        )
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
    with TestClient(
        create_app(settings, serves=False),
        base_url=HERE,
        headers=_authorised(token),
        raise_server_exceptions=False,
        client=("127.0.0.1", 0),
    ) as http:
        yield http


@contextmanager
def in_temporary_folder(config: Path | None = None) -> Iterator[httpx2.Client]:
    """Start the application in this process with an empty data folder, which is removed at the end."""
    with (
        TemporaryDirectory(prefix="touchline-") as folder,
        in_process(Path(folder), config) as http,
    ):
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
        raise Unavailable(
            f"{request.url} did not answer in time.",
            "Check the server, then try again.",
            reason="network",
        ) from None
    except httpx2.TransportError as error:
        raise Unavailable(
            f"{request.url.copy_with(path='/', query=None)} does not answer: {error}.",
            "Start the server with touchline serve, or check its address.",
            reason="network",
        ) from None
    raise problem_in(response)


def problem_in(response: httpx2.Response) -> TouchlineError:
    """Return the error that a refusal stands for."""
    try:
        problem = response.json()
    except ValueError:
        problem = None
    # something between us and the server answered
    if not isinstance(problem, Mapping) or "detail" not in problem:
        return Unavailable(
            f"{response.url} answered {response.status_code} {response.reason_phrase}.",
            "Check that this is the address of a Touchline server.",
            reason="network",
        )
    return error_of(_with_reason(problem))


def _with_reason(problem: Mapping[str, Any]) -> dict[str, Any]:
    """Return a problem with its reason, which is the last part of its type."""
    kind = str(problem.get("type", "")).rpartition("/")[2]
    return {
        **{name: value for name, value in problem.items() if name != "type"},
        "reason": kind or "refused",
    }


def error_of_job(problem: Mapping[str, Any]) -> TouchlineError:
    """Return the error with which a job has failed."""
    return error_of(_with_reason(problem))


def _authorised(token: str | None) -> dict[str, str]:
    return {"Authorization": f"Bearer {token}"} if token else {}


Frame = Literal["image", "corrected", "field"]


class Client:
    """Touchline for a script: a running server by its address, or the application inside this process.

    Client("http://127.0.0.1:8000", token=…) asks a server. Client(data=FOLDER) opens a data folder that no server uses,
    and Client.temporary() an empty one that is removed at the end. Close it, or use it in a with statement.

    Every refusal is raised as a TouchlineError with `what`, `fix` and `reason`; without a server, Unavailable.
    operator: who is to stand behind what is saved.
    """

    def __init__(
        self,
        server: str | None = None,
        *,
        token: str | None = None,
        data: Path | str | None = None,
        config: Path | str | None = None,
        operator: str | None = None,
    ) -> None:
        if server is not None and (data is not None or config is not None):
            raise BadInput(
                "A server has its own data folder and settings.",
                "Give either a server, or a data folder and settings.",
                reason="bad-request",
            )
        self._connect(
            to_server(server, token)
            if server is not None
            else in_process(
                None if data is None else Path(data), None if config is None else Path(config)
            ),
            operator,
        )

    @classmethod
    def temporary(cls, *, config: Path | str | None = None, operator: str | None = None) -> Self:
        """Return a client of the application inside this process, whose data folder is removed at the end."""
        client = cls.__new__(cls)
        client._connect(in_temporary_folder(None if config is None else Path(config)), operator)
        return client

    def _connect(self, opened: Any, operator: str | None) -> None:
        self._stack = ExitStack()
        self._http: httpx2.Client = self._stack.enter_context(opened)
        if operator is not None:
            self._http.headers["X-Operator"] = operator.encode("latin-1", "replace").decode(
                "latin-1"
            )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the connection, or the application in this process; jobs that it has not finished go on at a server."""
        self._stack.close()

    # --- any call

    def call(
        self,
        method: str,
        path: str,
        *,
        json: Any = None,
        params: Mapping[str, Any] | None = None,
        files: Mapping[str, tuple[str, bytes]] | None = None,
        data: Mapping[str, str] | None = None,
        content: bytes | None = None,
        headers: Mapping[str, str] | None = None,
        stream: bool = False,
    ) -> httpx2.Response:
        """Make one call and return the response; a TouchlineError for every refusal.

        path: with or without /api/v1, as "/cameras". Of the body one is given: json; content, as it is; or files as
        {name: (file name, bytes)} with data, the other fields of their form. stream: the answer is read piece by piece,
        by iter_bytes(), and the caller closes it.
        """
        given = {
            "json": json,
            "params": params,
            "files": files,
            "data": data,
            "content": content,
            "headers": headers,
        }
        full = path if path.startswith(f"{API}/") else f"{API}/{path.lstrip('/')}"
        request = self._http.build_request(
            method.upper(),
            full,
            **{name: value for name, value in given.items() if value is not None},
        )
        return send(self._http, request, stream)

    def items(self, path: str, **params: Any) -> Iterator[dict[str, Any]]:
        """Yield what a list holds, newest first, page by page: items("/calibrations", camera="north")."""
        while True:
            page = self.call("GET", path, params=params).json()
            yield from page["items"]
            if page.get("next_cursor") is None:
                return
            params = {**params, "cursor": page["next_cursor"]}

    # --- from an image to millimetres

    def upload(self, image: Path | str | bytes, *, camera: str | None = None) -> Snapshot:
        """Save an image, PNG, JPEG, BMP or WebP, as a file's path or as its bytes. camera: the one that took it."""
        answer = self.call(
            "POST",
            "/snapshots",
            files={"file": _file_of(image)},
            data=None if camera is None else {"camera": camera},
        )
        return cast(Snapshot, answer.json())

    def auto(self, snapshot: Snapshot | str, **request: Any) -> Job:
        """Start the search for the field's lines in an image; its result has the version under `calibration`.

        request: further entries of POST /calibrations/auto, as field, region, model, options, note. Without them the
        image decides. `wait` waits for the job.
        """
        return cast(
            Job,
            self.call(
                "POST", "/calibrations/auto", json={"snapshot": _id(snapshot), **request}
            ).json(),
        )

    def calibrate(
        self, snapshot: Snapshot | str, observations: list[Any], **request: Any
    ) -> Calibration:
        """Fit a model to observations in an image, and save it.

        request: field, region, rotate, model, options, note, as POST /calibrations takes them.
        """
        body = {"snapshot": _id(snapshot), "observations": observations, **request}
        return self.calibration(
            self.wait(
                cast(
                    Job,
                    self.call("POST", "/calibrations", params={"job": "true"}, json=body).json(),
                )
            )["calibration"]
        )

    def calibration(self, id: str) -> Calibration:
        """Return a version by its id."""
        return cast(Calibration, self.call("GET", f"/calibrations/{_path(id)}").json())

    def wait(
        self, job: Job | str, progress: Progress = no_progress, timeout_s: float | None = None
    ) -> Any:
        """Wait for a job and return its result; raise the problem that it failed with.

        progress: called with the finished share, 0 to 1, and a message, after each change. Ctrl-C, and whatever
        progress raises, cancels the job. timeout_s: Unavailable after so long; the job goes on.
        """
        id, delay_s, end_s = (
            _id(job),
            POLL_S,
            None if timeout_s is None else time.monotonic() + timeout_s,
        )
        reported: tuple[float, str] | None = None
        try:
            while True:
                now = cast(Job, self.call("GET", f"/jobs/{_path(id)}").json())
                if now["state"] not in ("queued", "running"):
                    break
                if reported != (news := (now["progress"], now["message"])):
                    reported = news
                    progress(*news)
                if end_s is not None and time.monotonic() > end_s:
                    raise Unavailable(
                        f"The job {id} is still {now['state']} after {timeout_s:g} s.",
                        "Wait for it again, or cancel it.",
                        reason="still-running",
                    )
                time.sleep(delay_s)
                delay_s = min(MAX_POLL_S, SLOWER * delay_s)
        except (Unavailable, NotFound):  # nobody answers, or it is still running: it goes on
            raise
        except BaseException:
            self.cancel(id)
            raise
        if now["problem"] is not None:
            raise error_of_job(now["problem"])
        if now["state"] != "done":
            raise Cancelled(f"The job {id} was cancelled.", "Start it again.")
        return now["result"]

    def cancel(self, job: Job | str) -> None:
        """Cancel a job; one that has ended stays as it is."""
        self.call("DELETE", f"/jobs/{_path(_id(job))}")

    def transform(
        self,
        calibration: Calibration | str,
        points: ArrayLike,
        source: Frame = "image",
        target: Frame = "field",
        z_mm: float = 0.0,
    ) -> NDArray[np.float64]:
        """Convert points from one frame to another, any number of them.

        points: (…, 2), px of the raw or of the corrected image, or mm from the field's centre. z_mm: the height above
        the carpet. Returns the same shape, NaN where a point is out of reach.
        """
        given = np.asarray(points, "<f8")
        if given.ndim == 0 or given.shape[-1] != 2:
            raise BadInput(
                f"The points have the shape {given.shape}.",
                "Give them as an array of shape (…, 2).",
                reason="bad-points",
            )
        answer = self.call(
            "POST",
            f"/calibrations/{_path(_id(calibration))}/transform",
            content=given.tobytes(),
            params={"from": source, "to": target, "z_mm": z_mm},
            headers={"Content-Type": POINTS},
        )
        return np.frombuffer(answer.content, "<f8").reshape(given.shape).copy()

    def correct(
        self,
        calibration: Calibration | str,
        image: Path | str | bytes,
        *,
        format: Literal["png", "jpg"] = "png",
        margin_px: int = 0,
        width: int | None = None,
    ) -> bytes:
        """Return an image corrected, as PNG or JPEG bytes. image: a file's path or its bytes.

        margin_px: carpet shown around the region. width: of the result, px; its natural one where it is None.
        """
        params = {
            "format": format,
            "margin_px": margin_px,
            **({} if width is None else {"width": width}),
        }
        return self.call(
            "POST",
            f"/calibrations/{_path(_id(calibration))}/correct",
            params=params,
            files={"file": _file_of(image)},
        ).content

    def export(
        self,
        calibration: Calibration | str,
        format: str = "json",
        *,
        approximate: bool = False,
        camera_id: int | None = None,
    ) -> bytes:
        """Return a calibration as a file of that format, such as "json", "opencv" or "npz".

        approximate: as the nearest that the format can hold. camera_id: its number, in a format that has one.
        """
        params = {
            "approximate": approximate,
            **({} if camera_id is None else {"camera_id": camera_id}),
        }
        return self.call(
            "GET", f"/calibrations/{_path(_id(calibration))}/export/{_path(format)}", params=params
        ).content


def _file_of(image: Path | str | bytes) -> tuple[str, bytes]:
    """Return an image's file name and bytes."""
    return (
        ("image", image)
        if isinstance(image, bytes)
        else (Path(image).name, Path(image).read_bytes())
    )


def _id(record: Mapping[str, Any] | str) -> str:
    return record if isinstance(record, str) else str(record["id"])


def _path(id: str) -> str:
    """Return an id as a part of a path."""
    return quote(id, safe="")
