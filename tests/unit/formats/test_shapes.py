"""Shapes of calibration files that people have, with numbers of our own: each is read as its own program reads it.

Or refused with what the file is and what is missing; none is read as another lens.
"""

import io
import json
import zipfile

import numpy as np
import pytest

from touchline.core.errors import BadInput, Conflict, TouchlineError
from touchline.core.geometry import ImageSize
from touchline.workflows import interchange
from touchline.workflows.interchange import ImportOptions

K = "rows: 3, cols: 3, data: [350, 0, 640, 0, 351, 480, 0, 0, 1]"
NINE = [350, 0, 640, 0, 351, 480, 0, 0, 1]
ROWS = [NINE[:3], NINE[3:6], NINE[6:]]
SIZE = "image_width: 1280\nimage_height: 960\n"
FIVE = "rows: 1, cols: 5, data: [-0.1, 0.09, 0.001, 0.0005, 0.02]"
FOUR = "rows: 1, cols: 4, data: [0.05, 0.002, 0.0004, -0.00002]"
TERMS = (-0.1, 0.09, 0.001, 0.0005, 0.02)
FISHEYE = (0.05, 0.002, 0.0004, -0.00002)
PIXELS = ((350.0, 351.0), (640.0, 480.0), ImageSize(1280, 960))


def yaml(*lines: str, size: str = SIZE, head: str = "") -> str:
    return head + size + "\n".join(lines) + "\n"


def brown(text: str | bytes, terms=TERMS, pixels=PIXELS, **stated):
    return text, "brown-conrady", terms, pixels, stated


def fisheye(text: str | bytes, terms=FISHEYE, pixels=PIXELS, **stated):
    return text, "fisheye", terms, pixels, stated


BOOFCV = """# Pinhole camera model with radial and tangential distortion
pinhole:
  fx: 350
  fy: 351
  cx: 640
  cy: 480
  width: 1280
  height: 960
  skew: {skew}
model: pinhole_radial_tangential
radial_tangential:
  radial:
  - -0.1
  - 0.09
  t1: 0.001
  t2: 0.0005
"""
OKVIS = """%YAML:1.0
cameras:
     - {T_SC:
        [ 1, 0, 0, 0.1,
          0, 1, 0, 0,
          0, 0, 1, 0,
          0, 0, 0, 1],
        image_dimension: [1280, 960],
        distortion_coefficients: [-0.1, 0.09, 0.001, 0.0005],
        distortion_type: radialtangential,
        focal_length: [350, 351],
        principal_point: [640, 480]}
camera_params:
    camera_rate: 30
"""
# the centre of its first pixel is (0.5, 0.5)
NERFSTUDIO = json.dumps(
    {"w": 1280, "h": 960, "fl_x": 350, "fl_y": 351, "cx": 640.5, "cy": 480.5}
    | {"k1": -0.1, "k2": 0.09, "p1": 0.001, "p2": 0.0005, "camera_model": "OPENCV", "frames": []}
)


def depthai(terms, kind=0):
    camera = {"cameraType": kind, "distortionCoeff": [*terms], "intrinsicMatrix": ROWS}
    camera |= {"width": 1280, "height": 960, "lensPosition": 128, "specHfovDeg": 68.7}
    return {"boardName": "b", "cameraData": [[0, camera]], "version": 6}


def npz(**arrays: np.ndarray) -> bytes:
    file = io.BytesIO()
    np.savez_compressed(file, **arrays)
    return file.getvalue()


def packed(kind: bytes, how: int = zipfile.ZIP_STORED) -> bytes:
    """A matrix of a type, as numpy would save it."""
    head = b"{'descr': '%b', 'fortran_order': False, 'shape': (3, 3), }" % kind
    head = head.ljust(117) + b"\n"
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", how) as out:
        out.writestr("K.npy", b"\x93NUMPY\x01\x00\x76\x00" + head + np.array(ROWS).tobytes())
    return file.getvalue()


