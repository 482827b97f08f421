"""touchline.Client: the same story at a server, on a data folder and in a temporary one; refusals; what it loads."""

import ast
import json
import subprocess
import sys
from inspect import getmembers, isfunction, signature

import cv2
import numpy as np
import pytest

from tests.support.client_types import FILE, client_types, description_of
from tests.support.exported import example
from tests.support.folder_pictures import camera, clicks, picture
from tests.support.paths import PACKAGE, ROOT
from tests.support.servers import served
from touchline import Client
from touchline.core.errors import BadInput, Cancelled, NotFound, TouchlineError, Unavailable
from touchline.core.jobs import JobSpec
from touchline.formats import FORMATS
from touchline.league.service import PublishingService
from touchline.store.store import Store

UNREACHABLE = "http://127.0.0.1:1"


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    """A picture and the clicks in it."""
    folder = tmp_path_factory.mktemp("shown")
    return picture(folder / "field.png"), json.loads(clicks(folder / "field.json").read_text())


@pytest.fixture(scope="module", params=["server", "data folder", "temporary"])
def client(request, tmp_path_factory):
    data = tmp_path_factory.mktemp("data")
    if request.param == "server":
        with served(data) as url, Client(url, operator="Ann") as client:
            yield client
    else:
        with (
            Client(data=data, operator="Ann")
            if request.param == "data folder"
            else Client.temporary() as client
        ):
            yield client


def test_from_an_image_to_millimetres_to_a_file(client, shown):
    path, clicked = shown
    snapshot = client.upload(path)
    assert (snapshot["width"], snapshot["height"]) == (640, 480) and client.upload(
        path.read_bytes()
    )["id"]
    made = client.calibrate(
        snapshot, clicked["observations"], field="ssl-div-b", region="full", model="division"
    )
    px = np.array([[[320.0, 240.0], [200.0, 200.0]], [[400.0, 300.0], [-9e5, 0.0]]])
    field_mm = client.transform(made, px)
    assert field_mm.shape == (2, 2, 2) and np.isnan(field_mm[1, 1]).all()
    truth = camera().raw_from_field(field_mm.reshape(-1, 2)[:3])
    assert np.abs(truth - px.reshape(-1, 2)[:3]).max() < 1.0
    back = client.transform(made["id"], field_mm[0], "field", "image")
    assert np.abs(back - px[0]).max() < 0.01
    corrected = cv2.imdecode(
        np.frombuffer(client.correct(made, path, width=320), np.uint8), cv2.IMREAD_COLOR
    )
    assert corrected.shape[1] == 320
    assert FORMATS["json"].read(client.export(made)).field["name"] == "ssl-div-b"


def test_what_a_job_finds_is_waited_for_with_its_progress(client, shown):
    seen = []
    job = client.auto(client.upload(shown[0]), field="ssl-div-b", region="full", keep=False)
    found = client.wait(job, lambda share, message: seen.append((share, message)))
    assert found["verdict"]["sentence"] and found["observations"]
    assert seen and all(0 <= share <= 1 for share, _ in seen) and len({*seen}) == len(seen)


@pytest.mark.parametrize("error", [KeyboardInterrupt(), Cancelled("Enough.", "Start it again.")])
def test_ctrl_c_and_a_progress_that_raises_cancel_the_job(client, shown, error):
    job = client.auto(client.upload(shown[0]))

    def stop(share, message):
        raise error

    with pytest.raises(type(error)):
        client.wait(job, stop)
    with pytest.raises(Cancelled, match="was cancelled"):
        client.wait(job)


def test_who_waits_no_longer_leaves_the_job_as_it_is(client, shown):
    job = client.auto(client.upload(shown[0]), field="ssl-div-b", region="full", keep=False)
    with pytest.raises(Unavailable, match="still"):
        client.wait(job, timeout_s=0.0)
    assert client.wait(job)["observations"]


def test_lists_are_read_page_by_page(client):
    record = FORMATS["json"].write(example("division", 0))
    ids = [
        client.call("POST", "/calibrations/import", files={"file": ("c.json", record)}).json()["id"]
        for _ in range(3)
    ]
    found = [one["id"] for one in client.items("/calibrations", limit=2)]
    assert found[:3] == ids[::-1] and len({*found}) == len(found)


