"""touchline call: any call of the REST interface, in this process or at a running server."""

import io
import json
import sys

import numpy as np
import pytest

from tests.support.exported import example
from tests.support.pictures import encoded, gradient
from tests.support.servers import served
from touchline.cli.call import Call, calls_of, filled, request_of
from touchline.core.errors import BadInput
from touchline.formats import FORMATS


@pytest.fixture
def files(tmp_path):
    (tmp_path / "cal.json").write_bytes(FORMATS["json"].write(example("division", 0)))
    (tmp_path / "field.png").write_bytes(encoded("png", gradient(64, 48)))
    return tmp_path


# --- what is written


def test_lines_name_their_answers_and_write_to_files(tmp_path):
    read = calls_of("""
        # a calibration, and its error
        made = POST /calibrations/import file=@cal.json
        GET /calibrations/${made.id}/uncertainty.json z_mm=150 > error.json
        PUT /rigs/hall {"title": "Hall > all", "cameras": ["a", "b"]}
        put /rigs/hall {"title": "b = POST /c"} > rig.json
        PUT /rigs/hall {"title": "a > b"}
    """)
    assert [(one.method, one.path, one.name, one.output and one.output.name) for one in read] == [
        ("POST", "/calibrations/import", "made", None),
        ("GET", "/calibrations/${made.id}/uncertainty.json", None, "error.json"),
        ("PUT", "/rigs/hall", None, None),
        ("PUT", "/rigs/hall", None, "rig.json"),
        ("PUT", "/rigs/hall", None, None),
    ]
    assert read[2].body == ('{"title": "Hall > all", "cameras": ["a", "b"]}',)
    assert read[3].body == ('{"title": "b = POST /c"}',) and read[4].body == ('{"title": "a > b"}',)


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("GET", "Line 2"),
        ("FETCH /cameras", "FETCH"),
        ("GET cameras", "is not a call"),
        ("a = ", "is not a call"),
        ("POST /x 'a=1", "Line 2"),
    ],
)
def test_a_line_that_is_no_call_is_named(line, says):
    with pytest.raises(BadInput, match=says):
        calls_of(f"GET /cameras\n{line}")


def test_answers_of_earlier_calls_are_filled_in_as_text_and_as_json():
    answers = {"a": {"id": 'x"y', "items": [{"n": 1.5}, None]}}
    call = filled(
        Call("POST", "/c/${a.items.0.n}", ('{"id": "${a.id}", "of": ${a.items}}',)), answers
    )
    assert call.path == "/c/1.5" and json.loads(call.body[0]) == {
        "id": 'x"y',
        "of": [{"n": 1.5}, None],
    }
    for unknown in ("${b}", "${a.none}", "${a.items.2}", "${a.id.0.z}"):
        with pytest.raises(BadInput, match="No earlier call"):
            filled(Call("GET", f"/c/{unknown}"), answers)


def test_a_body_is_json_entries_a_file_or_both(files, monkeypatch):
    def body(*words, method="POST"):
        return request_of(Call(method, "/x", words))

    monkeypatch.chdir(files)
    assert body("a=1", "b=text", "c=[1]", "d=a=b") == (
        "/x",
        {"json": {"a": 1, "b": "text", "c": [1], "d": "a=b"}},
    )
    assert body("z_mm=150", "a=1 2", method="GET") == ("/x?z_mm=150&a=1+2", {})
    (files / "body.json").write_text('{"a": 1, "b": 2}')
    assert body("@body.json", "b=3", "c=true") == ("/x", {"json": {"a": 1, "b": 3, "c": True}})
    _, whole = body("@body.json")
    assert whole == {
        "content": b'{"a": 1, "b": 2}',
        "headers": {"Content-Type": "application/json"},
    }
    points = np.arange(4.0).tobytes()
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(points)))
    assert body("-")[1] == {
        "content": points,
        "headers": {"Content-Type": "application/octet-stream"},
    }
    upload = body("file=@field.png", "camera=north")[1]
    assert upload["files"]["file"] == ("field.png", (files / "field.png").read_bytes())
    assert upload["data"] == {"camera": "north"}


@pytest.mark.parametrize("words", [("a",), ("a=1", "a=2"), ("=1",), ("[1]", "a=1"), ("{", "a=1")])
def test_a_body_that_is_none_is_refused(words):
    with pytest.raises(BadInput):
        request_of(Call("POST", "/x", words))


# --- in this process


