"""Epipolar geometry of two views: where a point of one view can lie in the other, and how far matches are from it.

    (x', y', 1) F (x, y, 1)ᵀ = 0,   F of rank 2: seven numbers

Normalised after R. Hartley (1997); first-order distance after P. Sampson (1982); orthonormal
form F = U diag(1, s, 0) Vᵀ after A. Bartoli and P. Sturm (2004); seven points, R. Hartley and A. Zisserman (2004).
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from touchline.core.geometry import Array, Points, homogeneous
from touchline.models.rotation import cross_matrix, matrix_from_vector


def sampson_px(fundamental: Array, a: Points, b: Points) -> Array:
    """Return the signed first-order distance, px, of matches (n, 2) from fundamental (…, 3, 3): (…, n)."""
    xa, xb = homogeneous(a), homogeneous(b)
    in_b = xa @ np.swapaxes(fundamental, -1, -2)  # (…, n, 3): the line of each a in view b
    in_a = xb @ fundamental
    with np.errstate(all="ignore"):
        steep = in_b[..., 0] ** 2 + in_b[..., 1] ** 2 + in_a[..., 0] ** 2 + in_a[..., 1] ** 2
        return np.sum(xb * in_b, axis=-1) / np.sqrt(steep)


def epipolar_px(fundamental: Array, a: Points, b: Points) -> Array:
    """Return (n,) px: the rms of a match's distances from its two epipolar lines."""
    in_b, in_a = homogeneous(a) @ fundamental.T, homogeneous(b) @ fundamental
    with np.errstate(all="ignore"):
        miss = np.sum(homogeneous(b) * in_b, axis=1) ** 2
        return np.sqrt((miss / np.sum(in_b[:, :2] ** 2, axis=1) + miss / np.sum(in_a[:, :2] ** 2, axis=1)) / 2)


def normaliser(points: Points) -> Array:
    """Return the similarity (3, 3) that centres points and scales them to a mean distance of √2."""
    middle = points.mean(axis=0)
    scale = np.sqrt(2) / max(float(np.linalg.norm(points - middle, axis=1).mean()), 1e-12)
    return np.array([[scale, 0, -scale * middle[0]], [0, scale, -scale * middle[1]], [0, 0, 1.0]])


def seven_point(a: Points, b: Points) -> Array:
    """Return every F (m, 3, 3) through seven matches (…, 7, 2), up to three of each seven, in one list."""
    design = (homogeneous(b)[..., :, None] * homogeneous(a)[..., None, :]).reshape(*a.shape[:-1], 9)
    null = np.linalg.svd(design, full_matrices=True)[2][..., -2:, :]
    first, second = (null[..., i, :].reshape(-1, 3, 3) for i in (0, 1))
    # det(α F1 + (1 - α) F2) is a cubic: four values determine it
    at = np.array([-1.0, 0.0, 1.0, 2.0])
    values = np.linalg.det(at[:, None, None, None] * first + (1 - at[:, None, None, None]) * second)
    cubic = np.linalg.solve(np.vander(at, 4), values)  # (4, m), highest power first
    with np.errstate(all="ignore"):
        companion = np.zeros((first.shape[0], 3, 3))
        companion[:, 0] = np.nan_to_num(-cubic[1:].T / cubic[0][:, None], nan=0.0, posinf=0.0, neginf=0.0)
    companion[:, 1, 0] = companion[:, 2, 1] = 1
    roots = np.linalg.eigvals(companion)
    found = roots.real[..., None, None] * first[:, None] + (1 - roots.real[..., None, None]) * second[:, None]
    found = found[np.abs(roots.imag) < 1e-9 * (1 + np.abs(roots.real))]
    return found / np.maximum(np.linalg.norm(found, axis=(1, 2), keepdims=True), 1e-300)


@dataclass(frozen=True, eq=False)
class FundamentalParameters:
    """F as a fit moves it, in normalised coordinates: F = t_bᵀ U diag(cos α, sin α, 0) Vᵀ t_a, always of rank 2."""

    u: Array
    angle: float
    v: Array
    t_a: Array
    t_b: Array

    @classmethod
    def of(cls, fundamental: Array, a: Points, b: Points) -> Self:
        t_a, t_b = normaliser(a), normaliser(b)
        u, s, vt = np.linalg.svd(np.linalg.inv(t_b).T @ fundamental @ np.linalg.inv(t_a))
        u, vt = u * [1, 1, np.linalg.det(u)], vt * np.array([[1], [1], [np.linalg.det(vt)]])
        return cls(u, float(np.arctan2(s[1], s[0])), vt.T, t_a, t_b)

    def fundamental(self) -> Array:
        f = self.t_b.T @ self._inner @ self.t_a
        return f / np.linalg.norm(f)

    @property
    def _inner(self) -> Array:
        return self.u @ np.diag([np.cos(self.angle), np.sin(self.angle), 0.0]) @ self.v.T

    def retract(self, delta: Array) -> Self:
        """Apply delta (7,): turns of U and V, and the angle."""
        return replace(self, u=self.u @ matrix_from_vector(delta[:3]), v=self.v @ matrix_from_vector(delta[3:6]),
                       angle=self.angle + float(delta[6]))

    def residuals(self, a: Points, b: Points) -> tuple[Array, Array]:
        """Return Sampson's distance (n,) px and its derivatives (n, 7)."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        middle = np.diag([c, s, 0.0])
        turns = [cross_matrix(e) for e in np.eye(3)]
        bent = [self.u @ k @ middle @ self.v.T for k in turns]
        bent += [self.u @ middle @ k.T @ self.v.T for k in turns]
        bent.append(self.u @ np.diag([-s, c, 0.0]) @ self.v.T)
        by = np.stack([self.t_b.T @ m @ self.t_a for m in bent])  # (7, 3, 3)
        f = self.t_b.T @ self._inner @ self.t_a
        return sampson_jacobian(f, by, a, b)


def sampson_jacobian(f: Array, by: Array, a: Points, b: Points) -> tuple[Array, Array]:
    """Return Sampson's distance (n,) and its derivatives (n, p) where dF = by (p, 3, 3)."""
    xa, xb = homogeneous(a), homogeneous(b)
    in_b, in_a = xa @ f.T, xb @ f
    value = np.sum(xb * in_b, axis=1)
    steep = np.sum(in_b[:, :2] ** 2, axis=1) + np.sum(in_a[:, :2] ** 2, axis=1)
    p, n = len(by), len(a)
    products = (xb[:, :, None] * xa[:, None, :]).reshape(n, 9)
    across = (in_b[:, :2, None] * xa[:, None, :]).reshape(n, 6)  # d steep / dF, first two rows, by halves
    along = (xb[:, :, None] * in_a[:, None, :2]).reshape(n, 6)  # and first two columns
    d_value = products @ by.reshape(p, 9).T
    d_steep = 2 * (across @ by[:, :2].reshape(p, 6).T + along @ by[:, :, :2].reshape(p, 6).T)
    with np.errstate(all="ignore"):
        root = np.sqrt(steep)[:, None]
        return value / root[:, 0], d_value / root - 0.5 * value[:, None] * d_steep / (steep[:, None] * root)