def test_a_refusal_has_what_the_server_said(client):
    with pytest.raises(NotFound) as refused:
        client.calibration("nothing")
    assert (
        refused.value.fix
        and refused.value.reason.startswith("unknown")
        and "type" not in refused.value.details
    )
    with pytest.raises(BadInput, match=r"\(3,\)"):
        client.transform("nothing", [1, 2, 3])
    with pytest.raises(TouchlineError, match="/docs"):
        client.call("GET", "/no/such/path")


@pytest.mark.parametrize("url", ["127.0.0.1:8000", "ftp://hall", "http://", "http://[::1", ""])
def test_an_address_that_is_none_is_refused(url):
    with pytest.raises(BadInput, match="http://127"):
        Client(url)


def test_no_server_and_something_else_in_its_place_are_told(tmp_path):
    with Client(UNREACHABLE) as client, pytest.raises(Unavailable, match="touchline serve"):
        client.upload(b"")
    with pytest.raises(BadInput):
        Client(UNREACHABLE, data=tmp_path)


def test_a_server_with_a_token_is_asked_with_it(tmp_path, monkeypatch):
    monkeypatch.setenv("TOUCHLINE_TOKEN", "sixteen letters, at least")
    with served(tmp_path / "data") as url:
        with Client(url, token="sixteen letters, at least") as client:
            assert client.call("GET", "/cameras").json()["items"] == []
        with Client(url) as client, pytest.raises(TouchlineError, match="access token"):
            client.call("GET", "/cameras")
    with Client(data=tmp_path / "own") as client:  # which knows the token of its own settings
        assert client.call("GET", "/cameras").json()["items"] == []


def test_in_this_process_cameras_sleep_and_what_a_server_left_waits_for_the_next(tmp_path):
    """A script that looks something up must not take a camera from a server's machine, nor its half-done work."""
    made = example("division", 0)
    with Store(tmp_path) as store:
        version = store.calibrations.add(made)
        store.calibrations.activate(version.id)
        store.jobs.add(
            "auto", JobSpec("touchline.workflows.recognition:run_auto", {}, "found-lines").to_json()
        )
    settings = tmp_path / "own.yaml"
    settings.write_text(
        f"cameras: [{{id: {version.camera}, source: 'sim://table'}}]\n"
        "publish: {enabled: true, interface: lo, ttl: 0, interval_s: 0.1}\n"
    )
    with Client(data=tmp_path, config=settings) as client:
        services = client._http.app.state.services
        assert services.live.running == () and not services.part(PublishingService)._running
        (job,) = client.items("/jobs")
        assert job["state"] == "queued"


# --- its types, and what it costs to import


@pytest.fixture(scope="module")
def description(tmp_path_factory):
    return description_of(tmp_path_factory.mktemp("described"))


def test_the_types_of_its_answers_are_those_of_the_rest_description(description):
    assert client_types(description) == FILE.read_text(), "run python -m tests.support.client_types"


def test_every_path_that_it_calls_is_in_the_rest_description(description):
    described = {
        (method.upper(), path)
        for path, methods in description["paths"].items()
        for method in methods
    }
    called = set()
    for node in ast.walk(ast.parse((PACKAGE / "client" / "client.py").read_text())):
        if (
            isinstance(node, ast.Call)
            and isinstance(node.func, ast.Attribute)
            and node.func.attr == "call"
            and len(node.args) > 1
            and isinstance(node.args[0], ast.Constant)
        ):
            path = "".join(
                str(part.value) if isinstance(part, ast.Constant) else "{}"
                for part in (
                    node.args[1].values
                    if isinstance(node.args[1], ast.JoinedStr)
                    else [node.args[1]]
                )
            )
            called.add((node.args[0].value, f"/api/v1{path}"))
    called.remove(("GET", "/api/v1{}"))  # of whatever list
    shapes = {
        (method, "/".join("{}" if part.startswith("{") else part for part in path.split("/")))
        for method, path in described
    }
    assert len(called) > 6 and called <= shapes


def test_it_loads_nothing_of_the_server():
    probe = "import sys, touchline; early = {*sys.modules}; touchline.Client; print(*early, '|', *sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", probe], cwd=ROOT, capture_output=True, text=True, check=True
    )
    early, late = (set(part.split()) for part in done.stdout.split("|"))
    assert not {"httpx2", "numpy"} & early
    assert (
        not {"fastapi", "starlette", "uvicorn", "pydantic", "sqlalchemy", "cv2", "viser", "av"}
        & late
    )


def test_every_method_is_described():
    for name, method in getmembers(Client, isfunction):
        if not name.startswith("_"):
            assert (
                method.__doc__
                and signature(method).return_annotation is not signature(method).empty
            ), name
