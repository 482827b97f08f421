"""A capability in a package that is installed beside Touchline, as static/help/contributing.md has it."""

import os
import re
import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import ClassVar

import pytest
from starlette.testclient import TestClient

from tests.support.activation import activate_despite
from tests.support.exported import example
from tests.support.installed import python_with_pip
from tests.support.paths import HELP, ROOT
from tests.support.refusals import API, refusal
from tests.support.servers import served
from touchline import Client, capabilities
from touchline.capabilities import Capability
from touchline.core.records import Warning
from touchline.core.registry import load
from touchline.formats import FORMATS
from touchline.main import create_app
from touchline.services.running_part import RunningPart
from touchline.settings import Settings
from touchline.store.fields import load_fields


def package_of_the_manual(folder: Path) -> Path:
    """The files of the manual's section."""
    section = (
        (HELP / "contributing.md")
        .read_text()
        .partition("## A capability in a package of its own")[2]
    )
    files = re.findall(
        r"In `([\w/.]+)`[^`]*(?:`[^`]*`[^`]*)?:\n\n```\w+\n(.*?)```",
        section.partition("\n## ")[0],
        re.DOTALL,
    )
    assert len(files) == 5
    for name, text in files:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return folder


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """The environment of a process in which the package is installed."""
    source = package_of_the_manual(tmp_path_factory.mktemp("census"))
    target = tmp_path_factory.mktemp("packages")
    pip = [python_with_pip(), "-m", "pip", "--python", sys.executable]
    done = subprocess.run(
        [
            *pip,
            "install",
            "--quiet",
            "--no-deps",
            "--no-build-isolation",
            "--target",
            target,
            source,
        ],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    path = os.pathsep.join([str(target), *filter(None, [os.environ.get("PYTHONPATH")])])
    return {**os.environ, "PYTHONPATH": path}


def test_its_route_its_job_and_its_command_are_there(installed, tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", installed["PYTHONPATH"])
    with served(tmp_path / "data") as url, Client(url) as client:
        record = FORMATS["json"].write(example("division", 0))
        made = client.call(
            "POST", "/calibrations/import", files={"file": ("c.json", record)}
        ).json()
        expected = sum(len(one["points"]) for one in made["observations"])
        seen = []
        job = client.call("POST", "/census").json()
        assert client.wait(job, lambda share, message: seen.append(message))["points"] == {
            made["id"]: expected
        }
        assert "/api/v1/census" in client.call("GET", "/openapi.json").json()["paths"]
        command = [sys.executable, "-c", "from touchline.cli import main; main()"]
        done = subprocess.run(
            [*command, "census", url], cwd=ROOT, env=installed, capture_output=True, text=True
        )
        assert done.stdout.strip() == str(expected), done.stderr
        listed = subprocess.run(
            [*command, "--help"], cwd=ROOT, env=installed, capture_output=True, text=True
        ).stdout
        assert "census" in listed and "Print how many points" in listed


class Beside:
    """What the entry points of these tests name."""

    CENSUS = Capability(commands={"census": ("tests.api.nowhere:census", "Count.")})
    TAKEN = Capability(jobs={"rig.check": "tests.api.nowhere:check"})
    BROKEN = Capability(routes=("tests.api.nowhere:router",))
    FAULTY = Capability(
        claims=(f"{__name__}:raise_async",), site_claims=(f"{__name__}:raise_at_once",)
    )
    RUNNING = Capability(running=(f"{__name__}:Watch",))
    FEEDLESS = Capability(
        camera_parts=("tests.api.nowhere:Part",),
        camera_feeds={"tests.api.nowhere:Part": "tests.api.nowhere:Feed"},
        saved_rows={"calibrations": "tests.api.nowhere:read"},
    )
    STOPPED = Capability(running=(f"{__name__}:NeverStarted",))
    NO_CAPABILITY = "a text"


class Watch(RunningPart):
    """A part that runs with the server, and what it was asked: of all of them, in order."""

    calls: ClassVar[list[str]] = []

    def start(self):
        self.calls.append("start")

    def close(self):
        self.calls.append("close")

    def wake(self):
        self.calls.append("wake")

    @property
    def warnings(self):
        return (Warning("watched", "Something is to be seen.", "Look."),)

    def uses_of_field(self, name):
        return [f"the watch of {name}"]


class NeverStarted(RunningPart):
    def start(self):
        raise_at_once()


async def raise_async(*_):
    raise_at_once()


def raise_at_once(*_):
    raise ValueError("a fault of its own")


@pytest.fixture
def beside(monkeypatch):
    """What is found where these entry points are installed: their names, and what they name in Beside."""

    def found(**names: str):
        points = [
            EntryPoint(name, f"{__name__}:Beside.{value}", capabilities.GROUP)
            for name, value in names.items()
        ]
        monkeypatch.setattr("importlib.metadata.entry_points", lambda group: points)
        monkeypatch.setattr(capabilities, "capabilities", capabilities.capabilities.__wrapped__)
        return capabilities.capabilities()

    return found


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("taker", "TAKEN", "'rig.check' is taken"),
        ("rigs", "CENSUS", "'rigs' is taken"),
        ("table", "NO_CAPABILITY", "no Capability"),
        ("gone", "NOT_THERE", "NOT_THERE"),
    ],
)
def test_a_package_that_is_wrong_is_left_out_and_logged(beside, caplog, name, value, said):
    assert {*beside(**{name: value})} == {*capabilities.CAPABILITIES}
    assert said in caplog.text and name in caplog.text