OST = """# oST version 5.0 parameters


[image]

width
1280

height
960

[narrow_stereo]

camera matrix
350.0 0.0 640.0
0.0 351.0 480.0
0.0 0.0 1.0

distortion
-0.1 0.09 0.001 0.0005 0.02

rectification
1 0 0
0 1 0
0 0 1

projection
350 0 640 0
0 351 480 0
0 0 1 0
"""
XML = """<?xml version="1.0"?>
<opencv_storage>
<calibration_Time>"Mon Nov 30 2026"</calibration_Time>
<image_Width>1280</image_Width>
<image_Height>960</image_Height>
<Camera_Matrix type_id="opencv-matrix">
  <rows>3</rows><cols>3</cols><dt>d</dt>
  <data>350. 0. 640. 0. 351. 480. 0. 0. 1.</data></Camera_Matrix>
<Distortion_Coefficients type_id="opencv-matrix">
  <rows>5</rows><cols>1</cols><dt>d</dt>
  <data>-0.1 0.09 0.001
    0.0005 0.02</data></Distortion_Coefficients>
</opencv_storage>
"""
VINS = """%YAML:1.0
---
model_type: {model}
camera_name: camera
image_width: 1280
image_height: 960
distortion_parameters:
   k1: -0.1
   k2: 0.09
   p1: 0.001
   p2: 0.0005
projection_parameters:
   fx: 350
   fy: 351
   cx: 640
   cy: 480
"""
ORB = """%YAML:1.0

Camera.type: "{type}"
Camera.fx: 350.0
Camera.fy: 351.0
Camera.cx: 640.0
Camera.cy: 480.0
Camera.k1: {k1}
Camera.k2: {k2}
{more}
Camera.width: 1280
Camera.height: 960
Camera.fps: 30.0
ORBextractor.nFeatures: 1000
"""
MESSAGE = """header:
  stamp: {sec: 1, nanosec: 2}
  frame_id: camera
height: 960
width: 1280
distortion_model: plumb_bob
d: [-0.1, 0.09, 0.001, 0.0005, 0.02]
k: [350.0, 0.0, 640.0, 0.0, 351.0, 480.0, 0.0, 0.0, 1.0]
r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
p: [350.0, 0.0, 640.0, 0.0, 0.0, 351.0, 480.0, 0.0, 0.0, 0.0, 1.0, 0.0]
binning_x: 0
binning_y: 0
roi: {x_offset: 0, y_offset: 0, height: 0, width: 0, do_rectify: false}
---
"""
MRCAL = """# generated on 2026-11-30
{
    'lensmodel':  'LENSMODEL_OPENCV5',
    'intrinsics': (350., 351., 640., 480., -0.1, 0.09, 0.001, 0.0005, 0.02,),
    'rt_cam_ref': (0., 0., 0., 0., 0., 0.),
    'imagersize': (1280, 960),
    'optimization_inputs': b'P)h>@6aWAK2mpzOBviX#;{}[]~`',
}
"""
KALIBR = """cam0:
  T_cam_imu:
  - [1.0, 0.0, 0.0, 0.0]
  - [0.0, 1.0, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: pinhole
  distortion_coeffs: [0.05, 0.002, 0.0004, -0.00002]
  distortion_model: equidistant
  intrinsics: [350, 351, 640, 480]
  resolution: [1280, 960]
  rostopic: /cam0/image_raw
"""
IMU = "imu0:\n  T_i_b:\n  - [1.0, 0.0]\n  rostopic: /imu0\n  update_rate: 200.0\n"
ANIPOSE = """[cam_0]
name = "left"
size = [ 1280, 960,]
matrix = [ [ 350.0, 0.0, 640.0,], [ 0.0, 351.0, 480.0,], [ 0.0, 0.0, 1.0,],]
distortions = [ -0.1, 0.09, 0.001, 0.0005, 0.02,]
rotation = [ 0.1, 0.2, 0.3,]
translation = [ 1.0, 2.0, 3.0,]

[metadata]
adjusted = false
"""
COLMAP = """# Camera list with one line of data per camera:
#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]
# Number of cameras: 1
1 {model} 1280 960 350 351 640.5 480.5 {terms}
"""
MATLAB = {
    "ImageSize": [960, 1280],
    "RadialDistortion": [-0.1, 0.09, 0.02],
    "TangentialDistortion": [0.001, 0.0005],
}
PHOTON = {
    "resolution": {"width": 1280.0, "height": 960.0},
    "cameraIntrinsics": {"rows": 3, "cols": 3, "type": 6, "data": NINE},
    "distCoeffs": {"rows": 1, "cols": 5, "type": 6, "data": TERMS},
    "observations": [],
}


def matrices(k: str, d: str) -> str:
    return json.dumps(
        {k: ROWS, d: list(TERMS), "image_size": [1280, 960], "reprojection_error": 0.21}
    )


