"""One picture of all cameras: lines in place, seams without a step, holes that are said; and lines looked for."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.rig_over_field import FIELD, sim_rig, sim_source, true_models, with_member
from touchline.core.errors import BadInput, Cancelled, FitFailed
from touchline.evaluate.agreement import agreement
from touchline.rigs.check import check
from touchline.rigs.evidence import from_pictures, marking_places
from touchline.rigs.mosaic import FieldView, Stitcher, stitcher_of
from touchline.rigs.rig import Rectangles, rig_status

VIEW = FieldView(FIELD, 700)


@pytest.fixture(scope="module")
def rig():
    return sim_rig(2)


def flat(count, level):
    return [np.full((1024, 1280, 3), level, np.uint8) for _ in range(count)]


# shares of white, each rounded up, would be more than white
@pytest.mark.parametrize("level", [120, 255])
def test_one_brightness_stays_one_brightness_across_every_seam(rig, level):
    made, names = stitcher_of(rig, ("cam0", "cam1"), VIEW)
    assert names == ["cam0", "cam1"]
    seen = made.stitch(flat(2, level))[~made.unseen]
    # bilinear at the very rim of a raw picture takes in some of what is beyond it
    assert np.mean(np.abs(seen.astype(int) - level) > 1) < 2e-3
    seam = made.stitch(flat(2, level)).reshape(-1, 3)[made.seam].astype(int)
    assert len(seam) > 1000 and (np.abs(seam - level) <= 1).all()


def test_a_seam_goes_over_without_a_step(rig):
    made, _ = stitcher_of(rig, ("cam0", "cam1"), VIEW)
    dark, bright = flat(1, 60) + flat(1, 180)
    row = made.stitch([dark, bright])[VIEW.size.height // 3, 40:-40, 0].astype(int)
    assert (
        row[0] == 60 and row[-1] == 180 and (np.diff(row) >= 0).all() and np.diff(row).max() <= 20
    )


def test_a_picture_of_the_field_that_would_take_all_memory_is_refused_and_a_cancelled_one_ends():
    with pytest.raises(BadInput) as refusal:
        FieldView(FIELD, 8192)
    assert refusal.value.reason == "bad-view" and refusal.value.fix

    def stop(share, _message):
        if share > 0.3:
            raise Cancelled("Gone.", "Ask again.")

    model, size = true_models()[0], sim_source(2, 0).camera.image_size
    with pytest.raises(Cancelled):
        Stitcher.of([(model, size, FIELD.region("half-left"))], VIEW, stop)


def test_there_and_back_is_the_same_place():
    places = np.array([[-4500.0, 3000.0], [0.0, 0.0], [1234.5, -2000.0]])
    assert np.abs(VIEW.field_from_view(VIEW.view_from_field(places)) - places).max() < 1e-9


def test_the_corners_are_the_places_of_the_first_and_the_last_pixel():
    corners = VIEW.view_from_field(np.array(VIEW.field_from_view_corner()))
    np.testing.assert_allclose(
        corners, [[0, 0], [VIEW.size.width - 1, VIEW.size.height - 1]], atol=1e-9
    )


def test_what_nobody_sees_is_said_with_its_place(rig):
    made, names = stitcher_of(rig, ("cam0",), VIEW)
    told = made.unseen_summary()
    assert names == ["cam0"] and 0.1 < told["share"] < 0.5 and told["where"]["x"][1] > 4400
    assert (
        told["m2"] == pytest.approx(54 * told["share"])
        and "not covered by any camera" in told["words"]
    )
    with pytest.raises(FitFailed):
        Stitcher.of([], VIEW)


def test_places_on_markings_keep_clear_of_each_other():
    places, normals, widths = marking_places(FIELD)
    assert (
        len(places) > 200
        and np.allclose(np.linalg.norm(normals, axis=1), 1)
        and (widths == 10).all()
    )
    # no place at the centre, where two lines cross
    assert np.linalg.norm(places, axis=1).min() > 150
    bare = replace(FIELD, lines={}, arcs={})
    assert [part.shape for part in marking_places(bare)] == [(0, 2), (0, 2), (0,)]


def test_lines_in_pictures_tell_which_camera_was_knocked_and_how_far(rig):
    a, b = (model for model in true_models_of_sim())
    pictures = [sim_source(2, number).read().pixels for number in (0, 1)]
    size = sim_source(2, 0).camera.image_size
    good = agreement(a, size, b, size, FIELD, from_pictures(a, pictures[0], b, pictures[1], FIELD))
    assert good["carpet"]["mean_mm"] < 1.5
    x, y, z = b.position_mm
    moved = replace(b, position_mm=(x + 30.0, y, z))
    found = agreement(
        a, size, moved, size, FIELD, from_pictures(a, pictures[0], moved, pictures[1], FIELD)
    )
    assert found["carpet"]["mean_mm"] == pytest.approx(30, rel=0.1)
    assert found["own_mm"]["a"] < 2 and found["own_mm"]["b"] > 10


def true_models_of_sim():
    """The two cameras of sim_source exactly as they are."""
    from dataclasses import astuple, replace

    from touchline.models.rotation import vector_from_matrix

    for number, model in enumerate(true_models()):
        camera = sim_source(2, number).camera
        yield replace(
            model,
            lens_terms=astuple(camera.lens),
            focal_px=camera.focal_px[0],
            centre_px=camera.centre_px,
            rotation=tuple(vector_from_matrix(np.array(camera.camera_from_field))),
            position_mm=camera.position_mm,
        )


def test_how_each_camera_stands_to_the_rig_is_told_with_its_cure(rig):
    wrong = with_member(with_member(rig, 0, calibration=None), 1, region="half-left")
    wrong = replace(wrong, given=Rectangles(50.0, 50.0, 9, 12))
    told = rig_status(wrong)
    assert [[t["reason"] for t in c["troubles"]] for c in told["cameras"]] == [
        ["not-calibrated"],
        ["other-region", "other-rectangles"],
    ]
    assert all(t["fix"] for c in told["cameras"] for t in c["troubles"])
    assert check(wrong, {})["verdict"]["level"] is None
