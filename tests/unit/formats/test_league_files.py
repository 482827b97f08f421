"""The files of the league's own programs, in their structure and with numbers of our own: read as they read them."""

import re
from dataclasses import replace

import cv2
import numpy as np
import pytest
import yaml

from tests.support.exported import example
from touchline.core.errors import BadInput, Conflict, TouchlineError
from touchline.core.field_json import field_from_json
from touchline.core.geometry import ImageSize
from touchline.fields.routes import parsed_field, write_field
from touchline.formats import FORMATS, ssl_settings, vision_processor
from touchline.formats.document import parse
from touchline.formats.ssl_field import field_to_wire, markings_alone
from touchline.models import model_from_json, raw_from_field
from touchline.store.fields import load_fields
from touchline.workflows import interchange
from touchline.workflows.interchange import ImportOptions

FIELDS = load_fields()
DIVISION_B = FIELDS["ssl-div-b"]
PLACES = np.stack(
    np.meshgrid((-4000, -2000, 0, 900, 1500), (-2500, -900, 0, 700, 2800), (0, 150)), axis=-1
).reshape(-1, 3)
PLACES = PLACES.astype(float)
QUATERNION = (0.7091, -0.6991, 0.0746, 0.053)
TRANSLATION = (178.99, -1468.16, 4605.0)
LINES = {
    "TopTouchLine": (-4500, 3000, 4500, 3000),
    "BottomTouchLine": (-4500, -3000, 4500, -3000),
    "LeftGoalLine": (-4500, -3000, -4500, 3000),
    "RightGoalLine": (4500, -3000, 4500, 3000),
    "HalfwayLine": (0, -3000, 0, 3000),
    "CenterLine": (-4500, 0, 4500, 0),
    "LeftPenaltyStretch": (-3500, -1000, -3500, 1000),
    "RightPenaltyStretch": (3500, -1000, 3500, 1000),
    "LeftFieldLeftPenaltyStretch": (-4500, -1000, -3500, -1000),
    "LeftFieldRightPenaltyStretch": (-4500, 1000, -3500, 1000),
    "RightFieldRightPenaltyStretch": (4500, -1000, 3500, -1000),
    "RightFieldLeftPenaltyStretch": (4500, 1000, 3500, 1000),
}
DIMENSIONS = {
    "Field Length": 9000,
    "Field Width": 6000,
    "Goal Width": 1000,
    "Goal Depth": 180,
    "Goal Height": 155,
    "Boundary Width Touch Line": 300,
    "Boundary Width Goal Line": 310,
    "Line Thickness": 10,
    "Penalty Area Depth": 1000,
    "Penalty Area Width": 2000,
    "Goal Line to Penalty Mark": 6000,
    "Center Circle Radius": 500,
    "Ball Radius": 21.5,
    "Max Robot Radius": 90,
}
SSL = {
    "focal length": 793.043436,
    "principal point x": 983.339912,
    "principal point y": 478.944722,
    "distortion": 0.28,
    **dict(zip(("q0", "q1", "q2", "q3"), QUATERNION, strict=True)),
    **dict(zip(("tx", "ty", "tz"), TRANSLATION, strict=True)),
}
BEGINS = {**SSL, "q0": 0.7, "q1": -0.7, "q2": 0.0, "q3": 0.0}
OPENCV = {
    "Intrinsic Parameters": {
        "focal_length_x": 801.5,
        "focal_length_y": 803.25,
        "principal_point_x": 970.125,
        "principal_point_y": 531.5,
        "dist_coeff_k1": -0.11,
        "dist_coeff_k2": 0.02,
        "dist_coeff_p1": 0.0015,
        "dist_coeff_p2": -0.0005,
        "dist_coeff_k3": 0.001,
    },
    "Extrinsic Parameters": {
        "rvec x": 2.2,
        "rvec y": 2.1,
        "rvec z": 0.1,
        "tvec x": 150.0,
        "tvec y": -200.0,
        "tvec z": 4500.0,
    },
    "use openCV camera model": True,
    **BEGINS,
}
GEOMETRY = """# All lengths are in mm.
#vision_ip: "224.5.23.2"
optional_field_lines:
  goal2goal: true     # from goal to goal
  halfway: true
  centercircle: true
  penalty: true

field:
  field_length: 9000
  field_width: 6000
  goal_width: 1000
  goal_depth: 180
  goal_height: 160
  penalty_area_depth: 1000
  penalty_area_width: 2000
  goal_center_to_penalty_mark: 6000
  boundary_width: 300
  boundary_width_goal_line: 300
  center_circle_radius: 500
  line_thickness: 10
  ball_radius: 21.5
  max_robot_radius: 90.0
  goal_substitution_area_width: 0
  #field_lines:
  #- name: "Name"
models:
  straight_two_phase:
    acc_slide: -3.40
    acc_roll: -0.45
    k_switch: 0.64
  chip_fixed_loss:
    damping_xy_first_hop: 0.55
    damping_xy_other_hops: 0.88
    damping_z: 0.54
"""
CALIB = f"""calib:
  - camera_id: 3
    focal_length: 793.043436
    principal_point_x: 983.339912
    principal_point_y: 478.944722
    distortion: 0.28
    q0: {QUATERNION[0]}
    q1: {QUATERNION[1]}
    q2: {QUATERNION[2]}
    q3: {QUATERNION[3]}
    tx: {TRANSLATION[0]}
    ty: {TRANSLATION[1]}
    tz: {TRANSLATION[2]}
    pixel_image_width: 1920
    pixel_image_height: 1080
"""
CONFIG = """cam_id: 1
camera:
  driver: OPENCV
  path: /dev/video0
  width: 1280
  height: 960
geometry:
  camera_amount: 2
  camera_height: 4200.0
  line_corners:
  - [100, 850]
  - [1180, 90]
  - [90, 80]
  - [1190, 870]
"""


