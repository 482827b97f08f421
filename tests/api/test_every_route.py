"""One good request to each route, and an answer as the documentation promises it; a new route fails until it is here.

One server, with a camera over each half of a field, both calibrated and active. What a request needs is made when it is
asked for, so that each test can run alone.
"""

import json
from collections.abc import Callable, Mapping
from operator import attrgetter
from typing import Any

import pytest
import schemathesis
from starlette.testclient import TestClient

from tests.support.league_geometry import packet_of
from tests.support.refusals import API, refusal
from tests.support.route_world import CAMERAS, HALVES, NAME, World, board, clicked_edges, motion
from tests.unit.formats.test_league_files import SSL, settings
from touchline.core.records import Calibration
from touchline.main import create_app
from touchline.services.open_store import READERS
from touchline.settings import Settings
from touchline.store.database import count_rows
from touchline.store.integrity import find_unreadable_rows

DAMAGED = "POST /restore-backup"  # wants a database that is damaged: test_rest_restore_backup.py
STREAM = "GET /cameras/{id}/stream.mjpg"
WIDE = {
    "model": "fisheye",
    "terms": [0.05, 0.002, 0.0, 0.0],
    "focal_px": 200.0,
    "aspect": 1.0,
    "centre_px": [160.0, 128.0],
    "image_size": {"width": 320, "height": 256},
}
POINTS = [[100.0, 100.0], [200.0, 150.0]]
GEOMETRY = packet_of("ssl-vision", "ssl-div-b").SerializeToString()

Value = Callable[[World], Any]


def sent(**values: Any) -> Mapping[str, Any]:
    """What stands in the braces of a path, and the client's arguments: values, or functions of the world."""
    return values


def first(world: World) -> str:
    return world.calibrations[0]


other, camera, live, snapshot, colours, clip, rig, job, lens = map(
    attrgetter,
    ("other", "camera", "live_camera", "snapshot", "kept_colours", "clip", "rig", "job", "lens"),
)


def separate(world: World) -> dict[str, Any]:
    world.ask("PUT", f"/publishing?rig={world.rig}", json={})
    return {"rig": world.rig}


def ssl_vision_settings(world: World) -> dict[str, bytes]:
    """Settings with a camera of each number that is published."""
    return {"file": settings(SSL, SSL)}


def pictured(world: World) -> dict[str, Any]:
    return {"snapshot": world.snapshot}


def file(world: World) -> dict[str, Any]:
    return {"file": world.picture}


def pair(world: World) -> dict[str, Any]:
    return dict(zip(("calibration_a", "calibration_b"), world.calibrations, strict=True))


def over_field(world: World) -> dict[str, Any]:
    return {"field": world.field.to_json(), "calibration": world.calibrations[0]}


def detection(world: World) -> dict[str, Any]:
    return {
        "snapshot": world.snapshot,
        "calibration": world.calibrations[0],
        "colours": world.colours,
    }


