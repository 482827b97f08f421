"""A server that was not asked sends nothing."""

import json
import os
from contextlib import closing
from pathlib import Path

import pytest

from tests.support.activation import activate_despite
from tests.support.exported import example
from tests.support.group_listener import Listener, free_group
from tests.support.servers import Line, form, served
from touchline.workflows import interchange


@pytest.fixture
def way():
    return free_group()


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
    lines = [
        *Path("/proc/net/udp").read_text().splitlines()[1:],
        *Path("/proc/net/udp6").read_text().splitlines()[1:],
    ]
    return {inode for inode in (line.split()[9] for line in lines) if f"socket:[{inode}]" in held}


@pytest.mark.long
def test_a_server_that_was_not_asked_has_no_socket_to_send_by(tmp_path, way):
    """Stronger than silence: without a UDP socket nothing can leave."""
    with served(tmp_path / "data") as url, closing(Line(url)) as line:
        own = Path("/proc") / str(os.getpid()) / "task"
        child = next(
            int(pid)
            for task in own.glob("*/children")
            for pid in task.read_text().split()
            if "serve" in Path(f"/proc/{pid}/cmdline").read_text()
        )
        assert (
            line.json(
                "POST", "/cameras", {"id": "north", "source": "sim://table?size=320x256&fps=5"}
            )[0]
            == 201
        )
        status, _, made = line.ask(
            "POST",
            "/calibrations/import",
            *form(interchange.export(example("ssl", 0), "json").data),
        )
        assert status == 201
        activate_despite(url, json.loads(made)["id"])
        assert line.json("GET", "/publishing")[2]["cameras"][0]["published"]
        assert udp_sockets(child) == set()
        with Listener(**way) as ear:
            assert line.json("PUT", "/publishing", {"enabled": True, **way})[0] == 200
            assert ear.receive() is not None and udp_sockets(child)  # the look would have found it
            assert line.json("PUT", "/publishing", {"enabled": False})[0] == 200
        assert udp_sockets(child) == set()
