"""The picture of a scene: markings and carpet by rays, things over them, optics, sensor, demosaicing, JPEG."""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tests.support.second_simulator.opencv_camera import OpenCvCamera
from tests.support.second_simulator.paint import PaintedField, coverage, painted
from tests.support.second_simulator.scene_spec import SceneSpec, camera_of, fields, region_of
from tests.support.second_simulator.things import draw_things, floor_colours
from touchline.core.field import Field, Region

Array = NDArray[np.float64]
SAMPLES = 2  # a side, of each pixel
GRID_PX = 8  # rays are computed so far apart, and interpolated by cubics in between
PAINT = (0.72, 0.74, 0.72)  # linear light


@dataclass(frozen=True, eq=False)
class Scene:
    """A picture and the truth about it."""

    spec: SceneSpec
    pixels: NDArray[np.uint8]
    camera: OpenCvCamera
    field: Field
    region: Region
    paint: PaintedField

    def truth(self) -> dict[str, Any]:
        return {
            "spec": self.spec.as_json(),
            "camera": self.camera.as_json(),
            "paint": self.paint.as_json(),
        }


def render(spec: SceneSpec, camera: OpenCvCamera | None = None, moment: int = 0) -> Scene:
    """Draw a scene; the same for the same spec. camera: another than the spec's, such as it after a knock.

    moment: another one of the same field and camera has other light, things and noise.
    """
    rng = np.random.default_rng([spec.seed, 11])
    field, region, camera = fields()[spec.field], region_of(spec), camera or camera_of(spec)
    straight = OpenCvCamera(
        camera.size,
        camera.matrix,
        camera.distortion,
        camera.rotation,
        camera.translation_mm,
        camera.fisheye,
    )
    paint = painted(field, spec.paint, rng)
    x, y = _carpet(straight, spec, rng)
    slopes = (
        np.gradient(x, axis=1),
        np.gradient(x, axis=0),
        np.gradient(y, axis=1),
        np.gradient(y, axis=0),
    )
    with np.errstate(invalid="ignore"):
        beyond = ~(np.hypot(x, y) < 30_000) | ~np.isfinite(sum(slopes))
    x[beyond] = y[beyond] = 29_000.0
    for slope in slopes:
        slope[beyond] = 100.0
    texture = np.asarray(cv2.GaussianBlur(rng.normal(0, 1, (512, 512)), (0, 0), 2), np.float64)
    texture /= texture.std()
    white = coverage(paint, x, y, slopes, texture, 12.0)[..., None]
    del slope, slopes, beyond  # five million samples are 40 MB a number
    colour = floor_colours(x, y, field, spec, rng)
    light = np.empty(colour.shape, np.float32)
    for of_row, floor, paint_share in zip(light, colour, white, strict=True):
        of_row[:] = floor * (1 - paint_share) + np.array(PAINT) * paint_share
    del colour, white
    rng = np.random.default_rng([spec.seed, 11, moment]) if moment else rng
    light = draw_things(light, x, y, straight, field, spec, SAMPLES, rng)
    width, height = spec.size
    light = light.reshape(height, SAMPLES, width, SAMPLES, 3).mean(axis=(1, 3))
    pixels = _sensor(_optics(light, spec), spec, rng)
    return Scene(
        spec,
        np.ascontiguousarray(pixels[:, ::-1]) if spec.mirrored else pixels,
        camera,
        field,
        region,
        paint,
    )


