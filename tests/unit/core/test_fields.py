"""Every field is closed, symmetric and whole, and only fields can be read."""

import json
from copy import deepcopy

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.paths import SHARED_DATA
from tests.support.tiers import rounds
from touchline.core.errors import BadInput, NotFound
from touchline.core.field import BORDERS, Arc, Field
from touchline.core.field_json import field_from_json
from touchline.core.strict_yaml import plain_from_yaml
from touchline.store.fields import load_field, load_fields

FIELDS = load_fields()
every_field = pytest.mark.parametrize("field", FIELDS.values(), ids=FIELDS)
PUBLISHED = SHARED_DATA / "fields" / "models_mm"
SAME_MM = 1e-6
SMALL = {
    "name": "small",
    "length_mm": 4000,
    "width_mm": 3000,
    "regions": {"full": {"x": [-2000, 2000], "y": [-1500, 1500]}},
}


def half_turn(name: str) -> str:
    """What a marking is called after the field turned by 180°."""
    swap = {"left": "right", "right": "left", "top": "bottom", "bottom": "top"}
    return "-".join(swap.get(word, word) for word in name.split("-"))


def distance(feature, spot) -> float:
    """From a spot to a marking with its ends, mm."""
    return float(np.linalg.norm(feature.sample(4001) - np.asarray(spot), axis=1).min())


def test_the_six_fields_are_there():
    assert list(FIELDS) == ["ssl-2008", "ssl-div-a", "ssl-div-b", "table", "vsss-3v3", "vsss-5v5"]


@every_field
def test_hats_are_where_the_leagues_robots_end(field: Field):
    assert field.hat_height_mm == field.extras["robot"]["height_mm"]
    assert field.hat_height_mm == (150 if field.name.startswith("ssl") else 75)
    assert field_from_json(field.to_json()).hat_height_mm == field.hat_height_mm


def test_a_field_that_says_no_hat_height_has_that_of_the_largest_league():
    assert field_from_json(SMALL).hat_height_mm == 150
    assert field_from_json({**SMALL, "hat_height_mm": 80}).hat_height_mm == 80
    for wrong in (0, -1, 2001, "80", None, True, float("nan")):
        with pytest.raises(BadInput, match="hat_height_mm"):
            field_from_json({**SMALL, "hat_height_mm": wrong})


@every_field
def test_the_border_of_the_field_is_closed(field: Field):
    ring = ["touch-line-top", "goal-line-right", "touch-line-bottom", "goal-line-left"]
    ends = [end for name in ring for end in (field.lines[name].start, field.lines[name].end)]
    corners = {
        (sx * field.length_mm / 2, sy * field.width_mm / 2) for sx in (-1, 1) for sy in (-1, 1)
    }
    assert {end: ends.count(end) for end in ends} == dict.fromkeys(corners, 2)


@every_field
def test_every_line_ends_on_another_line_or_arc(field: Field):
    for line in field.lines.values():
        others = [m for m in (*field.lines.values(), *field.arcs.values()) if m is not line]
        for end in (line.start, line.end):
            assert min(distance(other, end) for other in others) < 1.0, (
                f"{line.name} ends in the open at {end}"
            )


@every_field
def test_an_open_arc_ends_on_a_line(field: Field):
    for arc in field.arcs.values():
        if arc.end_deg - arc.start_deg < 360:
            for end in arc.sample(2):
                gap = min(np.linalg.norm(line.nearest(end) - end) for line in field.lines.values())
                assert gap < SAME_MM, f"{arc.name} ends {gap} mm off every line"


@every_field
def test_a_half_turn_leaves_the_field_as_it_is(field: Field):
    for name, line in field.lines.items():
        twin = field.lines[half_turn(name)]
        assert {line.start, line.end} == {(-x + 0.0, -y + 0.0) for x, y in (twin.start, twin.end)}
    for name, arc in field.arcs.items():
        twin = field.arcs[half_turn(name)]
        for mine, turned in ((arc, -twin.sample(361)), (twin, -arc.sample(361))):
            gaps = np.linalg.norm(mine.sample(361)[:, None] - turned, axis=-1)
            assert gaps.min(axis=1).max() < SAME_MM, name
    for name, mark in field.landmarks.items():
        assert mark.position == tuple(-v + 0.0 for v in field.landmarks[half_turn(name)].position)


