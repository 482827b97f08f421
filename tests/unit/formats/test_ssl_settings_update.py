"""ssl-vision's settings with Touchline's geometry: what its program then sends is what our packet says."""

import re

import numpy as np
import pytest

from tests.support.exported import example
from tests.unit.formats.test_league_files import (
    DIMENSIONS,
    LINES,
    MODELS,
    OPENCV,
    SSL,
    calibrated,
    projected,
    settings,
)
from touchline.core.errors import BadInput, Conflict
from touchline.formats import ssl_settings
from touchline.formats.document import parse
from touchline.formats.ssl_field import field_to_wire, markings_alone
from touchline.formats.ssl_settings_update import CAMERA_NUMBERS, updated_settings
from touchline.league.packet import PublishingConfig, published_cameras
from touchline.models import model_from_json
from touchline.ssl_protocol.ssl_vision_pb2 import SSL_GeometryFieldSize, SSL_GeometryModels
from touchline.store.fields import load_fields

FIELDS = load_fields()
FIELD = field_to_wire(FIELDS["ssl-div-a"])
ALL_MODELS = {
    "Straight Two-Phase": dict.fromkeys(ssl_settings.STRAIGHT.values(), 0.5),
    "Chip fix loss": dict.fromkeys(ssl_settings.CHIP.values(), 0.5),
}
BALL = SSL_GeometryModels()
# measured: doubles in the packet, where cameras and fields have floats
BALL.straight_two_phase.acc_slide, BALL.straight_two_phase.acc_roll = -3.2123456789012, -0.3
BALL.straight_two_phase.k_switch = 0.65


def camera(number=0, index=1):
    (one,) = published_cameras([example("ssl", index)], PublishingConfig(limit_mm=1e9))
    sent = one.sent
    sent.camera_id = number
    return sent


def texts(data):
    return ssl_settings.league_file(parse(data))


def parameters(data, thread=0):
    return parse(data).first["VarXML"][f"Thread {thread}"]["Camera Calibrator"]["Camera Parameters"]


@pytest.mark.parametrize("sign", [".", ","])
def test_what_ssl_vision_then_sends_is_the_packet(sign):
    before = settings(SSL, {**SSL, "focal length": 900.0}, sign=sign, models=ALL_MODELS)
    sent = camera(1)
    found = updated_settings(before, FIELD, [sent], BALL)
    assert found.cameras == (1,)
    read = parameters(found.data, 1)
    for wire, name in CAMERA_NUMBERS.items():
        value = float(read[name].replace(sign, "."))
        assert np.float32(value) == np.float32(getattr(sent, wire)), name
    field = texts(found.data).sent
    assert markings_alone(field, FIELD) == markings_alone(FIELD, field) == []
    plain = (SSL_GeometryFieldSize(), SSL_GeometryFieldSize())
    for to, given in zip(plain, (field, FIELD), strict=True):
        to.MergeFrom(given)
        to.ClearField("field_lines")
        to.ClearField("field_arcs")
    assert {name.name: value for name, value in plain[1].ListFields()}.items() <= {
        name.name: value for name, value in plain[0].ListFields()
    }.items()
    assert texts(found.data).models().straight_two_phase == BALL.straight_two_phase
    # what its reader makes of it sees as the version does
    other = calibrated(found.data, FIELDS, entry="1")
    ours = model_from_json(example("ssl", 1).model_name, example("ssl", 1).model_parameters)
    places = np.array([[0.0, 0.0, 0.0], [900.0, -400.0, 0.0], [-700.0, 300.0, 150.0]])
    np.testing.assert_allclose(projected(other, places), ours.project(places), atol=1e-3)
    # the other camera, its chip model and every other byte are as they were
    assert parameters(found.data, 0) == parameters(before, 0)
    assert "Unchanged, as they are not published: the cameras with these numbers: 0." in found.notes
    opposite = {".": ",", ",": "."}[sign]
    assert re.search(rf">\s*-?\d+\{opposite}\d+\s*<", found.data.decode()) is None


def test_all_else_is_as_it_was_byte_by_byte_and_a_second_time_changes_nothing():
    more = (
        '<!-- by hand: <Var name="focal length">1</Var> -->\n'
        '<Var  name="Thread 9" type=\'list\'>\t<Var name="Exposure &amp; gain" type="double" '
        'minval="" maxval="">0.1</Var>\n</Var>\r\n'
    )
    before = settings(SSL, models=ALL_MODELS, more=more)
    sent = camera()
    once = updated_settings(before, FIELD, [sent], BALL).data
    assert updated_settings(once, FIELD, [sent], BALL).data == once
    assert more.encode() in once and once.startswith(before[:60])
    # its own geometry, given back to it, changes no byte at all
    own = texts(before)
    same = camera()
    for wire, name in CAMERA_NUMBERS.items():
        setattr(same, wire, SSL[name])
    same.pixel_image_width, same.pixel_image_height = 1920, 1080
    assert updated_settings(before, own.sent, [same], own.models()).data == before


