"""A network camera's endpoint: whether it is allowed, a connection pinned to the checked address, login, errors.

Who may add a camera must not reach through it what only this machine can: itself, the metadata service of a
cloud, link-local neighbours. Cameras live on ordinary networks, so private addresses are fine.
A name is resolved once; the address that was checked is connected to.
"""

import ipaddress
import queue
import re
import secrets
import socket
import threading
import time
from base64 import b64encode
from collections.abc import Iterable
from dataclasses import dataclass
from dataclasses import field as member
from hashlib import md5, sha256
from pathlib import Path
from typing import Self
from urllib.parse import quote, unquote, urlsplit

from touchline.core.errors import BadInput, Unavailable
from touchline.core.sentences import SENDS_NO_IMAGES
from touchline.core.statements import Sentence, say
from touchline.sources.address import NOT_VALID

CHECK_SWITCHED_ON = say("network.check-switched-on", "Check that it is switched on.")
NOTHING_THERE = {
    "http": say("network.no-answer-at-path", "The camera has nothing under this path."),
    "rtsp": say("network.no-stream-at-path", "The camera has no stream under this path."),
}
PATHS = {"http": "MJPEG", "rtsp": "RTSP"}

PAIR = re.compile(r'([a-z][a-z0-9_-]*)\s*=\s*(?:"((?:[^"\\]|\\.)*)"|([^\s,"]+))', re.IGNORECASE)
HASHES = {"md5": md5, "sha-256": sha256}

PORTS = {"rtsp": 554, "http": 80, "https": 443}
NAME = re.compile(
    r"(?=.{1,253}\.?$)([a-z0-9_]([a-z0-9_-]{0,61}[a-z0-9_])?\.)*[a-z0-9_]([a-z0-9_-]{0,61}[a-z0-9_])?\.?",
    re.IGNORECASE,
)
# the last label of 127.1, 0x7f.1, 2130706433
NUMBER = re.compile(r"0x[0-9a-f]*|[0-9]+", re.IGNORECASE)
# clouds' services that hand out keys; most others are link-local
METADATA = frozenset(
    map(
        ipaddress.ip_address,
        (
            "169.254.169.254",
            "100.100.100.200",
            "168.63.129.16",
            "192.0.0.192",
            "fd00:ec2::254",
            "fd20:ce::254",
        ),
    )
)
THIS_NETWORK = ipaddress.ip_network("0.0.0.0/8")
NAT64, V4_COMPATIBLE = ipaddress.ip_network("64:ff9b::/96"), ipaddress.ip_network("::/96")
NEIGHBOURS = Path("/proc/net/arp")
FORM = "Enter it as {scheme}://user:password@host:port/path. Write @ / : # in a password as %40 %2F %3A %23."
THIS_MACHINE = say("host.this-machine", "this machine itself")


def status_error(status: int, scheme: str) -> Unavailable:
    """Return the error for a status. scheme: "http" or "rtsp"."""
    if 300 <= status < 400:
        return Unavailable(
            say("network.redirects", "The camera redirects to another address."),
            say("network.enter-that-address", "Enter that address."),
            reason="camera-redirects",
        )
    if status in (401, 403):
        return Unavailable(
            say("network.login-refused", "The camera does not accept the user name and password."),
            say(
                "network.enter-login",
                "Enter them as {scheme}://user:password@host/…",
                scheme=scheme,
            ),
            reason="camera-login",
        )
    if status == 404:
        return Unavailable(
            NOTHING_THERE[scheme],
            say(
                "network.see-manual",
                "See its manual for its {protocol} path.",
                protocol=PATHS[scheme],
            ),
            reason="unknown-stream",
        )
    return Unavailable(
        say(
            "network.refused",
            "The camera refused the request with {protocol} status {status}.",
            protocol=scheme.upper(),
            status=status,
        ),
        say("network.check-settings", "Check its settings, or restart it."),
        reason="camera-refuses",
    )


def silent() -> Unavailable:
    return Unavailable(
        SENDS_NO_IMAGES,
        say("network.check-network", "Check the camera and its network."),
        reason="camera-silent",
    )


def connection_lost() -> Unavailable:
    return Unavailable(
        say("network.connection-lost", "The connection to the camera was lost."),
        CHECK_SWITCHED_ON,
        reason="camera-gone",
    )


