"""What others publish: each sender's newest whole geometry, whatever else strangers send."""

import os
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.exported import example, model_of
from tests.support.group_listener import Listener, free_group, said
from tests.support.paths import ROOT
from tests.support.publishing import publishing_of
from tests.support.ssl_messages import changed
from tests.support.tiers import long
from tests.support.waiting import until
from touchline.core.errors import TouchlineError
from touchline.league.live import MAX_CAMERAS, GeometryListener, Publisher
from touchline.league.packet import PublishingConfig, geometry_packet, published_cameras
from touchline.league.packet_camera import packet_camera
from touchline.league.received import RemotePublisher, contradictions, received_json
from touchline.network.address import MulticastAddress
from touchline.network.listener import MAX_SENDERS
from touchline.ssl_protocol.protobuf import decode, encode
from touchline.ssl_protocol.ssl_vision_pb2 import (
    SSL_DetectionFrame,
    SSL_GeometryData,
    SSL_Source,
    SSL_WrapperPacket,
)
from touchline.store.fields import load_fields

FIELDS = load_fields()
LISTEN = (
    "import sys\n"
    "from tests.support.group_listener import Listener\n"
    "with Listener(sys.argv[1], int(sys.argv[2])) as ear:\n"
    "    while True: print(len(ear.receive(60).data), flush=True)\n"
)


def packet(index: int = 0, name: str = "ssl", **config) -> bytes:
    return geometry_packet(
        published_cameras([example(name, index)], PublishingConfig(limit_mm=1e9, **config))
    )


def float_bytes(value: float) -> bytes:
    return struct.pack("<f", value)


GOOD = packet()
SENT = decode(SSL_WrapperPacket, GOOD).geometry
WRONG = {
    "empty": b"",
    "text": b"GET / HTTP/1.1\r\n\r\n",
    "zeros": bytes(500),
    "ones": b"\xff" * 500,
    "cut off": GOOD[:-3],
    "cut in half": GOOD[: len(GOOD) // 2],
    "the longest": os.urandom(65_507),
    "a length that lies": b"\x12\xff\xff\xff\xff\x0f" + GOOD[4:],
    "nan": GOOD.replace(float_bytes(model_of("ssl", 0).focal_px), float_bytes(float("nan"))),
    "inf": GOOD.replace(float_bytes(model_of("ssl", 0).focal_px), float_bytes(float("inf"))),
    "no field": b"\x12\x00",
    "nested": b"\x12\x03\x0a\x01\x0a",
    "too many cameras": encode(
        SSL_WrapperPacket(geometry=changed(SENT, calib=[*SENT.calib] * (MAX_CAMERAS + 1)))
    ),
}


@pytest.fixture
def there():
    """(where, an listener that listens there)."""
    told = free_group()
    listener = GeometryListener(MulticastAddress(**told))
    assert listener.joined.wait(20)
    yield told, listener
    listener.close()


def read_by(listener, id, data, told, sock):
    """Send a packet until the listener has read it: it skips some of a sender that costs it much, on a busy machine."""
    while True:
        before = listener.get(id)
        said(data, **told, sock=sock)
        after = until(
            lambda: listener.get(id), lambda found, packets=before.packets: found.packets > packets
        )
        if after.skipped == before.skipped:
            return after
        time.sleep(0.05)  # so that what it may spend grows again


def test_nan_and_inf_are_really_in_the_wrong_packets():
    assert WRONG["nan"] != GOOD and WRONG["inf"] != GOOD


def test_two_senders_are_told_apart_and_the_newest_whole_packet_of_each_is_kept(there):
    told, listener = there
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as a,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as b,
    ):
        port_a, port_b = said(packet(1), **told, sock=a), said(packet(2), **told, sock=b)
        until(lambda: len(listener.senders) == 2)
        for data in (GOOD, GOOD[:-3]):
            read_by(listener, f"127.0.0.1-{port_a}", data, told, a)
    one, other = (listener.get(f"127.0.0.1-{port}") for port in (port_a, port_b))
    assert (one.data, other.data) == (GOOD, packet(2))
    assert (one.packets - one.skipped, one.geometries, one.refused) == (
        3,
        2,
        1,
    ) and other.refused == 0
    assert one.source == SSL_Source.OTHER and "ends within" in one.refusal


