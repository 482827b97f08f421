"""Files from outside: a lens or a calibration of each, strictly read, refused with the place and the cure."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.support.exported import (
    LENS_FORMATS,
    READABLE,
    example,
    field_around,
    model_of,
    of_model,
    seen_places,
)
from tests.support.fields import seen
from tests.support.paths import ROOT
from touchline.core.errors import BadInput, Conflict, TouchlineError
from touchline.core.field_json import field_from_json
from touchline.core.geometry import ImageSize
from touchline.core.quarter_turn import QuarterTurn
from touchline.fitting import FITTERS
from touchline.formats import FORMATS
from touchline.models import model_from_json
from touchline.models import model_of as camera_of
from touchline.store.fields import load_fields
from touchline.workflows import interchange
from touchline.workflows.interchange import ImportOptions

FIELDS = load_fields()
OPENCV = """%YAML:1.0
---
calibration_time: "Sat 21 Nov 2026"
image_width: 640
image_height: 480
flags: 0
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 5.3e+02, 0., 3.4e+02, 0., 5.31e+02, 2.35e+02, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -2.6e-01, -3.8e-02, 1.7e-03, -2.8e-04, 2.3e-01 ]
"""
ROS = """image_width: 640
image_height: 480
camera_name: narrow
camera_matrix:
  rows: 3
  cols: 3
  data: [530, 0, 340, 0, 531, 235, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.26, -0.038, 1.7e-03, -2.8e-04, 0.23]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
projection_matrix:
  rows: 3
  cols: 4
  data: [530, 0, 340, 0, 0, 531, 235, 0, 0, 0, 1, 0]
"""
KALIBR = """cam0:
  cam_overlaps: []
  camera_model: pinhole
  distortion_coeffs: [-0.01, 0.05, -0.04, 0.012]
  distortion_model: equidistant
  intrinsics: [461.6, 460.1, 362.6, 246.0]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
