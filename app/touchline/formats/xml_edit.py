"""Change single texts of an XML file: every byte outside them, comments and spaces among them, remains as it is.

For files of VarTypes, whose elements are called by their attribute `name`. The file is to have been read before, by
document.parse(), with its limits: an element's place is found here, its content is not judged.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat
from xml.sax.saxutils import escape

from touchline.core.errors import BadInput
from touchline.formats.numbers import format_error

UTF8_MARK = b"\xef\xbb\xbf"
TAG = re.compile(rb"""<[^\s/>]+(?:\s+[^\s=]+\s*=\s*(?:"[^"]*"|'[^']*'))*\s*/?>""")
BEFORE_TEXT = re.compile(rb"(?:\s|<!--.*?-->)*", re.DOTALL)
SPACE = b" \t\r\n"
NAME = "name"


@dataclass
class Element:
    """One element: bytes begin to after, of which inside to end are its content. line_break: with its indentation."""

    name: str
    attributes: dict[str, str]
    begin: int
    inside: int
    is_closed: bool  # <a/>
    line_break: bytes
    end: int = 0
    after: int = 0
    children: list["Element"] = field(default_factory=list)

    def all(self, name: str) -> list["Element"]:
        return [child for child in self.children if child.name == name]

    def child(self, *names: str) -> "Element | None":
        """Return the first element at a path below this one."""
        found: Element | None = self
        for name in names:
            found = next(iter(found.all(name)), None) if found is not None else None
        return found

    def below(self) -> Iterator["Element"]:
        for child in self.children:
            yield child
            yield from child.below()


class XmlEdit:
    """A file's elements, and its changes until now. Changes must not overlap.

    BadInput for a file whose bytes are not those that its reader sees.
    """

    def __init__(self, data: bytes) -> None:
        self._mark = UTF8_MARK if data.startswith(UTF8_MARK) else b""
        self._data = data.removeprefix(UTF8_MARK)
        if self._data[:2] in (b"\xff\xfe", b"\xfe\xff") or b"<![CDATA[" in self._data:
            raise _not_utf8()
        self._changes: list[tuple[int, int, bytes]] = []
        self.root = self._read()

    def _read(self) -> Element:
        parser = expat.ParserCreate("UTF-8")
        open_: list[Element] = []
        roots: list[Element] = []

        def start(tag: str, attributes: dict[str, str]) -> None:
            at = parser.CurrentByteIndex
            found = TAG.match(self._data, at)
            assert found is not None  # of a file that expat reads
            blank = at
            while blank > 0 and self._data[blank - 1] in SPACE:
                blank -= 1
            name, is_closed = attributes.get(NAME, tag), found[0].endswith(b"/>")
            line_break = self._data[blank:at]
            open_.append(Element(name, attributes, at, found.end(), is_closed, line_break))

        def end(_: str) -> None:
            element = open_.pop()
            element.end = element.after = element.inside
            if not element.is_closed:
                element.end = parser.CurrentByteIndex
                element.after = self._data.index(b">", element.end) + 1
            (open_[-1].children if open_ else roots).append(element)

        parser.StartElementHandler, parser.EndElementHandler = start, end
        try:
            parser.Parse(self._data, True)
        except expat.ExpatError:  # in another encoding
            raise _not_utf8() from None
        return roots[0]

    def text(self, element: Element) -> str:
        """Return an element's own text, without that of its children and without comments."""
        return self._leaf(element)[2].decode()

    def set_text(self, element: Element, text: str) -> None:
        """Replace an element's own text; its children, comments and the spaces around it remain."""
        before, after, _ = self._leaf(element)
        given = escape(text).encode()
        if element.is_closed:
            self.set_content(element, given)
        else:
            self._changes.append((before, after, given))

    def _leaf(self, element: Element) -> tuple[int, int, bytes]:
        before = BEFORE_TEXT.match(self._data, element.inside, element.end)
        assert before is not None  # it matches nothing as well
        after = self._data.find(b"<", before.end(), element.end)
        text = self._data[before.end() : element.end if after < 0 else after].rstrip(SPACE)
        return before.end(), before.end() + len(text), text

    def set_content(self, element: Element, content: bytes) -> None:
        """Give an element without content its first."""
        if element.is_closed:
            tag = re.match(rb"<([^\s/>]+)", self._data[element.begin : element.inside])
            assert tag is not None
            slash = self._data.rindex(b"/", element.begin, element.inside)
            content = b">" + content + b"</" + tag[1] + b">"
            self._changes.append((slash, element.inside, content))
        else:
            self._changes.append((element.inside, element.end, content))

    def append(self, parent: Element, elements: list[bytes]) -> None:
        """Append elements to a list, each with its line break; nothing where there are none."""
        if not elements:
            return
        content = b"".join(elements)
        if parent.children:
            after = parent.children[-1].after
            self._changes.append((after, after, content))
        else:
            self.set_content(parent, content + parent.line_break)

    def remove(self, element: Element) -> None:
        """Remove an element and the spaces before it."""
        self._changes.append((element.begin - len(element.line_break), element.after, b""))

    def result(self) -> bytes:
        """Return the file with all changes."""
        parts, at = [self._mark], 0
        for begin, end, content in sorted(self._changes):
            parts += [self._data[at:begin], content]
            at = end
        return b"".join([*parts, self._data[at:]])


def _not_utf8() -> BadInput:
    return format_error(
        "The file is not in UTF-8, or it has CDATA sections. No setting was replaced.",
        "Save it in UTF-8, as ssl-vision does.",
    )
