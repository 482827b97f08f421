"""What routes receive besides their own parameters: the server's services, the operator's name, an ETag."""

from collections.abc import Awaitable, Callable
from functools import wraps
from typing import Annotated, Any, Concatenate, TypeVar

from fastapi import Depends, Header, Request
from pydantic import AfterValidator
from starlette.requests import HTTPConnection

from touchline.api.requests import Id
from touchline.core.errors import TouchlineError
from touchline.core.jobs import Caller
from touchline.services.container import Services
from touchline.store.calibrations import FoundVersion

OPERATOR_HEADER = "X-Operator"
MAX_NAME = 64  # characters of an operator's name
Answer = TypeVar("Answer")


async def services_of(connection: HTTPConnection) -> Services:
    return connection.app.state.services


async def operator_of(request: Request) -> str:
    """Return the name that a caller gives, or its address: written beside a version, a draft and an activation.

    It is claimed, not proved.
    """
    return operator_name(request.headers.get(OPERATOR_HEADER, "")) or (
        request.client.host if request.client else ""
    )


async def caller_of(request: Request) -> Caller:
    """Return who asks, with the address of the connection beside the name: the name alone is anybody's."""
    return Caller(request.client.host if request.client else "", await operator_of(request))


def operator_name(given: str) -> str:
    """Return a name as others may read it: short, and without what would move or hide the words around it."""
    return "".join(filter(str.isprintable, given)).strip()[:MAX_NAME]


def _bare(etag: str | None) -> str | None:
    return None if etag is None else etag.strip().removeprefix("W/").strip('"')


ServicesDep = Annotated[Services, Depends(services_of)]
OperatorDep = Annotated[str, Depends(operator_of)]
CallerDep = Annotated[Caller, Depends(caller_of)]
IfMatch = Annotated[str | None, Header(max_length=200), AfterValidator(_bare)]


def version_of(services: ServicesDep, id: Id) -> FoundVersion:
    """Return the version that the path names, read in a thread: the event loop never waits for the store."""
    return services.store.calibrations.find(id)


VersionDep = Annotated[FoundVersion, Depends(version_of)]


def in_thread(
    work: Callable[Concatenate[Services, ...], Answer],
) -> Callable[..., Awaitable[Answer]]:
    """Make a route of work of a second or two: it waits for one of the services' threads and runs there."""

    @wraps(work)  # with its parameters
    async def route(services: Services, **given: Any) -> Answer:
        return await services.run_in_thread(work, services, **given)

    return route


class IfMatchNeeded(TouchlineError):
    """A change of something that exists must say which state it was made from."""

    status = 428
    reason = "if-match-needed"
    title = "If-Match needed"

    def __init__(self, what: str) -> None:
        super().__init__(what, "Send the ETag of GET as If-Match.")
