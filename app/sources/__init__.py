"""Where frames come from: what a source is, the table of those there are, and the addresses that name one.

A source is named by an address, scheme://target?option=value&…, such as sim://ssl-div-b?lens=strong&tilt=12. Its
scheme picks the class from SOURCES; its target and options are the class's own business. To add one: write
app/sources/NAME.py with a class that follows Source, add its line to SOURCES; the laws in tests/test_sources.py then
hold for it.

read() may block, and a bad source may hang or crash: whoever shows live pictures reads each source in a process of its
own and keeps only the newest frame.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from dataclasses import field as member
from pathlib import Path
from typing import Any, ClassVar, Protocol, Self, runtime_checkable
from urllib.parse import parse_qsl, unquote, urlsplit

from app.errors import BadInput, NotFound
from app.field import Field
from app.models import Option
from app.records import Frame
from app.registry import Registry

MAX_ADDRESS = 2000  # characters


@dataclass(frozen=True)
class Surroundings:
    """What a source may need of the house; floors beside it are handed to it, not imported.

    fields: every known field by name. decode: bytes of a picture → Frame, safely. pictures: the only folder from which
    pictures are read.
    """

    fields: Mapping[str, Field] = member(default_factory=dict)
    decode: Callable[[bytes], Frame] | None = None
    pictures: Path | None = None


@runtime_checkable
class Source(Protocol):
    """One camera, or what stands in for one. Open, read as often as you like, close."""

    TITLE: ClassVar[str]
    HELP: ClassVar[str]
    TARGET: ClassVar[str]  # what stands between :// and ?, in words
    OPTIONS: ClassVar[tuple[Option, ...]]

    @classmethod
    def open(cls, target: str, options: Mapping[str, Any], around: Surroundings) -> Self:
        """Get ready to read. BadInput or NotFound if target or options make no sense, Unavailable if it is off."""

    def read(self) -> Frame:
        """The next frame, its pixels read-only; waits for it. Unavailable when there will be none."""

    def close(self) -> None:
        """Let go of everything; more than once does no harm."""

    @classmethod
    def example(cls, folder: Path) -> str:
        """An address that opens, with whatever file it names put into the pictures folder first; for tests."""


SOURCES = Registry("source", {
    "sim": "app.sources.sim.source:SimSource",       # a rendered field through a real lens model, with exact truth
    "picture": "app.sources.picture:PictureSource",  # a picture file, again and again
})


def source_from_url(url: str, around: Surroundings) -> Source:
    """Open the source that an address names."""
    scheme, target, given = split_address(url)
    source = SOURCES[scheme]
    return source.open(target, read_query(source.OPTIONS, given), around)


def split_address(url: str) -> tuple[str, str, dict[str, str]]:
    """Scheme, target and options as text; BadInput for what is no address."""
    form = "Write it as scheme://target?option=value, such as sim://ssl-div-b?lens=strong."
    if not isinstance(url, str) or len(url) > MAX_ADDRESS or not url.isprintable():
        raise BadInput("The source is no address.", form, reason="bad-source")
    try:
        parts = urlsplit(url)
        pairs = parse_qsl(parts.query, keep_blank_values=True, strict_parsing=bool(parts.query), max_num_fields=50,
                          errors="strict")
        target = unquote(parts.netloc + parts.path, errors="strict")
    except ValueError:  # also what is no UTF-8
        raise BadInput("The source is no address.", form, reason="bad-source") from None
    given = dict(pairs)
    if not parts.scheme or "://" not in url or not target or parts.fragment or len(given) < len(pairs):
        raise BadInput("The source is no address, or gives an option twice.", form, reason="bad-source")
    return parts.scheme, target, given


def read_query(described: tuple[Option, ...], given: Mapping[str, str]) -> dict[str, Any]:
    """Every described option with its given or default value, from text."""
    table = {option.name: option for option in described}
    for name in given:
        if name not in table:
            raise BadInput(f"This source has no option called {name!r}.", f"Use one of: {', '.join(table)}.",
                           reason="unknown-option")
    return {name: _read_one(option, given[name]) if name in given else option.default
            for name, option in table.items()}


def _read_one(option: Option, text: str) -> Any:
    if option.type in ("text", "choice"):
        return text if option.type == "text" else option.read(text)
    if option.type == "bool":
        return option.read({"true": True, "false": False}.get(text, text))
    try:
        number = float(text)
    except ValueError:
        number = float("nan")  # which read() refuses, saying what is allowed
    return option.read(number)


def named_field(around: Surroundings, name: str) -> Field:
    """A field by name; NotFound lists those there are."""
    try:
        return around.fields[name]
    except KeyError:
        raise NotFound(f"There is no field called {name!r}.", f"Use one of: {', '.join(around.fields)}.",
                       reason="unknown-field") from None
