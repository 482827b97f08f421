"""A true camera: OpenCV's projection, pinhole with distortion or fisheye, and where its picture was mirrored."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
NEWTON_STEPS = 8
DIFFERENCE = 1e-6


@dataclass(frozen=True)
class OpenCvCamera:
    """matrix: fx, fy, cx, cy px. distortion: OpenCV's order. rotation: camera from field (Rodrigues), mm.

    fisheye: the model of cv2.fisheye. mirrored: the driver turned left and right over, after the projection.
    """

    size: tuple[int, int]
    matrix: tuple[float, float, float, float]
    distortion: tuple[float, ...]
    rotation: tuple[float, float, float]
    translation_mm: tuple[float, float, float]
    fisheye: bool = False
    mirrored: bool = False

    @property
    def camera_matrix(self) -> Array:
        fx, fy, cx, cy = self.matrix
        return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])

    @property
    def camera_from_field(self) -> Array:
        return np.asarray(cv2.Rodrigues(np.array(self.rotation))[0], np.float64)

    @property
    def position_mm(self) -> Array:
        return -self.camera_from_field.T @ np.array(self.translation_mm)

    def project(self, points_mm: Array) -> Array:
        """Map field mm (..., 3) to px (..., 2); NaN where the picture folds back, or behind the camera."""
        points = np.asarray(points_mm, float)
        flat = points.reshape(-1, 1, 3)
        rotation, translation = np.array(self.rotation), np.array(self.translation_mm)
        rays = flat[:, 0] @ self.camera_from_field.T + translation
        if self.fisheye:
            found, _ = cv2.fisheye.projectPoints(
                flat, rotation, translation, self.camera_matrix, np.array(self.distortion)
            )
        else:
            found, _ = cv2.projectPoints(
                flat, rotation, translation, self.camera_matrix, np.array(self.distortion)
            )
        pixels = np.asarray(found, np.float64).reshape(-1, 2)
        pixels[
            (rays[:, 2] <= 0) | (np.hypot(rays[:, 0], rays[:, 1]) > self._limit * rays[:, 2])
        ] = np.nan
        if self.mirrored:
            pixels[:, 0] = self.size[0] - 1 - pixels[:, 0]
        return pixels.reshape(*points.shape[:-1], 2)

    def carpet_from_pixel(self, pixels: Array, z_mm: float = 0.0) -> Array:
        """Map px (n, 2) to field mm (n, 2) at a height; NaN where the ray does not meet it ahead."""
        pixels = np.array(pixels, float)
        if self.mirrored:
            pixels[:, 0] = self.size[0] - 1 - pixels[:, 0]
        plane = self._undistorted(pixels)
        rays = np.column_stack([plane, np.ones(len(plane))]) @ self.camera_from_field
        x, y, height = self.position_mm
        with np.errstate(all="ignore"):
            reach = (z_mm - height) / rays[:, 2]
            field = np.array([x, y]) + rays[:, :2] * reach[:, None]
            again = self.project(np.column_stack([field, np.full(len(field), z_mm)]))
            known = (
                np.abs(
                    again
                    - (pixels if not self.mirrored else pixels * (-1, 1) + (self.size[0] - 1, 0))
                ).max(axis=1)
                < 0.01
            )
        field[~((reach > 0) & known)] = np.nan
        return field

    def inside(self, pixels: Array, margin_px: float = 0.0) -> NDArray[np.bool_]:
        """Return which px (..., 2) lie in the picture."""
        with np.errstate(invalid="ignore"):
            limit = np.array(self.size) - 1 - margin_px
            return np.all((pixels >= margin_px) & (pixels <= limit), axis=-1)

    def as_json(self) -> dict[str, Any]:
        return {
            "size": list(self.size),
            "matrix": list(self.matrix),
            "distortion": list(self.distortion),
            "rotation": list(self.rotation),
            "translation_mm": list(self.translation_mm),
            "position_mm": self.position_mm.tolist(),
            "fisheye": self.fisheye,
            "mirrored": self.mirrored,
        }

    def _distorted(self, plane: Array) -> Array:
        """Map the undistorted plane (n, 2), in focal lengths, to px before any mirroring."""
        rays, zero = np.column_stack([plane, np.ones(len(plane))])[:, None], np.zeros(3)
        project = cv2.fisheye.projectPoints if self.fisheye else cv2.projectPoints
        pixels, _ = project(rays, zero, zero, self.camera_matrix, np.array(self.distortion))
        return np.asarray(pixels, np.float64).reshape(-1, 2)

    def _undistorted(self, pixels: Array) -> Array:
        """Invert _distorted by Newton's method: OpenCV's own inverses do not converge near the edge of some lenses."""
        radii = np.linspace(0, min(self._limit, 20.0) * 0.999, 2000)
        fx, _, cx, cy = self.matrix
        reached = (
            np.linalg.norm(self._distorted(np.column_stack([radii, 0 * radii])) - (cx, cy), axis=1)
            / fx
        )
        about = (pixels - (cx, cy)) / self.matrix[:2]
        wanted = np.linalg.norm(about, axis=1)
        plane = about * (np.interp(wanted, reached, radii) / np.maximum(wanted, 1e-12))[:, None]
        for _ in range(NEWTON_STEPS):
            step = DIFFERENCE * (1 + np.linalg.norm(plane, axis=1))
            by_x, by_y = (
                (self._distorted(plane + aside) - self._distorted(plane - aside))
                / (2 * step[:, None])
                for aside in (step[:, None] * axis for axis in np.eye(2))
            )
            off = self._distorted(plane) - pixels
            det = by_x[:, 0] * by_y[:, 1] - by_y[:, 0] * by_x[:, 1]
            move = (
                np.column_stack(
                    [
                        by_y[:, 1] * off[:, 0] - by_y[:, 0] * off[:, 1],
                        by_x[:, 0] * off[:, 1] - by_x[:, 1] * off[:, 0],
                    ]
                )
                / det[:, None]
            )
            with np.errstate(invalid="ignore"):
                plane = plane - np.where(np.abs(move) < 1, move, 0)
        return plane

    @cached_property
    def _limit(self) -> float:
        """Return the tangent of the angle off the axis up to which the distorted radius rises all the way."""
        if self.fisheye:
            angles = np.linspace(0, np.pi / 2 - 0.02, 1201)
            a, b, c, d = self.distortion
            falls = np.flatnonzero(
                np.diff(
                    angles
                    * (1 + angles**2 * (a + angles**2 * (b + angles**2 * (c + angles**2 * d))))
                )
                <= 0
            )
            return float(np.tan(angles[falls[0] if len(falls) else -1]))
        k1, k2, _, _, k3 = self.distortion
        radii = np.linspace(0, 6, 1201)
        falls = np.flatnonzero(
            np.diff(radii * (1 + radii**2 * (k1 + radii**2 * (k2 + radii**2 * k3)))) <= 0
        )
        return float(radii[falls[0]]) if len(falls) else np.inf
