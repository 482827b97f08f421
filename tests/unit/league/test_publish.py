"""Geometry on the league's multicast group: real sockets, and a listener that shares nothing with the sender."""

import json
import socket
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest

from tests.support import ssl_listener as listener
from tests.support.exported import example, field_around, model_of, of_model, places
from tests.support.fields import plain_field
from tests.support.group_listener import Listener, free_group
from tests.support.waiting import until
from touchline.core.errors import BadInput, TouchlineError
from touchline.core.sentences import marking_name
from touchline.league.ball_models import BallModels, ChipFixedLoss, StraightTwoPhase
from touchline.league.live import Publisher
from touchline.league.packet import PublishingConfig, geometry_packet, published_cameras
from touchline.league.packet_camera import PacketCameraCache, packet_camera
from touchline.models import MODELS, RayModel
from touchline.network.address import MulticastAddress, NetworkError, is_here
from touchline.network.multicast import MulticastSender
from touchline.ssl_protocol.protobuf import MAX_BYTES, decode, encode
from touchline.ssl_protocol.ssl_vision_pb2 import SSL_DetectionFrame, SSL_WrapperPacket, Vector2f

EXAMPLES = [(name, i) for name in MODELS for i in range(3)]
ALL = PublishingConfig(limit_mm=1e9)


@pytest.fixture
def way():
    """(what a listener needs, the config that publishes there)."""
    told = free_group()
    return told, PublishingConfig(enabled=True, interval_s=60.0, **told)


def on_quarters(*models):
    """Calibrations named a, b, … that share a field of four quarters."""
    field = plain_field(model_of("ssl", 0).region)
    made = [of_model(model, id=f"id-{i}", camera="abcdef"[i]) for i, model in enumerate(models)]
    assert all(one.field["name"] == field.name for one in made)
    return made


def test_a_listener_gets_every_camera_and_projects_as_we_do_within_the_stated_loss(way):
    told, config = way
    heard_of = {}
    with Listener(**told) as ear, closing(MulticastSender(config.address)) as group:
        for name, index in EXAMPLES:
            (one,) = published_cameras([example(name, index)], ALL)
            group.send(geometry_packet([one]))
            heard_of[name, index] = one, listener.Packet.FromString(ear.receive().data)
    for (name, index), (one, packet) in heard_of.items():
        assert (
            packet.source
            == listener.Packet.DESCRIPTOR.fields_by_name["source"]
            .enum_type.values_by_name["SSL_Source_OTHER"]
            .number
        )
        (calib,) = packet.geometry.calib
        model = model_of(name, index)
        if not isinstance(model, RayModel):
            continue
        for z_mm, worst_mm in (
            (0.0, one.packet.loss.worst_mm),
            (150.0, one.packet.loss.hat_worst_mm),
        ):
            spots = places(model.region, z_mm, 25)
            pixels = model.project(spots)
            seen = ((pixels >= -0.5) & (pixels <= np.array(tuple(model.image_size)) - 0.5)).all(
                axis=1
            )
            off = np.linalg.norm(
                listener.looked_up(calib, pixels[seen], z_mm) - spots[seen, :2], axis=1
            )
            assert off.max() <= 1.02 * worst_mm + 1e-3, (name, index, z_mm)
            assert off.max() >= 0.8 * worst_mm - 1e-3, (name, index, z_mm)
            if one.packet.exact:  # the league's own model: only four bytes a number are lost
                ours = one.sent
                same = {
                    k: np.float32(getattr(ours, k))
                    for k in ("focal_length", "distortion", "q0", "tx", "tz")
                }
                assert same == {k: np.float32(getattr(calib, k)) for k in same}
                np.testing.assert_allclose(
                    listener.projected(calib, spots[seen]), pixels[seen], atol=2e-3
                )


def test_what_is_read_back_from_the_wire_projects_to_the_same_pixels(way):
    told, config = way
    with Listener(**told) as ear, closing(MulticastSender(config.address)) as group:
        group.send(geometry_packet(published_cameras([example("brown-conrady", 1)], ALL)))
        data = ear.receive().data
    (calib,) = listener.Packet.FromString(data).geometry.calib
    from touchline.workflows import interchange

    model = model_of("brown-conrady", 1)
    ours = interchange.read_file(data).camera(
        {k: getattr(model, k) for k in interchange.RECTANGLE_FIELDS}
    )
    spots = places(model.region)
    np.testing.assert_allclose(listener.projected(calib, spots), ours.project(spots), atol=1e-6)


