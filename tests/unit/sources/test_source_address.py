"""Addresses: a network camera keeps its own query, and no password comes back."""

import pytest

from touchline.core.errors import BadInput
from touchline.sources import (
    Identity,
    SourceContext,
    source_from_url,
    split_address,
    without_password,
)
from touchline.sources.address import without_secrets
from touchline.sources.network.endpoint import Endpoint


def test_a_network_cameras_query_is_its_own_and_our_options_stand_behind_the_hash():
    assert split_address("http://u:p%40@cam:81/v%20i?a=1&a=2&fps=9#fps=2&trust=any") == (
        "http",
        "u:p%40@cam:81/v%20i?a=1&a=2&fps=9",
        {"fps": "2", "trust": "any"},
    )
    assert split_address("rtsp://cam/ch0")[2] == {}
    assert split_address("sim://table?seed=2")[2] == {"seed": "2"}


@pytest.mark.parametrize(
    ("address", "shown"),
    [
        (
            "rtsp://op:s3cret@cam:554/a@b?channel=1#open_s=3",
            "rtsp://op@cam:554/a@b?channel=1#open_s=3",
        ),
        ("rtsp://:s3cret@cam/", "rtsp://cam/"),
        ("rtsp://op:s3@cret@cam/", "rtsp://cam/"),
        ("rtsp://op:s3/cret@cam/x", "rtsp://cam/x"),
        ("http://op:s3cret\\@cam/x", "http://op@cam/x"),
        (
            "http://cam/videostream.cgi?user=op&pwd=s3cret&rate=0",
            "http://cam/videostream.cgi?user=op&pwd=…&rate=0",
        ),
        ("http://cam/x?Password=s3cret", "http://cam/x?Password=…"),
        ("http://cam/x?access_token=s3cret&n=1", "http://cam/x?access_token=…&n=1"),
        (
            "rtsp://cam:554/user=op_password=s3_cret_channel=1_stream=0.sdp",
            "rtsp://cam:554/user=op_password=…_channel=1_stream=0.sdp",
        ),
        ("http://cam/x?key=s3/cret_c=r&n=1#token=s3/cret", "http://cam/x?key=…&n=1#token=…"),
        ("http://cam/x?x-api-key=s3cret", "http://cam/x?x-api-key=…"),
        ("http://cam/keyboard?monkey", "http://cam/keyboard?monkey"),
        ("sim://table?seed=1", "sim://table?seed=1"),
        ("no address at all", "no address at all"),
    ],
)
def test_what_is_shown_of_an_address_holds_no_password(address, shown):
    assert without_password(address) == shown


def test_evidence_that_an_earlier_version_has_saved_with_more_of_an_address_is_of_the_same_camera():
    now = Identity(without_password("http://cam/x?key=s3/cret"))
    assert now.differs_from(Identity("http://cam/x?key=…/cret")) is None
    told = now.differs_from(Identity("http://other/x?key=…/cret"))
    assert told is not None and "cret" not in told


@pytest.mark.parametrize(
    ("text", "logged"),
    [
        ("GET /?token=s3/c_r=et HTTP/1.1", "GET /?token=… HTTP/1.1"),
        (
            '"WebSocket /a?x=1&access_token=s3cret" [accepted]',
            '"WebSocket /a?x=1&access_token=…" [accepted]',
        ),
        (
            "OSError: 'rtsp://op:s3@cret@cam/x?pwd=s3cret' and\nhttp://:s3cret@cam",
            "OSError: 'rtsp://cam/x?pwd=… and\nhttp://cam",
        ),
        ("/a?secret=s3cret;b=2 /b?n=2", "/a?secret=…;b=2 /b?n=2"),
        (
            "sorted(a, sort_key=str, key=len) at https://cam:80/x",
            "sorted(a, sort_key=str, key=len) at https://cam:80/x",
        ),
        ("?token=" * 20_000, "?token=…"),
    ],
)
def test_what_is_logged_holds_no_secret_of_an_address(text, logged):
    assert without_secrets(text) == logged


def test_a_place_is_read_with_its_login_and_keeps_what_is_sent():
    place = Endpoint.of("rtsp", "op:s3%2Fcret@Cam.Local.:8554/a b/ü?x=[1]&y=%20")
    assert (place.host, place.port, place.user, place.password) == (
        "cam.local",
        8554,
        "op",
        "s3/cret",
    )
    assert place.resource == "/a%20b/%C3%BC?x=[1]&y=%20" and place.authority == "cam.local:8554"
    assert (
        Endpoint.of("http", "[fe80::1]").authority == "[fe80::1]"
        and Endpoint.of("https", "cam").port == 443
    )
    assert "s3/cret" not in repr(place)


@pytest.mark.parametrize(
    "target",
    [
        "a@b@cam/",
        "cam\\@other/",
        "cam:0/",
        "cam:99999/",
        "cam:x/",
        "ca m/",
        "-cam/",
        "cam-/",
        "ca..m/",
        "0x7f000001/",
        "2130706433/",
        "127.1/",
        "0177.0.0.1/",
        "cam.0x7f/",
        "1.2.3/",
        "[::1/",
        "[cam]/",
        "[fe80::1%eth0]/",
        "käm/",
        "/x",
        "@/x",
        "op:%ff@cam/",
        "op:a%0ab@cam/",
        "x" * 300,
        "cam：80/",
        "cam⁄x",
        ".",
        "a" * 64 + ".b/",
    ],
)
def test_an_address_that_leaves_a_doubt_about_its_host_is_refused(target):
    with pytest.raises(BadInput) as refused:
        Endpoint.of("http", target)
    assert refused.value.reason == "bad-source"
    with pytest.raises(BadInput):
        source_from_url(f"http://{target}", SourceContext(read=lambda raw: None))


@pytest.mark.parametrize("scheme", ["rtsp", "http", "https"])
def test_a_refusal_does_not_repeat_the_password(scheme):
    for host in ("127.0.0.1", "ca m", "no-such-host.invalid"):
        try:
            source_from_url(
                f"{scheme}://op:s3cret@{host}/x?pwd=s3cret", SourceContext(read=lambda raw: None)
            )
        except Exception as error:
            assert "s3cret" not in str(error) + repr(error) + repr(error.__context__)
        else:
            pytest.fail("it opened")