ASKED: dict[str, Mapping[str, Any]] = {
    "GET /archive": sent(),
    "GET /calibrations": sent(),
    "POST /calibrations": sent(json=attrgetter("fit")),
    "GET /calibrations/activations": sent(params={"camera": "cam0"}),
    "POST /calibrations/auto": sent(
        json=lambda w: {"field": NAME, "region": HALVES[0], **pictured(w)}
    ),
    "POST /calibrations/board": sent(json=board()),
    "POST /calibrations/compare": sent(json=lambda w: {**w.fit, "models": ["polynomial"]}),
    "POST /calibrations/import": sent(files=lambda w: {"file": w.record}),
    "DELETE /calibrations/{id}": sent(id=other),
    "GET /calibrations/{id}": sent(id=first),
    "PATCH /calibrations/{id}": sent(id=first, json={"note": "after the match"}),
    "POST /calibrations/{id}/activate": sent(id=first),
    "POST /calibrations/{id}/check": sent(id=first, json=pictured),
    "POST /calibrations/{id}/correct": sent(id=first, files=file),
    "GET /calibrations/{id}/corrected.{format}": sent(id=first, format="png", params=pictured),
    "GET /calibrations/{id}/difference/{other}.json": sent(id=first, other=other),
    "GET /calibrations/{id}/difference/{other}.png": sent(id=first, other=other),
    "GET /calibrations/{id}/export/{format}": sent(id=first, format="json"),
    "GET /calibrations/{id}/exports": sent(id=first),
    "GET /calibrations/{id}/overlay.json": sent(id=first),
    "GET /calibrations/{id}/report.html": sent(id=first),
    "GET /calibrations/{id}/report.json": sent(id=first),
    "GET /calibrations/{id}/residuals.json": sent(id=first),
    "POST /calibrations/{id}/restore": sent(id=attrgetter("deleted")),
    "GET /calibrations/{id}/scene.html": sent(id=first),
    "POST /calibrations/{id}/transform": sent(
        id=first, json={"from": "image", "to": "field", "points": POINTS}
    ),
    "POST /calibrations/{id}/turned": sent(id=first, json={"turn": 180}),
    "GET /calibrations/{id}/uncertainty.json": sent(id=first),
    "GET /calibrations/{id}/uncertainty.png": sent(id=first),
    "GET /calibrations/{id}/mesh": sent(id=first, params={"view": "corrected"}),
    "GET /calibrations/{id}/packet": sent(id=first),
    "GET /calibrations/{id}/claims": sent(id=first),
    "GET /cameras": sent(),
    "GET /cameras/status": sent(),
    "POST /cameras": sent(json={"id": "new", "source": CAMERAS[0]["source"]}),
    "GET /cameras/found": sent(),
    "GET /cameras/sources": sent(),
    "POST /cameras/test": sent(json={"source": CAMERAS[0]["source"]}),
    "DELETE /cameras/{id}": sent(id=camera),
    "GET /cameras/{id}": sent(id="cam0"),
    "PATCH /cameras/{id}": sent(id=camera, json={"name": "East"}),
    "POST /cameras/{id}/clip": sent(id="cam0", json={"seconds": 1}),
    "POST /cameras/{id}/colours/learn": sent(
        id="cam0", json=lambda w: {"automatic": True, **pictured(w)}
    ),
    "POST /cameras/{id}/confirm": sent(id=live),
    "GET /cameras/{id}/controls": sent(id=live),
    "PATCH /cameras/{id}/controls": sent(id=live, json={"controls": {"gain": 1.1}}),
    "GET /cameras/{id}/detections": sent(id="cam0"),
    "GET /cameras/{id}/frame.{format}": sent(id="cam0", format="jpg", params={"width": 100}),
    "GET /cameras/{id}/drift": sent(id="cam0"),
    "POST /cameras/{id}/reregister": sent(id="cam0", json=pictured),
    "DELETE /cameras/{id}/rolls": sent(id=lambda w: w.rolled and "cam1"),
    "GET /cameras/{id}/rolls": sent(id=lambda w: w.rolled and "cam1"),
    "DELETE /cameras/{id}/rolls/{roll}": sent(id="cam1", roll=attrgetter("rolled")),
    "PATCH /cameras/{id}/rolls/{roll}": sent(
        id="cam1", roll=attrgetter("rolled"), json={"left_out": True}
    ),
    "GET /cameras/{id}/seeing": sent(id="cam0"),
    "PUT /cameras/{id}/seeing": sent(id=camera, json={"on": True, "plan": "ssl"}),
    "GET /cameras/{id}/status": sent(id="cam0"),
    STREAM: sent(id=camera, params={"width": 64}),
    "GET /clips": sent(),
    "DELETE /clips/{id}": sent(id=clip),
    "GET /clips/{id}": sent(id=clip),
    "GET /clips/{id}/frames/{number}": sent(id=clip, number=0),
    "GET /clips/{id}/frames/{number}.jpg": sent(id=clip, number=0),
    "GET /colours": sent(),
    "DELETE /colours/{name}": sent(name=colours),
    "GET /colours/{name}": sent(name=colours),
    "PUT /colours/{name}": sent(name="new", json=lambda w: {"profile": w.colours}),
    "POST /detections": sent(json=detection),
    "POST /detections/picture.{format}": sent(format="png", json=detection),
    "GET /drafts/{snapshot}": sent(snapshot=snapshot),
    "PUT /drafts/{snapshot}": sent(snapshot=snapshot, json={"field": NAME}),
    "GET /events": sent(),
    "GET /fields": sent(),
    "GET /fields/{name}": sent(name=NAME),
    "PUT /fields/{name}": sent(name="own", json=lambda w: {**w.field.to_json(), "name": "own"}),
    "DELETE /fields/{name}": sent(name=attrgetter("own_field")),
    "GET /fields/{name}/export/{format}": sent(name=NAME, format="json"),
    "POST /fields/{name}/refit": sent(name=attrgetter("changed_field"), json={}),
    "POST /fields/read": sent(files=lambda w: {"file": json.dumps(w.field.to_json())}),
    "POST /fields/measured": sent(json=attrgetter("tape")),
    "POST /fields/painted": sent(json=over_field),
    "POST /fields/proposed": sent(json=lambda w: {"snapshot": w.whole_field, "length_mm": 8000}),
    "POST /fields/seen": sent(json=lambda w: {**over_field(w), **pictured(w)}),
    "POST /fit/attempt": sent(params={"quick": True}, json=attrgetter("fit")),
    "POST /fit/border": sent(
        json={"axis": "y_of_x", "points": [[x, 50.0 + x / 50] for x in range(0, 400, 40)]}
    ),
    "POST /fit/preview": sent(params={"quick": True}, json=attrgetter("fit")),
    "GET /health": sent(),
    "GET /readiness": sent(),
    "GET /jobs": sent(),
    "DELETE /jobs/{id}": sent(id=job),
    "GET /jobs/{id}": sent(id=job),
    "GET /jobs/{id}/events": sent(id=job),
    "GET /lenses": sent(),
    "DELETE /lenses/{id}": sent(id=lens),
    "GET /lenses/{id}": sent(id=lens),
    "GET /models": sent(),
    "POST /motion": sent(json=motion()),
    "POST /pairs": sent(json=pair),
    "POST /pairs/lines": sent(json=lambda w: {**pair(w), "points_a": POINTS}),
    "DELETE /publishing": sent(params=separate),
    "GET /publishing": sent(),
    "PUT /publishing": sent(json={"enabled": False}),
    "POST /publishing/ball-models/read": sent(files={"file": GEOMETRY}),
    "POST /publishing/confirm": sent(),
    "GET /publishing/geometry.yml": sent(),
    "GET /publishing/heard": sent(),
    "POST /publishing/ssl-vision-settings": sent(files=ssl_vision_settings),
    "POST /publishing/heard/{id}/import": sent(id=attrgetter("sender"), json={"camera_id": 0}),
    "GET /referee": sent(),
    "PUT /referee": sent(json={"blue": {"name": "ibis"}}),
    "GET /referee/robot-heights.yml": sent(),
    "POST /referee/robot-heights": sent(files={"file": b"ibis: 95"}),
    "GET /rigs": sent(),
    "DELETE /rigs/{name}": sent(name=rig),
    "GET /rigs/{name}": sent(name=rig),
    "PUT /rigs/{name}": sent(name="new", json=attrgetter("rig_body")),
    "POST /rigs/{name}/check": sent(name=rig, json={"pictures": "none"}),
    "POST /rigs/{name}/refit": sent(name=rig, json={}),
    "GET /rigs/{name}/stitched.json": sent(name=rig, params={"width": 300}),
    "GET /rigs/{name}/stitched.{format}": sent(name=rig, format="jpg", params={"width": 300}),
    "GET /rigs/{name}/tracks": sent(name=rig),
    "GET /settings": sent(),
    "GET /snapshots": sent(),
    "POST /snapshots": sent(json={"camera": "cam0"}),
    "GET /snapshots/{id}": sent(id=snapshot),
    "POST /snapshots/{id}/along": sent(
        id=snapshot, json=lambda w: {"fit": w.drawn, "feature": "top"}
    ),
    "GET /snapshots/{id}/image.{format}": sent(id=snapshot, format="png"),
    "POST /snapshots/{id}/snap": sent(id=snapshot, json={"points": POINTS}),
    "GET /stages": sent(),
    "POST /straightness": sent(json=clicked_edges()),
    "POST /lenses/picture.{format}": sent(
        format="png", json=lambda w: {"lens": WIDE, **pictured(w)}
    ),
    "POST /straightness/picture.{format}": sent(
        format="png", json=lambda w: {"lens": w.bent, **pictured(w)}
    ),
}

