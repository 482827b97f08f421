"""Many frames make one clean picture: walking people and robots vanish, noise shrinks, and clicks get better."""

from functools import lru_cache

import numpy as np
import pytest

from tests.support.line_centres import centroids, clear_of_others
from tests.support.sim_truth import truth_at
from tests.support.tiers import rounds
from touchline.core.errors import BadInput
from touchline.sources import SourceContext, source_from_url
from touchline.sources.sim.render import Rendering
from touchline.store.fields import load_fields
from touchline.vision.background import MAX_FRAMES, Background

FIELDS = load_fields()
FIELD = FIELDS["ssl-div-b"]
seeds = rounds("seed", 1, 2, 3)


@lru_cache(maxsize=2)
def rendering(
    seed: int, robots: int = 0, people: int = 0, noise: float = 0, more: str = ""
) -> Rendering:
    url = f"sim://ssl-div-b?size=960x720&robots={robots}&people={people}&noise={noise}&seed={seed}{more}"
    return source_from_url(url, SourceContext(FIELDS)).rendering


def background(frames) -> Background:
    frames = list(frames)
    found = Background(frames[0].shape, len(frames))
    for frame in frames:
        found.add(frame)
    return found


@seeds
def test_robots_and_walking_people_vanish(seed):
    shown, empty = rendering(seed, 8, 3, 2), rendering(seed).frame(0).astype(int)
    frames = [shown.frame_at(i, 0.7 * i) for i in range(15)]  # over ten seconds
    clean = background(frames)
    in_one = (np.abs(frames[7].astype(int) - empty).max(axis=2) > 25).sum()
    left = (np.abs(clean.picture.astype(int) - empty).max(axis=2) > 25) & ~clean.unsettled
    assert in_one > 5000 and left.sum() <= in_one / 200
    assert clean.unsettled.mean() < 0.005


@seeds
def test_what_is_hidden_most_of_the_time_is_marked_as_never_seen_free(seed):
    """In ten frames a second people hardly get away in one second."""
    shown, empty = rendering(seed, 8, 3, 2), rendering(seed).frame(0).astype(int)
    clean = background(shown.frame_at(i, 0.1 * i) for i in range(15))
    share = np.mean([truth_at(shown, 0.1 * i).hidden for i in range(15)], axis=0)
    share[truth_at(rendering(seed), 0.0).hidden] = 0  # goals belong to the picture
    wrong = np.abs(clean.picture.astype(int) - empty).max(axis=2) > 25
    assert clean.unsettled[(share > 0.45) & (share < 0.55)].mean() > 0.5
    assert clean.unsettled[share == 0].mean() < 0.002
    moved = (share > 0.4) & (share < 0.75)
    assert (wrong & moved & ~clean.unsettled).sum() < 0.4 * (wrong & moved).sum()
    assert not wrong[share < 0.35].any() or clean.unsettled[wrong & (share < 0.35)].mean() > 0.3


@seeds
def test_the_noise_that_is_left_is_what_is_said(seed):
    shown, exact = rendering(seed, noise=4), rendering(seed).frame(0).astype(float)
    clean = background(shown.frame(i) for i in range(15))
    assert clean.noise == pytest.approx(4, rel=0.08)
    left = (clean.picture - exact).std()
    assert left == pytest.approx(np.sqrt(clean.noise**2 / 15 + 1 / 12), rel=0.15) and left < 4 / 3.4
    # A median alone would keep a fifth more.
    median = np.median([shown.frame(i) for i in range(15)], axis=0)
    assert left < 0.93 * (median - exact).std()


@seeds
def test_line_centres_are_found_better_in_fifteen_frames_than_in_one(seed):
    """Of noise alone, against the same lines without any: what is left is a third, and people hide nothing."""
    shown, exact = rendering(seed, noise=8), rendering(seed)
    crowded = rendering(seed, 8, 3, 8)
    one, fifteen = (
        shown.frame(99),
        background(crowded.frame_at(i, 0.7 * i) for i in range(15)).picture,
    )
    errors = {"one": [], "fifteen": []}
    for line in FIELD.lines.values():
        clear = clear_of_others(FIELD, line, 60)
        true = centroids(exact.frame(0)[..., 1], exact.camera, line, 60)[clear]
        for name, pixels in (("one", one), ("fifteen", fifteen)):
            off = centroids(pixels[..., 1], exact.camera, line, 60)[clear] - true
            errors[name].append(np.clip(off, -2, 2))
    one_px, fifteen_px = (
        float(np.sqrt(np.mean(np.concatenate(errors[n]) ** 2))) for n in ("one", "fifteen")
    )
    assert fifteen_px < one_px / 2.5, (
        f"{one_px:.3f} px in one frame, {fifteen_px:.3f} px in fifteen"
    )


@pytest.mark.parametrize("count", range(2, MAX_FRAMES + 1))
def test_where_no_two_frames_agree_the_median_stands_and_is_marked(count):
    """Colours that have nothing to do with each other: no mean of several would be right."""
    levels = np.random.default_rng(count).permutation(count)
    frames = []
    for level in levels:
        frame = np.full((40, 50, 3), 90, np.uint8)
        frame[:4, :5] = 10 * level
        frames.append(frame)
    found = background(frames)
    assert (found.picture[:4, :5] == 10 * (count // 2)).all() and (found.picture[4:] == 90).all()
    assert found.unsettled[:4, :5].all() and found.unsettled.sum() == 20


def test_equal_frames_come_out_as_they_are():
    frame = np.random.default_rng(0).integers(0, 256, (37, 53, 3), np.uint8)
    found = background([frame] * 7)
    assert (found.picture == frame).all() and not found.unsettled.any() and found.noise < 0.5


def test_of_many_frames_some_are_kept_spread_over_all():
    frames = [np.full((2, 2, 3), i, np.uint8) for i in range(60)]
    found = background(frames)
    chosen = found._chosen_frames[: found._count, 0].tolist()
    assert chosen == np.linspace(0, 59, MAX_FRAMES).round().astype(int).tolist()
    found.add(np.full((2, 2, 3), 200, np.uint8))  # more than was announced
    assert found._chosen_frames.max() < 60


def test_a_picture_can_be_had_at_any_time_and_grows_better():
    rng = np.random.default_rng(1)
    found = Background((40, 40, 3), 15)
    errors = []
    for i in range(15):
        found.add(np.clip(rng.normal(100, 6, (40, 40, 3)), 0, 255).astype(np.uint8))
        if i in (0, 4, 14):
            errors.append(found.picture.astype(float).std())
    assert errors[0] > 1.6 * errors[1] > 1.6 * 1.3 * errors[2]


@pytest.mark.parametrize("shape", [(4, 4), (4, 4, 4), (4,)])
def test_what_is_no_colour_frame_is_refused(shape):
    with pytest.raises(BadInput):
        Background(shape, 5)


def test_frames_of_another_size_and_no_frames_at_all_are_refused():
    found = Background((4, 4, 3), 5)
    with pytest.raises(BadInput, match="frame"):
        _ = found.picture
    with pytest.raises(BadInput, match="size"):
        found.add(np.zeros((4, 5, 3), np.uint8))
    with pytest.raises(BadInput):
        Background((4, 4, 3), 0)
