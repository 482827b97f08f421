"""Before its first packet it listens; beside one that sends, it sends the same, with our cameras in their places."""

import socket
from contextlib import closing

import pytest

from tests.support import ssl_listener as listener
from tests.support.group_listener import Listener, free_group, said
from tests.support.league_geometry import packet_of
from tests.support.publishing import publishing_of
from tests.support.waiting import until
from tests.unit.formats.test_league_files import SSL, settings
from tests.unit.league.test_passed_on import FIELD, FIELDS, over, parts_of, sender
from touchline.league import received
from touchline.league.ball_models import BallModels, ChipFixedLoss, StraightTwoPhase
from touchline.league.packet import PublishingConfig, geometry_packet, published_cameras
from touchline.league.received import (
    STALE_S,
    camera_values,
    doubled_cameras,
    geometry_to_pass_on,
    says_the_same,
)
from touchline.ssl_protocol.protobuf import MAX_BYTES
from touchline.ssl_protocol.ssl_vision_pb2 import GeometryPartsPacket
from touchline.workflows.interchange import ball_models, read_file

OURS = BallModels(StraightTwoPhase(-3.0, -0.4, 0.6), ChipFixedLoss(0.5, 0.9, 0.6))


def with_cameras(*numbers: int, focal_px: float = 500.0, program: str = "vision-processor"):
    """Another program's packet, with cameras that are not ours."""
    packet = packet_of(program, "ssl-div-b")
    (ours,) = published_cameras([over(FIELD)], PublishingConfig())
    for number in numbers:
        camera = packet.geometry.calib.add()
        camera.MergeFromString(ours.sent.SerializeToString())
        camera.camera_id, camera.focal_length = number, focal_px + number
    return packet


def test_beside_another_its_cameras_are_sent_as_they_came_and_ours_in_their_place():
    theirs = with_cameras(2, 0, 1).SerializeToString()
    found = geometry_to_pass_on([sender(theirs)], 100.0, None)
    ours = published_cameras([over(FIELD)], PublishingConfig())
    sent = geometry_packet(ours, FIELDS, found)
    read, came = parts_of(sent), parts_of(theirs)
    assert (read.field, read.models) == (came.field, came.models)
    assert [read.calib[0], read.calib[2]] == [came.calib[0], came.calib[2]]
    cameras = listener.Packet.FromString(sent).geometry.calib
    assert [one.camera_id for one in cameras] == [2, 0, 1]
    assert cameras[1].focal_length == pytest.approx(700.0)
    # a program that takes over what it hears now sends the same, and none that hears both starts anew
    echo = listener.Packet.FromString(theirs)
    echo.geometry.calib[1].CopyFrom(cameras[1])
    assert says_the_same(sender(echo.SerializeToString()), sent)
    assert not says_the_same(sender(theirs), sent)


def test_cameras_of_a_sender_that_is_silent_or_that_we_have_sent_are_not_passed_on():
    theirs = sender(with_cameras(0, 1).SerializeToString())
    found = geometry_to_pass_on([theirs], 100.0, None)
    assert [number for number, _ in found.cameras] == [0, 1]
    later = geometry_to_pass_on([theirs], 101.0 + STALE_S, found)
    assert later.cameras == () and later.models == found.models
    repeated = camera_values(theirs.geometry.calib[1])
    kept = geometry_to_pass_on([theirs], 100.0, None, {repeated})
    assert [number for number, _ in kept.cameras] == [0]


def test_what_is_too_much_for_a_datagram_with_ours_is_not_passed_on():
    theirs = GeometryPartsPacket.FromString(with_cameras(1).SerializeToString())
    n = MAX_BYTES - theirs.ByteSize() - 20  # of a newer program, or of somebody who means harm
    size = bytes([0x80 | n & 127, 0x80 | n >> 7 & 127, n >> 14])
    theirs.geometry.field += b"\xa2\x06" + size + bytes(n)
    packet = theirs.SerializeToString()
    assert len(packet) <= MAX_BYTES
    found = geometry_to_pass_on([sender(packet)], 100.0, None)
    ours = published_cameras([over(FIELD)], PublishingConfig())
    assert geometry_packet(ours, FIELDS, found) == geometry_packet(ours, FIELDS)


def test_one_number_from_two_places_is_named_once():
    a, b, c = (
        sender(with_cameras(*numbers, focal_px=focal_px).SerializeToString(), address)
        for numbers, focal_px, address in (
            ((0, 1), 500.0, "10.0.0.1"),
            ((1, 2), 500.0, "10.0.0.2"),
            ((0, 2), 600.0, "10.0.0.3"),
        )
    )
    assert doubled_cameras([a, b], 100.0) == []  # the same calibration of number 1
    found = doubled_cameras([a, b, c], 100.0)
    assert {(n, x.address, y.address) for n, x, y in found} == {
        (0, "10.0.0.1", "10.0.0.3"),
        (2, "10.0.0.2", "10.0.0.3"),
    }
    assert doubled_cameras([a, c], 101.0 + STALE_S) == []


