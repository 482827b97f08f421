"""The page: one file that asks for nothing else, to print on A4 or to keep beside the match."""

import json
from collections.abc import Mapping
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from touchline.core.sentences import area_name, marking_name
from touchline.evaluate.headline_figures import HEADLINE
from touchline.report.contents import outcome
from touchline.report.drawing import ReportDrawings

# also in the file itself: once downloaded it has no server that could say so
POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"
SCENE = "scene.html"  # as REST calls it
LEVEL = {"good": "Good", "fair": "Fair", "poor": "Poor", "unknown": "Accuracy unknown"}
BENDS = {"barrel": "Barrel distortion: borders bow outwards.", "none": "No clear distortion.",
         "pincushion": "Pincushion distortion: borders bow inwards."}
MAX_PARAMETER_CHARACTERS = 12_000  # a spline through thousands of clicks is told by its hash alone


def page(contents: Mapping[str, Any], drawn: ReportDrawings) -> str:
    """Return the report as HTML, from its contents and its pictures."""
    version = contents["calibration"]
    camera = version["camera_name"] or version["camera"] or "an image without a camera"
    return render("report.html", **contents, title=f"Calibration of {camera}, version {version['version']}",
                  drawn=drawn, best=_best_next_click(contents), parameters=_parameters(contents["model"]["parameters"]),
                  policy=POLICY, scene=SCENE, levels=LEVEL, bends=BENDS, head=HEADLINE)


def render(name: str, **given: Any) -> str:
    """Return a page of the folder templates; every text that goes in is escaped."""
    return TEMPLATES.get_template(name).render(**given)


def _best_next_click(contents: Mapping[str, Any]) -> Mapping[str, Any] | None:
    best = contents["next_click"]
    if best and best["point"] and None not in (best["worst_mm"], best["worst_mm_then"]) \
            and round(best["worst_mm_then"], 1) < round(best["worst_mm"], 1):  # as they are printed
        return best
    return None


def _parameters(given: Mapping[str, Any]) -> str:
    text = "\n".join(f"{name}: {_json(value)}" for name, value in given.items())
    return text if len(text) <= MAX_PARAMETER_CHARACTERS else (
        f"{len(text)} characters: export the calibration as JSON to read them.")


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


TEMPLATES = Environment(loader=PackageLoader("touchline.report"), autoescape=True,
                        undefined=StrictUndefined, finalize=lambda given: "" if given is None else given,
                        trim_blocks=True, lstrip_blocks=True)
TEMPLATES.filters |= {"area_name": area_name, "feature": _feature, "height": _height, "json": _json, "outcome": outcome,
                      "place": _place, "repr": repr, "rounded": _rounded, "size": _size, "span": _span}
