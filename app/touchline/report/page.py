"""The page of a report, one file to print on A4 or to keep, and its pictures: points, field, maps of expected error.

Photographs are JPEG, what is drawn over them is SVG in the picture's own pixels, so that lines stay sharp on paper.
"""

import json
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from numpy.typing import NDArray

from touchline.core import opencv
from touchline.core.errors import TouchlineError
from touchline.core.field import BORDERS, Region
from touchline.core.geometry import ImageSize
from touchline.core.records import Calibration, Observations, observations_from_json
from touchline.core.sentences import area_name, marking_name
from touchline.evaluate.headline_figures import HEADLINE
from touchline.images import encode
from touchline.imaging.correction import CorrectedView
from touchline.imaging.heat_map import heat_map
from touchline.models import Restored
from touchline.report.contents import ReportPicture, outcome
from touchline.workflows import calibration as workflow

MAX_SIDE_PX = 1600  # an A4 page is 190 mm wide: 210 dots an inch
# of one photograph; two of them in base64 leave 0.8 of 3 MB for all the rest
MAX_PHOTO_BYTES = 800_000
# width, JPEG quality
TRIES = ((MAX_SIDE_PX, 88), (MAX_SIDE_PX, 75), (MAX_SIDE_PX, 55), (1200, 55), (800, 50))
MARGIN = 0.04  # of the corrected picture's width, shown around the region
MAX_POINTS = 20_000  # of one drawing's lines; the richest league field has 3000
# the longer side of an error map: two stand beside each other, their words in the size of print
MAP_PX = 270
INK, PAPER = (34, 26, 20), (255, 255, 255)
# Okabe and Ito's palette, as on the page: told apart by colour-blind eyes
BORDER_COLOURS = {"left": "#56b4e9", "right": "#e69f00", "top": "#cc79a7", "bottom": "#f0e442"}
LINE_COLOUR, OTHER_CLICKS, SEAM = "#7fe0b0", "#ffffff", "#10201a80"

# also in the file itself: once downloaded it has no server that could say so
POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"
SCENE = "scene.html"  # as REST calls it
LEVEL = {"good": "Good", "fair": "Fair", "poor": "Poor", "unknown": "Accuracy unknown"}
BENDS = {
    "barrel": "Barrel distortion: borders bow outwards.",
    "none": "No clear distortion.",
    "pincushion": "Pincushion distortion: borders bow inwards.",
}
MAX_PARAMETER_CHARACTERS = 12_000  # a spline through thousands of clicks is told by its hash alone

TEMPLATES = Environment(
    loader=PackageLoader("touchline.report"),
    autoescape=True,
    undefined=StrictUndefined,
    finalize=lambda given: "" if given is None else given,
    trim_blocks=True,
    lstrip_blocks=True,
)


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
    # why there is no corrected picture although there is one as it was taken
    after_why: str | None = None


def draw(
    calibration: Calibration, picture: ReportPicture, contents: Mapping[str, Any]
) -> ReportDrawings:
    """All pictures of one report. contents: its data."""
    built = Restored.of(calibration)
    maps = _maps(contents["uncertainty"], built.region)
    if picture.frame is None:
        return ReportDrawings(None, None, maps)
    observations = observations_from_json(calibration.observations)
    lines = workflow.overlay(built.model, built.field, built.region)
    before = _picture(
        picture.frame.pixels,
        [
            *_lines(lines, calibration.image_size),
            *_clicks(observations, calibration.outliers(observations), calibration.image_size),
        ],
        "The raw image",
    )
    try:
        view = _view(calibration.corrected_size)
        pixels = workflow.correct(picture.frame.pixels, built.model, calibration.image_size, view)
        lines = workflow.overlay(built.model, built.field, built.region, "corrected", view)
    except TouchlineError as refusal:
        return ReportDrawings(before, None, maps, str(refusal))
    height, width = pixels.shape[:2]
    return ReportDrawings(
        before,
        _picture(pixels, _lines(lines, ImageSize(width, height)), "The corrected image"),
        maps,
    )


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
            paths.setdefault(line["feature"] if line["kind"] == "border" else "", []).append(
                _path(points, size)
            )
    drawn = []
    for name in ("", *BORDERS):
        d = "".join(paths.get(name, ()))
        if d:
            drawn += [
                Stroke(d, SEAM, 2.6 * unit),
                Stroke(d, BORDER_COLOURS.get(name, LINE_COLOUR), 1.3 * unit),
            ]
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


