"""Random scenes for calibration without clicks: a field, a camera above it, a lens, light, robots and people."""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from tests.support.sim_truth import truth_at
from touchline.core.errors import BadInput
from touchline.core.field import Field, Region
from touchline.core.geometry import ImageSize
from touchline.core.records import Calibration
from touchline.models import field_from_raw, model_from_json
from touchline.sources.sim.actors import Motion
from touchline.sources.sim.camera import LENSES, SimCamera
from touchline.sources.sim.ground import Light
from touchline.sources.sim.render import Rendering, Sensor
from touchline.store.fields import load_fields

FIELDS = ("ssl-2008", "ssl-div-a", "ssl-div-b", "table", "vsss-3v3", "vsss-5v5")
LENS_NAMES = (
    "none",
    "mild",
    "half",
    "strong",
    "crooked",
    "pincushion",
    "division",
    "ssl",
    "fisheye",
)
SIZES = ((1224, 1024),) * 7 + ((780, 580), (1280, 960), (1920, 1080))
WIDEST = 1.25  # tangent of the angle off the axis at which the region's farthest corner may be seen
MAX_HIDDEN = 0.2


@dataclass(frozen=True)
class SceneSpec:
    """What a seed stands for."""

    seed: int
    field: str
    region: str
    lens: str
    size: tuple[int, int]
    height_mm: float
    tilt_deg: float
    pan_deg: float
    roll_deg: float
    blur_px: float
    noise: float
    glare: float
    robots: int
    people: int


@dataclass(frozen=True, eq=False)
class SeenScene:
    """A picture and the truth about it. hidden: the share of the visible lines that something stands before."""

    spec: SceneSpec
    pixels: NDArray[np.uint8]
    camera: SimCamera
    field: Field
    region: Region
    hidden: float


@lru_cache(maxsize=1)
def fields() -> dict[str, Field]:
    return load_fields()


def camera_of(spec: SceneSpec) -> SimCamera:
    """The camera of a scene; BadInput where no such camera sees the region."""
    region = fields()[spec.field].region(spec.region)
    camera = SimCamera.above(
        region,
        ImageSize(*spec.size),
        LENSES[spec.lens],
        height_mm=spec.height_mm,
        tilt_deg=spec.tilt_deg,
        pan_deg=spec.pan_deg,
        roll_deg=spec.roll_deg,
        fill=0.92,
    )
    corners = np.array([(x, y, 0.0) for x in region.x_mm for y in region.y_mm])
    rays = (corners - np.array(camera.position_mm)) @ np.array(camera.camera_from_field).T
    if (np.hypot(rays[:, 0], rays[:, 1]) / rays[:, 2]).max() > WIDEST:
        raise BadInput(
            "This camera would need too wide a lens.", "Set it higher.", reason="bad-camera"
        )
    return camera


def spec_of(seed: int) -> SceneSpec:
    """The random scene of a seed: drawn again until a camera can see it."""
    rng = np.random.default_rng([seed, 2026])
    while True:
        field = str(rng.choice(FIELDS))
        names = [n for n in fields()[field].regions if not n.startswith("eighth")]
        if field == "table":  # three lines in a quarter of it say nothing
            names = [n for n in names if not n.startswith("quarter")]
        region = (
            "full" if rng.random() < 0.6 else str(rng.choice([n for n in names if n != "full"]))
        )
        spec = SceneSpec(
            seed,
            field,
            region,
            str(rng.choice(LENS_NAMES)),
            SIZES[rng.integers(len(SIZES))],
            height_mm=float(rng.uniform(2000, 8000)),
            tilt_deg=float(rng.uniform(0, 35)),
            pan_deg=float(rng.uniform(-8, 8)),
            roll_deg=float(rng.normal(0, 4) if rng.random() < 0.75 else rng.uniform(-40, 40)),
            blur_px=float(rng.uniform(0.5, 1.3)),
            noise=float(rng.uniform(1, 5)),
            glare=float(rng.uniform(0, 0.6)),
            robots=int(rng.integers(0, 13)),
            people=int(rng.integers(1, 4)) if rng.random() < 0.35 else 0,
        )
        try:
            camera_of(spec)
        except BadInput:
            continue
        return spec


def scene_of(spec: SceneSpec) -> SeenScene:
    """Draw it; with fewer people where those hide more of the lines than they may."""
    field = fields()[spec.field]
    region = field.region(spec.region)
    camera = camera_of(spec)
    play = Motion(robots=spec.robots, people=spec.people, seed=spec.seed + 1)
    shown = Rendering.of(
        camera, field, region, play, Light(glare=spec.glare), Sensor(spec.blur_px, spec.noise)
    )
    time_s = 3.0 + spec.seed % 7
    hidden = 0.0
    if spec.robots or spec.people:
        places = np.concatenate([m.sample(200) for m in field.markings])
        inside = camera.sees(camera.raw_from_field(places))
        hidden = 1 - float(truth_at(shown, time_s).carpet_seen(places[inside]).mean())
        if hidden > MAX_HIDDEN and spec.people:
            return scene_of(replace(spec, people=spec.people - 1))
    return SeenScene(spec, shown.frame_at(0, time_s), camera, field, region, hidden)


def error_mm(made: Calibration, scene: SeenScene) -> float:
    """Return the root mean square error of a calibration on the carpet."""
    model = model_from_json(made.model_name, made.model_parameters)
    return carpet_error_mm(lambda raw: field_from_raw(model, raw), scene)[0]


def carpet_error_mm(
    found_field_from_raw, scene: SeenScene, rings: tuple[int, int] = (12, 9), height_mm: float = 0.0
) -> tuple[float, float]:
    """Root mean square and greatest error, mm, over a grid of the region, on the carpet or above, that is in sight.

    found_field_from_raw: raw px (n, 2) to field mm, at that height.
    """
    (x0, x1), (y0, y1) = scene.region.x_mm, scene.region.y_mm
    x, y = np.meshgrid(np.linspace(x0, x1, rings[0]), np.linspace(y0, y1, rings[1]))
    places = np.stack([x, y], axis=-1).reshape(-1, 2)
    raw = scene.camera.raw_from_field(
        np.concatenate([places, np.full((len(places), 1), height_mm)], axis=1)
    )
    seen = scene.camera.sees(raw)
    off = np.linalg.norm(found_field_from_raw(raw[seen]) - places[seen], axis=1)
    off = np.where(np.isfinite(off), off, 1e6)
    return float(np.sqrt(np.mean(off**2))), float(off.max())
