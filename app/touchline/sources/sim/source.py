"""sim://FIELD: a camera above a simulated field, described by its address alone, with controls and mishaps."""

import dataclasses
import re
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from touchline.core.errors import BadInput
from touchline.core.field import Field, Region
from touchline.core.geometry import ImageSize
from touchline.core.options import Option
from touchline.core.records import Frame
from touchline.core.statements import say
from touchline.processes.limits import return_memory
from touchline.sources import BaseSource, Control, Identity, SourceContext, named_field
from touchline.sources.lifecycle import (
    Pacer,
    is_number,
    refused_value,
    require_open,
    unknown_control,
)
from touchline.sources.sim import timecode
from touchline.sources.sim.actors import Motion
from touchline.sources.sim.camera import LENSES, Lens, SimCamera
from touchline.sources.sim.ground import Lamps, Light
from touchline.sources.sim.render import LIGHT, USUAL_EXPOSURE_MS, Rendering, Sensor, Shot

BINNINGS = (1, 2, 4)
NEUTRAL_K = 5000.0
AUTO_LEVEL = 110.0  # mean grey level that an automatic exposure aims at
MIN_EXPOSURE_US, MAX_GAIN_DB, RATES_HZ, KELVINS = 20.0, 24.0, (0.1, 240.0), (2500.0, 10_000.0)
NUMBERS = {
    "exposure": "exposure_us",
    "gain": "gain_db",
    "white_balance": "white_balance_k",
    "knock": "knock_px",
    # controls that are numbers, and their attributes
    "softer": "softer_px",
    "frame_rate": "frame_rate",
}
KNOCKS_PX, SOFTER_PX = (-200.0, 200.0), (0.0, 5.0)

# The league's numbering of cameras over a shared field.
CAMERAS = {
    "1": ("full",),
    "2": ("half-left", "half-right"),
    "4": ("quarter-bottom-left", "quarter-top-left", "quarter-bottom-right", "quarter-top-right"),
    "8": tuple(f"eighth-{i}" for i in range(8)),
}
MAX_PIXELS = 6_000_000  # each takes about 60 bytes while the field is painted
HEIGHT_PER_DIAGONAL = 0.7  # lower, and a strong lens shows its corners bent back
LENS_TERMS = ("k", "a", "k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2")


