"""The OpenAPI document as generated clients need it: meanings, examples, access, and files as bytes."""

from collections.abc import Iterator
from functools import cached_property
from typing import Any

from fastapi import FastAPI
from fastapi.routing import APIRoute

from touchline.api.dependencies import OPERATOR_HEADER
from touchline.api.description.fields import FIELDS
from touchline.api.description.own_fields import FORM_PARTS, ITEMS, OWN_FIELDS
from touchline.api.middleware.access import COOKIE
from touchline.api.requests import Problem

KINDS = {  # what an id in a path is the id of, by the word of the path before it
    "calibrations": "calibration version",
    "cameras": "camera",
    "clips": "clip",
    "drafts": "image",
    "heard": "sender, as the list has it",
    "jobs": "job",
    "lenses": "lens",
    "rolls": "roll",
    "snapshots": "image",
}
NAMES = {"colours": "saved colours", "fields": "field", "rigs": "rig"}  # likewise of a name
PARAMETERS = {
    "before": "id of an older version of the same camera, to show what has changed",
    "camera": "only those of this camera, by its id",
    "cursor": "`next_cursor` of the page before; by default the first page",
    "format": "the format of the file",
    "frame": "the image in whose px the answer is",
    "from": "frame of the points: px of the raw or corrected image, or mm on the field; required with binary points",
    "if-match": "the ETag that was read: the call is refused with 412 if something has changed since",
    "limit": "greatest number of items",
    "number": "number of the frame within the clip, from 0",
    "other": "id of the calibration version that it is compared with",
    "passwords": "with the cameras' passwords, in clear",
    "purpose": "only those that were taken for this purpose",
    "snapshot": "id of a stored image; by default the calibration's own",
    "stage": "name of a stage, to show its result; drawn: the image with all detections",
    "to": "frame of the answer; required with binary points",
    "view": "the view whose correction it is",
    "z_mm": "height of the points above the carpet, mm",
}

JSON = "application/json"
FORM = "multipart/form-data"
ID, OTHER_ID = "4f1c9a2b7d3e8056", "a07b3c5d9e1f2468"
OBSERVATIONS = [
    {
        "feature": "left",
        "points": [[70.3, 85.4], [66.8, 137.9], [63.8, 243.0], [65.4, 348.0], [76.0, 505.6]],
    },
    {
        "feature": "right",
        "points": [[680.6, 67.5], [692.1, 173.0], [698.9, 278.5], [700.1, 384.0], [697.5, 489.5]],
    },
    {
        "feature": "top",
        "points": [[89.3, 69.6], [236.0, 55.8], [397.9, 47.9], [547.6, 48.9], [663.7, 54.4]],
    },
    {
        "feature": "bottom",
        "points": [[97.6, 519.8], [252.6, 526.2], [361.1, 526.4], [537.8, 519.1], [680.4, 505.9]],
    },
]
FIT = {
    "field": "ssl-2008",
    "region": "half",
    "image_size": [780, 580],
    "observations": OBSERVATIONS,
}
MATRIX = [[0.0, -1e-6, 3e-4], [1e-6, 0.0, -0.01], [-3e-4, 0.01, 1.0]]
POINTS_A = [
    [120.5, 88.0],
    [410.2, 95.4],
    [640.0, 210.7],
    [330.1, 300.9],
    [95.3, 402.2],
    [415.8, 470.1],
    [610.9, 455.5],
    [250.0, 180.0],
    [520.4, 330.6],
]
POINTS_B = [
    [118.0, 92.1],
    [408.5, 97.0],
    [637.9, 214.2],
    [327.7, 304.0],
    [92.8, 406.5],
    [413.1, 473.9],
    [608.2, 458.8],
    [247.4, 184.1],
    [517.9, 334.4],
]
FIELD = {
    "name": "training",
    "length_mm": 3000,
    "width_mm": 2000,
    "lines": [{"name": "halfway", "from": [0, -1000], "to": [0, 1000], "width_mm": 10}],
    "landmarks": {"top-left": [-1500, 1000], "bottom-right": [1500, -1000]},
    "regions": {"full": {"x": [-1500, 1500], "y": [-1000, 1000]}},
}
MODEL = {"name": "polynomial", "parameters": {}}
STAGES = {"snapshot": ID, "stages": "ssl", "calibration": OTHER_ID}
RIG = {"field": "ssl-div-b", "cameras": ["north", {"camera": "south", "region": "right-half"}]}

EVENTS = "text/event-stream"
METHODS = ("get", "put", "post", "patch", "delete")


def parameter_description(path: str, name: str) -> str | None:
    """Return what a parameter of that path means; None where nothing is known of it."""
    words = path.split("/")
    if f"{{{name}}}" in words:
        of = words[words.index(f"{{{name}}}") - 1]
        if of in NAMES:
            return f"name of the {NAMES[of]}"
        if of in KINDS:
            return f"id of the {KINDS[of]}"
    return PARAMETERS.get(name.lower())


