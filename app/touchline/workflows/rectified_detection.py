"""Detection in the corrected picture: each frame is rectified first, then processed by the stages.

    pipeline = RectifiedDetector(config, context, calibration, beside_mm, field_area)
    pipeline.process(pixels, …)                            detections are in raw pixels either way

It costs a remap a frame and resamples what is then measured; colours and patterns are the same size all over the field.
Where heights are known they are allowed for as on the raw picture: along the ray of the raw pixel.
"""

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace

import numpy as np

from touchline.core.common_sentences import CALIBRATE_THIS_SIZE, other_image_size
from touchline.core.errors import BadInput
from touchline.core.field import Field
from touchline.core.geometry import Array, ImageSize, Pixels, Points
from touchline.core.records import Calibration
from touchline.imaging.correction import CorrectedView, correction_map
from touchline.models import CameraModel, RayModel
from touchline.models.restored import Restored
from touchline.vision.colour.learning import mean_light
from touchline.vision.stage_pipeline import FrameResult, StageConfig, StagePipeline
from touchline.vision.stages import StageContext
from touchline.vision.stages.localisation import FieldLocator

MAX_PX = 4096
STAGE = "correct"  # what its time is called


@dataclass(frozen=True, eq=False)
class _RectifiedCamera:
    """A camera whose pictures are corrected already: what FieldLocator needs of a model."""

    model: CameraModel
    shown: CorrectedView
    image_size: ImageSize

    def raw(self, pixels: Points) -> Points:
        return self.model.raw_from_corrected(self.shown.corrected_from_view(self.model, np.asarray(pixels, float)))

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

    beside_mm of carpet around the region is shown as well; on_field: makes the mask in which anything is looked for.
    """

    def __init__(self, config: StageConfig, context: StageContext, calibration: Calibration, beside_mm: float,
                 on_field: Callable[[FieldLocator, Field], Pixels | None]) -> None:
        self.config, self.context = config, context
        model, field, region = Restored.of(calibration)
        margin_px = round(beside_mm * model.corrected_size.width / region.width_mm)
        # As fine as the raw picture where that is finest: no dot becomes smaller than it was.
        axes = (np.linspace(0, n - 1, 9) for n in calibration.image_size)
        spots = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
        finest = float(np.nanmin(context.view.scale(spots)))
        shown = CorrectedView(margin_px, int(np.clip((region.width_mm + 2 * beside_mm) / finest, 64, MAX_PX)))
        self._straight = _RectifiedCamera(model, shown, shown.size(model))
        self._map = correction_map(model, shown)
        view = FieldLocator(self._straight.image_size, self._straight, eye_mm=context.view.eye_mm,
                             has_rays=isinstance(model, RayModel))
        self._inside = replace(context, image_size=self._straight.image_size, view=view, within=on_field(view, field))
        self._inner: StagePipeline | None = None

    def _pipeline(self, pixels: Pixels, rectified: Pixels) -> StagePipeline:
        """Return the pipeline, made at the first frame, which shows how much darker a corrected picture is."""
        if self._inner is None:
            profile = self._inside.profile
            if profile.light is not None:
                blue, green, red = (float(v * ((b + 1) / (a + 1))) for v, a, b in zip(
                    profile.light, mean_light(pixels), mean_light(rectified), strict=True))
                profile = replace(profile, light=(blue, green, red))
            self._inner = StagePipeline(self.config, replace(self._inside, profile=profile))
        return self._inner

    def process(self, pixels: Pixels, *, clock: Callable[[], float] | None = None,
                pictures: Collection[str] = (), camera: str | None = None, frame: int | None = None,
                time_s: float | None = None) -> FrameResult:
        """As StagePipeline.process; the stages' pictures are corrected ones."""
        size = ImageSize(pixels.shape[1], pixels.shape[0])
        if size != self.context.image_size:
            raise BadInput(other_image_size(size, self.context.image_size), CALIBRATE_THIS_SIZE, reason="size-mismatch")
        began = clock() if clock else 0.0
        rectified = self._map.apply(pixels)
        took = {STAGE: 1000 * (clock() - began)} if clock else {}
        seen = self._pipeline(pixels, rectified).process(rectified, clock=clock, pictures=pictures, camera=camera,
                                                         frame=frame, time_s=time_s)
        items = seen.detections.items
        raw = self._straight.raw(np.array([item.pixel for item in items]).reshape(-1, 2))
        found = tuple(replace(item, pixel=(float(x), float(y))) for item, (x, y) in zip(items, raw, strict=True)
                      if np.isfinite((x, y)).all())
        return replace(seen, detections=replace(seen.detections, items=found, image_size=size),
                       took_ms={**took, **seen.took_ms})