ORB_PAIR = ORB.format(
    type="KannalaBrandt8", k1=0.05, k2=0.002, more="Camera.k3: 0.0004\nCamera.k4: -0.00002"
) + "".join(
    f"Camera2.{name}: {value}\n"
    for name, value in zip(
        ["fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"],
        (450, 451, 641, 481, *FISHEYE),
        strict=True,
    )
)
OST_PAIR = OST.replace("[narrow_stereo]", "[narrow_stereo/left]") + OST.replace(
    "[narrow_stereo]", "[narrow_stereo/right]"
).replace("350", "340")
SHAPES = {
    "W1 ROS, camera_model": fisheye(
        yaml(
            "camera_name: c",
            f"camera_matrix: {{{K}}}",
            "camera_model: fisheye",
            f"distortion_coefficients: {{{FOUR}}}",
        )
    ),
    "W2 OpenCV with a ROS model": fisheye(
        yaml(
            f"camera_matrix: !!opencv-matrix\n  {{{K}}}",
            "distortion_model: equidistant",
            f"distortion_coefficients: !!opencv-matrix\n  {{{FOUR}}}",
            head="%YAML:1.0\n---\n",
        )
    ),
    "W3 four numbers, stated beside": fisheye(
        yaml(f"K: !!opencv-matrix {{{K}}}", f"D: !!opencv-matrix {{{FOUR}}}"), model="fisheye"
    ),
    "W3 four numbers of an ordinary lens": brown(
        yaml(f"K: !!opencv-matrix {{{K}}}", f"D: !!opencv-matrix {{{FOUR}}}"),
        (*FISHEYE,),
        model="brown-conrady",
    ),
    "S4 ROS after a directive": brown(
        yaml(
            f"camera_matrix: {{{K}}}",
            "distortion_model: plumb_bob",
            f"distortion_coefficients: {{{FIVE}}}",
            head="%YAML:1.0\n---\n",
        )
    ),
    "S5 Kalibr after a directive": fisheye("%YAML:1.0\n" + KALIBR),
    "S6 VINS": brown(VINS.format(model="PINHOLE"), TERMS[:4]),
    "S6 VINS, Kannala and Brandt": fisheye(
        "%YAML:1.0\n---\nmodel_type: KANNALA_BRANDT\n"
        + yaml(
            "projection_parameters: "
            "{k2: 0.05, k3: 0.002, k4: 0.0004, k5: -0.00002, mu: 350, mv: 351, u0: 640, v0: 480}"
        )
    ),
    "S7 ORB-SLAM": brown(
        ORB.format(type="PinHole", k1=-0.1, k2=0.09, more="Camera.p1: 0.001\nCamera.p2: 0.0005"),
        TERMS[:4],
    ),
    "S7 ORB-SLAM, radial alone, without its type": brown(
        ORB.format(type="x", k1=-0.1, k2=0.09, more="Camera.k3: 0.02").replace(
            'Camera.type: "x"\n', ""
        ),
        (-0.1, 0.09, 0.0, 0.0, 0.02),
    ),
    "S7 ORB-SLAM, fisheye": fisheye(
        ORB.format(
            type="KannalaBrandt8", k1=0.05, k2=0.002, more="Camera.k3: 0.0004\nCamera.k4: -0.00002"
        )
    ),
    "S8 a topic's messages": brown(MESSAGE + MESSAGE.replace("sec: 1", "sec: 2")),
    "S8 older keys": brown(
        MESSAGE.replace("d: [", "D: [").replace("k: [", "K: [").replace("---\n", "")
    ),
    "S9 by the camera's name": brown(
        "dalsa: {image_width: 1280, image_height: 960, camera_matrix: {"
        + K
        + "}, distortion_model: plumb_bob, distortion_coefficients: {"
        + FIVE
        + "}}"
    ),
    "S9 as a node's parameters": brown(
        "/cam:\n  ros__parameters:\n    image_width: 1280\n    image_height: 960\n"
        f"    camera_matrix: {{{K}}}\n    distortion_coefficients: {{{FIVE}}}\n"
    ),
    "S10 zeros beyond": brown(
        yaml(
            f"camera_matrix: {{{K}}}",
            "distortion_model: rational_polynomial",
            f"distortion_coefficients: {{rows: 1, cols: 14, data: {[*TERMS, *[0] * 9]}}}",
        )
    ),
    "S11 a fisheye with a zero": fisheye(
        yaml(
            f"camera_matrix: {{{K}}}",
            "distortion_model: equidistant",
            f"distortion_coefficients: {{rows: 1, cols: 5, data: {[*FISHEYE, 0]}}}",
        )
    ),
    "S12 a plain list": brown(
        yaml(
            f"camera_matrix: {{{K}}}",
            "distortion_model: plumb_bob",
            f"distortion_coefficients: {[*TERMS[:4]]}",
        ),
        TERMS[:4],
    ),
    "S13 PyYAML's lists": brown(yaml(f"camera_matrix: {ROWS}", f"dist_coeff: [{[*TERMS]}]")),
    "S14 OpenCV in XML": brown(XML),
    "S15 OpenCV in JSON": brown(
        json.dumps(
            {
                "image_width": 1280,
                "image_height": 960,
                "camera_matrix": {
                    "type_id": "opencv-matrix",
                    "rows": 3,
                    "cols": 3,
                    "dt": "d",
                    "data": NINE,
                },
                "distortion_coefficients": {
                    "type_id": "opencv-matrix",
                    "rows": 5,
                    "cols": 1,
                    "dt": "d",
                    "data": TERMS,
                },
            }
        )
    ),
    "S15 calibdb": brown(
        json.dumps(
            {
                "camera": "c",
                "img_size": [1280, 960],
                "camera_matrix": ROWS,
                "distortion_coefficients": TERMS,
                "distortion_model": "rectilinear",
                "avg_reprojection_error": 0.3,
            }
        )
    ),
    **{
        f"S16 {k}": brown(matrices(k, d))
        for k, d in (
            ("k", "d"),
            ("cam_K", "cam_kc"),
            ("mtx", "dist"),
            ("cameraMatrix", "distCoeffs"),
            ("intrinsic", "distortion_coeffs"),
            ("cam_0_matrix", "cam_0_distortion"),
            ("Intrinsic Matrix", "Distortion Coefficients"),
        )
    },
    "S16 the right one of a pair": brown(
        yaml(
            f"M1: {{{K.replace('350', '355')}}}",
            f"D1: {{{FIVE}}}",
            f"M2: {{{K}}}",
            f"D2: {{{FIVE}}}",
            "R: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}",
            "T: {rows: 3, cols: 1, data: [-0.1, 0, 0]}",
            head="%YAML:1.0\n---\n",
        ),
        entry="2",
    ),
    "S17 a size as a mapping": brown(
        f"size: {{width: 1280, height: 960}}\ncamera_matrix: {{{K}}}\ndist: {[*TERMS]}"
    ),
    "S18 PhotonVision with a mark": brown(b"\xef\xbb\xbf" + json.dumps(PHOTON).encode()),
    "S18 in UTF-16": brown(json.dumps(PHOTON).encode("utf-16")),
    "S19, S20 mrcal with tuples and the new key": brown(MRCAL),
    "S20 mrcal's lens_model": brown(MRCAL.replace("lensmodel", "lens_model")),
    "S21 Kalibr with an IMU": fisheye(KALIBR + IMU),
    "S21 the second of a chain": fisheye(
        KALIBR.replace("350", "340") + KALIBR.replace("cam0", "cam1"), entry="cam1"
    ),
    "S22 oST": brown(OST),
    "S22 oST without its first line": brown(OST.partition("\n\n\n")[2]),
    "S28 PhotonVision with pictures": brown(
        json.dumps({**PHOTON, "observations": [{"snapshotData": {"data": "A" * 6_000_000}}]})
    ),
    "CRLF and tabs": brown(yaml(f"K:\t{{{K}}}", f"D:\t{{{FIVE}}}").replace("\n", "\r\n").encode()),
    "Anipose": brown(ANIPOSE),
    "COLMAP": brown(COLMAP.format(model="OPENCV", terms="-0.1 0.09 0.001 0.0005"), TERMS[:4]),
    "COLMAP, fisheye": fisheye(
        COLMAP.format(model="OPENCV_FISHEYE", terms="0.05 0.002 0.0004 -0.00002")
    ),
    "MATLAB, transposed": brown(
        json.dumps({**MATLAB, "IntrinsicMatrix": [[350, 0, 0], [0, 351, 0], [641, 481, 1]]})
    ),
    "MATLAB, cameraIntrinsics": brown(
        json.dumps({**MATLAB, "FocalLength": [350, 351], "PrincipalPoint": [641, 481]})
    ),
    "BoofCV's model, in OpenCV's names": brown(
        yaml(f"K: {ROWS}", "model: pinhole_radial_tangential", f"dist: {[*TERMS[:4]]}"), TERMS[:4]
    ),
    "BoofCV": brown(BOOFCV.format(skew=0.0), TERMS[:4]),
    "BoofCV with zeros beyond": brown(
        BOOFCV.format(skew=0).replace("  - 0.09\n", "  - 0.09\n  - 0.02\n  - 0.0\n"), TERMS
    ),
    "OKVIS": brown(OKVIS, TERMS[:4]),
    "OKVIS, rational": brown(
        OKVIS.replace("radialtangential", "radialtangential8").replace(
            "0.0005]", "0.0005, 0.02, 0.01, 0.02, 0.03]"
        ),
        (*TERMS, 0.01, 0.02, 0.03),
    ),
    "nerfstudio": brown(NERFSTUDIO, TERMS[:4]),
    "nerfstudio, fisheye": fisheye(
        NERFSTUDIO.replace("OPENCV", "OPENCV_FISHEYE")
        .replace('"k1": -0.1, "k2": 0.09, "p1": 0.001, "p2": 0.0005', '"k1": 0.05, "k2": 0.002')
        .replace('"k2": 0.002', '"k2": 0.002, "k3": 0.0004, "k4": -0.00002'),
    ),
    "DepthAI": brown(json.dumps(depthai([*TERMS, *[0.0] * 9]))),
    "DepthAI, fisheye": fisheye(json.dumps(depthai([*FISHEYE, *[0.0] * 10], kind=1))),
    "npz": brown(npz(mtx=np.array(ROWS), dist=np.array([TERMS]), img_size=np.array([1280, 960]))),
    "npz by columns, in other types": brown(
        npz(
            camera_matrix=np.asfortranarray(np.array(ROWS, "f4")),
            dist_coeffs=np.array([[-0.125], [0.0625], [0.0], [0.0], [0.0]], ">f4"),
            width=np.uint16(1280),
            height=np.int64(960),
            rvecs=np.zeros((40, 3, 1)),
            names=np.array(["a", "b"]),
            tvecs=np.array([None, 1], object),
        ),
        (-0.125, 0.0625),
    ),
    "npz of a fisheye": fisheye(
        npz(K=np.array(ROWS), D=np.array(FISHEYE)[:, None], DIM=np.array([1280, 960])),
        model="fisheye",
    ),
    "RealSense": brown(
        json.dumps(
            {"fx": 350, "fy": 351, "ppx": 640, "ppy": 480, "width": 1280, "height": 960}
            | {"model": "distortion.brown_conrady", "coeffs": [TERMS]}
        )
    ),
    "RealSense, fisheye": fisheye(
        json.dumps(
            {"fx": 350, "fy": 351, "ppx": 640, "ppy": 480, "width": 1280, "height": 960}
            | {"model": "distortion.kannala_brandt4", "coeffs": [*FISHEYE, 0]}
        )
    ),
    "Basalt": fisheye(
        json.dumps(
            {
                "value0": {
                    "intrinsics": [
                        {
                            "camera_type": "kb4",
                            "intrinsics": dict(
                                zip(
                                    ["fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"],
                                    (350, 351, 640, 480, *FISHEYE),
                                    strict=True,
                                )
                            ),
                        }
                    ]
                }
            }
        ),
        pixels=(*PIXELS[:2], None),
    ),
    "coefficients beside the intrinsics": brown(
        json.dumps(
            {
                "intrinsic": {"fx": 350, "fy": 351, "cx": 640, "cy": 480}
                | {"width": 1280, "height": 960},
                "distortion": dict(zip(["k1", "k2", "p1", "p2", "k3"], TERMS, strict=True)),
            }
        )
    ),
    "a matrix by its names": brown(
        json.dumps(
            {
                "camera_matrix": {"fx": 350, "fy": 351, "cx": 640, "cy": 480, "w": 1}
                | {"image_width": 1280, "image_height": 960},
                "dist_coeffs": TERMS,
            }
        )
    ),
    "gyroflow": fisheye(
        json.dumps(
            {
                "calib_dimension": {"w": 1280, "h": 960},
                "fisheye_params": {"camera_matrix": ROWS, "distortion_coeffs": FISHEYE},
                "distortion_model": None,
            }
        )
    ),
    "the twelfth of many": brown(
        yaml(
            *(
                f"camera_matrix_{i}: {{{K.replace('350', str(339 + i))}}}\n"
                f"camera_distortion_{i}: {[*TERMS]}"
                for i in range(12)
            )
        ),
        entry="11",
    ),
    "oST of a pair, left": brown(OST_PAIR, entry="narrow_stereo/left"),
    "ORB-SLAM of a pair, first": fisheye(ORB_PAIR, entry="Camera"),
    "ORB-SLAM of a pair, second": fisheye(
        ORB_PAIR, pixels=((450.0, 451.0), (641.0, 481.0), PIXELS[2]), entry="Camera2"
    ),
    "VINS with a mask": brown(VINS.format(model="PINHOLE") + "fisheye: 1\n", TERMS[:4]),
    "maplab": brown(
        "sensors:\n- cameras:\n  - camera:\n      type: pinhole\n"
        "      image_width: 1280\n      image_height: 960\n"
        "      intrinsics: {rows: 4, cols: 1, data: [350, 351, 640, 480]}\n"
        "      distortion:\n        type: radial-tangential\n"
        f"        parameters: {{rows: 4, cols: 1, data: {[*TERMS[:4]]}}}\n",
        TERMS[:4],
    ),
    "Open3D, column by column": brown(
        json.dumps({"intrinsic_matrix": [350, 0, 0, 0, 351, 0, 640, 480, 1]})[:-1]
        + ', "width": 1280, "height": 960}',
        (),
    ),
    "rows within rows": brown(
        json.dumps({"cam_K": {"rows": 3, "cols": 3, "data": ROWS}, "cam_dist": {"data": TERMS}})[
            :-1
        ]
        + ', "image_size": [1280, 960]}'
    ),
    "JSON with all views": brown(
        json.dumps(
            {"rvecs": [[0.1, 0.2, 0.3]] * 1000, "tvecs": [[1.0, 2.0, 3.0]] * 1000}
            | {"mtx": ROWS, "dist": TERMS, "image_size": [1280, 960]}
        )
    ),
    "OpenCV's YAML without spaces": brown(
        "%YAML:1.0\n"
        + ORB.format(
            type="PinHole", k1=-0.1, k2=0.09, more="Camera.p1: 0.001\nCamera.p2: 0.0005"
        ).replace("%YAML:1.0", "Viewer.PointSize:2\nORBextractor.nLevels:8"),
        TERMS[:4],
    ),
    **{
        f"the size beside the camera, {name}": brown(
            yaml(f"cam0: {{K: {{{K}}}, D: {{{FIVE}}}}}", size=size)
        )
        for name, size in {
            "width and height": SIZE,
            "a list": "image_size: [1280, 960]\n",
            "by names": "resolution: {width: 1280, height: 960}\n",
        }.items()
    },
    "the size beside a list of cameras": brown(
        json.dumps({"image_size": [1280, 960], "cameras": [{"K": ROWS, "D": TERMS}]}),
    ),
    "the size two levels up": brown(
        json.dumps({"width": 1280, "height": 960, "rig": {"cam0": {"K": ROWS, "D": TERMS}}})
    ),
    "another size beside the camera": brown(
        yaml(
            f"cam0: {{K: {{{K}}}, D: {{{FIVE}}}, resolution: [1280, 960]}}",
            size="image_size: [640, 480]\n",
        )
    ),
    "another size between the levels": brown(
        json.dumps(
            {"image_width": 640, "image_height": 480}
            | {"rig": {"image_size": [1280, 960], "cam0": {"K": ROWS, "D": TERMS}}}
        )
    ),
    "a board's size beside the camera": brown(
        yaml(f"cam0: {{K: {{{K}}}, D: {{{FIVE}}}}}", size="size: 0.025\nwidth: 9\nheight: 6\n"),
        pixels=(*PIXELS[:2], None),
    ),
    "numbers one by one": brown(
        json.dumps(
            {"fx": 350, "fy": 351, "ppx": 640, "ppy": 480, "width": 1280, "height": 960}
            | dict(zip(["k1", "k2", "p1", "p2", "k3"], TERMS, strict=True))
        )
    ),
}
REFUSED = {
    "four numbers": (SHAPES["W3 four numbers, stated beside"][0], "unstated-lens", "fisheye"),
    "four zeros": (yaml(f"K: {{{K}}}", "D: [0, 0, 0, 0]"), "unstated-lens", "fisheye"),
    "two cameras": (KALIBR + KALIBR.replace("cam0", "cam1"), "several-cameras", "cam0, cam1"),
    "two lenses": (
        yaml(f"K: {{{K}}}", "D: [1, 0, 0, 0]", "distortion_model: plumb_bob", "fisheye_model: 1"),
        "bad-calibration",
        "two lenses",
    ),
    "S21 omni": (KALIBR.replace("pinhole", "omni"), "bad-calibration", "states two lenses"),
    "S21 stereographic": (
        MRCAL.replace("OPENCV5", "STEREOGRAPHIC"),
        "bad-calibration",
        "intrinsics has 9 numbers",
    ),
    "S21 splined": (
        MRCAL.replace("OPENCV5", "SPLINED_STEREOGRAPHIC_order=3_Nx=30_Ny=18_fov_x_deg=150"),
        "bad-calibration",
        "SPLINED",
    ),
    "S23": (
        json.dumps({**PHOTON, "lensmodel": "LENSMODEL_STERIOGRAPHIC"}),
        "bad-calibration",
        "(stereographic) with coefficients that no fisheye has",
    ),
    "VINS MEI": (VINS.format(model="MEI"), "bad-calibration", "has no xi"),
    "COLMAP FOV": (COLMAP.format(model="FOV", terms="0.9"), "bad-calibration", "'FOV'"),
    "RealSense": (
        json.dumps({"K": NINE, "D": TERMS, "model": "distortion.inverse_brown_conrady"}),
        "bad-calibration",
        "inverse_brown_conrady",
    ),
    "a thin prism": (
        yaml(f"K: {{{K}}}", f"D: {[*TERMS, *[0] * 3, 0.01, 0, 0, 0]}"),
        "bad-calibration",
        "thin prism",
    ),
    "no size": (yaml(f"K: {{{K}}}", f"D: {{{FIVE}}}", size=""), "no-image-size", "image size"),
    "no terms at all is no distortion": (
        yaml("points: [1, 2, 3]", "name: x"),
        "unknown-file",
        "no camera",
    ),
    "BoofCV with skew": (BOOFCV.format(skew=0.5), "bad-calibration", "skew is not read"),
    "BoofCV, r⁸": (
        BOOFCV.format(skew=0).replace("  - 0.09\n", "  - 0.09\n  - 0.0\n  - 0.1\n"),
        "bad-calibration",
        "terms beyond r⁶",
    ),
    "nerfstudio, r⁸": (
        NERFSTUDIO.replace('"OPENCV"', '"OPENCV", "k4": 0.001'),
        "bad-calibration",
        "k4 is of r⁸",
    ),
    "nerfstudio, another lens": (
        NERFSTUDIO.replace('"OPENCV"', '"EQUIRECTANGULAR"'),
        "bad-calibration",
        "EQUIRECTANGULAR",
    ),
    "DepthAI, another lens": (
        json.dumps(depthai(TERMS, kind=2)),
        "bad-calibration",
        "equirectangular",
    ),
    "DepthAI without its angle of view": (
        json.dumps({"cameraType": 1, "distortionCoeff": [*TERMS], "intrinsicMatrix": ROWS}),
        "bad-calibration",
        "A fisheye lens has 4",
    ),
    "OKVIS, another lens": (
        OKVIS.replace("radialtangential", "fisheye62"),
        "bad-calibration",
        "fisheye62",
    ),
    "BoofCV, Kannala and Brandt": (
        BOOFCV.format(skew=0).replace("pinhole_radial_tangential", "kannala_brandt"),
        "bad-calibration",
        "kannala_brandt",
    ),
    "a fisheye's coefficients under an unknown name": (
        yaml(f"K: {{{K}}}", "distortion_model: equidistant", f"radial: {[*FISHEYE]}"),
        "bad-calibration",
        "radial is not read",
    ),
    "DepthAI with a thin prism": (
        json.dumps(depthai([*TERMS, 0, 0, 0, 0.01, 0, 0, 0, 0, 0])),
        "bad-calibration",
        "thin prism",
    ),
    "Python's objects": (b"\x80\x04\x95\x10", "bad-calibration", "is a dump of Python objects"),
    "MATLAB's own": (b"MATLAB 5.0 MAT-file, Platform", "bad-calibration", "is a MAT file"),
    "a cut npz": (npz(K=np.array(ROWS))[:-30], "bad-calibration", "not a whole npz"),
    "an npz of no known type": (
        packed(b"<f1"),
        "unknown-file",
        "no camera",
    ),
    "an npz packed otherwise": (packed(b"<f8", zipfile.ZIP_LZMA), "unknown-file", "no camera"),
    "an npz of objects": (npz(K=np.array([ROWS, None], object)), "unknown-file", "no camera"),
    "our own remap table": (npz(raw_x=np.zeros((4, 4))), "unknown-file", "A remap table"),
    "BoofCV, universal": (
        yaml(
            "pinhole: {fx: 350, fy: 351, cx: 640, cy: 480, width: 1280, height: 960}",
            "model: omnidirectional_universal",
            size="",
        ),
        "bad-calibration",
        "omnidirectional_universal",
    ),
    "Basalt, double sphere": (
        json.dumps(
            {
                "camera_type": "ds",
                "intrinsics": {"fx": 350, "fy": 351, "cx": 640, "cy": 480, "xi": -0.2},
            }
        ),
        "bad-calibration",
        "has no alpha",
    ),
    "a spelling of its own": (
        yaml(f"K: {{{K}}}", "distortion_coefficents: [0.1, 0, 0, 0, 0]"),
        "bad-calibration",
        "distortion_coefficents is not read",
    ),
    "a number of another lens": (
        yaml(f"K: {{{K}}}", f"D: {[*TERMS]}", "xi: 1.2"),
        "bad-calibration",
        "xi is not read",
    ),
    "skew": (
        json.dumps({"fx": 350, "fy": 351, "cx": 640, "cy": 480, "skew": 3}),
        "bad-calibration",
        "skew is not read",
    ),
    "cameras without end": (
        "".join(f"{i} PINHOLE 640 480 {500 + i} 500 320 240\n" for i in range(300)),
        "bad-calibration",
        "more than 256 cameras",
    ),
    "a dozen cameras": (
        "".join(f"{i} PINHOLE 640 480 {500 + i} 500 320 240\n" for i in range(12)),
        "several-cameras",
        "12 cameras: 0, 1, 2, 3, 4, 5, 6, 7, …",
    ),
    "two cameras of oST": (OST_PAIR, "several-cameras", "narrow_stereo/right"),
    "two cameras of ORB-SLAM by number": (
        "Camera1.fx: 450\nCamera2.fx: 450\n",
        "unknown-file",
        "no camera",
    ),
    "two cameras of ORB-SLAM": (ORB_PAIR, "several-cameras", "Camera, Camera2"),
    "gyroflow of another lens": (
        json.dumps(
            {
                "fisheye_params": {"camera_matrix": ROWS, "distortion_coeffs": FISHEYE},
                "distortion_model": "poly5",
            }
        ),
        "bad-calibration",
        "poly5",
    ),
    "S26 ssl-vision's settings": (
        '<?xml version="1.0"?>\n<VarXML>\n<Var name="Field Length" type="double">\n6100,000000\n</Var></VarXML>',
        "unknown-file",
        "settings of ssl-vision, but no field",
    ),
    "XML with a type": (
        '<?xml version="1.0"?><!DOCTYPE a SYSTEM "http://127.0.0.1:9/a.dtd">' + XML[22:],
        "bad-calibration",
        "document type",
    ),
    "XML in XML": (
        '<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b "cccc"><!ENTITY d "&b;&b;">]><a>&d;</a>',
        "bad-calibration",
        "document type",
    ),
}


