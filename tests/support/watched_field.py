"""A simulated field with robots, watched through its own exact lens: what the stages say beside what is true."""

from dataclasses import dataclass

import numpy as np

from tests.support.sim_truth import truth_at
from touchline.core.geometry import ImageSize
from touchline.detection.colours import learn_profile
from touchline.detection.records import FieldLocator
from touchline.detection.stages import StageContext, StagePipeline
from touchline.detection.store import load_plans
from touchline.sources.sim.actors import Motion
from touchline.sources.sim.camera import LENSES, SimCamera
from touchline.sources.sim.ground import Lamps, Light
from touchline.sources.sim.render import Rendering, Sensor
from touchline.store.fields import load_fields

FIELDS = load_fields()
DRIFT_S = 60.0  # the simulated light comes and goes within that


@dataclass(frozen=True)
class ExactModel:
    """The simulated camera as a camera model has it, without any error of its own."""

    camera: SimCamera

    @property
    def image_size(self):
        return self.camera.image_size

    def unproject(self, pixels, z_mm=0.0):
        return self.camera.field_from_raw(pixels, z_mm)


def exact_view(camera: SimCamera) -> FieldLocator:
    """What stages ask of a calibration that is exactly the simulated camera."""
    return FieldLocator(camera.image_size, ExactModel(camera), has_rays=True)


def world(
    field="ssl-div-b",
    *,
    size=(1920, 1080),
    robots=16,
    seed=1,
    drift=0.4,
    noise=4.0,
    shuffled=True,
    gain=1.0,
    speed_mm_s=1500.0,
    blue_mm=None,
) -> Rendering:
    """A camera straight above the whole field, its light coming and going by the drift."""
    field = FIELDS[field]
    region = field.regions["full"]
    height_mm = 0.7 * float(np.hypot(region.width_mm, region.height_mm))
    camera = SimCamera.above(region, ImageSize(*size), LENSES["mild"], height_mm=height_mm)
    return Rendering.of(
        camera,
        field,
        region,
        Motion(robots=robots, seed=seed, speed_mm_s=speed_mm_s, shuffled=shuffled, blue_mm=blue_mm),
        Light(gain=gain),
        Sensor(noise=noise),
        Lamps(drift=drift),
    )


def colour_clicks(rendering: Rendering, time_s=0.0, per_colour=5):
    """What an operator would click in the frame at that time, at most so often a colour: by the truth, in raw px."""
    from touchline.core.ssl_pattern import DOTS_MM, GREEN

    truth = truth_at(rendering, time_s)
    places: dict[str, list[tuple[float, float, float]]] = {
        c: [] for c in ("orange", "yellow", "blue", "pink", "green")
    }
    if truth.ball and truth.ball.seen > 0.8:
        places["orange"].append((truth.ball.x_mm + 5, truth.ball.y_mm - 5, truth.ball.z_mm))
    small = rendering.field.hat_height_mm < 100
    for robot in truth.robots:
        c, s = np.cos(robot.angle), np.sin(robot.angle)

        def spot(ahead, left, robot=robot, c=c, s=s):
            return robot.x_mm + c * ahead - s * left, robot.y_mm + s * ahead + c * left, robot.z_mm

        if small:
            names = ("green", "pink", "cyan", "purple", "red")
            places[robot.team].append(spot(0, 18.7))
            places.setdefault(names[robot.number % 5], []).append(spot(0, -18.7))
            continue
        places[robot.team].append(spot(0, 0))
        for (ahead, left), green in zip(DOTS_MM, GREEN[robot.number % 16], strict=True):
            places["green" if green else "pink"].append(spot(ahead, left))
    raw = {
        name: rendering.camera.raw_from_field(np.array(spots))
        for name, spots in places.items()
        if spots
    }
    return {
        name: [tuple(map(float, p)) for p in pixels[:per_colour]] for name, pixels in raw.items()
    }


