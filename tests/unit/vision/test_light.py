"""What is said about light and focus is what was rendered: known vignettes, blurs, burnt places and flickers."""

from functools import lru_cache

import cv2
import numpy as np
import pytest

from tests.support.tiers import rounds
from touchline.core.errors import BadInput
from touchline.sources import SourceContext, source_from_url
from touchline.sources.sim.render import Rendering
from touchline.store.fields import load_fields
from touchline.vision import flicker as flickering
from touchline.vision import light as lighting
from touchline.vision import sharpness as focus
from touchline.vision.flicker import measure_flicker, row_means
from touchline.vision.light import measure_light
from touchline.vision.sharpness import measure_sharpness
from touchline.vision.zones import MIDDLE, ZONES, field_mask, zone_names, zone_slices

FIELDS = load_fields()
BIG = "ssl-div-b?size=1280x720"
SMALL = "ssl-div-b?size=640x360"
seeds = rounds("seed", 1, 2, 3)


@lru_cache(maxsize=2)
def rendering(url: str) -> Rendering:
    return source_from_url(f"sim://{url}", SourceContext(FIELDS)).rendering


def picture(url: str) -> np.ndarray:
    return rendering(url).frame(0).copy()


def texts(said: list[dict[str, str]]) -> str:
    assert all(set(s) == {"text", "fix", "severity", "statements"} for s in said)
    assert all(s["severity"] in ("warning", "note") for s in said)
    assert all(s["text"].endswith(".") and s["fix"].endswith(".") for s in said)
    return " ".join(s["text"] for s in said)


def carpet_mask(url: str) -> np.ndarray:
    scene, field = rendering(url).scene, rendering(url).field
    return (np.abs(scene.x_mm) < field.length_mm / 2) & (np.abs(scene.y_mm) < field.width_mm / 2)


# Light


@seeds
@pytest.mark.parametrize("vignette", [0.0, 0.4, 0.9])
@pytest.mark.parametrize("known", [True, False], ids=["field known", "field unknown"])
def test_evenness_is_what_the_lamps_and_the_lens_make_of_the_carpet(seed, vignette, known):
    """Robots, people and lines do not count, nor does the floor beyond the carpet."""
    url = f"{SMALL}&robots=10&people=2&glare=0&grain=0&seed={seed}&vignette={vignette}"
    mask, shade = carpet_mask(url), rendering(url).scene.light
    true = [float(np.median(shade[z][mask[z]])) for z in zone_slices(*mask.shape)]
    light = measure_light(picture(url), mask if known else None)
    assert light.evenness == pytest.approx(min(true) / max(true), abs=0.04)
    seen = np.array(light.carpet) / light.carpet[MIDDLE]
    # With the field unknown, the carpet outside the lines counts, which is darker.
    np.testing.assert_allclose(seen, np.array(true) / true[MIDDLE], atol=0.04 if known else 0.09)


def test_a_dark_corner_is_called_by_its_name_and_by_how_much():
    pixels = picture(f"{SMALL}&vignette=0&glare=0").astype(float)
    pixels[:120, 427:] *= 0.55
    said = texts(lighting.advice(measure_light(pixels.astype(np.uint8))))
    # 45 %, with the lamps' own share
    assert "Top right" in said and "darker than the" in said and " 4" in said
    assert lighting.advice(measure_light(picture(f"{SMALL}&vignette=0&glare=0"))) == []


def test_a_black_carpet_is_no_dark_picture_and_a_dark_picture_is():
    assert "dark:" not in texts(lighting.advice(measure_light(picture("vsss-3v3?size=640x480"))))
    assert "Image dark" in texts(
        lighting.advice(measure_light(picture("vsss-3v3?size=640x480&light=0.3")))
    )


