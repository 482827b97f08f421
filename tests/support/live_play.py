"""A simulated camera of which it is known what stands before it: robots that stand still, and a ball."""

import numpy as np

from tests.support.activation import activate_despite
from tests.support.refusals import API
from tests.support.sim_clicks import border_clicks
from tests.support.sim_truth import truth_at
from tests.support.simulated_source import simulated_source
from tests.support.watched_field import colour_clicks
from touchline.store.fields import load_fields

REGION, SIZE = "quarter-bottom-left", (800, 600)
SOURCE = (
    "sim://ssl-div-b?region=quarter-bottom-left&size=800x600&robots={robots}&play={play}&ball=true&speed=0&numbers=drawn"
    "&lens=division&k=-0.1&height=4000&fill={fill}&fps=20&seed={seed}"
)


class Before:
    """A camera's settings, what is before it, and its calibration by clicks."""

    def __init__(
        self,
        name: str,
        seed: int = 3,
        region: str = REGION,
        play: str = "region",
        robots: int = 12,
        fill: float = 0.9,
        terms: str = "",
    ) -> None:
        self.name, self.region = name, region
        self.source = SOURCE.format(seed=seed, play=play, robots=robots, fill=fill).replace(
            REGION, region
        )
        self.source += terms  # further ones of the address
        self.field = load_fields()["ssl-div-b"]
        self.rendering = simulated_source(self.source, {"ssl-div-b": self.field}).rendering
        self.settings = {"id": name, "source": self.source, "field": "ssl-div-b", "region": region}

    @property
    def robots(self) -> dict:
        """Those that are wholly seen, by team and number."""
        return {
            (r.team, r.number): r for r in truth_at(self.rendering, 0.0).robots if r.seen > 0.99
        }

    def clicks(self) -> dict:
        """On each colour, at most five times, raw px within the picture."""
        return {
            colour: [list(p) for p in places if 5 < p[0] < SIZE[0] - 5 and 5 < p[1] < SIZE[1] - 5][
                :5
            ]
            for colour, places in colour_clicks(self.rendering, per_colour=40).items()
        }

    def calibrate(self, client) -> dict:
        """An active version."""
        made = border_clicks(
            self.rendering.camera,
            self.field.regions[self.region],
            12,
            0.2,
            np.random.default_rng(1),
        )
        body = {
            "camera": self.name,
            "image_size": list(SIZE),
            "field": "ssl-div-b",
            "region": self.region,
            "model": "division",
            "options": {"height_mm": {"value": 4000.0, "sigma": 2.0}},
            "observations": [
                {"feature": name, "points": points.tolist()} for name, points in made.items()
            ],
        }
        answer = client.post(f"{API}/calibrations", json=body)
        assert answer.status_code == 201, answer.text
        activate_despite(client, answer.json()["id"])
        return answer.json()
