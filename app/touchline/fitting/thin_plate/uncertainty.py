"""The uncertainty of a thin-plate model: the covariance of its displacement at a lattice of places.

    (I + ds/dq) δq = z(q) + B(q) δθ - A (ε + W z + H δθ),     δθ = -C Hᵀ ε / σ_b² + what priors leave

A: the hat matrix; at fixed smoothing the spline is linear in the clicks. ε: their noise. δθ: the base's
parameters, found from the same clicks, so that the spline undoes most of their error (B, H: what they do to corrected
places, over the field and at the clicks). z: the displacement between the clicks, as large as the clicks let
expect; its size is σ² / λ at the cross-validated smoothing λ (G. Wahba, JRSS B 45 (1983)).

Stored is the covariance of δq at the lattice; a thin-plate spline through the lattice interpolates.
"""

import numpy as np

from touchline.core.geometry import Array, Mask, Points, with_z
from touchline.core.records import Fit
from touchline.fitting import Sensitivity, sensitivity_of
from touchline.fitting.thin_plate.smoothing import Constraints, SmoothingSplines, design, hat_matrix, kernel_columns
from touchline.models.thin_plate import spline_frame
from touchline.models.thin_plate_spline import Spline, kernel

LATTICE = (7, 5)  # columns, rows: finer bends than these can follow are known no better than their clicks
MARGIN = 0.05  # of the field's extent: how far outside it the lattice begins
DIGITS = 7  # of px²; every preview carries these 4,900 numbers
NODE_NAMES = tuple(f"bend_{axis}_{node}" for node in range(LATTICE[0] * LATTICE[1]) for axis in "xy")


def lattice(width_px: float, height_px: float) -> Points:
    """Return the nodes (35, 2), corrected px, over the field and a little further."""
    u, v = (np.linspace(-MARGIN, 1 + MARGIN, n) * extent
            for n, extent in zip(LATTICE, (width_px, height_px), strict=True))
    return np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)


def lattice_weights(nodes: Array, places: Array) -> Array:
    """Return (m, k): the interpolation from nodes (k, 2) to places (m, 2), both normalised, by a thin-plate spline."""
    every = Constraints(nodes, np.tile([1.0, 0.0], (len(nodes), 1)), np.zeros(len(nodes)), np.ones(len(nodes)))
    plane = design(every)[1][:, :3]
    system = np.block([[kernel(nodes, nodes), plane], [plane.T, np.zeros((3, 3))]])
    reads = np.concatenate([kernel(places, nodes), np.ones((len(places), 1)), places], axis=1)
    return np.linalg.solve(system, reads.T)[:len(nodes)].T


def node_covariance(base_fit: Fit, clicked: Points, trusted: Mask, constraints: Constraints,
                    smoother: SmoothingSplines, smoothing: float, spline: Spline, sigma_px: float | None, *,
                    unseen: bool = True) -> Array | None:
    """Return the (70, 70) covariance of δq at the lattice, corrected px, x and y of each node in turn; None where the
    base's is not known.

    clicked (n, 2): where the base sees the click of each row of known, corrected px. trusted (n,): whether the base
    rests on it. sigma_px: the noise of a click, where it is given. unseen=False leaves z out: what noise alone does, as
    repeated clicking would show.
    """
    base, covariance, sensitivity = base_fit.model, base_fit.covariance, sensitivity_of(base_fit.model)
    if covariance is None or sensitivity is None:
        return None
    likely = smoother.cross_validated()  # one that follows every click leaves nothing to read the noise off
    sigma_px = sigma_px or smoother.sigma_px(likely)
    middle, unit = spline_frame(base)
    nodes = (lattice(base.width_px, base.height_px) - middle) / unit
    value, slope = spline.with_gradient(nodes)
    hat = hat_matrix(constraints, smoother.strength(smoothing), nodes)
    at_nodes = _base_jacobian(base_fit, sensitivity, nodes * unit + middle + value).reshape(2 * len(nodes), -1)
    at_clicks = np.einsum("ni,nik->nk", constraints.directions * constraints.weights[:, None],
                          _base_jacobian(base_fit, sensitivity, clicked))
    by_base = at_nodes - hat @ at_clicks
    base_sigma = base_fit.notes["click_sigma_px"]
    from_noise = -covariance @ (at_clicks * trusted[:, None]).T / base_sigma**2
    values = from_noise @ from_noise.T * base_sigma**2
    noise = by_base @ from_noise - hat
    total = sigma_px**2 * noise @ noise.T + by_base @ _positive_semidefinite(covariance - values) @ by_base.T
    if unseen:
        size = sigma_px**2 / smoother.strength(likely)
        own = np.kron(kernel(nodes, nodes), np.eye(2))
        shared = hat @ kernel_columns(constraints, nodes).T
        total += size * _positive_semidefinite(own - shared - shared.T + hat @ design(constraints)[0] @ hat.T)
    turned = np.linalg.inv(slope / unit + np.eye(2))
    blocks = np.einsum("aij,ajbk,blk->aibl", turned, total.reshape(len(nodes), 2, len(nodes), 2), turned)
    rounding = 0.5 * 10.0**-DIGITS * len(total)  # at most so much it takes from a variance, which must stay positive
    return np.round(_positive_semidefinite(blocks.reshape(total.shape)) + rounding * np.eye(len(total)), DIGITS)


def _base_jacobian(base_fit: Fit, sensitivity: Sensitivity, corrected: Points) -> Array:
    """Differentiate a pixel's corrected place (n, 2) by the base's parameters: (n, 2, p) px; 0 beyond its horizon."""
    base = base_fit.model
    place = with_z(base.field_from_corrected(corrected))
    px_per_mm = base.corrected_from_field(np.eye(2)) - base.corrected_from_field(np.zeros((2, 2)))
    by = np.einsum("nik,ij->njk", sensitivity.field_jacobian(place, base_fit.parameter_names), px_per_mm)
    return np.where(np.isfinite(by), by, 0.0)


def _positive_semidefinite(covariance: Array) -> Array:
    """Return it symmetric, without the negative variances that rounding leaves."""
    values, vectors = np.linalg.eigh((covariance + covariance.T) / 2)
    return (vectors * np.maximum(values, 0.0)) @ vectors.T
