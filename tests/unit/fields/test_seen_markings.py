"""Chains of bright places on the carpet, put together to lines and circles."""

from dataclasses import replace

import numpy as np
import pytest

from touchline.core.field import Arc, Line
from touchline.fields.seen_markings import with_seen
from touchline.store.fields import load_fields

FIELD = replace(load_fields()["ssl-div-b"], lines={}, arcs={}, landmarks={}, extras={})


def chain(marking, begin=0.0, end=1.0, noise_mm=1.0, seed=0):
    places = marking.sample(400)[int(400 * begin) : int(400 * end)]
    return places + np.random.default_rng(seed).normal(0, noise_mm, places.shape)


def line(start, end):
    return Line("", start, end)


def added(*chains, field=FIELD):
    found, names = with_seen(field, chains)
    return [(found.lines | found.arcs)[name] for name in names]


def test_pieces_of_one_line_are_one_and_it_stands_upright():
    askew = line((-2000.0, 503.0), (2000.0, 497.0))
    (found,) = added(chain(askew, 0, 0.4), chain(askew, 0.5, 1.0))
    assert (found.start[1], found.end[1]) == pytest.approx((500, 500), abs=1) and found.start[
        1
    ] == found.end[1]
    assert found.length_mm == pytest.approx(4000, abs=20)


def test_a_line_that_all_but_reaches_another_ends_on_it():
    upper, down = line((-1000.0, 1000.0), (1000.0, 1000.0)), line((0.0, -500.0), (0.0, 930.0))
    found = added(chain(upper), chain(down))
    assert max(found[1].start[1], found[1].end[1]) == pytest.approx(1000, abs=1)


def test_a_circle_in_pieces_is_one_and_half_of_one_is_an_arc():
    ring = Arc("", (300.0, -200.0), 500.0)
    (found,) = added(*(chain(ring, a / 8, (a + 0.9) / 8, seed=a) for a in range(8)))
    assert isinstance(found, Arc) and (found.start_deg, found.end_deg) == (0, 360)
    assert found.centre == pytest.approx((300, -200), abs=2) and found.radius_mm == pytest.approx(
        500, abs=2
    )
    (found,) = added(chain(ring, 0.0, 0.3))
    assert (found.start_deg, found.end_deg) == pytest.approx((0, 108), abs=2)


def test_an_arc_that_runs_into_a_line_is_both():
    arc, straight = Arc("", (0.0, 0.0), 500.0, 0.0, 90.0), line((0.0, 500.0), (-1000.0, 500.0))
    found = added(np.concatenate([chain(arc), chain(straight)]))
    assert {type(one) for one in found} == {Arc, Line}


def test_marks_that_only_line_up_and_what_is_short_are_no_lines():
    crosses = [
        chain(line((x - 50.0, 0.0), (x + 50.0, 0.0))) for x in (-1000.0, -400.0, 200.0, 800.0)
    ]
    assert added(*crosses) == [] and added(chain(line((0.0, 0.0), (200.0, 0.0)))) == []


def test_what_is_there_already_and_what_lies_outside_is_not_added():
    known = replace(
        FIELD,
        lines={"here": Line("here", (-2000.0, 0.0), (2000.0, 0.0))},
        arcs={"ring": Arc("ring", (0.0, 0.0), 500.0)},
    )
    assert (
        added(
            chain(line((-1500.0, 8.0), (1500.0, 8.0))),
            chain(Arc("", (5.0, 5.0), 503.0)),
            field=known,
        )
        == []
    )
    assert added(chain(line((-5000.0, 0.0), (-5000.0, 2000.0)))) == []
    assert added() == []
