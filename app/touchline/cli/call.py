"""call: any call of the REST interface, as it is written in a shell, in this process or to a running server.

BODY    @FILE or -            the body, from a file or from standard input
        {…} or […]            the body, as JSON; entries after it, or after a file, replace those of its object
        NAME=VALUE            an entry of a JSON body, or of the query of GET and DELETE; VALUE is JSON, else a text
        NAME=@FILE            a file that is uploaded; the other entries are then those of its form

In a file, a line:   [NAME =] METHOD PATH [BODY…] [> FILE]      ${NAME.entry.0} is what an earlier call answered
"""

import json
import re
import shlex
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any
from urllib.parse import urlencode

import typer

from touchline.cli import files
from touchline.cli.archive import ConfigOption
from touchline.cli.console import POOR, Enough, exit_below
from touchline.cli.files import json_or_text, read_bytes
from touchline.cli.progress import progress_bar
from touchline.client.client import Client
from touchline.core.errors import BadInput

METHODS = ("GET", "POST", "PUT", "PATCH", "DELETE")
IN_QUERY = ("GET", "DELETE")
MAX_BYTES = 4 << 30  # of a body: an archive; the server has its own limits
USED = re.compile(r"\$\{([A-Za-z_]\w*)((?:\.\w[\w-]*)*)\}")
NAMED = re.compile(r"([A-Za-z_]\w*)\s*=\s*(?=[A-Za-z]+\s+/)")
# needs no quotes of a shell
WITH_JSON = re.compile(r'(\w+)\s+(\S+)\s+([{\[].*?)(?:\s+>\s+([^\s"\]}]+))?')
FORM = "Write METHOD PATH [BODY…], such as GET /cameras."
TOKEN = "TOUCHLINE_TOKEN"  # also the setting of the server itself


@dataclass(frozen=True)
class Call:
    """One call. body: its words; name: under which later calls use its answer; output: the file for it."""

    method: str
    path: str
    body: tuple[str, ...] = ()
    name: str | None = None
    output: Path | None = None


def call_of(words: Sequence[str]) -> Call:
    """Read METHOD PATH [BODY…]; BadInput."""
    if len(words) < 2 or words[0].upper() not in METHODS or not words[1].startswith("/"):
        raise BadInput(f"{' '.join(words)[:80]!r} is not a call.", FORM, reason="bad-call")
    return Call(words[0].upper(), words[1], tuple(words[2:]))


def calls_of(text: str) -> list[Call]:
    """Read the lines of a file of calls; BadInput names the line. Empty lines and those with # are skipped."""
    found: list[Call] = []
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        named = NAMED.match(line.strip())
        try:
            words, output = _words(line.strip()[named.end() if named else 0 :])
            found.append(replace(call_of(words), name=named[1] if named else None, output=output))
        except (ValueError, BadInput) as error:
            raise BadInput(f"Line {number}: {error}".rstrip("."), FORM, reason="bad-call") from None
    return found


def _words(text: str) -> tuple[list[str], Path | None]:
    """Return the words of a line as a shell reads them, and the file for the answer."""
    if found := WITH_JSON.fullmatch(text):
        return [*found.groups()[:3]], None if found[4] is None else Path(found[4])
    words = shlex.split(text)
    return (words[:-2], Path(words[-1])) if len(words) > 3 and words[-2] == ">" else (words, None)


def filled(call: Call, answers: Mapping[str, Any]) -> Call:
    """Return a call with what earlier ones answered in its path and its body; BadInput where there is no such entry."""

    def value(found: re.Match[str]) -> str:
        name, entries = found[1], found[2].split(".")[1:]
        try:
            answer = answers[name]
            for entry in entries:
                answer = answer[int(entry) if isinstance(answer, list) else entry]
        except (KeyError, IndexError, ValueError, TypeError):
            raise BadInput(
                f"No earlier call has answered {found[0]}.",
                f"Known are: {', '.join(answers) or 'none'}.",
                reason="bad-call",
            ) from None
        return json.dumps(answer)[1:-1] if isinstance(answer, str) else json.dumps(answer)

    return replace(
        call,
        path=USED.sub(value, call.path),
        body=tuple(USED.sub(value, word) for word in call.body),
    )


def request_of(call: Call) -> tuple[str, dict[str, Any]]:
    """Return the path, with its query, and the body as touchline.Client.call takes it; BadInput, FileTrouble."""
    if call.method in IN_QUERY:
        query = urlencode([_entry(word) for word in call.body])
        return call.path + (("&" if "?" in call.path else "?") + query if query else ""), {}
    if not call.body:
        return call.path, {}
    whole, words = _whole(call.body[0]), call.body
    if whole is not None:
        if len(words) == 1:
            return call.path, {"content": whole, "headers": {"Content-Type": _content_type(whole)}}
        words = words[1:]
    entries = dict(_entry(word) for word in words)
    if len(entries) < len(words):
        raise BadInput(
            "An entry of the body is given twice.",
            "Give it once, or the body as JSON.",
            reason="bad-call",
        )
    if whole is not None:
        return call.path, {
            "json": _object(whole) | {name: json_or_text(value) for name, value in entries.items()}
        }
    files = {name: Path(value[1:]) for name, value in entries.items() if value.startswith("@")}
    if not files:
        return call.path, {"json": {name: json_or_text(value) for name, value in entries.items()}}
    fields = {name: value for name, value in entries.items() if name not in files}
    return call.path, {
        "files": {name: (path.name, read_bytes(path, MAX_BYTES)) for name, path in files.items()},
        "data": fields or None,
    }