@every_field
def test_every_landmark_can_be_seen(field: Field):
    """It is painted, or two markings cross there, or a post or a wall meets one."""
    painted = {mark["at"] for mark in field.extras.get("marks", [])} | {"centre"}
    for name, mark in field.landmarks.items():
        near = [
            m.name
            for m in (*field.lines.values(), *field.arcs.values())
            if distance(m, mark.position) < 2.0
        ]
        wanted = 0 if name in painted else 1 if "post" in name or "cut" in name else 2
        assert len(near) >= wanted, f"{name} lies only on {near}"


@every_field
def test_every_region_is_inside_the_field_and_its_borders_meet(field: Field):
    assert {"full", "half-left", "half-right", "half"} <= set(field.regions)
    for region in field.regions.values():
        assert max(np.abs(region.x_mm)) <= field.length_mm / 2
        assert max(np.abs(region.y_mm)) <= field.width_mm / 2
        left, right, top, bottom = (region.border(name) for name in BORDERS)
        assert (left.start, right.start, left.end, right.end) == (
            top.start,
            top.end,
            bottom.start,
            bottom.end,
        )


@every_field
@pytest.mark.parametrize(
    "parts",
    [
        ["half-left", "half-right"],
        [f"quarter-{tb}-{lr}" for lr in ("left", "right") for tb in ("bottom", "top")],
        [f"eighth-{i}" for i in range(8)],
    ],
    ids=len,
)
def test_the_cameras_regions_tile_the_field(field: Field, parts):
    regions = [field.regions[name] for name in parts]
    assert sum(r.width_mm * r.height_mm for r in regions) == pytest.approx(
        field.length_mm * field.width_mm
    )
    for i, region in enumerate(regions):  # ids run along x, the lower row first
        assert (np.mean(region.y_mm) < 0) == (i % 2 == 0) or len(parts) == 2
    assert [np.mean(r.x_mm) for r in regions] == sorted(np.mean(r.x_mm) for r in regions)


@every_field
def test_the_half_stands_with_its_goal_line_on_top(field: Field):
    half = field.regions["half"]
    top = half.border("top")
    assert {top.start[0], top.end[0]} == {field.length_mm / 2}
    assert half.border("left").start[1] == field.width_mm / 2


@every_field
def test_the_api_form_reads_back_as_the_same_field(field: Field):
    assert field_from_json(json.loads(json.dumps(field.to_json()))) == field


@every_field
def test_a_region_may_be_given_as_its_four_borders_alone(field: Field):
    form = field.to_json()
    for region in form["regions"].values():
        for key in ("x", "y", "rotate", "width_mm", "height_mm"):
            del region[key]
        region["left"] = {"from": region["left"]["to"], "to": region["left"]["from"]}
    assert field_from_json(form) == field


@pytest.mark.skipif(
    not PUBLISHED.is_dir(), reason="the published field models are not beside the project"
)
@pytest.mark.parametrize(
    ("name", "file"),
    [
        ("ssl-div-a", "ssl_divA_2026"),
        ("ssl-div-b", "ssl_divB_2026"),
        ("ssl-2008", "ssl_2008_6050x4050"),
        ("vsss-3v3", "vsss_3v3_1500x1300"),
        ("vsss-5v5", "vsss_5v5_2200x1800"),
    ],
)
def test_the_markings_are_the_published_ones(name, file):
    field, published = FIELDS[name], json.loads((PUBLISHED / f"{file}.json").read_text())
    ours = sorted([*sorted([line.start, line.end]), line.width_mm] for line in field.lines.values())
    theirs = sorted(
        [*sorted([tuple(v["p1"]), tuple(v["p2"])]), v["thickness"]]
        for v in published["lines"].values()
    )
    assert ours == theirs
    theirs = [
        Arc(n, tuple(v["center"]), v["radius"], np.degrees(v["a1"]), np.degrees(v["a2"]))
        for n, v in published["arcs"].items()
    ]
    assert len(theirs) == len(field.arcs)
    for arc in theirs:
        assert any(
            np.allclose(arc.sample(50), own.sample(50), atol=1e-5) for own in field.arcs.values()
        ), arc.name
    spots = {mark.position for mark in field.landmarks.values()}
    assert {
        tuple(p) for p in published.get("penalty_marks", []) + published.get("crosses", [])
    } <= spots


