"""Edges: where they are to hundredths of a pixel, where they end, and that nothing is made up."""

import numpy as np
import pytest

from touchline.vision.edges import edge_chains

HEIGHT, WIDTH = 240, 320
# samples a pixel each way: a picture's pixel is the mean over its square, and the drawing exact to
# 1/16 px
FINE = 8
DRAWN_PX = 0.03  # what that costs the mean of a slanted edge


def picture(inside, noise=0.0, low=60, high=190):
    """Grey levels (h, w) uint8 of a shape inside(x, y), each pixel the mean over its square."""
    y, x = ((np.arange(n * FINE) + 0.5) / FINE - 0.5 for n in (HEIGHT, WIDTH))
    fine = np.where(inside(x[None, :], y[:, None]), high, low).astype(float)
    grey = fine.reshape(HEIGHT, FINE, WIDTH, FINE).mean(axis=(1, 3))
    return np.clip(
        np.round(grey + np.random.default_rng(0).normal(0, noise, grey.shape)), 0, 255
    ).astype(np.uint8)


@pytest.mark.parametrize("degrees", [0, 7, 30, 45, 60, 90, 133])
def test_a_straight_edge_is_found_to_a_few_hundredths_of_a_pixel(degrees):
    normal = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
    offset = normal @ (WIDTH / 2, HEIGHT / 2) + 0.375
    chains = edge_chains(picture(lambda x, y: normal[0] * x + normal[1] * y < offset, noise=1.0))
    assert len(chains) == 1
    off = chains[0] @ normal - offset
    assert np.abs(off.mean()) < DRAWN_PX and off.std() < 0.04
    assert np.linalg.norm(chains[0][-1] - chains[0][0]) > 200


@pytest.mark.parametrize("degrees", [3, 30])
def test_a_slanted_edge_ripples_by_less_than_a_hundredth_of_a_pixel(degrees):
    normal = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
    (chain,) = edge_chains(
        picture(lambda x, y: normal[0] * (x - 160) + normal[1] * (y - 120) < 0.375)
    )
    # the gradient's own top: 0.013 at 30°; its logarithm's: 0.018 at 3°
    assert np.std(chain @ normal) < 0.0105


def test_a_bowed_edge_is_followed_along_its_bow():
    chains = edge_chains(picture(lambda x, y: (x - 160) ** 2 + (y - 900) ** 2 < 800**2))
    assert len(chains) == 1
    off = np.hypot(chains[0][:, 0] - 160, chains[0][:, 1] - 900) - 800
    assert np.abs(off.mean()) < DRAWN_PX and off.std() < 0.04


def test_a_rectangle_gives_its_four_sides_and_no_corner():
    chains = edge_chains(
        picture(lambda x, y: (np.abs(x - 160.25) < 100) & (np.abs(y - 120.25) < 70))
    )
    assert len(chains) == 4
    for chain in chains:
        away = np.minimum(
            np.abs(np.abs(chain[:, 0] - 160.25) - 100), np.abs(np.abs(chain[:, 1] - 120.25) - 70)
        )
        assert away.max() < 0.06


def test_a_small_circle_is_no_straight_edge():
    assert edge_chains(picture(lambda x, y: (x - 160) ** 2 + (y - 120) ** 2 < 50**2)) == []


def test_noise_and_blank_pictures_give_nothing():
    noise = np.random.default_rng(1).integers(0, 255, (HEIGHT, WIDTH, 3), np.uint8)
    for blank in (noise, np.zeros((HEIGHT, WIDTH), np.uint8), np.zeros((2, 2, 3), np.uint8)):
        assert edge_chains(blank) == []


def test_an_edge_that_a_narrow_bar_interrupts_is_one_chain():
    """A grid's line is cut by every line that crosses it; pieces of one edge belong together."""
    shape = picture(lambda x, y: (y - 0.05 * x < 110) ^ (np.abs((x % 40) - 20) < 1.5))
    lengths = [np.ptp(c[:, 0]) for c in edge_chains(shape) if np.ptp(c[:, 0]) > np.ptp(c[:, 1])]
    assert lengths and max(lengths) > 200


def test_a_grids_lines_end_clear_of_their_crossings():
    """Blur rounds the corners of every mesh; what is kept of the sides is straight."""
    shape = picture(lambda x, y: ((x + 0.07 * y) % 48 > 4) & ((y - 0.07 * x) % 48 > 4))
    chains = edge_chains(shape)
    assert max(np.linalg.norm(c[-1] - c[0]) for c in chains) > 250
    for chain in chains:
        across = chain @ (
            np.array([0.07, -1.0])
            if np.ptp(chain[:, 0]) > np.ptp(chain[:, 1])
            else np.array([1, 0.07])
        )
        assert np.abs(across - np.median(across)).max() < 0.06


def test_the_same_picture_gives_the_same_chains():
    shape = picture(lambda x, y: y < 100 + 0.1 * x, noise=3.0)
    first, second = edge_chains(shape), edge_chains(shape)
    assert all((a == b).all() for a, b in zip(first, second, strict=True))
    colour = edge_chains(np.dstack([shape] * 3))
    assert all((a == b).all() for a, b in zip(first, colour, strict=True))