def test_the_loss_is_told_with_its_place_before_anything_is_sent():
    (one,) = published_cameras([example("fisheye", 1)], PublishingConfig(limit_mm=1.0))
    told = json.loads(json.dumps(one.to_json(), allow_nan=False))
    assert not told["published"] and told["problem"]["reason"] == "loss-above-limit"
    worst_mm = max(told["loss"]["worst_mm"], told["loss"]["hat_worst_mm"])
    assert len(told["loss"]["worst_place"]) == 2 and f"{worst_mm:.0f} mm" in told["problem"]["what"]
    # without its points, nothing else is known of it
    assert worst_mm > 1 and told["expected"] is None
    assert geometry_packet([one]) is None


def test_a_camera_above_the_limit_is_sent_once_that_was_approved():
    calibration = example("fisheye", 1)
    approving = PublishingConfig(limit_mm=1.0, approved={"north": calibration.id})
    assert published_cameras([calibration], approving)[0].sent is not None
    assert (
        published_cameras([replace(calibration, id="the-next-version")], approving)[0].sent
        is not None
    )
    assert published_cameras([replace(calibration, camera="south")], approving)[0].sent is None
    assert published_cameras([calibration], PublishingConfig(limit_mm=1e6))[0].sent is not None


def test_two_cameras_with_one_number_are_not_both_sent():
    a, b = on_quarters(model_of("ssl", 0), model_of("ssl", 0))
    first, second = published_cameras([a, b], PublishingConfig())
    assert (
        first.sent is not None and second.sent is None and second.problem.reason == "number-taken"
    )
    first, second = published_cameras([a, b], PublishingConfig(numbers={"b": 3}))
    assert [one.sent.camera_id for one in (first, second)] == [0, 3]


def test_a_packet_has_one_field_that_of_most_cameras_or_the_one_that_is_named():
    model = model_of("ssl", 0)
    a, b, c = on_quarters(model, model, model)
    other = replace(field_around(model.region), name="another").to_json()
    c = replace(c, field=other)
    numbers = {"b": 1, "c": 2}
    told = published_cameras([c, a, b], PublishingConfig(numbers=numbers))
    assert [(one.name, one.sent is not None) for one in told] == [
        ("c", False),
        ("a", True),
        ("b", True),
    ]
    assert told[0].problem.reason == "other-field"
    told = published_cameras([c, a, b], PublishingConfig(numbers=numbers, field="another"))
    assert [(one.name, one.sent is not None) for one in told] == [
        ("c", True),
        ("a", False),
        ("b", False),
    ]


def test_a_calibration_made_before_its_field_was_changed_is_not_sent_with_the_new_geometry():
    model = model_of("ssl", 0)
    old, new = on_quarters(model, model)
    field = field_around(model.region)
    line = next(iter(field.lines.values()))
    moved = replace(field, lines={**field.lines, line.name: line.shifted(15.0)})
    now = replace(moved, lines={**moved.lines, "added": replace(line.shifted(300.0), name="added")})
    old = replace(old, field=field.to_json(), created_at="2026-01-02")
    # a line that was added leaves it right
    new = replace(new, field=moved.to_json(), created_at="2026-01-01")
    told = published_cameras([old, new], PublishingConfig(numbers={"b": 1}), fields={now.name: now})
    assert [(one.name, one.sent is not None) for one in told] == [("a", False), ("b", True)]
    assert (
        told[0].problem.reason == "field-changed"
        and marking_name(line.name) in told[0].problem.what
    )
    packet = decode(SSL_WrapperPacket, geometry_packet(told, {now.name: now}))
    sent = {one.name: (one.p1, one.p2) for one in packet.geometry.field.field_lines}
    for name in (line.name, "added"):
        assert sent[name] == (
            packet_point(now.lines[name].start),
            packet_point(now.lines[name].end),
        )


def packet_point(point):
    return Vector2f(x=point[0], y=point[1])


