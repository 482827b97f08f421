"""Who asks: the name that a caller gives, or its address."""

from fastapi import Request

HEADER = "X-Operator"
LONGEST = 64


def operator(request: Request) -> str:
    """What is written beside a version, a draft and an activation: it is told, not proved."""
    named = request.headers.get(HEADER, "").strip()[:LONGEST]
    return named or (request.client.host if request.client else "")
