"""What is claimed of a version and of a site: each claim, and what makes it false; nothing unknown is held."""

from dataclasses import dataclass, replace
from itertools import product
from types import SimpleNamespace

import pytest

from touchline.core.records import Warning
from touchline.drift.service import another_cameras, ends_claim, lines_claim, live_claim
from touchline.evaluate.claims import (
    Claim,
    difference_claims,
    field_claims,
    gate_of,
    mm,
    problems,
    report_claims,
)
from touchline.evaluate.field_lines.orientation import Orientation
from touchline.evaluate.site_claims import SiteCamera, camera_claims
from touchline.league.claims import packet_claim, publishing_claim
from touchline.rigs.verdict import CheckedLevel, neighbour_claim, rig_claim

GOOD = {
    "verdict": {"mm": 0.4, "level": "good", "sentence": "Accurate."},
    "rms_px": 0.21,
    "cv_rms_mm": 0.5,
    "sigma_mm": {
        "rms": 0.4,
        "rms_95": 0.6,
        "hat": {"rms": 1.2, "rms_95": 1.8, "z_mm": 150.0, "known": True},
    },
    "camera": {"height_mm": 5040.0, "tilt_deg": 6.2},
    "warnings": [],
}


def version(report=None, **more):
    """A version as far as claims read it, with its report changed."""
    known = {
        "report": {**GOOD, **(report or {})},
        "model_name": "brown-conrady",
        "observations": ({"feature": "top"},),
        "field": {"name": "hall"},
        "region": "full",
        **more,
    }
    return SimpleNamespace(**known)


def claims(report=None, **more):
    return {claim.code: claim for claim in report_claims(version(report, **more))}


def warned(reason):
    return {"warnings": [{"reason": reason, "text": "So it is.", "fix": "Mend it."}]}


def hat(**values):
    return {"sigma_mm": {**GOOD["sigma_mm"], "hat": {**GOOD["sigma_mm"]["hat"], **values}}}


def levelled(carpet, tops):
    return {"verdict": {**GOOD["verdict"], "levels": {"carpet": carpet, "robot_tops": tops}}}


def test_a_good_report_holds_all_that_was_tried():
    assert {code: claim.state for code, claim in claims().items()} == dict.fromkeys(
        ("accuracy", "robot-tops", "model", "height"), "held"
    )
    assert gate_of(tuple(claims().values())) == "ready"


@pytest.mark.parametrize(
    ("report", "code", "state", "gates"),
    [
        (
            {"verdict": {"mm": 7.0, "level": "fair", "sentence": "Usable."}},
            "accuracy",
            "refuted",
            False,
        ),
        (
            {"verdict": {"mm": 209.0, "level": "poor", "sentence": "Not."}},
            "accuracy",
            "refuted",
            True,
        ),
        # its own, at least
        (
            {"verdict": {"mm": 3.0, "level": "poor", "sentence": "Not."}},
            "accuracy",
            "refuted",
            True,
        ),
        (
            {"verdict": {"mm": None, "level": "unknown", "sentence": "Unknown."}},
            "accuracy",
            "not-tested",
            True,
        ),
        ({"verdict": {}}, "accuracy", "not-tested", True),
        ({"sigma_mm": {"rms": 0.4, "rms_95": 30.0}}, "accuracy", "refuted", True),
        (
            levelled("poor", "good"),
            "accuracy",
            "refuted",
            True,
        ),  # by something else than this figure
        (levelled("good", "fair"), "robot-tops", "refuted", False),
        (hat(rms=9.0), "robot-tops", "refuted", False),
        (hat(rms=40.0), "robot-tops", "refuted", True),
        (hat(rms=40.0, known=False), "robot-tops", "not-tested", True),
        ({"sigma_mm": None}, "robot-tops", "not-tested", False),
        ({"camera": None}, "height", "not-tested", False),
        ({"height": {"state": "not-checked"}}, "height", "not-tested", False),
        ({"rms_px": None}, "model", "not-tested", False),
        (warned("lens-ends"), "model", "refuted", True),
        (warned("another-lens"), "model", "refuted", True),
        (warned("residuals-too-large"), "model", "refuted", True),
        (warned("unusual-principal-point"), "model", "refuted", False),
        (warned("unusual-aspect"), "model", "refuted", False),
        (warned("height-contradicted"), "height", "refuted", True),
        (warned("implausible-camera"), "height", "refuted", True),
        (warned("unusual-height"), "height", "refuted", True),
        (warned("height-unknown"), "height", "not-tested", False),
    ],
)
def test_what_a_report_says_against_itself_is_read(report, code, state, gates):
    claim = claims(report)[code]
    assert (claim.state, claim.gates) == (state, gates)
    assert gate_of(tuple(claims(report).values())) != "ready" or (not gates and state == "refuted")
    assert bool(problems(claims(report).values())) is gates
    assert problems(claims(report).values(), despite=[code]) == ()