def with_change(path: str, value) -> dict:
    """The ssl-2008 field as JSON, with one entry changed."""
    form = json.loads(json.dumps(FIELDS["ssl-2008"].to_json()))
    *parents, last = [int(p) if p.isdigit() else p for p in path.split("/")]
    at = form
    for key in parents:
        at = at[key]
    at[last] = value
    return form


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("length_mm", float("nan")),
        ("length_mm", 0),
        ("length_mm", 1e308),
        ("length_mm", True),
        ("length_mm", "6050"),
        ("width_mm", 10**400),
        ("name", "../etc/passwd"),
        ("name", "Übung"),
        ("name", "a" * 65),
        ("name", "con fig"),
        ("title", "two\nlines"),
        ("title", "\ud800"),
        ("colour", "red"),
        ("lines", {}),
        ("lines/0/from", [0]),
        ("lines/0/from", [0, float("inf")]),
        ("lines/0/to", [-3025, 2025]),
        ("lines/0/width_mm", 0),
        ("lines/0/name", "goal-line-left"),
        ("lines/0/name", "left"),
        ("lines/0/name", "centre-circle"),
        ("lines/0/z", 3),
        ("lines", [None]),
        ("arcs/0/radius_mm", -1),
        ("arcs/0/end_deg", 1000),
        ("arcs/1/end_deg", -90),
        ("landmarks/centre", [9e9, 0]),
        ("landmarks/A B", [0, 0]),
        ("landmarks", []),
        ("landmarks", {f"l{i}": [0, 0] for i in range(501)}),
        ("regions", {}),
        ("regions/full/x", [0, 0]),
        ("regions/full/x", [3025, -3025]),
        ("regions/full/x", [-4000, 4000]),
        ("regions/full/rotate", 45),
        ("regions/full/rotate", []),
        ("regions/full", {"x": [0, 100]}),
        ("regions/full/name", "half"),
        ("regions/full/left", {"from": [0, 0], "to": [0, 100]}),
        ("extras/goal", {"width_mm": 1}),
        ("extras/wind", 3),
        ("extras/carpet", "blue"),
        ("extras/marks/0/at", "nowhere"),
        ("extras/ball", {"radius_mm": []}),
    ],
)
def test_what_is_no_field_is_refused_with_a_reason_and_a_fix(path, value):
    with pytest.raises(BadInput) as refused:
        field_from_json(with_change(path, value))
    assert (
        refused.value.reason == "bad-field" and refused.value.fix and len(str(refused.value)) < 1000
    )


plain = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3)
    ),
)


@rounds("examples", 25, 150)
def test_any_other_data_is_a_field_or_a_refusal(examples):
    @settings(max_examples=examples, deadline=None)
    @given(
        path=st.sampled_from(
            [
                "name",
                "length_mm",
                "lines",
                "lines/0",
                "lines/0/from",
                "arcs/0",
                "arcs/0/centre",
                "landmarks",
                "regions",
                "regions/full",
                "regions/full/x",
                "regions/half/left",
                "extras",
                "extras/marks",
                "extras/goal",
            ]
        ),
        value=plain,
    )
    def field_or_refusal(path, value):
        try:
            assert isinstance(field_from_json(with_change(path, value)), Field)
        except BadInput as refused:
            assert refused.fix

    field_or_refusal()


def test_borders_that_disagree_with_the_rectangle_are_refused():
    form = deepcopy(FIELDS["table"].to_json())
    form["regions"]["half"]["rotate"] = 0
    with pytest.raises(BadInput, match="disagree"):
        field_from_json(form)