# A job is cancelled whatever it does, and controls are the camera's own.
STATELESS = ("DELETE /jobs/{id}", "PATCH /cameras/{id}/controls")
CHANGING = [
    *(
        route
        for route in ASKED
        if route.startswith(("PUT", "PATCH", "DELETE")) and route not in STATELESS
    ),
    "POST /calibrations/{id}/restore",
    "POST /cameras/{id}/confirm",
]


@pytest.fixture(scope="module")
def world(tmp_path_factory):
    settings = Settings(data=tmp_path_factory.mktemp("data"), cameras=CAMERAS)
    app = create_app(settings)
    with TestClient(app, base_url="http://127.0.0.1:8000") as client:
        yield World(app, client)


@pytest.fixture(scope="module")
def promised(world):
    return schemathesis.openapi.from_dict(world.ask("GET", "/openapi.json").json())


def test_no_route_is_left_out(promised):
    routes = {
        f"{call.ok().method.upper()} {call.ok().path.removeprefix(API)}"
        for call in promised.get_all_operations()
    }
    assert routes == {*ASKED, DAMAGED}


def asked(world: World, route: str) -> tuple[str, str, dict[str, Any], dict[str, Any]]:
    """The method of a route, its path as documented, what stands in its braces, and the client's arguments."""
    method, path = route.split()
    values = {
        name: value(world) if callable(value) else value for name, value in ASKED[route].items()
    }
    rest = {name: values.pop(name) for name in ("json", "params", "files") if name in values}
    return method, path, values, rest


