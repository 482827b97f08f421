"""What can be set on a V4L2 camera: exposure, gain, white balance, size and rate, as OpenCV's numbers say.

OpenCV hands on the driver's own numbers, but neither their ranges nor the sizes there are: a value is tried, and what
the camera made of it is read back.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import cv2

from touchline.core.errors import BadInput
from touchline.core.statements import say
from touchline.sources import Control
from touchline.sources.control_errors import is_number, refused_value, unknown_control

SIZE = re.compile(r"([1-9][0-9]{1,3})x([1-9][0-9]{1,3})", re.ASCII)
USUAL_SIZES = ("640x480", "800x600", "1280x720", "1280x960", "1280x1024", "1600x1200", "1920x1080", "2560x1440",
               "3840x2160")
EXPOSURE_STEP_US = 100  # V4L2_CID_EXPOSURE_ABSOLUTE counts in these
MANUAL, AUTOMATIC = 1, (3, 0)  # V4L2's exposure modes; webcams know 3, "aperture priority", as their automatic
UNSUPPORTED = -1  # what OpenCV says of a property that the device lacks


@dataclass(frozen=True)
class NumericProperty:
    """One property that is a number. scale: of ours to the driver's. auto: the property that hands it to the camera."""

    name: str
    label: str
    prop: int
    unit: str
    range: tuple[float, float]  # of what is sent at all; the camera's own is narrower
    scale: float = 1.0
    auto: int | None = None
    is_auto: Callable[[float], bool] = bool
    auto_modes: tuple[float, ...] = (1,)
    manual_mode: float = 0


PROPERTIES = {one.name: one for one in (
    NumericProperty("exposure", "Exposure time", cv2.CAP_PROP_EXPOSURE, "µs", (100, 10_000_000), EXPOSURE_STEP_US,
           cv2.CAP_PROP_AUTO_EXPOSURE, lambda mode: mode in AUTOMATIC, AUTOMATIC, MANUAL),
    NumericProperty("gain", "Gain", cv2.CAP_PROP_GAIN, "", (0, 10_000)),
    NumericProperty("white_balance", "White balance", cv2.CAP_PROP_WB_TEMPERATURE, "K", (1000, 20_000), 1.0,
           cv2.CAP_PROP_AUTO_WB),
    NumericProperty("frame_rate", "Frame rate", cv2.CAP_PROP_FPS, "Hz", (0.1, 240)),
)}


def read_controls(device: cv2.VideoCapture) -> tuple[Control, ...]:
    """Return every control that this device has, as it is now."""
    found = [_number(device, one) for one in PROPERTIES.values()]
    return (*(control for control in found if control is not None), _resolution(device))


def set_control(device: cv2.VideoCapture, name: str, value: Any) -> Control:
    """Set one control and return it as read back."""
    if name == "resolution":
        return _set_resolution(device, value)
    one = PROPERTIES.get(name)
    control = _number(device, one) if one else None
    if one is None or control is None:
        raise unknown_control(name, (control.name for control in read_controls(device)))
    if value == "auto":
        if one.auto is None or control.automatic is None:
            raise refused_value(one.label, repr(value)[:40], _allowed(one))
        for mode in one.auto_modes:
            device.set(one.auto, mode)
            if one.is_auto(device.get(one.auto)):
                break
    else:
        if not is_number(value, *one.range):
            allowed = _allowed(one) + ', or "auto"' * (control.automatic is not None)
            raise refused_value(one.label, repr(value)[:40], allowed)
        if one.auto is not None and control.automatic:
            device.set(one.auto, one.manual_mode)
        device.set(one.prop, value / one.scale)
    return _number(device, one) or control


def _number(device: cv2.VideoCapture, one: NumericProperty) -> Control | None:
    raw = device.get(one.prop)
    if raw == UNSUPPORTED or not abs(raw) < 1e9 or (one.name == "frame_rate" and raw <= 0):
        return None
    mode = device.get(one.auto) if one.auto is not None else UNSUPPORTED
    automatic = None if mode == UNSUPPORTED else bool(one.is_auto(mode))
    return Control(one.name, one.label, "float", raw * one.scale, one.unit, None, (), automatic)


def _resolution(device: cv2.VideoCapture) -> Control:
    now = f"{device.get(cv2.CAP_PROP_FRAME_WIDTH):.0f}x{device.get(cv2.CAP_PROP_FRAME_HEIGHT):.0f}"
    return Control("resolution", "Resolution", "choice", now, "px", None, tuple(dict.fromkeys((now, *USUAL_SIZES))))


def _set_resolution(device: cv2.VideoCapture, value: Any) -> Control:
    found = SIZE.fullmatch(value) if isinstance(value, str) else None
    if not found:
        raise refused_value("Resolution", repr(value)[:40], "width x height, such as 1280x720")
    width, height = int(found[1]), int(found[2])
    before = _resolution(device).value
    device.set(cv2.CAP_PROP_FRAME_WIDTH, width)
    device.set(cv2.CAP_PROP_FRAME_HEIGHT, height)
    control = _resolution(device)
    if control.value == before != value:
        raise BadInput(say("v4l2.resolution-refused", "The camera does not accept {wanted}. The resolution is still "
                           "{resolution}.", wanted=value, resolution=before),
                       say("v4l2.another-resolution", "Try another resolution."), reason="bad-control")
    return control


def _allowed(one: NumericProperty) -> str:
    return f"a number from {one.range[0]:g} to {one.range[1]:g}"
