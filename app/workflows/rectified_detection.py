"""Seeing in the corrected picture, where somebody asks for it: each frame is straightened first, then looked at.

    sight = CorrectedSight(plan, setting, calibration, beside_mm, on_field)    instead of Sight(plan, setting)
    sight.see(pixels, …)                                   pixels of what was found are raw ones either way

It costs a remap a frame and resamples what is then measured; colours and patterns are the same size all over the field.
Where heights are known they are allowed for as on the raw picture: along the ray of the raw pixel.
"""

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.core.errors import BadInput
from app.core.field import Field
from app.core.field_json import field_from_json
from app.core.geometry import ImageSize, Points
from app.core.records import Calibration
from app.imaging.correction import View as CorrectedView
from app.imaging.correction import correction_map
from app.models import CameraModel, RayModel, model_from_json
from app.vision.colour.learning import light_of
from app.vision.stage_pipeline import Plan, Seen, Sight
from app.vision.stages import Setting
from app.vision.stages.localisation import View

MOST_PX = 4096
STAGE = "correct"  # what its time is called


@dataclass(frozen=True, eq=False)
class _Straightened:
    """A camera whose pictures are corrected ones already: what View asks of a model."""

    model: CameraModel
    shown: CorrectedView
    image_size: ImageSize

    def raw(self, pixels: Points) -> Points:
        return self.model.raw_from_corrected(self.shown.corrected_from_view(self.model, np.asarray(pixels, float)))

    def corrected_from_raw(self, pixels: Points) -> Points:
        return self.shown.corrected_from_view(self.model, np.asarray(pixels, float))

    def field_from_corrected(self, points: Points) -> Points:
        return self.model.field_from_corrected(points)

    def unproject(self, pixels: Points, z_mm: Any) -> Points:
        return self.model.unproject(self.raw(pixels), z_mm)


class CorrectedSight:
    """Sight on straightened frames. setting is that of the raw picture, in whose pixels everything is told.

    beside_mm of carpet around the region is shown as well; on_field: where of such a picture anything is looked for.
    """

    def __init__(self, plan: Plan, setting: Setting, calibration: Calibration, beside_mm: float,
                 on_field: Callable[[View, Field], NDArray[np.uint8] | None]) -> None:
        self.plan, self.setting = plan, setting
        model = model_from_json(calibration.model_name, calibration.model_parameters)
        field = field_from_json(calibration.field)
        region = field.region(calibration.region, calibration.rotate)
        margin_px = round(beside_mm * model.corrected_size.width / region.width_mm)
        # As fine as the raw picture where that is finest: no dot becomes smaller than it was.
        axes = (np.linspace(0, n - 1, 9) for n in calibration.image_size)
        spots = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
        finest = float(np.nanmin(setting.view.scale(spots)))
        shown = CorrectedView(margin_px, int(np.clip((region.width_mm + 2 * beside_mm) / finest, 64, MOST_PX)))
        self._straight = _Straightened(model, shown, shown.size(model))
        self._map = correction_map(model, shown)
        view = View(self._straight.image_size, self._straight, eye_mm=setting.view.eye_mm,
                    has_rays=isinstance(model, RayModel))
        self._inside = replace(setting, image_size=self._straight.image_size, view=view, within=on_field(view, field))
        self._inner: Sight | None = None

    def _sight(self, pixels: NDArray[np.uint8], straight: NDArray[np.uint8]) -> Sight:
        """Made at the first frame, which tells how much darker a corrected picture is than its raw one."""
        if self._inner is None:
            profile = self._inside.profile
            if profile.light is not None:
                darker = [(b + 1) / (a + 1) for a, b in zip(light_of(pixels), light_of(straight), strict=True)]
                light = tuple(float(v * d) for v, d in zip(profile.light, darker, strict=True))
                profile = replace(profile, light=light)
            self._inner = Sight(self.plan, replace(self._inside, profile=profile))
        return self._inner

    def see(self, pixels: NDArray[np.uint8], *, clock: Callable[[], float] | None = None,
            pictures: Collection[str] = (), camera: str | None = None, frame: int | None = None,
            time_s: float | None = None) -> Seen:
        """As Sight.see; the stages' pictures are corrected ones."""
        size = ImageSize(pixels.shape[1], pixels.shape[0])
        if size != self.setting.image_size:
            raise BadInput(f"The picture is {size.width} × {size.height} px, the calibration was made for "
                           f"{self.setting.image_size.width} × {self.setting.image_size.height} px.",
                           "Use a picture of that size, or calibrate this one.", reason="size-mismatch")
        began = clock() if clock else 0.0
        straight = self._map.apply(pixels)
        took = {STAGE: 1000 * (clock() - began)} if clock else {}
        seen = self._sight(pixels, straight).see(straight, clock=clock, pictures=pictures, camera=camera, frame=frame,
                                                 time_s=time_s)
        items = seen.detections.items
        raw = self._straight.raw(np.array([item.pixel for item in items]).reshape(-1, 2))
        found = tuple(replace(item, pixel=(float(x), float(y))) for item, (x, y) in zip(items, raw, strict=True)
                      if np.isfinite((x, y)).all())
        return replace(seen, detections=replace(seen.detections, items=found, image_size=size),
                       took_ms={**took, **seen.took_ms})
