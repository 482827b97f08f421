"""call: any call of the REST interface, by the application in this process or by a running server."""

import json
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Annotated, Any

import typer

from touchline.cli import files
from touchline.cli.archive import ConfigOption
from touchline.cli.call_lines import Call, call_of, calls_of, filled, request_of
from touchline.cli.console import POOR, Enough, exit_below
from touchline.cli.progress import progress_bar
from touchline.client.client import Client
from touchline.core.errors import BadInput

TOKEN = "TOUCHLINE_TOKEN"  # also the setting of the server itself


def call(
    words: Annotated[list[str] | None, typer.Argument(metavar="METHOD PATH [BODY…]", help="Such as GET /cameras. Body: "
                                                      "@FILE, - for standard input, JSON, or entries NAME=VALUE; "
                                                      "NAME=@FILE uploads a file.")] = None,
    calls: Annotated[Path | None, typer.Option("--calls", metavar="FILE", help="Many calls, one a line, - for standard "
                                               "input. ${NAME.entry} is what the line NAME = … answered.")] = None,
    output: Annotated[Path | None, typer.Option("--out", "--output", "-o", metavar="FILE", help="The file for the "
                                                "answer. By default standard output.")] = None,
    server: Annotated[str | None, typer.Option("--server", metavar="URL", help="A running server, such as "
                                               "http://127.0.0.1:8000.")] = None,
    token: Annotated[str | None, typer.Option("--token", envvar=TOKEN, help="Its access token.")] = None,
    data: Annotated[Path | None, typer.Option("--data", metavar="DIR", help="Without --server: the data folder, of a "
                                              "server that is not running.")] = None,
    temporary: Annotated[bool, typer.Option("--temporary", help="Without --server: an empty data folder, removed at "
                                            "the end.")] = False,
    config: ConfigOption = None,
    header: Annotated[list[str] | None, typer.Option("--header", metavar="NAME:VALUE", help="Header of the request, "
                                                     "such as If-Match. May be repeated.")] = None,
    wait: Annotated[bool, typer.Option("--wait/--no-wait", help="Wait for the job that a call starts, and answer its "
                                       "result.")] = True,
    enough: Annotated[Enough | None, typer.Option("--enough", help=f"Exit code {POOR} unless the answer has a verdict "
                                                  "of at least this.")] = None,
) -> None:
    """Make calls of the REST interface, in this process or to a running server."""
    if sum((server is not None, data is not None, temporary)) > 1 or (server is not None and config is not None):
        raise typer.BadParameter("--server has its own data folder and settings", param_hint="--server, --data, "
                                                                                             "--temporary")
    headers = dict(_header(text) for text in header or [])
    if words and calls is None:
        listed = [call_of(words)]
    elif calls is not None and not words:
        listed = calls_of(_text(calls))
    else:
        raise typer.BadParameter("give one call, or --calls FILE", param_hint="METHOD PATH")
    answers: dict[str, Any] = {}
    level: str | None = None
    client = Client.temporary(config=config) if temporary else Client(server, token=token, data=data, config=config)
    with client:
        for number, one in enumerate(listed):
            is_last = number == len(listed) - 1
            answer = _make(client, filled(one, answers), headers, wait, one.output or (output if is_last else None),
                           is_shown=one.name is None or (is_last and output is not None))
            level = _level(answer) or level
            if one.name is not None:
                answers[one.name] = answer
    if enough is not None:
        exit_below(enough, level)


def _make(client: Client, one: Call, headers: dict[str, str], wait: bool, output: Path | None, is_shown: bool) -> Any:
    """Make one call, wait for its job and write what it answers; return that where it is JSON."""
    path, body = request_of(one)
    body["headers"] = {**body.get("headers", {}), **headers}
    with closing(client.call(one.method, path, **body, stream=True)) as response:
        if "json" not in response.headers.get("content-type", ""):
            if is_shown or output is not None:
                _write(output, response.iter_bytes())
            return None
        text = response.read()
        answer = json.loads(text)
    if response.status_code == 202 and wait and "/jobs/" in response.headers.get("location", ""):
        with progress_bar("Waiting") as progress:
            answer = client.wait(answer, progress)
        text = json.dumps(answer, ensure_ascii=False, indent=1).encode("utf-8", "replace")
    if output is not None:
        files.write_bytes(output, text)
    elif is_shown:
        print(json.dumps(answer, indent=1 if sys.stdout.isatty() else None))
    return answer


def _write(output: Path | None, pieces: Iterator[bytes]) -> None:
    """Write what is no JSON: to a file, whole or not at all, or to standard output as it comes."""
    if output is not None:
        files.write_bytes(output, b"".join(pieces))
        return
    for piece in pieces:
        if b"\0" in piece and sys.stdout.isatty():
            raise BadInput("The answer is no text.", "Write it to a file with --out FILE.", reason="bad-call")
        sys.stdout.buffer.write(piece)
    sys.stdout.flush()


def _text(calls: Path) -> str:
    return sys.stdin.read() if str(calls) == "-" else files.read_bytes(calls).decode("utf-8", "replace")


def _header(text: str) -> tuple[str, str]:
    name, is_header, value = text.partition(":")
    if not is_header or not name.strip():
        raise typer.BadParameter(f"{text!r} is not NAME:VALUE", param_hint="--header")
    return name.strip(), value.strip()


def _level(answer: Any) -> str | None:
    """Return the level of an answer's verdict, or of its report's; None where it has none."""
    for holder in (answer, answer.get("report") if isinstance(answer, dict) else None):
        verdict = holder.get("verdict") if isinstance(holder, dict) else None
        if isinstance(verdict, dict) and isinstance(verdict.get("level"), str):
            return verdict["level"]
    return None
