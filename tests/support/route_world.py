"""What a request to each route needs: two cameras above a field, calibrated, and all that can be made of them."""

import socket
import threading
from functools import cached_property
from typing import Any

import cv2
import numpy as np
from fastapi import FastAPI
from starlette.testclient import TestClient

from tests.support.board_views import BOARD, views_of
from tests.support.board_views import SIZE as BOARD_SIZE
from tests.support.exported import example
from tests.support.foreign_field import foreign_scene
from tests.support.group_listener import free_group, said
from tests.support.refusals import API
from tests.support.rest_jobs import finished
from tests.support.rolling_balls import SIZE as FILM_SIZE
from tests.support.rolling_balls import chords
from tests.support.rolling_balls import lens_of as film_lens
from tests.support.sim_clicks import border_observations
from tests.support.simulated_source import simulated_source
from tests.support.straight_edges import lens_of, lines_seen
from tests.support.tape import SIDES_AND_DIAGONALS, measured
from tests.support.waiting import until
from touchline.formats import FORMATS
from touchline.league.packet import PublishingConfig, geometry_packet, published_cameras
from touchline.store.fields import load_fields
from touchline.straight.service import saved_rolls
from touchline.workflows.calibration_request import CalibrationRequest

NAME, HALVES = "ssl-div-b", ("half-left", "half-right")
SOURCE = (
    "sim://ssl-div-b?cameras=2&camera={}&lens=half&tilt=6&fill=0.86&size=320x256&robots=2&ball=true&speed=0"
    "&numbers=drawn&fps=10"
)


CAMERAS = [
    {"id": f"cam{number}", "source": SOURCE.format(number), "field": NAME, "region": half}
    for number, half in enumerate(HALVES)
]


