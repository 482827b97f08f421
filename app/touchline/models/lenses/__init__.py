"""Lenses: distortion functions alone, one file each. A lens maps a ray to the normalised image plane, and back.

    plane = distort(terms, ray)         ray (X, Y, Z) in the camera's frame, any length; plane (…, 2), in focal lengths
    ray   = undistort(terms, plane)     of unit depth where Z > 0

A lens is a class without state: TERMS names its coefficients in order, and each function takes their values. Beyond
the horizon, where the picture would fold back on itself, the result is NaN. Tests check the derivatives by complex
step. To add one: write its file here, then a model that uses it (touchline/models/__init__.py).
"""

from typing import ClassVar, Protocol

from touchline.core.geometry import Array


class Lens(Protocol):
    TERMS: ClassVar[tuple[str, ...]]
    # of the radius, that each term grows with: 2 for k1 of x (1 + k1 r²)
    POWERS: ClassVar[tuple[int, ...]]
    # pairs of terms that are x and y of one vector in the picture, which turns with it
    VECTORS: ClassVar[tuple[tuple[str, str], ...]]

    @classmethod
    def power(cls, name: str) -> int:
        """Return a term's power by its name; 0 for what is no term, such as the centre."""

    @classmethod
    def at_scale(cls, terms: Array, log_scale: float) -> tuple[Array, Array, Array]:
        """Return the terms that bend a picture likewise at a focal length e^s as long, and d/d terms (k, k), d/d s."""

    @classmethod
    def rescaled(cls, terms: Array, step: Array, log_scale: float) -> Array:
        """Return terms + step to first order, for a focal length e^log_scale as long: see PowerTerms."""

    @classmethod
    def turned(cls, terms: Array, rotation: Array) -> Array:
        """Return the terms of the same lens in a turned picture: distort(turned, R ray) = R distort(terms, ray)."""

    @staticmethod
    def distort(terms: Array, rays: Array) -> Array:
        """Map rays (…, 3) to the plane (…, 2)."""

    @staticmethod
    def distort_jacobian(terms: Array, rays: Array) -> tuple[Array, Array, Array]:
        """Return plane (…, 2), its derivative by the ray (…, 2, 3), and by the terms (…, 2, n)."""

    @staticmethod
    def undistort(terms: Array, plane: Array) -> Array:
        """Map the plane (…, 2) to rays (…, 3)."""
