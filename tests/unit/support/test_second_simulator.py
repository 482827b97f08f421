"""The second simulator is as true as what is measured on it: projection, rendering, paint, repeatability."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

from tests.support.second_simulator import render, scene_spec
from tests.support.second_simulator.lenses import REAL_LENSES
from tests.support.second_simulator.paint import PaintErrors, painted
from tests.support.second_simulator.scene_spec import Optics, Sensor, Things, camera_of, fields
from tests.support.tiers import rounds
from touchline.core.field import Arc

SMALL = {"size": (160, 120)}
CLEAN = {
    "optics": Optics(0.6),
    "sensor": Sensor(0.0),
    "things": Things(),
    "paint": PaintErrors(width_mm=25.0),
}


@pytest.fixture(scope="module")
def drawn():
    return scene_spec(3)


@pytest.mark.parametrize("lens", [lens.name for lens in REAL_LENSES])
def test_a_pixel_leads_back_to_the_place_that_it_shows(drawn, lens):
    spec = replace(drawn, lens=lens, field="ssl-div-b", region="full", tilt_deg=20.0)
    camera = camera_of(spec)
    pixels = np.random.default_rng(0).uniform(0, 1, (200, 2)) * (np.array(spec.size) - 1)
    places = camera.carpet_from_pixel(pixels)
    seen = np.isfinite(places).all(axis=1)
    assert seen.mean() > 0.5
    again = camera.project(np.column_stack([places[seen], np.zeros(seen.sum())]))
    assert np.abs(again - pixels[seen]).max() < 1e-3


@rounds("seeds", {1: {"size": (780, 580)}}, {1: {}, 2: {}})
def test_lines_are_drawn_where_the_camera_sees_them(seeds):
    """The brightness's centre of gravity across a line, against the projection of its middle."""
    for seed, smaller in seeds.items():
        scene = render(
            scene_spec(
                seed,
                field="ssl-div-b",
                region="full",
                tilt_deg=15.0,
                mirrored=False,
                **smaller,
                **CLEAN,
            )
        )
        gray = scene.pixels[..., 1].astype(float)
        off = []
        for line in scene.paint.markings[:6]:
            start, end = np.array(line.start), np.array(line.end)
            for t in np.linspace(0.07, 0.93, 40):
                place = start + t * (end - start)
                along = (end - start) / np.linalg.norm(end - start)
                pixel, ahead = scene.camera.project(
                    np.array([[*place, 0.0], [*(place + 30 * along), 0.0]])
                )
                if not scene.camera.inside(pixel, 14):
                    continue
                tangent = (ahead - pixel) / np.linalg.norm(ahead - pixel)
                across = np.arange(-9, 9.01, 0.25)
                at = (pixel + across[:, None] * np.array([-tangent[1], tangent[0]])).astype(
                    np.float32
                )
                row = cv2.remap(gray, at[:, 0], at[:, 1], cv2.INTER_LINEAR).ravel()
                row = np.clip(row - np.percentile(row, 40) - 12, 0, None)
                if row.sum() > 50:
                    off.append((row * across).sum() / row.sum())
        assert len(off) > 60
        assert abs(np.median(off)) < 0.03
        assert np.percentile(np.abs(off), 80) < 0.15  # other paint comes near some


def test_a_scene_is_the_same_for_the_same_seed_and_has_its_truth_as_json():
    spec = scene_spec(2, **SMALL)
    one, other = render(spec), render(scene_spec(2, **SMALL))
    assert np.array_equal(one.pixels, other.pixels)
    truth = json.loads(json.dumps(one.truth()))
    assert truth["camera"]["position_mm"][2] == pytest.approx(spec.height_mm)
    assert scene_spec(3) != spec


def test_a_mirrored_picture_is_the_same_picture_turned_over():
    spec = scene_spec(4, **SMALL)
    plain, mirrored = render(spec), render(replace(spec, mirrored=True))
    assert np.array_equal(plain.pixels[:, ::-1], mirrored.pixels)
    place = np.array([[10.0, 20.0, 0.0]])
    assert mirrored.camera.project(place)[0, 0] == pytest.approx(
        spec.size[0] - 1 - plain.camera.project(place)[0, 0]
    )


def test_paint_lies_beside_its_place_by_what_the_truth_says():
    field = fields()["ssl-div-b"]
    paint = painted(field, PaintErrors(3.0, 10.0), np.random.default_rng(5))
    offsets = np.array(
        [
            *(paint.offsets_mm[name] for name in (*field.lines, *field.arcs)),
            *(np.linalg.norm(aside) for aside in paint.centres_mm.values()),
        ]
    )
    assert 6 < np.abs(offsets).max() < 22
    circle = next(marking for marking in paint.markings if isinstance(marking, Arc))
    aside = np.subtract(circle.centre, field.arcs[circle.name].centre)
    assert aside == pytest.approx(paint.centres_mm[circle.name]) and np.abs(aside).min() > 0.01
    moved = paint.markings[0]
    true = field.lines[moved.name].nearest(np.array([moved.start]))
    assert np.linalg.norm(true - moved.start) == pytest.approx(abs(paint.offsets_mm[moved.name]))


@pytest.mark.long
def test_seeds_show_all_kinds_of_scenes():
    seeds = 60
    specs = [scene_spec(seed) for seed in range(seeds)]
    assert {s.field for s in specs} == set(fields())
    assert {s.region.split("-")[0] for s in specs} >= {"full", "half", "quarter"}
    assert len({s.lens for s in specs}) >= len(REAL_LENSES) - 4
    assert max(s.tilt_deg for s in specs) > 28
    assert (
        sum(s.sensor.bayer for s in specs)
        > seeds // 3
        < sum(s.sensor.jpeg is not None for s in specs)
    )
