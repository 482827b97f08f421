"""What the documentation promises holds for any request it allows, and nothing that is sent breaks the server.

A real server in a process of its own. schemathesis makes requests from its documentation, good ones and bad ones;
hypothesis puts into good bodies what schemathesis does not: NaN, infinities, 1e999, half surrogates, endless numbers,
names and nestings, in any place.
"""

import copy
import json
import os
import signal
import subprocess
import sys
from contextlib import closing
from http.client import HTTPConnection
from unittest import SkipTest
from urllib.parse import urlsplit

import hypothesis
import numpy as np
import pytest
import schemathesis
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.errors import Unsatisfiable
from schemathesis import GenerationMode
from schemathesis.checks import Failure, not_a_server_error
from schemathesis.specs.openapi.checks import (
    allow_header_conformance,
    content_type_conformance,
    response_headers_conformance,
    response_schema_conformance,
    status_code_conformance,
    unsupported_method,
)

from tests.support.paths import ROOT
from tests.support.pictures import encoded, gradient
from tests.support.tiers import long
from tests.support.waiting import LONG_S

API = "/api/v1"
TASK = json.loads((ROOT / "tests" / "clicks" / "ssl_2008_half.json").read_text())
PROMISES = [
    not_a_server_error,
    status_code_conformance,
    content_type_conformance,
    response_schema_conformance,
    response_headers_conformance,
    allow_header_conformance,
    unsupported_method,
]
FEW = 2  # requests for each call
MANY = int(os.environ.get("TOUCHLINE_CONTRACT_CASES", "12"))  # a night may take more
SLOW = {
    "POST /calibrations/{id}/check",
    "GET /calibrations/{id}/exports",
    "GET /calibrations/{id}/scene.html",
    # a second each
    "POST /pairs",
    "POST /rigs/{name}/check",
    "GET /cameras/found",
    "POST /cameras/test",
}
PATIENT = [
    HealthCheck.too_slow,
    HealthCheck.filter_too_much,
    HealthCheck.data_too_large,
    HealthCheck.function_scoped_fixture,
]


