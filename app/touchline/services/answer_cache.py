"""The bytes of answers that never change while what they are made of does not: most are about one version."""

import gzip
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from typing import Self

from touchline.store.repository import LruCache

MAX_BYTES = 32 << 20  # some 1000 answers
OWN_BYTES = 1000  # of an answer, beside its content
TEXTS = ("text/", "application/json", "image/svg+xml")
WORTH_PACKING_BYTES = 1000


@dataclass(frozen=True)
class CachedAnswer:
    """An answer as it was sent first. etag: of its content."""

    content: bytes
    media_type: str
    etag: str

    @classmethod
    def of(cls, content: bytes, media_type: str = "application/json") -> Self:
        return cls(content, media_type, etag_of(content))

    @cached_property
    def packed(self) -> bytes | None:
        """The content by gzip; None where that is not worth it."""
        if len(self.content) <= WORTH_PACKING_BYTES or not self.media_type.startswith(TEXTS):
            return None
        return gzip.compress(self.content, mtime=0)


class AnswerCache(LruCache[tuple[object, ...], CachedAnswer]):
    """Answers by all that they are made of: the work, its parameters, and the stamps of the versions among these."""

    def __init__(self, max_bytes: int = MAX_BYTES) -> None:
        super().__init__(max_bytes, lambda answer: len(answer.content) + OWN_BYTES)


def etag_of(content: bytes) -> str:
    """Return a strong ETag, in its quotes."""
    return f'"{sha256(content).hexdigest()[:32]}"'
