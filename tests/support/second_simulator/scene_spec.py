"""Random scenes by seed: a field as painted, a real lens, a camera in a hall, light, things on the carpet, a sensor."""

from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from typing import Any

import cv2
import numpy as np

from tests.support.second_simulator.lenses import REAL_LENSES, RealLens
from tests.support.second_simulator.opencv_camera import OpenCvCamera
from tests.support.second_simulator.paint import PaintErrors
from touchline.core.field import Field, Region
from touchline.core.geometry import as_triple
from touchline.store.fields import load_fields

FIELDS = ("ssl-2008", "ssl-div-a", "ssl-div-b", "table", "vsss-3v3", "vsss-5v5")
SIZES = ((1224, 1024), (1280, 960), (1280, 720), (1440, 1080), (1920, 1080), (780, 580), (640, 480))
# others hang in halls
HEIGHTS_MM = {"table": (1500, 3500), "vsss-3v3": (1400, 3200), "vsss-5v5": (1600, 3500)}
HALL_MM = (2200, 8000)
WIDTHS_MM = {"table": (8, 25), "vsss-3v3": (3, 12), "vsss-5v5": (3, 15)}
LARGE_WIDTHS_MM = (8, 50)
MIN_PX_PER_LINE = 0.7  # thinner, and nobody could see it
WIDEST_DEG = 68.0  # from the axis: what is seen further out is smeared


@dataclass(frozen=True)
class Optics:
    """blur_px: σ in the middle and added in the corner. fringe: red and blue larger and smaller by this share."""

    blur_px: float = 0.6
    corner_blur_px: float = 0.0
    fringe: float = 0.0
    vignetting: float = 0.0


@dataclass(frozen=True)
class Sensor:
    """noise: grey levels in mid-grey. jpeg: quality, None for none. shake_px: of rows, by a rolling shutter."""

    noise: float = 1.5
    bayer: bool = False
    jpeg: int | None = None
    shake_px: float = 0.0


@dataclass(frozen=True)
class Things:
    """What is there besides the markings. shade: hard shadows; glare: reflections of lamps; walls: boards around it."""

    robots: int = 0
    people: int = 0
    cables: int = 0
    seams: bool = False
    goals: bool = False
    walls: bool = False
    shade: int = 0
    glare: int = 0


@dataclass(frozen=True)
class SceneSpec:
    """What a seed stands for."""

    seed: int
    field: str
    region: str
    lens: str
    size: tuple[int, int]
    centre_px: tuple[float, float]  # principal point from the picture's middle
    aspect: float
    tilt_deg: float
    towards_deg: float  # the tilt's direction over the field
    mount_deg: float  # the camera's turn about its axis
    height_mm: float
    fill: float
    mirrored: bool
    paint: PaintErrors
    optics: Optics
    sensor: Sensor
    things: Things

    def as_json(self) -> dict[str, Any]:
        return asdict(self)


@lru_cache(maxsize=1)
def fields() -> dict[str, Field]:
    return load_fields()


def scene_spec(seed: int, **fixed: Any) -> SceneSpec:
    """Return the random scene of a seed, drawn again until a real camera in a hall can see it.

    fixed: members of SceneSpec that are not drawn, such as tilt_deg=30.0.
    """
    rng = np.random.default_rng([seed, 7])
    for _ in range(400):
        spec = replace(_drawn(seed, rng), **fixed)
        if feasible(spec):
            return spec
    raise ValueError(f"No camera sees such a scene: seed {seed}, {fixed}.")


def _drawn(seed: int, rng: np.random.Generator) -> SceneSpec:
    name = str(rng.choice(FIELDS))
    part = rng.random()
    regions = fields()[name].regions
    kind = "full" if part < 0.55 or name == "table" else "half" if part < 0.8 else "quarter"
    region = str(rng.choice([r for r in regions if r.startswith(kind)]))
    size = SIZES[rng.integers(len(SIZES))]
    lens = REAL_LENSES[rng.integers(len(REAL_LENSES))]
    width = rng.uniform(*WIDTHS_MM.get(name, LARGE_WIDTHS_MM)) if rng.random() < 0.4 else None
    return SceneSpec(
        seed,
        name,
        region,
        lens.name,
        size,
        centre_px=(float(rng.normal(0, 0.012 * size[0])), float(rng.normal(0, 0.012 * size[0]))),
        aspect=float(1 + rng.normal(0, 0.002)),
        tilt_deg=float(rng.uniform(0, 8) if rng.random() < 0.4 else rng.uniform(0, 35)),
        towards_deg=float(rng.uniform(-180, 180)),
        mount_deg=float(rng.normal(0, 3) + (rng.choice([0, 180]) if rng.random() < 0.15 else 0)),
        height_mm=float(rng.uniform(*HEIGHTS_MM.get(name, HALL_MM))),
        fill=float(rng.uniform(0.85, 0.97)),
        mirrored=False,
        paint=PaintErrors(
            3.0,
            10.0,
            float(rng.uniform(0, 4e-4)),
            float(rng.uniform(0, 0.5) * (rng.random() < 0.4)),
            float(rng.uniform(0, 0.6)),
            width,
        ),
        optics=Optics(
            float(rng.uniform(0.5, 1.1)),
            float(rng.uniform(0, 0.8)),
            float(rng.uniform(0, 8e-4)),
            float(rng.uniform(0, 0.35)),
        ),
        sensor=Sensor(
            float(rng.uniform(0.5, 4)),
            bool(rng.random() < 0.6),
            int(rng.integers(70, 97)) if rng.random() < 0.6 else None,
            float(rng.uniform(0, 0.15) * (rng.random() < 0.3)),
        ),
        things=Things(
            int(rng.integers(0, 11)),
            int(rng.integers(1, 3) * (rng.random() < 0.25)),
            int(rng.random() < 0.25),
            bool(rng.random() < 0.4),
            bool(rng.random() < 0.6),
            bool(rng.random() < 0.4),
            int(rng.integers(1, 3) * (rng.random() < 0.3)),
            int(rng.integers(1, 4) * (rng.random() < 0.4)),
        ),
    )