@dataclass
class Settings:
    """The camera's settings. size: at full resolution."""

    size: ImageSize
    frame_rate: float
    exposure_us: float = 1000 * USUAL_EXPOSURE_MS
    auto_exposure: bool = False
    gain_db: float = 0.0
    white_balance_k: float = NEUTRAL_K
    binning: int = 1
    knock_px: float = 0.0
    softer_px: float = 0.0

    def shot(self, level: Callable[[Shot], float]) -> Shot:
        """Return what the next frame is taken with. level: computes a shot's mean grey level."""
        warm = (self.white_balance_k / NEUTRAL_K) ** 0.5
        gain, tint = 10 ** (self.gain_db / 20), (1 / warm, 1.0, warm)
        longest_us = 1e6 / self.frame_rate
        if self.auto_exposure:
            one_ms = Shot(1.0, gain, tint)
            aimed_us = 1000 * AUTO_LEVEL / max(level(one_ms), 1e-6)
            self.exposure_us = min(max(aimed_us, MIN_EXPOSURE_US), longest_us)
        self.exposure_us = min(self.exposure_us, longest_us)
        return Shot(self.exposure_us / 1000, gain, tint)

    def controls(self) -> tuple[Control, ...]:
        return (
            Control(
                "exposure",
                "Exposure time",
                "float",
                self.exposure_us,
                "µs",
                (MIN_EXPOSURE_US, 1e6 / self.frame_rate),
                (),
                self.auto_exposure,
            ),
            Control("gain", "Gain", "float", self.gain_db, "dB", (0.0, MAX_GAIN_DB)),
            Control("white_balance", "White balance", "float", self.white_balance_k, "K", KELVINS),
            Control(
                "resolution",
                "Resolution",
                "choice",
                self._text(self.binning),
                "px",
                None,
                tuple(self._text(n) for n in self._binnings),
            ),
            Control("frame_rate", "Frame rate", "float", self.frame_rate, "Hz", RATES_HZ),
            Control(
                "knock",
                "Move the camera: rotate it to the side",
                "float",
                self.knock_px,
                "px",
                KNOCKS_PX,
            ),
            Control("softer", "Defocus the lens", "float", self.softer_px, "px", SOFTER_PX),
        )

    def set(self, name: str, value: Any) -> Control:
        """Set one; NotFound for an unknown name, BadInput for a value that it cannot have."""
        control = self._control(name)
        if value == "auto" and control.automatic is not None:
            self.auto_exposure = True
        elif control.range is None:  # a choice
            if value not in control.choices:
                raise refused_value(
                    control.label, repr(str(value)[:40]), " or ".join(control.choices)
                )
            self.binning = self._binnings[control.choices.index(value)]
        else:
            low, high = control.range
            if not is_number(value, low, high):
                other = ', or "auto"' if control.automatic is not None else ""
                raise refused_value(
                    control.label,
                    repr(str(value)[:40]),
                    f"a number from {low:g} to {high:g}{other}",
                )
            setattr(self, NUMBERS[name], float(value))
            if name == "exposure":
                self.auto_exposure = False
            # no exposure is longer than a frame
            self.exposure_us = min(self.exposure_us, 1e6 / self.frame_rate)
        return self._control(name)

    def _control(self, name: str) -> Control:
        table = {control.name: control for control in self.controls()}
        if name not in table:
            raise unknown_control(name, table)
        return table[name]

    @property
    def _binnings(self) -> list[int]:
        w, h = self.size
        return [n for n in BINNINGS if w % n == h % n == 0 and min(w, h) // n >= 32]

    def _text(self, binning: int) -> str:
        return f"{self.size.width // binning}x{self.size.height // binning}"


class SimSource(BaseSource):
    """Renders one frame after the other. rendering: everything about the simulated scene."""

    TITLE: ClassVar = "Simulated camera"
    HELP: ClassVar = "A simulated field with robots and a ball, imaged with a realistic lens model. No hardware needed."
    TARGET: ClassVar = "the field's name"
    CAN_REST: ClassVar = True  # rendering costs CPU time: no more frames than viewers want
    OPTIONS: ClassVar = (
        Option("camera", "int", 0, "Number of this camera above the field.", (0, 7)),
        Option(
            "cameras", "choice", "1", "Number of cameras above the field.", choices=tuple(CAMERAS)
        ),
        Option("region", "text", "", "The covered area, instead of camera and cameras."),
        Option(
            "rotate",
            "choice",
            None,
            "Rotation of the covered area in the image. If not set: its own.",
            unit="°",
            choices=("0", "90", "180", "270"),
        ),
        Option(
            "lens",
            "choice",
            "strong",
            "Lens distortion preset. The name of a lens model is also accepted.",
            choices=tuple(LENSES),
        ),
        *(
            Option(term, "float", None, f"Lens term {term}. If not set: from the preset.", (-5, 5))
            for term in LENS_TERMS
        ),
        Option(
            "height",
            "float",
            None,
            "Height above the carpet. If not set: 0.7 of the diagonal of the covered area.",
            (200, 100_000),
            "mm",
        ),
        Option("tilt", "float", 0.0, "Tilt towards the top of the image.", (-60, 60), "°"),
        Option("pan", "float", 0.0, "Pan to the right.", (-60, 60), "°"),
        Option("roll", "float", 0.0, "Rotation about its own axis.", (-180, 180), "°"),
        Option(
            "fill",
            "float",
            0.9,
            "Share of the image that the covered area fills. Above 1 it is cut off.",
            (0.2, 3),
        ),
        Option("size", "text", "1280x1024", "Width and height of the image.", unit="px"),
        Option("robots", "int", 6, "Robots on the field, both teams.", (0, 32)),
        Option(
            "speed",
            "float",
            None,
            "Speed of the robots. If not set: a tenth of the diagonal of the covered area "
            "per second. The ball is kicked three times as fast.",
            (0, 10_000),
            "mm/s",
        ),
        Option(
            "numbers",
            "choice",
            "counted",
            "Robots are numbered from 0, or get random numbers from 0 to 15.",
            choices=("counted", "drawn"),
        ),
        Option(
            "play",
            "choice",
            "region",
            "Where they play: in the covered area of this camera, or on the whole "
            "field. On the whole field, all cameras with the same seed show the same "
            "play.",
            choices=("region", "field"),
        ),
        Option(
            "blue_mm",
            "float",
            None,
            "Height of the blue robots. If not set: that of the field.",
            (20, 300),
            "mm",
        ),
        Option(
            "yellow_mm",
            "float",
            None,
            "Height of the yellow robots. If not set: that of the field.",
            (20, 300),
            "mm",
        ),
        Option("ball", "bool", False, "Show a ball even without robots."),
        Option("people", "int", 0, "People who walk around and hide lines.", (0, 8)),
        Option(
            "walk",
            "float",
            1200.0,
            "Walking speed. At 0 they stand at the edge.",
            (0, 5000),
            "mm/s",
        ),
        Option("noise", "float", 2.0, "Sensor noise, standard deviation.", (0, 60), "grey levels"),
        Option(
            "blur",
            "float",
            0.65,
            "Blur of the lens and the pixels, standard deviation.",
            (0.3, 5),
            "px",
        ),
        Option("vignette", "float", 0.35, "Darkening towards the corners.", (0, 1)),
        Option("glare", "float", 0.1, "Reflection of a lamp on the carpet.", (0, 1)),
        Option("light", "float", 1.0, "Brightness of the whole image.", (0.05, 3)),
        Option("flicker", "float", 0.0, "Amplitude of the lamp flicker, up and down.", (0, 1)),
        Option("flicker_hz", "float", 100.0, "Frequency of the lamp flicker.", (0.01, 2000), "Hz"),
        Option(
            "readout",
            "float",
            15.0,
            "Rolling shutter, from the first row to the last. At 0 all rows are exposed at once.",
            (0, 1000),
            "ms",
        ),
        Option("drift", "float", 0.0, "Slow variation of the light within a minute.", (0, 0.95)),
        Option("grain", "float", 1.0, "Texture of the carpet.", (0, 3)),
        Option("seed", "int", 1, "Seed of the noise and the play.", (0, 2**31)),
        Option("fps", "float", 15.0, "Frames per second.", RATES_HZ),
        Option(
            "timecode", "bool", False, "Show the capture time in each image, as a row of cells."
        ),
        Option("serial", "text", "", "The camera's serial number. If not set: none."),
    )

    def __init__(
        self,
        rendering: Rendering,
        fps: float,
        identity: Identity,
        with_timecode: bool,
        light: Light = LIGHT,
    ) -> None:
        self.settings = Settings(rendering.camera.image_size, fps)
        self.time_s = 0.0  # of the newest frame
        self._light = light
        self._untouched = self._sizes = {1: rendering}  # by binning; what is seen now
        self._painted_state = (0.0, 0.0)  # the knock and focus that it shows
        self._painting = threading.Lock()
        self._identity = identity
        self._with_timecode = with_timecode
        self._index = 0
        self._pacer = Pacer()
        self._open = True

    @classmethod
    def open(cls, target: str, options: Mapping[str, Any], context: SourceContext) -> Self:
        field = named_field(context, target)
        region = _region(field, options)
        serial = options["serial"]
        if len(serial) > 100 or not serial.isprintable():
            raise BadInput(
                say("sim.bad-serial", "The option serial is not a serial number."),
                say("sim.serial-form", "Use up to 100 letters, digits and punctuation characters."),
                reason="bad-option",
            )
        play = Motion(
            options["robots"],
            options["people"],
            options["seed"],
            options["speed"],
            options["walk"],
            options["numbers"] == "drawn",
            options["ball"],
            options["blue_mm"],
            options["yellow_mm"],
        )
        light = Light(
            vignette=options["vignette"],
            glare=options["glare"],
            gain=options["light"],
            grain=options["grain"],
        )
        played = field.regions["full"] if options["play"] == "field" else region
        rendering = Rendering.of(
            _camera(region, options),
            field,
            played,
            play,
            light,
            Sensor(options["blur"], options["noise"], options["readout"]),
            Lamps(options["flicker"], options["flicker_hz"], options["drift"]),
        )
        where = options["region"] or f"{options['camera']} of {options['cameras']}"
        return cls(
            rendering,
            options["fps"],
            Identity(f"sim://{target} ({where})", serial, model=cls.TITLE),
            options["timecode"],
            light,
        )

    @property
    def rendering(self) -> Rendering:
        """The rendering at the current resolution, pose and focus."""
        sizes, binning = self._sizes, self.settings.binning
        if binning not in sizes:
            for other in set(sizes) - {1}:
                del sizes[other]
            sizes[binning] = sizes[1].binned(binning)
        return sizes[binning]

    @property
    def settled(self) -> bool:
        """Whether the picture shows the current pose: after a knock it is painted anew, which takes a second."""
        return self._painted_state == (self.settings.knock_px, self.settings.softer_px)

    def _paint(self) -> None:
        """Paint anew, on a thread of its own, so that frames go on. The unknocked rendering is kept."""
        with self._painting:
            while not self.settled:
                state = self.settings.knock_px, self.settings.softer_px
                self._sizes = (
                    {1: self._untouched[1].knocked(*state, self._light)}
                    if any(state)
                    else self._untouched
                )
                self._painted_state = state
        return_memory()

    @property
    def camera(self) -> SimCamera:
        return self.rendering.camera

    def read(self) -> Frame:
        require_open(self._open or None)
        self._pacer.wait(self.settings.frame_rate)
        # The time is counted up frame by frame: nothing jumps when the rate is changed.
        self.time_s += 1 / self.settings.frame_rate if self._index else 0.0
        pixels = self.rendering.frame_at(self._index, self.time_s, self.settings.shot(self._level))
        self._index += 1
        if self._with_timecode:
            timecode.paint(pixels, time.time_ns() // 1_000_000)
        pixels.setflags(write=False)
        return Frame(pixels)

    def pass_over(self, seconds: float) -> None:
        """Let so much time go by without a frame, up to the next one."""
        self.time_s += max(0.0, seconds - 1 / self.settings.frame_rate)

    def _level(self, shot: Shot) -> float:
        return self.rendering.mean_level * float(
            np.mean(self.rendering.row_gain(self.time_s, shot))
        )

    def close(self) -> None:
        self._open = False

    def controls(self) -> tuple[Control, ...]:
        return self.settings.controls()

    def set_control(self, name: str, value: Any) -> Control:
        control = self.settings.set(name, value)
        if not self.settled:
            threading.Thread(target=self._paint, name="knock", daemon=True).start()
        return control


def _region(field: Field, options: Mapping[str, Any]) -> Region:
    numbered = CAMERAS[options["cameras"]]
    if not options["region"] and options["camera"] >= len(numbered):
        raise BadInput(
            say(
                "sim.no-camera",
                "There is no camera {camera} among {cameras}.",
                camera=options["camera"],
                cameras=len(numbered),
            ),
            say(
                "sim.camera-range",
                "Use 0 to {last}, or set cameras=2, 4 or 8.",
                last=len(numbered) - 1,
            ),
            reason="bad-option",
        )
    rotate = None if options["rotate"] is None else int(options["rotate"])
    return field.region(options["region"] or numbered[options["camera"]], rotate)


def _camera(region: Region, options: Mapping[str, Any]) -> SimCamera:
    height_mm = options["height"] or HEIGHT_PER_DIAGONAL * float(
        np.hypot(region.width_mm, region.height_mm)
    )
    return SimCamera.above(
        region,
        _size(options["size"]),
        _lens(options),
        height_mm=height_mm,
        tilt_deg=options["tilt"],
        pan_deg=options["pan"],
        roll_deg=options["roll"],
        fill=options["fill"],
    )


def _lens(options: Mapping[str, Any]) -> Lens:
    """Return the preset with the given terms; BadInput for a term that it does not have."""
    preset = LENSES[options["lens"]]
    given = {term: options[term] for term in LENS_TERMS if options[term] is not None}
    known = [member.name for member in dataclasses.fields(preset)]
    for term in given:
        if term not in known:
            raise BadInput(
                say(
                    "sim.no-term",
                    "The lens {lens!r} has no term {term}.",
                    lens=options["lens"],
                    term=term,
                ),
                say("sim.terms", "It has {terms}.", terms=list(known)),
                reason="bad-option",
            )
    return dataclasses.replace(preset, **given)


def _size(text: str) -> ImageSize:
    found = re.fullmatch(r"([0-9]{2,5})[x×]([0-9]{2,5})", text)
    width, height = (int(n) for n in found.groups()) if found else (0, 0)
    if min(width, height) < 32 or width * height > MAX_PIXELS:
        raise BadInput(
            say("sim.bad-size", "The option size cannot be {size!r}.", size=text),
            say(
                "sim.size-form",
                "Write it as 1280x1024: at least 32 px a side, at most {most_megapixels} "
                "megapixels.",
                most_megapixels=MAX_PIXELS // 10**6,
            ),
            reason="bad-option",
        )
    return ImageSize(width, height)