def as_bytes(text: str | bytes) -> bytes:
    return text.encode() if isinstance(text, str) else text


@pytest.mark.parametrize("shape", SHAPES)
def test_a_shape_is_read_as_its_own_program_reads_it(shape):
    text, model, terms, (focal, centre, size), stated = SHAPES[shape]
    found = interchange.read_file(as_bytes(text), ImportOptions(**stated))
    assert found.model == model
    assert found.terms == (*terms, *[0.0] * (len(found.terms) - len(terms)))
    assert (found.focal_px, found.centre_px, found.image_size) == (focal, centre, size)
    wanted = ImportOptions(image_size=ImageSize(1280, 960), **stated)
    record = interchange.lens_record_from_file(found, wanted)
    assert record["note"].startswith("Imported from ")


@pytest.mark.parametrize("shape", REFUSED)
def test_what_cannot_be_read_is_named(shape):
    text, reason, word = REFUSED[shape]
    with pytest.raises(TouchlineError) as refusal:
        interchange.lens_record_from_file(interchange.read_file(as_bytes(text)), ImportOptions())
    assert (refusal.value.reason, refusal.value.fix != "") == (reason, True)
    assert word in str(refusal.value)


@pytest.mark.parametrize(
    "text, note",
    [
        (MESSAGE.replace("binning_x: 0", "binning_x: 2"), "binning_x was not applied"),
        (MESSAGE.replace("x_offset: 0", "x_offset: 40"), "roi was not applied"),
        (
            yaml(f"K: {{{K}}}", f"D: {{{FIVE}}}", size="image_size: [400, 300]\n"),
            "outside the image",
        ),
        (
            yaml(f"K: {{{K}}}", "D: [-0.5, 0.05, 0, 0, 0]"),
            "The lens ends inside the image",
        ),
        (
            yaml(f"K: {{{K}}}", f"D: {[*TERMS]}", size="image_size: [960, 1280]\n"),
            "states its size as height and width",
        ),
        (yaml(f"K: {{{K}}}"), "The file states no distortion"),
        (yaml(f"K: {{{K}}}", "distortion_model: equidistant"), "The file states no distortion"),
        (
            KALIBR + "  T_cn_cnm1:\n  - [1, 0, 0, 0.1]\n",
            "The transformation from the camera before it",
        ),
        (
            yaml(
                "camera_name: c", f"camera_matrix: {{{K}}}", f"distortion_coefficients: {{{FOUR}}}"
            ),
            "assumes brown-conrady",
        ),
    ],
)
def test_what_is_not_used_or_speaks_against_a_file_is_said(text, note):
    found = interchange.read_file(as_bytes(text))
    assert note in " ".join(found.notes)
    assert note in interchange.lens_record_from_file(found, ImportOptions())["note"]


