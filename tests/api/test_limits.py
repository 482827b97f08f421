"""Limits on what comes in, on the real server and real sockets: late or large requests end early and are told why."""

import asyncio
import json
import os
import socket
import threading
import time
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import pytest
import uvicorn
from starlette.applications import Starlette
from starlette.responses import JSONResponse, StreamingResponse
from starlette.routing import Route, WebSocketRoute
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect as websocket_connect

from tests.support.servers import API, served
from tests.support.waiting import LONG_S, until
from touchline.api.middleware.access import has_token
from touchline.api.middleware.connections import (
    MAX_HEAD_BYTES,
    LimitedConnection,
    limited_connections,
)
from touchline.api.middleware.limits import ENVELOPE_BYTES, MB, BodyLimits

JSON, UPLOAD = "application/json", "multipart/form-data; boundary=b"


async def length(request):
    return JSONResponse({"length": len(await request.body())})


async def ignore(request):
    return JSONResponse({"read": False})


async def begin_then_read(request):
    async def answer():
        yield b"begun"
        async for _ in request.stream():
            pass

    return StreamingResponse(answer())


async def busy_then_read(request):
    await asyncio.sleep(0.8)
    return await length(request)


async def read_then_stream(request):
    async def answer():
        for _ in range(8):
            yield b"."
            await asyncio.sleep(0.1)

    await request.body()
    return StreamingResponse(answer())


async def shout(websocket):
    await websocket.accept()
    while True:
        await websocket.send_text(await websocket.receive_text())


ROUTES = (length, ignore, begin_then_read, busy_then_read, read_then_stream)
APP = Starlette(
    routes=[
        *(Route(f"/{route.__name__}", route, methods=["GET", "POST"]) for route in ROUTES),
        WebSocketRoute("/shout", shout),
    ]
)


@contextmanager
def serving(http, **limits):
    """The real server with the limits, on a free port."""
    listener = socket.create_server(("127.0.0.1", 0), backlog=512)
    server = uvicorn.Server(
        uvicorn.Config(
            BodyLimits(APP, **limits),
            http=http,
            log_level="critical",
            timeout_keep_alive=20,
            timeout_graceful_shutdown=1,
            lifespan="off",
        )
    )
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
    thread.start()
    try:
        while not server.started:
            time.sleep(0.01)
        yield listener.getsockname()[1]
    finally:
        server.should_exit = True
        thread.join()
        listener.close()


@pytest.fixture(scope="module")
def port():
    with serving(
        limited_connections(head_s=0.6),
        text_bytes=MB,
        upload_bytes=4 * MB,
        text_s=0.5,
        upload_s=1.0,
    ) as port:
        yield port


def connect(port):
    return socket.create_connection(("127.0.0.1", port), timeout=10)


def head(path, kind, size=None, method="POST"):
    lengths = "Transfer-Encoding: chunked" if size is None else f"Content-Length: {size}"
    return f"{method} /{path} HTTP/1.1\r\nHost: x\r\nContent-Type: {kind}\r\n{lengths}\r\n\r\n".encode()


def answer(line, most_s=10):
    """Status, headers and body of the one answer on a line, and whether the server then closed it."""
    line.settimeout(most_s)
    data = b""
    while b"\r\n\r\n" not in data:
        piece = line.recv(65536)
        if not piece:
            return None
        data += piece
    text, _, body = data.partition(b"\r\n\r\n")
    headers = dict(row.lower().split(": ", 1) for row in text.decode().split("\r\n")[1:])
    while len(body) < int(headers.get("content-length", 0)):
        body += line.recv(65536)
    return int(text.split()[1]), headers, body


def refusal(line):
    status, headers, body = answer(line)
    told = json.loads(body)
    assert (
        headers["content-type"] == "application/problem+json"
        and told["status"] == status
        and told["fix"]
    )
    return status, told["type"].rsplit("/", 1)[1]


def is_closed(line, within_s=3.0):
    line.settimeout(within_s)
    try:
        return line.recv(1) == b""
    except ConnectionResetError:
        return True
    except TimeoutError:
        return False


@pytest.mark.parametrize(
    ("kind", "limit"),
    [
        (JSON, MB),
        ("text/plain", MB),
        (UPLOAD, 4 * MB + ENVELOPE_BYTES),
        ("application/octet-stream", 4 * MB + ENVELOPE_BYTES),
    ],
)
@pytest.mark.parametrize("declared", [True, False], ids=["declared", "chunked"])
def test_a_body_at_the_limit_passes_and_one_byte_more_is_refused(port, kind, limit, declared):
    for size, expected in ((limit, 200), (limit + 1, 413)):
        with connect(port) as line:
            line.sendall(head("length", kind, size if declared else None))
            line.sendall(
                bytes(size) if declared else b"%x\r\n" % size + bytes(size) + b"\r\n0\r\n\r\n"
            )
            if expected == 200:
                assert json.loads(answer(line)[2]) == {"length": size}
            else:
                assert refusal(line) == (413, "too-large")
                assert is_closed(line)


