"""Rotations as vectors and matrices: a turn by |v| about v (Rodrigues)."""

import numpy as np

from touchline.core.geometry import Array

# [eᵢ]×, each as one row of nine
UNIT_CROSS_ROWS = np.array(
    [[0, 0, 0, 0, 0, -1, 0, 1, 0], [0, 0, 1, 0, 0, 0, -1, 0, 0], [0, -1, 0, 1, 0, 0, 0, 0, 0.0]]
)


def cross_matrix(v: Array) -> Array:
    """Return [v]× (..., 3, 3): cross_matrix(v) @ w is v × w."""
    rows = np.asarray(v) @ UNIT_CROSS_ROWS
    return rows.reshape(*rows.shape[:-1], 3, 3)


def matrix_from_vector(v: Array) -> Array:
    """Return the rotation matrices (..., 3, 3) of rotation vectors (..., 3)."""
    half, k = np.linalg.norm(v, axis=-1)[..., None, None] / 2, cross_matrix(v)
    sinc = np.sinc(half / np.pi)  # sin(a/2) / (a/2), also at 0
    # sin a / a = sinc cos(a/2) and (1 - cos a) / a² = sinc² / 2
    return np.eye(3) + sinc * np.cos(half) * k + sinc**2 / 2 * (k @ k)


def vector_from_matrix(matrix: Array) -> Array:
    """Return the rotation vector of a matrix, |v| ≤ π; by way of the quaternion, which is safe near π."""
    m = matrix
    candidates = np.array([m[0, 0] + m[1, 1] + m[2, 2], m[0, 0], m[1, 1], m[2, 2]])
    largest = int(np.argmax(candidates))
    if largest == 0:
        q = np.array([1 + candidates[0], m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]])
    else:
        i = largest - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        q = np.empty(4)
        q[0] = m[k, j] - m[j, k]
        q[1 + i] = 1 + m[i, i] - m[j, j] - m[k, k]
        q[1 + j] = m[j, i] + m[i, j]
        q[1 + k] = m[k, i] + m[i, k]
    q = q / np.linalg.norm(q)
    if q[0] < 0:
        q = -q
    sine = np.linalg.norm(q[1:])
    angle = 2 * np.arctan2(sine, q[0])
    return q[1:] * (angle / sine) if sine > 1e-12 else 2 * q[1:]


def nearest_rotation(matrix: Array) -> Array:
    """Return the rotations nearest to matrices (..., 3, 3) (Frobenius); their determinant is +1."""
    u, _, vt = np.linalg.svd(matrix)
    u[..., 2] *= np.linalg.det(u @ vt)[..., None]
    return u @ vt