"""
MRCAL = """# generated on 2026-11-21
{
    'lensmodel':  'LENSMODEL_OPENCV8',

    # intrinsics are fx,fy,cx,cy,distortion0,distortion1,....
    'intrinsics': [ 1766.07, 1765.89, 1944.06, 1064.52, 2.16, -1.18, -0.00009, 0.0007, -0.23, 2.44, -0.66, -0.62,],
    'valid_intrinsics_region': [
    [ 300, 200 ],
    [ 300, 2000 ], ],
    # extrinsics are rt_fromref
    'extrinsics': [ 0.1, 0, 0, 0, 0, 2.0,],
    'imagersize': [ 3840, 2160,],
    'icam_intrinsics': 0,
    'optimization_inputs': b'P)h>@6aWAK2mpzOBviX#;{}[]~`',
}
"""
PHOTON = json.dumps(
    {
        "resolution": {"width": 640.0, "height": 480.0},
        "cameraIntrinsics": {
            "rows": 3,
            "cols": 3,
            "type": 6,
            "data": [699.4, 0, 345.6, 0, 677.7, 207.1, 0, 0, 1],
        },
        "distCoeffs": {
            "rows": 1,
            "cols": 5,
            "type": 6,
            "data": [0.18, -1.5, 0.0045, -0.0019, 3.08],
        },
        "observations": [],
        "calobjectSize": {"width": 10, "height": 10},
        "calobjectSpacing": 0.0254,
    }
)
OUTSIDE = {"opencv": OPENCV, "ros": ROS, "kalibr": KALIBR, "mrcal": MRCAL, "photonvision": PHOTON}
FOCAL = {"opencv": 530, "ros": 530, "kalibr": 461.6, "mrcal": 1766.07, "photonvision": 699.4}


def refused(text: str | bytes, match: str, **wanted) -> TouchlineError:
    with pytest.raises(TouchlineError, match=match) as refusal:
        found = interchange.read_file(text.encode() if isinstance(text, str) else text)
        if interchange.is_lens(found):
            interchange.lens_record_from_file(found, ImportOptions(**wanted))
        else:
            interchange.calibration_from_file(found, ImportOptions(**wanted), FIELDS)
    assert refusal.value.fix
    return refusal.value


@pytest.mark.parametrize("format", OUTSIDE)
def test_a_file_of_another_program_is_a_lens_that_a_fit_can_hold(format):
    found = interchange.read_file(OUTSIDE[format].encode())
    assert found.program == format and interchange.is_lens(found)
    record = interchange.lens_record_from_file(found, ImportOptions(camera="north"))
    assert record["lens"]["focal_px"] == FOCAL[format] and record["camera"] == "north"
    assert record["model"] == ("fisheye" if format == "kalibr" else "brown-conrady")
    # held by a fit of a field that it sees
    truth = replace(model_of("brown-conrady", 0), image_size=ImageSize(*record["image_size"]))
    camera = replace(
        truth if record["model"] == "brown-conrady" else model_of("fisheye", 0),
        lens_terms=tuple(record["lens"]["terms"]),
        focal_px=record["lens"]["focal_px"],
        aspect=record["lens"]["aspect"],
        centre_px=tuple(record["lens"]["centre_px"]),
        image_size=ImageSize(*record["image_size"]),
        position_mm=(0.0, 0.0, 5500.0),
    )
    clicks = seen(camera, camera.region, ends=0.25)
    fit = FITTERS[record["model"]].fit(
        clicks,
        field_around(camera.region),
        camera.region,
        camera.image_size,
        {"lens": {"name": record["model"], "lens": record["lens"]}},
    )
    assert fit.model.position_mm == pytest.approx(camera.position_mm, abs=0.5)


def test_outside_the_yaml_of_stereo_and_the_older_header_are_read_or_refused_by_name():
    assert interchange.read_file(OPENCV.replace("---\n", "").encode()).focal_px == (530, 531)
    refused(
        "%YAML:1.0\nM1: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [1,0,0,0,1,0,0,0,1]\n",
        "image size",
    )


@pytest.mark.parametrize(
    "real",
    [
        "opencv_left_right/left_intrinsics.yml",
        "photonvision/calibration/lifecam480p.json",
        "photonvision/calibration/laptop_1280.json",
        "photonvision/calibration/limelight_1280_720.json",
    ],
)
def test_real_files_are_read(real_data, real):
    found = interchange.read_file(real_data(f"boards/{real}").read_bytes())
    assert interchange.is_lens(found) and found.image_size.width in (640, 1280)
    record = interchange.lens_record_from_file(found, ImportOptions())
    assert record["lens"]["focal_px"] == pytest.approx(found.focal_px[0])


def test_a_file_without_its_picture_size_wants_it_told():
    text = OPENCV.replace("image_width: 640\nimage_height: 480\n", "")
    assert refused(text, "image size").reason == "no-image-size"
    record = interchange.lens_record_from_file(
        interchange.read_file(text.encode()), ImportOptions(image_size=ImageSize(640, 480))
    )
    assert record["image_size"] == [640, 480]


def test_another_size_of_the_same_shape_is_scaled_about_pixel_centres_and_said():
    model = model_of("brown-conrady", 1)
    found = interchange.read_file(interchange.export(of_model(model), "opencv").data)
    field = {"plain": field_around(model.region)}
    back = interchange.calibration_from_file(
        found, ImportOptions(image_size=ImageSize(640, 512)), field
    )
    half = model_from_json(back.model_name, back.model_parameters)
    places = seen_places(model, 150.0)
    np.testing.assert_allclose(
        half.project(places), (model.project(places) + 0.5) / 2 - 0.5, atol=1e-9
    )
    assert "1280 × 1024" in back.note and back.image_size == ImageSize(640, 512)
    with pytest.raises(Conflict, match=r"1280 × 1024 px, not of 1280 × 720") as refusal:
        interchange.calibration_from_file(
            found, ImportOptions(image_size=ImageSize(1280, 720)), field
        )
    assert refusal.value.reason == "size-mismatch"


@pytest.mark.parametrize("turn", [90, 180, 270])
@pytest.mark.parametrize("index", [1, 2])
def test_a_file_from_before_the_pictures_were_turned_is_turned(index, turn):
    model = replace(model_of("brown-conrady", index), aspect=1.03, centre_px=(610.0, 530.0))
    found = interchange.read_file(interchange.export(of_model(model), "opencv").data)
    fields = {"plain": field_from_json(of_model(model).field)}
    quarter = QuarterTurn(turn, model.image_size)
    back = interchange.calibration_from_file(found, ImportOptions(turn=turn), fields)
    places = np.array([[-300.0, 200.0, 0.0], [900.0, -700.0, 150.0], [100.0, 800.0, 150.0]])
    np.testing.assert_allclose(
        camera_of(back).project(places), quarter.points(model.project(places)), atol=1e-6
    )
    assert back.image_size == quarter.size_after and "turned by" in back.note
    # a file that does not state its size: the one that is stated is that of the pictures now
    sizeless = replace(found, image_size=None)
    for size, s in ((quarter.size_after, 1), (ImageSize(*(2 * n for n in quarter.size_after)), 2)):
        wanted = ImportOptions(turn=turn, image_size=size)
        lens = interchange.lens_record_from_file(found, wanted)["lens"]
        assert lens["focal_px"] == pytest.approx(s * camera_of(back).focal_px)
        assert ImageSize(**lens["image_size"]) == size
        unscaled = interchange.lens_record_from_file(sizeless, wanted)["lens"]
        assert unscaled["focal_px"] == pytest.approx(camera_of(back).focal_px)
        assert ImageSize(**unscaled["image_size"]) == size
    with pytest.raises(BadInput) as refusal:
        interchange.lens_record_from_file(sizeless, ImportOptions(turn=turn))
    assert refusal.value.reason == "no-image-size"


def test_the_covered_area_of_a_turned_file_is_upright_in_its_pictures_now():
    data = interchange.export(of_model(model_of("brown-conrady", 0)), "opencv").data
    data = data.replace(b'"region": "full", "rotate": 0, ', b"")
    found = {
        turn: interchange.calibration_from_file(
            interchange.read_file(data), ImportOptions(field="ssl-2008", turn=turn), FIELDS
        ).rotate
        for turn in (0, 90, 180, 270)
    }
    assert len({*found.values()}) == 4
    assert [(found[turn] - found[0]) % 360 for turn in (90, 180, 270)] == [270, 180, 90]


def test_what_is_said_beside_a_file_wins_over_what_stands_in_it():
    found = interchange.read_file(interchange.export(example("brown-conrady", 1), "mrcal").data)
    wanted = ImportOptions(field="ssl-2008", region="full", rotate=180, camera="west")
    back = interchange.calibration_from_file(found, wanted, FIELDS)
    assert (back.field["name"], back.region, back.rotate, back.camera) == (
        "ssl-2008",
        "full",
        180,
        "west",
    )
    refused(interchange.export(example("brown-conrady", 1), "ros").data, "no field called 'plain'")
    refused(
        interchange.export(example("brown-conrady", 1), "ros").data, "no field called", field="moon"
    )
    refused(
        interchange.export(example("brown-conrady", 1), "ros").data,
        "no covered area called",
        field="ssl-2008",
        region="moon",
    )


def test_a_region_that_is_not_known_is_told_from_what_the_camera_sees():
    model = replace(
        model_of("brown-conrady", 0), position_mm=(-1500.0, 0.0, 3500.0), rotation=(0.0, 0.0, 0.0)
    )
    model = replace(model, rotation=(float(np.pi), 0.0, 0.0), focal_px=950.0)
    data = interchange.export(of_model(model), "opencv").data.replace(
        b'"region": "full", "rotate": 0, ', b""
    )
    back = interchange.calibration_from_file(
        interchange.read_file(data), ImportOptions(field="ssl-2008"), FIELDS
    )
    assert (back.region, back.rotate) == ("half-left", 0)


@pytest.mark.parametrize(
    "text, match",
    [
        (ROS.replace("530, 0, 340", "'530,5', 0, 340"), "decimal comma"),
        (ROS.replace("image_width: 640", "image_width: 640,5"), "decimal comma"),
        (
            ROS.replace(
                "[530, 0, 340, 0, 531, 235, 0, 0, 1]",
                "[530,1, 0,0, 340,2, 0,0, 531,3, 235,4, 0,0, 0,0, 1,0]",
            ),
            "18 numbers",
        ),
        (ROS.replace("0.23]", ".nan]"), "not a number"),
        (ROS.replace("0.23]", "1e999]"), "out of range"),
        (ROS.replace("0.23]", "1:30]"), "not a number"),
        (ROS.replace("0.23]", "0x10]"), "not a number"),
        (ROS.replace("0.23]", "yes]"), "not a number"),
        (ROS.replace("0.23]", "9" * 5000 + "]"), "not a number|too long"),
        (ROS.replace("plumb_bob", "stereographic"), "stereographic"),
        (ROS.replace("cols: 5", "cols: 4"), "5 numbers"),
        (ROS.replace("0, 531, 235", "0.5, 531, 235"), "camera matrix"),
        (ROS.replace("data: [530, 0,", "data: [530, 3,"), "skew"),
        (ROS.replace("image_height: 480\n", ""), "image_height"),
        (ROS.replace("image_width: 640", "image_width: 0"), "width"),
        (ROS + "image_width: 641\n", "twice"),
        (ROS.replace("[-0.26", "[&a -0.26"), "anchor"),
        (ROS.replace("camera_name: narrow", "camera_name: !!python/object:os.system x"), "tag"),
        (ROS.replace("camera_name: narrow", "camera_name: " + "[" * 50 + "]" * 50), "20 levels"),
        (ROS + "#" * 300_000, "bytes"),
        (ROS.replace("530", "-530"), "focal length"),
        (ROS.replace("531", "5.31"), "fy / fx"),
        (OPENCV.replace("rows: 5", "rows: 500"), "rows"),
        (OPENCV.replace("rows: 5", "rows: 4"), "5 numbers for 4"),
        (
            OPENCV.replace("2.3e-01 ]", "2.3e-01, 0., 0., 0., 1., 0., 0., 0. ]").replace(
                "rows: 5", "rows: 12"
            ),
            "thin prism",
        ),
        (OPENCV.replace("camera_matrix:", "X1:"), "no camera"),
        (OPENCV.replace("!!opencv-matrix", "!!map/x"), "tag"),
        (KALIBR.replace("pinhole", "omni"), "two lenses"),
        (KALIBR.replace("equidistant", "fov"), "no w"),
        (KALIBR + KALIBR.replace("cam0", "cam1"), "2 cameras"),
        (KALIBR.replace("[752, 480]", "[752]"), "1 number"),
        (MRCAL.replace("OPENCV8", "CAHVOR"), "lensmodel"),
        (MRCAL.replace("OPENCV8", "OPENCV4"), "12 numbers"),
        (MRCAL.replace("1766.07", "1766,07"), "13 numbers"),
        (MRCAL.replace("1766.07", "__import__('os')"), "not valid YAML"),
        (MRCAL.replace("'imagersize'", "'extrinsics'"), "used twice"),
        (MRCAL.replace("1766.07", "[" * 40 + "]" * 40), "levels"),
        (PHOTON.replace("699.4", "1e999"), "out of range|not valid JSON"),
        (PHOTON.replace("699.4", "NaN"), "out of range|not a JSON number"),
        (PHOTON.replace('"rows": 3', '"rows": 4', 1), "4 × 3"),
        (PHOTON.replace("699.4", "true"), "not a number"),
        (PHOTON.replace('"width": 640.0', '"width": 640.5'), "whole number"),
        ("{}", r"\(JSON\) contains no camera"),
        ("", "contains no camera"),
        ("PK\x03\x04", "not a whole npz"),
        ("<?xml version='1.0'?><opencv_storage>", "not valid XML"),
    ],
)
def test_a_wrong_file_is_refused_by_what_is_wrong(text, match):
    refused(text, match)


@pytest.mark.parametrize(
    "line, match",
    [
        ('{"field": "plain", "region": 3}', "region"),
        ('{"field": "../x"}', "field"),
        ("{", "damaged"),
        ("{]}", "damaged"),
        ('{"field": "plain", "rotate": 45}', "rotate"),
        ('{"field": "plain", "rectangle": [1]}', "rectangle"),
        (
            '{"field": "plain", "rectangle": [1e9, 3, 4, 5], "rotation": [1, 2, 3], "position_mm": [0, 0, 9]}',
            "rectangle|out of range",
        ),
        ('{"field": "plain", "rotation": [1, 2], "position_mm": [0, 0, 9]}', "rotation"),
        ('{"field": "plain", "rotation": [1, 2, 3]}', "position_mm"),
        ('{"field": "ssl-2008", "rotation": [1, 2, 3], "position_mm": [0, 0, -9]}', "height"),
        ('{"field": "ssl-2008", "rotation": [1, 2, 99], "position_mm": [0, 0, 9]}', "rotation"),
    ],
)
def test_our_own_line_in_a_file_is_checked_like_all_else(line, match):
    refused(f"# touchline: {line}\n" + ROS, match)


CSV = "feature,kind,z_mm,raw_x_px,raw_y_px\nleft,line,0,10,20\nleft,line,0,11,40\n"


@pytest.mark.parametrize(
    "text, match",
    [
        (CSV.replace(",", ";"), "semicolons"),
        (CSV.replace("11,40", '"11,5",40'), "decimal comma"),
        (CSV.replace("11,40", "11,5,40"), "6 columns"),
        (CSV.replace("11,40", "x,40"), "not a number"),
        (CSV.replace("raw_y_px", "y"), "raw_y_px"),
        (CSV.replace("left,line,0,11", "left,circle,0,11"), "kind"),
        (CSV + "left,line,0,1,1\n" * 20_001, "more than"),
        (CSV.replace("left,line,0,11", "x y,grid,0,11"), "feature|points"),
        (CSV.replace("left,line,0,11", "1 2 3,landmark,0,11"), "position"),
        (CSV, "field, region"),
        ("feature,raw_x_px,raw_y_px\n", "field, region"),
    ],
)
def test_a_wrong_table_is_refused_by_what_is_wrong(text, match):
    refused(text, match)


def test_a_table_of_points_is_fitted_to_a_calibration():
    model = model_of("polynomial", 2)
    clicks = tuple(o.to_json() for o in seen(model, model.region, 9))
    data = FORMATS["csv"].write(of_model(model, observations=clicks))
    field = {"plain": field_around(model.region)}
    wanted = ImportOptions("plain", model.region.name, None, model.image_size, "north")
    made = interchange.calibration_from_file(interchange.read_file(data), wanted, field)
    assert (
        made.model_name == "polynomial"
        and made.report["rms_px"] < 1e-6
        and len(made.observations) == 4
    )


def test_a_table_with_tabs_between_its_columns_is_the_same():
    with_commas, with_tabs = (
        interchange.read_file(text.encode()) for text in (CSV, CSV.replace(",", "\t"))
    )
    assert [o.to_json() for o in with_tabs] == [o.to_json() for o in with_commas]


def test_every_reader_has_a_file_from_outside_in_these_tests():
    league = {
        "ssl-vision",
        "vision-processor",
    }  # test_league_files.py, and the league's own messages
    assert set(OUTSIDE) | league | {"json", "csv", "vision-processor-start"} == set(READABLE)
    assert set(OUTSIDE) | league == set(LENS_FORMATS)


def test_no_reader_uses_what_strangers_files_must_never_meet():
    readers = [
        *ROOT.glob("app/touchline/formats/*.py"),
        *ROOT.glob("app/touchline/ssl_protocol/*.py"),
    ]
    assert len(readers) > 15
    for file in readers:
        text = file.read_text()
        for never in ("FileStorage(", "pickle", "literal_eval(", "eval(", "yaml.load", "np.load"):
            assert never not in text, f"{file.name} uses {never}"
    with pytest.raises(BadInput):
        FORMATS["mrcal"].read(b"{" * 200_000)
