"""Touchline: calibrates the cameras above a robot-soccer field, and says in millimetres how far to trust it.

What scripts import is here; the program itself imports its parts.
"""

from typing import TYPE_CHECKING, Any

from touchline.installation import __version__ as __version__
from touchline.installation import shipped as shipped

if TYPE_CHECKING:
    from touchline.client.client import Client as Client
    from touchline.core.errors import TouchlineError as TouchlineError


def __getattr__(name: str) -> Any:
    """Return what scripts import; loaded when it is first asked for, since every command imports this package."""
    if name == "Client":
        from touchline.client.client import Client

        return Client
    if name == "TouchlineError":
        from touchline.core.errors import TouchlineError

        return TouchlineError
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