def var(name, value, sign="."):
    """An element as ssl-vision writes it."""
    if isinstance(value, dict):
        kind, text = "list", "".join(var(each, part, sign) for each, part in value.items())
    elif isinstance(value, bool):
        kind, text = "bool", str(value).lower()
    elif isinstance(value, str):
        kind, text = "string", value
    elif name == "camera index" or name.startswith("Image "):
        kind, text = "int", str(value)
    else:
        kind, text = 'double" minval="" maxval="', f"{value:f}".replace(".", sign)
    return f'<Var name="{name}" type="{kind}">\n{text}\n</Var>\n'


MODELS = {"Straight Two-Phase": {"Switch factor": 0.7}}


def settings(
    *cameras,
    sign=".",
    lines=None,
    size=(1920, 1080),
    dimensions=DIMENSIONS,
    models=MODELS,
    more="",
):
    lines = LINES if lines is None else lines
    field = {
        "Models": models,
        **dimensions,
        "Field Lines": {
            name: {"Name": name, "Type": name}
            | dict(zip(("P1.x", "P1.y", "P2.x", "P2.y"), ends, strict=True))
            | {"Line thickness": 10}
            for name, ends in lines.items()
        },
        "Field Arcs": {
            "CenterCircle": {"Name": "CenterCircle", "Type": "CenterCircle", "Center.x": 0.0}
            | {"Center.y": 0.0, "Radius": 500, "Start angle": 0.0, "End angle": 6.283185}
            | {"Line thickness": 10}
        }
        if lines
        else {},
    }
    threads = {
        f"Thread {i}": {
            "Camera Calibrator": {
                "Camera Parameters": camera,
                "Calibration Parameters": {
                    "camera index": i,
                    "Image width": size[0],
                    "Image height": size[1],
                },
            }
        }
        for i, camera in enumerate(cameras)
    }
    body = "".join(
        var(name, value, sign)
        for name, value in {"Global": {"Field Configuration": field}, **threads}.items()
    )
    # a choice has its text and then its options, and samples of colours have one name
    body = body.replace(
        'name="Type" type="string">\nTopTouchLine\n',
        'name="Type" type="stringenum">\nTopTouchLine\n<Var name="0" type="string">Undefined</Var>',
    )
    return (
        f'\ufeff<?xml version="1.0" encoding="utf-8"?>\n<VarXML>\n{body}{more}</VarXML>\n'.encode()
    )


def seen_by_ssl_vision(places, camera):
    """Its own projection: rotate by the quaternion, undo the undistorted radius r (1 + a r²), scale."""
    x, y, z, w = np.array([camera[name] for name in ("q0", "q1", "q2", "q3")]) / np.linalg.norm(
        [camera[name] for name in ("q0", "q1", "q2", "q3")]
    )
    v = np.array([x, y, z])
    turned = places + 2 * np.cross(v, np.cross(v, places) + w * places)
    turned = turned + [camera[name] for name in ("tx", "ty", "tz")]
    plane = turned[:, :2] / turned[:, 2:]
    wide = np.linalg.norm(plane, axis=1)
    a = camera["distortion"]
    narrow = np.array(
        [min(r.real for r in np.roots([a, 0, 1, -u]) if abs(r.imag) < 1e-9) for u in wide]
    )
    centre = [camera["principal point x"], camera["principal point y"]]
    return camera["focal length"] * plane * (narrow / wide)[:, None] + centre


