"""Fields whose lines lie beside their places, cameras calibrated over them, and how far off a field is."""

from dataclasses import replace

import numpy as np

from tests.support.simulated_source import simulated_source
from touchline.core.field import Field
from touchline.core.records import Calibration, Observation
from touchline.workflows.calibration_request import CalibrationRequest


def worst_mm(found: Field, truth: Field) -> float:
    """How far the end of any line is from where it truly is."""
    return max(
        float(np.abs(np.subtract([*line.start, *line.end], [*other.start, *other.end])).max())
        for line, other in zip(found.lines.values(), truth.lines.values(), strict=True)
    )


def calibrated_on(field: Field, truth: Field, seed: int = 0) -> Calibration:
    """A camera calibrated as if the field were as the rules have it, from 60 points on each line as it is."""
    camera = simulated_source(
        f"sim://{field.name}?lens=mild&tilt=12&size=1280x1024&robots=0&fps=9", {field.name: field}
    ).camera
    region, random, observations = field.region("full"), np.random.default_rng(seed), []
    for marking in truth.markings:
        pixels = camera.raw_from_field(np.c_[marking.sample(60), np.zeros(60)])
        pixels = pixels[camera.sees(pixels)]
        if len(pixels) > 10:
            noise = random.normal(0, 0.3, pixels.shape)
            observations.append(
                Observation(field.observed_name(marking.name, region), "line", pixels + noise)
            )
    task = CalibrationRequest(
        tuple(observations), field, region, camera.image_size, "brown-conrady"
    )
    return task.record(task.run(cross_validate=False))


def bare(field: Field) -> Field:
    """The field with its borders alone."""
    borders = {
        name: line for name, line in field.lines.items() if name.startswith(("touch", "goal"))
    }
    return replace(field, lines=borders, arcs={}, landmarks={}, extras={})


def visible(shown, marking):
    """Places of a marking that a picture of the second simulator shows, mm."""
    places = marking.sample(40)
    raw = shown.camera.project(np.column_stack([places, np.zeros(len(places))]))
    return places[
        np.isfinite(raw).all(axis=1) & (raw >= 0).all(axis=1) & (raw < shown.spec.size).all(axis=1)
    ]
