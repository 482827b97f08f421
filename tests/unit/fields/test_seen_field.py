"""What a calibrated picture shows of a field that has its borders alone, on the second simulator's pictures."""

from functools import cache

import numpy as np
import pytest

from tests.support.second_simulator import render, scene_spec
from tests.support.taped_field import bare, visible
from tests.support.tiers import rounds
from touchline.automatic.request import AutomaticRequest
from touchline.core.errors import Conflict
from touchline.core.field_json import field_from_json
from touchline.core.records import Frame
from touchline.fields.seen_markings import seen_field

NEAR_MM = 25.0
HALF, WHOLE = 8, 5  # seeds: half a Division B field, a whole Division A field


@cache
def scene(seed):
    """A picture, and a calibration made from it."""
    shown = render(scene_spec(seed))
    _, made = AutomaticRequest(shown.field, shown.region, "brown-conrady").answer(
        Frame(shown.pixels)
    )
    return shown, made


@rounds("seed", HALF, WHOLE)
def test_the_lines_inside_are_added_where_they_are(seed):
    shown, made = scene(seed)
    told = seen_field(shown.pixels, made, bare(shown.field))
    field = field_from_json(told["field"])
    added = [(field.lines | field.arcs)[name] for name in told["added"]]
    for marking in shown.field.markings:
        places = visible(shown, marking)
        if marking.name in bare(shown.field).lines or len(places) < 15:
            continue
        off = np.min(
            [np.linalg.norm(one.nearest(places) - places, axis=1) for one in added], axis=0
        )
        assert np.mean(off < NEAR_MM) > 0.6, marking.name
    for one in added:  # and nothing is where no paint is
        off = np.min(
            [
                np.linalg.norm(m.nearest(one.sample(20)) - one.sample(20), axis=1)
                for m in shown.field.markings
            ],
            axis=0,
        )
        assert off.mean() < NEAR_MM, one


def test_what_the_field_has_is_not_added_again():
    shown, made = scene(HALF)
    once = field_from_json(seen_field(shown.pixels, made, bare(shown.field))["field"])
    assert seen_field(shown.pixels, made, once)["added"] == []


def test_a_picture_of_another_size_is_refused():
    shown, made = scene(HALF)
    with pytest.raises(Conflict) as refused:
        seen_field(shown.pixels[:-2], made, shown.field)
    assert refused.value.reason == "size-mismatch"
