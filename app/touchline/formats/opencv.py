"""OpenCV: the YAML that cv2.FileStorage reads, written so that plain YAML readers read it as well.

Matrices stand as mappings {rows, cols, dt, data} without OpenCV's tag, which it does not need and others choke on; and
the first line is "%YAML 1.0", since "%YAML:1.0" is no YAML. camera_matrix and distortion_coefficients as in OpenCV's
own calibration sample (there fisheye_model: 1 means cv2.fisheye); rotation_vector and translation_vector as
cv2.projectPoints takes them, field mm to camera.
"""

from touchline.core.records import Calibration
from touchline.formats import Format, camera_file
from touchline.formats.approximation import ExportCamera, header
from touchline.formats.numbers import format_list


def write(calibration: Calibration, export: ExportCamera) -> bytes:
    camera = export.camera
    fisheye, terms = camera.NAME == "fisheye", camera_file.lens_terms(camera)
    text = "%YAML 1.0\n---\n" + header(
        calibration,
        export,
        "rotation_vector and translation_vector take field mm to the camera: "
        f"{'cv2.fisheye' if fisheye else 'cv2'}.projectPoints gives raw pixels.",
        pose=False,
    )
    text += f"image_width: {camera.image_size.width}\nimage_height: {camera.image_size.height}\n"
    text += f"fisheye_model: {int(fisheye)}\n"
    for name, rows, data in (
        ("camera_matrix", 3, camera_file.matrix_of(camera)),
        ("distortion_coefficients", len(terms), terms),
        ("rotation_vector", 3, camera.rotation),
        ("translation_vector", 3, camera_file.translation_of(camera)),
    ):
        text += f"{name}:\n   rows: {rows}\n   cols: {len(data) // rows}\n   dt: d\n   data: {format_list(data)}\n"
    return text.encode()


FORMAT = Format(
    "OpenCV YAML",
    "application/yaml",
    ".yml",
    "Brown–Conrady and fisheye lenses, with the pose; for cv2.FileStorage.",
    write,
    camera_file.read,
    lenses=camera_file.LENSES_WITH_FISHEYE,
)
