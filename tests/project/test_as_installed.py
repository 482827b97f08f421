"""The wheel without extras, installed in an environment of its own: every module, every GET, every kind of camera."""

import re
import shlex
import subprocess
from contextlib import closing
from functools import partial
from http.client import HTTPConnection
from pathlib import Path

import pytest

from tests.support.auto_scenes import SceneSpec, scene_of
from tests.support.installed import clean_environment, installed_python, python_with_pip
from tests.support.mjpeg_camera import MjpegCamera
from tests.support.pictures import encoded
from tests.support.servers import API, Line, served
from tests.support.waiting import LONG_S, until

SCENE = SceneSpec(
    3, "ssl-div-b", "full", "mild", (816, 682), 5500.0, 12.0, 0.0, 3.0, 0.7, 2.0, 0.1, 4, 0
)
IMPORT_ALL = """
import pkgutil
from importlib import import_module
import touchline
names = [found.name for found in pkgutil.walk_packages(touchline.__path__, "touchline.")
         if "migrations" not in found.name]
for name in names:
    import_module(name)
print(len(names))
"""
# of which there is one
FOUND = {"snapshots", "calibrations", "drafts", "cameras", "fields", "jobs", "rigs"}


@pytest.fixture(scope="module")
def python() -> Path:
    return installed_python()


@pytest.fixture(scope="module")
def network_camera():
    with closing(MjpegCamera()) as camera:
        yield camera


@pytest.fixture(scope="module")
def desk(python, network_camera, tmp_path_factory):
    """A connection to a server that is installed so, whose log stays empty."""
    data = tmp_path_factory.mktemp("installed")
    (data / "shown").mkdir()
    (data / "shown" / "field.png").write_bytes(encoded("png", scene_of(SCENE).pixels))
    config, log = data / "touchline.yaml", data / "log.txt"
    config.write_text("sources: {allowed_hosts: [127.0.0.1]}\npublish: {interface: lo, ttl: 0}\n")
    with (
        log.open("w") as file,
        served(data, "--config", str(config), log=file, python=python) as url,
        closing(Line(url)) as line,
    ):
        yield line
    assert log.read_text() == ""


def made(answer) -> dict:
    """The JSON of an answer that is no refusal."""
    status, _, body = answer
    assert status < 300, (status, body)
    return body


def finished(desk, job: dict) -> dict:
    return until(
        lambda: made(desk.json("GET", f"/jobs/{job['id']}")),
        lambda now: now["state"] in ("done", "failed", "cancelled"),
    )


@pytest.fixture(scope="module")
def ids(desk, network_camera) -> dict[str, str]:
    """What there is of each kind, made as an operator makes it: a camera of each kind, a calibration without clicks."""
    sources = {
        "simulated": "sim://ssl-div-b?size=320x256&fps=5",
        "file": "picture://field.png",
        "network": network_camera.url,
    }
    for name, source in sources.items():
        made(
            desk.json(
                "POST",
                "/cameras",
                {"id": name, "source": source, "field": "ssl-div-b", "region": "full"},
            )
        )
        body = {"camera": name}
        taken = until(
            partial(desk.json, "POST", "/snapshots", body), lambda answer: answer[0] != 503
        )
        assert made(taken)["width"] > 0, name
    job = made(
        desk.json(
            "POST", "/calibrations/auto", {"camera": "file", "field": "ssl-div-b", "region": "full"}
        )
    )
    found = finished(desk, job)
    assert found["result"]["verdict"]["level"] == "good", found
    version = made(desk.json("GET", f"/calibrations/{found['result']['calibration']}"))
    made(desk.json("POST", f"/calibrations/{version['id']}/activate"))
    made(
        desk.json(
            "PUT",
            "/rigs/above",
            {"title": "", "field": "ssl-div-b", "cameras": [{"camera": "file", "region": "full"}]},
        )
    )
    return {
        "calibrations": version["id"],
        "other": version["id"],
        "snapshots": version["snapshot"],
        "drafts": version["snapshot"],
        "cameras": "file",
        "fields": "ssl-div-b",
        "jobs": job["id"],
        "rigs": "above",
    }


def test_every_get_of_the_rest_description_answers(desk, ids):
    """Whatever there is of the kind is asked for; of kinds of which there is none, one that does not exist."""
    description = made(desk.json("GET", "/openapi.json"))
    refused = {}
    for path, calls in description["paths"].items():
        for asked in addresses(path, calls["get"], ids) if "get" in calls else ():
            status = status_of(desk, asked)
            kind = asked.split("/")[1]
            is_there = "{" not in path or (kind in FOUND and "none-such" not in asked)
            if status >= 500 or (is_there and status >= 400 and not may_refuse(asked)):
                refused[asked] = status
    assert not refused


def addresses(path: str, call: dict, ids: dict[str, str]) -> list[str]:
    """The path with its words filled in: once for each value of one that takes only some."""
    found = [path.removeprefix(API)]
    kind = found[0].split("/")[1]
    for parameter in call.get("parameters", ()):
        name = "{" + parameter["name"] + "}"
        values = parameter["schema"].get("enum") or [
            ids.get(parameter["name"]) or ids.get(kind, "none-such")
        ]
        if name in path:
            found = [address.replace(name, value) for address in found for value in values]
    return found


def may_refuse(address: str) -> bool:
    """What one camera with a division lens has not: detection running, or a form in another program's file."""
    return bool(re.search(r"/(rolls|detections|tracks|seeing|controls)$|/export/", address))


def status_of(desk, path: str) -> int:
    """The status of an answer, and the beginning of what it holds: a stream has no end."""
    with closing(HTTPConnection(desk.place, timeout=LONG_S)) as line:
        line.request("GET", API + path)
        answer = line.getresponse()
        answer.read1(1 << 16)
        return answer.status


def test_every_module_can_be_imported(python, tmp_path):
    done = subprocess.run(
        [python, "-c", IMPORT_ALL],
        cwd=tmp_path,
        env=clean_environment(),
        capture_output=True,
        text=True,
        timeout=LONG_S,
    )
    assert done.returncode == 0 and int(done.stdout) > 300, done.stderr


@pytest.mark.parametrize(
    "package, script",
    [
        (
            "distributed",
            "from touchline.jobs.dask_runner import DaskCluster\nDaskCluster('dask://host:8786')",
        ),
        (
            "psycopg[binary]",
            "from sqlalchemy import make_url\nfrom touchline.store.database import postgresql_engine\n"
            "postgresql_engine(make_url('postgresql+psycopg://touchline@127.0.0.1/touchline'), 1)",
        ),
    ],
)
def test_what_needs_another_package_states_the_command_that_installs_it_here(
    python, tmp_path, package, script
):
    code = (
        f"from touchline.cli.console import exit_code_of\ntry:\n    {script.replace(chr(10), chr(10) + '    ')}\n"
        "except Exception as error:\n    raise SystemExit(exit_code_of(error))"
    )
    done = subprocess.run(
        [python, "-c", code],
        cwd=tmp_path,
        env=clean_environment(),
        capture_output=True,
        text=True,
        timeout=LONG_S,
    )
    assert done.returncode == 3, done.stderr
    command = re.search(r"fix: Run (.+), then start Touchline again\.", done.stderr)[1]
    *pip, named = shlex.split(command)
    assert pip == ["python3", "-m", "pip", "--python", str(python), "install"] and named == package
    tried = subprocess.run(
        [python_with_pip(), *pip[1:], "--dry-run", "--no-deps", "--quiet", named],
        env=clean_environment(),
        capture_output=True,
        text=True,
    )
    assert tried.returncode == 0, tried.stderr
