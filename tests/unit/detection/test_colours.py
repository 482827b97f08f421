"""Colours from clicks, boxes and the picture alone: what the lookup table says, and what it does not say."""

from itertools import pairwise

import numpy as np
import pytest

from tests.support.sim_truth import truth_at
from tests.support.tiers import rounds
from tests.support.watched_field import colour_clicks, world
from touchline.core.errors import TouchlineError
from touchline.detection.colours import (
    CODES,
    automatic_profile,
    cells,
    colour_health,
    in_light,
    learn_profile,
    mean_light,
    sample_at,
    table_of,
)
from touchline.detection.profile import NAMES, ColourProfile, ColourSample
from touchline.detection.stages import StageContext, StagePipeline
from touchline.detection.store import load_plans

LEAGUE = ColourProfile(
    "league",
    {name: (ColourSample(NAMES[name]),) for name in ("orange", "yellow", "blue", "pink")},
    (
        ColourSample((44.0, 112.0, 60.0)),
        ColourSample((20.0, 20.0, 20.0)),
        ColourSample((226.0, 236.0, 232.0)),
    ),
)


def code(bgr):
    b, g, r = (int(v) for v in bgr)
    return b >> 3 | g >> 2 << 5 | r >> 3 << 11


def named(table, names, bgr):
    number = table[code(np.clip(bgr, 0, 255))]
    return names[number - 1] if number else None


@pytest.mark.parametrize("colour", LEAGUE.colours)
@pytest.mark.parametrize("light", [0.6, 0.8, 1.0, 1.2, 1.4])
def test_a_colour_keeps_its_name_in_shade_and_in_glare(colour, light):
    table, names = table_of(LEAGUE)
    assert named(table, names, light * np.array(NAMES[colour])) == colour


def test_the_background_and_what_nobody_clicked_have_no_name():
    table, names = table_of(LEAGUE)
    for grey in (0, 20, 60, 128, 200, 255):
        assert named(table, names, (grey,) * 3) is None
    assert (
        named(table, names, (44, 112, 60)) is None and named(table, names, (92, 232, 110)) is None
    )


def test_what_is_out_of_reach_has_no_name():
    """Turquoise is nearest to blue, and none."""
    near, far = (table_of(ColourProfile("x", LEAGUE.colours, reach=reach)) for reach in (3.0, 9.0))
    assert named(*near, (200, 190, 40)) is None and named(*far, (200, 190, 40)) == "blue"


def test_between_two_colours_there_is_a_margin():
    """A wider margin leaves more unnamed, and never gives a pixel to another colour."""
    tables = [
        table_of(ColourProfile("x", LEAGUE.colours, LEAGUE.background, margin=m))[0]
        for m in (0.0, 0.7, 2.0)
    ]
    for wide, narrow in pairwise(tables):
        assert (narrow[narrow > 0] == wide[narrow > 0]).all() and (narrow > 0).sum() < (
            wide > 0
        ).sum()


def test_a_table_for_other_light_names_what_the_first_named_before_it_changed():
    table, names = table_of(LEAGUE)
    assert len(table) == CODES and (in_light(table, (1.0, 1.0, 1.0)) == table).all()
    warm = in_light(table, (0.5, 0.8, 1.0))
    for colour, bgr in NAMES.items():
        if colour in LEAGUE.colours:
            assert named(warm, names, np.array(bgr) * (0.5, 0.8, 1.0)) == colour
    assert [code(c) for c in cells()[::977]] == list(range(CODES))[::977]


def test_a_click_takes_the_patch_and_not_what_is_beside_it():
    pixels = np.full((60, 60, 3), (40, 100, 50), np.uint8)
    pixels[20:30, 20:30] = (30, 112, 250)
    pixels = np.clip(pixels + np.random.default_rng(0).normal(0, 4, pixels.shape), 0, 255).astype(
        np.uint8
    )
    for place in ((21, 28), (25, 25), (20, 20), (22, 22, 27, 27)):
        np.testing.assert_allclose(sample_at(pixels, place).bgr, (30, 112, 250), atol=6)


@pytest.mark.parametrize("place", [(-3, 5), (5, 60), (70, 70, 80, 80)])
def test_a_click_outside_the_picture_is_refused(place):
    with pytest.raises(TouchlineError, match="outside the image"):
        sample_at(np.zeros((60, 60, 3), np.uint8), place)


