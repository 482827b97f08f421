"""A call as it is written in a shell: METHOD PATH [BODY…], and many of them in a file, results used in later ones.

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
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

from touchline.cli.files import json_or_text, read_bytes
from touchline.core.errors import BadInput

METHODS = ("GET", "POST", "PUT", "PATCH", "DELETE")
IN_QUERY = ("GET", "DELETE")
MAX_BYTES = 4 << 30  # of a body: an archive; the server has its own limits
USED = re.compile(r"\$\{([A-Za-z_]\w*)((?:\.\w[\w-]*)*)\}")
NAMED = re.compile(r"([A-Za-z_]\w*)\s*=\s*(?=[A-Za-z]+\s+/)")
WITH_JSON = re.compile(r'(\w+)\s+(\S+)\s+([{\[].*?)(?:\s+>\s+([^\s"\]}]+))?')  # needs no quotes of a shell
FORM = "Write METHOD PATH [BODY…], such as GET /cameras."


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
            words, output = _words(line.strip()[named.end() if named else 0:])
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
            raise BadInput(f"No earlier call has answered {found[0]}.",
                           f"Known are: {', '.join(answers) or 'none'}.", reason="bad-call") from None
        return json.dumps(answer)[1:-1] if isinstance(answer, str) else json.dumps(answer)
    return replace(call, path=USED.sub(value, call.path), body=tuple(USED.sub(value, word) for word in call.body))


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
        raise BadInput("An entry of the body is given twice.", "Give it once, or the body as JSON.", reason="bad-call")
    if whole is not None:
        return call.path, {"json": _object(whole) | {name: json_or_text(value) for name, value in entries.items()}}
    files = {name: Path(value[1:]) for name, value in entries.items() if value.startswith("@")}
    if not files:
        return call.path, {"json": {name: json_or_text(value) for name, value in entries.items()}}
    fields = {name: value for name, value in entries.items() if name not in files}
    return call.path, {"files": {name: (path.name, read_bytes(path, MAX_BYTES)) for name, path in files.items()},
                       "data": fields or None}


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
        raise BadInput("Entries can only be added to a JSON object.", "Give the body as JSON, or entries alone.",
                       reason="bad-call")
    return value


def _entry(word: str) -> tuple[str, str]:
    name, is_entry, value = word.partition("=")
    if not is_entry or not name:
        raise BadInput(f"{word[:80]!r} is no part of a body.", "Use @FILE, -, JSON, or entries as NAME=VALUE.",
                       reason="bad-call")
    return name, value


def _content_type(body: bytes) -> str:
    """Return JSON where it is, or was meant to be: the refusal then says what is wrong with it."""
    try:
        json.loads(body)
    except (ValueError, RecursionError):
        return "application/json" if body.lstrip()[:1] in (b"{", b"[") else "application/octet-stream"
    return "application/json"
