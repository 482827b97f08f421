"""What an address says: scheme://target?option=value&…, or for a network camera scheme://host/path?its=own#option=value.

What follows the ? of a network camera's address belongs to the camera and reaches it untouched, so our own options
stand behind a #, which no server ever sees.
"""

import re
from collections.abc import Mapping
from typing import Any
from urllib.parse import parse_qsl, unquote, urlsplit

from touchline.core.errors import BadInput
from touchline.core.options import Option
from touchline.core.sentences import use_one_of
from touchline.core.statements import say

MAX_ADDRESS = 2000  # characters
PORTS = {"rtsp": 554, "http": 80, "https": 443}
KEEP_THEIR_QUERY = tuple(PORTS)
NOT_VALID = say("address.not-valid", "The camera address is not valid.")
FORM = say(
    "address.form", "Write it as scheme://target?option=value, such as sim://ssl-div-b?lens=strong."
)

# user:password@ before the host; then name=value pairs whose name tells that the value is a secret, as some cameras
# take it in the query or, with _ between them, in the path. Counts are bounded: what is logged is a stranger's.
USERINFO = re.compile(r"^([^/?#@:]*)(:[^/?#@]*)?@(?=[^/?#@\\]+([/?#]|$))")
NAME = (
    r"(?:[a-z]{0,40}pass[a-z]{0,40}|[a-z]{0,40}pwd|[a-z_-]{0,40}(?:token|key|secret)|auth(?:orization)?|"
    r"sig[a-z]{0,40})="
)
SECRET = re.compile(rf"([?&;#]{NAME})[^&;#]*|([/_]{NAME})(?:(?!_[^\W_]+=)[^&;/#?])*", re.IGNORECASE)
ADDRESS_IN_TEXT = re.compile(r"[a-z][a-z0-9+.-]{0,20}://\S+", re.IGNORECASE)
SECRET_IN_TEXT = re.compile(rf"([?&;]{NAME})[^\s&;]*?(?=[\"']?(?:[\s&;]|$))", re.IGNORECASE)


def split_address(url: str) -> tuple[str, str, dict[str, str]]:
    """Scheme, target and options as text; BadInput for what is no address.

    The target is decoded from its %XX; a network camera's is everything between :// and #, as it was written.
    """
    if not isinstance(url, str) or len(url) > MAX_ADDRESS or not url.isprintable():
        raise BadInput(NOT_VALID, FORM, reason="bad-source")
    try:
        parts = urlsplit(url)
        theirs = parts.scheme in KEEP_THEIR_QUERY
        ours = parts.fragment if theirs else parts.query
        pairs = parse_qsl(
            ours,
            keep_blank_values=True,
            strict_parsing=bool(ours),
            max_num_fields=50,
            errors="strict",
        )
        target = parts.netloc + parts.path
        target = (
            target + f"?{parts.query}" * bool(parts.query)
            if theirs
            else unquote(target, errors="strict")
        )
    except ValueError:  # also what is no UTF-8
        raise BadInput(NOT_VALID, FORM, reason="bad-source") from None
    given = dict(pairs)
    if (
        not parts.scheme
        or "://" not in url
        or not target
        or (parts.fragment and not theirs)
        or len(given) < len(pairs)
    ):
        raise BadInput(
            say(
                "address.not-valid-or-twice",
                "The camera address is not valid, or contains an option twice.",
            ),
            FORM,
            reason="bad-source",
        )
    return parts.scheme, target, given


def without_password(url: str) -> str:
    """An address as it may be shown, answered and logged: a user's name stays, what looks like a secret goes."""
    scheme, separator, rest = url.partition("://")
    if not separator:
        return url
    rest, hidden = USERINFO.subn(lambda found: f"{found[1]}@" if found[1] else "", rest)
    if not hidden and "@" in rest and scheme.lower() in KEEP_THEIR_QUERY:
        host = rest.partition("/")[0]
        # An @ in a path is a camera's own affair; before it, or after an odd host, it is a password with signs in it.
        if "@" in host or (":" in host and not host.rpartition(":")[2].isdecimal()):
            rest = rest.rpartition("@")[2]
    return scheme + separator + SECRET.sub(r"\1\2…", rest)


def without_secrets(text: str) -> str:
    """Return a text as it may be logged: every address in it without its password, every query without its secrets."""
    return SECRET_IN_TEXT.sub(
        r"\1…", ADDRESS_IN_TEXT.sub(lambda found: without_password(found[0]), text)
    )


def device_of(url: str) -> str:
    """Return what is the same for two addresses of one device or stream; "" for what is no address.

    A simulated camera is what its options say; all others are a place, whatever options of ours follow it.
    """
    try:
        scheme, target, given = split_address(url)
    except BadInput:
        return ""
    if scheme not in KEEP_THEIR_QUERY:
        return (
            f"{scheme}://{target}?{sorted(given.items())}"
            if scheme == "sim"
            else f"{scheme}://{target.rstrip('/')}"
        )
    parts = urlsplit(f"{scheme}://{target}")
    try:
        port = parts.port or PORTS[scheme]
    except ValueError:
        return ""
    return f"{(parts.hostname or '').rstrip('.')}:{port}{parts.path.rstrip('/')}?{parts.query}"


def read_query(described: tuple[Option, ...], given: Mapping[str, str]) -> dict[str, Any]:
    """Every described option with its given or default value, from text."""
    table = {option.name: option for option in described}
    for name in given:
        if name not in table:
            raise BadInput(
                say(
                    "address.unknown-option",
                    "This source has no option called {option!r}.",
                    option=name,
                ),
                use_one_of(table) if table else say("address.no-options", "It has no options."),
                reason="unknown-option",
            )
    return {
        name: _read_one(option, given[name]) if name in given else option.default
        for name, option in table.items()
    }


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