def _clicks(
    observations: Observations, outliers: Sequence[NDArray[np.bool_]], size: ImageSize
) -> list[Stroke]:
    """A dot for each click in its border's colour, a red cross for each stray."""
    unit = max(size) / 800
    dots: dict[str, list[str]] = {}
    crosses = []
    for observation, out in zip(observations, outliers, strict=True):
        name = observation.feature if isinstance(observation.feature, str) else ""
        spots = [f"M{x:.2f} {y:.2f}h0" for x, y in observation.points[~out]]
        dots.setdefault(BORDER_COLOURS.get(name, OTHER_CLICKS), []).extend(spots)
        arm = 4 * unit
        crosses += [
            f"M{x - arm:.2f} {y - arm:.2f}l{2 * arm:.2f} {2 * arm:.2f}m0 {-2 * arm:.2f}l{-2 * arm:.2f} "
            f"{2 * arm:.2f}"
            for x, y in observation.points[out]
        ]
    drawn = []
    for colour, spots in dots.items():
        d = "".join(spots)
        drawn += [
            Stroke(d, "#10201a", 7 * unit, is_dot=True),
            Stroke(d, colour, 4.6 * unit, is_dot=True),
        ]
    cross = "".join(crosses)
    return (
        drawn
        if not cross
        else [*drawn, Stroke(cross, "#ffffff", 4 * unit), Stroke(cross, "#d00000", 2 * unit)]
    )


def _maps(uncertainty: Mapping[str, Any], region: Region) -> dict[str, str]:
    found = {name: part["map"] for name, part in uncertainty.items() if part["map"] is not None}
    if not found:
        return {}
    scale = MAP_PX / max(region.width_mm, region.height_mm)
    width, height = (max(40, round(side * scale)) for side in (region.width_mm, region.height_mm))
    return {
        name: data_address(
            encode(
                heat_map(
                    np.array(part["grid"]["sigma_mm"], float),
                    width=width,
                    height=height,
                    unit="mm",
                    title=f"z = {part['z_mm']:g} mm",
                    ink=INK,
                    paper=PAPER,
                )
            ),
            "png",
        )
        for name, part in found.items()
    }


def page(contents: Mapping[str, Any], drawn: ReportDrawings) -> str:
    """Return the report as HTML, from its contents and its pictures."""
    version = contents["calibration"]
    camera = version["camera_name"] or version["camera"] or "an image without a camera"
    return render(
        "report.html",
        **contents,
        title=f"Calibration of {camera}, version {version['version']}",
        drawn=drawn,
        best=_best_next_click(contents),
        parameters=_parameters(contents["model"]["parameters"]),
        policy=POLICY,
        scene=SCENE,
        levels=LEVEL,
        bends=BENDS,
        head=HEADLINE,
    )


def render(name: str, **given: Any) -> str:
    """Return a page of the folder templates; every text that goes in is escaped."""
    return TEMPLATES.get_template(name).render(**given)


def _best_next_click(contents: Mapping[str, Any]) -> Mapping[str, Any] | None:
    best = contents["next_click"]
    if (
        best
        and best["point"]
        and None not in (best["worst_mm"], best["worst_mm_then"])
        and round(best["worst_mm_then"], 1) < round(best["worst_mm"], 1)
    ):  # as they are printed
        return best
    return None


def _parameters(given: Mapping[str, Any]) -> str:
    text = "\n".join(f"{name}: {_json(value)}" for name, value in given.items())
    return (
        text
        if len(text) <= MAX_PARAMETER_CHARACTERS
        else (f"{len(text)} characters: export the calibration as JSON to read them.")
    )


def _rounded(number: float, digits: int) -> str:
    shown = f"{number:.{digits}f}"
    return shown.replace("-", "−") if float(shown) else shown.lstrip("-")


def _feature(name: str | list[float] | None) -> str:
    if isinstance(name, list):
        return f"({name[0]:g}, {name[1]:g}) mm"
    shown = marking_name(name or "–")
    return f"{shown[:1].upper()}{shown[1:]}"


def _height(part: tuple[str, Mapping[str, Any]]) -> str:
    name, found = part
    return "on the carpet" if name == "carpet" else f"at robot-top height, {found['z_mm']:g} mm"


def _place(point: list[float] | None) -> str:
    return "–" if point is None else f"({point[0]:.0f}, {point[1]:.0f})".replace("-", "−")


def _span(ends: list[float]) -> str:
    return f"{ends[0]:g} to {ends[1]:g} mm".replace("-", "−")


def _json(given: object) -> str:
    return json.dumps(given, ensure_ascii=False, allow_nan=False)


def _size(size: list[int]) -> str:
    return f"{size[0]} × {size[1]} px"


TEMPLATES.filters |= {
    "area_name": area_name,
    "feature": _feature,
    "height": _height,
    "json": _json,
    "outcome": outcome,
    "place": _place,
    "repr": repr,
    "rounded": _rounded,
    "size": _size,
    "span": _span,
}
