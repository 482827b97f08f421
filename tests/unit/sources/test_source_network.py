"""Where a network camera may be: nothing is connected to that only this machine should reach."""

import contextlib
import ipaddress
import socket
import threading
import time

import pytest

from tests.support.mjpeg_camera import MjpegCamera
from tests.support.rtsp_camera import RtspCamera
from tests.support.waiting import until
from touchline.core.errors import BadInput, TouchlineError, Unavailable
from touchline.images.in_process import decode_in_process, read_in_process
from touchline.sources import SourceContext, source_from_url
from touchline.sources.network.endpoint import (
    Endpoint,
    connect,
    hardware_address,
    is_allowed,
    why_forbidden,
)

AROUND = SourceContext(decode=decode_in_process, read=read_in_process)


class Listener:
    """Counts who connects, on every address that this machine has."""

    def __init__(self):
        self.hits = 0
        self._socket = socket.create_server(
            ("::", 0), family=socket.AF_INET6, dualstack_ipv6=True, backlog=300
        )
        self.port = self._socket.getsockname()[1]
        threading.Thread(target=self._count, daemon=True).start()

    def _count(self):
        with contextlib.suppress(OSError):
            while True:
                line, _ = self._socket.accept()
                self.hits += 1
                line.close()

    def close(self):
        self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()


@pytest.fixture
def listener():
    with contextlib.closing(Listener()) as one:
        yield one