def _json(value: Any) -> dict[str, Any]:
    return {JSON: value}


EXAMPLES: dict[str, dict[str, Any]] = {
    "activate_calibration": _json({"despite": ["on-this-field"]}),
    "add_seen_lines": _json({"field": FIELD, "calibration": ID}),
    "adjust_field": _json(
        {
            "field": FIELD,
            "distances": [
                {"from": "top-left", "to": "bottom-right", "mm": 3612.0, "sigma_mm": 3.0}
            ],
        }
    ),
    "adopt_line_offsets": _json({"field": FIELD, "calibration": ID}),
    "attempt_calibration": _json(FIT),
    "calibrate_lens": _json(
        {
            "snapshots": [ID, OTHER_ID],
            "camera": "north",
            "board": {"kind": "chessboard", "columns": 9, "rows": 6, "square_mm": 25.0},
        }
    ),
    "check_calibration": _json({"camera": "north", "frames": 5}),
    "check_rig": _json({"snapshots": {"north": ID, "south": OTHER_ID}, "pictures": "none"}),
    "compare_models": _json({**FIT, "models": ["polynomial", "homography"]}),
    "compare_pair": _json(
        {"points_a": POINTS_A, "points_b": POINTS_B, "calibration_a": ID, "calibration_b": OTHER_ID}
    ),
    "correct_image": {FORM: {"file": "field.png"}},
    "create_calibration": _json({**FIT, "note": "first points of the day"}),
    "create_camera": _json(
        {"id": "north", "name": "North", "source": "v4l2:///dev/video0", "field": "ssl-div-b"}
    ),
    "create_snapshot": {
        FORM: {"file": "field.png", "purpose": "picture"},
        JSON: {"camera": "north", "frames": 5},
    },
    "detect_calibration": _json({"snapshot": ID}),
    "detect_objects": _json(STAGES),
    "draw_detections": _json(STAGES),
    "draw_lens": _json(
        {
            "snapshot": ID,
            "lens": {
                "model": "fisheye",
                "terms": [0.05, 0.012, -0.004, 0.0006],
                "focal_px": 412.5,
                "aspect": 1.0,
                "centre_px": [639.5, 511.5],
                "image_size": {"width": 1280, "height": 1024},
            },
        }
    ),
    "evaluate_rolls": _json({"camera": "north", "make": "report"}),
    "find_epipolar_lines": _json(
        {
            "points_a": POINTS_A[:2],
            "matrix": MATRIX,
            "image_size_a": [780, 580],
            "image_size_b": [780, 580],
        }
    ),
    "find_points_along_line": _json(
        {
            "fit": {"model": MODEL, "field": "ssl-2008", "region": "half"},
            "feature": "top",
            "count": 9,
        }
    ),
    "fit_border": _json(
        {
            "points": OBSERVATIONS[0]["points"],
            "axis": "x_of_y",
            "degree": "auto",
            "image_size": [780, 580],
        }
    ),
    "import_calibration": {FORM: {"file": "geometry.bin", "field": "ssl-div-b", "region": "full"}},
    "import_geometry_camera": _json({"camera_id": 0, "camera": "north"}),
    "learn_colours": _json(
        {"clicks": {"orange": [[412.0, 305.5]], "background": [[10, 10, 60, 60]]}, "snapshot": ID}
    ),
    "measure_straightness": _json({"snapshots": [ID], "lens": "auto"}),
    "preview_calibration": _json(FIT),
    "propose_field": _json({"snapshot": ID, "length_mm": 9000.0}),
    "update_ssl_vision_settings": {FORM: {"file": "robocup-ssl.xml"}},
    "read_ball_models": {FORM: {"file": "geometry.yml"}},
    "import_robot_heights": {FORM: {"file": "robot-heights.yml"}},
    "read_field_file": {FORM: {"file": "field.json"}},
    "record_clip": _json({"seconds": 10.0}),
    "refit_field": _json({"cameras": ["north"]}),
    "refit_rig": _json({"cameras": ["south"]}),
    "reregister_camera": _json({"frames": 5, "note": "the camera was moved"}),
    "restore_backup": _json({"backup": 1412, "database": 1415}),
    "save_colours": _json(
        {"profile": {"name": "hall", "colours": {"orange": [{"rgb": [250, 112, 30]}]}}}
    ),
    "save_detection_settings": _json({"on": True, "plan": "ssl", "publish": False}),
    "save_draft": _json(
        {
            "field": "ssl-2008",
            "region": "half",
            "model": "polynomial",
            "observations": OBSERVATIONS[:1],
        }
    ),
    "save_own_field": _json(FIELD),
    "save_rig": _json(RIG),
    "snap_points": _json({"points": [[70.3, 85.4]], "width_px": 3.0}),
    "straighten_image": _json(
        {
            "snapshot": ID,
            "lens": {
                "name": "division",
                "terms": {"k1": -0.21},
                "centre_px": [639.5, 511.5],
                "image_size": [1280, 1024],
            },
        }
    ),
    "test_camera": _json({"source": "v4l2:///dev/video0"}),
    "turn_calibration": _json({"turn": 180}),
    "transform_points": _json(
        {"from": "image", "to": "field", "points": [[100.0, 100.0], [200.0, 150.0]], "z_mm": 0.0}
    ),
    "update_calibration_note": _json({"note": "used in the final"}),
    "update_camera": _json({"name": "North", "field": "ssl-div-b", "region": "left-half"}),
    "update_camera_controls": _json({"controls": {"exposure": "auto", "gain": 1.5}}),
    "update_publishing": _json({"enabled": True, "interface": "eth0", "numbers": {"north": 0}}),
    "update_referee": _json({"blue": {"name": "ibis"}, "heights": {"Our team": 142.0}}),
    "update_roll": _json({"left_out": True}),
}


