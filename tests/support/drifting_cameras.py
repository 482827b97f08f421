"""Cameras that are followed and knocked, for tests: a simulated one, a reference of it, and the same one bumped."""

from dataclasses import replace

import numpy as np

from tests.support.live_cameras import FIELDS
from tests.support.sim_clicks import border_observations
from tests.support.simulated_source import simulated_source
from touchline.evaluate.field_lines.motion import LineReference
from touchline.models import CameraModel
from touchline.sources.sim.render import Rendering
from touchline.workflows.calibration_request import CalibrationRequest


def fitted(
    url: str, model: str = "brown-conrady", noise_px: float = 0.3
) -> tuple[Rendering, CameraModel]:
    """A simulated camera, and a calibration of it from an operator's clicks on the borders."""
    rendering = simulated_source(url, FIELDS).rendering
    clicks = border_observations(
        rendering.camera, rendering.region, 9, noise_px=noise_px, rng=np.random.default_rng(1)
    )
    task = CalibrationRequest(
        clicks, rendering.field, rendering.region, rendering.camera.image_size, model
    )
    return rendering, task.run(cross_validate=False).model


def followed(url: str, model: str = "brown-conrady") -> tuple[Rendering, LineReference]:
    """A simulated camera, and what its first picture shows of the lines."""
    rendering, calibration = fitted(url, model)
    reference = LineReference.of(
        [rendering.frame_at(0, 0.0)], calibration, rendering.field, rendering.region
    )
    assert reference is not None
    return rendering, reference


def bumped(
    rendering: Rendering, tilt_deg: float = 0.0, pan_deg: float = 0.0, roll_deg: float = 0.0
) -> Rendering:
    """The same camera, turned a little about its own axes."""
    return Rendering.of(
        rendering.camera.turned(tilt_deg, pan_deg, roll_deg),
        rendering.field,
        rendering.region,
        rendering.motion,
        sensor=rendering.sensor,
        lamps=rendering.lamps,
    )


def zoomed(rendering: Rendering, factor: float) -> Rendering:
    """The same camera with a focal length longer by a factor."""
    one = rendering.camera
    camera = replace(one, focal_px=(one.focal_px[0] * factor, one.focal_px[1] * factor))
    return Rendering.of(
        camera,
        rendering.field,
        rendering.region,
        rendering.motion,
        sensor=rendering.sensor,
        lamps=rendering.lamps,
    )


def moved_by(one: Rendering, other: Rendering) -> tuple[float, float]:
    """How far the second picture's field is from the first's: px and mm that 95 % of the region do not exceed."""
    x, y = np.meshgrid(np.linspace(*one.region.x_mm, 13), np.linspace(*one.region.y_mm, 9))
    places = np.stack([x.ravel(), y.ravel()], axis=-1)
    before, after = one.camera.raw_from_field(places), other.camera.raw_from_field(places)
    mm = np.linalg.norm(one.camera.field_from_raw(after) - places, axis=1)
    return float(np.percentile(np.linalg.norm(after - before, axis=1), 95)), float(
        np.nanpercentile(mm, 95)
    )


def knocked(
    rendering: Rendering, by: str, rng: np.random.Generator
) -> tuple[Rendering, tuple[float, float]]:
    """Bumped about a random axis, by so much as "1 px" or "3 mm"; and by how many px and mm in truth."""
    size, unit = float(by.split()[0]), by.split()[1]
    axis = rng.normal(size=3)
    axis *= 0.05 / np.linalg.norm(axis)
    px, mm = moved_by(rendering, replace_camera(rendering, axis))
    axis *= size / (px if unit == "px" else mm)
    other = bumped(rendering, *axis)
    return other, moved_by(rendering, other)


def replace_camera(rendering: Rendering, axis_deg: np.ndarray) -> Rendering:
    """Bumped, without its picture: only to measure how far."""
    return replace(rendering, camera=rendering.camera.turned(*axis_deg))
