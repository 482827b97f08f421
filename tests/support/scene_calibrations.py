"""Clicks on what a simulated camera shows of a field, for the tests of scenes."""

import numpy as np

from tests.support.pair_over_field import FIELDS
from tests.support.sim_clicks import border_observations
from tests.support.simulated_source import simulated_source
from touchline.core.records import Observation, ObservationJson


def border_and_circle_clicks(
    source: str, region: str, noise_px: float = 0.3
) -> list[ObservationJson]:
    """An operator's clicks on the region's borders and on the field's inner lines, as REST takes them."""
    camera, field = simulated_source(source, FIELDS).camera, FIELDS["ssl-div-b"]
    clicks = list(
        border_observations(camera, field.region(region), 12, noise_px, np.random.default_rng(3))
    )
    circle = camera.raw_from_field(field.arcs["centre-circle"].sample(25))
    circle = circle[camera.sees(circle)]
    return [o.to_json() for o in (*clicks, Observation("centre-circle", "line", circle))]
