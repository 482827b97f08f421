"""Logins at cameras, as RFC 7616 has them."""

import re

from touchline.sources.network.endpoint import Login


def challenge(nonce: str) -> list[str]:
    return [f'Digest realm="cam", nonce="{nonce}", qop="auth", stale=true']


def test_requests_are_counted_from_one_for_each_nonce():
    login, counts = Login("op", "s3cret"), []
    for nonce in ("first", "second"):
        assert login.accept_challenge(challenge(nonce))
        counts += [
            re.search(r'nonce="(\w+)".* nc=(\w+)', login.header("GET", "/")).groups()
            for _ in range(2)
        ]
    assert counts == [
        ("first", "00000001"),
        ("first", "00000002"),
        ("second", "00000001"),
        ("second", "00000002"),
    ]
