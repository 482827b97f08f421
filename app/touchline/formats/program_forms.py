"""Programs whose files are read: the cameras in a file, and forms of their own (MATLAB, VINS, …) in the usual names."""

import re
from collections.abc import Iterator
from typing import Any

from touchline.core.json_values import JsonObject
from touchline.formats.camera_names import (
    INHERITED,
    MATRIX,
    UNREAD,
    Names,
    has_numbers,
    is_matrix,
    other_lens,
    plain,
    size_in,
    stated_lens,
)
from touchline.formats.document import FileContent
from touchline.formats.numbers import format_error, numbers

MAX_LEVELS = 6  # down to a camera
MAX_CAMERAS = 256
# of a stereo pair in one mapping: M1 and D1, cameraMatrixLeft, cam_0_matrix
AFTER = re.compile(r"(.+?)([0-9]{1,3}|left|right|l|r)")
BEFORE = re.compile(r"(left|right|cam(?:era)?[0-9]{1,3})(.+)")
WHOLE = ("distortion", "distortionparameters", "distortioncoefficients", "distcoeffs", "d")
# COLMAP's models: our lens, and what their parameters are called
COLMAP = {
    "SIMPLE_PINHOLE": ("brown-conrady", "f cx cy"),
    "PINHOLE": ("brown-conrady", "fx fy cx cy"),
    "SIMPLE_RADIAL": ("brown-conrady", "f cx cy k1"),
    "RADIAL": ("brown-conrady", "f cx cy k1 k2"),
    "OPENCV": ("brown-conrady", "fx fy cx cy k1 k2 p1 p2"),
    "FULL_OPENCV": ("brown-conrady", "fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6"),
    "OPENCV_FISHEYE": ("fisheye", "fx fy cx cy k1 k2 k3 k4"),
    "SIMPLE_RADIAL_FISHEYE": ("fisheye", "f cx cy k1"),
    "RADIAL_FISHEYE": ("fisheye", "f cx cy k1 k2"),
}
VINS_FISHEYE = {
    "k2": "k1",
    "k3": "k2",
    "k4": "k3",
    "k5": "k4",
    "mu": "fx",
    "mv": "fy",
    "u0": "cx",
    "v0": "cy",
}
VINS_OMNI = {"gamma1": "fx", "gamma2": "fy", "u0": "cx", "v0": "cy"}
NERFSTUDIO = {"fl_x": "fx", "fl_y": "fy", "w": "width", "h": "height"}
# DepthAI's numbers of lenses
DEPTHAI = {
    "0": "pinhole-radial-tangential",
    "1": "fisheye",
    "2": "equirectangular",
    "3": "radialdivision",
}
# under which name a program states its lens, where it has others than we read
OWN_LENS = {
    "nerfstudio": "cameramodel",
    "boofcv": "model",
    "okvis": "distortiontype",
    "depthai": "cameratype",
}
# by what stands in them: programs whose files are read, and the lens that they assume where none is stated
PROGRAMS = {
    "opencv": ("OpenCV", None),
    "ros": ("ROS camera_info", "brown-conrady"),
    "kalibr": ("Kalibr camchain", None),
    "mrcal": ("mrcal camera model", None),
    "photonvision": ("PhotonVision JSON", "brown-conrady"),
    "vins": ("VINS", "brown-conrady"),
    "orb-slam": ("ORB-SLAM", "brown-conrady"),
    "matlab": ("MATLAB", "brown-conrady"),
    "colmap": ("COLMAP", None),
    "anipose": ("Anipose", "brown-conrady"),
    "nerfstudio": ("nerfstudio", "brown-conrady"),
    "boofcv": ("BoofCV", "brown-conrady"),
    "okvis": ("OKVIS", None),
    "depthai": ("DepthAI", "brown-conrady"),
    "ssl-vision-settings": ("settings of ssl-vision", None),
}


def program_of(value: JsonObject, syntax: str) -> str | None:
    """Return the program whose camera this mapping is; None where it is no camera."""
    names = Names(value)
    has = names.has
    if has("colmapmodel"):
        return "colmap"
    if has("flx") and has("fly"):
        return "nerfstudio"
    if isinstance(value.get("pinhole"), dict):
        return "boofcv"
    if has("radialdistortion") and has("intrinsicmatrix", "k", "focallength"):
        return "matlab"
    if has("projectionparameters", "mirrorparameters"):
        return "vins"
    if all(
        isinstance(part, list) and len(part) == 2
        for part in map(value.get, ("focal_length", "principal_point"))
    ):
        return "okvis"
    matrices = [found for _, found in names.find(MATRIX) if is_matrix(found)]
    if not matrices:
        return ("orb-slam" if has("orbslam") else "opencv") if has("fx") and has("fy") else None
    if has("lensmodel") and isinstance(matrices[0], list) and not has("cameraintrinsics"):
        return "mrcal"
    if has("cameraintrinsics"):
        return "photonvision"
    if has("distortioncoeff") and has("cameratype", "lensposition", "spechfovdeg"):
        return "depthai"
    if isinstance(matrices[0], list) and len(matrices[0]) != 9 and has("intrinsics"):
        return "kalibr" if not isinstance(matrices[0][0], list) else "opencv"
    if syntax == "oST" or has("distortionmodel", "projectionmatrix", "cameraname", "binningx"):
        return "ros"
    return "anipose" if syntax == "TOML" else "opencv"


