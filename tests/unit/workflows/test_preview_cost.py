"""What a preview costs, counted in evaluations of a camera: a count is the same on a busy machine."""

from dataclasses import replace

import pytest

from tests.support.rig_over_field import sim_task
from touchline.fitting.ray_camera.problem import ClickResiduals


@pytest.mark.parametrize(("model", "most"), [("auto", 230), ("polynomial", 135), ("fisheye", 160)])
def test_a_full_preview_of_48_clicks_on_the_borders_evaluates_few_cameras(monkeypatch, model, most):
    task = sim_task(4, 0, model=model)
    task = replace(task, observations=task.observations[:4], options={})
    evaluated, residuals = [], ClickResiduals.residuals
    monkeypatch.setattr(
        ClickResiduals,
        "residuals",
        lambda self, state: evaluated.append(0) or residuals(self, state),
    )
    assert task.attempt_json(quick=False)["refusal"] is None
    assert len(evaluated) <= most
