"""Expected error as coloured sheets, at the carpet and where hats are; all cameras on one scale."""

import viser

from app.imaging.heat_map import round_up
from app.scene.cameras import add_lying
from app.scene.geometry.error_surface import Sheet
from app.scene.geometry.scene_camera import Standing

ABOVE_MM = 6.0


def top_of(cameras: list[Standing]) -> float | None:
    """The scale's end, mm, for all sheets together; None where nobody knows anything."""
    known = [sheet.largest_mm for camera in cameras for sheet in (camera.carpet_sheet, camera.hat_sheet)
             if isinstance(sheet, Sheet)]
    return round_up(max(known)) if known else None


def draw_sheets(scene: viser.SceneApi, name: str, standing: Standing, top_mm: float,
                ) -> dict[str, viser.SceneNodeHandle]:
    """{"carpet", "hat"}, as far as they are known."""
    return {which: add_lying(scene, f"{name}/{which}", sheet.picture(top_mm), sheet.lying, ABOVE_MM)
            for which, sheet in (("carpet", standing.carpet_sheet), ("hat", standing.hat_sheet))
            if isinstance(sheet, Sheet)}
