"""Exports read by those whose formats they are, where they install: OpenCV, PyYAML, mrcal, numpy; the same pixels."""

import json
import os
import re
import shutil
import subprocess
import sys

import cv2
import numpy as np
import pytest
import yaml

from tests.support.exported import EXAMPLES, LENS_FORMATS, example, model_of, seen_places
from tests.support.paths import HELP
from touchline.formats import FORMATS
from touchline.formats.approximation import exact_camera
from touchline.formats.numbers import format_number
from touchline.models.rotation import matrix_from_vector
from touchline.workflows import interchange

SYSTEM_PYTHON = "/usr/bin/python3"  # mrcal comes with the system, not from PyPI


def held_by(format: str) -> list[tuple[str, int]]:
    kind = FORMATS[format]
    return [
        e
        for e in EXAMPLES
        if exact_camera(model_of(*e), kind.lenses, kind.square_pixels) is not None
    ]


def exported(format: str, name: str, index: int) -> bytes:
    return interchange.export(example(name, index), format).data


def same_as_ours(pixels: np.ndarray, model, places: np.ndarray) -> None:
    assert len(places) > 30
    np.testing.assert_allclose(pixels.reshape(-1, 2), model.project(places), atol=1e-6)


def by_opencv(fisheye: bool, places, rotation, translation, k, d) -> np.ndarray:
    if fisheye:
        return cv2.fisheye.projectPoints(places[None].copy(), rotation, translation, k, d)[0]
    return cv2.projectPoints(places, rotation, translation, k, d)[0]


@pytest.mark.parametrize("z_mm", [0.0, 150.0])
@pytest.mark.parametrize("name, index", held_by("opencv"))
def test_opencv_reads_its_file_and_sees_the_same(tmp_path, name, index, z_mm):
    (tmp_path / "a.yml").write_bytes(exported("opencv", name, index))
    file = cv2.FileStorage(str(tmp_path / "a.yml"), cv2.FILE_STORAGE_READ)
    k, d, r, t = (
        file.getNode(n).mat()
        for n in (
            "camera_matrix",
            "distortion_coefficients",
            "rotation_vector",
            "translation_vector",
        )
    )
    fisheye = int(file.getNode("fisheye_model").real()) == 1
    model = model_of(name, index)
    assert (file.getNode("image_width").real(), file.getNode("image_height").real()) == tuple(
        model.image_size
    )
    places = seen_places(model, z_mm)
    same_as_ours(by_opencv(fisheye, places, r, t, k, d), model, places)


@pytest.mark.parametrize(
    "format", [f for f in LENS_FORMATS if FORMATS[f].media_type == "application/yaml"]
)
@pytest.mark.parametrize("name, index", EXAMPLES)
def test_pyyaml_finds_numbers_and_no_words_where_numbers_belong(format, name, index):
    text = interchange.export(example(name, index), format, approximate=True).data.decode()
    value = yaml.safe_load(text)

    def leaves(v):
        return (
            [x for part in (v.values() if isinstance(v, dict) else v) for x in leaves(part)]
            if isinstance(v, (dict, list))
            else [v]
        )

    words = {v for v in leaves(value) if isinstance(v, str)}
    assert all(re.fullmatch(r"[A-Za-z/][A-Za-z0-9/_-]*", word) for word in words), words


@pytest.mark.parametrize(
    "value", [1e-5, -1e-5, 1e22, 5e-324, 1.5e-7, 0.1, -0.0, 1 / 3, 1e15, 123456789.0, 1e16]
)
def test_a_number_is_read_as_itself_by_yaml_json_and_python(value):
    text = format_number(value)
    for read in (yaml.safe_load, json.loads, float):
        assert isinstance(read(text), float) and read(text) == value, text


@pytest.mark.parametrize("name, index", held_by("ros"))
def test_a_ros_node_sees_the_same(name, index):
    """As camera_info_manager_py reads it: yaml.safe_load and these keys."""
    value = yaml.safe_load(exported("ros", name, index))
    model = model_of(name, index)
    k, d = (np.array(value[key]["data"]) for key in ("camera_matrix", "distortion_coefficients"))
    counts = {"plumb_bob": 5, "rational_polynomial": 8, "equidistant": 4}
    assert len(d) == counts[value["distortion_model"]]
    assert (value["image_width"], value["image_height"]) == tuple(model.image_size)
    assert [len(value[key]["data"]) for key in ("rectification_matrix", "projection_matrix")] == [
        9,
        12,
    ]
    places = seen_places(model)
    rotation, translation = pose(model)
    pixels = by_opencv(
        value["distortion_model"] == "equidistant",
        places,
        rotation,
        translation,
        k.reshape(3, 3),
        d,
    )
    same_as_ours(pixels, model, places)


@pytest.mark.parametrize("name, index", held_by("kalibr"))
def test_kalibrs_pinhole_sees_the_same(name, index):
    camera = yaml.safe_load(exported("kalibr", name, index))["cam0"]
    model = model_of(name, index)
    fu, fv, pu, pv = camera["intrinsics"]
    k = np.array([[fu, 0, pu], [0, fv, pv], [0, 0, 1]])
    assert camera["camera_model"] == "pinhole" and len(camera["distortion_coeffs"]) == 4
    assert camera["resolution"] == list(model.image_size)
    rotation, translation = pose(model)
    places = seen_places(model)
    same_as_ours(
        by_opencv(
            camera["distortion_model"] == "equidistant",
            places,
            rotation,
            translation,
            k,
            np.array(camera["distortion_coeffs"]),
        ),
        model,
        places,
    )


