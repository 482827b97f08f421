"""A painted line as a camera sees it, drawn without any model of ours: finely, then blurred, sampled, made noisy."""

import cv2
import numpy as np

FINE = 4  # sub-pixels each way


def painted(
    edges, size=(120, 100), paint=220.0, ground=(60.0, 60.0), blur_px=0.8, noise=2.0, rng=None
) -> np.ndarray:
    """A picture (h, w) uint8. edges: for each line two functions of pixels (..., 2), positive on the line's side.

    ground: grey before the first edge of the first line, and after its second.
    """
    width, height = size
    at = (np.arange(max(size) * FINE) + 0.5) / FINE - 0.5
    places = np.stack(np.meshgrid(at[: width * FINE], at[: height * FINE]), axis=-1)
    lines = [(first(places), second(places)) for first, second in edges]
    fine = (
        np.where(lines[0][0] > 0, ground[1], ground[0])
        if lines
        else np.full(places.shape[:2], ground[0])
    )
    for first, second in lines:
        fine[(first > 0) & (second > 0)] = paint
    fine = cv2.GaussianBlur(fine.astype(np.float32), (0, 0), blur_px * FINE) if blur_px else fine
    seen = cv2.resize(fine, (width, height), interpolation=cv2.INTER_AREA)
    seen = seen + (rng or np.random.default_rng(0)).normal(0, noise, seen.shape)
    return np.clip(np.rint(seen), 0, 255).astype(np.uint8)


def straight(middle, angle_rad, width_px, spread=0.0):
    """A line's two edges. spread: how much wider it is one px further along, as perspective makes it."""
    middle = np.asarray(middle, float)
    along = np.array([np.cos(angle_rad), np.sin(angle_rad)])
    normal = np.array([-along[1], along[0]])

    def first(p):
        return (p - middle) @ normal + (width_px + spread * ((p - middle) @ along)) / 2

    def second(p):
        return (width_px + spread * ((p - middle) @ along)) / 2 - (p - middle) @ normal

    return first, second


def round_line(centre, radius_px, width_px):
    """An arc's two edges, the inner one first."""
    centre = np.asarray(centre, float)
    return (
        lambda p: np.linalg.norm(p - centre, axis=-1) - radius_px + width_px / 2,
        lambda p: radius_px + width_px / 2 - np.linalg.norm(p - centre, axis=-1),
    )
