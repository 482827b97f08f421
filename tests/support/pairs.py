"""Pairs of views for tests: simulated ones with known truth, and the hand-clicked ones beside the project."""

import zlib
from dataclasses import dataclass

import numpy as np

from tests.support.examples import example_parameters
from tests.support.paths import SHARED_DATA
from touchline.core.geometry import as_triple, homogeneous
from touchline.models.ray_camera import Division
from touchline.models.rotation import vector_from_matrix
from touchline.rigs.evidence import ideal_px

KUSVOD2 = SHARED_DATA / "pairs" / "kusvod2"
PAIRS = ("corr", "plant", "rotunda")


@dataclass(frozen=True, eq=False)
class Pair:
    """Two cameras over a field, matches a, b (n, 2) raw px of which good (n,) are none at random, and clean ones."""

    camera_a: Division
    camera_b: Division
    a: np.ndarray
    b: np.ndarray
    good: np.ndarray
    clean_a: np.ndarray
    clean_b: np.ndarray


def simulated(
    seed: int,
    *,
    matches: int = 120,
    mistakes: float = 0.3,
    noise_px: float = 0.3,
    uneven: bool = False,
    flat: bool = False,
    k: float = 0.0,
) -> Pair:
    """Two cameras above one field, tilted towards each other; points up to a metre above the carpet, or flat on it.

    uneven: σ differs from match to match by up to e^1.3 either way.
    """
    rng = np.random.default_rng(seed)
    cameras = [
        _looking(
            np.array([side * rng.uniform(1200, 2000), rng.normal(0, 400), rng.uniform(3500, 4500)]),
            rng.normal(0, 300, 2),
            k,
            rng,
        )
        for side in (-1, 1)
    ]
    places = np.column_stack(
        [
            rng.uniform(-1500, 1500, 2000),
            rng.uniform(-1200, 1200, 2000),
            np.zeros(2000) if flat else rng.uniform(0, 1000, 2000),
        ]
    )
    pixels = [c.project(places) for c in cameras]
    seen = np.all(
        [
            np.isfinite(p).all(axis=1) & (p > 0).all(axis=1) & (p < [1280, 1024]).all(axis=1)
            for p in pixels
        ],
        axis=0,
    )
    a, b = (p[seen] for p in pixels)
    spread = noise_px * (np.exp(rng.uniform(-1.3, 1.3, (matches, 1))) if uneven else 1.0)
    noisy = [p[:matches] + rng.normal(0, 1, (matches, 2)) * spread for p in (a, b)]
    good = np.arange(matches) >= round(mistakes * matches)
    noisy[1][~good] = rng.uniform([0, 0], [1280, 1024], ((~good).sum(), 2))
    return Pair(cameras[0], cameras[1], noisy[0], noisy[1], good, a[matches:], b[matches:])


def _looking(position: np.ndarray, at: np.ndarray, k: float, rng: np.random.Generator) -> Division:
    ahead = np.array([*at, 0.0]) - position
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, [np.sin(0.1 * rng.normal()), 1.0, 0.0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(ahead, right), ahead])
    return Division(
        **{
            **next(example_parameters()),
            "lens_terms": (k,),
            "position_mm": as_triple(position),
            "rotation": as_triple(vector_from_matrix(rotation)),
        }
    )


def ideal(pair: Pair, which: str) -> tuple[np.ndarray, np.ndarray]:
    """Matches ("" or "clean_") without the lenses."""
    return (
        ideal_px(pair.camera_a, getattr(pair, f"{which}a")),
        ideal_px(pair.camera_b, getattr(pair, f"{which}b")),
    )


def labelled_matches(
    name: str,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Detected matches a, b of a kusvod2 pair, whether each was clicked by hand, and the hand-clicked a, b again."""
    table = np.loadtxt(KUSVOD2 / f"{name}_pts.txt")
    by_hand = _matrix_of_six_rows((KUSVOD2 / f"{name}_vpts.mat").read_bytes()).T
    return (
        table[:, :2],
        table[:, 3:5],
        table[:, 6].astype(bool),
        by_hand[:, :2] / by_hand[:, 2:3],
        by_hand[:, 3:5] / by_hand[:, 5:],
    )


def _matrix_of_six_rows(data: bytes) -> np.ndarray:
    """The 6 × N matrix of doubles in a MATLAB 5 file, by its element header: nothing else in these files is like it."""
    place = 128
    while place + 8 <= len(data):  # compressed elements, one after the other
        size = int.from_bytes(data[place + 4 : place + 8], "little")
        inner = zlib.decompress(data[place + 8 : place + 8 + size])
        for at in range(0, len(inner) - 24, 4):
            kind, rows, columns = (
                int.from_bytes(inner[at + i : at + i + 4], "little") for i in (0, 8, 12)
            )
            # dimensions: int32, 8 bytes, then name, then doubles
            if kind == 5 and rows == 6 and 4 < columns < 100:
                name = at + 16
                small = int.from_bytes(inner[name + 2 : name + 4], "little")
                values = (
                    name + 8
                    if small or not int.from_bytes(inner[name + 4 : name + 8], "little")
                    else name + 16
                )
                count = int.from_bytes(inner[values + 4 : values + 8], "little") // 8
                if count == rows * columns:
                    return np.frombuffer(inner, "<f8", count, values + 8).reshape(columns, rows).T
        place += 8 + size
    raise ValueError("no 6 × N matrix")


def epipolar_error_px(fundamental: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Written anew for the tests: distances of b from F a and of a from Fᵀ b, root mean square of the two."""
    to_b, to_a = homogeneous(a) @ fundamental.T, homogeneous(b) @ fundamental
    far_b = np.abs(np.sum(homogeneous(b) * to_b, axis=1)) / np.hypot(to_b[:, 0], to_b[:, 1])
    far_a = np.abs(np.sum(homogeneous(a) * to_a, axis=1)) / np.hypot(to_a[:, 0], to_a[:, 1])
    return np.sqrt((far_a**2 + far_b**2) / 2)


def eight_point(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """F (3, 3) from eight matches or more by Hartley's normalised algorithm; rank 2, Frobenius norm 1."""
    t_a, t_b = _similarity(a), _similarity(b)
    near_a, near_b = homogeneous(a) @ t_a.T, homogeneous(b) @ t_b.T
    design = (near_b[:, :, None] * near_a[:, None, :]).reshape(-1, 9)
    u, s, vt = np.linalg.svd(np.linalg.svd(design, full_matrices=True)[2][-1].reshape(3, 3))
    f = t_b.T @ (u @ np.diag([s[0], s[1], 0.0]) @ vt) @ t_a
    return f / np.linalg.norm(f)


def _similarity(points: np.ndarray) -> np.ndarray:
    """(3, 3): to the middle of points, at a mean distance of √2."""
    middle = points.mean(axis=0)
    scale = np.sqrt(2) / np.hypot(*(points - middle).T).mean()
    return np.array([[scale, 0, -scale * middle[0]], [0, scale, -scale * middle[1]], [0, 0, 1.0]])
