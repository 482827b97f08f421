"""Where painted lines are seen in a picture: the centre of brightness across them, against the truth."""

import cv2
import numpy as np

from touchline.core.field import Field
from touchline.sources.sim.camera import SimCamera


def centroids(picture: np.ndarray, camera: SimCamera, marking, count: int) -> np.ndarray:
    """Signed px from the true centre of a marking to the centre of brightness across it, at `count` places."""
    places = marking.sample(count + 2)[1:-1]
    step = (marking.sample(20_001)[1:] - marking.sample(20_001)[:-1])[:: 20_000 // count][:count]
    tangent = camera.raw_from_field(places + step) - camera.raw_from_field(places - step)
    normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1) / np.linalg.norm(
        tangent, axis=1, keepdims=True
    )
    away = np.arange(-6, 6.01, 0.25)
    at = (camera.raw_from_field(places)[:, None] + away[:, None] * normal[:, None]).astype(
        np.float32
    )
    profile = cv2.remap(picture.astype(np.float32), at[..., 0], at[..., 1], cv2.INTER_LINEAR)
    profile = profile - profile[:, [0, 1, 2, -3, -2, -1]].mean(axis=1, keepdims=True)
    inner = np.abs(away) <= 4
    return (profile * away)[:, inner].sum(axis=1) / profile[:, inner].sum(axis=1)


def clear_of_others(field: Field, marking, count: int, margin_mm: float = 120) -> np.ndarray:
    """Which of the places along a marking lie far from every other marking."""
    places = marking.sample(count + 2)[1:-1]
    others = [m.sample(2001) for m in field.markings if m is not marking]
    marks = [np.array([field.landmarks[m["at"]].position]) for m in field.extras["marks"]]
    walls = np.array([[s * (field.length_mm / 2 + 10), t] for s in (-1, 1) for t in (-510, 510)])
    near = np.min(
        [
            np.linalg.norm(places[:, None] - o, axis=-1).min(axis=1)
            for o in (*others, *marks, walls)
        ],
        axis=0,
    )
    return near > margin_mm