@pytest.mark.parametrize("kind", WRONG)
def test_what_is_no_whole_packet_is_counted_and_left(there, kind):
    told, listener = there
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        id = f"127.0.0.1-{said(GOOD, **told, sock=stranger)}"
        until(lambda: (found := listener.get(id)) and found.geometries == 1)
        found = read_by(listener, id, WRONG[kind], told, stranger)
        assert found.refused == 1 and found.data == GOOD and found.refusal
        assert read_by(listener, id, GOOD, told, stranger).geometries == 2


@pytest.mark.parametrize("examples", [50, long(300)])
def test_any_bytes_are_told_as_they_are_or_refused(examples):
    listener = GeometryListener.__new__(GeometryListener)
    ours = published_cameras([example("ssl", 0)], PublishingConfig())

    @settings(max_examples=examples, derandomize=True, deadline=None)
    @given(
        st.one_of(
            st.binary(max_size=300),
            st.tuples(st.integers(0, len(GOOD) - 1), st.binary(max_size=4)).map(
                lambda cut: GOOD[: cut[0]] + cut[1] + GOOD[cut[0] + len(cut[1]) :]
            ),
        )
    )
    def is_told(data):
        after = listener._read(RemotePublisher("127.0.0.1", 1, 0.0), data)
        told = received_json(
            replace(after, geometry_s=after.last_s), time.monotonic(), FIELDS.values(), ours
        )
        assert told["refused"] == (1 if told["refusal"] else 0)

    is_told()


def test_detections_are_counted_and_passed_over(there):
    told, listener = there
    frame = encode(
        SSL_WrapperPacket(
            source=SSL_Source.GRSIM,
            detection=SSL_DetectionFrame(frame_number=1, t_capture=1, t_sent=1, camera_id=0),
        )
    )
    said(frame, **told)
    (found,) = until(lambda: listener.senders)
    assert (found.packets, found.geometries, found.refused) == (1, 0, 0)
    described = received_json(found, time.monotonic(), (), ())
    assert described["source"] == "grsim" and described["cameras"] == []


def test_our_own_packets_are_not_somebody_elses():
    told = free_group()
    publisher = Publisher(
        PublishingConfig(enabled=True, interval_s=0.1, **told),
        lambda: [example("ssl", 0)],
        packet_camera,
    )
    listener = GeometryListener(MulticastAddress(**told), publisher.sender.is_own_packet)
    try:
        until(lambda: listener.own > 3)
        said(GOOD, **told)
        until(lambda: listener.senders)
        assert len(listener.senders) == 1
    finally:
        listener.close()
        publisher.close()


def test_our_own_packets_stay_ours_while_the_settings_change(tmp_path):
    """The first of a new sender and the last of the one before are heard while they are exchanged."""
    told = free_group()
    publishing = publishing_of(
        tmp_path, lambda: [example("ssl", 0)], enabled=True, interval_s=0.1, **told
    )
    publishing.start()
    try:
        for number in range(20):
            publishing.change({"numbers": {"north": number}})
            own = publishing.received()["own"]
            until(lambda own=own: publishing.received()["own"] > own)
        assert publishing.received()["items"] == []
    finally:
        publishing.close()


