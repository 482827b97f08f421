"""The league's packets: our bytes against Google's implementation, and the traps that other tools fell into."""

from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.core.errors import BadInput, Conflict, TouchlineError
from app.formats.ssl_field import field_from_wire, field_to_wire
from app.formats.ssl_geometry import camera_number
from app.models import MODELS
from app.ssl_protocol import messages
from app.ssl_protocol.messages import (
    DetectedRobot,
    DetectionFrame,
    FieldLine,
    FieldSize,
    Geometry,
    Vector2f,
    WrapperPacket,
)
from app.ssl_protocol.protobuf import MAX_BYTES, decode, encode
from app.store.fields import load_fields
from app.workflows import interchange
from tests.support import ssl_listener as listener
from tests.support.exported import example, model_of, of_model, seen_places
from tests.support.tiers import rounds

FIELDS = load_fields()
SSL_EXAMPLES = range(3)


def same(ours, theirs) -> None:
    """Field by field, what is absent as well."""
    for f in fields(ours):
        value, label = getattr(ours, f.name), f.metadata["label"]
        if label == "repeated":
            assert len(value) == len(getattr(theirs, f.name))
            for a, b in zip(value, getattr(theirs, f.name), strict=True):
                same(a, b)
        elif value is None:
            assert not theirs.HasField(f.name)
        elif isinstance(f.metadata["kind"], str):
            assert theirs.HasField(f.name)
            expected = np.float32(value) if f.metadata["kind"] == "float" else value
            assert getattr(theirs, f.name) == expected
        else:
            same(value, getattr(theirs, f.name))


@pytest.mark.parametrize("name", FIELDS)
def test_a_listener_hears_every_field_as_we_send_it(name):
    packet = WrapperPacket(geometry=Geometry(field_to_wire(FIELDS[name])))
    heard = listener.Packet.FromString(encode(packet))
    same(packet, heard)
    assert decode(WrapperPacket, heard.SerializeToString()) == decode(WrapperPacket, encode(packet))


@pytest.mark.parametrize("index", SSL_EXAMPLES)
@pytest.mark.parametrize("z_mm", [0.0, 150.0])
def test_a_listener_projects_as_we_do(index, z_mm):
    model, made = model_of("ssl", index), interchange.export(example("ssl", index), "ssl-vision")
    (calib,) = listener.Packet.FromString(made.data).geometry.calib
    places = seen_places(model, z_mm)
    np.testing.assert_allclose(listener.projected(calib, places), model.project(places), atol=2e-3)  # four-byte floats
    ours = interchange.read_file(made.data).camera({k: getattr(model, k) for k in interchange.RECTANGLE_FIELDS})
    np.testing.assert_allclose(listener.projected(calib, places), ours.project(places), atol=1e-6)


@pytest.mark.parametrize("name, index", [(n, i) for n in ("brown-conrady", "fisheye", "division") for i in range(3)])
def test_a_listener_sees_another_lens_off_by_what_was_said(name, index):
    model = model_of(name, index)
    made = interchange.export(example(name, index), "ssl-vision", approximate=True)
    (calib,) = listener.Packet.FromString(made.data).geometry.calib
    places = seen_places(model)
    near = seen_places(model, 150.0)
    px = np.linalg.norm(listener.projected(calib, places) - model.project(places), axis=1)
    step = np.linalg.norm(model.unproject(model.project(places) + np.array([1, 0])) - places[:, :2], axis=1)
    assert (px * step).max() < 2 * made.loss.worst_mm + 1e-3 and len(near)
    assert calib.distortion * _bend(model) <= 0  # the signs are opposite


def _bend(model) -> float:
    """Negative for barrel."""
    seen = float(model.LENS.distort(np.array(model.lens_terms), np.array([0.3, 0, 1.0]))[0])
    return 0.0 if abs(seen / 0.3 - 1) < 1e-6 else seen / 0.3 - 1


def test_the_distortion_undistorts_where_opencvs_k1_distorts():
    barrel = replace(model_of("brown-conrady", 0), lens_terms=(-0.05, 0, 0, 0, 0, 0, 0, 0))
    data = interchange.export(of_model(barrel), "ssl-vision", approximate=True).data
    assert listener.Packet.FromString(data).geometry.calib[0].distortion == pytest.approx(0.05, rel=0.2)


