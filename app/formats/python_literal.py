"""Parse an untrusted Python literal: dictionaries, lists, texts and numbers, and nothing that could run.

ast.literal_eval would do it, but ends the whole process where brackets are nested a hundred thousand deep.
"""

import re
from typing import Any

from app.formats.numbers import format_error

MAX_BYTES = 4 << 20  # mrcal keeps what it solved inside its files
MAX_DEPTH = 12
MAX_TOKENS = 50_000  # a quarter of a second; splined lenses have thousands, the lenses that we read a dozen
TOKEN = re.compile(r"""(?P<space>[ \t\r\n]+|\#[^\n]*)|(?P<mark>[][(){},:])|b?(?P<text>'[^'\\\n]*'|"[^"\\\n]*")
                       |(?P<word>[^][(){},:'"\#\s]+)""", re.VERBOSE)
CLOSING = {"{": "}", "[": "]", "(": ")"}


def literal(data: bytes, what: str) -> Any:
    """Return the value: dict, list (of tuples as well), str, float, or the words None, True and False as they stand."""
    if len(data) > MAX_BYTES:
        raise format_error(f"{what} has {len(data)} bytes. The limit is {MAX_BYTES}.", "Use a shorter file.")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise format_error(f"{what} is not text.", "Use the original file.") from None
    reader = _Reader(text, what)
    value = reader.value(0)
    if reader.kind != "end":
        raise reader.wrong()
    return value


class _Reader:
    """A parser with one token of lookahead."""

    def __init__(self, text: str, what: str) -> None:
        self._text, self._what, self._at, self._left = text, what, 0, MAX_TOKENS
        self.advance()

    def advance(self) -> None:
        self.kind, self.token = "end", ""
        while self._at < len(self._text):
            found = TOKEN.match(self._text, self._at)
            self._left -= 1
            if self._left < 0:
                raise format_error(f"{self._what} has more than {MAX_TOKENS} parts.", "Use a shorter file.")
            if found is None:
                raise self.wrong()
            self._at = found.end()
            if found.lastgroup != "space":
                self.kind, self.token = found.lastgroup or "", found[found.lastgroup or 0]
                return

    def value(self, depth: int) -> Any:
        kind, token = self.kind, self.token
        if depth > MAX_DEPTH:
            raise format_error(f"{self._what} has more than {MAX_DEPTH} levels.", "Use fewer levels.")
        if kind == "mark" and token in CLOSING:
            self.advance()
            return self._mapping(depth) if token == "{" else self._list(CLOSING[token], depth)
        if kind not in ("text", "word"):
            raise self.wrong()
        self.advance()
        return token[1:-1] if kind == "text" else token

    def _list(self, closing: str, depth: int) -> list[Any]:
        found = []
        while self.token != closing or self.kind != "mark":
            found.append(self.value(depth + 1))
            self._comma_unless(closing)
        self.advance()
        return found

    def _mapping(self, depth: int) -> dict[str, Any]:
        found: dict[str, Any] = {}
        while self.token != "}" or self.kind != "mark":
            if self.kind != "text" or self.token[1:-1] in found:
                raise self.wrong()
            key = self.token[1:-1]
            self.advance()
            self._expect(":")
            found[key] = self.value(depth + 1)
            self._comma_unless("}")
        self.advance()
        return found

    def _comma_unless(self, closing: str) -> None:
        if not (self.kind == "mark" and self.token == closing):
            self._expect(",")

    def _expect(self, mark: str) -> None:
        if self.kind != "mark" or self.token != mark:
            raise self.wrong()
        self.advance()

    def wrong(self) -> Exception:
        line = self._text.count("\n", 0, min(self._at, len(self._text))) + 1
        return format_error(f"{self._what} cannot be read (line {line}).",
                            "Use the original file.")
