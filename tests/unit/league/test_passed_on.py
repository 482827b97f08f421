"""What another publisher says of the field beyond its cameras is passed on byte for byte; the rest is told."""

import json
import socket
import time
from contextlib import closing
from dataclasses import replace

import pytest

from tests.support import ssl_listener as listener
from tests.support.group_listener import Listener, free_group, said
from tests.support.league_geometry import MODELS, PROGRAMS, packet_of
from tests.support.publishing import over, publishing_of
from tests.support.waiting import until
from touchline.league.live import GeometryListener
from touchline.league.packet import (
    MAX_AGE_S,
    PassedOn,
    PublishingConfig,
    geometry_packet,
    published_cameras,
)
from touchline.league.received import (
    STALE_S,
    RemotePublisher,
    geometry_differences,
    geometry_to_pass_on,
)
from touchline.league.service import RECEIVED_FILE
from touchline.ssl_protocol.protobuf import decode
from touchline.ssl_protocol.ssl_vision_pb2 import GeometryPacket, GeometryPartsPacket
from touchline.store.fields import load_fields

FIELDS = load_fields()
FIELD = FIELDS["ssl-div-b"]
UNKNOWN = b"\xa2\x06\x03abc"  # field 100 of a message: a program newer than ours


def packet_with_unknown(program: str, division: str = "ssl-div-b") -> bytes:
    """The program's packet with something in its field and its ball models that only newer programs know."""
    parts = GeometryPartsPacket.FromString(packet_of(program, division).SerializeToString())
    parts.geometry.field += UNKNOWN
    parts.geometry.models += UNKNOWN
    return parts.SerializeToString()


def parts_of(packet: bytes):
    return decode(GeometryPartsPacket, packet).geometry


def sender(packet: bytes, address: str = "10.0.0.2", geometry_s: float = 100.0) -> RemotePublisher:
    return RemotePublisher(
        address,
        10006,
        geometry_s,
        geometry=decode(GeometryPacket, packet).geometry,
        data=packet,
        source=2,
        geometry_s=geometry_s,
        geometry_at=1e9,
    )


def heard(packet: bytes) -> PassedOn:
    return geometry_to_pass_on([sender(packet)], 100.0, None)


@pytest.mark.parametrize("program", PROGRAMS)
def test_field_and_ball_models_are_sent_as_they_came(program):
    theirs = packet_with_unknown(program)
    cameras = published_cameras([over(FIELD)], PublishingConfig())
    sent = parts_of(geometry_packet(cameras, FIELDS, heard(theirs)))
    assert sent.field == parts_of(theirs).field and UNKNOWN in sent.field
    assert sent.models == parts_of(theirs).models and UNKNOWN in sent.models
    read = listener.Packet.FromString(geometry_packet(cameras, FIELDS, heard(theirs)))
    assert read.geometry.models.straight_two_phase.acc_roll == MODELS[program][0][1]
    assert len(read.geometry.calib) == 1
    assert read.geometry.field.goal_substitution_area_width == (
        300 if program == "ssl-vision" else 0
    )


def test_another_field_or_one_with_exchanged_names_is_not_passed_on():
    cameras = published_cameras([over(FIELD)], PublishingConfig())
    alone = geometry_packet(cameras, FIELDS)
    assert (
        geometry_packet(
            cameras, FIELDS, heard(packet_of("ssl-vision", "ssl-div-a").SerializeToString())
        )
        == alone
    )
    former = packet_of("ssl-vision", "ssl-div-b")
    a, b = (
        next(
            line
            for line in former.geometry.field.field_lines
            if line.name == f"RightField{side}PenaltyStretch"
        )
        for side in ("Left", "Right")
    )
    a.name, b.name = b.name, a.name
    assert geometry_packet(cameras, FIELDS, heard(former.SerializeToString())) == alone


def test_one_sender_is_kept_as_long_as_it_is_heard():
    one, other = (packet_of(program, "ssl-div-b").SerializeToString() for program in PROGRAMS)
    first = geometry_to_pass_on([sender(one, "10.0.0.2", 100.0)], 100.0, None)
    both = [sender(one, "10.0.0.2", 100.0), sender(other, "10.0.0.3", 101.0)]
    assert geometry_to_pass_on(both, 102.0, first) == first
    assert geometry_to_pass_on(both, 102.0, None).address == "10.0.0.3"
    # it has fallen silent
    assert geometry_to_pass_on(both, 100.5 + STALE_S, first).address == "10.0.0.3"
    assert geometry_to_pass_on(both, 200.0 + STALE_S, first) == first  # all have