def _carpet(camera: OpenCvCamera, spec: SceneSpec, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return field x and y of every sample, (h · SAMPLES, w · SAMPLES) mm."""
    width, height = spec.size
    columns = np.arange(-2 * GRID_PX, width + 3 * GRID_PX, GRID_PX, dtype=np.float64)
    rows = np.arange(-2 * GRID_PX, height + 3 * GRID_PX, GRID_PX, dtype=np.float64)
    grid = np.stack(np.meshgrid(columns, rows), axis=-1)
    at = camera.carpet_from_pixel(grid.reshape(-1, 2)).reshape(*grid.shape)
    fine_x = (np.arange(width * SAMPLES) + 0.5) / SAMPLES - 0.5
    fine_y = (np.arange(height * SAMPLES) + 0.5) / SAMPLES - 0.5
    across, down = _cubic_weights(columns, fine_x), _cubic_weights(rows, fine_y)
    # Beyond the horizon there is no carpet; a neighbour's place keeps the interpolation finite there.
    known = np.all(np.isfinite(at), axis=-1)
    filled = np.where(known[..., None], at, 1e9)
    fine = [down @ filled[..., k] @ across.T for k in (0, 1)]
    lost = (np.abs(down) > 0) @ (~known).astype(float) @ (np.abs(across) > 0).T > 0
    x, y = (np.where(lost, np.nan, one) for one in fine)
    if spec.sensor.shake_px:  # of each row, by a mount that hums while the rows are read
        sway = spec.sensor.shake_px * np.sin(
            np.arange(len(fine_y)) * rng.uniform(0.02, 0.2) + rng.uniform(0, 6)
        )
        for one in (x, y):
            one += np.gradient(one, axis=1) * SAMPLES * sway[:, None]
    return x, y


def _cubic_weights(knots: Array, at: Array) -> Array:
    """Return the matrix (n, knots) of four-point Lagrange interpolation on an even grid."""
    step = knots[1] - knots[0]
    first = np.clip(np.floor((at - knots[0]) / step).astype(int) - 1, 0, len(knots) - 4)
    t = (at - knots[first]) / step
    weights = np.zeros((len(at), len(knots)))
    for k in range(4):
        others = [j for j in range(4) if j != k]
        value = np.prod([(t - j) / (k - j) for j in others], axis=0)
        weights[np.arange(len(at)), first + k] = value
    return weights


def _optics(light: NDArray[np.float32], spec: SceneSpec) -> NDArray[np.float32]:
    """Blur that grows to the corners, lateral chromatic aberration about the optical centre, vignetting."""
    optics = spec.optics
    height, width = light.shape[:2]
    cx, cy = (width - 1) / 2 + spec.centre_px[0], (height - 1) / 2 + spec.centre_px[1]
    v, u = np.indices((height, width), np.float32)
    radius = np.hypot(u - cx, v - cy) / (np.hypot(width, height) / 2)
    sharp = cv2.GaussianBlur(light, (0, 0), optics.blur_px)
    if optics.corner_blur_px:
        soft = cv2.GaussianBlur(light, (0, 0), optics.blur_px + optics.corner_blur_px)
        share = np.clip(radius**2, 0, 1)[..., None]
        sharp = sharp * (1 - share) + soft * share
    if optics.fringe:
        for channel, sign in ((0, -1), (2, 1)):  # blue smaller, red larger
            s = 1 + sign * optics.fringe
            affine = np.array([[s, 0, cx * (1 - s)], [0, s, cy * (1 - s)]])
            sharp[..., channel] = cv2.warpAffine(
                np.ascontiguousarray(sharp[..., channel]),
                affine,
                (width, height),
                flags=cv2.INTER_CUBIC,
                borderMode=cv2.BORDER_REPLICATE,
            )
    return sharp * (1 - optics.vignetting * radius**2)[..., None]


def _sensor(
    light: NDArray[np.float32], spec: SceneSpec, rng: np.random.Generator
) -> NDArray[np.uint8]:
    sensor = spec.sensor
    light = np.clip(light * (0.8 / max(float(np.percentile(light, 99.5)), 0.05)), 0, 1)
    shot = sensor.noise / 255 * np.sqrt(np.clip(light, 0.02, 1) / 0.5)
    light = np.clip(light + rng.normal(0, 1, light.shape).astype(np.float32) * shot, 0, 1)
    if sensor.bayer:
        raw = np.zeros(light.shape[:2], np.float32)
        raw[0::2, 0::2], raw[0::2, 1::2] = light[0::2, 0::2, 0], light[0::2, 1::2, 1]
        raw[1::2, 0::2], raw[1::2, 1::2] = light[1::2, 0::2, 1], light[1::2, 1::2, 2]
        # The names of OpenCV's patterns are those of the second row: blue first is its "RG".
        mosaic = np.rint(raw * 65535).astype(np.uint16)
        light = cv2.cvtColor(mosaic, cv2.COLOR_BayerRG2BGR_EA).astype(np.float32) / np.float32(
            65535
        )
    encoded = np.where(
        light <= 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 1e-9) ** (1 / 2.4) - 0.055
    )
    pixels = np.rint(np.clip(encoded, 0, 1) * 255).astype(np.uint8)
    if sensor.jpeg is not None:
        pixels = cv2.imdecode(
            cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, sensor.jpeg])[1],
            cv2.IMREAD_COLOR,
        )
    return pixels
