"""Simulated rigs: calibrations that are the truth itself, and those that an operator's clicks make."""

from dataclasses import astuple, replace
from functools import cache

import numpy as np

from tests.support.pair_over_field import FIELD, FIELDS, HALVES, cameras
from tests.support.sim_clicks import border_observations, line_clicks
from tests.support.simulated_source import simulated_source
from touchline.core.geometry import with_z
from touchline.core.records import Observation
from touchline.models.ray_camera import BrownConrady
from touchline.models.rotation import vector_from_matrix
from touchline.rigs.rig import Rig, RigMember
from touchline.sources.sim.camera import BrownConrady as SimBrownConrady
from touchline.sources.sim.source import SimSource
from touchline.workflows.calibration_request import CalibrationRequest

REGIONS = {
    2: HALVES,
    4: ("quarter-bottom-left", "quarter-top-left", "quarter-bottom-right", "quarter-top-right"),
}


@cache
def true_models():
    """The two cameras of pair_over_field exactly as they are, as models."""
    made = []
    for camera, half in zip(cameras(), HALVES, strict=True):
        region = FIELD.region(half)
        assert isinstance(camera.lens, SimBrownConrady)
        terms = astuple(camera.lens)
        made.append(
            BrownConrady(
                terms,
                camera.focal_px[0],
                1.0,
                camera.centre_px,
                tuple(vector_from_matrix(np.array(camera.camera_from_field))),
                camera.position_mm,
                900.0,
                1200.0,
                8,
                10,
                region,
                camera.image_size,
            )
        )
    return tuple(made)


@cache
def sim_source(count: int, number: int, seed: int = 1, robots: int = 0) -> SimSource:
    """One of the cameras above a Division B field, tilted and with a barrel lens; robots would stand on the lines."""
    return simulated_source(
        f"sim://ssl-div-b?cameras={count}&camera={number}&lens=half&tilt=6&fill=0.86&seed={seed}"
        f"&robots={robots}&fps=240",
        FIELDS,
    )


def sim_task(
    count: int,
    number: int,
    seed: int = 0,
    model: str = "brown-conrady",
    noise_px: float = 0.3,
    options: dict | None = None,
) -> CalibrationRequest:
    """What an operator clicks: 12 places on each border, and the centre circle, to 0.3 px."""
    camera, region = sim_source(count, number).camera, FIELD.region(REGIONS[count][number])
    random = np.random.default_rng([seed, number])
    clicks = list(border_observations(camera, region, 12, noise_px, random))
    circle = camera.raw_from_field(FIELD.arcs["centre-circle"].sample(25))
    circle = circle[camera.sees(circle)]
    if model != "polynomial":
        clicks.append(
            Observation("centre-circle", "line", circle + random.normal(0, noise_px, circle.shape))
        )
        for name in ("centre-line", "halfway-line"):
            points, _ = line_clicks(camera, FIELD.lines[name], 25, noise_px, random)
            if len(points) > 3:
                clicks.append(Observation(name, "line", points))
        options = {"height_mm": {"value": camera.position_mm[2], "sigma": 20.0}, **(options or {})}
    return CalibrationRequest(
        tuple(clicks), FIELD, region, camera.image_size, model, options or {}, camera=f"cam{number}"
    )


def sim_rig(
    count: int,
    seed: int = 0,
    model: str = "brown-conrady",
    options=None,
    cross_validate: bool = False,
) -> Rig:
    """A rig with calibrations from clicks."""
    members = []
    for number in range(count):
        task = sim_task(count, number, seed, model, options=(options or {}).get(number))
        calibration = task.record(task.run(cross_validate=cross_validate))
        members.append(
            RigMember(
                f"cam{number}", f"Camera {number}", REGIONS[count][number], calibration=calibration
            )
        )
    return Rig("hall", "Hall", FIELD, None, tuple(members))


def with_member(rig: Rig, number: int, **changes) -> Rig:
    """The rig with one of its cameras changed."""
    members = list(rig.cameras)
    members[number] = replace(members[number], **changes)
    return replace(rig, cameras=tuple(members))


def random_halves(seed: int, height_sigma_mm: float | None = 20.0):
    """Two cameras hung anyhow, each calibrated from clicks on its half: the calibrations, and the cameras in truth.

    height_sigma_mm: of the tape to each camera; None: the heights are not known.
    """
    random, made, cameras = np.random.default_rng(seed), [], []
    for number, half in enumerate(HALVES):
        tilt, fill = random.uniform(1, 14), random.uniform(0.75, 0.9)
        camera = simulated_source(
            f"sim://ssl-div-b?cameras=2&camera={number}&lens=half&tilt={tilt:.1f}&fill={fill:.2f}"
            f"&seed={seed + 1}&robots=0&fps=30",
            FIELDS,
        ).camera
        region = FIELD.region(half)
        circle = camera.raw_from_field(FIELD.arcs["centre-circle"].sample(25))
        circle = circle[camera.sees(circle)]
        clicks = [
            *border_observations(camera, region, 12, 0.3, random),
            Observation("centre-circle", "line", circle + random.normal(0, 0.3, circle.shape)),
            *(
                Observation(
                    name, "line", line_clicks(camera, FIELD.lines[name], 25, 0.3, random)[0]
                )
                for name in ("centre-line", "halfway-line")
            ),
        ]
        tape = (
            {}
            if height_sigma_mm is None
            else {
                "height_mm": {
                    "value": camera.position_mm[2] + random.normal(0, height_sigma_mm),
                    "sigma": height_sigma_mm,
                }
            }
        )
        task = CalibrationRequest(
            tuple(clicks),
            FIELD,
            region,
            camera.image_size,
            "brown-conrady",
            tape,
            camera=f"cam{number}",
        )
        made.append(task.record(task.run(cross_validate=False)))
        cameras.append(camera)
    return made, cameras


def apart_in_truth(models, cameras, places, z_mm: float):
    """How far two models place apart what both cameras see at places (n, 2) mm of the height z_mm, (n,) mm."""
    at = [
        model.unproject(camera.raw_from_field(with_z(places, z_mm)), z_mm)
        for model, camera in zip(models, cameras, strict=True)
    ]
    return np.linalg.norm(at[1] - at[0], axis=1)
