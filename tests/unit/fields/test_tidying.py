"""What was read from a picture becomes a field: alike on both halves, its lines meeting, under standard names."""

from dataclasses import replace

import pytest

from touchline.core.field import Arc, Line
from touchline.fields.proposal import bare_field
from touchline.fields.tidying import scaled, tidied

BARE = bare_field(1.5)  # 6000 × 4000
FRONT, TOP, BOTTOM = (
    ((2400, -800), (2400, 800)),
    ((2400, 800), (3000, 800)),
    ((2400, -800), (3000, -800)),
)


def seen(*ends, arcs=()):
    lines = {f"line-{k}": Line(f"line-{k}", *map(tuple, pair), 20.0) for k, pair in enumerate(ends)}
    return replace(BARE, lines={**BARE.lines, **lines}, arcs={arc.name: arc for arc in arcs})


def shifted(ends, by, sign=1):
    return tuple((sign * x + by, y + by) for x, y in ends)


def test_markings_and_their_mirror_images_are_averaged_and_named():
    other = [shifted(ends, 12, -1) for ends in (FRONT, TOP, BOTTOM)]
    field = tidied(
        seen(FRONT, TOP, BOTTOM, *other, ((8, -1990), (8, 1985)), ((-3000, 5), (2990, 5)))
    )
    assert {*field.lines} == {
        *BARE.lines,
        "halfway-line",
        "centre-line",
        *(
            f"goal-area-{side}-{part}"
            for side in ("left", "right")
            for part in ("front", "top", "bottom")
        ),
    }
    front, top = field.lines["goal-area-right-front"], field.lines["goal-area-right-top"]
    assert front.start[0] == pytest.approx(2394) and top.end == (3000, front.end[1])
    assert field.lines["halfway-line"].start == (0, -2000) and field.lines["centre-line"].end == (
        3000,
        0,
    )
    mirrored = field.lines["goal-area-left-front"]
    assert mirrored.start == (-front.start[0], front.start[1])


def test_what_one_half_shows_is_added_to_the_other_and_a_shadow_goes():
    field = tidied(seen(FRONT, TOP, BOTTOM, ((900, 300), (1400, 300)), ((0, 0), (900, 700))))
    assert "goal-area-left-top" in field.lines and len(field.lines) == len(BARE.lines) + 6


def test_a_piece_of_the_centre_circle_is_all_of_it_and_area_arcs_keep_their_ends():
    arcs = (Arc("circle-1", (10, -5), 500, 20, 200), Arc("circle-2", (2700, 0), 300, 120, 240))
    field = tidied(seen(arcs=arcs))
    circle, right, left = (
        field.arcs[name] for name in ("centre-circle", "goal-area-right-arc", "goal-area-left-arc")
    )
    assert (circle.centre, circle.radius_mm, circle.end_deg - circle.start_deg) == (
        (0, 0),
        500,
        360,
    )
    assert (right.start_deg, right.end_deg) == pytest.approx((120, 240))
    assert left.end_deg - left.start_deg == pytest.approx(120) and left.centre == (-2700, 0)
    assert left.sample(3)[1] == pytest.approx((-2400, 0))


def test_what_stands_around_the_outermost_lines_is_no_part_of_the_field():
    inner = [((-2700, 1700 * s), (2700, 1700 * s)) for s in (1, -1)] + [
        ((2700 * s, -1700), (2700 * s, 1700)) for s in (1, -1)
    ]
    posts = [((2700 * s, 400), (3000 * s, 400)) for s in (1, -1)] + [
        ((2700 * s, -400), (3000 * s, -400))
        # of goals in the wall
        for s in (1, -1)
    ]
    field = tidied(
        seen(*inner, *posts, ((0, -1700), (0, 1700)), arcs=(Arc("circle-1", (0, 0), 400),))
    )
    assert (field.length_mm, field.width_mm) == (5400, 3400)
    assert {*field.lines} == {*BARE.lines, "halfway-line"} and all(
        m.length_mm > 0 for m in field.lines.values()
    )


def test_a_line_inside_the_field_is_no_frame():
    inner = [((-2700, 1700 * s), (2700, 1700 * s)) for s in (1, -1)] + [
        ((2700 * s, -1700), (2700 * s, 1700)) for s in (1, -1)
    ]
    field = tidied(seen(*inner, *(((-200, 1900 * s), (200, 1900 * s)) for s in (1, -1))))
    assert (field.length_mm, field.width_mm) == (6000, 4000)  # something is painted between the two


def test_scaled_to_whole_millimetres_it_is_still_alike_on_both_sides():
    field = scaled(tidied(seen(FRONT, TOP, BOTTOM, arcs=(Arc("circle-1", (0, 0), 500),))), 0.2503)
    assert (field.length_mm, field.width_mm, field.arcs["centre-circle"].radius_mm) == (
        1502,
        1002,
        125,
    )
    right, left = field.lines["goal-area-right-front"], field.lines["goal-area-left-front"]
    assert right.start[0] == -left.start[0] == 601 and field.regions["half-left"].x_mm == (-751, 0)
    assert right.width_mm == 5
