"""Cameras over a field whose height somebody measured: what they see, and what a fit makes of it.

Four kinds of view of a Division B field by the second simulator's real lenses, off-centre and not quite square, over
lines painted σ 3 mm beside their places; points as clicked (nine a border, three on six lines inside, σ 0.3 px), or as
found by a detector (every marking in sight, σ 0.15 px).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tests.support.second_simulator.opencv_camera import OpenCvCamera
from tests.support.second_simulator.paint import PaintErrors, painted
from tests.support.second_simulator.scene_spec import camera_of, fields, scene_spec
from touchline.core.field import BORDERS, Arc, Field, Line, Region
from touchline.core.geometry import ImageSize
from touchline.core.records import Observation, Observations
from touchline.models.ray_camera import RayCamera

VIEWS = {
    "from above": ("full", (0.0, 6.0)),
    "oblique": ("full", (15.0, 30.0)),
    "half": ("half-left", (0.0, 20.0)),
    "quarter": ("quarter-top-left", (0.0, 20.0)),
}
POINTS = ("clicks", "detected")
CLICKS, CLICK_PX = 9, 0.3
INSIDE_LINES, INSIDE_CLICKS = 6, 3
DETECTED, DETECTED_PX = 235, 0.15
PAINT_MM = 3.0
SIZE = (1280, 1024)


@dataclass(frozen=True, eq=False)
class HeightScene:
    """A camera over a region, and the points that it is calibrated with."""

    camera: OpenCvCamera
    field: Field
    region: Region
    observations: Observations

    @property
    def model(self) -> str:
        return "fisheye" if self.camera.fisheye else "brown-conrady"

    @property
    def image_size(self) -> ImageSize:
        return ImageSize(*self.camera.size)

    @property
    def height_mm(self) -> float:
        return float(self.camera.position_mm[2])

    def height_option(
        self, factor: float = 1.0, off_mm: float = 0.0, sigma_mm: float = 30.0
    ) -> dict[str, object]:
        """Return the option of a height that is off."""
        return {"height_mm": {"value": self.height_mm * factor + off_mm, "sigma": sigma_mm}}

    def error_mm(self, model: RayCamera, z_mm: float) -> float:
        """Return the rms error in a plane over the region in sight and in reach, mm."""
        places = self._grid
        pixels = self.camera.project(np.column_stack([places, np.full(len(places), z_mm)]))
        seen = self.camera.inside(pixels)
        off = model.unproject(pixels[seen], z_mm) - places[seen]
        return float(np.sqrt(np.nanmean(np.sum(off**2, axis=1))))

    @cached_property
    def _grid(self) -> np.ndarray:
        x, y = np.meshgrid(np.linspace(*self.region.x_mm, 13), np.linspace(*self.region.y_mm, 11))
        return np.column_stack([x.ravel(), y.ravel()])


def height_scene(
    seed: int, view: str, points: str, paint_mm: float = PAINT_MM, **fixed: object
) -> HeightScene:
    """Return the scene of a seed. fixed: members of SceneSpec that are not drawn."""
    rng = np.random.default_rng([seed, 11])
    region_name, tilts = VIEWS[view]
    spec = scene_spec(
        seed,
        **{
            "field": "ssl-div-b",
            "region": region_name,
            "size": SIZE,
            "mirrored": False,
            "tilt_deg": float(rng.uniform(*tilts)),
            **fixed,
        },
    )
    camera, field = camera_of(spec), fields()[spec.field]
    region = field.region(region_name)
    as_painted: dict[str, Line | Arc] = {
        m.name: m for m in painted(field, PaintErrors(paint_mm), rng).markings
    }
    if points == "clicks":
        borders = {
            name: _painted_border(name, region, field, as_painted, rng, paint_mm)
            for name in BORDERS
        }
        observations = [
            _clicked(camera, name, border, CLICKS, rng, region) for name, border in borders.items()
        ]
        inside = [m for m in as_painted.values() if isinstance(m, Arc) or not _on_border(m, region)]
        found = [
            _clicked(camera, m.name, m, INSIDE_CLICKS, rng, region)
            for m in (inside[i] for i in rng.permutation(len(inside)))
        ]
        observations += [o for o in found if o is not None][:INSIDE_LINES]
    else:
        seen = {name: _seen(camera, m, region) for name, m in as_painted.items()}
        total = sum(map(len, seen.values()))
        observations = []
        for name, pixels in seen.items():
            count = round(DETECTED * len(pixels) / total)
            if count >= 3:
                chosen = pixels[np.linspace(0, len(pixels) - 1, count).astype(int)]
                observations.append(
                    Observation(
                        field.observed_name(name, region),
                        "line",
                        chosen + rng.normal(0, DETECTED_PX, chosen.shape),
                    )
                )
    return HeightScene(camera, field, region, tuple(o for o in observations if o is not None))


def _painted_border(name, region, field, as_painted, rng, paint_mm):
    border = region.border(name)
    for line in as_painted.values():
        if isinstance(line, Line) and field.observed_name(line.name, region) == name:
            return line
    return border.shifted(float(rng.normal(0, paint_mm)))


def _on_border(line, region) -> bool:
    return any(
        np.allclose(np.array([line.start, line.end])[:, k], edge, atol=50)
        for k, edges in ((0, region.x_mm), (1, region.y_mm))
        for edge in edges
    )


def _seen(camera, marking, region) -> np.ndarray:
    """Return what the picture shows of a marking inside the region: beyond it, strong lenses smear."""
    along = marking.sample(max(int(marking.length_mm / 5), 50))
    low, high = (np.array([x, y]) for x, y in zip(region.x_mm, region.y_mm, strict=True))
    along = along[((along >= low - 100) & (along <= high + 100)).all(axis=1)]
    if not len(along):
        return np.empty((0, 2))
    pixels = camera.project(np.column_stack([along, np.zeros(len(along))]))
    with np.errstate(invalid="ignore"):
        return pixels[camera.inside(pixels, 3) & np.isfinite(pixels).all(axis=1)]


def _clicked(camera, name, marking, count, rng, region):
    pixels = _seen(camera, marking, region)
    if len(pixels) < 4 * count:
        return None
    chosen = pixels[np.sort(rng.choice(len(pixels), count, replace=False))]
    return Observation(name, "line", chosen + rng.normal(0, CLICK_PX, chosen.shape))