def test_nothing_is_held_by_nothing():
    with pytest.raises(AssertionError):
        Claim("anything", "held", "All is well")
    assert gate_of([Claim("a", "not-tested", "A")]) == "not-tested"
    # told, and no reason to ask
    assert gate_of([Claim("a", "refuted", "A", tried=("it",))]) == "ready"


@pytest.mark.parametrize(
    ("changes", "field", "region", "active", "found"),
    [
        ((), None, None, None, {}),
        ((), "hall", "full", None, {"region": "held"}),
        ((), "hall", "half-left", None, {"region": "refuted"}),
        ((), "other", "full", None, {"camera-field": "refuted"}),
        ((), None, None, version(region="half-left"), {"region": "refuted"}),
        ((), None, None, version(field={"name": "other"}), {"camera-field": "refuted"}),
        (("halfway-line",), "hall", "full", None, {"field": "refuted", "region": "held"}),
    ],
)
def test_a_version_of_another_field_or_area_than_its_camera_is_told(
    changes, field, region, active, found
):
    told = list(field_claims(version(), changes, field, region, active))
    assert {claim.code: claim.state for claim in told} == found
    assert all(claim.gates for claim in told if claim.state == "refuted")


def seen_as(state, way=None):
    return Orientation(state, way, {})


@pytest.mark.parametrize(
    ("found", "former", "state"),
    [
        (None, None, "not-tested"),
        (seen_as("unknown"), 3, "not-tested"),
        (seen_as("confirmed"), 3, "held"),
        (seen_as("contradicted", "turned"), 3, "refuted"),
        (seen_as("contradicted", "mirrored"), 3, "refuted"),
    ],
)
def test_which_goal_is_at_which_end_is_held_only_where_the_active_version_says_so(
    found, former, state
):
    claim = ends_claim(found, former)
    assert (claim.state, claim.is_problem) == (state, state == "refuted")


def checked(level, reason="", **more):
    return {
        "verdict": {
            "lines_level": level,
            "reason": reason,
            "sentence": "So it is.",
            "fix": "Mend it.",
        },
        "found_share": 0.9,
        "lines_found": 8,
        "missing": [],
        "p95_mm": 2.0,
        "change": None,
        "orientation": "unknown",
        "lines": [{"feature": "left", "worst_mm": 3.0}, {"feature": "top", "worst_mm": 17.2}],
        **more,
    }


@pytest.mark.parametrize(
    ("found", "state", "gates"),
    [
        (checked("good"), "held", False),
        (checked("fair"), "refuted", False),
        (checked("poor"), "refuted", True),
        (checked(None), "not-tested", False),
        (checked("poor", "elsewhere"), "refuted", True),
        (checked("fair", missing=["left", "centre-circle"]), "refuted", False),
    ],
)
def test_the_lines_of_a_picture_hold_a_version_or_do_not(found, state, gates):
    for claim in (lines_claim(found), live_claim(found)):
        assert (claim.state, claim.gates) == (state, gates) or (
            found["missing"] and claim.code == "live-image"
        )
    assert (
        lines_claim(checked("poor")).figure == mm(17.2)
        and "top border" in lines_claim(checked("poor")).evidence
    )
    assert "centre circle" in lines_claim(checked("fair", missing=["centre-circle"])).evidence


def test_a_live_image_that_is_turned_or_another_cameras_is_told_though_its_lines_fit():
    turned = live_claim(checked("good", "turned", orientation="contradicted", change={"mm": 0.3}))
    assert turned.figure is None  # its lines are near others
    assert turned.is_problem and turned.evidence == "So it is." and turned.fix == "Mend it."
    assert not live_claim(checked("good", orientation="confirmed")).is_problem
    other = another_cameras("north", "South")
    assert other.is_problem and "South" in other.evidence and other.fix and other.camera == "north"


