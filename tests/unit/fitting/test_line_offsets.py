"""How far lines lie beside their places is learned from the picture, and tilts do not speak for it."""

import numpy as np
import pytest

from touchline.fitting.ray_camera.problem import line_sigmas_mm

USUAL_MM = 3.0


def learned(offsets_mm, kind):
    """Return σ of offsets that the clicks tell to 0.1 mm each."""
    prior_mm = np.full(len(offsets_mm), USUAL_MM)
    jacobian = np.concatenate([np.diag(np.full(len(offsets_mm), 10.0)), np.diag(1 / prior_mm)])
    return line_sigmas_mm(
        jacobian, range(len(offsets_mm)), offsets_mm, prior_mm, USUAL_MM, np.array(kind)
    )


def test_straight_lines_may_lie_beside_their_places():
    offsets, tilts = (
        np.array([3.0, -4.0, 2.5, -3.5, 4.5, -2.0]),
        np.array([0.1, -0.1, 0.1, 0.0, 0.1, -0.1]),
    )
    both = np.concatenate([offsets, tilts])
    sigmas = learned(both, [0] * 6 + [1] * 6)
    alone = learned(offsets, [0] * 6)
    assert np.median(sigmas[:6]) == pytest.approx(np.median(alone), rel=0.1)
    assert np.median(sigmas[6:]) < 0.5 < 2.0 < np.median(sigmas[:6])
    # one σ for both would be too small
    assert np.median(learned(both, [0] * 12)[:6]) < 0.8 * np.median(alone)


def test_one_line_far_off_does_not_speak_for_the_others():
    sigmas = learned(np.array([0.3, -0.2, 0.4, -0.3, 0.1, 12.0]), [0] * 6)
    assert sigmas[5] > 2 * sigmas[0] and sigmas[0] < USUAL_MM


@pytest.mark.parametrize("painted", ["normal", "one far off"])
def test_what_lines_tell_of_a_shared_place_is_known_as_well_as_is_told(painted):
    """Twelve lines, each seen exactly but painted beside its place, tell one shift: observed over expected, rms."""
    rng, lines, before = np.random.default_rng(0), 12, np.full(12, USUAL_MM)
    off = []
    for _ in range(200):
        aside = rng.normal(0, USUAL_MM, lines)
        aside[0] += 12.0 * (painted == "one far off")
        # seen to a hundredth of a mm
        shared = np.concatenate([np.ones((lines, 1)), np.eye(lines)], axis=1) * 100
        for _ in range(4):
            jacobian = np.concatenate([shared, np.eye(lines + 1)[1:] / before[:, None]])
            seen = np.concatenate([aside * 100, np.zeros(lines)])
            found = np.linalg.lstsq(jacobian, seen, rcond=None)[0]
            before = line_sigmas_mm(
                jacobian, range(1, lines + 1), found[1:], before, USUAL_MM, np.zeros(lines)
            )
        off.append(found[0] / np.sqrt(np.linalg.inv(jacobian.T @ jacobian)[0, 0]))
    assert 0.7 < np.sqrt(np.mean(np.square(off))) < 1.05  # with one far off on the safe side


@pytest.mark.parametrize("told", [0.0, 1e-6, 1.0])
@pytest.mark.parametrize("off_mm", [1e3, 1e8])
def test_offsets_beyond_belief_are_bounded(off_mm, told):
    """Of a search that ended nowhere: lines kilometres beside their places, of which points tell one sum or nothing."""
    offsets, prior_mm = off_mm * np.arange(1, 7), np.full(6, USUAL_MM)
    jacobian = np.concatenate([np.full((3, 6), told), np.diag(1 / prior_mm)])
    sigmas = line_sigmas_mm(jacobian, range(6), offsets, prior_mm, USUAL_MM, np.zeros(6))
    assert (sigmas > 0).all() and (sigmas < 1000).all()