def test_a_calibration_that_cannot_be_a_camera_is_left_out_and_the_others_are_sent():
    good = example("ssl", 0)
    broken = replace(good, id="broken", camera="broken", model_parameters={})
    told = published_cameras([broken, good], PublishingConfig())
    assert [one.sent is not None for one in told] == [False, True] and told[0].problem.fix
    assert told[0].to_json()["problem"]["reason"]


def test_a_version_is_worked_out_once(monkeypatch):
    asked = []
    monkeypatch.setattr(
        "touchline.league.packet_camera.packet_camera",
        lambda calibration: asked.append(calibration.id) or packet_camera(calibration),
    )
    wiring, calibration = PacketCameraCache(), example("ssl", 0)
    assert wiring(calibration) is wiring(calibration) and asked == [calibration.id]
    for i in range(2 * PacketCameraCache.MAX_CAMERAS):
        wiring(replace(calibration, id=f"c{i}", model_parameters={}))
    assert len(wiring._cache) <= PacketCameraCache.MAX_CAMERAS


def test_ttl_and_interface_are_those_that_were_set():
    for ttl in (0, 1, 7):
        told = {**free_group(), "ttl": ttl}
        with Listener(**told) as ear, closing(MulticastSender(MulticastAddress(**told))) as group:
            group.send(b"\x18\x01")
            came = ear.receive()
        assert (came.ttl, came.interface, came.sender[0]) == (ttl, "lo", "127.0.0.1")
        named = {**told, "interface": "lo"}
        with Listener(**told) as ear, closing(MulticastSender(MulticastAddress(**named))) as group:
            group.send(b"\x18\x01")
            assert (ear.receive().ttl, came.interface) == (ttl, "lo")


def test_other_packets_go_by_the_same_socket(way):
    told, config = way
    frame = encode(
        SSL_WrapperPacket(
            detection=SSL_DetectionFrame(frame_number=7, t_capture=1.5, t_sent=1.6, camera_id=0)
        )
    )
    publisher = Publisher(config, lambda: [example("ssl", 0)], packet_camera)
    with Listener(**told) as ear:
        try:
            publisher.wake()
            geometry = ear.hear_until(
                lambda came: listener.Packet.FromString(came.data).HasField("geometry")
            )
            publisher.sender.send(frame)
            detection = ear.hear_until(lambda came: came.data == frame)
            assert geometry.sender == detection.sender
            assert publisher.sender.is_own_packet(*detection.sender)
            assert not publisher.sender.is_own_packet("127.0.0.1", detection.sender[1] ^ 1)
            # another machine
            assert not publisher.sender.is_own_packet("203.0.113.9", detection.sender[1])
        finally:
            publisher.close()


def test_what_is_activated_is_said_at_once_and_the_rest_every_interval(way):
    told, config = way
    standing = [example("ssl", 0)]
    publisher = Publisher(config, lambda: standing, packet_camera)  # a minute between two packets
    with Listener(**told) as ear:
        try:
            publisher.wake()
            assert ear.receive() is not None
            standing[:] = [replace(example("ssl", 1), id="next")]
            publisher.wake()
            focal = np.float32(model_of("ssl", 1).focal_px)
            ear.hear_until(
                lambda came: (
                    listener.Packet.FromString(came.data).geometry.calib[0].focal_length == focal
                )
            )
        finally:
            publisher.close()
        often = Publisher(replace(config, interval_s=0.1), lambda: standing, packet_camera)
        try:
            assert [ear.receive() is not None for _ in range(4)] == [True] * 4
        finally:
            often.close()
        while ear.receive(0.05) is not None:
            pass
        assert ear.receive(0.5) is None  # closed is silent


def test_a_broken_shelf_is_told_and_tried_again(way):
    told, config = way
    broken = [True]

    def active():
        if broken:
            raise RuntimeError
        return [example("ssl", 0)]

    publisher = Publisher(config, active, packet_camera)
    with Listener(**told) as ear:
        try:
            until(lambda: publisher.status.failures > 1)
            assert publisher.status.problem.reason == "publishing-failed"
            broken.clear()
            assert ear.receive() is not None
            until(lambda: publisher.status.problem is None)
        finally:
            publisher.close()


