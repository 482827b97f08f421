"""No claim of a version is held that was made false; of a good version all are that can be tried."""

import pytest

from tests.support.falsified_claims import FALSE, World, all_claims
from touchline.core.errors import FitFailed


@pytest.fixture(scope="module")
def world():
    return World(3)


@pytest.mark.parametrize("name", FALSE)
def test_a_claim_that_was_made_false_is_not_held(world, name):
    case = FALSE[name]
    try:
        claims = case.claims(world)
    except FitFailed:  # refused: then nothing is claimed
        return
    assert {claim.code for claim in claims} >= set(case.codes)
    assert case.held(claims) == []


def test_a_good_version_is_not_doubted_and_its_pictures_hold_what_it_claims(world):
    tried = [*all_claims(world, world.version, world.picture), *world.live(world.later)]
    claims = {claim.code: claim for claim in tried}
    assert {code for code, claim in claims.items() if claim.state == "held"} >= {
        "accuracy",
        "robot-tops",
        "model",
        "lines",
        "live-image",
    }
    assert not any(claim.is_problem for claim in claims.values())