def _whole(word: str) -> bytes | None:
    """Return the body that one word is by itself; None for an entry."""
    if word == "-":
        return sys.stdin.buffer.read()
    if word.startswith("@"):
        return read_bytes(Path(word[1:]), MAX_BYTES)
    return word.encode() if word.startswith(("{", "[")) else None


def _object(body: bytes) -> dict[str, Any]:
    """Read the JSON object to which entries are added."""
    try:
        value = json.loads(body)
    except (ValueError, RecursionError):
        value = None
    if not isinstance(value, dict):
        raise BadInput(
            "Entries can only be added to a JSON object.",
            "Give the body as JSON, or entries alone.",
            reason="bad-call",
        )
    return value


def _entry(word: str) -> tuple[str, str]:
    name, is_entry, value = word.partition("=")
    if not is_entry or not name:
        raise BadInput(
            f"{word[:80]!r} is no part of a body.",
            "Use @FILE, -, JSON, or entries as NAME=VALUE.",
            reason="bad-call",
        )
    return name, value


def _content_type(body: bytes) -> str:
    """Return JSON where it is, or was meant to be: the refusal then says what is wrong with it."""
    try:
        json.loads(body)
    except (ValueError, RecursionError):
        return (
            "application/json" if body.lstrip()[:1] in (b"{", b"[") else "application/octet-stream"
        )
    return "application/json"


def call(
    words: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="METHOD PATH [BODY…]",
            help="Such as GET /cameras. Body: "
            "@FILE, - for standard input, JSON, or entries NAME=VALUE; "
            "NAME=@FILE uploads a file.",
        ),
    ] = None,
    calls: Annotated[
        Path | None,
        typer.Option(
            "--calls",
            metavar="FILE",
            help="Many calls, one a line, - for standard "
            "input. ${NAME.entry} is what the line NAME = … answered.",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "--output",
            "-o",
            metavar="FILE",
            help="The file for the answer. By default standard output.",
        ),
    ] = None,
    server: Annotated[
        str | None,
        typer.Option(
            "--server", metavar="URL", help="A running server, such as http://127.0.0.1:8000."
        ),
    ] = None,
    token: Annotated[
        str | None, typer.Option("--token", envvar=TOKEN, help="Its access token.")
    ] = None,
    data: Annotated[
        Path | None,
        typer.Option(
            "--data",
            metavar="DIR",
            help="Without --server: the data folder, of a server that is not running.",
        ),
    ] = None,
    temporary: Annotated[
        bool,
        typer.Option(
            "--temporary", help="Without --server: an empty data folder, removed at the end."
        ),
    ] = False,
    config: ConfigOption = None,
    header: Annotated[
        list[str] | None,
        typer.Option(
            "--header",
            metavar="NAME:VALUE",
            help="Header of the request, such as If-Match. May be repeated.",
        ),
    ] = None,
    wait: Annotated[
        bool,
        typer.Option(
            "--wait/--no-wait", help="Wait for the job that a call starts, and answer its result."
        ),
    ] = True,
    enough: Annotated[
        Enough | None,
        typer.Option(
            "--enough", help=f"Exit code {POOR} unless the answer has a verdict of at least this."
        ),
    ] = None,
) -> None:
    """Make calls of the REST interface, in this process or to a running server."""
    if sum((server is not None, data is not None, temporary)) > 1 or (
        server is not None and config is not None
    ):
        raise typer.BadParameter(
            "--server has its own data folder and settings",
            param_hint="--server, --data, --temporary",
        )
    headers = dict(_header(text) for text in header or [])
    if words and calls is None:
        listed = [call_of(words)]
    elif calls is not None and not words:
        listed = calls_of(_text(calls))
    else:
        raise typer.BadParameter("give one call, or --calls FILE", param_hint="METHOD PATH")
    answers: dict[str, Any] = {}
    level: str | None = None
    client = (
        Client.temporary(config=config)
        if temporary
        else Client(server, token=token, data=data, config=config)
    )
    with client:
        for number, one in enumerate(listed):
            is_last = number == len(listed) - 1
            answer = _make(
                client,
                filled(one, answers),
                headers,
                wait,
                one.output or (output if is_last else None),
                is_shown=one.name is None or (is_last and output is not None),
            )
            level = _level(answer) or level
            if one.name is not None:
                answers[one.name] = answer
    if enough is not None:
        exit_below(enough, level)


def _make(
    client: Client,
    one: Call,
    headers: dict[str, str],
    wait: bool,
    output: Path | None,
    is_shown: bool,
) -> Any:
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
            raise BadInput(
                "The answer is no text.", "Write it to a file with --out FILE.", reason="bad-call"
            )
        sys.stdout.buffer.write(piece)
    sys.stdout.flush()


def _text(calls: Path) -> str:
    return (
        sys.stdin.read()
        if str(calls) == "-"
        else files.read_bytes(calls).decode("utf-8", "replace")
    )


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
