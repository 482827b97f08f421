"""Claims of a version, and what makes each of them false, over a whole field of the second simulator.

FALSE has the cases: what is made false, the codes of the claims that then must not be held, and how it is done.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import cv2
import numpy as np

from tests.support.second_simulator.opencv_camera import OpenCvCamera
from tests.support.second_simulator.paint import PaintErrors, painted
from tests.support.second_simulator.render import render
from tests.support.second_simulator.scene_spec import (
    Optics,
    SceneSpec,
    Sensor,
    Things,
    camera_of,
    fields,
    scene_spec,
)
from touchline.core.field import BORDERS, Field
from touchline.core.geometry import ImageSize, Pixels
from touchline.core.records import Calibration, Observation
from touchline.drift.check import check
from touchline.drift.service import ends_claim, lines_claim, live_claim
from touchline.evaluate.claims import Claim, field_claims, report_claims
from touchline.evaluate.field_lines.orientation import OrientationReference
from touchline.models import Restored, model_of
from touchline.workflows.calibration_request import CalibrationRequest

SIZE = (640, 512)
POINT_PX = 0.2  # of the points on the markings
EACH_MARKING = 24


@dataclass(frozen=True, eq=False)
class World:
    """A camera over a whole field, and a good version of it with its measured height."""

    seed: int

    @cached_property
    def spec(self) -> SceneSpec:
        tilt_deg = float(np.random.default_rng([self.seed, 31]).uniform(3, 6))
        return scene_spec(
            self.seed,
            field="ssl-div-b",
            region="full",
            size=SIZE,
            lens="opencv-sample-left",
            mirrored=False,
            tilt_deg=tilt_deg,
            mount_deg=0.0,
            centre_px=(2.0, -1.5),
            aspect=1.0,
            paint=PaintErrors(2.0),
            optics=Optics(),
            sensor=Sensor(),
            things=Things(robots=8, seams=True, goals=True, walls=True, glare=2),
        )

    @cached_property
    def camera(self) -> OpenCvCamera:
        return camera_of(self.spec)

    @property
    def field(self) -> Field:
        return fields()[self.spec.field]

    @cached_property
    def picture(self) -> Pixels:
        """That the version comes from."""
        return render(self.spec).pixels

    @cached_property
    def later(self) -> Pixels:
        """Of the same camera: other robots, light and noise."""
        return render(self.spec, moment=1).pixels

    def points(
        self, change: Callable[[np.ndarray], np.ndarray] = lambda px: px
    ) -> tuple[Observation, ...]:
        """Points on the markings as they are painted. change: of their pixels."""
        rng, found = np.random.default_rng([self.seed, 37]), []
        # as render() has it
        paint = painted(self.field, self.spec.paint, np.random.default_rng([self.seed, 11]))
        for marking in paint.markings:
            along = marking.sample(4 * EACH_MARKING)
            pixels = change(self.camera.project(np.column_stack([along, np.zeros(len(along))])))
            pixels = pixels[self.camera.inside(pixels, 4)][2::4]
            if len(pixels) > 3:
                name = self.field.observed_name(marking.name, self.field.regions["full"])
                found.append(
                    Observation(name, "line", pixels + rng.normal(0, POINT_PX, pixels.shape))
                )
        return tuple(found)

    def made(
        self,
        observations: Sequence[Observation] | None = None,
        field: Field | None = None,
        rotate: int = 0,
        factor: float | None = 1.0,
        **options: object,
    ) -> Calibration:
        """A version of the points. factor: of the entered height, None without one."""
        field = field or self.field
        if factor is not None:
            options["height_mm"] = {
                "value": factor * float(self.camera.position_mm[2]),
                "sigma": 20.0,
            }
        request = CalibrationRequest(
            tuple(observations or self.points()),
            field,
            field.region("full", rotate),
            ImageSize(*SIZE),
            "brown-conrady",
            options,
        )
        return replace(request.record(request.preview(cross_validate=False)), id="made", version=1)

    @cached_property
    def version(self) -> Calibration:
        return self.made()

    def live(self, picture: Pixels) -> list[Claim]:
        """What is claimed of the version while its camera shows that."""
        return [live_claim(check(self.version, picture, before=self.picture))]

    def shifted(self, x_px: float, y_px: float = 0.0) -> Pixels:
        move = np.array([[1.0, 0.0, x_px], [0.0, 1.0, y_px]])
        return np.asarray(
            cv2.warpAffine(self.later, move, SIZE, borderMode=cv2.BORDER_REPLICATE), np.uint8
        )

    def zoomed(self, factor: float) -> Pixels:
        move = cv2.getRotationMatrix2D((SIZE[0] / 2, SIZE[1] / 2), 0.0, factor)
        return np.asarray(
            cv2.warpAffine(self.later, move, SIZE, borderMode=cv2.BORDER_REPLICATE), np.uint8
        )


def all_claims(world: World, version: Calibration, picture: Pixels) -> list[Claim]:
    """What is claimed of a version from its own report and its own picture."""
    return [*report_claims(version), lines_claim(check(version, picture))]


def enlarged(field: Field, factor: float) -> Field:
    """The field as somebody believes it who measures too long."""
    lines = {
        name: replace(
            line,
            start=(line.start[0] * factor, line.start[1] * factor),
            end=(line.end[0] * factor, line.end[1] * factor),
        )
        for name, line in field.lines.items()
    }
    arcs = {
        name: replace(
            arc,
            centre=(arc.centre[0] * factor, arc.centre[1] * factor),
            radius_mm=arc.radius_mm * factor,
        )
        for name, arc in field.arcs.items()
    }
    regions = {
        name: replace(
            region,
            x_mm=(region.x_mm[0] * factor, region.x_mm[1] * factor),
            y_mm=(region.y_mm[0] * factor, region.y_mm[1] * factor),
        )
        for name, region in field.regions.items()
    }
    return replace(
        field,
        length_mm=field.length_mm * factor,
        width_mm=field.width_mm * factor,
        lines=lines,
        arcs=arcs,
        regions=regions,
    )


def _own_lens(world: World) -> dict[str, Any]:
    """Its lens as a calibration of it has it, to be kept."""
    return {
        "lens": {"name": world.version.model_name, "parameters": world.version.model_parameters},
        "lens_sigma": "0",
    }


def _other_lens(world: World, share: float) -> list[Claim]:
    """The lens of another camera is given, which bends that share of what this one bends, and is kept."""
    made = world.version.model_parameters
    other = {**made, "lens_terms": [share * term for term in made["lens_terms"]]}
    return report_claims(
        world.made(lens={"name": "brown-conrady", "parameters": other}, lens_sigma="0")
    )


def _stretched(world: World) -> list[Claim]:
    """The picture comes 6 % wider than it is high, and nobody measured the height."""
    middle = SIZE[0] / 2
    points = world.points(
        change=lambda px: np.column_stack([(px[:, 0] - middle) * 0.94 + middle, px[:, 1]])
    )
    return report_claims(world.made(points, factor=None))


def _of_a_screen(world: World) -> list[Claim]:
    """Somebody photographed a screen that shows the camera's picture, from its side."""
    corners = np.array([[0, 0], [SIZE[0], 0], [SIZE[0], SIZE[1]], [0, SIZE[1]]], np.float32)
    seen = np.array(
        [[60, 40], [SIZE[0] - 110, 85], [SIZE[0] - 100, SIZE[1] - 95], [55, SIZE[1] - 35]],
        np.float32,
    )
    screen = cv2.getPerspectiveTransform(corners, seen)
    points = world.points(change=lambda px: cv2.perspectiveTransform(px[None], screen)[0])
    return report_claims(world.made(points, factor=1.0))


