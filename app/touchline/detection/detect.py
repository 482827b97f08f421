"""Detection of ball and robots: a stage pipeline set up for a camera, and detect() for one still picture.

    pipeline = pipeline_for(config, size, profile, calibration)     once for a camera
    pipeline.process(pixels, clock=perf_counter)                    for each frame

Where a config asks for corrected pictures, each frame is rectified first. It costs a remap a frame and resamples what
is then measured; colours and patterns are the same size all over the field. Heights are allowed for as on the raw
picture: along the ray of the raw pixel; and detections are in raw pixels either way.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np

from touchline.core.errors import BadInput, Conflict
from touchline.core.field import Field
from touchline.core.field_json import field_from_json
from touchline.core.geometry import Array, ImageSize, Pixels, Points, as_points
from touchline.core.jobs import Progress, no_progress
from touchline.core.records import Calibration, Frame
from touchline.core.sentences import CALIBRATE_THIS_SIZE, other_image_size
from touchline.core.statements import say, stated
from touchline.detection.colours import (
    BACKGROUND,
    Box,
    Click,
    automatic_profile,
    colour_health,
    learn_profile,
    mean_light,
)
from touchline.detection.profile import NAMES, ColourProfile
from touchline.detection.records import Detections, FieldLocator
from touchline.detection.stages import FrameResult, StageConfig, StageContext, StagePipeline
from touchline.imaging.correction import CorrectedView, correction_map
from touchline.models import CameraModel, RayModel, Restored, model_of
from touchline.workflows.calibration import check_size

# by colour: x, y of a click, or x0, y0, x1, y1 of a box
Clicks = Mapping[str, Sequence[Sequence[float]]]
NO_HEIGHTS: Mapping[str, float] = {}
SMALL_MM = 100.0  # robots lower than that wear two colours, and no SSL pattern
DETECTING = say("progress.detecting", "Detecting")
BESIDE_MM = 300.0  # around the field, where a ball or a robot may still be
MAX_CLICKS = 40  # of one colour
MAX_PX = 16e6  # of a still picture: three seconds, and 0.5 GB
MAX_RECTIFIED_WIDTH_PX = 4096
DIGITS = 4  # in the JSON of a frame: a ten-thousandth of a pixel or millimetre
RECTIFY = "correct"  # what its time is called
_GRID_PX = 12  # how finely the field's edge is known in the picture


@dataclass(frozen=True, eq=False)
class DetectionResult:
    """What a picture showed, and by which stages and colours."""

    seen: FrameResult
    config: StageConfig
    profile: ColourProfile

    def to_json(self) -> dict[str, Any]:
        return stated(
            {
                **self.seen.detections.to_json(),
                "stages": self.config.name,
                "took_ms": dict(self.seen.took_ms),
                "notes": [*self.profile.notes, *self.seen.notes],
                "colours": self.profile.to_json(),
                "health": [health.to_json() for health in colour_health(self.profile)],
            }
        )


def detect(
    pixels: Pixels,
    config: StageConfig,
    *,
    calibration: Calibration | None = None,
    profile: ColourProfile | None = None,
    clicks: Clicks | None = None,
    mm_per_px: float | None = None,
    eye_mm: tuple[float, float, float] | None = None,
    team_z_mm: Mapping[str, float] = NO_HEIGHTS,
    pictures: Collection[str] = (),
    progress: Progress = no_progress,
    clock: Callable[[], float] | None = None,
) -> DetectionResult:
    """Detect ball and robots in one picture. Colours are a profile's, or clicked in this picture, or found in it.

    mm_per_px: how large things are, where there is no calibration. eye_mm: the camera's position, field mm, given by
    hand for a model without rays. team_z_mm: as context_for. clock: seconds, to time the stages.
    """
    size = ImageSize(pixels.shape[1], pixels.shape[0])
    if size.width * size.height > MAX_PX:
        raise BadInput(
            say(
                "detection.image-too-large",
                "The image ({size}) is too large for object detection.",
                size=size,
            ),
            say(
                "detection.smaller-image",
                "Use an image of at most {most_megapixels:.0f} million pixels, "
                "or lower the camera's resolution.",
                most_megapixels=MAX_PX / 1e6,
            ),
            reason="image-too-large",
        )
    if calibration is None and mm_per_px is None:
        raise BadInput(
            say("detection.no-scale", "The scale of this image is unknown."),
            say("detection.select-calibration", "Select a calibration, or enter the mm per pixel."),
            reason="no-scale",
        )
    if eye_mm is not None and not eye_mm[2] > 0:
        raise BadInput(
            say("detection.height-not-positive", "The camera height must be above the carpet."),
            say("detection.enter-height", "Enter the height in mm, more than 0."),
            reason="bad-eye",
        )
    if calibration is not None:
        check_size(size, calibration.image_size)
    profile = colour_profile_for(pixels, config, profile, clicks)
    progress(0.4, DETECTING)
    # What is loaded and made at the first frame is no part of a frame's time.
    given = (config, size, profile, calibration, mm_per_px, eye_mm, team_z_mm)
    pipeline_for(*given).process(pixels)
    progress(0.7, DETECTING)
    pipeline = pipeline_for(*given)
    config = pipeline.config
    return DetectionResult(
        pipeline.process(pixels, clock=clock, pictures=pictures), config, profile
    )


def colour_profile_for(
    pixels: Pixels,
    config: StageConfig,
    profile: ColourProfile | None = None,
    clicks: Clicks | None = None,
) -> ColourProfile:
    """Return a profile, with clicks in this picture added; without both it is detected in the image."""
    if clicks:
        return learn_profile(
            profile.name if profile else "clicked", [(pixels, _read(clicks))], profile
        )
    if profile is not None:
        return profile
    everywhere = next(
        (options["everywhere"] for name, options in config.stages if name == "colours"), ()
    )
    read_near = ("pink", "green") if any(name == "butterfly" for name, _ in config.stages) else ()
    return automatic_profile(
        "detected in the image", pixels, tuple(dict.fromkeys([*everywhere, *read_near]))
    )


def learn_from_frame(
    frame: Frame,
    plan: StageConfig,
    base: ColourProfile | None,
    clicks: Mapping[str, Any],
    find_colours: bool,
) -> ColourProfile:
    """Return a profile from clicks by colour, from what is found in the picture, or from both: clicks win."""
    found = base
    if find_colours:
        found = (
            colour_profile_for(frame.pixels, plan)
            if base is None
            else automatic_profile(base.name, frame.pixels, tuple(base.colours), base)
        )
    if not any(clicks.values()):
        return found if found is not None else colour_profile_for(frame.pixels, plan)
    clicked = colour_profile_for(frame.pixels, plan, base, clicks)
    if not find_colours or found is None:
        return clicked
    others = {colour: samples for colour, samples in found.colours.items() if colour not in clicks}
    return replace(
        clicked,
        name=found.name,
        notes=found.notes,
        colours={
            **others,
            **{colour: clicked.colours[colour] for colour in clicks if colour in clicked.colours},
        },
    )


def _read(clicks: Clicks) -> dict[str, list[Click | Box]]:
    """Check clicks and boxes: finite pairs, or fours."""
    found: dict[str, list[Click | Box]] = {}
    for colour, places in clicks.items():
        if colour != BACKGROUND and colour not in NAMES:
            raise BadInput(
                f"Unknown colour: {str(colour)[:40]!r}.",
                f"Use one of: {', '.join(NAMES)}, {BACKGROUND}.",
                reason="unknown-colour",
            )
        if len(places) > MAX_CLICKS or any(len(place) not in (2, 4) for place in places):
            raise BadInput(
                say(
                    "detection.bad-samples",
                    "The samples of {colour} are invalid, or more than {most}.",
                    colour=colour,
                    most=MAX_CLICKS,
                ),
                say(
                    "detection.sample-form",
                    "Send [x, y] for a point, or [x0, y0, x1, y1] for a box.",
                ),
                reason="bad-clicks",
            )
        samples = found[colour] = []
        for place in places:
            x, y, *end = (
                as_points(np.reshape(place, (-1, 2)), f"The samples of {colour}").ravel().tolist()
            )
            samples.append((x, y, end[0], end[1]) if end else (x, y))
    return found


def context_for(
    size: ImageSize,
    profile: ColourProfile,
    calibration: Calibration | None = None,
    mm_per_px: float | None = None,
    eye_mm: tuple[float, float, float] | None = None,
    team_z_mm: Mapping[str, float] = NO_HEIGHTS,
) -> StageContext:
    """Return the stages' context; a calibration gives places, sizes, heights and where the field is.

    team_z_mm: heights of teams of the Small Size League, which count where the field's robots are as large.
    """
    if calibration is None:
        return StageContext(size, profile, FieldLocator.flat(size, mm_per_px or 1.0))
    check_size(size, calibration.image_size)
    field = field_from_json(calibration.field)
    view = FieldLocator.of(model_of(calibration), eye_mm)
    ball = field.extras.get("ball", {}).get("radius_mm", 21.5)
    tops_mm = team_z_mm if wears_ssl_pattern(field) else {}
    within = field_area(view, field)
    return StageContext(size, profile, view, field.hat_height_mm, ball, within, tops_mm)


def wears_ssl_pattern(field: Field) -> bool:
    """Tell whether a field's robots are of the Small Size League's size: smaller ones wear two colours."""
    return field.hat_height_mm >= SMALL_MM


def pipeline_for(
    config: StageConfig,
    size: ImageSize,
    profile: ColourProfile,
    calibration: Calibration | None = None,
    mm_per_px: float | None = None,
    eye_mm: tuple[float, float, float] | None = None,
    team_z_mm: Mapping[str, float] = NO_HEIGHTS,
) -> "StagePipeline | RectifiedDetector":
    """Set up the stages of a camera. Conflict no-calibration where corrected pictures are asked for without one."""
    context = context_for(size, profile, calibration, mm_per_px, eye_mm, team_z_mm)
    config = with_calibration_sigma(config, calibration)
    if not config.corrected:
        return StagePipeline(config, context)
    if calibration is None:
        raise Conflict(
            say(
                "detection.not-calibrated",
                "The image cannot be corrected, because there is no calibration.",
            ),
            say(
                "detection.use-calibration",
                "Activate or select a calibration, or use the raw image.",
            ),
            reason="no-calibration",
        )
    return RectifiedDetector(config, context, calibration)


def with_calibration_sigma(config: StageConfig, calibration: Calibration | None) -> StageConfig:
    """Add the calibration's own expected error to every place's covariance, unless the config gives another."""
    sigma = (calibration.report.get("sigma_mm") or {}) if calibration is not None else {}
    carpet, hat = _each_way(sigma), _each_way(sigma.get("hat") or {})
    sigmas = {"calibration_sigma_mm": carpet, "hat_sigma_mm": hat or carpet}
    return replace(
        config,
        stages=tuple(
            (name, {**options, **{k: v for k, v in sigmas.items() if not options[k]}})
            if name == "places"
            else (name, options)
            for name, options in config.stages
        ),
    )


def _each_way(sigma: Mapping[str, Any]) -> float:
    """Split a report's expected error, a length, into σ of each axis; 0 where it is not known."""
    return float(np.clip((sigma.get("median") or 0.0) / np.sqrt(2), 0, 500))