@seeds
def test_clipping_is_the_share_of_pixels_that_are_full_or_empty(seed):
    pixels = np.random.default_rng(seed).integers(40, 200, (360, 640, 3), np.uint8)
    pixels[:36, :64] = 255  # a hundredth
    pixels[324:, :128] = 1  # a fiftieth
    light = measure_light(pixels)
    assert light.clipped_high == pytest.approx(
        0.01, abs=1e-4
    ) and light.clipped_low == pytest.approx(0.02, abs=1e-4)
    assert light.burnt[0] == pytest.approx(0.09, abs=2e-3) and sum(light.burnt[1:]) == 0
    said = texts(lighting.advice(light))
    assert "overexposed at top left: 1.0 %" in said and "underexposed: 2.0 %" in said


def test_what_is_burnt_out_beside_the_field_does_not_count():
    pixels = picture(SMALL)
    pixels[:, :40] = 255
    inside = np.array([[60, 20], [620, 20], [620, 340], [60, 340]])
    assert (
        measure_light(pixels).clipped_high > 0.05
        and measure_light(pixels, inside).clipped_high == 0
    )
    # a field out of sight
    assert measure_light(pixels, np.zeros(pixels.shape[:2], bool)).clipped_high > 0.05


def test_too_much_light_is_burnt_where_the_lamp_is_mirrored():
    url = "ssl-2008?size=780x580&light=2.2&glare=0.6"
    light = measure_light(picture(url))
    full = picture(url).max(axis=2) >= 253
    assert light.clipped_high == pytest.approx(full.mean(), abs=1e-3) and light.clipped_high > 0.02
    assert "Image overexposed at" in texts(lighting.advice(light))


@pytest.mark.parametrize(
    "outline",
    [
        np.zeros((3, 4), bool),
        [[0, 0], [1, 1]],
        [[0, 0], [9, 9], [np.nan, 4]],
        [[0, 0], [9, 9], [1e300, 4]],
        np.zeros(5),
    ],
)
def test_an_outline_that_does_not_fit_is_refused(outline):
    with pytest.raises(BadInput) as refused:
        field_mask(np.asarray(outline), 36, 64)
    assert refused.value.reason == "bad-outline"


@pytest.mark.parametrize(
    ("zones", "known", "name"),
    [
        ((0, 3, 6), range(9), "left edge"),
        ((0, 2, 6, 8), range(9), "corners"),
        ((0,), range(9), "top left"),
        (range(9), range(9), "whole image"),
        ((0, 3), (0, 1, 3, 4), "left edge"),
        ((3, 7), range(9), "left, bottom"),
        ((2, 5, 6, 7, 8), range(9), "right edge, bottom edge"),
        ((0, 1, 2, 3, 5, 6, 7, 8), range(9), "rim"),
    ],
)
def test_zones_are_called_what_people_call_them(zones, known, name):
    assert ", ".join(zone_names(zones, known)) == name
    assert len(ZONES) == 9 and ZONES[MIDDLE] == "middle"


def test_light_and_focus_are_plain_json():
    import json

    pixels = picture(SMALL)
    for report in (
        measure_light(pixels).to_json(),
        measure_sharpness(pixels).to_json(),
        measure_flicker(*series(rendering(SMALL))),
    ):
        assert json.loads(json.dumps(report)) == report


# Focus


@seeds
@pytest.mark.parametrize("blur", [0.8, 1.5, 2.5])
def test_a_step_is_as_wide_as_its_blur_makes_it(seed, blur):
    """From a fifth to four fifths of a Gaussian's rise is 1.68 σ; a few per cent more for sampling between pixels."""
    rng = np.random.default_rng(seed)
    pixels = np.full((540, 960), 50, np.float32)
    for x in range(60, 900, 120):
        cv2.fillPoly(
            pixels, [np.int32([(x, -9), (x + 60, -9), (x + 60 + 30, 560), (x + 30, 560)])], 170
        )
    pixels = cv2.GaussianBlur(pixels, (0, 0), blur) + rng.normal(0, 2, pixels.shape)
    report = measure_sharpness(cv2.merge([np.clip(pixels, 0, 255).astype(np.uint8)] * 3))
    assert None not in report.width_px
    np.testing.assert_allclose(report.width_px, 1.683 * blur, rtol=0.15, atol=0.15)


