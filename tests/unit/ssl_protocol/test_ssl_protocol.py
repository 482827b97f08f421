"""The league's packets: read strictly, against a description of our own, and the traps that other tools fell into."""

import time
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support import ssl_listener as listener
from tests.support.exported import example, model_of, of_model, seen_places
from tests.support.ssl_messages import changed
from tests.support.tiers import rounds
from touchline.core.errors import BadInput, Conflict, TouchlineError
from touchline.formats.ssl_field import field_from_wire, field_to_wire
from touchline.formats.ssl_vision import camera_number
from touchline.models import MODELS
from touchline.network.listener import CPU_SHARE_PER_SENDER
from touchline.ssl_protocol import ssl_vision_pb2
from touchline.ssl_protocol.protobuf import MAX_BYTES, build, decode, encode
from touchline.ssl_protocol.ssl_vision_pb2 import (
    SSL_DetectionFrame,
    SSL_DetectionRobot,
    SSL_FieldLineSegment,
    SSL_GeometryCameraCalibration,
    SSL_GeometryData,
    SSL_GeometryFieldSize,
    SSL_WrapperPacket,
    Vector2f,
)
from touchline.store.fields import load_fields
from touchline.workflows import interchange

FIELDS = load_fields()
SSL_EXAMPLES = range(3)


@pytest.mark.parametrize("name", FIELDS)
def test_a_listener_hears_every_field_as_we_send_it(name):
    packet = SSL_WrapperPacket(geometry=SSL_GeometryData(field=field_to_wire(FIELDS[name])))
    heard = listener.Packet.FromString(encode(packet))
    assert heard.geometry.field.field_length == FIELDS[name].length_mm
    assert decode(SSL_WrapperPacket, heard.SerializeToString()) == packet


@pytest.mark.parametrize("index", SSL_EXAMPLES)
@pytest.mark.parametrize("z_mm", [0.0, 150.0])
def test_a_listener_projects_as_we_do(index, z_mm):
    model, made = model_of("ssl", index), interchange.export(example("ssl", index), "ssl-vision")
    (calib,) = listener.Packet.FromString(made.data).geometry.calib
    places = seen_places(model, z_mm)
    # four-byte floats
    np.testing.assert_allclose(listener.projected(calib, places), model.project(places), atol=2e-3)
    ours = interchange.read_file(made.data).camera(
        {k: getattr(model, k) for k in interchange.RECTANGLE_FIELDS}
    )
    np.testing.assert_allclose(listener.projected(calib, places), ours.project(places), atol=1e-6)


@pytest.mark.parametrize(
    "name, index", [(n, i) for n in ("brown-conrady", "fisheye", "division") for i in range(3)]
)
def test_a_listener_sees_another_lens_off_by_what_was_said(name, index):
    model = model_of(name, index)
    made = interchange.export(example(name, index), "ssl-vision", approximate=True)
    (calib,) = listener.Packet.FromString(made.data).geometry.calib
    places = seen_places(model)
    near = seen_places(model, 150.0)
    px = np.linalg.norm(listener.projected(calib, places) - model.project(places), axis=1)
    step = np.linalg.norm(
        model.unproject(model.project(places) + np.array([1, 0])) - places[:, :2], axis=1
    )
    assert (px * step).max() < 2 * made.loss.worst_mm + 1e-3 and len(near)
    assert calib.distortion * _bend(model) <= 0  # the signs are opposite


def _bend(model) -> float:
    """Negative for barrel."""
    seen = float(model.LENS.distort(np.array(model.lens_terms), np.array([0.3, 0, 1.0]))[0])
    return 0.0 if abs(seen / 0.3 - 1) < 1e-6 else seen / 0.3 - 1


def test_the_distortion_undistorts_where_opencvs_k1_distorts():
    barrel = replace(model_of("brown-conrady", 0), lens_terms=(-0.05, 0, 0, 0, 0, 0, 0, 0))
    data = interchange.export(of_model(barrel), "ssl-vision", approximate=True).data
    assert listener.Packet.FromString(data).geometry.calib[0].distortion == pytest.approx(
        0.05, rel=0.2
    )


def test_pincushion_is_as_good_as_barrel():
    base = model_of("ssl", 1)
    for a in (0.06, -0.06):
        model = replace(base, lens_terms=(a,))
        (calib,) = listener.Packet.FromString(
            interchange.export(of_model(model), "ssl-vision").data
        ).geometry.calib
        places = seen_places(model)
        np.testing.assert_allclose(
            listener.projected(calib, places), model.project(places), atol=2e-3
        )