def in_usual_names(
    value: JsonObject, program: str, at: str
) -> tuple[JsonObject, str | None, float]:
    """Bring a form of its own into the usual names; return also the lens, and what is added to the centre, px."""
    names = Names(value)
    if program == "colmap":
        model = value["colmap_model"]
        if model not in COLMAP:
            raise other_lens(f"{at}the model", model)
        lens, called = COLMAP[model]
        wanted = called.split()
        given = numbers(value["parameters"], f"{at}parameters", (len(wanted),))
        usual = dict(zip(wanted, given, strict=True))
        if "f" in usual:
            usual["fx"] = usual["fy"] = usual.pop("f")
        size = {"width": value["width"], "height": value["height"]}
        return {**usual, **size}, lens, -0.5  # its top-left pixel's centre is (0.5, 0.5)
    if program == "matlab":
        return _of_matlab(names, at), "brown-conrady", -1.0  # its pixels are counted from 1
    if program == "nerfstudio":
        usual = {NERFSTUDIO.get(key, key): part for key, part in value.items()}
        if stated_lens(Names(usual), at) != "fisheye" and has_numbers(usual.pop("k4", 0)):
            raise format_error(f"{at}k4 is of r⁸, which no lens here has.", "Calibrate without it.")
        return usual, None, -0.5  # as COLMAP's
    if program == "boofcv":
        return _of_boofcv(value, at), None, 0.0
    if program == "okvis":
        focal = _paired(names, at, "focallength", ("fx", "fy"))
        return {**value, **focal, **_paired(names, at, "principalpoint", ("cx", "cy"))}, None, 0.0
    if program == "depthai" and (number_of := names.first("cameratype")) is not None:
        return {**value, number_of[0]: DEPTHAI.get(str(number_of[1]), str(number_of[1]))}, None, 0.0
    if program == "vins":
        parts = [
            part
            for _, part in names.find(
                ("projectionparameters", "distortionparameters", "mirrorparameters")
            )
            if isinstance(part, dict)
        ]
        usual = {key: item for part in parts for key, item in part.items()} | dict(value)
        if "mu" in usual:  # Kannala and Brandt's: r = θ + k2 θ³ + k3 θ⁵ + …
            usual |= {ours: usual[name] for name, ours in VINS_FISHEYE.items() if name in usual}
            usual.pop("k5", None)
        usual |= {ours: usual[name] for name, ours in VINS_OMNI.items() if name in usual}
        usual.pop("fisheye", None)  # whether a mask is used
        return usual, None, 0.0
    return _without_whole(value, names), None, 0.0


def _without_whole(value: JsonObject, names: Names) -> JsonObject:
    """Return a camera with the coefficients that stand as {type, parameters} or {k1, k2, …} in usual names."""
    whole = next((it for it in names.find(WHOLE) if isinstance(it[1], dict)), None)
    if whole is None or "data" in whole[1]:
        return dict(value)
    usual = {key: part for key, part in value.items() if key != whole[0]}
    inside: JsonObject = whole[1]
    parts = Names(inside)
    parameters = parts.first("parameters", "params")
    if parameters is None:
        return usual | inside
    stated = parts.first("type")
    kind = {} if stated is None else {"distortion_model": stated[1]}
    return usual | kind | {"D": parameters[1]}


def _of_boofcv(value: JsonObject, at: str) -> JsonObject:
    """Return BoofCV's pinhole and radial_tangential, a list with t1 and t2, in usual names."""
    usual: JsonObject = {key: part for key, part in value.items() if not isinstance(part, dict)}
    if stated_lens(Names(usual), at) == "fisheye":  # with other terms than ours
        raise other_lens(f"{at}model", value.get("model"))
    usual |= value["pinhole"]
    if isinstance(lens := value.get("radial_tangential"), dict):
        given = lens.get("radial")
        radial = numbers(given if isinstance(given, list) else [], f"{at}radial", range(9))
        if any(radial[3:]):
            raise format_error(f"{at}radial has terms beyond r⁶.", "Calibrate with at most three.")
        usual |= dict(zip(("k1", "k2", "k3"), radial, strict=False))
        usual |= {"p1": lens.get("t1", 0.0), "p2": lens.get("t2", 0.0)}
    return usual