def test_many_calls_use_one_start_and_the_answers_of_one_another(touchline, files):
    (files / "calls.txt").write_text("""
        made = POST /calibrations/import file=@cal.json
        POST /calibrations/${made.id}/transform {"from": "image", "to": "field", "points": [[300, 200], [-9999, 0]]}
        GET /calibrations/${made.id}/export/npz > table.npz
    """)
    code, out, err = touchline("call", "--calls", "calls.txt", "--temporary")
    assert (code, err) == (0, "")
    near, far = json.loads(out)["points"]
    assert len(near) == 2 and far is None
    assert "map_x" in np.load(files / "table.npz") or np.load(files / "table.npz").files


def test_a_data_folder_keeps_what_a_call_saved_and_the_next_one_reads_it(touchline, files):
    code, out, _ = touchline(
        "call", "POST", "/calibrations/import", "file=@cal.json", "--data", "kept"
    )
    made = json.loads(out)
    assert code == 0
    code, out, _ = touchline("call", "GET", "/calibrations", "--data", "kept", "--out", "all.json")
    assert (code, out) == (0, "")
    assert [one["id"] for one in json.loads((files / "all.json").read_text())["items"]] == [
        made["id"]
    ]


def test_refusals_have_the_fix_and_the_exit_codes_of_all_commands(touchline, files):
    for wanted, words in (
        (3, ("GET", "/calibrations/none")),
        (3, ("POST", "/calibrations/import", "file=@field.png")),
        (4, ("POST", "/snapshots", "file=@nowhere.png")),
    ):
        code, out, err = touchline("call", *words, "--temporary")
        assert (code, out) == (wanted, "") and err.startswith("error: ") and "\nfix: " in err, (
            words,
            err,
        )
    for words in (
        (),
        ("GET",),
        ("GET", "cameras"),
        ("GET", "/health", "--calls", "calls.txt"),
        ("GET", "/health", "--temporary", "--server", "http://127.0.0.1:1"),
        ("GET", "/health", "--header", "no header", "--temporary"),
    ):
        code, out, _ = touchline("call", *words)
        assert code in (2, 3) and out == "", words
    assert touchline("call", "GET", "/health", "--server", "http://127.0.0.1:1")[0] == 4
    assert touchline("call", "GET", "/health", "--server", "ftp://example")[0] == 3


# --- at a running server


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    with served(tmp_path_factory.mktemp("served")) as url:
        yield url


def test_a_running_server_is_called_by_its_address(touchline, files, server):
    at = ("--server", server)
    code, out, err = touchline("call", "POST", "/calibrations/import", "file=@cal.json", *at)
    assert (code, err) == (0, "")
    id = json.loads(out)["id"]
    code, out, _ = touchline(
        "call",
        "POST",
        f"/calibrations/{id}/transform?from=image&to=field",
        "-",
        *at,
        stdin="[[300, 200]]",
    )
    assert code == 3  # a bare list is no body of that call
    code, out, _ = touchline(
        "call",
        "POST",
        f"/calibrations/{id}/transform",
        "-",
        *at,
        stdin='{"from": "image", "to": "field", "points": [[300, 200]]}',
    )
    assert code == 0 and len(json.loads(out)["points"][0]) == 2
    code, out, _ = touchline(
        "call", "GET", f"/calibrations/{id}/report.html", "-o", "report.html", *at
    )
    assert (code, out) == (0, "") and "<html" in (files / "report.html").read_text()
    report = touchline("call", "GET", f"/calibrations/{id}/report.json", *at)[1]
    level = json.loads(report)["verdict"]["level"]
    code = touchline("call", "GET", f"/calibrations/{id}/report.json", "--enough", "good", *at)[0]
    assert code == (0 if level == "good" else 5)
    code, out, _ = touchline(
        "call", "PATCH", f"/calibrations/{id}", "note=later", "--header", 'If-Match: "old"', *at
    )
    assert code == 3


def test_a_job_is_waited_for_or_only_started(touchline, files, server):
    at = ("--server", server)
    snapshot = json.loads(touchline("call", "POST", "/snapshots", "file=@field.png", *at)[1])["id"]
    code, out, err = touchline("call", "POST", "/calibrations/auto", f"snapshot={snapshot}", *at)
    # nothing is seen in a gradient
    assert code == 0 and json.loads(out)["calibration"] is None, err
    code, out, _ = touchline(
        "call", "POST", "/calibrations/auto", f"snapshot={snapshot}", "--no-wait", *at
    )
    job = json.loads(out)
    assert code == 0 and job["state"] in ("queued", "running", "done")
    assert touchline("call", "DELETE", f"/jobs/{job['id']}", *at)[0] == 0