@pytest.mark.parametrize(
    "wrong",
    [
        {"group": "10.0.0.1"},
        {"group": "224.5.23"},
        {"group": "ff02::1"},
        {"group": ""},
        {"group": "224.5.23.2 "},
        {"port": 0},
        {"port": 70_000},
        {"ttl": -1},
        {"ttl": 256},
        {"interface": "a/b"},
        {"interface": "x" * 40},
        {"interface": "224.0.0.1"},
        {"interface": "0.0.0.0"},
        {"interface": "eth0\0"},
        {"interface": "e\ud800"},
    ],
)
def test_a_route_that_cannot_be_is_refused(wrong):
    with pytest.raises(BadInput) as refused:
        MulticastAddress(**wrong)
    assert refused.value.fix.endswith(".") and refused.value.reason.startswith("bad-")


@pytest.mark.parametrize(
    "wrong",
    [
        {"interval_s": 0.0},
        {"interval_s": float("nan")},
        {"limit_mm": float("inf")},
        {"limit_mm": -1.0},
        {"numbers": {"a": -1}},
        {"numbers": {"a": 2**32}},
    ],
)
def test_a_plan_that_cannot_be_is_refused(wrong):
    with pytest.raises(BadInput):
        PublishingConfig(**wrong)


@pytest.mark.parametrize("interface", ["gone0", "203.0.113.9"])
def test_an_interface_that_is_not_there_is_named_with_those_that_are(interface):
    group = MulticastSender(MulticastAddress(interface=interface))
    for attempt in (group.check, lambda: group.send(b"x")):
        with pytest.raises(NetworkError) as refused:
            attempt()
        assert refused.value.reason == "no-interface" and interface in refused.value.what
        assert "lo (127.0.0.1)" in refused.value.fix


def test_a_packet_that_no_datagram_carries_is_refused_by_its_length():
    with closing(MulticastSender(MulticastAddress(**free_group()))) as group:
        with pytest.raises(BadInput):
            group.send(bytes(MAX_BYTES + 1))
        group.send(bytes(MAX_BYTES))


def test_checking_says_nothing_to_anybody(way):
    told, config = way
    with Listener(**told) as ear:
        MulticastSender(config.address).check()
        assert ear.receive(0.3) is None


def test_an_address_is_here_only_where_this_machine_has_it():
    assert is_here("127.0.0.1") and not is_here("203.0.113.9")


def test_a_plan_is_kept_as_it_is_and_nonsense_is_refused():
    config = PublishingConfig(
        *(True, True, "239.1.1.1", 1234, "lo", 3, True, 0.5, 2.0, False, 0.0, "ssl-div-b"),
        BallModels(StraightTwoPhase(-3.0, -0.4, 0.6), ChipFixedLoss(0.5, 0.9, 0.6)),
        {"a": 1},
        {"a": "b"},
    )
    assert PublishingConfig.from_json(json.loads(json.dumps(config.to_json()))) == config
    for wrong in (
        None,
        [],
        {"enabled": "yes"},
        {"nobody": 1},
        {"port": "1"},
        {"numbers": {"a": "1"}},
        {"group": 7},
        {"numbers": [1]},
        {"ttl": 1e400},
        {"listen_first_s": 61},
        {"ball_models": {"straight_two_phase": {"acc_slide": 3, "acc_roll": -1, "k_switch": 0.6}}},
        {"ball_models": {"chip_fixed_loss": {"damping_z": 0.5}}},
    ):
        with pytest.raises(TouchlineError):
            PublishingConfig.from_json(wrong)


def test_whoever_listens_shares_the_port():
    """League programs set one or the other way of sharing; each must be able to listen beside us."""
    from touchline.network.multicast import MulticastReceiver

    told = free_group()
    address = MulticastAddress(**told)
    with (
        closing(MulticastReceiver(address)),
        Listener(**told) as second,
        closing(MulticastReceiver(address)),
        closing(MulticastSender(address)) as group,
    ):
        group.send(b"\x18\x01")
        assert second.receive() is not None
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as selfish:
        selfish.bind((told["group"], told["port"]))
        with pytest.raises(NetworkError) as refused:
            MulticastReceiver(MulticastAddress(**told))
        assert refused.value.reason == "port-taken"


def test_the_packet_we_send_is_one_that_we_would_take():
    told = published_cameras([example("ssl", 0)], PublishingConfig())
    geometry = decode(SSL_WrapperPacket, geometry_packet(told)).geometry
    assert [camera.camera_id for camera in geometry.calib] == [0]
