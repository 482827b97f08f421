"""A field with lines moved a little: what hangs on them comes along, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from touchline.core.field import Landmark
from touchline.core.field_json import field_from_json
from touchline.fields.measuring import JoinedField, rounded_field
from touchline.store.fields import load_fields

FIELDS = load_fields()
DIV_B = FIELDS["ssl-div-b"]
ASIDE = 15.0


def moved(field=DIV_B, arcs=None, **shifts):
    named = {name.replace("_", "-"): shift for name, shift in shifts.items()}
    return JoinedField(field).moved(named, arcs or {})


@pytest.mark.parametrize("field", FIELDS.values(), ids=FIELDS)
def test_nothing_moved_is_the_same_field(field):
    assert (
        rounded_field(JoinedField(field).moved({}, {}), 6).to_json()
        == rounded_field(field, 6).to_json()
    )


def test_a_goal_line_takes_ends_landmarks_edges_and_the_length_along():
    # up along it, its left is towards the middle: this is outwards
    taped = moved(goal_line_right=(-ASIDE, -ASIDE))
    assert (
        taped.lines["touch-line-top"].end
        == (4515.0, 3000.0)
        == taped.landmarks["corner-top-right"].position
    )
    assert taped.lines["centre-line"].end == (4515.0, 0.0)
    assert taped.lines["defence-right-top"].end == (4515.0, 1000.0)
    assert taped.landmarks["goal-right-post-top"].position == (4515.0, 500.0)
    assert taped.regions["full"].x_mm == (-4500.0, 4515.0) and taped.regions["half-left"].x_mm == (
        -4500.0,
        0.0,
    )
    assert (taped.length_mm, taped.width_mm) == (9015.0, 6000.0)
    assert taped.lines["goal-line-left"] == DIV_B.lines["goal-line-left"]
    assert field_from_json(taped.to_json()) == taped, (
        "what was taped a little outside is still a field"
    )


def test_a_line_that_lies_askew_meets_the_others_where_they_cross():
    taped = moved(touch_line_top=(0.0, 30.0))
    assert taped.lines["goal-line-right"].end == pytest.approx((4500.0, 3030.0))
    assert taped.landmarks["halfway-top"].position == pytest.approx((0.0, 3015.0))
    assert taped.regions["full"].y_mm == pytest.approx((-3000.0, 3015.0))  # along its middle


def test_landmarks_of_an_arc_stay_on_it_and_on_their_line():
    taped = moved(arcs={"centre-circle": (20.0, 3.0, 4.0)}, halfway_line=(-5.0, -5.0))
    circle = taped.arcs["centre-circle"]
    for name in ("circle-top", "circle-bottom", "circle-left", "circle-right"):
        place = np.array(taped.landmarks[name].position)
        assert np.linalg.norm(place - circle.centre) == pytest.approx(520.0, abs=1e-6), name
    assert taped.landmarks["circle-top"].position[0] == pytest.approx(5.0)  # the halfway line's
    assert taped.landmarks["circle-right"].position[1] == pytest.approx(0.0)  # the centre line's
    assert taped.landmarks["centre"].position == pytest.approx((5.0, 0.0))


def test_a_landmark_on_an_arc_alone_stays_at_its_angle():
    field = replace(DIV_B, landmarks={**DIV_B.landmarks, "spot": Landmark("spot", (300.0, 400.0))})
    taped = moved(field, arcs={"centre-circle": (20.0, 3.0, 4.0)})
    assert taped.landmarks["spot"].position == pytest.approx((3.0 + 312.0, 4.0 + 416.0))


def test_an_end_on_nothing_goes_with_its_own_line_alone():
    line = replace(
        DIV_B.lines["centre-line"], name="free", start=(-1000.0, -2000.0), end=(1000.0, -2100.0)
    )
    field = replace(DIV_B, lines={**DIV_B.lines, "free": line})
    taped = JoinedField(field).moved({"free": (10.0, 10.0)}, {})
    assert np.allclose(
        np.subtract(taped.lines["free"].start, line.start), 10 * line.normals(np.array(line.start))
    )
    assert {name: one for name, one in taped.lines.items() if name != "free"} == DIV_B.lines
