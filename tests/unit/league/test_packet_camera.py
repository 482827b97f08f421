"""The camera in the packet: the best that it can hold for the points, and what teams can expect of it."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.support.league_geometry import ssl_vision_image2field, vision_processor_image2field
from tests.support.sim_clicks import border_observations
from touchline.core.errors import Conflict
from touchline.core.field import Region
from touchline.core.geometry import ImageSize
from touchline.core.records import Calibration, Observation
from touchline.evaluate.approximation import approximate_camera
from touchline.evaluate.uncertainty import grid_over
from touchline.formats.ssl_vision import camera_from_wire
from touchline.league.packet import PublishingConfig, published_cameras
from touchline.league.packet_camera import packet_camera
from touchline.models import model_of
from touchline.models.contract import RECTANGLE_FIELDS
from touchline.models.ray_camera import Fisheye, Ssl
from touchline.sources.sim.camera import LENSES, SimCamera
from touchline.store.fields import load_fields
from touchline.workflows.calibration import uncertainty
from touchline.workflows.calibration_request import CalibrationRequest

FIELD = load_fields()["ssl-div-b"]
REGION = FIELD.regions["full"]
SIZE = ImageSize(1224, 1024)
ROBOT_TOP_MM = FIELD.hat_height_mm
LIMITS = {"good": 7.5, "fair": 22.5}


def camera(lens: str) -> SimCamera:
    return SimCamera.above(REGION, SIZE, LENSES[lens], height_mm=6000, tilt_deg=14, fill=0.9)


def points(lens: str):
    seen = camera(lens)
    markings = [m for m in (*FIELD.lines.values(), *FIELD.arcs.values()) if "touch" not in m.name]
    inside = [
        Observation(
            m.name, "line", raw[seen.sees(raw)] + np.random.default_rng(5).normal(0, 0.3, (1, 2))
        )
        for m in markings[2:]
        if len(raw := seen.raw_from_field(m.sample(12)))
    ]
    return (*border_observations(seen, REGION, 12, 0.3, np.random.default_rng(2)), *inside)


@cache
def calibrated(lens: str, model: str) -> Calibration:
    request = CalibrationRequest(points(lens), FIELD, REGION, SIZE, model, camera="north")
    return request.record(request.run())


def true_mm(lens: str, field_from_pixel, z_mm: float = 0.0) -> float:
    """Rms over the region in sight, of a function from raw px to field mm at that height."""
    places = grid_over(REGION).reshape(-1, 2)
    raw = camera(lens).raw_from_field(np.column_stack([places, np.full(len(places), z_mm)]))
    seen = camera(lens).sees(raw)
    return float(
        np.sqrt(np.mean(np.sum((field_from_pixel(raw[seen]) - places[seen]) ** 2, axis=1)))
    )


def received(calibration: Calibration):
    """What a team makes of the packet."""
    packet, model = packet_camera(calibration), model_of(calibration)
    read = camera_from_wire(packet.sent, FIELD)
    return packet, read.camera({name: getattr(model, name) for name in RECTANGLE_FIELDS})


@pytest.mark.parametrize("lens", ["mild", "strong", "pincushion"])
def test_its_expected_error_is_true_on_the_carpet_and_at_robot_tops(lens):
    packet, back = received(calibrated(lens, "brown-conrady"))
    told = json.loads(json.dumps(packet.to_json(), allow_nan=False))
    for z_mm, figures in ((0.0, told["expected"]), (ROBOT_TOP_MM, told["expected"]["hat"])):
        true = true_mm(lens, lambda raw, z=z_mm: back.unproject(raw, z), z_mm)
        assert 0.4 < true / figures["rms"] < 2, (z_mm, true, figures)
    assert told["expected"]["rms"] >= told["fit_expected"]["rms"] - 0.05
    assert told["level"] not in LIMITS or true_mm(lens, back.unproject) <= LIMITS[told["level"]]


@pytest.mark.parametrize("model", ["ssl", "division", "polynomial", "homography"])
def test_it_is_better_than_one_term_fitted_to_the_points_whatever_was_calibrated(model):
    """A lens with one term gives way where points are many; and models without rays know no heights."""
    _, direct = calibrated("strong", "ssl"), calibrated("strong", model)
    fitted = model_of(calibrated("strong", "ssl"))
    packet, back = received(direct)
    assert true_mm("strong", back.unproject) < true_mm("strong", fitted.unproject)
    assert packet.expected["rms"] == pytest.approx(true_mm("strong", back.unproject), rel=0.3)
    assert packet.expected["hat"]["rms"] > 0 and not packet.exact


def test_a_model_with_one_term_tells_what_it_lacks():
    report, model = calibrated("strong", "ssl").report, model_of(calibrated("strong", "ssl"))
    assert 0.7 < true_mm("strong", model.unproject) / report["sigma_mm"]["rms"] < 1.5
    assert report["verdict"]["mm"] >= report["sigma_mm"]["rms"] - 1e-9
    found = uncertainty(model, json.loads(json.dumps(report["covariance"])), REGION, 0.0, 13, 11)
    assert found["rms"] == pytest.approx(report["sigma_mm"]["rms"])  # the map is of the same error
    assert "freer" not in calibrated("strong", "ssl").lens_option()["covariance"]


@pytest.mark.parametrize(
    "spoil",
    [
        {"model": "nobody"},
        {"parameters": {}},
        {"names": []},
        {"matrix": [[-1.0]]},
        {"model": "polynomial"},
    ],
)
def test_a_foreign_fit_in_an_imported_report_is_refused_and_fitted_anew(spoil):
    calibration = calibrated("strong", "ssl")
    covariance = calibration.covariance
    spoilt = {**covariance, "freer": {**covariance["freer"], **spoil}}
    with pytest.raises(Conflict):
        uncertainty(model_of(calibration), spoilt, REGION)
    packet = packet_camera(
        replace(calibration, report={**calibration.report, "covariance": spoilt})
    )
    assert packet.expected["rms"] == pytest.approx(
        packet_camera(calibration).expected["rms"], rel=0.2
    )


@pytest.mark.parametrize("model", ["brown-conrady", "ssl"])
def test_both_programs_of_the_league_place_pixels_as_we_do(model):
    packet, back = received(calibrated("strong", model))
    pixels = np.stack(
        np.meshgrid(np.linspace(20, 1200, 12), np.linspace(20, 1000, 10)), axis=-1
    ).reshape(-1, 2)
    for z_mm in (0.0, ROBOT_TOP_MM):
        ours = back.unproject(pixels, z_mm)
        near = np.abs(ours).max(axis=1) < 6000
        for rule in (ssl_vision_image2field, vision_processor_image2field):
            off = np.linalg.norm(rule(packet.sent, pixels, z_mm) - ours, axis=1)[near]
            assert off.max() < 0.01, (rule, off.max())


def test_it_is_called_no_better_than_the_calibration_that_it_is_made_of():
    """Points left out may tell of what the expected error does not know."""
    calibration = calibrated("mild", "brown-conrady")
    assert packet_camera(calibration).level in ("good", "fair")
    poor = {**calibration.report, "verdict": {**calibration.report["verdict"], "level": "poor"}}
    assert packet_camera(replace(calibration, report=poor)).level == "poor"


def test_a_negative_term_and_its_readers_fault_are_told():
    packet, back = received(calibrated("pincushion", "brown-conrady"))
    assert back.lens_terms[0] < 0 and packet.ignored_px > 1
    (told,) = (w for w in packet.warnings("north") if w.reason == "negative-term")
    assert f"up to {packet.ignored_px:.0f} px" in told.text and told.fix
    assert all(
        w.reason != "negative-term"
        for w in received(calibrated("mild", "brown-conrady"))[0].warnings("north")
    )


def test_it_is_published_with_a_warning_up_to_the_limit_and_asked_above():
    calibration = calibrated("strong", "brown-conrady")
    judged_mm = packet_camera(calibration).judged_mm
    (one,) = published_cameras([calibration], PublishingConfig(limit_mm=judged_mm + 0.1))
    assert one.sent is not None
    assert any(
        w["reason"] == "packet-error" and "Teams receive north" in w["text"]
        for w in one.to_json()["warnings"]
    )
    (asked,) = published_cameras([calibration], PublishingConfig(limit_mm=judged_mm - 0.1))
    assert asked.sent is None and asked.problem.reason == "loss-above-limit"


def test_a_fisheye_that_sees_behind_what_a_packet_can_hold_is_sent_all_the_same():
    """One place of the picture at 93° from the axis made every camera impossible."""
    region = Region("half-left", (-6000.0, 0.0), (-4500.0, 4500.0))
    model = Fisheye(
        (0.00366, -0.0008, -0.00342, 0.00168),
        538.257,
        0.9979394770282457,
        (723.84, 532.0),
        (-3.1073387, -0.0740729, -0.3086781),
        (-4111.8, 373.1, 3046.6),
        720.0,
        1080.0,
        7,
        10,
        region,
        ImageSize(1440, 1080),
    )
    found = approximate_camera(model, Ssl, ("a",), region, ROBOT_TOP_MM, square=True)
    places = grid_over(region).reshape(-1, 2)
    pixels = model.project(np.column_stack([places, np.zeros(len(places))]))
    off = np.linalg.norm(found.unproject(pixels) - places, axis=1)
    assert found.aspect == 1 and np.sqrt(np.mean(off**2)) < 100