def field_area(view: FieldLocator, field: Field) -> Pixels | None:
    """Return a mask (height, width), 255 where the field is or a robot on it; None where the model cannot tell."""
    w, h = view.image_size
    columns, rows = max(2, -(-w // _GRID_PX)), max(2, -(-h // _GRID_PX))
    grid = np.stack(
        np.meshgrid((np.arange(columns) + 0.5) * w / columns, (np.arange(rows) + 0.5) * h / rows),
        -1,
    )
    reach = np.array([field.length_mm, field.width_mm]) / 2 + BESIDE_MM
    inside = np.zeros((rows, columns), bool)
    for z_mm in (0.0, field.hat_height_mm) if view.knows_heights else (0.0,):
        with np.errstate(invalid="ignore"):
            inside |= (np.abs(view.field_from_raw(grid, z_mm)) <= reach).all(axis=-1)
    if not inside.any():
        return None
    cells = cv2.dilate(inside.astype(np.uint8) * 255, np.ones((3, 3), np.uint8))
    return np.asarray(cv2.resize(cells, (w, h), interpolation=cv2.INTER_NEAREST), np.uint8)


def detections_image(
    pixels: Pixels, detections: Detections, view: FieldLocator, robot_mm: float = 90.0
) -> Pixels:
    """Draw a ring around each thing, and each robot's front and number."""
    picture = pixels.copy()
    for item in detections.items:
        paint = NAMES.get(
            item.team or "", NAMES["orange"] if item.kind == "ball" else (255, 255, 255)
        )
        turns = view.spread(np.array([item.pixel]), item.z_mm)[1][0]
        px_per_mm = (
            np.linalg.inv(turns)
            if np.isfinite(turns).all() and np.linalg.det(turns)
            else np.zeros((2, 2))
        )
        radius = 1.4 * np.sqrt(item.area_px / np.pi) + 3
        if item.kind == "robot":
            radius = max(radius, robot_mm * float(np.sqrt(abs(np.linalg.det(px_per_mm)))))
        at = (round(item.pixel[0]), round(item.pixel[1]))
        cv2.circle(picture, at, max(3, round(radius)), (0, 0, 0), 3, cv2.LINE_AA)
        cv2.circle(picture, at, max(3, round(radius)), paint, 2, cv2.LINE_AA)
        if item.orientation_rad is not None:
            way = px_per_mm @ np.array([np.cos(item.orientation_rad), np.sin(item.orientation_rad)])
            way = way / max(float(np.hypot(*way)), 1e-9) * radius
            cv2.line(
                picture, at, (round(at[0] + way[0]), round(at[1] + way[1])), paint, 2, cv2.LINE_AA
            )
        if item.kind == "robot":
            spot = (at[0] + 5, at[1] - round(radius) - 3)
            for colour, width in (((0, 0, 0), 3), ((255, 255, 255), 1)):
                cv2.putText(
                    picture,
                    "?" if item.id is None else str(item.id),
                    spot,
                    cv2.FONT_HERSHEY_SIMPLEX,
                    0.5,
                    colour,
                    width,
                    cv2.LINE_AA,
                )
    return picture


def detection_json(
    result: FrameResult | None,
    seq: int,
    time_s: float,
    size: ImageSize,
    calibration: Calibration | None,
    notes: tuple[str, ...],
    fps: float,
) -> dict[str, Any]:
    """Return what was detected in a frame of a live camera or a clip; result: None where it could not be processed."""
    items = result.detections.items if result else ()
    took = dict(result.took_ms) if result else {}
    return stated(
        {
            "seq": seq,
            "time_s": round(time_s, 4),
            "width": size.width,
            "height": size.height,
            "calibration": calibration.id if calibration else None,
            "items": [_rounded(i.to_json()) for i in items],
            "stages": [{"name": name, "ms": round(ms, 3)} for name, ms in took.items()],
            "ms": round(sum(took.values()), 3),
            "notes": [*notes, *(result.notes if result else ())],
            "fps": round(fps, 2),
        }
    )


def _rounded(value: Any) -> Any:
    if isinstance(value, float):
        return round(value, DIGITS)
    if isinstance(value, dict):
        return {name: _rounded(one) for name, one in value.items()}
    return [_rounded(one) for one in value] if isinstance(value, (list, tuple)) else value


@dataclass(frozen=True, eq=False)
class _RectifiedCamera:
    """A camera whose pictures are corrected already: what FieldLocator needs of a model."""

    model: CameraModel
    shown: CorrectedView
    image_size: ImageSize

    def raw(self, pixels: Points) -> Points:
        return self.model.raw_from_corrected(
            self.shown.corrected_from_view(self.model, np.asarray(pixels, float))
        )

    def corrected_from_raw(self, pixels: Points) -> Points:
        return self.shown.corrected_from_view(self.model, np.asarray(pixels, float))

    def field_from_corrected(self, points: Points) -> Points:
        return self.model.field_from_corrected(points)

    def unproject(self, pixels: Points, z_mm: float | Array) -> Points:
        if not isinstance(self.model, RayModel):
            return np.full_like(pixels, np.nan)  # out of reach
        return self.model.unproject(self.raw(pixels), z_mm)


class RectifiedDetector:
    """StagePipeline on rectified frames. context is that of the raw picture, in whose pixels results are given.

    BESIDE_MM of carpet around the region is shown as well.
    """

    def __init__(
        self, config: StageConfig, context: StageContext, calibration: Calibration
    ) -> None:
        self.config, self.context = config, context
        model, field, region = Restored.of(calibration)
        margin_px = round(BESIDE_MM * model.corrected_size.width / region.width_mm)
        # As fine as the raw picture where that is finest: no dot becomes smaller than it was.
        axes = (np.linspace(0, n - 1, 9) for n in calibration.image_size)
        spots = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
        finest = float(np.nanmin(context.view.scale(spots)))
        width_px = (region.width_mm + 2 * BESIDE_MM) / finest
        shown = CorrectedView(margin_px, int(np.clip(width_px, 64, MAX_RECTIFIED_WIDTH_PX)))
        self._straight = _RectifiedCamera(model, shown, shown.size(model))
        self._map = correction_map(model, shown)
        view = FieldLocator(
            self._straight.image_size,
            self._straight,
            eye_mm=context.view.eye_mm,
            has_rays=isinstance(model, RayModel),
        )
        self._inside = replace(
            context, image_size=self._straight.image_size, view=view, within=field_area(view, field)
        )
        self._inner: StagePipeline | None = None

    def _pipeline(self, pixels: Pixels, rectified: Pixels) -> StagePipeline:
        """Return the pipeline, made at the first frame, which shows how much darker a corrected picture is."""
        if self._inner is None:
            profile = self._inside.profile
            if profile.light is not None:
                blue, green, red = (
                    float(v * ((b + 1) / (a + 1)))
                    for v, a, b in zip(
                        profile.light, mean_light(pixels), mean_light(rectified), strict=True
                    )
                )
                profile = replace(profile, light=(blue, green, red))
            self._inner = StagePipeline(self.config, replace(self._inside, profile=profile))
        return self._inner

    def process(
        self,
        pixels: Pixels,
        *,
        clock: Callable[[], float] | None = None,
        pictures: Collection[str] = (),
        camera: str | None = None,
        frame: int | None = None,
        time_s: float | None = None,
    ) -> FrameResult:
        """As StagePipeline.process; the stages' pictures are corrected ones."""
        size = ImageSize(pixels.shape[1], pixels.shape[0])
        if size != self.context.image_size:
            raise BadInput(
                other_image_size(size, self.context.image_size),
                CALIBRATE_THIS_SIZE,
                reason="size-mismatch",
            )
        began = clock() if clock else 0.0
        rectified = self._map.apply(pixels)
        took = {RECTIFY: 1000 * (clock() - began)} if clock else {}
        seen = self._pipeline(pixels, rectified).process(
            rectified, clock=clock, pictures=pictures, camera=camera, frame=frame, time_s=time_s
        )
        items = seen.detections.items
        raw = self._straight.raw(np.array([item.pixel for item in items]).reshape(-1, 2))
        found = tuple(
            replace(item, pixel=(float(x), float(y)))
            for item, (x, y) in zip(items, raw, strict=True)
            if np.isfinite((x, y)).all()
        )
        return replace(
            seen,
            detections=replace(seen.detections, items=found, image_size=size),
            took_ms={**took, **seen.took_ms},
        )
