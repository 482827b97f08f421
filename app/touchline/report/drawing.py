"""The pictures of a report: as it was taken with its clicks and the field, corrected, and maps of expected error.

Photographs are JPEG, what is drawn over them is SVG in the picture's own pixels, so that lines stay sharp on paper.
"""

from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.core import opencv
from touchline.core.errors import TouchlineError
from touchline.core.field import BORDERS, Region
from touchline.core.geometry import ImageSize
from touchline.core.records import Calibration, Observations, observations_from_json
from touchline.images import encode
from touchline.imaging.correction import CorrectedView
from touchline.imaging.heat_map import heat_map
from touchline.models import Restored
from touchline.report.contents import ReportPicture
from touchline.workflows import calibration as workflow

MAX_SIDE_PX = 1600  # an A4 page is 190 mm wide: 210 dots an inch
MAX_PHOTO_BYTES = 800_000  # of one photograph; two of them in base64 leave 0.8 of 3 MB for all the rest
TRIES = ((MAX_SIDE_PX, 88), (MAX_SIDE_PX, 75), (MAX_SIDE_PX, 55), (1200, 55), (800, 50))  # width, JPEG quality
MARGIN = 0.04  # of the corrected picture's width, shown around the region
MAX_POINTS = 20_000  # of one drawing's lines; the richest league field has 3000
MAP_PX = 270  # the longer side of an error map: two stand beside each other, their words in the size of print
INK, PAPER = (34, 26, 20), (255, 255, 255)
# Okabe and Ito's palette, as on the page: told apart by colour-blind eyes
BORDER_COLOURS = {"left": "#56b4e9", "right": "#e69f00", "top": "#cc79a7", "bottom": "#f0e442"}
LINE_COLOUR, OTHER_CLICKS, SEAM = "#7fe0b0", "#ffffff", "#10201a80"


@dataclass(frozen=True)
class Stroke:
    """path: as SVG has it, in the picture's pixels. is_dot: it has round ends."""

    path: str
    colour: str
    width_px: float
    is_dot: bool = False


@dataclass(frozen=True)
class Photograph:
    """A picture of that size, px, as a data address, with strokes over it from the centre of its top-left pixel."""

    title: str
    width: int
    height: int
    address: str
    strokes: tuple[Stroke, ...]


@dataclass(frozen=True)
class ReportDrawings:
    """before, after: None where there is no picture. maps: by "carpet" and "hat", as data addresses."""

    before: Photograph | None
    after: Photograph | None
    maps: Mapping[str, str]
    after_why: str | None = None  # why there is no corrected picture although there is one as it was taken


def draw(calibration: Calibration, picture: ReportPicture, contents: Mapping[str, Any]) -> ReportDrawings:
    """All pictures of one report. contents: its data."""
    built = Restored.of(calibration)
    maps = _maps(contents["uncertainty"], built.region)
    if picture.frame is None:
        return ReportDrawings(None, None, maps)
    observations = observations_from_json(calibration.observations)
    lines = workflow.overlay(built.model, built.field, built.region)
    before = _picture(picture.frame.pixels, [*_lines(lines, calibration.image_size),
                                             *_clicks(observations, calibration.outliers(observations),
                                                      calibration.image_size)], "The raw image")
    try:
        view = _view(calibration.corrected_size)
        pixels = workflow.correct(picture.frame.pixels, built.model, calibration.image_size, view)
        lines = workflow.overlay(built.model, built.field, built.region, "corrected", view)
    except TouchlineError as refusal:
        return ReportDrawings(before, None, maps, str(refusal))
    height, width = pixels.shape[:2]
    return ReportDrawings(before, _picture(pixels, _lines(lines, ImageSize(width, height)), "The corrected image"),
                          maps)


def _jpeg(pixels: NDArray[np.uint8]) -> bytes:
    """A JPEG of at most MAX_PHOTO_BYTES: smaller, then coarser, until it fits; the last try counts as it is."""
    data = b""
    for width, quality in TRIES:
        data = encode(opencv.shrink_to_width(pixels, width), "jpg", quality)
        if len(data) <= MAX_PHOTO_BYTES:
            break
    return data