def calibrated(data, fields=FIELDS, **options):
    return interchange.calibration_from_file(
        interchange.read_file(data, ImportOptions(**options)), ImportOptions(**options), fields
    )


def projected(calibration, places=PLACES):
    return model_from_json(calibration.model_name, calibration.model_parameters).project(places)


@pytest.mark.parametrize("sign", [".", ","])
def test_ssl_visions_camera_sees_as_it_does_whatever_its_decimal_sign(sign):
    found = calibrated(settings(SSL, sign=sign))
    assert (found.model_name, found.field["name"], found.image_size) == (
        "ssl",
        "ssl-div-b",
        ImageSize(1920, 1080),
    )
    np.testing.assert_allclose(projected(found), seen_by_ssl_vision(PLACES, SSL), atol=1e-6)
    assert found.note == (
        "Imported from settings of ssl-vision. The file's ball models are not part of a "
        "calibration: open the file on the page Publishing, too."
    )


def test_its_other_model_is_opencvs():
    found = calibrated(settings(OPENCV))
    inner, outer = OPENCV["Intrinsic Parameters"], OPENCV["Extrinsic Parameters"]
    fx, fy, cx, cy, *terms = inner.values()
    wanted = cv2.projectPoints(
        PLACES,
        np.array([*outer.values()][:3]),
        np.array([*outer.values()][3:]),
        np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]]),
        np.array(terms),
    )[0].reshape(-1, 2)
    assert found.model_name == "brown-conrady"
    np.testing.assert_allclose(projected(found), wanted, atol=1e-6)


def test_of_several_cameras_one_is_chosen_and_those_without_a_pose_are_none():
    two = settings(
        SSL, {**SSL, "focal length": 900.0}, BEGINS, {**SSL, **dict.fromkeys(BEGINS, 0.0)}
    )
    with pytest.raises(Conflict) as refusal:
        interchange.read_file(two)
    assert (refusal.value.reason, refusal.value.details) == (
        "several-cameras",
        {"entries": ["0", "1"]},
    )
    assert interchange.read_file(two, ImportOptions(entry="1")).focal_px == (900.0, 900.0)
    assert interchange.read_file(two, ImportOptions(camera_id=1)).focal_px == (900.0, 900.0)
    assert interchange.read_file(settings(BEGINS, SSL)).focal_px == (SSL["focal length"],) * 2
    with pytest.raises(BadInput, match="a field, but no camera"):
        interchange.read_file(settings(BEGINS))


def test_a_camera_without_a_picture_yet_wants_its_size():
    data = settings(SSL, size=(0, 0))
    with pytest.raises(BadInput) as refusal:
        calibrated(data)
    assert refusal.value.reason == "no-image-size"
    size = ImageSize(1920, 1080)
    assert calibrated(data, image_size=size).image_size == size


def test_settings_without_lines_have_those_that_ssl_vision_makes():
    made = ssl_settings.league_file(parse(settings(lines={}))).sent
    given = ssl_settings.league_file(parse(settings())).sent
    assert markings_alone(made, given) == markings_alone(given, made) == []
    assert (given.boundary_width, given.boundary_width_goal_line) == (300, 310)
    without = settings(lines={}, dimensions={**DIMENSIONS, "Center Line": False})
    assert markings_alone(made, ssl_settings.league_file(parse(without)).sent) == ["CenterLine"]


def test_the_settings_of_an_older_program_have_one_boundary():
    older = {
        {"Boundary Width Touch Line": "Boundary Width"}.get(name, name): value
        for name, value in DIMENSIONS.items()
        if name not in ("Boundary Width Goal Line", "Goal Height")
    }
    sent = ssl_settings.league_file(parse(settings(dimensions=older))).sent
    assert (sent.boundary_width, sent.boundary_width_goal_line, sent.goal_height) == (300, 300, 155)


