"""HTTP and RTSP authentication: Basic, or Digest (RFC 7616), as the camera demands."""

import re
import secrets
from base64 import b64encode
from collections.abc import Iterable
from hashlib import md5, sha256

PAIR = re.compile(r'([a-z][a-z0-9_-]*)\s*=\s*(?:"((?:[^"\\]|\\.)*)"|([^\s,"]+))', re.IGNORECASE)
HASHES = {"md5": md5, "sha-256": sha256}


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
        algorithm, realm, nonce = challenge.get("algorithm", "MD5"), challenge.get("realm", ""), challenge["nonce"]

        def hashed(text: str) -> str:
            return HASHES[algorithm.lower()](text.encode()).hexdigest()

        identity, request = hashed(f"{self._user}:{realm}:{self._password}"), hashed(f"{method}:{uri}")
        user = self._user.replace("\\", "\\\\").replace('"', '\\"')
        fields = {"username": user, "realm": realm, "nonce": nonce, "uri": uri}
        bare = f", algorithm={algorithm}" if "algorithm" in challenge else ""
        if "qop" in challenge:
            self._count += 1
            count, ours = f"{self._count:08x}", secrets.token_hex(8)
            fields |= {"cnonce": ours, "response": hashed(f"{identity}:{nonce}:{count}:{ours}:auth:{request}")}
            bare += f", qop=auth, nc={count}"
        else:
            fields["response"] = hashed(f"{identity}:{nonce}:{request}")
        if "opaque" in challenge:
            fields["opaque"] = challenge["opaque"]
        return "Digest " + ", ".join(f'{name}="{value}"' for name, value in fields.items()) + bare