def sight_of(rendering: Rendering, plan="ssl", time_s=0.0, frame=0, tops_mm=None) -> StagePipeline:
    """Learned from at most five clicks a colour in the first frame. tops_mm: of teams whose robots are known."""
    pixels = rendering.frame_at(frame, time_s)
    profile = learn_profile("here", [(pixels, colour_clicks(rendering, time_s))])
    field = rendering.field
    setting = StageContext(
        rendering.camera.image_size,
        profile,
        exact_view(rendering.camera),
        field.hat_height_mm,
        field.extras.get("ball", {"radius_mm": 21.5})["radius_mm"],
        team_z_mm=tops_mm or {},
    )
    return StagePipeline(load_plans()[plan], setting)


@dataclass
class Score:
    """Counted over frames: what was off, and what was not seen though it could be."""

    off_mm: list
    turned_deg: list
    ball_mm: list
    wrong: int = 0
    unnamed: int = 0
    missed: int = 0
    invented: int = 0
    robots: int = 0
    balls: int = 0
    balls_missed: int = 0
    balls_invented: int = 0

    @classmethod
    def fresh(cls):
        return cls([], [], [])


def scored(score: Score, seen, truth, near_mm=100.0) -> None:
    """Each robot that can be seen beside the nearest that was told."""
    left = list(seen.detections.of("robot"))
    for robot in truth.robots:
        if robot.seen < 0.99:
            continue
        score.robots += 1
        near = [d for d in left if np.hypot(d.x_mm - robot.x_mm, d.y_mm - robot.y_mm) < near_mm]
        if not near:
            score.missed += 1
            continue
        best = min(near, key=lambda d: np.hypot(d.x_mm - robot.x_mm, d.y_mm - robot.y_mm))
        left.remove(best)
        score.off_mm.append(float(np.hypot(best.x_mm - robot.x_mm, best.y_mm - robot.y_mm)))
        turned = np.degrees(best.orientation_rad - robot.angle)
        score.turned_deg.append(abs(float((turned + 180) % 360 - 180)))
        if best.id is None:
            score.unnamed += 1
        elif (best.team, best.id) != (robot.team, robot.number):
            score.wrong += 1
    hidden = [r for r in truth.robots if r.seen < 0.99]
    score.invented += sum(
        all(np.hypot(d.x_mm - r.x_mm, d.y_mm - r.y_mm) > near_mm for r in hidden) for d in left
    )
    ball = seen.detections.of("ball")
    if truth.ball and truth.ball.seen >= 0.9:
        score.balls += 1
        if ball:
            off = float(np.hypot(ball[0].x_mm - truth.ball.x_mm, ball[0].y_mm - truth.ball.y_mm))
            (score.ball_mm if off < near_mm else [None]).append(off)
            score.balls_invented += off >= near_mm
        else:
            score.balls_missed += 1
    elif (
        truth.ball
        and ball
        and np.hypot(ball[0].x_mm - truth.ball.x_mm, ball[0].y_mm - truth.ball.y_mm) > near_mm
    ):
        score.balls_invented += 1


def calibration_of(rendering: Rendering, noise_px: float = 0.5):
    """What an operator would have made of this camera: Brown–Conrady on clicks along every line, and a tape."""
    from touchline.core.records import Observation
    from touchline.workflows.calibration_request import CalibrationRequest

    rng, camera = np.random.default_rng(5), rendering.camera
    seen = []
    for marking in rendering.field.markings:
        raw = camera.raw_from_field(marking.sample(14))
        seen.append(Observation(marking.name, "line", raw + rng.normal(0, noise_px, raw.shape)))
    task = CalibrationRequest(
        tuple(seen),
        rendering.field,
        rendering.region,
        camera.image_size,
        "brown-conrady",
        {"height_mm": {"value": camera.position_mm[2], "sigma": 15.0}},
    )
    return task.record(task.run(cross_validate=False))