def test_our_ball_models_are_sent_where_no_others_are():
    cameras = published_cameras([over(FIELD)], PublishingConfig())
    alone = listener.Packet.FromString(geometry_packet(cameras, FIELDS, None, OURS))
    assert alone.geometry.models.straight_two_phase.acc_roll == -0.4
    assert alone.geometry.models.chip_fixed_loss.damping_xy_other_hops == 0.9
    theirs = packet_of("ssl-vision", "ssl-div-b").SerializeToString()
    found = geometry_to_pass_on([sender(theirs)], 100.0, None)
    beside = geometry_packet(cameras, FIELDS, found, OURS)
    assert parts_of(beside).models == parts_of(theirs).models
    half = geometry_packet(cameras, FIELDS, None, BallModels(OURS.straight_two_phase, None))
    sent = listener.Packet.FromString(half).geometry.models
    assert sent.HasField("straight_two_phase") and not sent.HasField("chip_fixed_loss")


@pytest.fixture
def way():
    return free_group()


@pytest.fixture
def switched_off(tmp_path, way):
    """Publishing as it runs, switched off, listening first for longer than a test takes."""
    publishing = publishing_of(
        tmp_path,
        lambda: [over(FIELD)],
        FIELDS,
        **{**way, "interval_s": 0.1, "listen_first_s": 60.0},
    )
    publishing.start()
    with closing(publishing):
        yield publishing


def state(publishing) -> str:
    return publishing.status()["state"]


def test_nothing_is_sent_before_others_were_listened_to(switched_off, way):
    with Listener(**way) as ear:
        switched_off.change({"enabled": True})
        until(lambda: switched_off._publisher.status.held == "listening")
        switched_off.publish_anyway()  # nobody has asked
        assert state(switched_off) == "starting" and ear.receive(0.5) is None
        switched_off.change({"listen_first_s": 0.1})
        assert ear.receive() is not None
        until(lambda: state(switched_off) == "on-air")


def test_beside_another_it_asks_first_and_stays_on_air_whoever_comes_later(switched_off, way):
    with Listener(**way) as ear, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        switched_off.change({"enabled": True})
        until(lambda: switched_off.received()["listening"])
        port = said(with_cameras(0, 1).SerializeToString(), **way, sock=other)
        until(lambda: state(switched_off) == "asking")
        (warning,) = switched_off.warnings
        assert warning.reason == "another-publisher" and "127.0.0.1" in warning.text
        (item,) = switched_off.received()["items"]
        assert [one["contradicts"] for one in item["cameras"]] == [True, False]
        while (came := ear.receive(0.5)) is not None:
            assert came.sender[1] == port  # of ours nothing
        switched_off.publish_anyway()
        came = ear.hear_until(lambda came: came.sender[1] != port)
        cameras = listener.Packet.FromString(came.data).geometry.calib
        assert [one.focal_length for one in cameras] == [pytest.approx(700.0), 501.0]
        # ssl-vision's file gets ours, not those of the other program
        assert switched_off.ssl_vision_settings(settings(SSL, SSL)).cameras == (0,)
        until(lambda: state(switched_off) == "on-air")
        said(with_cameras(0, focal_px=9.0).SerializeToString(), **way, sock=other)
        until(lambda: switched_off.received()["items"][0]["cameras"][0]["focal_px"] == 9.0)
        assert state(switched_off) == "on-air"
        assert [one.reason for one in switched_off.warnings] == ["two-publishers"]


def test_once_the_other_is_silent_it_publishes(switched_off, way, monkeypatch):
    with Listener(**way) as ear, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        switched_off.change({"enabled": True, "listen_first_s": 0.0, "absorb": True})
        switched_off.change({"enabled": False})
        port = said(with_cameras(0).SerializeToString(), **way, sock=other)
        until(lambda: switched_off.received()["items"])
        while ear.receive(0.1) is not None:
            pass
        switched_off.change({"enabled": True})
        until(lambda: state(switched_off) == "asking")
        monkeypatch.setattr(received, "STALE_S", 0.0)
        assert ear.hear_until(lambda came: came.sender[1] != port)


def test_after_a_restart_it_goes_on_at_once(tmp_path, way):
    """In the middle of a match: whoever sends anything to the group must not keep us silent."""
    publishing = publishing_of(
        tmp_path,
        lambda: [over(FIELD)],
        FIELDS,
        **{**way, "enabled": True, "interval_s": 0.1, "listen_first_s": 60.0},
    )
    with Listener(**way) as ear, closing(publishing):
        publishing.start()
        assert ear.receive() is not None


def test_a_sender_of_the_same_is_no_other(switched_off, way):
    ours = geometry_packet(published_cameras([over(FIELD)], PublishingConfig()), FIELDS)
    with Listener(**way) as ear, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        switched_off.change({"enabled": True, "absorb": True})
        until(lambda: switched_off.received()["listening"])
        port = said(ours, **way, sock=other)
        until(lambda: switched_off.received()["items"])
        assert state(switched_off) == "starting"
        switched_off.change({"listen_first_s": 0.0})
        ear.hear_until(lambda came: came.sender[1] != port)


def test_the_file_for_the_other_program_has_what_would_be_sent(switched_off):
    switched_off.change({"ball_models": OURS.to_json()})
    data = switched_off.geometry_file()
    assert BallModels.of(ball_models(data)) == OURS
    assert read_file(data).focal_px == pytest.approx((700.0, 700.0))