def data_address(data: bytes, kind: str) -> str:
    return f"data:image/{kind};base64,{b64encode(data).decode()}"


def _view(size: ImageSize) -> CorrectedView:
    """The region with some carpet around it, at most MAX_SIDE_PX on its longer side."""
    margin = round(MARGIN * size.width)
    width, height = size.width + 2 * margin, size.height + 2 * margin
    scale = MAX_SIDE_PX / max(width, height)
    return CorrectedView(margin, max(16, round(width * scale)) if scale < 1 else None)


def _picture(pixels: NDArray[np.uint8], strokes: Iterable[Stroke], title: str) -> Photograph:
    height, width = pixels.shape[:2]
    return Photograph(title, width, height, data_address(_jpeg(pixels), "jpeg"), tuple(strokes))


def _lines(lines: Iterable[Mapping[str, Any]], size: ImageSize) -> list[Stroke]:
    """The field's lines as one path, each border as one of its own, over a dark seam that parts them from carpet."""
    unit = max(size) / 800
    left = MAX_POINTS
    paths: dict[str, list[str]] = {}
    for line in lines:
        points = line["points"][:left]
        left -= len(points)
        if len(points) > 1:
            paths.setdefault(line["feature"] if line["kind"] == "border" else "", []).append(_path(points, size))
    drawn = []
    for name in ("", *BORDERS):
        d = "".join(paths.get(name, ()))
        if d:
            drawn += [Stroke(d, SEAM, 2.6 * unit), Stroke(d, BORDER_COLOURS.get(name, LINE_COLOUR), 1.3 * unit)]
    return drawn


def _path(points: Sequence[Sequence[float] | None], size: ImageSize) -> str:
    """Through points in pixels, with a gap where one is out of reach or far outside."""
    reach = 4 * max(size)
    pen, words = "M", []
    for point in points:
        if point is None or max(abs(point[0]), abs(point[1])) > reach:
            pen = "M"
            continue
        words.append(f"{pen}{point[0]:.1f} {point[1]:.1f}")
        pen = "L"
    return "".join(words)


def _clicks(observations: Observations, outliers: Sequence[NDArray[np.bool_]], size: ImageSize) -> list[Stroke]:
    """A dot for each click in its border's colour, a red cross for each stray."""
    unit = max(size) / 800
    dots: dict[str, list[str]] = {}
    crosses = []
    for observation, out in zip(observations, outliers, strict=True):
        name = observation.feature if isinstance(observation.feature, str) else ""
        spots = [f"M{x:.2f} {y:.2f}h0" for x, y in observation.points[~out]]
        dots.setdefault(BORDER_COLOURS.get(name, OTHER_CLICKS), []).extend(spots)
        arm = 4 * unit
        crosses += [f"M{x - arm:.2f} {y - arm:.2f}l{2 * arm:.2f} {2 * arm:.2f}m0 {-2 * arm:.2f}l{-2 * arm:.2f} "
                    f"{2 * arm:.2f}" for x, y in observation.points[out]]
    drawn = []
    for colour, spots in dots.items():
        d = "".join(spots)
        drawn += [Stroke(d, "#10201a", 7 * unit, is_dot=True), Stroke(d, colour, 4.6 * unit, is_dot=True)]
    cross = "".join(crosses)
    return drawn if not cross else [
        *drawn, Stroke(cross, "#ffffff", 4 * unit), Stroke(cross, "#d00000", 2 * unit)]


def _maps(uncertainty: Mapping[str, Any], region: Region) -> dict[str, str]:
    found = {name: part["map"] for name, part in uncertainty.items() if part["map"] is not None}
    if not found:
        return {}
    scale = MAP_PX / max(region.width_mm, region.height_mm)
    width, height = (max(40, round(side * scale)) for side in (region.width_mm, region.height_mm))
    return {name: data_address(encode(heat_map(
        np.array(part["grid"]["sigma_mm"], float), width=width, height=height, unit="mm",
        title=f"z = {part['z_mm']:g} mm", ink=INK, paper=PAPER)), "png") for name, part in found.items()}