def _of_matlab(names: Names, at: str) -> JsonObject:
    """Return cameraParameters in usual names. IntrinsicMatrix is K by columns; ImageSize is rows, columns."""
    usual: JsonObject = {}
    if (given := names.first("intrinsicmatrix", "k")) is not None:
        usual["K"] = given[1]
    else:
        usual |= _paired(names, at, "focallength", ("fx", "fy"))
        usual |= _paired(names, at, "principalpoint", ("cx", "cy"))
    usual |= _paired(names, at, "radialdistortion", ("k1", "k2", "k3"))
    usual |= _paired(names, at, "tangentialdistortion", ("p1", "p2"))
    if (found := names.first("imagesize")) is not None and found[1]:
        height, width = numbers(found[1], at + found[0], (2,))
        usual["image_size"] = [width, height]
    return usual


def _paired(names: Names, at: str, part: str, keys: tuple[str, ...]) -> JsonObject:
    """Return a list's two numbers or all under these keys; nothing where there is no such list."""
    if (found := names.first(part)) is None:
        return {}
    return dict(zip(keys, numbers(found[1], at + found[0], (2, len(keys))), strict=False))


def cameras_in(document: FileContent) -> dict[str, tuple[str, JsonObject]]:
    """Return the cameras of a file by name, "" for a file that is one: the program, and the mapping of its numbers."""
    found: dict[str, tuple[str, JsonObject]] = {}
    for content in document.contents:
        for name, program, value in _cameras(content, document.syntax, "", 0):
            alike = {key: part for key, part in value.items() if key != "header"}
            if any(
                alike == {k: v for k, v in known.items() if k != "header"}
                for _, known in found.values()
            ):
                continue  # a topic's messages are the same again and again
            if len(found) == MAX_CAMERAS:
                raise format_error(
                    f"The file contains more than {MAX_CAMERAS} cameras.", "Use a file with fewer."
                )
            found[name if name not in found else f"{name or 'camera'} ({len(found) + 1})"] = (
                program,
                value,
            )
    return found


def _cameras(
    value: Any, syntax: str, name: str, level: int
) -> Iterator[tuple[str, str, JsonObject]]:
    if level > MAX_LEVELS or not isinstance(value, (dict, list)):
        return
    if isinstance(value, list):
        for i, part in enumerate(value):
            if isinstance(part, dict) or (isinstance(part, list) and dict in map(type, part)):
                yield from _cameras(part, syntax, f"{name}[{i}]", level + 1)
        return
    value = _with_dots_as_levels(value)
    program = program_of(value, syntax)
    if program is not None:
        yield name, program, value
        return
    pairs = _by_affix(value)
    for affix, part in pairs.items():
        yield affix, "opencv", part
    inherited = {key: part for key, part in value.items() if _is_of_what_is_below(key, part)}
    size = size_in(value)
    for key, part in value.items() if not pairs else ():
        if isinstance(part, dict):
            about = inherited | ({"fisheye": True} if "fisheye" in plain(key) else {})
            part = {k: v for k, v in about.items() if k != key} | _of_size(part, size)
        elif isinstance(part, list):
            part = [_of_size(one, size) if isinstance(one, dict) else one for one in part]
        yield from _cameras(part, syntax, _below(name, str(key)), level + 1)


def _of_size(part: JsonObject, size: JsonObject) -> JsonObject:
    """Return a mapping with the size that is stated one level up, where it states none itself."""
    return part if size_in(part) else size | part


def _is_of_what_is_below(key: str, part: Any) -> bool:
    """Whether it says what the lens of a camera one level down is, or may: a name, coefficients, or neither."""
    return plain(key) in INHERITED or (UNREAD.fullmatch(plain(key)) is not None and bool(part))


def _below(name: str, key: str) -> str:
    """Return a name a level down; what every such file has between is left out."""
    if key in ("ros__parameters", "opencv_storage"):
        return name
    return f"{name}.{key}" if name else key[:64]


def _with_dots_as_levels(value: JsonObject) -> JsonObject:
    """Return ORB-SLAM's Camera.fx as {"Camera": {"fx": …}}; what its first camera says holds for Camera1 as well."""
    nested: JsonObject = {}
    for key, part in value.items():
        head, dot, tail = str(key).partition(".")
        if dot and head.startswith("Camera"):
            nested.setdefault(head, {"orb_slam": "1"})[tail] = part
    if not nested:
        return dict(value)
    first = nested.get("Camera", {})
    if len(nested) > 1 and "fx" not in first:
        nested.pop("Camera", None)
    common = {key: first[key] for key in ("type", "width", "height") if key in first}
    return {name: common | part for name, part in nested.items()}


def _by_affix(value: JsonObject) -> dict[str, JsonObject]:
    """Return the cameras of one mapping whose names differ by what stands before or after: M1 and D1, M2 and D2."""
    groups: dict[str, JsonObject] = {}
    shared: JsonObject = {}
    for key, part in value.items():
        name = plain(key)
        if (found := AFTER.fullmatch(name)) is not None:
            base, affix = found.groups()
        elif (found := BEFORE.fullmatch(name)) is not None:
            affix, base = found.groups()
        else:
            shared[key] = part
            continue
        groups.setdefault(affix, {})[base] = part
    return {
        affix: shared | part
        for affix, part in groups.items()
        if any(is_matrix(found) for _, found in Names(part).find(MATRIX))
    }