class Login:
    """Answers a camera's challenges, then signs each request with the last one's nonce."""

    def __init__(self, user: str, password: str) -> None:
        self._user, self._password = user, password
        self._challenge: dict[str, str] | None = None
        self._count = 0
        self._basic = False

    def accept_challenge(self, challenges: Iterable[str]) -> bool:
        """Take the WWW-Authenticate headers of a refusal; return whether to retry."""
        if not self._user and not self._password:
            return False
        challenges = list(challenges)
        challenged_before = self._basic or self._challenge is not None
        for text in challenges:  # Digest first, wherever it stands: it does not show the password
            scheme, _, rest = text.strip().partition(" ")
            fields = {name.lower(): quoted or bare for name, quoted, bare in PAIR.findall(rest)}
            known = fields.get("algorithm", "MD5").lower() in HASHES and "nonce" in fields
            plain = "qop" not in fields or "auth" in re.split(r"[\s,]+", fields["qop"].lower())
            if scheme.lower() == "digest" and known and plain:
                stale = fields.get("stale", "").lower() == "true"
                self._challenge, self._count = fields, 0
                return stale or not challenged_before
        if any(text.strip().lower().startswith("basic") for text in challenges):
            self._basic, self._challenge = True, None
            return not challenged_before
        return False

    def header(self, method: str, uri: str) -> str | None:
        """The Authorization header's value for a request; None before any challenge."""
        if self._challenge is not None:
            return self._digest(method, uri, self._challenge)
        if self._basic:
            return "Basic " + b64encode(f"{self._user}:{self._password}".encode()).decode()
        return None

    def _digest(self, method: str, uri: str, challenge: dict[str, str]) -> str:
        algorithm, realm, nonce = (
            challenge.get("algorithm", "MD5"),
            challenge.get("realm", ""),
            challenge["nonce"],
        )

        def hashed(text: str) -> str:
            return HASHES[algorithm.lower()](text.encode()).hexdigest()

        identity, request = (
            hashed(f"{self._user}:{realm}:{self._password}"),
            hashed(f"{method}:{uri}"),
        )
        user = self._user.replace("\\", "\\\\").replace('"', '\\"')
        fields = {"username": user, "realm": realm, "nonce": nonce, "uri": uri}
        bare = f", algorithm={algorithm}" if "algorithm" in challenge else ""
        if "qop" in challenge:
            self._count += 1
            count, ours = f"{self._count:08x}", secrets.token_hex(8)
            fields |= {
                "cnonce": ours,
                "response": hashed(f"{identity}:{nonce}:{count}:{ours}:auth:{request}"),
            }
            bare += f", qop=auth, nc={count}"
        else:
            fields["response"] = hashed(f"{identity}:{nonce}:{request}")
        if "opaque" in challenge:
            fields["opaque"] = challenge["opaque"]
        return "Digest " + ", ".join(f'{name}="{value}"' for name, value in fields.items()) + bare


Address = ipaddress.IPv4Address | ipaddress.IPv6Address