class World:
    """What there is on a server with the cameras cam0 and cam1; other things are made when they are asked for."""

    def __init__(self, app: FastAPI, client: TestClient) -> None:
        self.app, self.client = app, client
        self.field = load_fields()[NAME]
        for number in (0, 1):
            self.post(f"/calibrations/{self.calibrations[number]}/activate")

    def ask(self, method: str, path: str, **sent: Any) -> Any:
        answer = self.client.request(method, API + path, **sent)
        assert answer.is_success, answer.text
        return answer

    def change(self, method: str, path: str, **sent: Any) -> Any:
        """Ask for a change of what stands there now, if anything does."""
        known = self.client.get(API + path)
        seen = (
            {"If-Match": known.headers["etag"]}
            if known.is_success and "etag" in known.headers
            else {}
        )
        return self.ask(method, path, headers=seen, **sent)

    def post(self, path: str, body: Any = None) -> Any:
        return self.ask("POST", path, json=body).json()

    @cached_property
    def calibrations(self) -> list[str]:
        return [self.imported(request) for request in self.requests]

    def imported(self, request: CalibrationRequest) -> str:
        record = FORMATS["json"].write(request.record(request.run(cross_validate=False)))
        return self.ask("POST", "/calibrations/import", files={"file": record}).json()["id"]

    @property
    def other(self) -> str:
        """A new version that is not active."""
        return self.imported(self.requests[0])

    @property
    def deleted(self) -> str:
        id = self.other
        self.ask("DELETE", f"/calibrations/{id}")
        return id

    @property
    def record(self) -> bytes:
        """The file of a calibration."""
        return self.ask("GET", f"/calibrations/{self.calibrations[0]}/export/json").content

    @cached_property
    def requests(self) -> list[CalibrationRequest]:
        """What an operator clicks on the borders of both halves."""
        made = []
        for number, half in enumerate(HALVES):
            camera = simulated_source(SOURCE.format(number), {NAME: self.field}).camera
            region = self.field.region(half)
            clicks = border_observations(camera, region, 8, 0.2, np.random.default_rng(number))
            made.append(
                CalibrationRequest(
                    clicks,
                    self.field,
                    region,
                    camera.image_size,
                    "division",
                    {"height_mm": {"value": camera.position_mm[2], "sigma": 20.0}},
                    camera=f"cam{number}",
                )
            )
        return made

    @property
    def fit(self) -> dict[str, Any]:
        """The body of a fit, by the quickest model."""
        request = self.requests[0].to_json()
        return {
            **{key: request[key] for key in ("camera", "region", "observations")},
            "field": NAME,
            "model": "homography",
            "snapshot": self.snapshot,
        }

    @cached_property
    def snapshot(self) -> str:
        return self.post("/snapshots", {"camera": "cam0"})["id"]

    @cached_property
    def whole_field(self) -> str:
        """An image of a field in no rule book."""
        png = cv2.imencode(".png", foreign_scene().pixels)[1].tobytes()
        return self.ask("POST", "/snapshots", files={"file": png}).json()["id"]

    @cached_property
    def picture(self) -> bytes:
        return self.ask("GET", f"/snapshots/{self.snapshot}/image.png").content

    @cached_property
    def colours(self) -> dict[str, Any]:
        return self.post(
            "/cameras/cam0/colours/learn", {"automatic": True, "snapshot": self.snapshot}
        )["profile"]

    @property
    def kept_colours(self) -> str:
        self.change("PUT", "/colours/hall", json={"profile": self.colours})
        return "hall"

    @property
    def clip(self) -> str:
        return self.post("/cameras/cam0/clip", {"seconds": 1})["clip"]

    @property
    def rig(self) -> str:
        self.change("PUT", "/rigs/hall", json=self.rig_body)
        return "hall"

    @property
    def rig_body(self) -> dict[str, Any]:
        return {
            "field": NAME,
            "w_max_rectangle_px": 400.0,
            "h_max_rectangle_px": 300.0,
            "n_rectangles_x": 8,
            "n_rectangles_y": 6,
            "cameras": [
                {"camera": f"cam{number}", "region": half} for number, half in enumerate(HALVES)
            ],
        }

    @property
    def camera(self) -> str:
        """A new one."""
        id = f"added-{len(self.ask('GET', '/cameras').json()['items'])}"
        self.post("/cameras", {"id": id, "source": SOURCE.format(0)})
        return id

    @property
    def own_field(self) -> str:
        """A field of its own that nothing uses."""
        self.change("PUT", "/fields/own", json={**self.field.to_json(), "name": "own"})
        return "own"

    @cached_property
    def changed_field(self) -> str:
        """A field that was changed since the active calibration of a camera was made."""
        definition: dict[str, Any] = {**self.field.to_json(), "name": "changed"}
        self.change("PUT", "/fields/changed", json=definition)
        record = self.record.replace(f'"{NAME}"'.encode(), b'"changed"')
        sent = {"files": {"file": record}, "data": {"camera": self.camera}}
        self.post(
            f"/calibrations/{self.ask('POST', '/calibrations/import', **sent).json()['id']}/activate"
        )
        self.change("PUT", "/fields/changed", json={**definition, "lines": definition["lines"][1:]})
        return "changed"

    @property
    def tape(self) -> dict[str, Any]:
        """The field, and distances on it as somebody with a tape reads them."""
        distances = [
            {"from": a, "to": b, "mm": mm} for a, b, mm in measured(self.field, SIDES_AND_DIAGONALS)
        ]
        return {"field": self.field.to_json(), "distances": distances}

    def wait_for(self, camera: str) -> str:
        """Wait until a camera sends."""
        until(lambda: self.ask("GET", f"/cameras/{camera}/status").json()["state"] == "live")
        return camera

    @property
    def live_camera(self) -> str:
        return self.wait_for("cam0")

    @property
    def rolled(self) -> str:
        """A new one of the camera cam1, from (100, 100) straight to the right."""
        rolls = saved_rolls(self.app.state.services)  # a camera would have to see one roll
        id = f"{rolls.revision:016x}"
        rolls.add(
            "cam1",
            id,
            {
                "points": [[100 + 10 * step, 100] for step in range(20)],
                "at": 0.0,
                "seconds": 0.6,
                "rms_px": 0.1,
                "straight_px": 0.1,
                "image_size": [320, 256],
            },
        )
        return id

    def remove_soon(self, camera: str) -> None:
        """Remove a camera once somebody has watched it for some frames."""

        def status() -> dict[str, Any]:
            return self.ask("GET", f"/cameras/{camera}/status").json()

        def remove() -> None:
            try:
                self.wait_for(camera)
                first = until(status, lambda now: now["viewers"])["seq"]
                until(status, lambda now: now["seq"] > first + 5)
            finally:  # else the stream would never end
                self.ask("DELETE", f"/cameras/{camera}")

        threading.Thread(target=remove).start()

    @cached_property
    def drawn(self) -> dict[str, Any]:
        """The fit that the page sends with a line that it draws."""
        model = self.ask("GET", f"/calibrations/{self.calibrations[0]}").json()["model"]
        return {"model": model, "field": NAME, "region": HALVES[0]}

    @cached_property
    def bent(self) -> dict[str, Any]:
        """A lens, as straight edges tell it."""
        lens = self.post("/straightness", clicked_edges())["lens"]
        return {**lens, "image_size": [320, 256]}

    @property
    def lens(self) -> str:
        return finished(self.client, self.post("/motion", {**motion(), "make": "lens"}))["result"][
            "lens"
        ]

    @property
    def job(self) -> str:
        """One that has ended."""
        return finished(self.client, self.post("/motion", motion()))["id"]

    @property
    def sender(self) -> str:
        """A stranger who has published a camera's geometry."""
        group = free_group()
        self.ask("PUT", "/publishing", json={"absorb": True, **group})
        until(lambda: self.ask("GET", "/publishing/heard").json()["listening"])
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            packet = geometry_packet(published_cameras([example("ssl", 1)], PublishingConfig()))
            assert packet is not None
            said(packet, **group, sock=stranger)
            (one,) = until(lambda: self.ask("GET", "/publishing/heard").json()["items"])
        return one["id"]


def board() -> dict[str, Any]:
    return {
        "board": BOARD.to_json(),
        "image_size": list(BOARD_SIZE),
        "views": [
            {**view.to_json(), "object_points": view.places_mm.tolist()}
            for view in views_of(count=6)
        ],
    }


def motion() -> dict[str, Any]:
    tracks, seconds = chords(np.random.default_rng(3), film_lens(-0.2), 8)
    return {
        "image_size": list(FILM_SIZE),
        "rolls": [
            {"points": p.tolist(), "seconds": t} for p, t in zip(tracks, seconds, strict=True)
        ],
    }


def clicked_edges() -> dict[str, Any]:
    lines = lines_seen(lens_of("division", (-0.25,)), 0)
    return {"lines": [line.tolist() for line in lines], "image_size": [1280, 1024]}
