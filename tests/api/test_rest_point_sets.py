"""Unusual sets of points over REST: fitted or refused with a fix; what is saved can be read by all that takes it."""

import pytest
from hypothesis import HealthCheck, given, settings

from tests.support.calibration_surfaces import CAL, fitted, read_everywhere, saved, sound
from tests.support.pictures import encoded, gradient
from tests.support.point_sets import REGIONS, SETS, SIZE, TURNS, View, bodies
from tests.support.refusals import API
from tests.support.tiers import long
from touchline.fitting import FITTERS
from touchline.workflows.model_choice import AUTO

EXAMPLES = 150
ALL = (*FITTERS, AUTO)
FEW = (
    "four corners",
    "three borders",
    "one point",
    "corners at one pixel",
    "corners above the carpet",
)
HALF = View("half", 90)
READ = (("four corners", "homography"), ("four borders", "polynomial"))


@pytest.fixture(scope="module")
def snapshot(standing) -> str:
    return standing.post(
        f"{API}/snapshots", files={"file": encoded("png", gradient(*SIZE))}
    ).json()["id"]


@pytest.fixture(scope="module")
def other(standing) -> str:
    """Another calibration of the same picture."""
    return sound(standing.post(CAL, json=HALF.body(HALF.borders(), "homography")), 201)["id"]


@pytest.mark.parametrize("model", ["polynomial", "homography", *map(long, ALL[2:])])
@pytest.mark.parametrize("name", FEW)
def test_a_set_is_fitted_or_refused_with_a_fix_and_nothing_is_half_saved(
    standing, snapshot, name, model
):
    fitted(standing, HALF.body(SETS[name](HALF), model), snapshot)


@pytest.mark.parametrize("name, model", READ)
def test_what_is_saved_of_few_points_is_read_by_all_that_takes_a_calibration(
    standing, snapshot, other, name, model
):
    id = fitted(standing, HALF.body(SETS[name](HALF), model), snapshot)
    assert id is not None
    read_everywhere(standing, id, other, snapshot, is_long=False)


@pytest.mark.parametrize(
    "name", ["four corners", *map(long, [name for name in SETS if name != "four corners"])]
)
def test_models_are_compared_on_any_set_or_it_is_refused(standing, snapshot, name):
    before = saved(standing)
    models = {"models": ["polynomial", "homography"]} if name == "four corners" else {}
    sound(standing.post(f"{CAL}/compare", json=HALF.body(SETS[name](HALF), **models)))
    assert saved(standing) == before


@pytest.mark.long
@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("region", REGIONS)
@pytest.mark.parametrize("model", ALL)
def test_every_set_of_the_table_in_every_area_and_turn(
    standing, snapshot, other, model, region, turn
):
    view = View(region, turn)
    for points in SETS.values():
        id = fitted(standing, view.body(points(view), model), snapshot)
        if id is not None and turn == 90:
            read_everywhere(standing, id, other, snapshot)


@pytest.mark.long
@pytest.mark.parametrize("model", ALL)
def test_any_points_and_options_are_answered_and_read(standing, snapshot, other, model):
    @settings(max_examples=EXAMPLES, suppress_health_check=list(HealthCheck))
    @given(body=bodies([model]))
    def ask(body):
        id = fitted(standing, body, snapshot)
        if id is not None:
            read_everywhere(standing, id, other, snapshot)

    ask()