def _turned_version(world: World, flip: int | None = None) -> list[Claim]:
    """The version is made of the picture as it is turned by half a turn, or mirrored, against the active one's."""
    model, _, region = Restored.of(world.version)
    borders = [o for o in world.points() if o.feature in BORDERS]
    turned = world.made(borders, rotate=180) if flip is None else world.version
    picture = world.picture if flip is None else world.later[:, ::-1]
    found = OrientationReference.of(world.picture, model, region).compare(picture, model_of(turned))
    return [ends_claim(found, 1)]


def _exchanged_lines(world: World) -> list[Claim]:
    """Points of the halfway line are given as those of a penalty area's front line, and the other way round."""
    exchange = {"halfway-line": "defence-left-front", "defence-left-front": "halfway-line"}
    points = [replace(o, feature=exchange.get(str(o.feature), o.feature)) for o in world.points()]
    return all_claims(world, world.made(points), world.picture)


def _too_few(world: World) -> list[Claim]:
    """Points on the borders, all within the same third of each."""
    points = [
        replace(o, points=o.points[: len(o.points) // 3])
        for o in world.points()
        if o.feature in BORDERS
    ]
    return report_claims(world.made(points, factor=None))


def _moved(world: World, x_mm: float) -> Pixels:
    camera = world.camera
    shift = camera.camera_from_field @ np.array([x_mm, 0.0, 0.0])
    moved = replace(camera, translation_mm=tuple(np.array(camera.translation_mm) - shift))
    return render(world.spec, moved, moment=1).pixels


def _region_of_another(world: World) -> list[Claim]:
    return list(field_claims(world.version, (), "ssl-div-b", "half-left", None))


def _field_of_another(world: World) -> list[Claim]:
    return list(field_claims(world.version, (), "ssl-div-a", "full", None))


def _field_changed(world: World) -> list[Claim]:
    return list(field_claims(world.version, ("halfway-line",), "ssl-div-b", "full", None))


def _enlarged(world: World, factor: float) -> list[Claim]:
    """The field is measured too long, under a lens and a height that are right."""
    return report_claims(world.made(field=enlarged(world.field, factor), **_own_lens(world)))


def _wrong_height(world: World, factor: float) -> list[Claim]:
    """A wrong height is entered, under a lens that is right."""
    return report_claims(world.made(factor=factor, **_own_lens(world)))


@dataclass(frozen=True)
class Falsified:
    """codes: of the claims that are false; any: whether it is enough that one of them is not held, because each is only
    about a part of what is false."""

    codes: tuple[str, ...]
    claims: Callable[[World], list[Claim]]
    any: bool = False

    def held(self, claims: Sequence[Claim]) -> list[str]:
        """Return the codes of the false claims that are held."""
        held = [
            claim.code for claim in claims if claim.code in self.codes and claim.state == "held"
        ]
        return [] if self.any and len(held) < len(self.codes) else held


FALSE: dict[str, Falsified] = {
    "the live image is turned by 180°": Falsified(
        ("live-image",), lambda w: w.live(w.later[::-1, ::-1])
    ),
    "the live image is mirrored": Falsified(("live-image",), lambda w: w.live(w.later[:, ::-1])),
    "the live image is upside down": Falsified(("live-image",), lambda w: w.live(w.later[::-1])),
    "moved by 8 px": Falsified(("live-image",), lambda w: w.live(w.shifted(8))),
    "moved along the halfway line by 4 px": Falsified(
        ("live-image",), lambda w: w.live(w.shifted(0, 4))
    ),
    "hung 60 mm aside": Falsified(("live-image",), lambda w: w.live(_moved(w, 60.0))),
    "zoomed by 3 %": Falsified(("live-image",), lambda w: w.live(w.zoomed(1.03))),
    "the lamps are off": Falsified(
        ("live-image",), lambda w: w.live((w.later // 200).astype(np.uint8))
    ),
    "the lens is covered": Falsified(
        ("live-image",), lambda w: w.live(np.full_like(w.picture, 90))
    ),
    "the version is of another area": Falsified(("region",), _region_of_another),
    "the version is of another field": Falsified(("camera-field",), _field_of_another),
    "the field has changed": Falsified(("field",), _field_changed),
    "the version's field is turned": Falsified(("ends",), _turned_version),
    "the version's picture is mirrored": Falsified(("ends",), lambda w: _turned_version(w, 1)),
    "the field is taken for 2 % larger": Falsified(
        ("height", "accuracy"), lambda w: _enlarged(w, 1.02)
    ),
    "the field is taken for 4 % larger": Falsified(
        ("height", "accuracy"), lambda w: _enlarged(w, 1.04)
    ),
    "the height is entered 10 % too large": Falsified(("height",), lambda w: _wrong_height(w, 1.1)),
    "the height is entered 20 % too small": Falsified(("height",), lambda w: _wrong_height(w, 0.8)),
    "a lens without distortion is given": Falsified(
        ("model", "accuracy"), lambda w: _other_lens(w, 0.0)
    ),
    "a lens of half the distortion is given": Falsified(
        ("accuracy",), lambda w: _other_lens(w, 0.5)
    ),
    "the picture is stretched by 6 %": Falsified(("model", "robot-tops"), _stretched),
    "a photograph of a screen": Falsified(("accuracy",), _of_a_screen),
    "two lines are exchanged": Falsified(("lines", "model"), _exchanged_lines, True),
    "points at one end alone": Falsified(("accuracy",), _too_few),
}