def test_a_declared_length_beyond_the_limit_is_refused_before_any_byte_of_it(port):
    with connect(port) as line:
        line.sendall(head("length", UPLOAD, 10**15))
        assert refusal(line) == (413, "too-large")


def test_a_large_body_is_not_buffered(port):
    before = resident_mb()
    with connect(port) as line:
        line.sendall(head("length", UPLOAD))
        piece = b"10000\r\n" + bytes(65536) + b"\r\n"
        peak = before
        with suppress(OSError):  # it is cut off, as it should be
            for _ in range(1000):
                line.sendall(piece)
                peak = max(peak, resident_mb())
    assert peak - before < 4 + 10  # MB: what may be read, and ten more


def resident_mb():
    return (
        int(Path(f"/proc/{os.getpid()}/statm").read_text().split()[1])
        * os.sysconf("SC_PAGESIZE")
        / MB
    )


def test_a_body_that_trickles_is_ended_in_time(port):
    with connect(port) as line:
        line.sendall(head("length", JSON, 1000))
        begin = time.monotonic()
        stop = threading.Event()
        threading.Thread(target=trickle, args=(line, stop)).start()
        assert refusal(line) == (408, "too-slow")
        stop.set()
        # half a second on a quiet machine
        assert 0.4 < time.monotonic() - begin < 30 and is_closed(line)


def trickle(line, stop):
    while not stop.wait(0.05):
        try:
            line.sendall(b"x")
        except OSError:
            return


def test_an_upload_has_longer(port):
    with connect(port) as line:
        line.sendall(head("length", UPLOAD, 2))
        time.sleep(0.7)
        line.sendall(b"ab")
        assert answer(line)[0] == 200


def test_a_body_that_arrived_while_the_app_was_busy_is_not_late(port):
    with connect(port) as line:
        line.sendall(head("busy_then_read", JSON, 2) + b"ab")
        assert json.loads(answer(line)[2]) == {"length": 2}


def test_an_answer_may_take_longer_than_the_body_was_allowed_to(port):
    with connect(port) as line:
        line.sendall(head("read_then_stream", JSON, 2) + b"ab")
        received = b""
        while not received.endswith(b"0\r\n\r\n"):
            received += (piece := line.recv(65536))
            assert piece, "the answer was cut"
        assert received.count(b"\r\n.\r\n") == 8


@pytest.mark.parametrize("begun", [False, True], ids=["nothing sent", "answer begun"])
def test_an_app_whose_caller_was_refused_is_not_heard_any_more(begun):
    sent = []

    async def app(scope, receive, send):
        if begun:
            await send({"type": "http.response.start", "status": 200, "headers": []})
        assert (await receive())["type"] == (await receive())["type"] == "http.disconnect"
        await send({"type": "http.response.body", "body": b"too late"})
        raise RuntimeError("my caller has gone")

    async def receive():
        return {"type": "http.request", "body": b"abc", "more_body": False}

    async def send(message):
        sent.append(message)

    scope = {"type": "http", "headers": [(b"content-type", b"text/plain")]}
    asyncio.run(BodyLimits(app, text_bytes=2)(scope, receive, send))
    assert [m["status"] for m in sent if m["type"] == "http.response.start"] == [
        200 if begun else 413
    ]
    assert not any(m.get("body") == b"too late" for m in sent)


def test_an_answer_that_has_begun_is_cut_when_the_body_is_too_large(port):
    with connect(port) as line:
        line.sendall(head("begin_then_read", JSON))
        line.sendall((b"80000\r\n" + bytes(0x80000) + b"\r\n") * 3)
        received = b""
        with suppress(ConnectionResetError):  # it was cut while we were sending
            while piece := line.recv(65536):
                received += piece
        assert received.startswith(b"HTTP/1.1 200") and b"413" not in received


@pytest.mark.parametrize(
    "sent", [b"", b"G", b"GET / HTTP/1.1\r\n", b"GET / HTTP/1.1\r\nHost: x\r\nX-Slow: 1"]
)
def test_a_half_open_connection_is_closed_in_time(port, sent):
    with connect(port) as line:
        begin = time.monotonic()
        line.sendall(sent)
        assert refusal(line) == (408, "too-slow")
        # half a second on a quiet machine
        assert 0.4 < time.monotonic() - begin < 30 and is_closed(line)


