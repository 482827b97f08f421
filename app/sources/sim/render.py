"""One picture of a simulated camera: everything still is painted once, the rest is drawn on top for each frame."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from app.field import Field, Region
from app.sources.sim import look
from app.sources.sim import play as play_of
from app.sources.sim.camera import SimCamera
from app.sources.sim.look import Light
from app.sources.sim.paint import Ground, Plane
from app.sources.sim.play import Play
from app.sources.sim.things import draw


@dataclass(frozen=True)
class Sensor:
    """blur_px: Gaussian sigma of lens and pixel together. noise: standard deviation in grey levels."""

    blur_px: float = 0.65
    noise: float = 2.0


PLAY, LIGHT, SENSOR = Play(), Light(), Sensor()


@dataclass(frozen=True, eq=False)
class Rendering:
    """A camera above a field, ready to give frame after frame; the same arguments give the same frames.

    region: the part of the field where the play is. still: everything that does not move. shade: the light on it.
    """

    camera: SimCamera
    field: Field
    region: Region
    play: Play
    sensor: Sensor
    ground: Ground
    still: NDArray[np.float32]
    shade: Plane

    @classmethod
    def of(cls, camera: SimCamera, field: Field, region: Region, play: Play = PLAY, light: Light = LIGHT,
           sensor: Sensor = SENSOR) -> Self:
        ground = Ground.of(camera)
        shade = look.lighting(ground, light, field)
        still = look.ground_colour(ground, field, light, sensor.blur_px, play.seed) * shade[..., None]
        draw(still, ground, shade, play_of.standing(play, field, region), sensor.blur_px)
        if light.glare:
            still += look.glare(ground, light, field)[..., None]
        return cls(camera, field, region, play, sensor, ground, still, shade)

    def frame(self, index: int, fps: float = 25.0) -> NDArray[np.uint8]:
        """(height, width, 3) BGR; the index-th frame of a camera at this rate."""
        picture = self.still.copy()
        things = play_of.moving(self.play, self.field, self.region, index / fps)
        draw(picture, self.ground, self.shade, things, self.sensor.blur_px)
        if self.sensor.noise:
            picture += _noise(picture.shape, self.sensor.noise, self.play.seed, index)
        return cv2.convertScaleAbs(np.maximum(picture, 0, out=picture))  # rounds, and saturates at 255

    def robots(self, index: int, fps: float = 25.0) -> list[play_of.RobotTruth]:
        """Where the robots of that frame are."""
        return play_of.robots_at(self.play, self.field, self.region, index / fps)


def _noise(shape: tuple[int, ...], sigma: float, seed: int, index: int) -> NDArray[np.float32]:
    """Sensor noise of one frame, cut at a random place from one large sheet: drawing it afresh takes longer."""
    sheet = _noise_sheet(seed)
    rng = np.random.default_rng([seed, 4, index])
    start = int(rng.integers(sheet.size // 2))
    count = int(np.prod(shape))
    turns = -(-(start + count) // sheet.size)
    flat = np.tile(sheet, turns)[start:start + count] if turns > 1 else sheet[start:start + count]
    return flat.reshape(shape) * np.float32(sigma)


@lru_cache(maxsize=2)
def _noise_sheet(seed: int) -> NDArray[np.float32]:
    return np.random.default_rng([seed, 5]).standard_normal(1 << 23, dtype=np.float32)