def test_clicks_add_to_a_profile_that_is_there():
    pixels = np.full((60, 60, 3), (40, 100, 50), np.uint8)
    pixels[20:30, 20:30] = (30, 112, 250)
    more = learn_profile("here", [(pixels, {"orange": [(25, 25)]})], LEAGUE)
    assert len(more.colours["orange"]) == 2 and more.colours["blue"] == LEAGUE.colours["blue"]
    with pytest.raises(TouchlineError, match="Unknown colour"):
        learn_profile("here", [(pixels, {"mauve": [(25, 25)]})])
    with pytest.raises(TouchlineError, match="There are no colour samples"):
        learn_profile("here", [(pixels, {})])


def test_light_is_measured_without_what_is_burnt_out():
    pixels = np.full((100, 100, 3), (40, 100, 60), np.uint8)
    pixels[:10] = 255
    np.testing.assert_allclose(mean_light(pixels), (40, 100, 60), atol=0.5)
    np.testing.assert_allclose(mean_light(pixels // 2), (20, 50, 30), atol=0.5)


@rounds("count", 2, 4)
def test_without_a_click_colours_are_found_in_the_picture(count):
    """Robots are found nearly as well as with clicks, in a picture that is bluer than the leagues' colours."""
    from tests.support.watched_field import exact_view

    match = world(drift=0.0, noise=3.0)
    tint = np.array([1.1, 0.95, 0.8])
    frames = [
        np.clip(match.frame_at(i, 2.0 * i) * tint, 0, 255).astype(np.uint8) for i in range(count)
    ]
    profile = automatic_profile("found", frames[0])
    assert not profile.notes and profile.background
    sight = StagePipeline(
        load_plans()["ssl"],
        StageContext(match.camera.image_size, profile, exact_view(match.camera)),
    )
    for i, pixels in enumerate(frames):
        told = {(d.team, d.id) for d in sight.process(pixels).detections.of("robot")}
        true = {(r.team, r.number) for r in truth_at(match, 2.0 * i).robots}
        assert len(told & true) >= 15 and not told - true - {("yellow", None), ("blue", None)}


def test_a_colour_that_is_not_there_is_said():
    bare = world(robots=0, size=(640, 480), drift=0.0).frame_at(0, 0.0)
    profile = automatic_profile("found", bare, ("orange", "blue"))
    assert len(profile.notes) == 2 and "No orange" in profile.notes[0]


def test_health_says_which_colours_run_together():
    told = {h.colour: h for h in colour_health(LEAGUE)}
    assert told["blue"].level == "good" and "is well separated" in told["blue"].sentence
    close = ColourProfile(
        "x", {"orange": (ColourSample((30, 112, 250)),), "red": (ColourSample((34, 108, 246)),)}
    )
    assert {h.level for h in colour_health(close)} == {
        "mixed"
    } and "overlaps with" in colour_health(close)[0].sentence


def test_a_profile_survives_json():
    pixels = world(size=(960, 720), drift=0.0, noise=2.0)
    profile = learn_profile("hall 2", [(pixels.frame_at(0, 0.0), colour_clicks(pixels))])
    back = ColourProfile.from_json(profile.to_json())
    assert back.to_json() == profile.to_json() and set(back.colours) == set(profile.colours)
    # rounded to a tenth of a grey level
    assert (table_of(back)[0] == table_of(profile)[0]).mean() > 0.999


@pytest.mark.parametrize(
    "change",
    [
        {"name": ""},
        {"colours": {}},
        {"colours": {"mauve": [{"rgb": [1, 2, 3]}]}},
        {"colours": {"blue": []}},
        {"colours": {"blue": [{"rgb": [1, 2]}]}},
        {"colours": {"blue": [{"rgb": [1, 2, float("nan")]}]}},
        {"colours": {"blue": [{"rgb": [1, 2, 300]}]}},
        {"light": [1, 2]},
        {"reach": 0},
        {"margin": float("inf")},
        {"more": 1},
        {"colours": {"blue": [{"rgb": [1, 2, 3], "spread": -1}]}},
        {"background": 3},
    ],
)
def test_profiles_that_make_no_sense_are_refused(change):
    with pytest.raises(TouchlineError):
        ColourProfile.from_json({**LEAGUE.to_json(), **change})