def test_lines_that_the_field_has_not_are_removed_and_others_added():
    before = settings(
        SSL,
        lines={**LINES, "MyLine": (0, 0, 10, 10), "CenterLine": (0, 0, 1, 1)},
        dimensions={**DIMENSIONS, "Center Line": True, "Number of Line Segments": 13},
    )
    bare = SSL_GeometryFieldSize()
    bare.CopyFrom(FIELD)
    del bare.field_lines[:]
    bare.field_lines.extend(one for one in FIELD.field_lines if one.name != "CenterLine")
    bare.field_lines.add(name="Own <line> & more", thickness=10).p2.x = 5.5
    found = updated_settings(before, bare, [camera()])
    names = [line.name for line in texts(found.data).sent.field_lines]
    assert sorted(names) == sorted(line.name for line in bare.field_lines)
    assert any("CenterLine" in note for note in found.notes)
    field = parse(found.data).first["VarXML"]["Global"]["Field Configuration"]
    assert (field["Center Line"], float(field["Number of Line Segments"])) == ("false", 12)
    empty = settings(SSL, lines={}).replace(
        b'<Var name="Field Lines" type="list">\n\n</Var>', b'<Var name="Field Lines" type="list"/>'
    )
    assert b'"list"/>' in empty
    field = texts(updated_settings(empty, FIELD, [camera()]).data).sent
    assert markings_alone(field, FIELD) == markings_alone(FIELD, field) == []


def test_a_camera_is_found_by_its_number_whichever_thread_has_it():
    before = settings(SSL, SSL)
    swapped = re.sub(
        rb'("camera index" type="int">\n)([01])', lambda m: m[1] + (b"%d" % (1 - int(m[2]))), before
    )
    found = updated_settings(swapped, FIELD, [camera(1)])
    assert parameters(found.data, 0) != parameters(before, 0)
    assert parameters(found.data, 1) == parameters(before, 1)


def test_a_camera_of_opencvs_model_has_ssl_visions_afterwards():
    found = updated_settings(settings(OPENCV), FIELD, [camera()])
    assert parameters(found.data)["use openCV camera model"] == "false"
    assert any("OpenCV" in note for note in found.notes)
    assert calibrated(found.data).model_name == "ssl"


def test_an_older_programs_settings_have_only_what_it_knows_and_say_what_it_lacks():
    older = {
        {"Boundary Width Touch Line": "Boundary Width"}.get(name, name): value
        for name, value in DIMENSIONS.items()
        if name not in ("Boundary Width Goal Line", "Goal Height")
    }
    found = updated_settings(
        settings(SSL, dimensions=older, models=MODELS), FIELD, [camera()], BALL
    )
    assert texts(found.data).sent.boundary_width == FIELD.boundary_width
    (absent,) = (note for note in found.notes if "has no such settings" in note)
    assert "Goal Height" in absent and "Sliding acceleration" in absent


def test_it_says_which_cameras_ssl_vision_will_not_send_and_which_are_in_no_file():
    dimensions = {**DIMENSIONS, "Total Number of Cameras": 1}
    before = settings(SSL, SSL, dimensions=dimensions).replace(
        b'"Total Number of Cameras" type="double" minval="" maxval="">\n1.000000',
        b'"Total Number of Cameras" type="int" minval="" maxval="">\n1',
    )
    assert b'"Total Number of Cameras" type="int"' in before
    found = updated_settings(before, FIELD, [camera(0), camera(1), camera(7)])
    assert found.cameras == (0, 1)
    assert found.notes[1:] == (
        "Not in the file: the cameras with these numbers: 7. Change their numbers on the page "
        "Publishing, or also update the file of the computer that has them.",
        "SSL-Vision sends only cameras with numbers below its setting Total Number of Cameras, 1. "
        "Increase it there for: 1.",
    )
    enough = before.replace(b">\n1\n", b">\n2\n", 1)
    assert len(updated_settings(enough, FIELD, [camera(0), camera(1)]).notes) == 1


@pytest.mark.parametrize(
    "data, numbers, error, match",
    [
        (settings(SSL), [3], Conflict, "none of the published cameras: it has 0, and 3"),
        (b"<VarXML></VarXML>", [0], BadInput, "no field"),
        (b"focal: 1", [0], BadInput, "not the settings of ssl-vision"),
        (settings(SSL).decode().encode("utf-16"), [0], BadInput, "UTF-8"),
        (settings(SSL).replace(b"</VarXML>", "<!-- gr\xfcn --></VarXML>".encode("latin-1")), [0], BadInput, "The file"),
        (settings(SSL).replace(b"</VarXML>", b"<Var><![CDATA[a]]></Var></VarXML>"), [0], BadInput, "CDATA"),
        (settings(SSL)[:-20], [0], BadInput, "The file"),
        (
            settings(SSL).replace(b'"distortion" type="double" minval=""', b'"distortion" type="double" minval="1.5"'),
            [0],
            Conflict,
            "limits distortion to 1.5 … ∞",
        ),
        (
            settings(SSL).replace(b'"tz" type="double" minval="" max', b'"tz" type="double" maxval="9.5" was'),
            [0],
            Conflict,
            "limits tz to −∞ … 9.5",
        ),
        (settings(SSL).replace(b'"ty"', b'"t y"'), [0], BadInput, "has no setting 'ty'"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_in_words(data, numbers, error, match):
    with pytest.raises(error, match=re.escape(match)) as refused:
        updated_settings(data, FIELD, [camera(number) for number in numbers])
    assert refused.value.fix