@dataclass(frozen=True)
class Endpoint:
    """What a network camera's address names. resource: path and query, as they are sent."""

    scheme: str
    host: str
    port: int
    resource: str
    user: str = ""
    password: str = member(default="", repr=False)

    @classmethod
    def of(cls, scheme: str, target: str) -> Self:
        """Parse everything between :// and #; BadInput for what leaves any doubt about the host."""
        wrong = BadInput(
            NOT_VALID, say("address.network-form", FORM, scheme=scheme), reason="bad-source"
        )
        if "\\" in target or any(c.isspace() for c in target.partition("/")[0]):
            # some programs take a backslash for a slash: then they and we would mean different
            # hosts
            raise wrong
        try:
            parts = urlsplit(f"{scheme}://{target}")
            port = PORTS[scheme] if parts.port is None else parts.port
            user, password = (
                unquote(part or "", errors="strict") for part in (parts.username, parts.password)
            )
        except ValueError:
            raise wrong from None
        host = (parts.hostname or "").lower()
        if (
            parts.netloc.count("@") > 1
            or port == 0
            or not _is_host(host)
            or not (user + password).isprintable()
        ):
            raise wrong
        resource = quote(parts.path or "/", safe="/%:@!$&'()*+,;=~") + (
            "?" + quote(parts.query, safe="/%:@!$&'()*+,;=~?[]") if parts.query else ""
        )
        return cls(scheme, host.removesuffix("."), port, resource, user, password)

    @property
    def authority(self) -> str:
        """host:port as a Host header or another URL has it."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return host if self.port == PORTS[self.scheme] else f"{host}:{self.port}"


def connect(endpoint: Endpoint, allowed: Iterable[str], deadline: float) -> socket.socket:
    """Open a TCP connection; BadInput for a forbidden address, Unavailable where nobody answers.

    allowed: names, addresses and networks, with or without a port, that may be connected to all the same. deadline: on
    time.monotonic(), for looking the name up as well.
    """
    addresses = _resolve(endpoint, deadline)
    for address in addresses:
        check_allowed(endpoint, address, allowed)
    for address in addresses:
        try:
            line = socket.create_connection(
                (str(address), endpoint.port), max(0.01, deadline - time.monotonic())
            )
        except OSError:
            continue
        line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return line
    raise Unavailable(
        say("network.no-response", "No response from {address}.", address=endpoint.authority),
        say(
            "network.check-address",
            "Check that the camera is switched on, and that address and port are correct.",
        ),
        reason="camera-unreachable",
    )


def check_allowed(endpoint: Endpoint, address: Address, allowed: Iterable[str]) -> None:
    """BadInput for a forbidden address that the settings do not allow all the same."""
    why = why_forbidden(address)
    if why and not is_allowed(endpoint, address, allowed):
        raise BadInput(
            say(
                "network.forbidden-host",
                "{host} is {kind}, which is not allowed for cameras.",
                host=endpoint.host,
                kind=why,
            ),
            say(
                "network.allow-host",
                "To allow it, add it to the settings under sources: allowed_hosts.",
            ),
            reason="forbidden-host",
        )


def why_forbidden(address: Address) -> Sentence | None:
    """Return in words what a forbidden address is; None for an allowed one."""
    if address.version == 6 and (inner := _inner(address)) is not None:
        return why_forbidden(inner) or None
    if address in METADATA:
        return say("host.metadata-service", "a cloud's metadata service")
    if (
        address.is_unspecified
        or address.is_loopback
        or (address.version == 4 and address in THIS_NETWORK)
    ):
        return THIS_MACHINE
    if address.is_link_local or (address.version == 6 and address.is_site_local):
        return say("host.link-local", "a link-local address")
    if address.is_multicast or address.is_reserved:
        return say("host.not-one-machine", "not the address of a single machine")
    return THIS_MACHINE if _is_ours(address) else None


def is_allowed(endpoint: Endpoint, address: Address, allowed: Iterable[str]) -> bool:
    """Tell whether the settings allow the host, its address or its network, for this port or for all."""
    plain = (_inner(address) if address.version == 6 else None) or address
    for entry in allowed:
        name, port = _split_port(entry)
        if port not in (None, endpoint.port):
            continue
        if name == endpoint.host:
            return True
        try:
            network = ipaddress.ip_network(name, strict=False)
        except ValueError:
            continue
        if plain in network or address in network:
            return True
    return False


def hardware_address(line: socket.socket, table: Path = NEIGHBOURS) -> str:
    """The MAC address of a neighbour on the same network, such as "00:0c:e5:…"; "" behind a router or with IPv6."""
    try:
        ip = line.getpeername()[0]
        rows = [row.split() for row in table.read_text("ascii").splitlines()]
    except (OSError, ValueError):
        return ""
    return next(
        (
            row[3].lower()
            for row in rows
            if len(row) > 3 and row[0] == ip and row[3] != "00:00:00:00:00:00"
        ),
        "",
    )


def _resolve(endpoint: Endpoint, deadline: float) -> list[Address]:
    """Resolve the host, on a thread: a silent name server would block for half a minute."""
    answers: queue.SimpleQueue[list[str] | None] = queue.SimpleQueue()

    def ask() -> None:
        try:
            found = socket.getaddrinfo(endpoint.host, endpoint.port, type=socket.SOCK_STREAM)
            answers.put([str(entry[4][0]) for entry in found])
        except (OSError, UnicodeError):
            answers.put(None)

    threading.Thread(target=ask, name="look up", daemon=True).start()
    try:
        found = answers.get(timeout=max(0.01, deadline - time.monotonic()))
    except queue.Empty:
        found = None
    addresses = list(
        dict.fromkeys(ipaddress.ip_address(text.partition("%")[0]) for text in found or ())
    )
    if not addresses:
        raise Unavailable(
            say(
                "network.unknown-host",
                "The name {host} is unknown on this network.",
                host=endpoint.host,
            ),
            say("network.use-ip", "Correct it, or use the camera's IP address."),
            reason="unknown-host",
        )
    return addresses


def _is_host(host: str) -> bool:
    """Tell whether text is a name or an address in its ordinary form; no disguised number (0x7f.1)."""
    try:
        ipaddress.ip_address(host)
        return "%" not in host
    except ValueError:
        return bool(NAME.fullmatch(host)) and not NUMBER.fullmatch(
            host.removesuffix(".").rpartition(".")[2]
        )


def _inner(address: ipaddress.IPv6Address) -> ipaddress.IPv4Address | None:
    """The IPv4 address that an IPv6 one leads to: mapped, compatible, 6to4, Teredo or NAT64."""
    if address in NAT64 or (address in V4_COMPATIBLE and int(address) > 1):
        return ipaddress.IPv4Address(int(address) & 0xFFFFFFFF)
    return address.ipv4_mapped or address.sixtofour or (address.teredo or (None, None))[1]


def _is_ours(address: Address) -> bool:
    """Whether it is one of this machine's own: the way there then begins where it ends. Nothing is sent."""
    family = socket.AF_INET if address.version == 4 else socket.AF_INET6
    try:
        with socket.socket(family, socket.SOCK_DGRAM) as probe:
            probe.connect((str(address), 9))
            return ipaddress.ip_address(probe.getsockname()[0].partition("%")[0]) == address
    except OSError:
        return False


def _split_port(text: str) -> tuple[str, int | None]:
    """Split an entry of the settings: name, address or network, and a port or None."""
    text = text.strip().lower()
    if text.startswith("["):
        host, _, port = text[1:].partition("]")
        return host, int(port[1:]) if port[1:].isdecimal() else None
    host, colon, port = text.rpartition(":")
    if colon and port.isdecimal() and ":" not in host:
        return host, int(port)
    return text.removesuffix("."), None
