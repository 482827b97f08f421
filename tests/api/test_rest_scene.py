"""A scene over the wire: begun with its line and gone with it, behind our own port, token and origin."""

import json
import os
import socket
from pathlib import Path

import msgspec
import pytest
from pydantic import ValidationError
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from tests.support.rig_over_field import sim_task
from tests.support.servers import served
from tests.support.tiers import long
from tests.support.viser_page import LOOK, PROTOCOL
from tests.support.waiting import until
from touchline.formats import FORMATS
from touchline.main import create_app
from touchline.scene import routes, service
from touchline.settings import Settings

HOST = {"host": "127.0.0.1:8000"}
TOKEN = "a-token-that-is-long-enough"
LAN = "http://10.0.0.5:8000"
LINE = "/api/v1/scene"


@pytest.fixture(scope="module")
def kept(standing):
    """A version with rays, brought in as a file."""
    task = sim_task(2, 0)
    record = json.loads(FORMATS["json"].write(task.record(task.run(cross_validate=False))))
    record.get("calibration", record)["camera"] = None
    answer = standing.post(
        "/api/v1/calibrations/import", files={"file": json.dumps(record).encode()}
    )
    assert answer.status_code == 201, answer.text
    return answer.json()["id"]


def opened(client, **headers):
    return client.websocket_connect(LINE, headers={**HOST, **headers})


def processes(client):
    return list(client.app.state.services.part(service.SceneState).open._open.values())


def is_reaped(pid: int) -> bool:
    """Whether a process has ended and somebody has waited for it."""
    return not os.path.exists(f"/proc/{pid}")


def is_closed(port: int) -> bool:
    with socket.socket() as line:
        return line.connect_ex(("127.0.0.1", port)) != 0


def test_a_scene_is_shown_looked_at_and_told(standing, kept):
    with opened(standing) as line:
        address = line.receive_json()["address"]
        line.send_json(
            {
                "set": {"view": "above", "sheet": "carpet", "dark": False},
                "show": {"calibrations": [kept]},
            }
        )
        told = line.receive_json()["shown"]
        assert told["cameras"][0]["calibration"] == kept and told["cameras"][0]["height_mm"] > 1000
        assert told["missing"] == []
        page = standing.get(address)
        assert page.status_code == 200 and "<canvas" not in page.text and b"data-p=" in page.content
        policy = page.headers["content-security-policy"]
        assert (
            "default-src 'none'" in policy
            and "frame-ancestors 'self'" in policy
            and "http" not in policy
        )


def test_the_dashboards_own_policy_stays_as_it_was(standing):
    policy = standing.get("/").headers["content-security-policy"]
    script = next(part for part in policy.split(";") if "script-src" in part)
    assert "unsafe" not in script and "blob" not in script


def test_visers_line_goes_through_with_its_protocol_and_tells_what_was_clicked(standing, kept):
    with opened(standing) as line:
        address = line.receive_json()["address"].rstrip("/")
        line.send_json({"show": {"calibrations": [kept]}})
        line.receive_json()
        with standing.websocket_connect(address, subprotocols=[PROTOCOL], headers=HOST) as viewer:
            assert viewer.accepted_subprotocol == PROTOCOL
            assert len(viewer.receive_bytes()) > 100
            viewer.send_bytes(LOOK)
            [process] = processes(standing)
            until(lambda: process.viewers == 1)
            viewer.send_bytes(
                msgspec.msgpack.encode(
                    {
                        "type": "ScenePointerMessage",
                        "event_type": "click",
                        "modifier": None,
                        "ray_origin": (-1.5, 0.5, 4.0),
                        "ray_direction": (0.0, 0.0, -1.0),
                        "screen_pos": ((0.5, 0.5),),
                    }
                )
            )
            told = line.receive_json()["clicked"]
        assert told["place_mm"] == pytest.approx([-1500, 500], abs=0.01)
        [camera] = told["cameras"]
        field = standing.post(
            f"/api/v1/calibrations/{kept}/transform",
            json={"from": "field", "to": "image", "points": [[-1500, 500]]},
        ).json()
        assert camera["pixel"] == pytest.approx(field["points"][0], abs=1e-3)
        assert 0 < camera["sigma_mm"] < 50
        until(lambda: process.viewers == 0)


