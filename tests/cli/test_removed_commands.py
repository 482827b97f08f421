"""Commands of earlier versions: each says which call takes its place, and that call answers the same."""

import json
from contextlib import closing
from dataclasses import replace

import pytest

from tests.support.exported import example
from tests.support.former_commands import BEFORE, FIGURES, FORMER, figures_of, lay_out
from tests.support.group_listener import Listener, free_group, said
from tests.support.pair_over_field import calibrations
from tests.support.servers import served
from tests.support.waiting import until
from touchline.capabilities import commands
from touchline.cli.console import REMOVED
from touchline.league.packet import PublishingConfig, geometry_packet, published_cameras
from touchline.workflows import interchange

OTHERS = {"scene", "publish", "absorb", "batch"}  # batch: tests/api/test_scripts_manual.py


@pytest.fixture(scope="module")
def desk(tmp_path_factory):
    folder = tmp_path_factory.mktemp("desk")
    lay_out(folder)
    return folder


def test_every_removed_command_is_compared_here():
    assert {*REMOVED} == {*FORMER} | OTHERS and not {*REMOVED} & {*commands()}


@pytest.mark.parametrize("name", REMOVED)
def test_a_removed_command_says_which_call_takes_its_place(touchline, name):
    for words in ((), ("--help",), ("a.json", "--json", "-o", "b")):
        code, out, err = touchline(name, *words)
        assert (code, out) == (2, "") and f"fix: Use {REMOVED[name]}." in err
    assert f"  {name} " not in touchline("--help")[1]


@pytest.mark.parametrize("name", FORMER)
def test_its_calls_answer_what_the_command_answered(touchline, desk, name, monkeypatch):
    former = FORMER[name]
    monkeypatch.chdir(desk)
    monkeypatch.setenv("TOUCHLINE_PICTURES", str(desk))
    for words in BEFORE:
        if not (desk / words.split()[-1]).exists() and words.split()[-1] in former.calls:
            assert touchline(*words.split())[0] == 0
    code, out, err = touchline("call", "--temporary", "--calls", "-", stdin=former.calls)
    assert code == 0, err
    answer = json.loads(out)
    told = figures_of(former, answer if former.within is None else answer[former.within])
    for place, value in json.loads(FIGURES.read_text())[name].items():
        assert told[place] == (
            value if isinstance(value, str) else pytest.approx(value, rel=2e-3, abs=1e-6)
        ), place


def test_the_scene_is_the_same_page(touchline, tmp_path):
    (tmp_path / "cal.json").write_bytes(interchange.export(example("division", 0), "json").data)
    code, out, err = touchline(
        "call",
        "--temporary",
        "--calls",
        "-",
        stdin="""
        made = POST /calibrations/import file=@cal.json
        GET /calibrations/${made.id}/scene.html > scene.html
    """,
    )
    assert (code, out, err) == (0, "", "")
    page = (tmp_path / "scene.html").read_text()
    assert "__VISER_EMBED_DATA__" in page and ", version 1</title>" in page


def test_a_server_publishes_and_hears_what_the_commands_sent_and_heard(touchline, tmp_path):
    way, made = free_group(), replace(calibrations("ssl")[0], camera="north")
    (tmp_path / "cal.json").write_bytes(interchange.export(made, "json").data)
    with served(tmp_path / "data") as url, closing(Listener(**way)) as ear:
        at = ("--server", url)
        code, _, err = touchline(
            "call",
            *at,
            "--calls",
            "-",
            stdin=f"""
            camera = POST /cameras id=north source=sim://table
            made = POST /calibrations/import file=@cal.json camera=north
            active = POST /calibrations/${{made.id}}/activate
            PUT /publishing {json.dumps({"enabled": True, "absorb": True, "numbers": {"north": 4}, **way})}
        """,
        )
        assert code == 0, err
        came = ear.receive()
        assert came.data == geometry_packet(
            published_cameras([made], PublishingConfig(numbers={"north": 4}))
        )
        others = geometry_packet(
            published_cameras([example("ssl", 1)], PublishingConfig(numbers={"north": 2}))
        )

        def heard():
            said(others, **way)
            return json.loads(touchline("call", *at, "GET", "/publishing/heard")[1])["items"]

        (sender,) = until(heard)
        assert [camera["camera_id"] for camera in sender["cameras"]] == [2]
