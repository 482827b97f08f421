"""What a game controller sends over real multicast: recognised, newest by sender, and junk ignored."""

import os
import socket
import time

import pytest

from tests.support.exported import example
from tests.support.group_listener import free_group, said
from tests.support.referee_messages import ENUMS, Referee, referee, team
from tests.support.waiting import until
from touchline.league.packet import PublishingConfig, geometry_packet, published_cameras
from touchline.network.address import MulticastAddress
from touchline.network.listener import RECEIVE_S
from touchline.referee.live import RefereeListener
from touchline.referee.received import (
    KEEP_S,
    STALE_S,
    GameController,
    RefereeMessage,
    choose,
    others,
)

GOOD = referee()
JUNK = {
    "empty": b"",
    "text": b"GET / HTTP/1.1\r\n\r\n",
    "zeros": bytes(500),
    "ones": b"\xff" * 500,
    "cut off": GOOD[:-3],
    "cut in half": GOOD[: len(GOOD) // 2],
    "the longest": os.urandom(65_507),
    "geometry": geometry_packet(
        published_cameras([example("ssl", 0)], PublishingConfig(limit_mm=1e9))
    ),
    "one team": Referee(
        packet_timestamp=1,
        stage=1,
        command=1,
        command_counter=1,
        command_timestamp=1,
        yellow=team("MRL"),
    ).SerializePartialToString(),
    "no text": GOOD.replace(b"ibis", b"\xff\xfe\xff\xfe"),
}


@pytest.fixture
def there():
    """(where, a listener that listens there)."""
    way = free_group()
    listener = RefereeListener(MulticastAddress(**way))
    assert listener.joined.wait(20)
    yield way, listener
    listener.close()


def received(listener, way, data, sock, wanted):
    """Send a packet until the sender is as wanted."""

    def look():
        port = said(data, **way, sock=sock)
        return listener.get(f"127.0.0.1-{port}")

    return until(look, lambda found: found is not None and wanted(found))


def test_a_game_controllers_message_is_recognised(there):
    way, listener = there
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        found = received(listener, way, GOOD, sock, lambda one: one.message)
        message = found.message
        assert (message.blue, message.yellow) == ("ibis", "TIGERs Mannheim")
        assert (message.stage_name, message.command_name) == ("normal-first-half", "force-start")
        assert message.source == "the-one" and message.blue_on_positive_half is None
        sent_us = Referee.FromString(GOOD).packet_timestamp
        assert message.sent_s == pytest.approx(sent_us / 1e6, abs=1e-6)
        changed = referee(
            blue=" KI\x00KS ",
            stage=ENUMS["Stage"]["LATER"],
            command=ENUMS["Command"]["NEWER"],
            blue_team_on_positive_half=True,
        )
        message = received(
            listener, way, changed, sock, lambda one: one.message.blue == "KIKS"
        ).message
        assert (message.stage_name, message.command_name) == ("unknown", "unknown")
        assert message.blue_on_positive_half is True


@pytest.mark.parametrize("kind", JUNK)
def test_junk_is_counted_and_changes_nothing(there, kind):
    way, listener = there
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        received(listener, way, GOOD, sock, lambda one: one.message)
        found = received(listener, way, JUNK[kind], sock, lambda one: one.refused)
        assert found.refusal and found.message.blue == "ibis"
        after = received(
            listener, way, referee(blue="MRL"), sock, lambda one: one.message.blue == "MRL"
        )
        assert after.message.yellow == "TIGERs Mannheim"


def controller(address, since_s, message_s, source="", blue="ibis"):
    message = RefereeMessage(0.0, 1, 1, blue, "MRL", source=source)
    return GameController(
        address, 1, message_s, message=message, message_s=message_s, since_s=since_s
    )


def test_of_two_game_controllers_the_one_that_sends_longest_without_a_gap_counts():
    now_s = 1000.0
    first, second = controller("a", 0.0, now_s), controller("b", 500.0, now_s)
    assert choose([second, first], now_s) is first
    assert others([second, first], first, now_s) == [second]
    silent = controller("a", 0.0, now_s - STALE_S - 1)
    assert (
        choose([silent, second], now_s) is second and others([silent, second], second, now_s) == []
    )


def test_a_silent_game_controller_counts_for_some_minutes_where_no_other_sends():
    last, before = controller("a", 0.0, 100.0), controller("b", 0.0, 50.0)
    assert choose([before, last], 100.0 + KEEP_S) is last
    assert choose([before, last], 100.1 + KEEP_S) is None
    assert choose([GameController("c", 1, 100.0)], 100.0) is None


def test_one_game_controller_by_two_ways_is_no_second_one():
    a, b, c = (
        controller("a", 0.0, 10.0, "x"),
        controller("b", 1.0, 10.0, "x"),
        controller("c", 2.0, 10.0, "y"),
    )
    assert others([a, b, c], a, 10.0) == [c]


def test_a_gap_begins_anew(there):
    _, listener = there
    late = GameController("a", 1, 0.0)
    first = listener.accept(late, GOOD)
    again = listener.accept(first, GOOD)
    assert again.since_s == first.since_s
    gap = listener.accept(controller("a", 0.0, time.monotonic() - STALE_S - 1), GOOD)
    assert gap.since_s == gap.message_s > 0


def test_a_flood_costs_no_more_than_a_few_looks_a_second():
    way, looks = free_group(), []
    listener = RefereeListener(MulticastAddress(**way), lambda: looks.append(time.monotonic()))
    try:
        assert listener.joined.wait(20)
        begun_s = time.monotonic()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
            while listener.datagrams < 100:
                said(GOOD, **way, sock=sock)
        until(lambda: looks)
        assert len(looks) <= (time.monotonic() - begun_s) / RECEIVE_S + 1
    finally:
        listener.close()