def own_address() -> str:
    """This machine's address on its network, if it is on one."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe, contextlib.suppress(OSError):
        probe.connect(("192.0.2.1", 9))
        return probe.getsockname()[0]
    return "127.0.0.1"


LOOPBACKS = (
    "127.0.0.1",
    "127.0.0.2",
    "127.1",
    "127.0.1",
    "127.255.255.254",
    "2130706433",
    "0x7f000001",
    "0x7f.0.0.1",
    "0x7f.1",
    "0177.0.0.1",
    "017700000001",
    "0177.1",
    "00127.0.0.1",
    "127.000.000.001",
    "0",
    "0.0.0.0",
    "0.0.0.1",
    "[::1]",
    "[::]",
    "[0:0:0:0:0:0:0:1]",
    "[::ffff:127.0.0.1]",
    "[::ffff:7f00:1]",
    "[::ffff:0:7f00:1]",
    "[::127.0.0.1]",
    "[2002:7f00:1::]",
    "[64:ff9b::127.0.0.1]",
    "[64:ff9b::7f00:1]",
    "[::ffff:0.0.0.0]",
    "localhost",
    "LOCALHOST",
    "localhost.",
    "127.0.0.1.",
    "①②⑦.⓪.⓪.①",
    "127。0。0。1",
    "loc%61lhost",
    "127%2e0.0.1",
    "127.0.0.1%00.cam",
    "[fe80::1%25lo]",
    own_address(),
    f"[::ffff:{own_address()}]",
    socket.gethostname(),
    "localhost.localdomain",
    "ip6-localhost",
    "0x7F.0X0.0.1",
    "[::ffff:0:127.0.0.1]",
    "[64:ff9b:1::7f00:1]",
    "[fec0::1]",
)
USERINFO_TRICKS = (
    "192.168.1.20@{h}",
    "192.168.1.20:80@{h}",
    "{h}@{h}",
    "a:b@{h}",
    "cam.local%40{h}",
    "192.168.1.20@@{h}",
    "192.168.1.20\\@{h}",
    "{h}\\@192.168.1.20",
    "192.168.1.20#@{h}",
    "192.168.1.20?@{h}",
    "192.168.1.20 @{h}",
    "@{h}",
    "192.168.1.20;@{h}",
    "{h}#192.168.1.20",
    "{h}?192.168.1.20",
    "{h}/@192.168.1.20",
    "192.168.1.20&@{h}#@{h}",
)


def payloads(port: int) -> list[str]:
    """At least 200 addresses that mean this machine, or try to make somebody think so."""
    urls = [
        f"{scheme}://{host}:{port}/x" for scheme in ("rtsp", "http", "https") for host in LOOPBACKS
    ]
    urls += [
        f"{scheme}://{trick.format(h=f'127.0.0.1:{port}')}/x"
        for scheme in ("rtsp", "http")
        for trick in USERINFO_TRICKS
    ]
    local = f"127.0.0.1:{port}"
    urls += [
        f"{scheme}://{local}/x"
        for scheme in (
            "file",
            "ftp",
            "gopher",
            "tcp",
            "udp",
            "rtp",
            "rtmp",
            "srt",
            "sftp",
            "concat:http",
            "subfile,,:http",
            "cache:http",
            "async:http",
            "crypto:http",
            "tls",
            "unix",
            "data",
            "hls+http",
            "mmsh",
            "rtsps",
            "rtspt",
            "HTTP",
            "RTSP",
            "\thttp",
            "http\t",
            "jar:http",
            "exec",
            "dict",
            "ldap",
        )
    ]
    urls += [
        f"video://http://{local}/x.mp4",
        f"picture://http://{local}/x.png",
        f"folder://{local}",
        f"v4l2://{local}",
        f"video:///proc/self/fd/0?x=http://{local}",
        f"http:/{local}/x",
        f"http:{local}",
        f"//{local}/x",
        f"http:///{local}/x",
        f"rtsp:///{local}",
        f"http://{local}:80@{local}/",
        f"http://[{local}]/x",
    ]
    return urls


def test_two_hundred_addresses_of_this_machine_reach_nobody(listener, tmp_path):
    around = SourceContext(decode=decode_in_process, read=read_in_process, pictures=tmp_path)
    urls = payloads(listener.port)
    assert len(urls) >= 200
    for url in urls:
        with pytest.raises(TouchlineError):
            source_from_url(url, around).close()
            pytest.fail(f"{url} opened")
    # The listener takes connections in their order: one before ours would have been counted before it.
    socket.create_connection(("127.0.0.1", listener.port)).close()
    assert until(lambda: listener.hits) == 1


@pytest.mark.parametrize(
    "address",
    [
        "127.0.0.1",
        "127.8.8.8",
        "0.0.0.0",
        "0.1.2.3",
        "169.254.1.1",
        "169.254.169.254",
        "224.0.0.1",
        "239.255.255.250",
        "255.255.255.255",
        "240.0.0.1",
        "100.100.100.200",
        "168.63.129.16",
        "192.0.0.192",
        "::1",
        "::",
        "fe80::1",
        "fec0::1",
        "ff02::1",
        "fd00:ec2::254",
        "::ffff:127.0.0.1",
        "::ffff:169.254.169.254",
        "2002:7f00:1::",
        "64:ff9b::a9fe:a9fe",
        "::169.254.169.254",
    ],
)
def test_addresses_where_no_camera_should_be_are_named(address):
    assert why_forbidden(ipaddress.ip_address(address))


@pytest.mark.parametrize(
    "address",
    [
        "192.168.1.20",
        "10.0.0.7",
        "172.16.5.5",
        "100.64.0.9",
        "203.0.113.5",
        "fd12::7",
        "2001:db8::5",
        "::ffff:192.168.1.20",
    ],
)
def test_ordinary_and_private_addresses_are_where_cameras_live(address):
    assert why_forbidden(ipaddress.ip_address(address)) is None


@pytest.mark.parametrize(
    ("entry", "url", "listed"),
    [
        ("127.0.0.1", "127.0.0.1:8554", True),
        ("127.0.0.1:8554", "127.0.0.1:8554", True),
        ("127.0.0.1:8554", "127.0.0.1:22", False),
        ("127.0.0.0/8", "127.0.0.9", True),
        ("169.254.0.0/16", "127.0.0.1", False),
        ("::1", "[::1]", True),
        ("[::1]:80", "[::1]", True),
        ("[::1]:81", "[::1]", False),
        ("localhost", "127.0.0.1", False),
        ("Sim.Local", "sim.local", True),
        ("127.0.0.1", "[::ffff:127.0.0.1]", True),
        ("", "127.0.0.1", False),
        ("nonsense/99", "127.0.0.1", False),
    ],
)
def test_the_settings_allow_a_name_an_address_or_a_network_with_a_port_or_without(
    entry, url, listed
):
    place = Endpoint.of("http", url)
    address = (
        ipaddress.ip_address(place.host)
        if place.host[0] in "1:"
        else ipaddress.ip_address("127.0.0.1")
    )
    assert is_allowed(place, address, [entry]) is listed


def test_what_is_listed_is_connected_to(listener):
    place = Endpoint.of("http", f"127.0.0.1:{listener.port}")
    with pytest.raises(BadInput) as refused:
        connect(place, ["10.0.0.0/8"], time.monotonic() + 5)
    assert refused.value.reason == "forbidden-host" and "allowed_hosts" in refused.value.fix
    connect(place, ["127.0.0.0/8"], time.monotonic() + 5).close()


def test_a_name_is_looked_up_once_and_what_was_judged_is_connected_to(monkeypatch, listener):
    """The name's second answer would be this machine; nobody asks for it."""
    asked, tried = [], []

    def flipping(*question, **_):
        asked.append(question)
        return [
            (
                socket.AF_INET,
                socket.SOCK_STREAM,
                6,
                "",
                (("192.0.2.7" if len(asked) == 1 else "127.0.0.1"), 80),
            )
        ]

    def connecting(address, timeout=None, **_):
        tried.append(address)
        raise OSError

    monkeypatch.setattr(socket, "getaddrinfo", flipping)
    monkeypatch.setattr(socket, "create_connection", connecting)
    for scheme in ("http", "rtsp"):
        asked.clear(), tried.clear()
        with pytest.raises(Unavailable):
            source_from_url(f"{scheme}://flip.test:{listener.port}/x", AROUND)
        assert len(asked) == 1 and tried == [("192.0.2.7", listener.port)]
    assert listener.hits == 0