def test_the_active_version_and_neighbours_are_compared_with():
    lens = {"focal_ratio": 1.0004, "max_px": 0.4}
    same, apart = (
        {"median_mm": 0.2, "max_mm": 0.6, "lens": lens},
        {"median_mm": 3.0, "max_mm": 9.0, "lens": {**lens, "max_px": 5.0}},
    )
    assert [claim.state for claim in difference_claims(same, 3)] == ["held", "held"]
    assert [claim.state for claim in difference_claims(apart, 3)] == ["refuted", "refuted"]
    nothing = difference_claims({"median_mm": None, "max_mm": None, "lens": None}, 3)
    assert [(claim.code, claim.state) for claim in nothing] == [("difference", "not-tested")]


@pytest.mark.parametrize(
    ("p95_mm", "own", "apart_mm", "state", "gates"),
    [
        (2.0, [], 2.0, "held", False),
        (8.0, [], 8.0, "refuted", False),
        (40.0, [], 40.0, "refuted", True),
        (2.0, ["poor"], 2.0, "refuted", True),
        (2.0, ["fair"], 2.0, "refuted", False),
    ],
)
def test_a_version_agrees_with_its_neighbour_as_far_as_both_are_good_and_near(
    p95_mm, own, apart_mm, state, gates
):
    found = {"carpet": {"p95_mm": p95_mm}, "median_mm": apart_mm, "overlap_m2": 3.0}
    claim = neighbour_claim("east", "East", found, own)
    assert (claim.state, claim.gates, claim.code) == (state, gates, "neighbour-east")


def test_what_teams_receive_is_held_only_where_its_error_is_known():
    sent = {
        "problem": None,
        "expected": {"rms": 1.0, "hat": {"rms": 2.0, "z_mm": 150.0, "known": True}},
        "loss": {"worst_mm": 3.0},
        "level": "good",
        "asked": False,
        "warnings": [],
    }
    assert packet_claim(sent).state == "held"
    assert packet_claim({**sent, "level": "fair"}).state == "refuted"
    assert "off by 27 mm" in packet_claim({**sent, "level": "poor"}, 27.3).evidence
    unknown = packet_claim({**sent, "expected": None})
    assert unknown.state == "not-tested" and unknown.figure == mm(3.0, at_most=True)
    refused = packet_claim({**sent, "problem": {"what": "It cannot be.", "fix": "Use another."}})
    assert refused.state == "refuted" and not refused.gates


STEADY = {"state": "steady", "alarm": False, "sentence": "No movement.", "fix": ""}
NORTH = SiteCamera("north", "North", "live", None, True, "good", 0.4, (), STEADY)


AGREED = CheckedLevel(True, "good", 1.2)


@dataclass(frozen=True)
class OneRig:
    """A rig with its newest check."""

    name: str = "all"
    newest: CheckedLevel = AGREED
    troubles: tuple = ()

    def checked(self, **changes):
        return replace(self, newest=replace(self.newest, **changes))


RIG = OneRig()


def site(cameras=(NORTH,), rigs=(RIG,), state="on-air", warnings=()):
    claims = [
        *camera_claims(cameras),
        *(rig_claim(one.name, "All", one.newest, one.troubles) for one in rigs),
        publishing_claim(state, warnings),
    ]
    return {claim.code: claim for claim in claims}


def test_a_site_is_ready_where_all_was_tried():
    assert gate_of(tuple(site().values())) == "ready"
    assert {claim.state for claim in site().values()} == {"held"}


@pytest.mark.parametrize(
    ("camera", "code", "state"),
    [
        ({"state": "offline"}, "cameras-live", "refuted"),
        ({"state": "mismatch"}, "cameras-live", "refuted"),
        ({"state": "idle"}, "cameras-live", "not-tested"),
        ({"state": "connecting"}, "cameras-live", "not-tested"),
        ({"active": False}, "cameras-calibrated", "refuted"),
        ({"level": "poor"}, "cameras-calibrated", "refuted"),
        ({"level": "poor", "length_mm": None}, "cameras-calibrated", "refuted"),
        ({"level": "unknown"}, "cameras-calibrated", "not-tested"),
        ({"drift": None}, "cameras-in-place", "not-tested"),
        *(
            ({"drift": {**STEADY, "state": state}}, "cameras-in-place", "not-tested")
            for state in ("learning", "unfollowed", "covered", "dark")
        ),
        *(
            ({"drift": {**STEADY, "state": state, "alarm": True}}, "cameras-in-place", "refuted")
            for state in ("knocked", "misplaced", "replaced", "out-of-focus")
        ),
    ],
)
def test_one_camera_of_two_that_is_not_as_it_should_be_keeps_a_site_from_being_ready(
    camera, code, state
):
    for cameras in ([replace(NORTH, **camera), NORTH], [NORTH, replace(NORTH, **camera)]):
        found = site(cameras)
        assert found[code].state == state and "North" in found[code].evidence
        assert gate_of(tuple(found.values())) == (
            "problems" if state == "refuted" else "not-tested"
        )