@pytest.mark.parametrize("name, index", held_by("photonvision"))
def test_photonvisions_matrices_see_the_same(name, index):
    value = json.loads(exported("photonvision", name, index))
    model = model_of(name, index)
    k = np.array(value["cameraIntrinsics"]["data"]).reshape(3, 3)
    d = np.array(value["distCoeffs"]["data"])
    assert (
        value["distCoeffs"]["cols"] == len(d) in (5, 8) and value["lensmodel"] == "LENSMODEL_OPENCV"
    )
    places = seen_places(model, 150.0)
    same_as_ours(by_opencv(False, places, *pose(model), k, d), model, places)


@pytest.fixture(scope="module")
def mrcal(tmp_path_factory):
    """Project with mrcal itself, in the system's Python: (file, places (n, 3) m) -> pixels."""
    if (
        not shutil.which(SYSTEM_PYTHON)
        or subprocess.run([SYSTEM_PYTHON, "-c", "import mrcal"], capture_output=True).returncode
        != 0
    ):
        if os.environ.get("TOUCHLINE_TESTS") == "all":
            pytest.fail("mrcal is not installed: apt-get install python3-mrcal")
        pytest.skip(
            "mrcal is not installed (apt-get install python3-mrcal; it is not on PyPI): what we write was not "
            "read by it"
        )
    folder = tmp_path_factory.mktemp("mrcal")
    script = (
        "import mrcal, numpy as np, sys\n"
        "model = mrcal.cameramodel(sys.argv[1])\n"
        "there = mrcal.transform_point_rt(model.extrinsics_rt_fromref(), np.load(sys.argv[2]))\n"
        "np.save(sys.argv[3], mrcal.project(there, *model.intrinsics()))\n"
        "model.write(sys.argv[4])\n"
        "print(*model.imagersize())\n"
    )

    def run(data: bytes, places: np.ndarray):
        (folder / "a.cameramodel").write_bytes(data)
        np.save(folder / "in.npy", places)
        done = subprocess.run(
            [
                SYSTEM_PYTHON,
                "-c",
                script,
                *(
                    str(folder / n)
                    for n in ("a.cameramodel", "in.npy", "out.npy", "back.cameramodel")
                ),
            ],
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stderr
        return (
            np.load(folder / "out.npy"),
            (folder / "back.cameramodel").read_bytes(),
            done.stdout.split(),
        )

    return run


@pytest.mark.parametrize("name, index", held_by("mrcal"))
def test_mrcal_sees_the_same_and_what_it_writes_is_read(mrcal, name, index):
    model = model_of(name, index)
    places = seen_places(model, 150.0)
    pixels, written, size = mrcal(exported("mrcal", name, index), places / 1000)
    same_as_ours(pixels, model, places)
    assert size == [str(n) for n in model.image_size]
    # mrcal's own file: a lens, for its extrinsics may be anybody's
    back = interchange.read_file(written)
    assert interchange.is_lens(back) and back.notes and back.image_size == model.image_size
    assert back.lens().focal_px == pytest.approx(model.focal_px, abs=1e-6)
    assert back.lens().terms == pytest.approx(
        model.lens_terms if model.NAME == "brown-conrady" else [0] * 8, abs=1e-9
    )


@pytest.mark.parametrize("name, index", EXAMPLES)
def test_a_spreadsheet_reads_the_table(name, index):
    model = model_of(name, index)
    rows = np.genfromtxt(
        exported("csv", name, index).decode().splitlines(), delimiter=",", names=True
    )
    pixels = np.stack([rows["raw_x_px"], rows["raw_y_px"]], 1)
    field = np.stack([rows["field_x_mm"], rows["field_y_mm"]], 1)
    fine = np.isfinite(pixels).all(axis=1)
    assert fine.sum() > 300
    ours = model.raw_from_corrected(model.corrected_from_field(field[fine]))
    np.testing.assert_allclose(ours, pixels[fine], atol=1e-6)


def test_the_manuals_ten_lines_do_what_they_say(tmp_path):
    name, index = "brown-conrady", 1
    (tmp_path / "north.npz").write_bytes(exported("npz", name, index))
    (tmp_path / "north.yml").write_bytes(exported("opencv", name, index))
    cv2.imwrite(str(tmp_path / "field.png"), np.full((1024, 1280, 3), 127, np.uint8))
    blocks = re.findall(r"```python run\n(.*?)```", (HELP / "formats.md").read_text(), re.DOTALL)
    lines = [line for line in blocks[0].splitlines() if line.strip()]
    assert len(blocks) == 2 and len(lines) <= 10
    done = subprocess.run(
        [sys.executable, "-c", "\n".join(blocks)], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    place, pixel = (
        np.array(re.findall(r"-?\d+\.?\d*", line), float) for line in done.stdout.splitlines()
    )
    model = model_of(name, index)
    np.testing.assert_allclose(place, model.unproject(np.array([320.0, 240.0])), atol=0.01)
    np.testing.assert_allclose(pixel, model.project(np.array([1000.0, 500.0, 150.0])), atol=1e-4)
    assert cv2.imread(str(tmp_path / "corrected.png")).shape == (961, 1281, 3)


def test_every_format_stands_in_the_manual():
    text = (HELP / "formats.md").read_text()
    assert re.findall(r"^\| `([a-z-]+)` \|", text, re.MULTILINE) == list(FORMATS)


def pose(model) -> tuple[np.ndarray, np.ndarray]:
    """OpenCV's two vectors, from our camera and not from a file."""
    rotation = np.array(model.rotation)
    return rotation, -matrix_from_vector(rotation) @ np.array(model.position_mm)
