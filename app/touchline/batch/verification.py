"""How well a calibration holds on another picture of its camera: by clicks in it, and by the straight edges it shows.

A calibration that fits leaves clicks where the field has them and makes straight edges straight. Edges tell whether the
lens is still the one that was calibrated, at any place where there are some; whether the camera has moved they do not
tell, for a moved camera sees straight edges as straight. Clicks tell both.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.core.errors import FitFailed
from touchline.core.field import Field, Region
from touchline.core.geometry import ImageSize, Points
from touchline.core.progress import Progress
from touchline.core.records import Observations
from touchline.evaluate.fit.residuals import feature_residuals, rms
from touchline.evaluate.fit.verdict import FAIR_MM, GOOD_MM
from touchline.models import CameraModel
from touchline.vision.lines.edges import edge_chains
from touchline.workflows import straight_lines

MARGIN_SHARE = 0.05  # of the corrected picture's size: a curve fitted to borders says nothing further out
MIN_POINTS = 20  # of a chain that are left within: fewer are no edge
LEVELS = ("good", "fair", "poor")


def verify(model: CameraModel, pixels: NDArray[np.uint8], observations: Observations, field: Field, region: Region,
         own: bool, progress: Progress) -> dict[str, Any]:
    """Return figures, verdict and warnings of one picture. own: the calibration was made from it."""
    clicks = _by_clicks(model, observations, field, region) if observations else None
    progress(0.2, "Detecting edges")
    edges = _by_edges(model, pixels)
    judged = [part for part in (clicks, edges) if part and part["level"] is not None]
    worst = [part["worst_mm"] for part in judged if part["worst_mm"] is not None]
    by_clicks = clicks or {"rms_mm": None, "rms_px": None, "warnings": []}
    return {"verdict": max((part["level"] for part in judged), key=LEVELS.index, default="unknown"),
            "judged_by": " and ".join(part["by"] for part in judged),
            "held_out_mm": None if own else by_clicks["rms_mm"], "rms_mm": by_clicks["rms_mm"],
            "rms_px": by_clicks["rms_px"], "worst_mm": max(worst, default=None),
            "distortion_before_pct": edges["before_pct"], "distortion_after_pct": edges["after_pct"],
            "warnings": [*by_clicks["warnings"], *edges["warnings"]]}


def level_of(mm: float) -> str:
    return LEVELS[int(mm > GOOD_MM) + int(mm > FAIR_MM)]


def _by_clicks(model: CameraModel, observations: Observations, field: Field, region: Region) -> dict[str, Any]:
    residuals = [feature_residuals(model, observation, field, region) for observation in observations]
    mm = np.concatenate([np.empty(0), *(r.mm for r in residuals)])
    px = np.concatenate([np.empty(0), *(r.px for r in residuals)])
    found, lost = rms(mm), int((~np.isfinite(mm)).sum())
    warnings = [] if not lost else [f"{lost} of {len(mm)} points are outside the range of the calibration. Check that "
                                    "they are points in an image of this camera."]
    level = None if not len(mm) else "poor" if lost or found is None else level_of(found)
    return {"by": "clicks", "level": level, "rms_mm": found, "rms_px": rms(px), "warnings": warnings,
            "worst_mm": None if found is None else float(np.nanmax(mm))}


def _by_edges(model: CameraModel, pixels: NDArray[np.uint8]) -> dict[str, Any]:
    """The bow of the edge that bows most, in the raw picture and in the corrected one."""
    chains = edge_chains(pixels)
    seen = [within for chain in chains if len(within := _within(model, chain)) >= MIN_POINTS]
    before, _ = _bow(chains, ImageSize(pixels.shape[1], pixels.shape[0]))
    after, refusal = _bow(seen, model.corrected_size)
    nothing = {"by": "edges", "level": None, "before_pct": before and before["pct"], "after_pct": None,
               "worst_mm": None}
    if after is None:
        return {**nothing, "warnings": [refusal]}
    told = {**nothing, "after_pct": after["pct"], "warnings": []}
    if after["distortion"] == "unknown":
        return {**told, "warnings": ["The edges do not show whether the image is straight. Use an image with long "
                                     "edges on all sides, or give points."]}
    ends = seen[after["line"]][[0, -1]]  # of its chord: along it a corrected pixel is so many mm
    mm_long, px_long = (np.linalg.norm(np.diff(places, axis=0)) for places in (model.field_from_corrected(ends), ends))
    mm = after["px"] * float(mm_long / px_long)
    return {**told, "level": "good" if after["distortion"] == "none" else level_of(mm), "worst_mm": float(mm)}


def _within(model: CameraModel, chain: Points) -> Points:
    """A chain in the corrected picture, as far as that and a little more reaches."""
    corrected, size = model.corrected_from_raw(chain), np.array(tuple(model.corrected_size))
    with np.errstate(invalid="ignore"):
        fine = ((corrected >= -MARGIN_SHARE * size) & (corrected <= (1 + MARGIN_SHARE) * size)).all(axis=-1)
    return corrected[fine]


def _bow(chains: Sequence[Points], size: ImageSize) -> tuple[dict[str, Any] | None, str]:
    try:
        found = straight_lines.straightness([chains], (), size)
    except FitFailed as refusal:
        return None, str(refusal)
    return {**found["bow"]["most"], "distortion": found["distortion"]}, ""
