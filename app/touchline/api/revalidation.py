"""Answers that callers may cache as long as they ask each time whether theirs is still the right one."""

import re
from collections.abc import Mapping

from starlette.datastructures import Headers
from starlette.responses import Response

TAGS = re.compile(r'"[^"]*"')  # whether weak or not: of an answer to GET the same


def revalidated(asked: Headers, content: bytes, etag: str, media_type: str, headers: Mapping[str, str]) -> Response:
    """Return the content with its ETag; 304 without it where the If-None-Match of the request names that."""
    known = asked.get("if-none-match", "")
    sent = {**headers, "ETag": etag}
    if known.strip() == "*" or etag in TAGS.findall(known):
        sent.pop("Content-Encoding", None)
        return Response(status_code=304, headers=sent)
    return Response(content, media_type=media_type, headers=sent)
