"""A coarse mesh says where the corrected picture comes from, to a fortieth of a pixel, and says how far it is off."""

import numpy as np
import pytest

from tests.support.examples import plain_examples
from touchline.core.errors import BadInput
from touchline.imaging.correction import (
    MAX_ERROR_PX,
    MAX_NODES,
    CorrectedView,
    correction_map,
    correction_mesh,
)
from touchline.models import MODELS

EXAMPLES = [(name, i) for name in MODELS for i, _ in enumerate(plain_examples(name))]


def example(name, i):
    return plain_examples(name)[i]


def interpolated(mesh, x, y):
    """Return what a graphics processor makes of the nodes, at corrected pixels x (w,) and y (h, 1)."""
    head = mesh.header()
    g_x = (x - head["first"][0]) / head["step"][0]
    g_y = (y - head["first"][1]) / head["step"][1]
    i = np.clip(np.floor(g_x), 0, head["columns"] - 2).astype(int)
    j = np.clip(np.floor(g_y), 0, head["rows"] - 2).astype(int)
    f, g = (g_x - i)[..., None], (g_y - j)[..., None]
    nodes = mesh.raw_px.astype(float)
    upper = nodes[j, i] * (1 - f) + nodes[j, i + 1] * f
    return upper * (1 - g) + (nodes[j + 1, i] * (1 - f) + nodes[j + 1, i + 1] * f) * g


@pytest.mark.parametrize(
    "margin_px",
    [pytest.param(0, marks=pytest.mark.long), 40, pytest.param(300, marks=pytest.mark.long)],
)
@pytest.mark.parametrize(("name", "i"), EXAMPLES)
def test_between_its_nodes_it_is_where_the_map_is(name, i, margin_px):
    model = example(name, i)
    mesh, table = correction_mesh(model, margin_px), correction_map(model, CorrectedView(margin_px))
    height, width = table.raw_x.shape
    got = interpolated(mesh, np.arange(width) - margin_px, np.arange(height)[:, None] - margin_px)
    want = np.stack([table.raw_x, table.raw_y], axis=-1)
    is_seen = ((want > 0) & (want < np.array(tuple(model.image_size)) - 1)).all(axis=-1)
    off = np.hypot(*np.moveaxis(got - want, -1, 0))[is_seen]
    assert off.max() <= mesh.error_px + 2e-3 and mesh.error_px <= MAX_ERROR_PX
    assert mesh.raw_px.nbytes < 200_000 and np.isfinite(off).all()


def test_so_many_nodes_as_were_asked_for_and_their_error():
    model = example("brown-conrady", 1)
    few, many = correction_mesh(model, 40, 9, 5), correction_mesh(model, 40, 129, 97)
    assert few.raw_px.shape == (5, 9, 2) and many.raw_px.shape == (97, 129, 2)
    assert few.error_px > 40 * many.error_px and many.error_px < 0.03
    # cells no wider than high
    assert correction_mesh(model, 0, columns=33).raw_px.shape == (26, 33, 2)
    assert correction_mesh(model, 0, rows=25).raw_px.shape[0] == 25


def test_its_outer_nodes_lie_on_the_outer_edges():
    model = example("polynomial", 0)
    mesh = correction_mesh(model, 25, 7, 4)
    head, size = mesh.header(), model.corrected_size
    corners = np.array([[-25.5, -25.5], [size.width + 24.5, size.height + 24.5]])
    np.testing.assert_allclose(
        model.raw_from_corrected(corners), [mesh.raw_px[0, 0], mesh.raw_px[-1, -1]], atol=1e-3
    )
    last = np.array(head["first"]) + np.array(head["step"]) * (6, 3)
    np.testing.assert_allclose([head["first"], last], corners)
    read = np.frombuffer(mesh.data(), "<f4").reshape(head["rows"], head["columns"], 2)
    np.testing.assert_array_equal(read, mesh.raw_px)


def test_what_is_out_of_reach_is_no_number():
    mesh = correction_mesh(example("polynomial", 0), 1000)
    assert np.isnan(mesh.raw_px).any() and mesh.error_px <= MAX_ERROR_PX


@pytest.mark.parametrize("counts", [(1, 2), (2, MAX_NODES + 1)])
def test_a_mesh_that_is_none_is_refused(counts):
    with pytest.raises(BadInput, match="is not possible"):
        correction_mesh(example("polynomial", 0), 0, *counts)
