"""Programs whose files are read, and the forms of their own (MATLAB, VINS, COLMAP, BoofCV, …) in the usual names."""

from touchline.core.json_values import JsonObject
from touchline.formats.camera_names import (
    MATRIX,
    Names,
    has_numbers,
    is_matrix,
    other_lens,
    stated_lens,
)
from touchline.formats.numbers import format_error, numbers

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
DEPTHAI = {"0": "pinhole-radial-tangential", "1": "fisheye"}  # its numbers of lenses
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
    if has("distortioncoeff") and has("lensposition", "spechfovdeg"):
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
        return {**value, number_of[0]: DEPTHAI.get(str(number_of[1]), number_of[1])}, None, 0.0
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