def test_the_notes_of_a_good_file_are_empty():
    for text, _, terms, _, stated in SHAPES.values():
        notes = interchange.read_file(as_bytes(text), ImportOptions(**stated)).notes
        assert not terms or not [note for note in notes if "assumes" not in note], text


def test_the_choice_of_cameras_comes_with_the_refusal():
    with pytest.raises(Conflict) as refusal:
        interchange.read_file((KALIBR + KALIBR.replace("cam0", "cam1")).encode())
    assert refusal.value.details == {"entries": ["cam0", "cam1"]}
    with pytest.raises(Conflict, match="no camera called 'cam2'") as refusal:
        interchange.read_file(
            (KALIBR + KALIBR.replace("cam0", "cam1")).encode(), ImportOptions(entry="cam2")
        )
    assert "cam0, cam1" in refusal.value.fix


def test_a_stated_lens_is_not_overruled():
    with pytest.raises(BadInput, match="states its lens: fisheye"):
        interchange.read_file(KALIBR.encode(), ImportOptions(model="brown-conrady"))


def test_a_pixel_of_a_foreign_file_is_that_of_its_program():
    """OpenCV's own projection of the same numbers, to a millionth of a pixel."""
    import cv2

    rays = np.array([[x, y, 1.0] for x in np.linspace(-1, 1, 5) for y in np.linspace(-0.8, 0.8, 5)])
    k = np.array(ROWS, float)
    zero = np.zeros(3)
    for shape, project in (
        ("S10 zeros beyond", lambda d: cv2.projectPoints(rays, zero, zero, k, d)[0]),
        (
            "S11 a fisheye with a zero",
            lambda d: cv2.fisheye.projectPoints(rays[:, None], zero, zero, k, d)[0],
        ),
    ):
        text, _, terms, *_ = SHAPES[shape]
        lens = interchange.read_file(as_bytes(text)).lens()
        np.testing.assert_allclose(
            lens.project(rays), project(np.array(terms)).reshape(-1, 2), atol=1e-6
        )