def test_what_was_heard_is_kept_for_a_day():
    found = heard(packet_of("ssl-vision", "ssl-div-b").SerializeToString())
    assert PassedOn.from_saved(found.saved(), found.heard_at + 10) == found
    assert PassedOn.from_saved(found.saved(), found.heard_at + MAX_AGE_S + 1) is None
    for wrong in (
        None,
        {},
        [],
        {**found.saved(), "packet": "§"},
        {**found.saved(), "packet": ""},
        {**found.saved(), "heard_at": "x"},
        {**found.saved(), "packet": "AAAA"},
    ):
        assert PassedOn.from_saved(wrong, found.heard_at) is None
    assert found.needs_saving(None) and not found.needs_saving(found)
    assert replace(found, packet=packet_with_unknown("ssl-vision")).needs_saving(found)


def test_what_differs_is_said():
    cameras = published_cameras([over(FIELD)], PublishingConfig())
    ours = decode(GeometryPacket, geometry_packet(cameras, FIELDS)).geometry
    theirs = decode(
        GeometryPacket, packet_of("ssl-vision", "ssl-div-b").SerializeToString()
    ).geometry
    assert geometry_differences(ours, ours) == []
    found = geometry_differences(theirs, ours)
    assert any("goal_height 155, 160" in text for text in found) and any(
        "ball models" in text for text in found
    )
    theirs.field.field_lines[0].p1.y += 20
    theirs.field.field_lines[0].p2.y += 20
    assert any(
        "Only it sends" in text and "TopTouchLine" in text
        for text in geometry_differences(theirs, ours)
    )
    other = decode(
        GeometryPacket, packet_of("ssl-vision", "ssl-div-a").SerializeToString()
    ).geometry
    (only,) = geometry_differences(other, ours)
    assert "12000 × 9000" in only and "9000 × 6000" in only


def test_it_is_heard_and_passed_on_over_the_network_and_kept(tmp_path):
    told, kept = free_group(), tmp_path / RECEIVED_FILE
    theirs = packet_with_unknown("vision-processor")
    publishing = publishing_of(
        tmp_path, lambda: [over(FIELD)], FIELDS, enabled=True, interval_s=0.1, **told
    )
    with Listener(**told) as ear, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        publishing.start()
        try:
            ear.hear_until(lambda came: parts_of(came.data).models == b"")
            until(lambda: publishing.received()["listening"])
            port = said(theirs, **told, sock=other)
            came = ear.hear_until(
                lambda came: came.sender[1] != port and parts_of(came.data).models
            )
            assert parts_of(came.data).field == parts_of(theirs).field
            until(lambda: publishing.status()["passed_on"])
            item = until(
                lambda: next(
                    (one for one in publishing.received()["items"] if len(one["differs"]) == 1),
                    None,
                )
            )
            assert "Only you send the cameras with these numbers: 0." in item["differs"][0]["text"]
            assert item["source"] == "vision-processor"
            saved = json.loads(kept.read_bytes())
            assert PassedOn.from_saved(saved, time.time()).packet == theirs
            publishing.change({"pass_on": False})
            ear.hear_until(lambda came: came.sender[1] != port and not parts_of(came.data).models)
            assert publishing.status()["passed_on"] is None
            until(lambda: publishing.received()["items"][0]["differs"])
            assert json.loads(kept.read_bytes()) == saved  # once, while it stays the same
        finally:
            publishing.close()


def test_a_sender_that_is_heard_is_remembered_by_the_next_publisher(tmp_path):
    found = heard(packet_of("ssl-vision", "ssl-div-b").SerializeToString())
    told = free_group()
    with Listener(**told) as ear:
        (tmp_path / RECEIVED_FILE).write_text(
            json.dumps({**found.saved(), "heard_at": time.time() - 1})
        )
        publishing = publishing_of(
            tmp_path, lambda: [over(FIELD)], FIELDS, enabled=True, interval_s=0.1, **told
        )
        publishing.start()
        with closing(publishing):
            assert parts_of(ear.receive().data).models == found.models


def test_a_packet_that_ends_within_the_ball_models_is_refused():
    packet = packet_of("ssl-vision", "ssl-div-b")
    packet.geometry.models.straight_two_phase.ClearField("k_switch")
    reader = GeometryListener.__new__(GeometryListener)
    after = reader._read(RemotePublisher("127.0.0.1", 1, 0.0), packet.SerializePartialToString())
    assert after.refused == 1 and "k_switch" in after.refusal