def test_pincushion_is_as_good_as_barrel():
    base = model_of("ssl", 1)
    for a in (0.06, -0.06):
        model = replace(base, lens_terms=(a,))
        (calib,) = listener.Packet.FromString(interchange.export(of_model(model), "ssl-vision").data).geometry.calib
        places = seen_places(model)
        np.testing.assert_allclose(listener.projected(calib, places), model.project(places), atol=2e-3)


def test_tz_is_not_the_cameras_height():
    tilted = model_of("ssl", 2)
    (calib,) = listener.Packet.FromString(interchange.export(of_model(tilted), "ssl-vision").data).geometry.calib
    assert calib.derived_camera_world_tz == pytest.approx(tilted.position_mm[2], rel=1e-6)
    assert abs(calib.tz - tilted.position_mm[2]) > 20
    assert (calib.pixel_image_width, calib.pixel_image_height) == tuple(tilted.image_size)


def test_a_position_that_contradicts_the_pose_does_not_move_the_camera():
    sent = decode(WrapperPacket, interchange.export(example("ssl", 1), "ssl-vision").data)
    calib = replace(sent.geometry.calib[0], derived_camera_world_tz=1.0)
    told = replace(sent, geometry=replace(sent.geometry, calib=(calib,)))
    assert interchange.read_file(encode(told)).pose.position_mm[2] == pytest.approx(4000, abs=0.01)


@pytest.mark.parametrize("name, ids", [("full", 0), ("half-left", 0), ("half-right", 1), ("quarter-bottom-left", 0),
                                       ("quarter-top-left", 1), ("quarter-bottom-right", 2), ("quarter-top-right", 3),
                                       *((f"eighth-{i}", i) for i in range(8))])
def test_a_camera_has_the_number_of_its_region(name, ids):
    field = FIELDS["ssl-div-b"]
    assert camera_number(field, field.region(name)) == ids


def test_a_number_can_be_given_and_a_packet_with_several_wants_one():
    data = interchange.export(example("ssl", 0), "ssl-vision", camera_id=7).data
    sent = decode(WrapperPacket, data)
    assert sent.geometry.calib[0].camera_id == 7
    both = replace(sent, geometry=replace(sent.geometry, calib=(*sent.geometry.calib, replace(
        sent.geometry.calib[0], camera_id=3, focal_length=500.0))))
    with pytest.raises(Conflict, match="7, 3"):
        interchange.read_file(encode(both))
    assert interchange.read_file(encode(both), camera_id=3).focal_px == (500.0, 500.0)
    with pytest.raises(Conflict, match="no camera 4"):
        interchange.read_file(encode(both), camera_id=4)


@pytest.mark.parametrize("name", FIELDS)
def test_a_field_that_is_known_is_found_again(name):
    assert field_from_wire(field_to_wire(FIELDS[name]), FIELDS.values()).name == name


def test_a_field_that_nobody_knows_is_made_of_what_was_sent():
    sent = field_to_wire(FIELDS["ssl-div-b"])
    other = field_from_wire(replace(sent, field_length=9100, boundary_width=250), FIELDS.values())
    assert (other.length_mm, other.width_mm, other.name) == (9100, 6000, "ssl-9100x6000")
    assert other.lines["touch-line-top"].start == (-4500, 3000) and other.arcs["centre-circle"].radius_mm == 500
    with pytest.raises(BadInput, match="field"):
        field_from_wire(replace(sent, field_length=-3), FIELDS.values())


def test_an_imported_packet_is_a_calibration_over_the_part_that_it_sees():
    field = FIELDS["ssl-div-b"]
    ssl = MODELS["ssl"]
    model = replace(model_of("ssl", 0), region=field.region("half-right"), position_mm=(2250.0, 0.0, 5500.0),
                    rotation=(2.2214414690791831, 2.2214414690791831, 0.0), focal_px=880.0)
    original = replace(of_model(model), field=field.to_json(), region="half-right", rotate=0)
    made = interchange.export(original, "ssl-vision")
    back = interchange.calibration_from_file(interchange.read_file(made.data), interchange.ImportOptions(), FIELDS)
    assert (back.field["name"], back.region, back.model_name) == ("ssl-div-b", "half-right", "ssl")
    assert ssl.from_parameters(back.model_parameters).camera_from_field[0, 1] == pytest.approx(1, abs=1e-5)
    assert back.rotate == 270  # the picture's right is the field's +y


