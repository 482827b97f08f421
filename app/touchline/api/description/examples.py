"""An example for each body of the REST API, by operation id and media type. The fits have points of a real image."""

from typing import Any

JSON = "application/json"
FORM = "multipart/form-data"
ID, OTHER_ID = "4f1c9a2b7d3e8056", "a07b3c5d9e1f2468"
OBSERVATIONS = [
    {"feature": "left", "points": [[70.3, 85.4], [66.8, 137.9], [63.8, 243.0], [65.4, 348.0], [76.0, 505.6]]},
    {"feature": "right", "points": [[680.6, 67.5], [692.1, 173.0], [698.9, 278.5], [700.1, 384.0], [697.5, 489.5]]},
    {"feature": "top", "points": [[89.3, 69.6], [236.0, 55.8], [397.9, 47.9], [547.6, 48.9], [663.7, 54.4]]},
    {"feature": "bottom", "points": [[97.6, 519.8], [252.6, 526.2], [361.1, 526.4], [537.8, 519.1], [680.4, 505.9]]},
]
FIT = {"field": "ssl-2008", "region": "half", "image_size": [780, 580], "observations": OBSERVATIONS}
MATRIX = [[0.0, -1e-6, 3e-4], [1e-6, 0.0, -0.01], [-3e-4, 0.01, 1.0]]
POINTS_A = [[120.5, 88.0], [410.2, 95.4], [640.0, 210.7], [330.1, 300.9], [95.3, 402.2], [415.8, 470.1], [610.9, 455.5],
            [250.0, 180.0], [520.4, 330.6]]
POINTS_B = [[118.0, 92.1], [408.5, 97.0], [637.9, 214.2], [327.7, 304.0], [92.8, 406.5], [413.1, 473.9], [608.2, 458.8],
            [247.4, 184.1], [517.9, 334.4]]
FIELD = {"name": "training", "length_mm": 3000, "width_mm": 2000,
         "lines": [{"name": "halfway", "from": [0, -1000], "to": [0, 1000], "width_mm": 10}],
         "landmarks": {"top-left": [-1500, 1000], "bottom-right": [1500, -1000]},
         "regions": {"full": {"x": [-1500, 1500], "y": [-1000, 1000]}}}
MODEL = {"name": "polynomial", "parameters": {}}
STAGES = {"snapshot": ID, "stages": "ssl", "calibration": OTHER_ID}
RIG = {"field": "ssl-div-b", "cameras": ["north", {"camera": "south", "region": "right-half"}]}


def _json(value: Any) -> dict[str, Any]:
    return {JSON: value}


EXAMPLES: dict[str, dict[str, Any]] = {
    "activate_calibration": _json({"despite": ["on-this-field"]}),
    "add_seen_lines": _json({"field": FIELD, "calibration": ID}),
    "adjust_field": _json({"field": FIELD, "distances": [
        {"from": "top-left", "to": "bottom-right", "mm": 3612.0, "sigma_mm": 3.0}]}),
    "adopt_line_offsets": _json({"field": FIELD, "calibration": ID}),
    "attempt_calibration": _json(FIT),
    "calibrate_lens": _json({"snapshots": [ID, OTHER_ID], "camera": "north", "board": {
        "kind": "chessboard", "columns": 9, "rows": 6, "square_mm": 25.0}}),
    "check_calibration": _json({"camera": "north", "frames": 5}),
    "check_rig": _json({"snapshots": {"north": ID, "south": OTHER_ID}, "pictures": "none"}),
    "compare_models": _json({**FIT, "models": ["polynomial", "homography"]}),
    "compare_pair": _json({"points_a": POINTS_A, "points_b": POINTS_B, "calibration_a": ID, "calibration_b": OTHER_ID}),
    "correct_image": {FORM: {"file": "field.png"}},
    "create_calibration": _json({**FIT, "note": "first points of the day"}),
    "create_camera": _json({"id": "north", "name": "North", "source": "v4l2:///dev/video0", "field": "ssl-div-b"}),
    "create_snapshot": {FORM: {"file": "field.png", "purpose": "picture"}, JSON: {"camera": "north", "frames": 5}},
    "detect_calibration": _json({"snapshot": ID}),
    "detect_objects": _json(STAGES),
    "draw_detections": _json(STAGES),
    "evaluate_rolls": _json({"camera": "north", "make": "report"}),
    "find_epipolar_lines": _json({"points_a": POINTS_A[:2], "matrix": MATRIX, "image_size_a": [780, 580],
                                  "image_size_b": [780, 580]}),
    "find_points_along_line": _json({"fit": {"model": MODEL, "field": "ssl-2008", "region": "half"}, "feature": "top",
                                     "count": 9}),
    "fit_border": _json({"points": OBSERVATIONS[0]["points"], "axis": "x_of_y", "degree": "auto",
                         "image_size": [780, 580]}),
    "import_calibration": {FORM: {"file": "geometry.bin", "field": "ssl-div-b", "region": "full"}},
    "import_geometry_camera": _json({"camera_id": 0, "camera": "north"}),
    "learn_colours": _json({"clicks": {"orange": [[412.0, 305.5]], "background": [[10, 10, 60, 60]]}, "snapshot": ID}),
    "measure_straightness": _json({"snapshots": [ID], "lens": "auto"}),
    "preview_calibration": _json(FIT),
    "propose_field": _json({"snapshot": ID, "length_mm": 9000.0}),
    "read_field_file": {FORM: {"file": "field.json"}},
    "record_clip": _json({"seconds": 10.0}),
    "refit_field": _json({"cameras": ["north"]}),
    "refit_rig": _json({"cameras": ["south"]}),
    "reregister_camera": _json({"frames": 5, "note": "the camera was moved"}),
    "restore_backup": _json({"backup": 1412, "database": 1415}),
    "save_colours": _json({"profile": {"name": "hall", "colours": {"orange": [{"rgb": [250, 112, 30]}]}}}),
    "save_detection_settings": _json({"on": True, "plan": "ssl", "publish": False}),
    "save_draft": _json({"field": "ssl-2008", "region": "half", "model": "polynomial",
                         "observations": OBSERVATIONS[:1]}),
    "save_own_field": _json(FIELD),
    "save_rig": _json(RIG),
    "snap_points": _json({"points": [[70.3, 85.4]], "width_px": 3.0}),
    "straighten_image": _json({"snapshot": ID, "lens": {
        "name": "division", "terms": {"k1": -0.21}, "centre_px": [639.5, 511.5], "image_size": [1280, 1024]}}),
    "test_camera": _json({"source": "v4l2:///dev/video0"}),
    "transform_points": _json({"from": "image", "to": "field", "points": [[100.0, 100.0], [200.0, 150.0]],
                               "z_mm": 0.0}),
    "update_calibration_note": _json({"note": "used in the final"}),
    "update_camera": _json({"name": "North", "field": "ssl-div-b", "region": "left-half"}),
    "update_camera_controls": _json({"controls": {"exposure": "auto", "gain": 1.5}}),
    "update_publishing": _json({"enabled": True, "interface": "eth0", "numbers": {"north": 0}}),
    "update_roll": _json({"left_out": True}),
}
