"""What a scene's tests show: calibrations of the simulator's cameras, kept by a server, and a lens from a board."""

import numpy as np

from app.core.records import Observation, ObservationJson
from tests.support.board_views import BOARD, SIZE, views_of
from tests.support.pair_over_field import FIELDS
from tests.support.sim_clicks import border_observations
from tests.support.simulated_source import simulated_source

NORTH = "sim://ssl-div-b?cameras=2&camera=0&lens=half&tilt=6&fill=0.86&robots=0&fps=5"
SOUTH = "sim://ssl-div-b?cameras=2&camera=1&lens=half&tilt=6&fill=0.86&robots=0&fps=5"
WIDE = "sim://ssl-div-b?lens=fisheye&fill=0.9&robots=0&fps=5"


def border_and_circle_clicks(source: str, region: str, noise_px: float = 0.3) -> list[ObservationJson]:
    """An operator's clicks on the region's borders and on the field's inner lines, as REST takes them."""
    camera, field = simulated_source(source, FIELDS).camera, FIELDS["ssl-div-b"]
    clicks = list(border_observations(camera, field.region(region), 12, noise_px, np.random.default_rng(3)))
    circle = camera.raw_from_field(field.arcs["centre-circle"].sample(25))
    circle = circle[camera.sees(circle)]
    return [o.to_json() for o in (*clicks, Observation("centre-circle", "line", circle))]


def kept_camera(api, id: str, source: str, region: str, model: str, options: dict | None = None,
                observations: list[ObservationJson] | None = None) -> dict:
    """A live camera, one picture of it, and an active calibration from clicks on that. api: (method, path, …)."""
    api("POST", "/cameras", json={"id": id, "name": id.title(), "source": source, "field": "ssl-div-b",
                                  "region": region})
    picture = api("POST", "/snapshots", json={"camera": id}).json()
    answer = api("POST", "/calibrations", json={
        "snapshot": picture["id"], "camera": id, "field": "ssl-div-b", "region": region, "model": model,
        "options": options or {}, "observations": observations or border_and_circle_clicks(source, region)})
    made = answer.json()
    assert "id" in made, made
    api("POST", f"/calibrations/{made['id']}/activate")
    return made


def board_request(count: int = 12) -> dict:
    """The body of POST /calibrations/board for a board that was seen so often."""
    return {"board": BOARD.to_json(), "image_size": list(SIZE), "model": "brown-conrady", "views": [
        {"name": view.name, "image_points": view.pixels.tolist(), "object_points": view.places_mm.tolist()}
        for view in views_of(count=count, seed=1)]}
