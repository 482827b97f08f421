"""Which area of the field a picture shows, where that is only a part of the chosen one."""

import numpy as np
import pytest

from tests.support.auto_scenes import LENSES, fields
from touchline.core.field import BORDERS
from touchline.core.geometry import ImageSize
from touchline.core.records import Observation
from touchline.evaluate.areas import FITS_OVERLAP, NEAR_OVERLAP, better_areas, smaller_areas
from touchline.sources.sim.camera import SimCamera
from touchline.workflows.calibration_request import CalibrationRequest

FIELD = fields()["ssl-div-b"]


def camera_over(region, fill=0.92, **how):
    """Its picture is as wide as the region, or wider than that is high."""
    size = ImageSize(1224, 1024) if region.width_mm > region.height_mm else ImageSize(1024, 1224)
    return SimCamera.above(
        region, size, LENSES["mild"], height_mm=4500.0, tilt_deg=8.0, fill=fill, **how
    )


def offered(seen, chosen="full", fill=0.92, rotate=0, is_turnable=False, least=NEAR_OVERLAP, **how):
    camera = camera_over(FIELD.region(seen, rotate), fill, **how)
    found = better_areas(
        camera.raw_from_field, FIELD, FIELD.regions[chosen], camera.image_size, is_turnable, least
    )
    return [(area.region.name, area.region.rotate_deg) for area in found]


@pytest.mark.parametrize("seen", ["full", "half-left", "half-right", "quarter-top-right"])
def test_the_area_that_was_chosen_rightly_is_not_doubted(seen):
    assert offered(seen, seen) == []
    assert offered(seen, seen, 0.8) == []  # more around it
    assert offered(seen, seen, 1.05) == []  # its corners are outside the picture
    assert offered("full", seen) == []  # a part of what is seen is asked for


@pytest.mark.parametrize("rotate", [0, 90, 180, 270])
@pytest.mark.parametrize("seen", ["half-left", "half-right"])
def test_the_half_that_the_picture_shows_is_offered_as_it_is_upright_there(seen, rotate):
    for roll in (-10.0, 0.0, 12.0):
        assert offered(seen, rotate=rotate, roll_deg=roll) == [(seen, rotate)]


def test_on_a_symmetric_field_the_area_opposite_is_as_good_where_it_is_a_part_of_the_chosen_one():
    assert offered("half-left", is_turnable=True) == [("half-left", 0), ("half-right", 180)]
    assert offered("quarter-top-right", "half-right", is_turnable=True) == [
        ("quarter-top-right", 0)
    ]


def test_where_no_area_fits_better_none_is_offered():
    assert offered("full", fill=1.4) == []  # its middle
    # two thirds of the full field: the half is offered only where the full one cannot be matched, or is not known
    wide = {"fill": 0.71}
    assert (offered("half-left", least=FITS_OVERLAP, **wide), offered("half-left", **wide)) == (
        [],
        [("half-left", 0)],
    )


def test_areas_within_another_are_each_rectangle_once_and_one_of_two_that_are_turned_into_each_other():
    of_2008 = fields()["ssl-2008"]
    assert [area.name for area in smaller_areas(of_2008, of_2008.regions["full"])][:3] == [
        "half-left",
        "quarter-bottom-left",
        "quarter-top-left",
    ]
    assert {area.rotate_deg for area in smaller_areas(of_2008, of_2008.region("full", 90))} == {90}
    assert "half-right" not in {
        area.name for area in smaller_areas(of_2008, of_2008.regions["half"])
    }


def test_a_report_of_points_says_that_the_chosen_area_is_not_in_the_picture_and_names_the_right_one():
    """Half a field, of which an operator chose the full one and clicked what is seen of its lines."""
    camera, full, noise = (
        camera_over(FIELD.region("half-right", 90)),
        FIELD.regions["full"],
        np.random.default_rng(5),
    )

    def clicked(name, line):
        raw = camera.raw_from_field(line.sample(40))
        raw = raw[camera.sees(raw)][2:-2:2] + noise.normal(0, 0.2, (1, 2))
        return Observation(name, "line", raw)

    lines = [
        clicked(name, FIELD.feature(name, full))
        for name in (*BORDERS, "halfway-line", "centre-circle")
    ]
    request = CalibrationRequest(
        tuple(line for line in lines if len(line.points) > 3),
        FIELD,
        full,
        camera.image_size,
        "division",
    )
    done = request.preview(cross_validate=False)
    assert [warning["reason"] for warning in done.report["warnings"]].count(
        "area-not-in-image"
    ) == 1
    assert done.report["areas"] == [
        {"region": "half-right", "rotate": 90, "seen_share": pytest.approx(1.0)}
    ]
