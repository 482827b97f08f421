"""publish and absorb: from a shell, without a server; and a server that was not asked sends nothing."""

import json
import os
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path

import pytest

from tests.support import ssl_listener as listener
from tests.support.exported import example, model_of
from tests.support.group_listener import Listener, free_group, said
from tests.support.servers import Line, form, served
from tests.support.waiting import until
from touchline.league.config import PublishingConfig
from touchline.league.geometry_packet import geometry_packet, published_cameras
from touchline.workflows import interchange

TOUCHLINE = [sys.executable, "-c", "from touchline.cli import main; main()"]


@pytest.fixture
def way():
    return free_group()


def options(way) -> list[str]:
    return ["--group", way["group"], "--port", str(way["port"]), "--interface", way["interface"]]


def written(folder: Path, name: str, index: int) -> Path:
    path = folder / f"{name}-{index}.json"
    path.write_bytes(interchange.export(example(name, index), "json").data)
    return path


def test_publish_sends_once_and_says_what_is_lost(touchline, tmp_path, way):
    a, b = written(tmp_path, "ssl", 0), written(tmp_path, "brown-conrady", 1)
    with Listener(**way) as ear:
        code, out, _ = touchline("publish", a, b, *options(way), "--ttl", 0, "--camera-id", 4, "--camera-id", 5)
        assert code == 0
        came = ear.receive()
        assert ear.receive(0.2) is None
    geometry = listener.Packet.FromString(came.data).geometry
    assert [calib.camera_id for calib in geometry.calib] == [4, 5] and came.ttl == 0
    assert "ssl-0.json: camera 4 of plain, error unknown; 0.0 mm at most from the calibration" in out
    assert f"{len(came.data)} bytes" in out


def test_publish_sends_nothing_where_one_camera_loses_too_much(touchline, tmp_path, way):
    a, b = written(tmp_path, "ssl", 0), written(tmp_path, "fisheye", 1)
    with Listener(**way) as ear:
        code, _, told = touchline("publish", a, b, *options(way), "--camera-id", 0, "--camera-id", 1, "--limit-mm", 1)
        assert code == 3 and "Teams would receive" in told and "fix:" in told
        code, _, told = touchline("publish", a, a, *options(way))
        assert code == 3 and "both have camera number 0" in told
        assert ear.receive(0.2) is None
        assert touchline("publish", a, b, *options(way), "--camera-id", 0, "--camera-id", 1, "--approve")[0] == 0
        assert ear.receive() is not None


def test_a_network_that_is_not_there_has_an_exit_code_of_its_own(touchline, tmp_path):
    code, _, told = touchline("publish", written(tmp_path, "ssl", 0), "--interface", "gone0")
    assert code == 4 and "no interface gone0" in told and "lo (127.0.0.1)" in told
    code, _, told = touchline("absorb", "--interface", "gone0", "--for", 0.1)
    assert code == 4 and "no interface gone0" in told
    assert touchline("absorb", "--group", "10.0.0.1")[0] == 3


def test_publish_every_goes_on_until_it_is_ended(tmp_path, way):
    with Listener(**way) as ear:
        publishing = subprocess.Popen([*TOUCHLINE, "publish", str(written(tmp_path, "ssl", 0)), "--every", "0.1",
                                       *options(way)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        try:
            assert [ear.receive(60) is not None for _ in range(3)] == [True] * 3
            publishing.send_signal(signal.SIGINT)
            out, err = publishing.communicate(timeout=30)
        finally:
            publishing.kill()
            publishing.wait()
    assert publishing.returncode == 0 and "bytes to" in out and err == ""


def test_absorb_tells_who_is_there_and_keeps_what_import_reads(touchline, tmp_path, way):
    packet = geometry_packet(published_cameras([example("ssl", 1)], PublishingConfig(numbers={"north": 2})))
    joined = f"{int.from_bytes(bytes(map(int, way['group'].split('.'))), 'little'):08X}"  # as the kernel lists it

    def say():
        until(lambda: joined in Path("/proc/net/igmp").read_text())
        return said(packet, **way)

    with ThreadPoolExecutor() as other:
        saying = other.submit(say)
        code, out, _ = touchline("absorb", "--for", 2, "--folder", tmp_path / "heard", *options(way))
        port = saying.result()
    assert code == 0
    assert f"127.0.0.1, port {port}, other: 1 packets, 1 with geometry" in out and "camera 2 at " in out
    assert "mm, unknown field" in out
    kept = tmp_path / "heard" / f"127.0.0.1-{port}.pb"
    assert kept.read_bytes() == packet
    code, _, err = touchline("import", kept, "--camera-id", 2, "-o", "back.json")
    assert code == 0, err
    parameters = json.loads((tmp_path / "back.json").read_text())["model"]["parameters"]
    assert parameters["focal_px"] == pytest.approx(model_of("ssl", 1).focal_px, rel=1e-6)


def test_absorb_says_that_nobody_was_heard(touchline, way):
    code, out, told = touchline("absorb", "--for", 0.1, "--json", *options(way))
    assert code == 0 and json.loads(out) == [] and "No sender was detected in 0.1 s" in told


def udp_sockets(pid: int) -> set[str]:
    """The UDP sockets that a process and its children hold, by their inodes."""
    family = {pid}
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = status.read_text().rsplit(")", 1)[1].split()
        except OSError:
            continue
        if int(fields[1]) in family:
            family.add(int(status.parent.name))
    held = set()
    for member in family:
        for link in Path(f"/proc/{member}/fd").glob("*"):
            try:
                held.add(os.readlink(link))
            except OSError:
                continue
    lines = [*Path("/proc/net/udp").read_text().splitlines()[1:], *Path("/proc/net/udp6").read_text().splitlines()[1:]]
    return {inode for inode in (line.split()[9] for line in lines) if f"socket:[{inode}]" in held}


@pytest.mark.long
def test_a_server_that_was_not_asked_has_no_socket_to_send_by(tmp_path, way):
    """Stronger than silence: without a UDP socket nothing can leave."""
    with served(tmp_path / "data") as url, closing(Line(url)) as line:
        own = Path("/proc") / str(os.getpid()) / "task"
        child = next(int(pid) for task in own.glob("*/children") for pid in task.read_text().split()
                     if "serve" in Path(f"/proc/{pid}/cmdline").read_text())
        assert line.json("POST", "/cameras", {"id": "north", "source": "sim://table?size=320x256&fps=5"})[0] == 201
        status, _, made = line.ask("POST", "/calibrations/import", *form(interchange.export(example("ssl", 0),
                                                                                         "json").data))
        assert status == 201
        assert line.json("POST", f"/calibrations/{json.loads(made)['id']}/activate")[0] == 200
        assert line.json("GET", "/publishing")[2]["cameras"][0]["published"]
        assert udp_sockets(child) == set()
        with Listener(**way) as ear:
            assert line.json("PUT", "/publishing", {"enabled": True, **way})[0] == 200
            assert ear.receive() is not None and len(udp_sockets(child)) == 1  # the look would have found it
            assert line.json("PUT", "/publishing", {"enabled": False})[0] == 200
        assert udp_sockets(child) == set()
