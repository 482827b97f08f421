"""Fields as the league's programs send them: which of ours they are, and under which names ours are sent."""

import math
import random
from dataclasses import replace

import pytest

from tests.support.league_geometry import PROGRAMS, SIZES, lines_of, packet_of
from touchline.core.field_json import field_from_json
from touchline.formats.ssl_field import (
    field_from_wire,
    field_to_wire,
    known_field,
    markings_alone,
    names_are_the_leagues,
)
from touchline.ssl_protocol.protobuf import decode
from touchline.ssl_protocol.ssl_vision_pb2 import SSL_GeometryFieldSize, SSL_WrapperPacket
from touchline.store.fields import load_fields

FIELDS = load_fields()
BOTH = [(program, division) for program in PROGRAMS for division in SIZES]
FORMER = {
    "RightFieldLeftPenaltyStretch": "RightFieldRightPenaltyStretch",
    # how older Touchlines named them
    "RightFieldRightPenaltyStretch": "RightFieldLeftPenaltyStretch",
}


def sent(program: str, division: str, **changes) -> SSL_GeometryFieldSize:
    return decode(
        SSL_WrapperPacket, packet_of(program, division, **changes).SerializeToString()
    ).geometry.field


def middles(lines) -> dict[str, tuple[float, float]]:
    return {name: ((x0 + x1) / 2, (y0 + y1) / 2) for name, x0, y0, x1, y1 in lines}


@pytest.mark.parametrize(("program", "division"), BOTH)
def test_a_field_of_either_program_is_recognised(program, division):
    assert field_from_wire(sent(program, division), FIELDS.values()) is FIELDS[division]


@pytest.mark.parametrize(("program", "division"), BOTH)
def test_it_has_the_sizes_of_the_field_that_it_is_recognised_as(program, division):
    theirs, ours = sent(program, division), field_to_wire(FIELDS[division])
    for name in (
        *("field_length", "field_width", "goal_width", "goal_depth", "line_thickness"),
        *("penalty_area_depth", "penalty_area_width", "goal_center_to_penalty_mark"),
        *("center_circle_radius", "boundary_width", "ball_radius", "max_robot_radius"),
    ):
        assert getattr(theirs, name) == getattr(ours, name), name
    assert {line.thickness for line in (*ours.field_lines, *ours.field_arcs)} == {10}
    older = sent(program, division, is_older=True)
    assert not older.HasField("penalty_area_depth") and theirs.HasField("penalty_area_depth")
    assert field_from_wire(older, FIELDS.values()) is FIELDS[division]


@pytest.mark.parametrize(("program", "division"), BOTH)
def test_ours_are_sent_under_the_names_that_the_programs_give_them(program, division):
    ours = field_to_wire(FIELDS[division])
    found = middles(
        (line.name, line.p1.x, line.p1.y, line.p2.x, line.p2.y) for line in ours.field_lines
    )
    assert found == middles(lines_of(program, division))
    assert all(line.type for line in ours.field_lines) and names_are_the_leagues(ours)
    assert (
        markings_alone(ours, sent(program, division))
        == markings_alone(sent(program, division), ours)
        == []
    )


@pytest.mark.parametrize(("program", "division"), BOTH)
def test_names_order_widths_and_noise_do_not_matter(program, division):
    field = sent(program, division)
    lines = [*field.field_lines]
    random.Random(3).shuffle(lines)
    for number, line in enumerate(lines):
        line.name, line.thickness = f"line {number}", 25.0
        line.ClearField("type")
        line.p1.x, line.p2.y = line.p1.x + 0.2, line.p2.y - 0.2
    del field.field_lines[:]
    field.field_lines.extend(lines)
    field.goal_depth, field.boundary_width, field.line_thickness = 200, 700, 25
    field.field_arcs[0].a1, field.field_arcs[0].a2 = -math.pi, 3.14159
    assert field_from_wire(field, FIELDS.values()) is FIELDS[division]


@pytest.mark.parametrize("division", SIZES)
def test_lines_that_a_hall_has_not_painted_may_be_missing(division):
    some = tuple(
        name
        for name, *_ in lines_of("vision-processor", division)
        if "Penalty" in name or "Center" in name
    )
    assert (
        known_field(sent("vision-processor", division, without=some), FIELDS.values())
        is FIELDS[division]
    )


def test_of_several_fields_of_one_size_the_one_with_most_in_common_counts():
    whole = FIELDS["ssl-div-b"]
    bare = replace(
        whole,
        name="bare",
        arcs={},
        lines={n: m for n, m in whole.lines.items() if "defence" not in n},
    )
    heard = sent("ssl-vision", "ssl-div-b")
    assert known_field(heard, (bare, whole)) is known_field(heard, (whole, bare)) is whole
    wide = replace(
        whole,
        name="wide",
        extras={**whole.extras, "goal": {"width_mm": 1200, "depth_mm": 180, "height_mm": 160}},
    )
    assert known_field(heard, (wide, whole)) is whole


@pytest.mark.parametrize("moved", range(12))
def test_a_field_with_a_line_elsewhere_is_another(moved):
    field = sent("ssl-vision", "ssl-div-b")
    line = field.field_lines[moved]
    across = "y" if line.p1.y == line.p2.y else "x"
    for end in (line.p1, line.p2):
        setattr(end, across, getattr(end, across) + 20)
    found = field_from_wire(field, FIELDS.values())
    assert found.name == "ssl-9000x6000" and known_field(field, FIELDS.values()) is None
    assert markings_alone(field, field_to_wire(FIELDS["ssl-div-b"])) == [line.name]


def test_another_circle_is_another_field():
    field = sent("ssl-vision", "ssl-div-b")
    field.field_arcs[0].radius = 600
    assert known_field(field, FIELDS.values()) is None
    field.field_arcs[0].radius, field.field_arcs[0].a2 = 500, math.pi
    assert known_field(field, FIELDS.values()) is None


@pytest.mark.parametrize("division", SIZES)
def test_what_an_older_touchline_sends_is_recognised_and_named_by_where_it_lies(division):
    field = field_to_wire(FIELDS[division])
    for line in field.field_lines:
        line.name = FORMER.get(line.name, line.name)
    assert field_from_wire(field, FIELDS.values()) is FIELDS[
        division
    ] and not names_are_the_leagues(field)
    found = field_from_wire(field)  # as where the field is not known
    for name, line in FIELDS[division].lines.items():
        assert sorted([found.lines[name].start, found.lines[name].end]) == sorted(
            [line.start, line.end]
        ), name


def test_a_message_with_one_boundary_width_has_it_behind_the_goals_too():
    field = sent(*BOTH[0])
    field.boundary_width = 250
    field.ClearField("boundary_width_goal_line")
    assert field_from_wire(field).extras["boundary"] == {"touch_mm": 250, "goal_mm": 250}


@pytest.mark.parametrize(("program", "division"), BOTH)
def test_a_field_that_is_made_of_a_message_is_the_same_again(program, division):
    made = field_from_wire(sent(program, division))
    assert field_from_json(made.to_json()) == made
    assert known_field(field_to_wire(made), FIELDS.values()) is FIELDS[division]
