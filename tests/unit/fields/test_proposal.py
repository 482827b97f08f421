"""A field that is in no rule book is proposed from the lines of one image, of the length that was measured."""

import numpy as np
import pytest

from tests.support.auto_scenes import error_mm
from tests.support.foreign_field import LENGTH_MM, WIDTH_MM, foreign_field, foreign_scene
from tests.support.second_simulator import render, scene_spec
from tests.support.tiers import rounds
from touchline.automatic.request import AutomaticRequest
from touchline.core.errors import BadInput, FitFailed
from touchline.core.field_json import field_from_json
from touchline.core.records import Frame
from touchline.fields.proposal import proposed_field

NEAR_MM = 0.004 * LENGTH_MM
SIZE = {"length_mm": LENGTH_MM, "width_mm": WIDTH_MM}


def far_mm(one, other) -> float:
    """How far the markings of a field lie from those of the same name of another."""
    return max(
        float(np.abs(m.nearest(n.sample(20)) - n.sample(20)).max())
        for m, n in zip(
            one.markings,
            (other.feature(m.name, other.region("full")) for m in one.markings),
            strict=True,
        )
    )


@pytest.mark.parametrize(
    "given", [{"length_mm": LENGTH_MM}, {"width_mm": WIDTH_MM}, SIZE], ids=" and ".join
)
def test_every_marking_is_proposed_at_its_place_and_by_its_name(given):
    truth = foreign_field()
    told = proposed_field(foreign_scene().pixels, given.get("length_mm"), given.get("width_mm"))
    field = field_from_json(told["field"])
    assert {*field.lines, *field.arcs} == {*truth.lines, *truth.arcs} and told["is_ratio_known"]
    assert far_mm(truth, field) < NEAR_MM and field.line_sigma_mm >= 0.001 * LENGTH_MM
    assert {*field.regions} >= {
        "full",
        "half-left",
        "quarter-top-right",
    } and "circle-top" in field.landmarks
    assert "8.0" in told["sentence"]


def test_the_proposed_field_calibrates_its_image():
    scene = foreign_scene()
    field = field_from_json(proposed_field(scene.pixels, LENGTH_MM, None)["field"])
    told, made = AutomaticRequest(field, field.region("full")).answer(Frame(scene.pixels))
    assert made is not None and told["verdict"]["level"] in ("good", "fair")
    assert error_mm(made, scene) < NEAR_MM


def test_corners_are_those_of_the_borders_in_the_image():
    scene = foreign_scene()
    corners = np.array([(-1, 1), (1, 1), (1, -1), (-1, -1)]) * (LENGTH_MM / 2, WIDTH_MM / 2)
    truth = scene.camera.raw_from_field(np.column_stack([corners, np.zeros(4)]))
    found = np.array(proposed_field(scene.pixels, LENGTH_MM, None)["corners"])
    assert min(np.abs(found - truth).max(), np.abs(np.roll(found, 2, axis=0) - truth).max()) < 3


def test_without_a_circle_it_is_said_that_the_width_may_be_off_unless_it_is_given():
    pixels = foreign_scene(is_round=False).pixels
    told = proposed_field(pixels, LENGTH_MM, None)
    assert not told["is_ratio_known"] and "may be several per cent off" in told["sentence"]
    assert proposed_field(pixels, **SIZE)["is_ratio_known"]
    assert proposed_field(pixels, **SIZE)["field"]["width_mm"] == WIDTH_MM


@rounds("seed", 4, 40, 42)
def test_walls_around_the_lines_are_no_borders(seed):
    scene = render(scene_spec(seed))
    told = proposed_field(scene.pixels, scene.field.length_mm, None)
    assert abs(told["field"]["width_mm"] / scene.field.width_mm - 1) < 0.04
    assert {m["name"] for m in (*told["field"]["lines"], *told["field"]["arcs"])} == {
        *scene.field.lines,
        *scene.field.arcs,
    }


def test_half_of_a_field_is_not_taken_for_one():
    scene = foreign_scene(region="half-left")
    with pytest.raises(FitFailed) as refused:
        proposed_field(scene.pixels, LENGTH_MM, None)
    assert refused.value.reason == "no-borders"


def test_what_gives_no_field_is_refused_with_what_to_do():
    empty = np.full((480, 640, 3), 90, np.uint8)
    for pixels, size, error, reason in (
        (empty, (6000.0, None), FitFailed, "no-borders"),
        (empty, (None, None), BadInput, "no-length"),
        (empty, (4000.0, 6000.0), BadInput, "bad-size"),
    ):
        with pytest.raises(error) as refused:
            proposed_field(pixels, *size)
        assert refused.value.reason == reason and refused.value.fix