def test_what_cannot_be_shown_is_told_and_the_line_stays_open(standing, kept, standing_calibration):
    with opened(standing) as line:
        line.receive_json()
        for asked in (
            {"calibrations": [kept], "before": standing_calibration["id"]},
            {"calibrations": ["x"]},
            {"calibrations": ["0" * 16]},
            {"rig": "nobody"},
            {"lens": "0" * 16},
            {},
        ):
            line.send_json({"show": asked})
            assert line.receive_json()["problem"]["fix"]
        line.send_json({"show": {"calibrations": [kept], "before": kept}})
        assert line.receive_json()["shown"]["cameras"][0]["moved"]["max_mm"] == pytest.approx(
            0, abs=1e-6
        )


@pytest.mark.parametrize(
    "word",
    [
        "",
        "[]",
        "{",
        '{"show": 3}',
        '{"set": {"scale": 1e9}}',
        '{"set": {"scale": NaN}}',
        '{"set": {"layers": ["walls"]}}',
        '{"show": {"rig": "../x"}}',
        "[" * 5000,
        "x" * 50_000,
    ],
)
def test_what_nobody_can_mean_is_refused(word):
    with pytest.raises(ValidationError):
        routes.SceneMessage.model_validate_json(word)


def test_a_refused_word_ends_the_line_in_words(standing):
    with opened(standing) as line:
        line.receive_json()
        line.send_text('{"show": 3}')
        told = line.receive_json()
        assert told["fix"] and told["status"] == 422
        with pytest.raises(WebSocketDisconnect) as end:
            line.receive_json()
        assert end.value.code == 4422


@pytest.mark.parametrize("times", [2, long(10)])
def test_ten_scenes_opened_and_closed_leave_no_process_and_no_port(standing, kept, times):
    seen = []
    for _ in range(times):
        with opened(standing) as line:
            address = line.receive_json()["address"]
            line.send_json({"show": {"calibrations": [kept]}})
            line.receive_json()
            [process] = processes(standing)
            seen.append((process.pid, process.port))
        until(lambda process=process: is_reaped(process.pid) and is_closed(process.port))
        assert standing.get(address).status_code == 404
    assert len({pid for pid, _ in seen}) == times and not processes(standing)
    until(lambda: standing.app.state.services.part(service.SceneState).open._count == 0)


def test_so_many_scenes_and_no_more(standing, monkeypatch):
    monkeypatch.setattr(service, "MAX_SCENES", 1)
    with opened(standing) as line:
        line.receive_json()
        with opened(standing) as one_more:
            assert "scenes are open" in one_more.receive_json()["detail"]
    until(lambda: standing.app.state.services.part(service.SceneState).open._count == 0)


def test_a_scene_that_nobody_looks_at_is_closed(standing, kept, monkeypatch):
    monkeypatch.setattr(routes, "IDLE_S", 0.5)
    monkeypatch.setattr(routes, "POLL_S", 0.1)
    with opened(standing) as line:
        line.receive_json()
        assert line.receive_json()["type"] == "/problems/scene-idle"
    until(lambda: not processes(standing))


def test_a_scene_whose_process_dies_is_told_and_the_server_goes_on(standing):
    with opened(standing) as line:
        line.receive_json()
        processes(standing)[0]._process.kill()
        assert line.receive_json()["type"] == "/problems/scene-gone"
    assert standing.get("/api/v1/health").status_code == 200


def scene_processes(folder) -> list[int]:
    """Of the server that keeps its data there."""

    def words(pid: str, file: str) -> str:
        try:
            return (Path("/proc") / pid / file).read_text()
        except OSError:  # it has just ended
            return ""

    pids = [
        pid
        for pid in os.listdir("/proc")
        if pid.isdigit() and "touchline.scene.live" in words(pid, "cmdline")
    ]
    return [
        int(pid)
        for pid in pids
        if str(folder) in words(words(pid, "stat").rpartition(")")[2].split()[1], "cmdline")
    ]


