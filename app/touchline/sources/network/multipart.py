"""Parse multipart/x-mixed-replace: bytes in, parts out, whatever lies between them.

Each part is --boundary, header lines, an empty line, a picture. Some cameras write the boundary with two dashes more
or fewer than they announce, some leave the length out, some get it wrong.
"""

import re
from collections.abc import Iterator

MAX_PART = 8_000_000  # bytes; a camera's JPEG of 50 megapixels has fewer
MAX_HEAD = 16 * 1024
LENGTH = re.compile(rb"^content-length\s*:\s*(\d{1,12})\s*$", re.IGNORECASE | re.MULTILINE)
BOUNDARY = re.compile(r'boundary\s*=\s*(?:"([^"]{1,200})"|([^\s;,"]{1,200}))', re.IGNORECASE)


class PartTooLarge(Exception):
    """A part, or what stands where one should begin, is larger than any picture."""


def boundary_of(content_type: str) -> bytes | None:
    """Return a Content-Type's boundary without leading dashes; None where it is no multipart."""
    if not content_type.lower().lstrip().startswith("multipart/"):
        return None
    found = BOUNDARY.search(content_type)
    named = (found[1] or found[2]).strip().lstrip("-") if found else ""
    return named.encode("latin-1", "replace") or None


class MultipartParser:
    """feed() takes bytes and yields each part's content once it is whole."""

    def __init__(self, boundary: bytes) -> None:
        self._mark = b"--" + boundary
        self._data = bytearray()
        self._looked = 0  # so far no mark has been found
        self._in_part = False
        self._length: int | None = None

    def feed(self, data: bytes) -> Iterator[bytes]:
        """Yield the parts that are whole now. PartTooLarge where one grows beyond MAX_PART."""
        self._data += data
        while (part := self._next()) is not None:
            yield part

    def pending_jpeg(self) -> bytes | None:
        """Return the part so far, if it has no stated length and ends as a JPEG does: it may be whole."""
        if not self._in_part or self._length is not None or not self._data.startswith(b"\xff\xd8"):
            return None
        return bytes(self._data) if self._data[-4:].rstrip(b"\r\n").endswith(b"\xff\xd9") else None

    def take_pending(self) -> None:
        """Drop the pending part after use; the next boundary is looked for."""
        self._data.clear()
        self._in_part, self._looked = False, 0

    def _next(self) -> bytes | None:
        if not self._in_part and not self._enter():
            return None
        if self._length is not None:
            if len(self._data) < self._length:
                return None
            part = bytes(self._data[:self._length])
            self._leave(self._length)
            return part
        at = self._find_mark()
        if at < 0:
            return None
        part = bytes(self._data[:at])
        self._leave(at)
        if at > MAX_PART:
            raise PartTooLarge
        return part.rstrip(b"-").removesuffix(b"\n").removesuffix(b"\r")

    def _enter(self) -> bool:
        """Go past the next mark and the header lines behind it."""
        at = self._find_mark()
        if at < 0:
            return False
        head = at + len(self._mark)
        ends = [(end, end + len(gap)) for gap in (b"\r\n\r\n", b"\n\n") if (end := self._data.find(gap, head)) >= 0]
        if not ends:
            self._looked = at
            if len(self._data) - head > MAX_HEAD:
                self._drop()
            return False
        end, start = min(ends)
        stated = LENGTH.search(bytes(self._data[head:end]).replace(b"\r", b""))
        self._length = int(stated[1]) if stated and int(stated[1]) else None
        if self._length is not None and self._length > MAX_PART:
            self._drop()
        del self._data[:start]
        self._in_part, self._looked = True, 0
        return True

    def _find_mark(self) -> int:
        at = self._data.find(self._mark, self._looked)
        if at < 0 and len(self._data) > MAX_PART:
            self._drop()
        self._looked = max(0, len(self._data) - len(self._mark)) if at < 0 else at
        return at

    def _leave(self, at: int) -> None:
        del self._data[:at]
        self._in_part, self._looked, self._length = False, 0, None

    def _drop(self) -> None:
        self._data.clear()
        self._leave(0)
        raise PartTooLarge