def lens_of(spec: SceneSpec) -> RealLens:
    return next(lens for lens in REAL_LENSES if lens.name == spec.lens)


def region_of(spec: SceneSpec) -> Region:
    return fields()[spec.field].region(spec.region)


def camera_of(spec: SceneSpec) -> OpenCvCamera:
    """Return the true camera: over the region at its height, moved and turned until the region fills the picture.

    A lens shows a region at one height only, so the picture's scale is fitted by the lens's focal length: as if the
    same lens had been made for a sensor of another size.
    """
    lens, region = lens_of(spec), region_of(spec)
    width, height = spec.size
    centre = ((width - 1) / 2 + spec.centre_px[0], (height - 1) / 2 + spec.centre_px[1])
    corners = np.array(
        [(x, y, 0.0) for x in np.linspace(*region.x_mm, 9) for y in np.linspace(*region.y_mm, 9)]
    )
    middle = np.array([np.mean(region.x_mm), np.mean(region.y_mm), 0.0])
    focal = lens.focal * width
    matrix = (focal, focal * spec.aspect, *centre)
    tilt, towards = np.radians(spec.tilt_deg), np.radians(spec.towards_deg)
    ahead = np.array(
        [np.sin(tilt) * np.cos(towards), np.sin(tilt) * np.sin(towards), -np.cos(tilt)]
    )
    upright = np.radians(region.rotate_deg + spec.mount_deg)
    right = np.array([np.cos(upright), -np.sin(upright), 0.0])
    right = right - ahead * (right @ ahead)
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(ahead, right), ahead])
    vector = as_triple(cv2.Rodrigues(rotation)[0].ravel())
    aim = middle.copy()
    for _ in range(12):  # aim so that what is seen lies in the middle of the picture
        position = aim - ahead * (spec.height_mm / -ahead[2])
        camera = OpenCvCamera(
            spec.size,
            matrix,
            lens.distortion,
            vector,
            as_triple(-rotation @ position),
            lens.fisheye,
        )
        pixels = camera.project(corners)
        if not np.isfinite(pixels).any():
            break
        seen = (np.nanmin(pixels, axis=0) + np.nanmax(pixels, axis=0)) / 2
        off = camera.carpet_from_pixel(np.array([seen, [(width - 1) / 2, (height - 1) / 2]]))
        if not np.isfinite(off).all():
            break
        aim[:2] += off[0] - off[1]
    return replace(camera, mirrored=spec.mirrored)


def feasible(spec: SceneSpec) -> bool:
    """Return whether that camera sees its region, large enough, and its markings wide enough."""
    camera, region, field = camera_of(spec), region_of(spec), fields()[spec.field]
    edge = np.array(
        [(x, y, 0.0) for x in np.linspace(*region.x_mm, 9) for y in np.linspace(*region.y_mm, 9)]
    )
    pixels = camera.project(edge)
    if not np.isfinite(pixels).all() or camera.inside(pixels).mean() < 0.80:
        return False
    rays = edge - camera.position_mm
    if (
        np.degrees(
            np.arccos((rays @ camera.camera_from_field[2]) / np.linalg.norm(rays, axis=1))
        ).max()
        > WIDEST_DEG
    ):
        return False
    extent = np.ptp(pixels, axis=0) / np.array(spec.size)
    if extent.max() > 1.12 or extent.max() < 0.8:
        return False
    width_mm = spec.paint.width_mm or min(m.width_mm for m in field.markings)
    across = camera.project(edge + np.array([width_mm, 0, 0])) - pixels
    return bool(np.nanmedian(np.linalg.norm(across, axis=1)) >= MIN_PX_PER_LINE)