@seeds
@pytest.mark.parametrize(
    ("part", "name", "zones"),
    [
        (np.s_[:, :427], "Left edge", (0, 3, 6)),
        (np.s_[:, 853:], "Right edge", (2, 5, 8)),
        (np.s_[:240, :427], "Top left", (0,)),
        (np.s_[240:480, 427:853], "Middle", (4,)),
    ],
)
def test_the_zone_that_was_blurred_is_the_one_called_soft(seed, part, name, zones):
    pixels = picture(f"{BIG}&robots=8&seed={seed}")
    assert focus.advice(measure_sharpness(pixels)) == []
    pixels[part] = cv2.GaussianBlur(pixels, (0, 0), 2.5)[part]
    report = measure_sharpness(pixels)
    said = focus.advice(report)
    assert len(said) == 1 and said[0]["text"].startswith(f"{name} soft"), said
    for i, width in enumerate(report.width_px):
        assert width is None or (width > 2.5) == (i in zones)


def test_only_the_field_counts_and_its_mask_may_be_a_reduced_one():
    pixels = picture(BIG)
    left = np.zeros((360, 640), bool)
    left[:, :213] = True
    whole, part = measure_sharpness(pixels), measure_sharpness(pixels, left)
    polygon = measure_sharpness(pixels, np.array([[0, 0], [425, 0], [425, 719], [0, 719]]))
    for i in range(9):
        assert (part.width_px[i] is None) == (i % 3 != 0)
        if i % 3 == 0:
            assert part.width_px[i] == pytest.approx(whole.width_px[i], abs=0.15)
            assert polygon.width_px[i] == pytest.approx(part.width_px[i], abs=0.15)


def test_a_picture_out_of_focus_is_soft_all_over():
    # Lines that are thinner than the blur, and noise, make it seem less than the 4.5 px it is.
    sharp, soft = (
        measure_sharpness(picture(f"ssl-div-b?size=1280x720&region=quarter-top-left&blur={b}"))
        for b in (0.65, 4)
    )
    assert sharp.best_px < 1.3 and focus.advice(sharp) == []
    assert soft.best_px > 2.5 and "Whole image soft" in texts(focus.advice(soft))


@seeds
@pytest.mark.parametrize("noise", [2, 8])
def test_bare_carpet_is_not_called_soft(seed, noise):
    report = measure_sharpness(
        picture(f"{BIG}&robots=0&region=eighth-2&fill=3&noise={noise}&seed={seed}")
    )
    assert report.width_px == (None,) * 9 and report.best_px is None
    assert "no edges detected" in texts(focus.advice(report))


@seeds
def test_a_zone_without_edges_says_nothing_beside_sharp_ones(seed):
    pixels = picture(f"{BIG}&robots=0&seed={seed}")
    rng = np.random.default_rng(seed)
    pixels[:240, :427] = np.clip(rng.normal(70, 3, (240, 427, 3)), 0, 255)
    soft_blotch = cv2.GaussianBlur(rng.normal(0, 1, (240, 427)).astype(np.float32), (0, 0), 25)
    pixels[480:, :427] = np.clip(70 + 12 * soft_blotch / soft_blotch.std(), 0, 255)[..., None]
    report = measure_sharpness(pixels)
    # The patches' own borders are sharp, and may be seen.
    assert all(report.width_px[i] is None or report.width_px[i] < 2 for i in (0, 6))
    assert focus.advice(report) == []


def test_pictures_without_anything_say_nothing():
    for shape in ((20, 20, 3), (360, 640, 3)):
        report = measure_sharpness(np.zeros(shape, np.uint8))
        assert report.best_px is None and set(report.width_px) == {None}
    light = measure_light(np.zeros((90, 160, 3), np.uint8))
    assert (
        light.clipped_low == 1
        and light.evenness is not None
        and "underexposed" in texts(lighting.advice(light))
    )


# Flicker


def series(
    shown: Rendering, fps: float = 30.0, frames: int = 30, seed: int = 0
) -> tuple[np.ndarray, list]:
    """Frames at a camera's slightly irregular pace."""
    times = np.arange(frames) / fps + np.random.default_rng(seed).normal(0, 2e-4, frames)
    return times, [row_means(shown.frame_at(i, float(t))) for i, t in enumerate(times)]


