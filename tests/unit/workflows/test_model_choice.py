"""The model "auto": the recommended one, saved under its own name with why; and at once a lens while clicking."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.reference_camera import SIZE, reference_camera, reference_field
from tests.support.sim_clicks import border_observations, known_grid, rms_mm
from touchline.core.errors import FitFailed
from touchline.models import field_from_raw
from touchline.workflows.calibration_request import CalibrationRequest

FIELD = reference_field()
REGION = FIELD.regions["full"]


def task(lens="strong", points=9, **options):
    camera = reference_camera(lens, 8)
    clicks = border_observations(camera, REGION, points, 0.3, np.random.default_rng(1))
    return camera, CalibrationRequest(clicks, FIELD, REGION, SIZE, "auto", options)


def test_what_is_saved_is_the_recommended_model_with_the_comparison_that_chose_it():
    camera, request = task(height_mm={"value": 4150.0, "sigma": 30.0}, degree=3)
    done = request.run()
    made = request.record(done)
    choice = made.report["model_choice"]
    assert made.model_name == choice["recommended"] != "auto" and choice["reason"]
    assert {"polynomial", made.model_name} < {row["model"] for row in choice["ranking"]}
    assert set(made.options) == {"height_mm"}  # a degree is none of a lens's
    raw, truth = known_grid(camera, REGION, 21, 17)
    assert rms_mm(field_from_raw(done.model, raw), truth) < 5
    again = replace(request, model=made.model_name, options=made.options).run()
    assert again.report["verdict"] == made.report["verdict"]


def test_while_clicking_it_is_a_lens_at_once():
    _, request = task()
    shown = request.preview(cross_validate=False)
    assert shown.model.NAME in ("brown-conrady", "fisheye") and "model_choice" not in shown.report


@pytest.mark.parametrize("fit", [CalibrationRequest.run, CalibrationRequest.preview])
def test_where_nothing_can_be_fitted_yet_it_says_what_is_missing(fit):
    _, request = task(points=1)
    with pytest.raises(FitFailed) as refused:
        fit(request)
    assert refused.value.reason == "too-few-points" and "more" in refused.value.fix