@pytest.mark.parametrize(
    "data, match",
    [
        (
            settings(SSL).replace(b"793.043436", b"x"),
            "Camera Parameters, focal length is not a number",
        ),
        (settings(SSL).replace(b'"Field Width"', b'"Width"'), "has no Field Width"),
        (settings(SSL).replace(b'"P1.x"', b'"P1.q"'), "Field Lines, TopTouchLine has no P1.x"),
        (settings(SSL).replace(b"0.709100", b"9.709100"), "quaternion has the length 9"),
        (settings(SSL).replace(b"9000.000000", b"-9000.000000", 1), "field in the packet"),
        (settings(SSL).replace(b"793.043436", b"-1"), "focal length"),
        (b"<VarXML><Var name='Thread 0' type='list'/></VarXML>", "but no field"),
        (
            b"<VarXML>" + b"<Var name='a' type='list'>" * 40 + b"</Var>" * 40 + b"</VarXML>",
            "levels",
        ),
    ],
)
def test_wrong_settings_are_refused_by_name(data, match):
    with pytest.raises(TouchlineError, match=match) as refusal:
        calibrated(data)
    assert refusal.value.fix


@pytest.mark.parametrize("data", [settings(SSL, sign=","), GEOMETRY.encode()])
def test_a_field_of_the_league_is_known_and_keeps_its_areas(data):
    assert parsed_field(data, FIELDS.values()) is DIVISION_B
    alone = parsed_field(data)
    assert (alone.name, alone.length_mm, len(alone.lines)) == ("ssl-9000x6000", 9000, 12)


def test_a_geometry_says_which_of_its_lines_are_painted():
    without = GEOMETRY.replace("penalty: true", "penalty: no").replace(
        "halfway: true", "halfway: Off"
    )
    names = set(parsed_field(without.encode()).lines)
    assert "halfway-line" not in names and not {n for n in names if n.startswith("defence")}
    older = GEOMETRY.replace("optional_field_lines", "default_lines").replace(
        "  halfway: true\n", ""
    )
    assert "halfway-line" in parsed_field(older.encode()).lines


def test_a_camera_in_a_geometry_is_read_to_four_bytes():
    found = calibrated((GEOMETRY + CALIB).encode())
    assert (found.model_name, found.field["name"]) == ("ssl", "ssl-div-b")
    np.testing.assert_allclose(projected(found), seen_by_ssl_vision(PLACES, SSL), atol=2e-3)
    assert found.note.startswith("Imported from vision-processor geometry. The file's ball models")


@pytest.mark.parametrize(
    "text, match",
    [
        (GEOMETRY.replace("goal_width: 1000", "goal_width: 1000.5"), "goal_width"),
        (GEOMETRY.replace("goal_width: 1000", "goal_wide: 1000"), "goal_wide"),
        (GEOMETRY.replace("field_width: 6000", "field_width: six"), "field_width"),
        (GEOMETRY.replace("  field_width: 6000\n", ""), "field_width"),
        (GEOMETRY.replace("  line_thickness: 10\n", ""), "no line_thickness"),
        (GEOMETRY.replace("ball_radius: 21.5", "ball_radius: .nan"), "ball_radius"),
        (GEOMETRY.replace("penalty: true", "penalty: maybe"), "optional_field_lines.penalty"),
        (GEOMETRY.replace("penalty: true", "penalties: true"), "penalties"),
        (GEOMETRY.replace("k_switch: 0.64", "k_switch: [1]"), "k_switch"),
        (GEOMETRY, "a field, but no camera"),
        (GEOMETRY + CALIB.replace("    tz: 4605.0\n", ""), "tz"),
    ],
)
def test_a_wrong_geometry_is_refused_by_name(text, match):
    with pytest.raises(BadInput, match=match) as refusal:
        interchange.read_file(text.encode())
    assert refusal.value.fix


@pytest.mark.parametrize("name", [name for name in FIELDS if name.startswith("ssl")])
def test_a_field_goes_to_vision_processor_and_back(name):
    field = FIELDS[name]
    data, _, suffix = write_field(field, "vision-processor")
    there, back = field_to_wire(field), field_to_wire(parsed_field(data))
    assert suffix == ".geometry.yml"
    assert markings_alone(there, back) == []
    # what the publisher makes of the borders is more where a hall has not painted them
    assert set(markings_alone(back, there)) <= {*LINES} - {line.name for line in there.field_lines}
    assert (back.field_length, back.goal_depth) == (there.field_length, there.goal_depth)
    content = yaml.safe_load(data)
    assert set(content["optional_field_lines"]) == {*vision_processor.OPTIONAL}