@seeds
def test_a_global_shutter_sees_the_whole_picture_flicker(seed):
    shown = rendering(f"{SMALL}&robots=8&flicker=0.05&flicker_hz=100&readout=0&seed={seed}")
    flicker = measure_flicker(*series(shown, seed=seed))
    true_pct = 5 * np.sinc(100 * 0.004)
    assert flicker["amplitude_pct"] == pytest.approx(true_pct, rel=0.1)
    assert flicker["beat_hz"] == pytest.approx(10, abs=0.3)  # 100 Hz at 30 frames a second
    assert flicker["lamp_hz"] == 100
    assert flicker["bands_pct"] < 0.5
    assert "as lamps do at 100 Hz" in texts(flickering.advice(flicker))
    assert "10 ms" in flickering.advice(flicker)[0]["fix"]


@seeds
@pytest.mark.parametrize(
    ("fps", "hz", "readout_ms"), [(30, 100, 15), (25, 120, 15), (50, 120, 18), (30, 100, 25)]
)
def test_a_rolling_shutter_sees_bands(seed, fps, hz, readout_ms):
    shown = rendering(
        f"{SMALL}&robots=8&flicker=0.1&flicker_hz={hz}&readout={readout_ms}&seed={seed}"
    )
    flicker = measure_flicker(*series(shown, fps, seed=seed))
    true_pct = 10 * np.sinc(hz * 0.004)
    assert flicker["bands_pct"] == pytest.approx(true_pct, rel=0.2)
    assert (
        flicker["bands"] == pytest.approx(hz * readout_ms / 1000, abs=0.4)
        and flicker["lamp_hz"] == hz
    )
    assert "bands of" in texts(flickering.advice(flicker))


@seeds
def test_play_people_and_noise_are_no_flicker(seed):
    flicker = measure_flicker(
        *series(rendering(f"{SMALL}&robots=12&people=3&noise=5&seed={seed}"), seed=seed)
    )
    assert (
        flickering.advice(flicker) == [] and flicker["lamp_hz"] is None and flicker["bands"] is None
    )


def test_an_exposure_of_a_whole_flicker_shows_none():
    source = source_from_url(
        f"sim://{SMALL}&flicker=0.3&flicker_hz=100&fps=30", SourceContext(FIELDS)
    )
    source.set_control("exposure", 10_000)
    times, rows = np.arange(15) / 30, [row_means(source.read().pixels) for _ in range(15)]
    assert flickering.advice(measure_flicker(times, rows)) == []


def test_slow_drift_is_drift_and_not_flicker():
    flicker = measure_flicker(*series(rendering(f"{SMALL}&drift=0.5")))
    assert flicker["drift_pct"] == pytest.approx(100 * 0.5 * 2 * np.pi * (29 / 30) / 60, rel=0.1)
    assert flickering.advice(flicker) == []


def test_too_few_frames_and_broken_ones_say_nothing():
    times, rows = series(rendering(SMALL), frames=11)
    assert measure_flicker(times, rows) is None and flickering.advice(None) == []
    assert (
        measure_flicker([], []) is None and measure_flicker([1.0] * 20, [np.ones(5)] * 20) is None
    )
    assert measure_flicker(np.arange(20.0), [np.zeros(5)] * 20) is None
    times, rows = series(rendering(SMALL), frames=13)
    rows[4] = np.full_like(rows[4], np.nan)
    assert measure_flicker(times, rows)["frames"] == 12


def test_row_means_are_means_of_rows():
    pixels = np.random.default_rng(0).integers(0, 255, (1080, 64, 3), np.uint8)
    pixels[:] = np.arange(1080)[:, None, None] % 250
    means = row_means(pixels)
    assert means.shape == (270,)
    np.testing.assert_allclose(
        means, (np.arange(1080) % 250).reshape(270, 4).mean(axis=1), atol=0.01
    )