@pytest.mark.parametrize("route", ASKED)
def test_a_good_request_is_answered_as_the_documentation_promises(world, promised, route):
    method, path, values, rest = asked(world, route)
    if route == STREAM:
        world.remove_soon(world.wait_for(values["id"]))  # then the stream ends
    asking = world.change if method in ("PUT", "PATCH") else world.ask
    answer = asking(method, path.format_map(values), **rest)
    promised[API + path][method].validate_response(answer)


@pytest.mark.parametrize("route", CHANGING)
def test_a_change_made_from_another_state_is_refused_with_the_one_that_there_is(world, route):
    method, path, values, rest = asked(world, route)
    answer = world.client.request(
        method, API + path.format_map(values), headers={"If-Match": '"0123456789abcdef"'}, **rest
    )
    problem = refusal(answer, 412)
    assert (
        problem["type"].startswith("/problems/stale-") and problem["fix"] and "current" in problem
    )


def test_what_the_routes_save_can_be_read_by_the_next_start(world):
    for part in ("snapshot", "kept_colours", "rig", "lens", "rolled", "camera", "calibrations"):
        getattr(world, part)
    world.change("PUT", f"/drafts/{world.snapshot}", json={"field": NAME})
    world.change("PUT", "/cameras/cam0/seeing", json={"on": True, "plan": "ssl"})
    world.ask("POST", f"/cameras/{world.live_camera}/confirm")
    with world.app.state.services.store._database.reading() as rows:
        assert all(count_rows(rows).values()), "something of each"
        assert [
            (table.__tablename__, reason)
            for table, _, reason in find_unreadable_rows(rows, READERS)
        ] == []


def test_no_route_changes_a_record_that_all_share(world):
    store = world.app.state.services.store.calibrations
    assert world.calibrations
    for version in store.found(limit=200).items:
        assert (
            version.calibration.to_json()
            == Calibration.from_json(json.loads(version.text)).to_json()
        )
