"""What routes receive besides their own parameters: the server's services, the operator's name, an ETag."""

from typing import Annotated

from fastapi import Depends, Header, Request
from pydantic import AfterValidator
from starlette.requests import HTTPConnection

from app.core.errors import TouchlineError
from app.services.container import Services

OPERATOR_HEADER = "X-Operator"
MAX_NAME = 64  # characters of an operator's name


async def services_of(connection: HTTPConnection) -> Services:
    return connection.app.state.services


async def operator_of(request: Request) -> str:
    """Return the name that a caller gives, or its address: written beside a version, a draft and an activation.

    It is claimed, not proved.
    """
    name = request.headers.get(OPERATOR_HEADER, "").strip()[:MAX_NAME]
    return name or (request.client.host if request.client else "")


def _bare(etag: str | None) -> str | None:
    return None if etag is None else etag.strip().removeprefix("W/").strip('"')


ServicesDep = Annotated[Services, Depends(services_of)]
OperatorDep = Annotated[str, Depends(operator_of)]
IfMatch = Annotated[str | None, Header(max_length=200), AfterValidator(_bare)]


class IfMatchNeeded(TouchlineError):
    """A change of something that exists must say which state it was made from."""

    status = 428
    reason = "if-match-needed"
    title = "If-Match needed"

    def __init__(self, what: str) -> None:
        super().__init__(what, "Send the ETag of GET as If-Match.")