def test_tz_is_not_the_cameras_height():
    tilted = model_of("ssl", 2)
    (calib,) = listener.Packet.FromString(
        interchange.export(of_model(tilted), "ssl-vision").data
    ).geometry.calib
    assert calib.derived_camera_world_tz == pytest.approx(tilted.position_mm[2], rel=1e-6)
    assert abs(calib.tz - tilted.position_mm[2]) > 20
    assert (calib.pixel_image_width, calib.pixel_image_height) == tuple(tilted.image_size)


def test_a_position_that_contradicts_the_pose_does_not_move_the_camera():
    sent = decode(SSL_WrapperPacket, interchange.export(example("ssl", 1), "ssl-vision").data)
    sent.geometry.calib[0].derived_camera_world_tz = 1.0
    assert interchange.read_file(encode(sent)).pose.position_mm[2] == pytest.approx(4000, abs=0.01)


@pytest.mark.parametrize(
    "name, ids",
    [
        ("full", 0),
        ("half-left", 0),
        ("half-right", 1),
        ("quarter-bottom-left", 0),
        ("quarter-top-left", 1),
        ("quarter-bottom-right", 2),
        ("quarter-top-right", 3),
        *((f"eighth-{i}", i) for i in range(8)),
    ],
)
def test_a_camera_has_the_number_of_its_region(name, ids):
    field = FIELDS["ssl-div-b"]
    assert camera_number(field, field.region(name)) == ids


def test_a_number_can_be_given_and_a_packet_with_several_wants_one():
    data = interchange.export(example("ssl", 0), "ssl-vision", camera_id=7).data
    both = decode(SSL_WrapperPacket, data)
    assert both.geometry.calib[0].camera_id == 7
    both.geometry.calib.append(changed(both.geometry.calib[0], camera_id=3, focal_length=500.0))
    with pytest.raises(Conflict, match="7, 3"):
        interchange.read_file(encode(both))
    assert interchange.read_file(encode(both), interchange.ImportOptions(camera_id=3)).focal_px == (
        500.0,
        500.0,
    )
    with pytest.raises(Conflict, match="no camera called '4'"):
        interchange.read_file(encode(both), interchange.ImportOptions(camera_id=4))


@pytest.mark.parametrize("name", FIELDS)
def test_a_field_that_is_known_is_found_again(name):
    assert field_from_wire(field_to_wire(FIELDS[name]), FIELDS.values()).name == name


def test_a_field_that_nobody_knows_is_made_of_what_was_sent():
    sent = field_to_wire(FIELDS["ssl-div-b"])
    other = field_from_wire(changed(sent, field_length=9100, boundary_width=250), FIELDS.values())
    assert (other.length_mm, other.width_mm, other.name) == (9100, 6000, "ssl-9100x6000")
    assert (
        other.lines["touch-line-top"].start == (-4500, 3000)
        and other.arcs["centre-circle"].radius_mm == 500
    )
    with pytest.raises(BadInput, match="field"):
        field_from_wire(changed(sent, field_length=-3), FIELDS.values())


def test_an_imported_packet_is_a_calibration_over_the_part_that_it_sees():
    field = FIELDS["ssl-div-b"]
    ssl = MODELS["ssl"]
    model = replace(
        model_of("ssl", 0),
        region=field.region("half-right"),
        position_mm=(2250.0, 0.0, 5500.0),
        rotation=(2.2214414690791831, 2.2214414690791831, 0.0),
        focal_px=880.0,
    )
    original = replace(of_model(model), field=field.to_json(), region="half-right", rotate=0)
    made = interchange.export(original, "ssl-vision")
    back = interchange.calibration_from_file(
        interchange.read_file(made.data), interchange.ImportOptions(), FIELDS
    )
    assert (back.field["name"], back.region, back.model_name) == ("ssl-div-b", "half-right", "ssl")
    assert ssl.from_parameters(back.model_parameters).camera_from_field[0, 1] == pytest.approx(
        1, abs=1e-5
    )
    assert back.rotate == 270  # the picture's right is the field's +y


@pytest.mark.parametrize("name", listener.MESSAGES)
def test_every_message_is_described_as_the_listener_has_it(name):
    ours, theirs = getattr(ssl_vision_pb2, name).DESCRIPTOR, listener.CLASSES[name].DESCRIPTOR
    described = [
        {(f.number, f.name, f.type, f.is_required, f.is_repeated) for f in one.fields}
        for one in (ours, theirs)
    ]
    assert described[0] == described[1]