def test_a_site_without_cameras_or_with_a_rig_that_nobody_could_compare_is_not_ready():
    assert gate_of(tuple(site(()).values())) == "not-tested"
    for rig in (
        OneRig(newest=CheckedLevel()),
        OneRig(newest=CheckedLevel(True)),
        RIG.checked(outdated="North has moved."),
    ):
        assert site(rigs=[rig])["rig-all"].state == "not-tested"
    assert site(rigs=[RIG.checked(level="poor")])["rig-all"].is_problem
    assert site(rigs=[RIG.checked(level="poor", outdated="So.")])["rig-all"].state == "not-tested"
    second = replace(RIG.checked(level="poor"), name="second")
    assert site(rigs=[RIG, second])["rig-second"].is_problem  # each of them counts


def test_each_camera_that_refutes_a_claim_is_told_with_what_to_do():
    gone = {"reason": "no-file", "what": "No file.", "fix": "Bring it."}
    moved = {
        **STEADY,
        "state": "knocked",
        "alarm": True,
        "sentence": "It moved.",
        "fix": "Update it.",
    }
    for change, code, told in (
        ({"state": "offline", "problem": gone}, "cameras-live", ("No file.", "Bring it.")),
        ({"drift": moved}, "cameras-in-place", ("It moved.", "Update it.")),
    ):
        bad = replace(NORTH, id="south", title="South", **change)
        found = site([NORTH, bad, replace(bad, id="east", title="East")])[code]
        assert [(one.text, one.fix, one.camera) for one in found.cases] == [
            (f"{title}: {told[0]}", told[1], title.lower()) for title in ("South", "East")
        ]
        assert found.to_json()["cases"][0]["statements"]["text"] == [
            {"text": "South:"},
            {"text": told[0]},
        ]
    poor = site([replace(NORTH, level="poor")])["cameras-calibrated"]
    assert [(one.camera, bool(one.fix)) for one in poor.cases] == [("north", True)]
    assert not any(claim.cases for claim in site().values())


def test_a_rig_whose_cameras_do_not_fit_together_does_not_agree_whatever_its_check_says():
    trouble = {
        "camera": "north",
        "reason": "other-region",
        "text": "It has another area.",
        "fix": "Change the rig.",
        "level": None,
    }
    found = site(rigs=[OneRig(troubles=(trouble,))])["rig-all"]
    assert (found.state, found.gates, found.cases[0].fix) == ("refuted", False, "Change the rig.")
    assert site(rigs=[OneRig(troubles=(trouble,)).checked(level="poor")])["rig-all"].gates


def test_publishing_that_fails_stands_against_a_match_and_none_does_not():
    for state, title in (("failing", "Not publishing"), ("on-air", "Publishing has problems")):
        warned = site(
            state=state, warnings=[Warning("two-publishers", "Another sends it.", "Stop one.")]
        )
        assert warned["publishing"].is_problem and warned["publishing"].title == title
        assert [(one.text, one.fix) for one in warned["publishing"].cases] == [
            ("Another sends it.", "Stop one.")
        ]
    off = site(state="off")
    assert off["publishing"].state == "refuted" and gate_of(tuple(off.values())) == "ready"


def test_what_stands_against_the_field_of_an_active_version_is_told_once_for_all_cameras():
    against = tuple(field_claims(version(), ("halfway-line",), "hall", "half-left", None))
    found = site([replace(NORTH, against=against), replace(NORTH, title="South", against=against)])
    assert {code for code, claim in found.items() if claim.is_problem} == {
        "cameras-field",
        "cameras-region",
    }
    assert found["cameras-field"].evidence == "North, South"
    assert [one.text for one in found["cameras-field"].cases] == [
        f"{name}: It was calibrated before its field was changed: halfway line."
        for name in ("North", "South")
    ]


@pytest.mark.parametrize(
    ("state", "gates"), list(product(("held", "refuted", "not-tested"), (True, False)))
)
def test_only_what_gates_and_is_not_held_is_a_problem(state, gates):
    claim = Claim("it", state, "It is so", tried=("looking",), gates=gates)
    assert claim.is_problem is (gates and state != "held")
    assert claim.to_json()["state"] == state