def test_headers_that_trickle_are_ended_in_time_on_a_later_request_as_well(port):
    with connect(port) as line:
        line.sendall(head("ignore", JSON, 0))
        assert answer(line)[0] == 200
        stop = threading.Event()
        line.sendall(b"GET / HTTP/1.1\r\nX: ")
        threading.Thread(target=trickle, args=(line, stop)).start()
        assert refusal(line) == (408, "too-slow")
        stop.set()


@pytest.mark.parametrize("requests", [0, 1])
def test_blank_lines_do_not_keep_a_connection_open(port, requests):
    with connect(port) as line:
        for _ in range(requests):
            line.sendall(head("ignore", JSON, 0))
            assert answer(line)[0] == 200
        begin = time.monotonic()
        with pytest.raises(OSError):  # a broken pipe or a reset, as the system likes
            while time.monotonic() - begin < 60:
                line.sendall(b"\r\n")
                time.sleep(0.05)


def test_a_connection_may_rest_between_two_requests(port):
    with connect(port) as line:
        for _ in range(2):
            line.sendall(head("ignore", JSON, 0))
            assert answer(line)[0] == 200
            time.sleep(0.9)


@pytest.mark.parametrize("requests", [0, 1])
def test_headers_without_end_are_refused(port, requests):
    with connect(port) as line:
        for _ in range(requests):
            line.sendall(head("ignore", JSON, 0))
            assert answer(line)[0] == 200
        line.sendall(b"GET / HTTP/1.1\r\nHost: x\r\n")
        with suppress(OSError):
            for k in range(MAX_HEAD_BYTES // 50):
                line.sendall(b"X-%06d: " % k + b"a" * 50 + b"\r\n")
        assert answer(line)[0] == 431


def test_a_large_body_in_the_same_packet_as_its_headers_is_no_header(port):
    with connect(port) as line:
        line.sendall(head("length", JSON, 200_000) + bytes(200_000))
        assert json.loads(answer(line)[2]) == {"length": 200_000}


def test_two_hundred_half_open_connections_do_not_keep_others_out(port):
    lines = [connect(port) for _ in range(200)]
    for line in lines:
        line.sendall(b"POST /length HTTP/1.1\r\nHost: x\r\n")
    begin = time.monotonic()
    with connect(port) as good:
        good.sendall(head("length", JSON, 2) + b"ab")
        assert answer(good)[0] == 200
    assert time.monotonic() - begin < 30
    for line in lines:
        assert refusal(line) == (408, "too-slow") and is_closed(line)
        line.close()


OURS = "127.0.0.1"  # every other loopback address counts as another machine in these tests
TOKEN = b"Authorization: Bearer 0123456789abcdef0123\r\n"
IDLE = head("ignore", JSON, 0)
HALF = b"POST /length HTTP/1.1\r\nHost: x\r\n"
BUSY = head("read_then_stream", JSON, 100)  # without its body


@pytest.fixture
def others(monkeypatch):
    monkeypatch.setattr(
        "touchline.api.middleware.connections._is_this_machine", lambda address: address == OURS
    )


def connect_from(address, port, *sent):
    line = socket.create_connection((OURS, port), timeout=10, source_address=(address, 0))
    for data in sent:
        line.sendall(data)
    return line


def known(headers):
    return has_token(headers, "0123456789abcdef0123")


def status_from(address, port, more=b""):
    """What a new connection is answered; None where it is closed without an answer."""
    with suppress(OSError, TypeError), connect_from(address, port) as line:
        line.sendall(IDLE[:-2] + more + b"\r\n")
        return answer(line)[0]
    return None


def test_one_other_machine_has_so_many_connections_and_no_more(others):
    with serving(limited_connections(per_address=3), text_s=LONG_S) as port, ExitStack() as ends:
        lines = [ends.enter_context(connect_from("127.0.0.2", port, BUSY)) for _ in range(3)]
        until(lambda: status_from("127.0.0.2", port), lambda status: status == 503)
        with connect_from("127.0.0.2", port) as fourth:
            assert refusal(fourth) == (503, "too-many-connections")
        assert status_from("127.0.0.3", port) == status_from(OURS, port) == 200
        lines[0].close()
        # it learns of the end in its time
        until(lambda: status_from("127.0.0.2", port), lambda status: status == 200)


@pytest.mark.parametrize("sent", [IDLE, HALF, b""])
def test_of_one_machine_what_waits_longest_is_closed_for_a_new_connection(others, sent):
    with serving(limited_connections(per_address=3, head_s=LONG_S)) as port, ExitStack() as ends:
        lines = []
        for _ in range(3):
            lines.append(ends.enter_context(connect_from("127.0.0.2", port, sent)))
            if sent == IDLE:
                assert answer(lines[-1])[0] == 200
        assert status_from("127.0.0.2", port) == 200
        assert is_closed(lines[0], LONG_S) and not is_closed(lines[2], 0.1)


def test_a_websocket_lives_on_and_counts_until_its_end(others):
    from websockets.sync.client import connect as open_socket

    with serving(limited_connections(head_s=0.3, per_address=1)) as port:
        with open_socket(
            f"ws://{OURS}:{port}/shout", close_timeout=1, source_address=("127.0.0.2", 0)
        ) as viewer:
            time.sleep(0.5)
            viewer.send("still here")
            assert viewer.recv(timeout=LONG_S) == "still here"
            assert status_from("127.0.0.2", port) == 503 and status_from("127.0.0.3", port) == 200
        until(lambda: status_from("127.0.0.2", port), lambda status: status == 200)


def test_nobody_shuts_out_this_machine_or_who_has_the_token(others):
    """Ten other machines hold whatever they may: half heads, idle connections, and requests without an end."""
    with (
        serving(
            limited_connections(most=24, per_address=4, head_s=LONG_S, is_known=known),
            text_s=LONG_S,
        ) as port,
        ExitStack() as ends,
    ):
        for sent in (HALF, IDLE, b"", BUSY):
            for machine in range(2, 12):
                for _ in range(4):
                    ends.enter_context(connect_from(f"127.0.1.{machine}", port, sent))
            until(lambda: status_from("127.0.0.9", port, TOKEN), lambda status: status == 200)
            for _ in range(10):
                assert (
                    status_from(OURS, port) == 200 and status_from("127.0.0.9", port, TOKEN) == 200
                ), sent
                assert sent == BUSY or status_from("127.0.0.8", port) == 200, (
                    "who only waits keeps nobody out"
                )
        for upgrade in (b"", b"Connection: Upgrade\r\nUpgrade: websocket\r\n"):
            with connect_from("127.0.0.8", port, IDLE[:-2] + upgrade + b"\r\n") as line:
                assert refusal(line) == (503, "too-many-connections"), (
                    "the reserve is not for everybody"
                )
                assert is_closed(line, LONG_S)


@pytest.mark.parametrize(
    ("address", "is_ours"),
    [
        ("127.0.0.1", True),
        ("127.8.8.8", True),
        ("::1", True),
        ("", True),
        ("::ffff:127.0.0.1", True),
        ("192.168.1.7", False),
        ("::ffff:10.0.0.1", False),
    ],
)
def test_this_machine_is_told_from_others(address, is_ours):
    from touchline.api.middleware.connections import _is_this_machine

    assert _is_this_machine(address) is is_ours


def test_two_servers_count_apart():
    assert limited_connections().open is not limited_connections().open
    assert issubclass(limited_connections(), LimitedConnection)


def test_callers_who_misbehave_or_leave_are_no_errors_of_the_server(tmp_path):
    """A socket's text that is no UTF-8 closes it; an upload that is cut off has nobody who could read an answer."""
    with open(tmp_path / "log", "w+") as log, served(tmp_path / "data", log=log) as url:
        for _ in range(3):
            jobs = f"{url.replace('http', 'ws')}{API}/jobs/stream"
            with websocket_connect(jobs) as line, pytest.raises(ConnectionClosed) as end:
                line.send(b"\xff\xfe", text=True)
                for _ in range(10):
                    line.recv(LONG_S)
            assert end.value.rcvd.code == 1007
            with connect(int(url.rpartition(":")[2])) as line:
                line.sendall(
                    head("api/v1/snapshots", UPLOAD, 10_000).replace(b"Host: x", b"Host: 127.0.0.1")
                    + b'--b\r\nContent-Disposition: form-data; name="file"; filename="a.png"\r\n\r\nhalf'
                )
                time.sleep(0.2)  # so that it is being read
        log.seek(0)
        assert "Traceback" not in (said := log.read()) and "unexpected" not in said, said


def test_what_is_saved_is_for_its_owner_alone(tmp_path):
    with served(tmp_path / "data") as url, connect(int(url.rpartition(":")[2])) as line:
        field = json.dumps(
            {
                "name": "mine",
                "length_mm": 1000,
                "width_mm": 900,
                "regions": {"full": {"x": [-500, 500], "y": [-450, 450]}},
            }
        ).encode()
        asked = head("api/v1/fields/mine", JSON, len(field), "PUT").replace(
            b"Host: x", b"Host: 127.0.0.1"
        )
        line.sendall(asked + field)
        assert answer(line)[0] == 200
    saved = [tmp_path / "data", *(tmp_path / "data").rglob("*")]
    assert len(saved) > 4 and [path for path in saved if path.stat().st_mode & 0o077] == []