@pytest.mark.long
def test_a_server_that_ends_takes_its_scenes_along(tmp_path):
    with served(tmp_path) as url, connect(f"{url.replace('http', 'ws')}{LINE}", proxy=None) as line:
        assert json.loads(line.recv(timeout=60))["address"]
        [pid] = scene_processes(tmp_path)
    until(lambda: is_reaped(pid))


def test_its_own_port_lets_nobody_in(standing):
    with opened(standing) as line:
        line.receive_json()
        [process] = processes(standing)
        for origin in ("http://127.0.0.1:8000", "http://evil.example"):
            with pytest.raises(InvalidStatus) as refused:
                connect(
                    f"ws://127.0.0.1:{process.port}/",
                    subprotocols=[PROTOCOL],
                    proxy=None,
                    origin=origin,
                )
            assert refused.value.response.status_code == 403


ELSEWHERE = (
    {"origin": "http://evil.example"},
    {"origin": "null"},
    {"sec-fetch-site": "cross-site"},
    {"host": "evil.example"},
)


def test_other_origins_open_no_scene_and_see_none(standing):
    with opened(standing) as line:
        address = line.receive_json()["address"].rstrip("/")
        for headers in ELSEWHERE:
            for path in (LINE, address):
                with (
                    pytest.raises(WebSocketDisconnect),
                    standing.websocket_connect(
                        path, subprotocols=[PROTOCOL], headers={**HOST, **headers}
                    ) as other,
                ):
                    other.receive()
            assert len(processes(standing)) == 1


def test_without_the_token_there_is_no_scene(tmp_path):
    settings = Settings(data=tmp_path, token=TOKEN, server={"host": "0.0.0.0"})
    with TestClient(create_app(settings), base_url=LAN, follow_redirects=False) as client:
        bearer = {"Authorization": f"Bearer {TOKEN}"}
        for path in (LINE, "/viser/anything"):
            with pytest.raises(WebSocketDisconnect), client.websocket_connect(path) as line:
                line.receive_json()
        assert client.get("/viser/anything/").status_code == 401
        with client.websocket_connect(LINE, headers=bearer) as line:
            address = line.receive_json()["address"]
            assert client.get(address).status_code == 401
            with (
                pytest.raises(WebSocketDisconnect),
                client.websocket_connect(address.rstrip("/"), subprotocols=[PROTOCOL]) as viewer,
            ):
                viewer.receive_bytes()
            assert client.get(address, headers=bearer).status_code == 200


def test_an_unknown_scene_is_none(standing):
    assert standing.get("/viser/nothing/").status_code == 404
    with (
        pytest.raises(WebSocketDisconnect),
        standing.websocket_connect("/viser/nothing", headers=HOST) as line,
    ):
        line.receive_bytes()


def test_the_scene_as_a_file(standing, kept, monkeypatch):
    answer = standing.get(f"/api/v1/calibrations/{kept}/scene.html?dark=true")
    assert answer.status_code == 200 and "__VISER_EMBED_DATA__" in answer.text
    assert answer.headers["content-security-policy"].startswith("sandbox allow-scripts;")
    assert "-scene.html" in answer.headers["content-disposition"]
    # A version never changes: the same file needs no process again.
    monkeypatch.setattr(service, "MAX_SCENES", 0)
    assert (
        standing.get(f"/api/v1/calibrations/{kept}/scene.html?dark=true").content == answer.content
    )
    busy = standing.get(f"/api/v1/calibrations/{kept}/scene.html")
    assert busy.status_code == 429 and busy.json()["fix"]
    assert standing.get(f"/api/v1/calibrations/{'0' * 16}/scene.html").status_code == 404
    until(lambda: not processes(standing))