def test_another_calibration_for_our_number_contradicts_and_an_echo_of_ours_does_not(there):
    told, listener = there
    ours = published_cameras([example("ssl", 0)], PublishingConfig())
    cameras = {}
    for name, data in (
        ("echo", GOOD),
        ("other", packet(1)),
        ("elsewhere", packet(1, numbers={"north": 5})),
    ):
        port = said(data, **told)
        found = until(
            lambda port=port: (one := listener.get(f"127.0.0.1-{port}")) and one.geometry and one
        )
        (cameras[name],) = received_json(found, time.monotonic(), FIELDS.values(), ours)["cameras"]
    assert {name: (one["ours"], one["contradicts"]) for name, one in cameras.items()} == {
        "echo": ("north", False),
        "other": ("north", True),
        "elsewhere": (None, False),
    }
    found = replace(
        found,
        data=packet(1),
        geometry=decode(SSL_WrapperPacket, packet(1)).geometry,
        geometry_s=found.geometry_s - 3600,
    )
    # long silent
    assert not received_json(found, time.monotonic(), FIELDS.values(), ours)["cameras"][0][
        "contradicts"
    ]


def test_an_echo_with_a_zero_of_another_sign_or_a_field_of_tomorrow_contradicts_nobody():
    (one,) = published_cameras([example("ssl", 0)], PublishingConfig())
    zero = replace(one, packet=replace(one.packet, sent=changed(one.packet.sent, distortion=-0.0)))
    calib = encode(changed(zero.sent, distortion=0.0)) + b"\xd0\x3e\x01"
    echo = changed(SENT, calib=[type(zero.sent).FromString(calib)])
    sender = RemotePublisher("127.0.0.1", 1, 0.0, geometry=echo, geometry_s=time.monotonic())
    assert contradictions([sender], [zero], time.monotonic()) == []
    echo.calib[0].distortion = 0.01
    assert contradictions([sender], [zero], time.monotonic()) == [(sender, zero)]


def test_the_field_that_is_sent_is_found_among_those_known_here(there):
    told, listener = there
    from touchline.formats.ssl_field import field_to_wire

    for field, known in (("ssl-div-b", True), (None, False)):
        sent = SENT if field is None else changed(SENT, field=field_to_wire(FIELDS[field]))
        port = said(encode(SSL_WrapperPacket(geometry=sent)), **told)
        found = until(
            lambda port=port: (one := listener.get(f"127.0.0.1-{port}")) and one.geometry and one
        )
        one = received_json(found, time.monotonic(), FIELDS.values(), ())
        assert one["field"]["known"] is known and (field is None or one["field"]["name"] == field)
        assert one["cameras"][0]["position_mm"][2] == pytest.approx(
            model_of("ssl", 0).position_mm[2], abs=0.1
        )


def test_a_field_or_a_camera_that_cannot_be_is_told_and_harms_nobody(there):
    told, listener = there
    (calib,) = SENT.calib
    flat = changed(SENT, field=changed(SENT.field, field_length=-5))
    odd = changed(
        SENT, calib=[changed(calib, q0=0.0, q1=0.0, q2=0.0, q3=0.0), changed(calib, camera_id=1)]
    )
    for sent, check in (
        (flat, lambda one: one["problem"]["fix"] and one["field"] is None),
        (odd, lambda one: [c["problem"] is None for c in one["cameras"]] == [False, True]),
    ):
        port = said(encode(SSL_WrapperPacket(geometry=sent)), **told)
        found = until(
            lambda port=port: (one := listener.get(f"127.0.0.1-{port}")) and one.geometry and one
        )
        assert check(received_json(found, time.monotonic(), FIELDS.values(), ()))


def test_a_number_of_a_source_that_nobody_has_given_yet_is_unknown():
    assert [RemotePublisher("127.0.0.1", 1, 0.0, source=n).source_name for n in (2, 3, 99, -1)] == [
        "ssl-vision",
        "vision-processor",
        "unknown",
        "unknown",
    ]


