"""The game controller over REST: off until asked, the teams, the table of heights, and what cameras make of it."""

import socket
import threading

import numpy as np
import pytest
from starlette.testclient import TestClient

from tests.support.group_listener import Listener, free_group, said
from tests.support.live_play import Before
from tests.support.referee_messages import referee
from tests.support.refusals import API, refusal
from tests.support.ssl_listener import Packet
from tests.support.waiting import until
from touchline.main import create_app
from touchline.settings import Settings

HERE = "http://127.0.0.1:8000"
LOW_MM = 90.0


@pytest.fixture
def way():
    """A group of its own: what others send to the league's is not heard."""
    return {name: value for name, value in free_group().items() if name != "ttl"}


@pytest.fixture
def client(tmp_path):
    with TestClient(create_app(Settings(data=tmp_path / "data")), base_url=HERE) as client:
        yield client


def state(client) -> dict:
    return client.get(f"{API}/referee").json()


def put(client, etag=None, **changes):
    headers = {} if etag is None else {"If-Match": etag}
    return client.put(f"{API}/referee", json=changes, headers=headers)


def changed(client, **changes) -> dict:
    answer = put(client, **changes)
    assert answer.status_code == 200, answer.text
    return answer.json()


def table(client) -> dict:
    return {one["team"]: (one["height_mm"], one["own"]) for one in state(client)["table"]}


def test_it_is_listened_to_while_publishing_sends_or_listens_and_over_the_same_interface(
    client, way
):
    before = changed(client, group=way["group"], port=way["port"])
    assert (before["enabled"], before["listening"], before["controllers"]) == (None, False, [])
    assert client.put(f"{API}/publishing", json={"absorb": True, **free_group()}).is_success
    until(lambda: state(client)["listening"])
    said(referee(), **way)
    found = until(lambda: state(client), lambda it: it["controllers"])
    assert found["teams"]["blue"] == {
        "team": "ibis",
        "entry": "ibis",
        "height_mm": LOW_MM,
        "source": "game-controller",
        "known": True,
    }
    (one,) = found["controllers"]
    assert (one["blue"], one["stage"], one["command"], one["chosen"], one["current"]) == (
        "ibis",
        "normal-first-half",
        "force-start",
        True,
        True,
    )
    assert not changed(client, enabled=False)["controllers"]
    assert changed(client, enabled=None)["enabled"] is None
    until(lambda: state(client)["listening"])
    assert client.put(f"{API}/publishing", json={"absorb": False}).is_success
    assert not state(client)["listening"]


def test_by_hand_wins_and_is_kept_over_a_restart(tmp_path, way):
    settings = Settings(data=tmp_path / "data")
    with TestClient(create_app(settings), base_url=HERE) as client:
        changed(client, enabled=True, **way)
        until(lambda: state(client)["listening"])
        said(referee(blue="MRL", yellow="nobody knows us"), **way)
        heard = until(lambda: state(client), lambda it: it["teams"]["blue"]["team"])["teams"]
        assert heard["blue"]["height_mm"] == 150
        assert heard["yellow"] == {
            "team": "nobody knows us",
            "entry": None,
            "height_mm": None,
            "source": "game-controller",
            "known": False,
        }
        teams = changed(client, blue={"name": "IBIS"}, yellow={"height_mm": 120})["teams"]
        assert (teams["blue"]["entry"], teams["blue"]["source"]) == ("ibis", "hand")
        assert teams["yellow"]["height_mm"] == 120
    with TestClient(create_app(settings), base_url=HERE) as client:
        assert state(client)["teams"]["blue"]["height_mm"] == LOW_MM
        assert changed(client, blue={})["blue"] == {"name": None, "height_mm": None}


def test_own_entries_win_over_the_table_and_are_removed_one_by_one(client):
    assert table(client)["ibis"] == (90, False)
    changed(client, heights={"Ours": 123.5, "ibis": 95})
    changed(client, heights={"Others": 140})
    found = table(client)
    assert (found["Ours"], found["ibis"], found["Others"]) == (
        (123.5, True),
        (95, True),
        (140, True),
    )
    changed(client, heights={"ibis": None, "Others": None, "never there": None})
    assert table(client)["ibis"] == (90, False) and "Others" not in table(client)


def test_the_table_is_written_and_read_as_the_file_of_vision_processor(client):
    changed(client, heights={"Ours": 123.5})
    file = client.get(f"{API}/referee/robot-heights.yml")
    assert file.headers["content-type"].startswith("text/plain")
    assert "attachment" in file.headers["content-disposition"]
    assert "Ours: 123.5\n" in file.text and "RobôCin: 144.0\n" in file.text
    changed(client, heights={"Ours": None, "ibis": 95})

    def send(data):
        return client.post(f"{API}/referee/robot-heights", files={"file": ("a.yml", data)})

    answer = send(file.content)
    assert answer.status_code == 200, answer.text
    # what is the same as in the table is no entry of one's own
    assert answer.json()["heights"] == {"Ours": 123.5} and table(client)["ibis"] == (90, False)
    assert refusal(send(b"ibis: ninety"), 422)
    assert refusal(send(b"[]"), 422, "bad-robot-heights")
    assert state(client)["heights"] == {"Ours": 123.5}


