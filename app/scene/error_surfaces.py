"""Draw expected error as coloured surfaces, on the carpet and at hat height; all cameras on one scale."""

import viser

from app.imaging.heat_map import round_up
from app.scene.cameras import add_quad
from app.scene.geometry.error_surface import ErrorSurface
from app.scene.geometry.scene_camera import SceneCamera

ABOVE_MM = 6.0


def common_scale_mm(cameras: list[SceneCamera]) -> float | None:
    """Return the upper end of the common colour scale, mm; None where no error is known."""
    known = [surface.largest_mm for camera in cameras for surface in (camera.carpet_error, camera.hat_error)
             if isinstance(surface, ErrorSurface)]
    return round_up(max(known)) if known else None


def draw_error_surfaces(scene: viser.SceneApi, name: str, camera: SceneCamera, top_mm: float,
                ) -> dict[str, list[viser.SceneNodeHandle]]:
    """Draw the layers "carpet" and "hat", as far as they are known."""
    return {which: [add_quad(scene, f"{name}/{which}", surface.picture(top_mm), surface.quad, ABOVE_MM)]
            for which, surface in (("carpet", camera.carpet_error), ("hat", camera.hat_error))
            if isinstance(surface, ErrorSurface)}