def test_so_many_senders_are_remembered_first_those_with_geometry(there):
    told, listener = there
    strangers = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(MAX_SENDERS + 9)]
    try:
        ports = [said(GOOD, **told, sock=one) for one in strangers[:3]]
        until(lambda: listener.datagrams == 3)
        for one in strangers[3:]:
            said(b"?", **told, sock=one)
        until(lambda: listener.datagrams == len(strangers))
        until(lambda: listener.get(f"127.0.0.1-{strangers[-1].getsockname()[1]}"))
        assert len(listener.senders) == MAX_SENDERS
        assert {one.port for one in listener.senders if one.geometry} == set(ports)
    finally:
        for one in strangers:
            one.close()


def test_a_flood_is_read_sparingly_and_the_league_is_heard_through_it(there, monkeypatch):
    # On any machine a heavy packet takes longer.
    monkeypatch.setattr("touchline.network.listener.CPU_SHARE_PER_SENDER", 1e-4)
    told, listener = there
    league = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    id = f"127.0.0.1-{said(GOOD, **told, sock=league)}"
    until(lambda: (found := listener.get(id)) and found.geometries)
    field = changed(SENT.field, field_lines=[SENT.field.field_lines[0]] * 900)
    heavy = encode(
        SSL_WrapperPacket(geometry=SSL_GeometryData(field=field, calib=[*SENT.calib] * 64))
    )
    assert 40_000 < len(heavy) < 65_507
    flooders = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2)]
    try:
        for _ in range(12):
            for one in flooders:
                said(heavy, **told, sock=one)
        until(lambda: sum(one.skipped > 5 for one in listener.senders) == len(flooders))
        assert all(one.geometries < 5 for one in listener.senders if one.skipped > 5)

        def heard_again():
            said(packet(1), **told, sock=league)
            return (found := listener.get(id)) and found.data == packet(1)

        until(heard_again)
    finally:
        for one in (*flooders, league):
            one.close()


def test_a_listener_that_is_killed_takes_nobody_with_it():
    told = free_group()
    publisher = Publisher(
        PublishingConfig(enabled=True, interval_s=0.1, **told),
        lambda: [example("ssl", 0)],
        packet_camera,
    )
    listening = subprocess.Popen(
        [sys.executable, "-c", LISTEN, told["group"], str(told["port"])],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        text=True,
    )
    listener = GeometryListener(MulticastAddress(**told))
    try:
        assert int(listening.stdout.readline()) > 100
        listening.send_signal(signal.SIGKILL)
        listening.wait(20)
        before, heard = publisher.status.packets, listener.datagrams
        until(lambda: publisher.status.packets > before + 5 and listener.datagrams > heard + 3)
        assert publisher.status.problem is None
        with Listener(**told) as again:
            assert again.receive() is not None
    finally:
        listener.close()
        publisher.close()
        listening.stdout.close()


def test_a_sender_is_listed_once_its_first_packet_was_read(monkeypatch):
    told, reading, go_on = free_group(), threading.Event(), threading.Event()
    read = GeometryListener._read

    def slowly(self, *given):
        reading.set()
        go_on.wait(20)
        return read(self, *given)

    monkeypatch.setattr(GeometryListener, "_read", slowly)
    listener = GeometryListener(MulticastAddress(**told))
    try:
        assert listener.joined.wait(20)
        said(GOOD, **told)
        assert reading.wait(20) and not listener.senders
        go_on.set()
        (one,) = until(lambda: listener.senders)
        assert one.geometry is not None
    finally:
        go_on.set()
        listener.close()


def test_a_port_that_another_keeps_is_told_and_joined_once_it_is_free():
    told = free_group()
    selfish = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    selfish.bind((told["group"], told["port"]))
    listener = GeometryListener(MulticastAddress(**told))
    try:
        problem = until(lambda: listener.problem)
        assert isinstance(problem, TouchlineError) and problem.reason == "port-taken"
        selfish.close()
        assert listener.joined.wait(20)
        said(GOOD, **told)
        until(lambda: listener.senders)
        assert listener.problem is None
    finally:
        listener.close()
        selfish.close()