def test_every_message_is_described_as_the_listener_has_it():
    ours = {"Vector2f": "Vector2f", "SSL_FieldLineSegment": "FieldLine", "SSL_FieldCircularArc": "FieldArc",
            "SSL_GeometryFieldSize": "FieldSize", "SSL_GeometryCameraCalibration": "CameraCalibration",
            "SSL_GeometryData": "Geometry", "SSL_DetectionBall": "DetectedBall", "SSL_DetectionRobot": "DetectedRobot",
            "SSL_DetectionFrame": "DetectionFrame", "SSL_WrapperPacket": "WrapperPacket"}
    for theirs, name in ours.items():
        described = {tuple(part.split()[i] for i in (0, 2, 3)) for part in listener.MESSAGES[theirs].split("; ")}
        assert described == {(f.metadata["label"], f.name, str(f.metadata["number"]))
                             for f in fields(getattr(messages, name))}, theirs


def test_a_detection_goes_there_and_back():
    robot = DetectedRobot(confidence=0.5, robot_id=3, x=-1200.25, y=300.5, orientation=-1.5, pixel_x=1.0, pixel_y=2.0)
    packet = WrapperPacket(DetectionFrame(frame_number=4_000_000_000, t_capture=1.7e9 + 0.125, t_sent=1.7e9 + 0.25,
                                          camera_id=0, robots_yellow=(robot,)), source=1)
    same(packet, listener.Packet.FromString(encode(packet)))
    assert decode(WrapperPacket, encode(packet)) == packet


@rounds("examples", 60, 300)
def test_any_bytes_are_a_packet_or_refused(examples):
    @settings(max_examples=examples, deadline=None)
    @given(st.binary(max_size=200))
    def packet_or_refused(data):
        try:
            decode(WrapperPacket, data)
        except TouchlineError as refused:
            assert refused.reason == "bad-protobuf" and refused.fix
    packet_or_refused()


@rounds("examples", 60, 300)
def test_a_packet_with_wrong_bytes_is_read_as_google_reads_it_or_refused(examples):
    sent = interchange.export(example("ssl", 1), "ssl-vision").data

    @settings(max_examples=examples, deadline=None)
    @given(st.data())
    def read_alike_or_refused(data):
        spoilt = bytearray(sent)
        for _ in range(data.draw(st.integers(1, 4))):
            spoilt[data.draw(st.integers(0, len(spoilt) - 1))] = data.draw(st.integers(0, 255))
        try:
            ours = decode(WrapperPacket, bytes(spoilt))
        except TouchlineError:
            return
        heard = listener.Packet.FromString(bytes(spoilt))
        assert len(ours.geometry.calib) == len(heard.geometry.calib) if ours.geometry else True
    read_alike_or_refused()


def test_a_long_packet_and_numbers_that_do_not_fit_are_refused():
    with pytest.raises(BadInput, match="datagram"):
        decode(WrapperPacket, b"\x12" * (MAX_BYTES + 1))
    thin = FieldLine("", Vector2f(0, 0), Vector2f(1, 1), 1.0)
    with pytest.raises(BadInput, match="more than 1000 times"):
        decode(FieldSize, (b"\x32" + bytes([len(line := encode(thin))]) + line) * 1001)
    for wrong in ({"focal_length": float("inf")}, {"focal_length": 1e39}, {"camera_id": -1}, {"camera_id": 2**32}):
        with pytest.raises(BadInput):
            encode(replace(_calib(), **wrong))


def _calib():
    return decode(WrapperPacket, interchange.export(example("ssl", 0), "ssl-vision").data).geometry.calib[0]


@pytest.mark.parametrize(("name", "mm"), [("ssl-div-a", 8000), ("ssl-div-b", 6000)])
def test_the_penalty_mark_is_as_far_from_the_goal_as_the_rules_say(name, mm):
    assert field_to_wire(FIELDS[name]).goal_center_to_penalty_mark == mm