WRONG = (
    {"heights": {"ibis": 0}},
    {"heights": {"ibis": 1e9}},
    {"heights": {"": 90}},
    {"heights": {" ibis": 90}},
    {"heights": {"ib\nis": 90}},
    {"heights": {"ibis": "90"}},
    {"heights": None},
    {"heights": {f"team {i}": 90 for i in range(501)}},
    {"blue": {"name": ""}},
    {"blue": {"height_mm": -1}},
    {"blue": {"team": "ibis"}},
    {"blue": None},
    {"blue": "ibis"},
    {"group": "10.0.0.1"},
    {"port": 0},
    {"interface": "no such thing at all"},
    {"enabled": "yes"},
    {"red": {}},
)


def test_what_is_wrong_is_refused_and_nothing_is_saved(client):
    before = client.get(f"{API}/referee")
    for wrong in WRONG:
        assert refusal(put(client, **{"yellow": {"name": "MRL"}, **wrong}), 422), wrong
    after = client.get(f"{API}/referee")
    assert (after.json()["yellow"], after.headers["etag"]) == (
        {"name": None, "height_mm": None},
        before.headers["etag"],
    )


def test_an_interface_that_is_not_here_is_refused_where_it_is_switched_on(client):
    answer = put(client, enabled=True, interface="nothere0")
    assert refusal(answer, 409, "no-interface")
    assert state(client)["enabled"] is None


def test_of_two_who_change_it_the_second_sees_what_the_first_did(client):
    etag = client.get(f"{API}/referee").headers["etag"]
    assert put(client, etag, blue={"name": "MRL"}).status_code == 200
    late = put(client, etag, blue={"name": "ibis"})
    assert late.status_code == 412
    assert refusal(late)["current"]["blue"] == {"name": "MRL", "height_mm": None}
    assert state(client)["blue"]["name"] == "MRL"


def test_a_damaged_file_is_reported_and_left_as_it_is(tmp_path):
    settings = Settings(data=tmp_path / "data")
    settings.data.mkdir()
    (settings.data / "referee.json").write_text('{"heights": {"ibis": "high"}}')
    with TestClient(create_app(settings), base_url=HERE) as client:
        warnings = client.get(f"{API}/health").json()["warnings"]
        assert [one["reason"] for one in warnings] == ["referee-damaged"]
        assert "high" in (settings.data / "referee.json").read_text()
        changed(client, blue={"name": "ibis"})
        assert client.get(f"{API}/health").json()["warnings"] == []


def test_two_game_controllers_are_reported(client, way):
    changed(client, enabled=True, **way)
    until(lambda: state(client)["listening"])
    ended = threading.Event()

    def keep_sending():
        with (
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one,
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other,
        ):
            while not ended.wait(0.2):
                said(referee(), sock=one, **way)
                said(referee(blue="MRL", source_identifier="another"), sock=other, **way)

    sender = threading.Thread(target=keep_sending)
    sender.start()
    try:
        (warning,) = until(lambda: client.get(f"{API}/health").json()["warnings"])
    finally:
        ended.set()
        sender.join()
    assert warning["reason"] == "two-game-controllers" and "127.0.0.1" in warning["text"]
    assert sum(one["chosen"] for one in state(client)["controllers"]) == 1


def test_a_cameras_robots_follow_the_game_controller_and_so_do_the_packets_of_the_league(
    tmp_path, way
):
    play, group = Before("north", terms=f"&blue_mm={LOW_MM:g}"), free_group()
    settings = Settings(data=tmp_path / "data", cameras=[play.settings])
    with TestClient(create_app(settings), base_url=HERE) as client, Listener(**group) as ear:
        play.calibrate(client)
        learned = client.post(
            f"{API}/cameras/north/colours/learn", json={"clicks": play.clicks()}
        ).json()
        assert client.put(f"{API}/colours/hall", json={"profile": learned["profile"]}).is_success
        assert client.put(f"{API}/publishing", json={"enabled": True, **group}).is_success
        changed(client, enabled=True, **way)
        until(lambda: state(client)["listening"])
        at = f"{API}/cameras/north/seeing"
        body = {"on": True, "plan": "ssl", "colours": "hall", "publish": True}
        etag = client.get(at).headers["etag"]
        assert client.put(at, json=body, headers={"If-Match": etag}).is_success

        def heights(came):
            detection = Packet.FromString(came.data).detection
            return [
                {robot.height for robot in robots}
                for robots in (detection.robots_blue, detection.robots_yellow)
            ]

        ear.hear_until(lambda came: heights(came) == [{150.0}, {150.0}], 90.0)
        said(referee(blue="Ibis", yellow="somebody"), **way)
        came = ear.hear_until(lambda came: heights(came) == [{LOW_MM}, {150.0}], 90.0)
        blue = Packet.FromString(came.data).detection.robots_blue
        off = [
            np.hypot(robot.x - truth.x_mm, robot.y - truth.y_mm)
            for robot in blue
            if (truth := play.robots.get(("blue", robot.robot_id))) is not None
        ]
        assert off and max(off) < 15
        seen = client.get(at).json()["teams"]
        assert (seen["blue"]["entry"], seen["blue"]["height_mm"]) == ("ibis", LOW_MM)
        assert (seen["yellow"]["entry"], seen["yellow"]["height_mm"]) == (None, 150)