Schema = dict[str, Any]
ACCESS: Schema = {
    "token": {"type": "http", "scheme": "bearer", "description": "The server's access token."},
    "cookie": {
        "type": "apiKey",
        "in": "cookie",
        "name": COOKIE,
        "description": "What a browser keeps after the login, in place of the token.",
    },
}
NO_TOKEN: Schema = {}  # a server for its own machine alone has none
OPERATOR: Schema = {
    "name": OPERATOR_HEADER,
    "in": "header",
    "required": False,
    "schema": {"type": "string"},
    "description": "name of the operator, for what is saved, activated or started; by default the "
    "caller's network address",
}


def operation_id(route: APIRoute) -> str:
    """Return the name of the route's function, which no path and no framework changes."""
    return route.name


class DescribedApi(FastAPI):
    """An application with a complete document, made once, when it is asked for."""

    @cached_property
    def _document(self) -> Schema:
        return completed(super().openapi())

    def openapi(self) -> Schema:
        return self._document


def completed(document: Schema) -> Schema:
    """Return the document, changed in place: valid 3.1, with meanings, examples and access.

    What nothing is known of, as of a route that was installed beside it, stays as it is.
    """
    schemas: dict[str, Schema] = document["components"]["schemas"]
    schemas[Problem.__name__] = Problem.model_json_schema()
    for path, method, operation in operations(document):
        if method != "get":
            operation.setdefault("parameters", []).append(dict(OPERATOR))
        for parameter in operation.get("parameters", ()):
            if "description" not in parameter and (
                meaning := parameter_description(path, parameter["name"])
            ):
                parameter["description"] = meaning
        _complete_answers(operation["responses"])
        _complete_body(operation, schemas)
    own = own_fields()
    for name, schema in schemas.items():
        _describe_fields(schema, own.get(name, {}))
    document["components"]["securitySchemes"] = ACCESS
    document["security"] = [*({name: []} for name in ACCESS), NO_TOKEN]
    return document


def operations(document: Schema) -> Iterator[tuple[str, str, Schema]]:
    """Yield path, method and operation of every call."""
    for path, item in document["paths"].items():
        yield from ((path, method, item[method]) for method in METHODS if method in item)


def own_fields() -> dict[str, dict[str, str]]:
    """Return what fields mean in one component, by its name."""
    found: dict[str, dict[str, str]] = {name: {"items": items} for name, items in ITEMS.items()}
    for names, fields in OWN_FIELDS.items():
        for name in names.split():
            found.setdefault(name, {}).update(fields)
    return found


def _complete_answers(answers: Schema) -> None:
    for answer in answers.values():
        content = answer.get("content", {})
        if EVENTS in content:  # the framework's itemSchema is of OpenAPI 3.2
            content[EVENTS] = {"schema": {"description": "Events, each with a Job as its data."}}


def _complete_body(operation: Schema, schemas: dict[str, Schema]) -> None:
    """Give each body its example, and one of JSON its name: generators make a type of it."""
    for media_type, described in operation.get("requestBody", {}).get("content", {}).items():
        if example := EXAMPLES.get(operation["operationId"], {}).get(media_type):
            described["example"] = example
        schema = described["schema"]
        if media_type == FORM:
            _describe_fields(schema, FORM_PARTS)
        elif "properties" in schema:
            schemas[schema["title"]] = schema
            described["schema"] = {"$ref": f"#/components/schemas/{schema['title']}"}


def _describe_fields(schema: Schema, own: dict[str, str]) -> None:
    for field, described in schema.get("properties", {}).items():
        if "description" not in described and (meaning := own.get(field, FIELDS.get(field))):
            described["description"] = meaning
