"""Render a simulated camera: everything still is painted once, the rest is drawn on top for each frame."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core.field import Field, Region
from touchline.core.geometry import ImageSize, as_pair
from touchline.sources.sim.actors import Motion, goals, moving
from touchline.sources.sim.camera import SimCamera
from touchline.sources.sim.draw import STEPS, Canvas, Scene, draw, in_steps
from touchline.sources.sim.ground import Ground, Lamps, Light, Plane, glare, ground_colour, lighting
from touchline.sources.sim.solids import Colour, Solid


@dataclass(frozen=True)
class Sensor:
    """blur_px: Gaussian sigma of lens and pixel together. noise: standard deviation in grey levels.

    readout_ms: from the first row's exposure to the last one's; 0 is a global shutter.
    """

    blur_px: float = 0.65
    noise: float = 2.0
    readout_ms: float = 15.0


@dataclass(frozen=True)
class Shot:
    """What the camera is set to. gain: of everything, noise too. tint: of blue, green, red, as white balance has it."""

    exposure_ms: float = 4.0
    gain: float = 1.0
    tint: Colour = (1.0, 1.0, 1.0)


USUAL_EXPOSURE_MS = Shot.exposure_ms  # at which the picture is as bright as Light says
MOTION, LIGHT, SENSOR, LAMPS, SHOT = Motion(), Light(), Sensor(), Lamps(), Shot()


@dataclass(frozen=True, eq=False)
class Rendering:
    """A camera above a field, ready to give frame after frame; the same arguments give the same frames.

    region: the part of the field with the motion. still: everything that does not move, in steps of the canvas.
    Frames share one canvas: only one thread at a time may render.
    """

    camera: SimCamera
    field: Field
    region: Region
    motion: Motion
    sensor: Sensor
    lamps: Lamps
    scene: Scene
    still: NDArray[np.int16]

    @classmethod
    def of(
        cls,
        camera: SimCamera,
        field: Field,
        region: Region,
        motion: Motion = MOTION,
        light: Light = LIGHT,
        sensor: Sensor = SENSOR,
        lamps: Lamps = LAMPS,
    ) -> Self:
        ground = Ground.of(camera)
        shade = lighting(ground, light, field)
        scene = Scene.of(ground, shade, sensor.blur_px)
        still = ground_colour(ground, field, light, sensor.blur_px, motion.seed) * shade[..., None]
        draw(still, scene, goals(field))
        if light.glare:
            still += glare(ground, light, field)[..., None]
        return cls(camera, field, region, motion, sensor, lamps, scene, in_steps(still, STEPS))

    def knocked(self, by_px: float, softer_px: float, light: Light = LIGHT) -> Self:
        """Turn the camera so that its picture's centre moves by by_px, and blur it by softer_px."""
        camera = self.camera.turned(pan_deg=float(np.degrees(by_px / self.camera.focal_px[0])))
        sensor = replace(self.sensor, blur_px=float(np.hypot(self.sensor.blur_px, softer_px)))
        return type(self).of(
            camera, self.field, self.region, self.motion, light, sensor, self.lamps
        )

    def binned(self, factor: int) -> Self:
        """Return the view of a sensor that sums factor × factor pixels: exact, and much faster than painting anew."""
        w, h = self.camera.image_size
        size = ImageSize(w // factor, h // factor)
        small = replace(
            self.camera,
            image_size=size,
            focal_px=as_pair(f / factor for f in self.camera.focal_px),
            centre_px=as_pair((c + 0.5) / factor - 0.5 for c in self.camera.centre_px),
        )
        cut = (slice(size.height * factor), slice(size.width * factor))

        def shrunk(plane: NDArray) -> NDArray:
            return cv2.resize(plane[cut], tuple(size), interpolation=cv2.INTER_AREA)

        # A binned pixel is a square of its own: its spread comes to what is left of the blur.
        blur_px = float(np.sqrt((self.sensor.blur_px / factor) ** 2 + (1 - 1 / factor**2) / 12))
        scene = Scene.of(Ground.of(small), shrunk(self.scene.light), blur_px)
        return replace(
            self,
            camera=small,
            scene=scene,
            still=shrunk(self.still),
            sensor=replace(self.sensor, blur_px=blur_px),
        )

    def frame(self, index: int, fps: float = 25.0, shot: Shot = SHOT) -> NDArray[np.uint8]:
        """Return the index-th frame (height, width, 3) BGR of a camera at this rate."""
        return self.frame_at(index, index / fps, shot)

    def frame_at(self, index: int, time_s: float, shot: Shot = SHOT) -> NDArray[np.uint8]:
        """Return a frame. index: of the noise. time_s: of the motion."""
        canvas = self._canvas(shot.tint)
        with canvas.drawn(self.moving(time_s)):
            return canvas.develop(
                self.row_gain(time_s, shot), self.sensor.noise * shot.gain, self.motion.seed, index
            )

    def row_gain(self, time_s: float, shot: Shot = SHOT) -> Plane | float:
        """Return each row's brightness relative to the usual light and exposure."""
        flat = shot.gain * shot.exposure_ms / USUAL_EXPOSURE_MS
        if self.lamps == LAMPS:
            return flat
        height = self.camera.image_size.height
        rows_s = time_s + self.sensor.readout_ms / 1000 * (np.arange(height) / height)
        return flat * self.lamps.brightness(rows_s, shot.exposure_ms / 1000)

    @cached_property
    def mean_level(self) -> float:
        """The still picture's mean grey level, in the usual light at the usual exposure."""
        return float(self.still.mean()) / STEPS

    def moving(self, time_s: float) -> list[Solid]:
        """Return what moves, in the order to draw it."""
        return moving(self.motion, self.field, self.region, time_s, self.camera.position_mm)

    @cached_property
    def _canvases(self) -> dict[Colour, Canvas]:
        return {}

    def _canvas(self, tint: Colour) -> Canvas:
        """Return the canvas of this white balance, which replaces the former."""
        if tint not in self._canvases:
            self._canvases.clear()
            self._canvases[tint] = Canvas(self.still, self.scene, tint)
        return self._canvases[tint]