class Server:
    """A running server, and things that are there: a snapshot, a calibration, a camera."""

    def __init__(self, url: str) -> None:
        self.url = url
        _, self.snapshot = self.upload(encoded("png", gradient(780, 580)))
        _, self.calibration = self.ask(
            "POST",
            "/calibrations",
            json.dumps(
                {
                    **{k: v for k, v in TASK.items() if k != "image_size"},
                    "camera": "north",
                    "snapshot": self.snapshot["id"],
                }
            ).encode(),
        )
        # the active one cannot be deleted
        self.ask("POST", f"/calibrations/{self.calibration['id']}/activate")

    def upload(self, picture: bytes):
        """Status, and the JSON of the answer."""
        form = (
            b'--b\r\nContent-Disposition: form-data; name="file"; filename="a"\r\n\r\n'
            + picture
            + b"\r\n--b--\r\n"
        )
        return self.ask("POST", "/snapshots", form, "multipart/form-data; boundary=b")

    def ask(
        self, method: str, path: str, body: bytes | None = None, type: str = "application/json"
    ):
        """Status, and the JSON of the answer."""
        with closing(HTTPConnection(urlsplit(self.url).netloc, timeout=30)) as line:
            line.request(method, API + path, body, {"Content-Type": type})
            answer = line.getresponse()
            content = answer.read()
        if "json" not in answer.headers.get("content-type", ""):
            return answer.status, content
        return answer.status, json.loads(
            content, parse_constant=lambda constant: pytest.fail(f"{constant} was sent")
        )


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    data = tmp_path_factory.mktemp("data")
    config = data / "touchline.yaml"
    config.write_text(
        'cameras: [{id: north, source: "sim://table?size=320x256&fps=200", field: table}]\n'
        "publish: {interface: lo, ttl: 0}\n"
    )
    process = subprocess.Popen(
        [
            sys.executable,
            "-c",
            "from touchline.cli import main; main()",
            "serve",
            "--port",
            "0",
            "--data",
            str(data),
            "--config",
            str(config),
        ],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        yield Server(process.stdout.readline().split()[-1].rstrip("/"))
        assert process.poll() is None, "the server has died"
    finally:
        process.send_signal(signal.SIGTERM)
        process.wait(10)


def effort(cases):
    """So many requests: a few that are always the same, or many that are new each time."""
    return settings(
        max_examples=cases,
        derandomize=cases < MANY,
        deadline=None,
        suppress_health_check=PATIENT,
        database=None,
    )


cases_each = pytest.mark.parametrize("cases", [FEW, long(MANY)], ids=["few", "many"])


@cases_each
@pytest.mark.parametrize("mode", GenerationMode)
def test_every_call_keeps_what_the_documentation_promises(server, mode, cases):
    documentation = schemathesis.openapi.from_url(f"{server.url}{API}/openapi.json")
    calls = [operation.ok() for operation in documentation.get_all_operations()]
    assert len(calls) > 20
    broken = {}
    for call in calls:
        if cases < MANY and call.label.replace(API, "") in SLOW:
            continue

        @effort(cases)
        @given(case=call.as_strategy(generation_mode=mode))
        def keeps(case):
            meet_what_is_there(case, server)
            case.call_and_validate(checks=PROMISES, timeout=LONG_S)

        try:
            keeps()
        except (Unsatisfiable, SkipTest):
            pass  # nothing can be wrong about a call without parameters
        except BaseExceptionGroup as failures:
            broken[call.label] = "\n".join(str(failure) for failure in failures.exceptions)
        except (AssertionError, Failure) as failure:
            broken[call.label] = str(failure)
    assert not broken, "\n\n".join(f"{label}\n{text}" for label, text in broken.items())


def meet_what_is_there(case, server):
    """Two of three ids and names are those of something that is there; random ones never are."""
    known = {
        "snapshots": server.snapshot["id"],
        "drafts": server.snapshot["id"],
        "fields": "table",
        "calibrations": server.calibration["id"],
    }
    kind = case.path.split("/")[3]
    if kind == "publishing" and isinstance(case.body, dict) and case.body.get("interface") == "":
        case.body["interface"] = "lo"  # what a test publishes stays on this machine
    for name, value in list((case.path_parameters or {}).items()):
        if name in ("id", "snapshot", "name") and kind in known and len(str(value)) % 3:
            case.path_parameters[name] = known[kind]
        if name == "format" and "export" in case.path:
            case.path_parameters[name] = "json" if len(str(value)) % 3 else value


STRANGE = st.sampled_from(
    [
        "NaN",
        "Infinity",
        "-Infinity",
        "1e999",
        "-1e999",
        "1e308",
        "1e-320",
        "-0.0",
        "9" * 5000,
        "0." + "1" * 5000,
        "1E400",
        '"\\ud800"',
        '"\\udfff\\ud800"',
        '"\\u0000"',
        '"nan"',
        '"' + "x" * 70_000 + '"',
        '"../../etc/passwd"',
        '"%2e%2e/"',
        "true",
        "null",
        "{}",
        "[]",
        "[[]]",
        '{"a": ' * 500 + "1" + "}" * 500,
        "[" * 50_000,
        '{"__proto__": 1}',
        "0x10",
        "01",
        "'x'",
        "1e5",
        "2.0",
        "18446744073709551616",
        '"\U0001f916"',
        '"<script>alert(1)</script>"',
        "",
    ]
)


def places(value, path=()):
    """The path of every entry of a body."""
    yield path
    for key, item in (
        value.items()
        if isinstance(value, dict)
        else enumerate(value)
        if isinstance(value, list)
        else ()
    ):
        yield from places(item, (*path, key))


def with_strange(body, path, strange):
    """The body as text, with a strange piece of text in one place."""
    if not path:
        return strange
    body = copy.deepcopy(body)
    inside = body
    for key in path[:-1]:
        inside = inside[key]
    inside[path[-1]] = "@@@"
    return json.dumps(body).replace('"@@@"', strange)


BODIES = {
    "border": lambda s: (
        "POST",
        "/fit/border",
        {
            "points": TASK["observations"][0]["points"],
            "axis": "x_of_y",
            "degree": 3,
            "image_size": [780, 580],
        },
    ),
    "preview": lambda s: (
        "POST",
        "/fit/preview",
        {**TASK, "options": {"degree": 3}, "rotate": 90, "note": "n"},
    ),
    "calibrate": lambda s: (
        "POST",
        "/calibrations",
        {**TASK, "camera": "south", "options": {"robust": True}},
    ),
    "transform": lambda s: (
        "POST",
        f"/calibrations/{s.calibration['id']}/transform",
        {"from": "image", "to": "field", "points": [[1, 2], [3, 4]], "z_mm": 0},
    ),
    "draft": lambda s: (
        "PUT",
        f"/drafts/{s.snapshot['id']}",
        {"field": "table", "options": {"degree": 2}, "observations": TASK["observations"][:1]},
    ),
    "field": lambda s: (
        "PUT",
        "/fields/mine",
        {
            "name": "mine",
            "length_mm": 3000,
            "width_mm": 2000,
            "lines": [{"name": "a", "from": [0, 0], "to": [0, 9]}],
            "landmarks": {"b": [0, 1]},
            "regions": {"full": {"x": [-1500, 1500], "y": [-1000, 1000]}},
        },
    ),
    "snapshot": lambda s: ("POST", "/snapshots", {"camera": "north"}),
    "detections": lambda s: (
        "POST",
        "/detections",
        {
            "snapshot": s.snapshot["id"],
            "mm_per_px": 3.0,
            "eye_mm": [0, 0, 4000],
            "clicks": {"blue": [[20, 30]]},
            "colours": {
                "name": "here",
                "colours": {"orange": [{"rgb": [250, 112, 30], "spread": 0.02}]},
                "reach": 3.0,
            },
            "stages": {
                "name": "mine",
                "title": "Mine",
                "stages": [
                    {"stage": "colours", "everywhere": ["orange", "blue"], "follow": True},
                    {"stage": "blobs", "least_px": 3},
                    {"stage": "ball", "most": 2},
                    {"stage": "places"},
                ],
            },
        },
    ),
    "publishing": lambda s: (
        "PUT",
        "/publishing",
        {
            "enabled": True,
            "absorb": True,
            "group": "239.255.3.4",
            "port": 23458,
            "interface": "lo",
            "ttl": 0,
            "interval_s": 1.0,
            "limit_mm": 5.0,
            "field": "table",
            "numbers": {"north": 3},
            "approved": {"north": "abc"},
        },
    ),
}


@cases_each
@pytest.mark.parametrize("name", BODIES)
def test_nothing_strange_in_a_good_body_breaks_anything(server, name, cases):
    method, path, body = BODIES[name](server)

    @effort(cases * 8)
    @given(place=st.sampled_from(list(places(body))), strange=STRANGE)
    def is_told(place, strange):
        text = with_strange(body, place, strange)
        status, answer = server.ask(method, path, text.encode("utf-8", "surrogatepass"))
        assert status in (200, 201) or 400 <= status < 500, (status, answer)
        if status >= 400:
            assert answer["fix"] and answer["detail"]

    is_told()


TYPES = [
    "application/json",
    "multipart/form-data; boundary=b",
    "",
    "x/y",
    "application/octet-stream",
    "application/json; charset=x",
]
PATHS = [
    "/snapshots",
    "/calibrations/import",
    "/fit/border",
    "/calibrations",
    "TRANSFORM",
    "CORRECT",
]


@cases_each
def test_no_bytes_break_anything(server, cases):
    @effort(cases * 8)
    @given(body=st.binary(max_size=400), type=st.sampled_from(TYPES), path=st.sampled_from(PATHS))
    def is_answered(body, type, path):
        path = {
            "TRANSFORM": f"/calibrations/{server.calibration['id']}/transform?from=image&to=field",
            "CORRECT": f"/calibrations/{server.calibration['id']}/correct",
        }.get(path, path)
        status, answer = server.ask("POST", path, body, type)
        assert status == 200 or 400 <= status < 500, (status, answer)

    is_answered()


PICTURE_CALLS = {
    **{
        f"{plan} {scale}": lambda s, id, plan=plan, scale=scale: (
            "POST",
            "/detections",
            {"snapshot": id, "stages": plan, "mm_per_px": scale},
        )
        for plan in ("ssl", "vsss", "mirosot")
        for scale in (1e-3, 50)
    },
    "clicked colours": lambda s, id: (
        "POST",
        "/detections",
        {
            "snapshot": id,
            "stages": "ssl",
            "mm_per_px": 3.0,
            "clicks": {"blue": [[1, 1]], "orange": [[0, 0, 1, 1]]},
        },
    ),
    "drawn": lambda s, id: (
        "POST",
        "/detections/picture.jpg",
        {"snapshot": id, "stages": "ssl", "mm_per_px": 3.0},
    ),
    "snapped": lambda s, id: (
        "POST",
        f"/snapshots/{id}/snap",
        {"points": [[0, 0], [1, 1], [0.5, 0]]},
    ),
    "small": lambda s, id: ("GET", f"/snapshots/{id}/image.png?width=16", None),
    "large": lambda s, id: ("GET", f"/snapshots/{id}/image.jpg?width=8192", None),
    "corrected": lambda s, id: (
        "GET",
        f"/calibrations/{s.calibration['id']}/corrected.png?snapshot={id}",
        None,
    ),
    "previewed": lambda s, id: (
        "POST",
        "/fit/preview",
        {**{k: v for k, v in TASK.items() if k != "image_size"}, "snapshot": id},
    ),
}
SIDE = st.sampled_from([1, 2, 3, 7, 64, 400, 4000])
KINDS = {
    "black": lambda shape: np.zeros(shape, np.uint8),
    "white": lambda shape: np.full(shape, 255, np.uint8),
    "noise": lambda shape: np.random.default_rng(0).integers(0, 256, shape, np.uint8),
    "stripes": lambda shape: np.resize(np.array([0, 0, 0, 255, 255, 255], np.uint8), shape),
}


@cases_each
def test_no_picture_breaks_anything(server, cases):
    @effort(cases * 8)
    @given(
        width=SIDE,
        height=SIDE,
        kind=st.sampled_from(sorted(KINDS)),
        call=st.sampled_from(sorted(PICTURE_CALLS)),
    )
    def is_answered(width, height, kind, call):
        hypothesis.assume(width * height <= 2e6)
        status, kept = server.upload(encoded("png", KINDS[kind]((height, width, 3))))
        assert status == 201 or (status == 422 and min(width, height) == 1), (status, kept)
        if status == 201:
            method, path, body = PICTURE_CALLS[call](server, kept["id"])
            status, answer = server.ask(
                method, path, None if body is None else json.dumps(body).encode()
            )
            assert status == 200 or 400 <= status < 500, (call, width, height, kind, status, answer)

    is_answered()


HEADERS = [
    "Host",
    "Origin",
    "Cookie",
    "Authorization",
    "Range",
    "If-Match",
    "If-None-Match",
    "Content-Type",
    "Accept",
    "Accept-Encoding",
    "Sec-Fetch-Site",
    "Sec-Fetch-Mode",
    "X-Operator",
    "X-Forwarded-For",
    "Upgrade",
    "Expect",
]
VALUES = st.one_of(
    st.text(
        st.characters(min_codepoint=32, max_codepoint=255, exclude_characters="\x7f"), max_size=200
    ),
    st.sampled_from(
        [
            "",
            "[",
            "http://[",
            "//[::1",
            "null",
            "bytes=-",
            "bytes=9-1,,",
            "bytes=" + "9" * 400,
            'W/"',
            "*",
            "gzip;q=nan",
            "a=b; " * 2000,
            "touchline=\xff",
            "Bearer",
            "websocket",
            "multipart/form-data",
            "multipart/form-data; boundary=",
            "100-continue",
        ]
    ),
)


@cases_each
def test_no_header_breaks_anything(server, cases):
    calls = [
        "GET /",
        "GET /api/v1/health",
        "GET /api/v1/settings",
        "GET /main.js",
        "POST /api/v1/snapshots",
        f"GET /api/v1/snapshots/{server.snapshot['id']}/image.png",
        "PUT /api/v1/fields/mine",
        "POST /login",
        "GET /login",
    ]

    @effort(cases * 20)
    @given(
        headers=st.dictionaries(st.sampled_from(HEADERS), VALUES, max_size=4),
        call=st.sampled_from(calls),
    )
    def is_answered(headers, call):
        method, path = call.split()
        with closing(HTTPConnection(urlsplit(server.url).netloc, timeout=30)) as line:
            line.putrequest(method, path, skip_host="Host" in headers, skip_accept_encoding=True)
            for name, value in headers.items():
                line.putheader(name, value.encode("latin-1"))
            line.putheader("Content-Length", "2")
            line.endheaders(b"{}")
            assert line.getresponse().status < 500, (call, headers)

    is_answered()


def test_the_server_is_as_well_as_before(server):
    """Last in this file: what came in above has left nothing broken behind."""
    assert server.ask("GET", "/health")[1]["status"] == "ok"
    assert (
        server.ask("GET", f"/calibrations/{server.calibration['id']}")[1]["report"]
        == server.calibration["report"]
    )