def test_a_line_elsewhere_is_written_out_and_a_border_elsewhere_is_refused():
    text = DIVISION_B.to_json()
    moved = {line["name"]: line for line in text["lines"]}
    moved["halfway-line"]["from"][0] = moved["halfway-line"]["to"][0] = 25
    field = field_from_json(text)
    content = yaml.safe_load(write_field(field, "vision-processor")[0])
    assert content["optional_field_lines"]["halfway"] is False
    assert [line["name"] for line in content["field"]["field_lines"]] == ["HalfwayLine"]
    assert (
        parsed_field(write_field(field, "vision-processor")[0]).lines["halfway-line"].start[0] == 25
    )
    moved["touch-line-top"]["from"][1] = moved["touch-line-top"]["to"][1] = 2950
    with pytest.raises(Conflict, match="makes TopTouchLine of length and width"):
        write_field(field_from_json(text), "vision-processor")


def test_four_corners_are_a_start_over_the_cameras_area():
    found = calibrated(CONFIG.encode(), field="ssl-div-b")
    assert (found.region, found.model_name, found.image_size) == (
        "half-right",
        "homography",
        ImageSize(1280, 960),
    )
    model = model_from_json(found.model_name, found.model_parameters)
    corners = np.array([[0, -3000], [0, 3000], [4500, 3000], [4500, -3000]], float)
    wanted = np.array([[100, 850], [90, 80], [1180, 90], [1190, 870]], float)
    np.testing.assert_allclose(raw_from_field(model, corners), wanted, atol=1e-6)
    # its top border runs to the picture's right
    np.testing.assert_allclose(model.corrected_from_raw(wanted)[1], (0, 0), atol=1e-6)
    assert found.note == "Fitted to the four corners of an imported config.yml."


@pytest.mark.parametrize(
    "text, options, reason",
    [
        (CONFIG, {}, "no-field"),
        (CONFIG.replace("OPENCV", "SPINNAKER"), {"field": "ssl-div-b"}, "no-image-size"),
        (CONFIG.replace("camera_amount: 2", "camera_amount: 3"), {}, "bad-calibration"),
        (CONFIG.replace("  - [90, 80]\n", ""), {}, "bad-calibration"),
        (CONFIG.replace("[90, 80]", "[90, 80, 1]"), {}, "bad-calibration"),
        (CONFIG.replace("cam_id: 1", "cam_id: 9"), {}, "bad-calibration"),
    ],
)
def test_what_a_config_lacks_is_asked_for(text, options, reason):
    with pytest.raises(TouchlineError) as refusal:
        calibrated(text.encode(), **options)
    assert (refusal.value.reason, bool(refusal.value.fix)) == (reason, True)


@pytest.mark.parametrize(
    "region, camera, cameras",
    [("full", 0, 1), ("half-left", 0, 2), ("half-right", 1, 2), ("quarter-top-right", 3, 4)],
)
def test_a_calibration_says_where_vision_processor_starts(region, camera, cameras):
    area = DIVISION_B.region(region, None)
    found = calibrated(settings(SSL), region=region)
    content = yaml.safe_load(interchange.export(found, "vision-processor-start").data)
    assert (content["cam_id"], content["geometry"]["camera_amount"]) == (camera, cameras)
    (x0, x1), (y0, y1) = area.x_mm, area.y_mm
    corners = np.array([[x0, y0, 0], [x0, y1, 0], [x1, y1, 0], [x1, y0, 0]])
    np.testing.assert_allclose(
        content["geometry"]["line_corners"], seen_by_ssl_vision(corners, SSL), atol=0.06
    )
    height = model_from_json(found.model_name, found.model_parameters).position_mm[2]
    assert content["geometry"]["camera_height"] == pytest.approx(height, abs=0.06)


def test_an_area_that_only_one_of_them_has_is_refused():
    strip = {"strip": {"x": [-1000, 1000], "y": [-3000, 3000]}}
    narrow = field_from_json({**DIVISION_B.to_json(), "name": "narrow", "regions": strip})
    with pytest.raises(
        Conflict, match="no area from x 0 to 4500 and y -3000 to 3000 mm"
    ) as refusal:
        calibrated(CONFIG.encode(), {"narrow": narrow}, field="narrow")
    assert refusal.value.reason == "unknown-region"
    found = replace(calibrated(settings(SSL)), field=narrow.to_json(), region="strip", rotate=0)
    with pytest.raises(Conflict, match="areas such as strip") as refusal:
        FORMATS["vision-processor-start"].write(found)
    assert refusal.value.reason == "format-cannot-hold"


def test_an_exported_geometry_names_the_camera():
    text = interchange.export(example("ssl", 0), "vision-processor", camera_id=5).data.decode()
    assert re.search(r"^- camera_id: 5$", text, re.MULTILINE)
    assert (
        interchange.read_file(text.encode(), ImportOptions(entry="5")).program == "vision-processor"
    )
