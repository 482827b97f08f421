"""One picture of a simulated camera: everything still is painted once, the rest is drawn on top for each frame."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.field import Field, Region
from app.core.geometry import ImageSize
from app.sources.sim import illumination, robot_shapes
from app.sources.sim import motion as play_of
from app.sources.sim.camera import SimCamera
from app.sources.sim.canvas import Canvas
from app.sources.sim.draw import Scene, draw
from app.sources.sim.illumination import Light
from app.sources.sim.lamps import Lamps
from app.sources.sim.motion import Play
from app.sources.sim.paint import Ground, Plane
from app.sources.sim.things import Colour, Thing
from app.sources.sim.truth import CARPET, Owners, Truth, own, truth_of


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
PLAY, LIGHT, SENSOR, LAMPS, SHOT = Play(), Light(), Sensor(), Lamps(), Shot()


@dataclass(frozen=True, eq=False)
class Rendering:
    """A camera above a field, ready to give frame after frame; the same arguments give the same frames.

    region: the part of the field where the play is. still: everything that does not move. shade: the light on it.
    Only one thread at a time may ask for frames: they are drawn on one canvas.
    """

    camera: SimCamera
    field: Field
    region: Region
    play: Play
    sensor: Sensor
    lamps: Lamps
    scene: Scene
    still: NDArray[np.float32]

    @classmethod
    def of(cls, camera: SimCamera, field: Field, region: Region, play: Play = PLAY, light: Light = LIGHT,
           sensor: Sensor = SENSOR, lamps: Lamps = LAMPS) -> Self:
        ground = Ground.of(camera)
        shade = illumination.lighting(ground, light, field)
        scene = Scene.of(ground, shade, sensor.blur_px)
        still = illumination.ground_colour(ground, field, light, sensor.blur_px, play.seed) * shade[..., None]
        draw(still, scene, robot_shapes.goals(field))
        if light.glare:
            still += illumination.glare(ground, light, field)[..., None]
        return cls(camera, field, region, play, sensor, lamps, scene, still)

    def knocked(self, by_px: float, softer_px: float, light: Light = LIGHT) -> Self:
        """The same camera turned to its side, so that the middle of its picture moves by so much, and out of focus."""
        camera = self.camera.turned(pan_deg=float(np.degrees(by_px / self.camera.focal_px[0])))
        sensor = replace(self.sensor, blur_px=float(np.hypot(self.sensor.blur_px, softer_px)))
        return type(self).of(camera, self.field, self.region, self.play, light, sensor, self.lamps)

    def binned(self, factor: int) -> Self:
        """The same view by a sensor that adds up factor × factor pixels: exact, and much faster than painting anew."""
        w, h = self.camera.image_size
        size = ImageSize(w // factor, h // factor)
        small = replace(self.camera, image_size=size, focal_px=tuple(f / factor for f in self.camera.focal_px),
                        centre_px=tuple((c + 0.5) / factor - 0.5 for c in self.camera.centre_px))
        cut = (slice(size.height * factor), slice(size.width * factor))

        def shrunk(plane: NDArray) -> NDArray:
            return cv2.resize(plane[cut], tuple(size), interpolation=cv2.INTER_AREA)
        # A binned pixel is a square of its own: its spread comes to what is left of the blur.
        blur_px = float(np.sqrt((self.sensor.blur_px / factor) ** 2 + (1 - 1 / factor**2) / 12))
        scene = Scene.of(Ground.of(small), shrunk(self.scene.light), blur_px)
        return replace(self, camera=small, scene=scene, still=shrunk(self.still),
                       sensor=replace(self.sensor, blur_px=blur_px))

    def frame(self, index: int, fps: float = 25.0, shot: Shot = SHOT) -> NDArray[np.uint8]:
        """(height, width, 3) BGR; the index-th frame of a camera at this rate."""
        return self.frame_at(index, index / fps, shot)

    def frame_at(self, index: int, time_s: float, shot: Shot = SHOT) -> NDArray[np.uint8]:
        """index: of the noise. time_s: of what moves."""
        canvas = self._canvas(shot.tint)
        canvas.draw(self._moving(time_s))
        return canvas.develop(self.row_gain(time_s, shot), self.sensor.noise * shot.gain, self.play.seed, index)

    def row_gain(self, time_s: float, shot: Shot = SHOT) -> Plane | float:
        """How bright each row of a frame is, beside one in the usual light at the usual exposure."""
        flat = shot.gain * shot.exposure_ms / USUAL_EXPOSURE_MS
        if self.lamps == LAMPS:
            return flat
        height = self.camera.image_size.height
        rows_s = time_s + self.sensor.readout_ms / 1000 * (np.arange(height) / height)
        return flat * self.lamps.brightness(rows_s, shot.exposure_ms / 1000)

    @cached_property
    def mean_level(self) -> float:
        """Mean grey level of what is still, in the usual light at the usual exposure."""
        return float(self.still.mean())

    def robots(self, index: int, fps: float = 25.0) -> list[play_of.RobotTruth]:
        """Where the robots of that frame are."""
        return play_of.robots_at(self.play, self.field, self.region, index / fps)

    def truth(self, index: int, fps: float = 25.0) -> Truth:
        """Everything that is true of that frame: who is where, and what the camera sees of it."""
        return self.truth_at(index / fps)

    def truth_at(self, time_s: float) -> Truth:
        owners, names = self._still_owners
        where = self.play, self.field, self.region, time_s
        ball = (play_of.ball_at(*where), robot_shapes.ball_radius_mm(self.field)) if self.play.has_ball else None
        return truth_of(self.scene, owners, names, self._moving(time_s), time_s, play_of.robots_at(*where), ball,
                        play_of.people_at(self.play, self.region, time_s))

    def _moving(self, time_s: float) -> list[Thing]:
        return robot_shapes.moving(self.play, self.field, self.region, time_s, self.camera.position_mm)

    @cached_property
    def _still_owners(self) -> tuple[Owners, tuple[str, ...]]:
        names, size = ("goal",), self.camera.image_size
        bare = np.full((size.height, size.width), CARPET, np.int16)
        return own(bare, self.scene, robot_shapes.goals(self.field), names), names

    @cached_property
    def _canvases(self) -> dict[Colour, Canvas]:
        return {}

    def _canvas(self, tint: Colour) -> Canvas:
        """The canvas of this white balance; another balance takes a new one in its place."""
        if tint not in self._canvases:
            self._canvases.clear()
            self._canvases[tint] = Canvas(self.still, self.scene, tint)
        return self._canvases[tint]
