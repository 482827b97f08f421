"""What the painted lines tell of two cameras is not carried on where, or in a direction in which, no line tells."""

import numpy as np
import pytest

from tests.support.rig_over_field import FIELD, FIELDS, sim_task
from tests.support.tiers import rounds
from touchline.evaluate.agreement import agreement
from touchline.models import model_from_json
from touchline.rigs.evidence import from_pictures
from touchline.sources import SourceContext, source_from_url

ADDRESS = "sim://ssl-div-b?cameras=2&camera={}&lens=half&tilt=6&fill=0.86&robots=0&fps=10"
KNOCK_MM = 50


@pytest.fixture(scope="module")
def models():
    """Calibrated by clicks on borders, the second knocked since."""
    made = []
    for number in range(2):
        task = sim_task(2, number)
        record = task.record(task.run(cross_validate=False))
        parameters = dict(record.model_parameters)
        x, y, z = parameters["position_mm"]
        made.append(
            model_from_json(
                record.model_name, {**parameters, "position_mm": [x + number * KNOCK_MM, y, z]}
            )
        )
    return made


@rounds("frame", 7, 21)
def test_a_knock_is_told_by_the_lines_of_two_pictures_and_not_exaggerated_between_them(
    models, frame
):
    pictures = [
        source_from_url(ADDRESS.format(number), SourceContext(FIELDS)).rendering.frame(
            frame + number
        )
        for number in range(2)
    ]
    sizes = [tuple(pixels.shape[1::-1]) for pixels in pictures]
    evidence = from_pictures(models[0], pictures[0], models[1], pictures[1], FIELD)
    told = agreement(models[0], sizes[0], models[1], sizes[1], FIELD, evidence)["carpet"]
    assert told["mean_mm"] == pytest.approx(KNOCK_MM, rel=0.05)
    # what there is: at a corner the lens, clicked, is wrong by 22 mm
    assert told["max_mm"] < 1.45 * KNOCK_MM
    assert np.nanmin(np.array(told["map"]["mm"], float)) > 0.5 * KNOCK_MM