def test_one_beside_a_wrong_one_is_there(beside, caplog):
    assert "census" in beside(table="NO_CAPABILITY", broken="BROKEN", census="CENSUS")
    ours = sum(len(one.routes) for one in capabilities.CAPABILITIES.values())
    assert (
        len([*capabilities.loaded("routes")]) == ours and "tests.api.nowhere:router" in caplog.text
    )
    assert capabilities.find_command("census") == "tests.api.nowhere:census"
    assert capabilities.find_command("serve") == "touchline.cli.server:serve"


def test_no_name_is_in_the_table_twice():
    tables = [(one.jobs, one.savers, one.commands) for one in capabilities.CAPABILITIES.values()]
    for kind in zip(*tables, strict=True):
        names = [name for table in kind for name in table]
        assert len(names) == len({*names})
    for targets in (capabilities.jobs(), capabilities.savers()):
        assert all(callable(load(target)) for target in targets.values())


def test_a_part_runs_with_the_server_and_is_told_what_changes(beside, tmp_path, monkeypatch):
    monkeypatch.setattr(Watch, "calls", [])
    beside(watch="RUNNING")
    field = {**load_fields()["table"].to_json(), "name": "own"}
    with TestClient(
        create_app(Settings(data=tmp_path)), base_url="http://127.0.0.1:8000"
    ) as client:
        assert Watch.calls == ["start"]
        assert "watched" in [
            one["reason"] for one in client.get(f"{API}/health").json()["warnings"]
        ]
        kept = client.put(f"{API}/fields/own", json=field)
        assert kept.status_code == 200 and Watch.calls == ["start", "wake"]
        told = refusal(
            client.delete(f"{API}/fields/own", headers={"If-Match": kept.headers["etag"]}),
            409,
            "field-used",
        )
        assert told["users"] == ["the watch of own"]
    assert Watch.calls == ["start", "wake", "close"]


def test_a_part_does_not_start_where_nothing_is_served(beside, tmp_path, monkeypatch):
    monkeypatch.setattr(Watch, "calls", [])
    beside(watch="RUNNING")
    with Client(data=tmp_path):
        pass
    assert Watch.calls == ["close"]


def test_a_part_that_does_not_start_is_logged_and_stops_nothing(beside, tmp_path, caplog):
    beside(stopped="STOPPED", feedless="FEEDLESS", watch="RUNNING")
    with TestClient(
        create_app(Settings(data=tmp_path)), base_url="http://127.0.0.1:8000"
    ) as client:
        assert "watched" in [
            one["reason"] for one in client.get(f"{API}/health").json()["warnings"]
        ]
    assert "tests.api.nowhere:Feed of 'feedless' cannot be used" in caplog.text
    # what is damaged is ours to say
    assert capabilities.saved_rows().keys().isdisjoint({"calibrations"})
    assert "The part of 'stopped' cannot run: ValueError: a fault of its own" in caplog.text


def test_checks_of_a_package_that_fail_are_named_and_stop_nothing(beside, standing, clicks, caplog):
    beside(faulty="FAULTY")
    made = standing.post(f"{API}/calibrations", json=clicks()).json()
    found = standing.get(f"{API}/calibrations/{made['id']}/claims").json()
    for items in (found["items"], standing.get(f"{API}/readiness").json()["items"]):
        assert [
            (one["state"], one["gates"]) for one in items if one["code"] == "package-faulty"
        ] == [("not-tested", False)]
    assert "a fault of its own" in caplog.text
    activate_despite(standing, made["id"])