def test_four_borders_that_form_no_rectangle_are_refused():
    form = deepcopy(FIELDS["table"].to_json())
    full = {key: form["regions"]["full"][key] for key in BORDERS}
    full["left"]["from"] = [-1300, 700]
    form["regions"] = {"full": full}
    with pytest.raises(BadInput, match="do not form an upright rectangle"):
        field_from_json(form)


@pytest.mark.parametrize(
    "text",
    [
        b"a: &x [1]\nb: *x",
        b"a: !!python/object/apply:os.system [ls]",
        b"a: !!str 1",
        b"a: 1\na: 2",
        b"[" * 100_000,
        b"[" * 21 + b"]" * 21,
        b"\xff\xfe",
        b"a: \x00",
        b"{" * 5000,
        b"? [1, 2]\n: 3",
        b"a: " + b"9" * 10_000,
        b"a: 2001-99-99",
        b"a: [",
        b"x" * 300_000,
        b"a: 1\n---\nb: 2",
        "\ud800".encode("utf-8", "surrogatepass"),
    ],
    ids=lambda text: repr(text[:16]),
)
def test_yaml_beyond_plain_data_is_refused(text):
    with pytest.raises(BadInput) as refused:
        plain_from_yaml(text, "The text")
    assert refused.value.reason == "bad-yaml"


def test_a_field_file_is_named_as_its_field(tmp_path):
    path = tmp_path / "other.yaml"
    path.write_text(json.dumps(SMALL))
    with pytest.raises(BadInput, match="small"):
        load_field(path)
    path = path.rename(tmp_path / "small.yaml")
    assert load_fields(tmp_path) == {"small": field_from_json(SMALL)}


def test_a_missing_folder_or_file_says_so(tmp_path):
    with pytest.raises(NotFound):
        load_fields(tmp_path / "none")
    with pytest.raises(NotFound):
        load_field(tmp_path / "none.yaml")


def test_markings_along_the_regions_borders_are_named_as_borders():
    field = load_fields()["ssl-2008"]
    half = field.region("half")
    assert field.observed_name("goal-line-right", half) == "top"
    assert field.observed_name("halfway-line", half) == "bottom"
    assert field.observed_name("goal-line-left", half) == "goal-line-left"
    assert field.observed_name("centre-circle", half) == "centre-circle"


@pytest.mark.parametrize("name", ["full", "half"])
def test_lines_lie_where_a_fit_found_them_whichever_way_their_border_runs(name):
    field = load_fields()["ssl-2008"]
    region = field.region(name)
    offsets = {"left": 3.0, "right": -4.0, "top": 5.0, "bottom": 6.0, "centre-circle": 2.0}
    painted = field.as_painted(
        {"line_offsets_mm": offsets, "arc_offsets_mm": {"centre-circle": (3.0, -1.0)}}, region
    )
    found = {marking.name: marking for marking in painted.markings}
    along = [line for line in field.lines if field.observed_name(line, region) != line]
    assert len(along) == 4
    for line in along:
        border = painted.feature(field.observed_name(line, region), region)
        middle = np.asarray(border.sample(3)[1])
        assert found[line].nearest(middle) == pytest.approx(middle, abs=1e-9)
        assert painted.feature(line, region).nearest(middle) == pytest.approx(middle, abs=1e-9)
        assert np.linalg.norm(field.lines[line].nearest(middle) - middle) == pytest.approx(
            abs(offsets[field.observed_name(line, region)])
        )
    circle = field.arcs["centre-circle"]
    assert found["centre-circle"].radius_mm == circle.radius_mm + 2.0
    assert found["centre-circle"].centre == (circle.centre[0] + 3.0, circle.centre[1] - 1.0)
    assert painted.feature("centre-circle", region) == found["centre-circle"]
    assert field.as_painted({}, region).markings == field.markings  # a model that knows of none
    assert painted.lines == field.lines  # the rules' field, as it is published