@pytest.mark.parametrize("name", listener.ENUMS)
def test_every_number_means_what_the_listener_has(name):
    assert getattr(ssl_vision_pb2, name).keys() == listener.ENUMS[name].split()


def test_a_detection_goes_there_and_back():
    robot = SSL_DetectionRobot(
        confidence=0.5, robot_id=3, x=-1200.25, y=300.5, orientation=-1.5, pixel_x=1.0, pixel_y=2.0
    )
    packet = SSL_WrapperPacket(
        detection=SSL_DetectionFrame(
            frame_number=4_000_000_000,
            t_capture=1.7e9 + 0.125,
            t_sent=1.7e9 + 0.25,
            camera_id=0,
            robots_yellow=[robot],
        )
    )
    heard = listener.Packet.FromString(encode(packet)).detection
    assert (heard.frame_number, heard.t_capture, heard.robots_yellow[0].x) == (
        4_000_000_000,
        1.7e9 + 0.125,
        -1200.25,
    )
    assert decode(SSL_WrapperPacket, encode(packet)) == packet


@rounds("examples", 60, 300)
def test_any_bytes_are_a_packet_or_refused(examples):
    @settings(max_examples=examples, deadline=None)
    @given(st.binary(max_size=200))
    def packet_or_refused(data):
        try:
            decode(SSL_WrapperPacket, data)
        except TouchlineError as refused:
            assert refused.reason == "bad-protobuf" and refused.fix

    packet_or_refused()


def test_a_long_packet_and_numbers_that_do_not_fit_are_refused():
    with pytest.raises(BadInput, match="datagram"):
        decode(SSL_WrapperPacket, b"\x12" * (MAX_BYTES + 1))
    thin = SSL_FieldLineSegment(
        name="", p1=Vector2f(x=0, y=0), p2=Vector2f(x=1, y=1), thickness=1.0
    )
    with pytest.raises(BadInput, match="more than 1000 times"):
        decode(SSL_GeometryFieldSize, (b"\x32" + bytes([len(line := encode(thin))]) + line) * 1001)
    for wrong in (
        {"focal_length": float("inf")},
        {"focal_length": 1e39},
        {"camera_id": -1},
        {"camera_id": 2**32},
        {"camera_id": 1.5},
        {"tx": "1"},
    ):
        with pytest.raises(BadInput, match=next(iter(wrong))) as refused:
            encode(build(SSL_GeometryCameraCalibration, **wrong))
        assert refused.value.reason == "bad-protobuf"


@pytest.mark.parametrize(
    "data, what",
    [
        (b"\x0a\x02\xff\xfe", "name is not text"),
        (b"\x0a\x01a", "SSL_FieldLineSegment has no p1"),
        (b"\x0a\x01a\x12\x05\x0d\0\0\0\0", "Vector2f has no y"),
        (b"\x0a\x05a", "ends within a field"),
        (b"\x25\0\0\xc0\x7f", "thickness is not finite"),
        (b"\x25\0\0\x80\xff", "thickness is not finite"),
    ],
)
def test_what_is_no_line_is_named(data, what):
    with pytest.raises(BadInput, match=what) as refused:
        decode(SSL_FieldLineSegment, data)
    assert refused.value.reason == "bad-protobuf"


@pytest.mark.parametrize(
    "members",
    [
        b"\x12\x00" * 32_000,
        b"\x0a\x80\xf4\x03" + b"\x32\x00" * 32_000,
        b"\x0a\x80\x08" + b"\x32\x00" * 512 + b"\x12\x00" * 900,
    ],
)
def test_empty_members_cost_no_more_than_a_whole_packet_may(members):
    """Naming what each of them lacks would take a tenth of a second."""
    begun = time.thread_time()
    with pytest.raises(BadInput):
        decode(SSL_GeometryData, members)
    assert time.thread_time() - begun < CPU_SHARE_PER_SENDER


@pytest.mark.parametrize(("name", "mm"), [("ssl-div-a", 8000), ("ssl-div-b", 6000)])
def test_the_penalty_mark_is_as_far_from_the_goal_as_the_rules_say(name, mm):
    assert field_to_wire(FIELDS[name]).goal_center_to_penalty_mark == mm
