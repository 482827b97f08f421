"""Lines of a known field that are painted elsewhere are named with their distances; nothing else is blamed for them."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support import auto_scenes
from tests.support.auto_scenes import SceneSpec, error_mm, fields, scene_of
from touchline.automatic.request import AutomaticRequest, lines_elsewhere
from touchline.core.field_json import field_from_json
from touchline.core.records import Frame
from touchline.models import model_from_json

SPEC = SceneSpec(
    3, "ssl-div-b", "full", "mild", (1224, 1024), 5500.0, 10.0, 0.0, 3.0, 0.7, 2.0, 0.1, 4, 0
)
OFF_MM = 60.0


def painted(change) -> dict:
    """The field's file after a change of it."""
    value = fields()[SPEC.field].to_json()
    change(value)
    return value


def wider_areas(value) -> None:
    half = value["length_mm"] / 2
    for line in value["lines"]:
        for end in ("from", "to") if line["name"].startswith("defence") else ():
            x, y = line[end]
            line[end] = [
                x - np.sign(x) * OFF_MM * (abs(abs(x) - half) > 1),
                y + np.sign(y) * OFF_MM,
            ]


def larger_circle(value) -> None:
    next(arc for arc in value["arcs"] if arc["name"] == "centre-circle")["radius_mm"] += OFF_MM


@pytest.fixture
def answer(monkeypatch):
    """What is found with the field of the rules in a hall that is painted otherwise; with the calibration's error."""

    def of(change):
        as_painted = {**fields(), SPEC.field: field_from_json(painted(change))}
        with monkeypatch.context() as hall:
            hall.setattr(auto_scenes, "fields", lambda: as_painted)
            scene = scene_of(SPEC)
        field = fields()[SPEC.field]
        told, made = AutomaticRequest(field, field.region("full")).answer(Frame(scene.pixels))
        return told, None if made is None else error_mm(made, scene)

    return of


def test_areas_that_are_painted_elsewhere_are_named_and_not_the_light(answer):
    told, error = answer(wider_areas)
    assert error is None and told["verdict"]["level"] == "unsure"
    assert [doubt["reason"] for doubt in told["doubts"]] == ["painted-elsewhere"]
    assert {line["feature"].split("-")[0] for line in told["elsewhere"]} == {"defence"}
    assert len(told["elsewhere"]) >= 4 and all(
        abs(line["mm"] - OFF_MM) < 6 for line in told["elsewhere"]
    )
    assert "front line of the left defence area by" in told["verdict"]["sentence"]
    assert "light" not in told["verdict"]["fix"]


def test_where_the_other_lines_are_enough_it_is_a_remark(answer):
    told, error = answer(larger_circle)
    assert error < 1.0 and told["doubts"] == [] and told["verdict"]["level"] == "good"
    (circle,) = told["elsewhere"]
    assert circle["feature"] == "centre-circle" and abs(circle["mm"] - OFF_MM) < 3
    assert "painted elsewhere: centre circle by 60 mm." in told["verdict"]["sentence"]


def test_lines_that_are_where_the_field_has_them_are_not_named(answer):
    told, error = answer(lambda value: None)
    assert (
        error < 1.0 and told["elsewhere"] == [] and "elsewhere" not in told["verdict"]["sentence"]
    )


def test_a_line_that_the_camera_does_not_see_is_not_looked_for():
    scene = scene_of(replace(SPEC, region="half-left"))
    _, made = AutomaticRequest(scene.field, scene.region).answer(Frame(scene.pixels))
    model = model_from_json(made.model_name, made.model_parameters)
    assert (
        lines_elsewhere(model, scene.pixels[..., 0], scene.field, scene.region, ["goal-line-right"])
        == []
    )