def test_one_forbidden_address_among_a_names_is_enough_to_refuse_it(monkeypatch):
    mixed = [
        (socket.AF_INET, socket.SOCK_STREAM, 6, "", (ip, 80))
        for ip in ("192.168.1.20", "127.0.0.1")
    ]
    monkeypatch.setattr(socket, "getaddrinfo", lambda *_, **__: mixed)
    with pytest.raises(BadInput) as refused:
        connect(Endpoint.of("http", "two.test"), [], time.monotonic() + 5)
    assert refused.value.reason == "forbidden-host"


def test_a_name_server_that_is_silent_holds_nobody(monkeypatch):
    answer = threading.Event()
    monkeypatch.setattr(socket, "getaddrinfo", lambda *_, **__: answer.wait(60) and [])
    start = time.monotonic()
    with pytest.raises(Unavailable) as refused:
        connect(Endpoint.of("http", "slow.test"), [], start + 0.3)
    answer.set()
    # it is silent for sixty
    assert refused.value.reason == "unknown-host" and time.monotonic() - start < 30


def test_a_neighbour_is_told_by_its_network_card(listener, tmp_path):
    table = tmp_path / "arp"
    table.write_text(
        "IP address       HW type     Flags       HW address            Mask     Device\n"
        "192.168.1.20     0x1         0x2         aa:aa:aa:aa:aa:aa     *        eth0\n"
        "127.0.0.1        0x1         0x2         00:0C:E5:12:34:56     *        eth0\n"
    )
    with socket.create_connection(("127.0.0.1", listener.port)) as line:
        assert hardware_address(line, table) == "00:0c:e5:12:34:56"
        table.write_text(
            "127.0.0.1        0x1         0x0         00:00:00:00:00:00     *        eth0\n"
        )
        assert hardware_address(line, table) == hardware_address(line, tmp_path / "none") == ""


@pytest.mark.parametrize("camera", [MjpegCamera, RtspCamera])
def test_a_camera_that_sends_us_on_leads_nowhere(camera, listener):
    with contextlib.closing(camera()) as one:
        for target in (
            f"http://127.0.0.1:{listener.port}/",
            f"rtsp://127.0.0.1:{listener.port}/",
            "file:///etc/hostname",
        ):
            one.redirect = target
            with pytest.raises(Unavailable) as refused:
                source_from_url(
                    one.url, SourceContext(read=read_in_process, hosts=(f"127.0.0.1:{one.port}",))
                )
            assert refused.value.reason == "camera-redirects"
    assert listener.hits == 0
