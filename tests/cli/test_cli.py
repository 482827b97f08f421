"""The shell: results on stdout, errors with their fix on stderr, and an exit code for each kind."""

import json
import os
import re
import signal
import socket
import subprocess
import sys
from urllib.request import urlopen

import cv2
import numpy as np
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from tests.support.paths import CLICKS as CLICKS_FOLDER
from tests.support.paths import HELP, PACKAGE, ROOT
from tests.support.servers import served
from tests.support.waiting import LONG_S
from touchline.installation import __version__

CLICKS = CLICKS_FOLDER / "ssl_2008_half.json"
MANUAL = HELP / "cli.md"
TOUCHLINE = [sys.executable, "-c", "from touchline.cli import main; main()"]


@pytest.fixture
def picture(tmp_path):
    """A picture of the clicks' size."""
    path = tmp_path / "field.png"
    pixels = np.tile(np.arange(780, dtype=np.uint8), (580, 1))
    cv2.imwrite(str(path), cv2.merge([pixels, pixels // 2, 255 - pixels]))
    return path


def test_help_and_version_answer(touchline):
    code, out, _ = touchline("--help")
    assert code == 0 and "calibrate" in out and "Exit codes" in out
    assert touchline("--version")[1] == f"touchline {__version__}\n"


def test_calibrate_says_the_verdict_in_millimetres_and_writes_the_whole_record(
    touchline, picture, tmp_path
):
    code, out, err = touchline(
        "calibrate", picture, "--points", CLICKS, "-o", "cal.json", "--note", "first"
    )
    assert (code, err) == (0, "") and re.search(r"\d mm", out) and "Saved as cal.json" in out
    record = json.loads((tmp_path / "cal.json").read_text())
    assert (
        record["field"] == "ssl-2008"
        and record["note"] == "first"
        and record["image_size"] == [780, 580]
    )
    assert record["software"] == f"touchline {__version__}" and len(record["image_sha256"]) == 64
    assert len(record["observations"]) == 4


def test_json_prints_the_whole_report(touchline, picture):
    _, out, _ = touchline("calibrate", picture, "--points", CLICKS, "-o", "cal.json", "--json")
    assert json.loads(out)["rms_px"] < 1


def test_options_are_read_as_what_they_are(touchline, picture, tmp_path):
    options = ("--option", "degree=4", "--option", "robust=false")
    assert touchline("calibrate", picture, "--points", CLICKS, "-o", "cal.json", *options)[0] == 0
    assert json.loads((tmp_path / "cal.json").read_text())["options"] == {
        "degree": 4,
        "robust": False,
    }


def test_correct_writes_a_picture_of_the_corrected_size(touchline, picture, calibration, tmp_path):
    assert touchline("correct", picture, "-c", calibration, "-o", "out.png", "--margin", 10) == (
        0,
        "",
        "",
    )
    height, width = cv2.imread(str(tmp_path / "out.png")).shape[:2]
    corrected = json.loads(calibration.read_text())["corrected_size"]
    assert [width, height] == [corrected[0] + 20, corrected[1] + 20]


def test_transform_takes_points_as_words_lines_or_json_and_says_the_same(touchline, calibration):
    words = ("transform", "-c", calibration, "--from", "image", "--to", "field")
    as_words = touchline(*words, "320.5,240", "100,400")
    as_lines = touchline(*words, stdin="320.5, 240\n\n100,400\n")
    as_json = touchline(*words, "--json", stdin='{"points": [[320.5, 240], [100, 400]]}')
    assert as_words == as_lines and as_words[0] == 0
    lines = [[float(v) for v in line.split(",")] for line in as_words[1].split()]
    assert json.loads(as_json[1])["points"] == lines


def test_transform_takes_negative_coordinates_and_comes_back(touchline, calibration):
    code, out, _ = touchline(
        "transform", "-c", calibration, "--from", "field", "--to", "image", "-10,-20.5", "--json"
    )
    ((x, y),) = json.loads(out)["points"]
    _, back, _ = touchline(
        "transform", "-c", calibration, "--from", "image", "--to", "field", f"{x!r},{y!r}", "--json"
    )
    assert code == 0 and np.allclose(json.loads(back)["points"], [[-10, -20.5]], atol=1e-6)


POINTS_REFUSED = {
    "not JSON": "[1",
    "NaN": '[{"feature": "left", "points": [[NaN, 1]]}]',
    "no observations": "{}",
    "no list": "3",
    "an unknown entry": '{"observations": [], "feild": 1}',
    "no field": "[]",
    "too deep": "[" * 100_000,
}


@pytest.mark.parametrize("text", POINTS_REFUSED.values(), ids=POINTS_REFUSED.keys())
def test_a_points_file_that_is_none_is_refused_with_code_3(touchline, picture, tmp_path, text):
    (tmp_path / "p.json").write_text(text)
    code, out, err = touchline("calibrate", picture, "--points", "p.json", "-o", "cal.json")
    assert (code, out) == (3, "") and re.fullmatch(r"error: .+\nfix: .+\n", err)
    assert not (tmp_path / "cal.json").exists()


def test_each_kind_of_trouble_has_its_exit_code(touchline, picture, calibration, tmp_path):
    (tmp_path / "text.png").write_text("no picture")
    small = tmp_path / "small.png"
    cv2.imwrite(str(small), np.zeros((20, 20, 3), np.uint8))
    fit = ("--points", CLICKS, "-o", "c2.json")
    cases = [
        (2, ("frobnicate",)),
        (2, ("calibrate",)),
        (2, ("serve", "--port", "99999")),
        (2, ("calibrate", picture, *fit, "--option", "degree")),
        (2, ("transform", "-c", calibration, "--from", "image", "--to", "moon", "1,2")),
        (3, ("calibrate", "text.png", *fit)),
        (3, ("calibrate", small, *fit)),
        (3, ("calibrate", picture, *fit, "--field", "no-such")),
        (3, ("calibrate", picture, *fit, "--region", "no-such")),
        (3, ("calibrate", picture, *fit, "--rotate", "45")),
        (3, ("calibrate", picture, *fit, "--model", "no-such")),
        (3, ("calibrate", picture, *fit, "--option", "degre=3")),
        (3, ("correct", small, "-c", calibration, "-o", "o.png")),
        (3, ("correct", picture, "-c", calibration, "-o", "o.xyz")),
        (3, ("correct", picture, "-c", CLICKS, "-o", "o.png")),
        (3, ("transform", "-c", calibration, "--from", "image", "--to", "field", "1;2")),
        (3, ("transform", "-c", calibration, "--from", "image", "--to", "field", "nan,2")),
        (3, ("transform", "-c", calibration, "--from", "image", "--to", "field", "1e308,2")),
        (4, ("calibrate", "nowhere.png", *fit)),
        (4, ("correct", picture, "-c", "nowhere.json", "-o", "o.png")),
        (4, ("calibrate", picture, "--points", CLICKS, "-o", "no/such/folder/cal.json")),
        (4, ("serve", "--data", str(picture))),
    ]
    for wanted, words in cases:
        code, out, err = touchline(*words)
        assert (code, out) == (wanted, ""), (words, code, err)
        if wanted > 2:
            assert re.fullmatch(r"error: .+\nfix: .+\n", err), (words, err)
    assert not list(tmp_path.glob("o.*")) and not (tmp_path / "c2.json").exists()


def test_what_stood_there_stays_when_writing_fails(touchline, picture, calibration, tmp_path):
    before = calibration.read_bytes()
    assert (
        touchline(
            "calibrate", picture, "--points", CLICKS, "-o", calibration, "--model", "no-such"
        )[0]
        == 3
    )
    assert calibration.read_bytes() == before
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


@pytest.fixture
def commands(tmp_path):
    """Those that the manual shows, with the files that it shows in tmp_path."""
    text = MANUAL.read_text()
    for name, content in re.findall(r"```json file=(\S+)\n(.*?)```", text, re.DOTALL):
        (tmp_path / name).write_text(content)
    commands = re.findall(r"```sh run\n(.*?)```", text, re.DOTALL)
    assert len(commands) >= 4
    return commands


def test_the_manuals_way_from_a_picture_to_millimetres_does_what_it_says(
    touchline, commands, picture, tmp_path
):
    """Its commands for that, without a shell."""
    out = ""
    for command in commands:
        given, _, words = command.strip().rpartition(" | ")
        verb = words.split()[1]
        if verb in ("correct", "transform") or (verb == "calibrate" and "\n" not in words):
            code, out, err = touchline(
                *words.split()[1:], stdin=given.removeprefix("echo ").strip("'")
            )
            assert code == 0, (command, err)
    assert len(json.loads(out)["points"]) == 2
    assert (tmp_path / "corrected.png").stat().st_size > 1000


@pytest.mark.long
def test_the_manuals_commands_do_what_they_say(commands, picture, tmp_path):
    shim = tmp_path / "touchline"
    shim.write_text(
        f"#!/bin/sh\nexec '{sys.executable}' -c 'from touchline.cli import main; main()' \"$@\"\n"
    )
    shim.chmod(0o755)
    environment = {
        **os.environ,
        "PATH": f"{tmp_path}:{os.environ['PATH']}",
        "PYTHONPATH": str(PACKAGE.parent),
    }
    for command in commands:
        done = subprocess.run(
            f"set -e\n{command}",
            shell=True,
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, (command, done.stderr)
    assert json.loads(done.stdout)["points"]
    assert (tmp_path / "corrected.png").stat().st_size > 1000


@pytest.mark.long
def test_the_rest_manuals_examples_do_what_they_say(picture, tmp_path):
    clicks = re.search(r"```json file=clicks.json\n(.*?)```", MANUAL.read_text(), re.DOTALL)[1]
    (tmp_path / "clicks.json").write_text(clicks)
    examples = re.findall(
        r"```python run\n(.*?)```", (MANUAL.parent / "api.md").read_text(), re.DOTALL
    )
    assert len(examples) >= 3
    server = subprocess.Popen(
        [*TOUCHLINE, "serve", "--port", "0", "--data", str(tmp_path / "data")],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        url = server.stdout.readline().split()[-1]
        script = "\n".join(examples).replace("http://127.0.0.1:8000/", url)
        done = subprocess.run(
            [sys.executable, "-c", script + "\nprint(np.isfinite(field_mm).mean())"],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=120,
        )
        assert done.returncode == 0, done.stderr
        sentence, points, reached = done.stdout.strip().split("\n")
        assert "mm" in sentence and len(json.loads(points)) == 2 and float(reached) > 0.9
        assert (tmp_path / "corrected.png").stat().st_size > 1000
    finally:
        server.terminate()
        server.wait(10)


def test_the_rest_manual_names_every_call(tmp_path):
    from touchline.main import create_app
    from touchline.settings import Settings

    app = create_app(Settings(data=tmp_path / "data"))
    with app.state.services.store:
        paths = app.openapi()["paths"]
    text = (MANUAL.parent / "api.md").read_text()
    for path in paths:
        name = path.removeprefix("/api/v1").replace(
            "{format}", "json" if "export" in path else "png"
        )
        assert f"{name}`" in text or f"{name}?" in text, f"{path} is missing in api.md"


def test_a_server_that_cannot_start_never_says_that_it_runs(tmp_path):
    """Its data folder is another server's: it notices after the port is open."""
    data = tmp_path / "data"
    with served(data):
        second = subprocess.run(
            [*TOUCHLINE, "serve", "--port", "0", "--data", str(data)],
            cwd=ROOT,
            capture_output=True,
            text=True,
            timeout=LONG_S,
        )
    assert second.returncode == 4 and second.stdout == "" and "fix: " in second.stderr


def test_the_log_of_requests_has_no_token_of_a_mistyped_address(tmp_path):
    server = subprocess.Popen(
        [*TOUCHLINE, "serve", "-v", "--port", "0", "--data", str(tmp_path / "data")],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        url = next(line.split()[-1] for line in server.stdout if "is running at" in line)
        urlopen(f"{url}api/v1/health?n=1&token=s3cret", timeout=60).close()
        with pytest.raises(InvalidStatus):
            connect(url.replace("http", "ws") + "viser/none?token=s3cret")
        server.send_signal(signal.SIGTERM)
        told, _ = server.communicate(timeout=60)
    finally:
        server.kill()
        server.wait()
    assert (
        "s3cret" not in told
        and "/api/v1/health?n=1&token=… HTTP" in told
        and "/viser/none?token=…" in told
    )


def test_serve_says_its_address_and_sigterm_ends_it_though_a_request_is_half_sent(
    touchline, tmp_path
):
    server = subprocess.Popen(
        [*TOUCHLINE, "serve", "--port", "0", "--data", str(tmp_path / "data")],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        url = server.stdout.readline().split()[-1]
        assert json.load(urlopen(url + "api/v1/health", timeout=60))["status"] == "ok"
        port = url.rstrip("/").split(":")[-1]
        code, _, err = touchline("serve", "--port", port, "--data", tmp_path / "d2")
        assert code == 4 and "fix: Choose another port with --port" in err
        half_sent = socket.create_connection(("127.0.0.1", int(port)))
        half_sent.sendall(
            b"POST /api/v1/fit/border HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\n"
            b"Content-Length: 1000\r\n\r\n{"
        )
        urlopen(url + "api/v1/health", timeout=60).close()  # by now what came before was read
        server.send_signal(signal.SIGTERM)
        _, told = server.communicate(timeout=60)
        assert b" 503 " in half_sent.recv(1000) and "Traceback" not in told
    finally:
        server.kill()
        server.wait()
