"""The page: one file that asks for nothing else, to print on A4 or to keep beside the match."""

import json
from collections.abc import Iterable, Mapping
from typing import Any

from app.core.marking_names import area_name, marking_name
from app.report.drawing import ReportDrawings
from app.report.figures import HEAD
from app.report.markup import Html, element, joined
from app.report.style import CSS

# also in the file itself: once downloaded it has no server that could say so
POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"
SCENE = "scene.html"  # as REST and `touchline scene` call it
LEVEL = {"good": "Good", "fair": "Fair", "poor": "Poor", "unknown": "Accuracy unknown"}
MAX_PARAMETER_CHARACTERS = 12_000  # characters; a spline through thousands of clicks is told by its hash alone


def page(contents: Mapping[str, Any], drawn: ReportDrawings) -> str:
    """The report as HTML, from its contents and its pictures."""
    it = contents["calibration"]
    camera = it["camera_name"] or it["camera"] or "an image without a camera"
    title = f"Calibration of {camera}, version {it['version']}"
    head = element("head", element("meta", charset="utf-8"),
                   element("meta", http_equiv="Content-Security-Policy", content=POLICY),
                   element("meta", name="viewport", content="width=device-width, initial-scale=1"),
                   element("title", title), element("style", Html(CSS)))
    body = element("body", _header(contents, title), _figures(contents), _warnings(contents),
                   _pictures(contents, drawn),
                   _distortion(contents), _uncertainty(contents, drawn), _residuals(contents), _provenance(contents))
    return f"<!doctype html>\n{element('html', head, body, lang='en')}\n"


def _header(contents: Mapping[str, Any], title: str) -> Html:
    it, field, verdict = contents["calibration"], contents["field"], contents["verdict"]
    turned = f", rotated by {field['rotate']}°" if field["rotate"] else ""
    length = [": ", value(verdict["mm"], "mm", 1)] if verdict["mm"] is not None else None
    return joined([
        element("h1", title),
        element("p", f"{contents['model']['title']} on {field['title']}, covered area "
                f"{area_name(field['region'])}{turned}. Made {it['created_at']}"
                f"{', active for its camera' if it['active'] else ''}.", class_="dim"),
        element("p", "Note: ", it["note"]) if it["note"] else None,
        element("p", "Camera position and errors: ", element("a", "3-D scene", href=SCENE),
                f" (requires the server or {SCENE} in the same folder).", class_="screen dim"),
        element("div", element("p", element("b", LEVEL[verdict["level"]], length)),
                element("p", verdict["sentence"]), class_=f"verdict {verdict['level']}")])


def _figures(contents: Mapping[str, Any]) -> Html:
    rows = [(it["title"], value(it["value"], it["unit"], HEAD[key].digits), element("span", it["reading"],
                                                                                      class_="reading"))
            for key, it in contents["figures"].items()]
    return joined([element("h2", "Figures"), _table(("", "", "meaning"), rows, numbers={1})])


def _warnings(contents: Mapping[str, Any]) -> Html:
    items = [element("li", element("b", warning["text"]), " ", warning["fix"]) for warning in contents["warnings"]]
    best = contents["next_click"]
    if best and best["point"] and None not in (best["worst_mm"], best["worst_mm_then"]) \
            and round(best["worst_mm_then"], 1) < round(best["worst_mm"], 1):  # as they are printed
        items.append(element("li", "Best next point: ", _feature(best["feature"]), " at ", _place(best["point"]),
                             " px. It would reduce the largest expected error from ", value(best["worst_mm"], "mm", 1),
                             " to ",
                             value(best["worst_mm_then"], "mm", 1), "."))
    return joined([element("h2", "Warnings and remedies"),
                   element("ul", items) if items else element("p", "No warnings.")])


def _pictures(contents: Mapping[str, Any], drawn: ReportDrawings) -> Html:
    section, it = contents["picture"], contents["calibration"]
    if drawn.before is None:
        return joined([element("h2", "Before and after"), _missing(section["why_not"], None)])
    other = [element("p", element("b", "This is not the calibration image"), ": its sha256 differs. Its lines may be "
                     "in other positions.")] if section["same"] is False else None
    before = element("figure", drawn.before, element(
        "figcaption", f"Before: raw image, {_size(it['image_size'])}. Lines: the field model. Dots: points, in the "
        "colour of their border (left blue, right orange, top pink, bottom yellow, others white). "
        "Red crosses: outliers. The lines must match the painted lines."))
    after = _missing(drawn.after_why, None) if drawn.after is None else element("figure", drawn.after, element(
        "figcaption", f"After: corrected, {_size(it['corrected_size'])} within the borders. Straight painted lines "
        "must be straight here, and match the overlay."))
    return joined([element("h2", "Before and after"), other, before, after])


def _distortion(contents: Mapping[str, Any]) -> Html:
    section = contents["distortion"]
    kind = {"barrel": "Barrel distortion: borders bow outwards.", "none": "No clear distortion.",
            "pincushion": "Pincushion distortion: borders bow inwards."}.get(section["kind"] or "")
    rows = [(name.capitalize(), value(it["before_pct"], "%", 2), value(it["after_pct"], "%", 2))
            for name, it in section["per_border"].items()]
    return joined([element("h2", "Distortion of each border"), element("p", kind) if kind else None,
                   _table(("border", "before", "after"), rows, numbers={1, 2}),
                   element("p", "Deviation of a border from its chord, relative to its length; negative is outwards. "
                           "After: the points in the corrected image. Errors that leave borders straight are not "
                           "included.",
                           class_="dim")])


def _uncertainty(contents: Mapping[str, Any], drawn: ReportDrawings) -> Html:
    parts, whys = [], []
    for name, it in contents["uncertainty"].items():
        where = "on the carpet" if name == "carpet" else f"at robot-top height, {it['z_mm']:g} mm"
        if it["map"] is None:
            whys.append(_missing(f"Expected error {where}: {it['why']}", it["fix"]))
            continue
        found = it["map"]
        parts.append(element("figure", element("img", src=drawn.maps[name], alt=f"Map of the expected error {where}"),
                             element("figcaption", f"Expected error {where}: ", value(found["rms"], "mm", 2), " rms, ",
                                     value(found["median"], "mm", 2), " median, ", value(found["max"], "mm", 2),
                                     " largest (circled), at ", _place(found["worst_place"]),
                                     " mm from the field centre.")))
    return joined([element("h2", "Expected error"), element("div", parts, class_="maps") if parts else None, whys,
                   element("p", "The covered area as in the corrected image. Both maps have the same scale. They show "
                           "the effect of the noise of the points, not errors that the model cannot represent.",
                           class_="dim")
                   if parts else None])


def _residuals(contents: Mapping[str, Any]) -> Html:
    lengths = (("rms_px", "px"), ("rms_mm", "mm"), ("max_mm", "mm"))
    rows = [(_feature(it["feature"]) + ("" if it["used"] else ", check only"), it["kind"] or "–",
             value(it["n"], "", 0), value(it["outliers"], "", 0), *(value(it[key], unit, 2) for key, unit in lengths))
            for it in contents["per_feature"]]
    strays = [(_feature(it["feature"]), it["index"] + 1, _place(it["point"]), value(it["px"], "px", 2),
               value(it["mm"], "mm", 1)) for it in contents["outliers"]]
    more = contents["outliers_not_listed"]
    return joined([
        element("h2", "Residuals by feature"),
        _table(("feature", "kind", "points", "outliers", "rms", "rms", "largest"), rows, numbers={2, 3, 4, 5, 6})
        if rows else element("p", "The calibration has no residuals."),
        element("p", "Distance of the points from their line or landmark in the model, without outliers.",
                class_="dim") if rows else None,
        [element("h2", "Outliers"), _table(("feature", "point", "position, px", "residual", "residual"), strays,
                                           numbers={1, 2, 3, 4}),
         element("p", f"{more} more are not listed.") if more else None] if strays else None])


def _provenance(contents: Mapping[str, Any]) -> Html:
    it, field, model, picture = contents["calibration"], contents["field"], contents["model"], contents["picture"]
    x, y = field["region_x_mm"], field["region_y_mm"]
    parameters = "\n".join(f"{name}: {_json(given)}" for name, given in model["parameters"].items())
    if len(parameters) > MAX_PARAMETER_CHARACTERS:
        parameters = f"{len(parameters)} characters: export the calibration as JSON to read them."
    rows = [("Calibration", element("code", it["id"])), ("Version", it["version"]),
            ("Parent", element("code", it["parent"]) if it["parent"] else "none"),
            ("Camera", [it["camera_name"], " ", element("code", it["camera"])] if it["camera"] else "none"),
            ("Made", [it["created_at"], f", {it['software']}"]), ("This report", f"by {contents['written_by']}"),
            ("Field", f"{field['title']} ({field['name']}), {field['length_mm']:g} × {field['width_mm']:g} mm"),
            ("Covered area", f"{area_name(field['region'])}, x {_mm(x)}, y {_mm(y)}, rotated by {field['rotate']}°"),
            ("Raw image", _size(it["image_size"])), ("Corrected image", _size(it["corrected_size"])),
            ("sha256 of the calibration image", element("code", it["image_sha256"] or "unknown")),
            ("sha256 of the image shown", element("code", picture["sha256"])) if picture["sha256"] else None,
            ("Model", f"{model['title']} ({model['name']})"),
            ("Options", element("code", _json(it["options"])[:2000])),
            ("sha256 of the parameters", element("code", model["parameters_sha256"]))]
    return joined([element("h2", "Origin"), _table(("", ""), [row for row in rows if row]),
                   element("h2", "Parameters of the model"), element("pre", parameters)])


def value(number: float | None, unit: str, digits: int) -> Html:
    """A number as it is read, with the exact one beside it for machines."""
    if number is None:
        return element("span", "unknown", class_="dim")
    shown = f"{number:.{digits}f}"
    shown = shown.replace("-", "−") if float(shown) else shown.lstrip("-")
    return element("data", f"{shown} {unit}".rstrip(), value=repr(number))


def _table(titles: Iterable[str], rows: Iterable[Iterable[object]], numbers: Iterable[int] = ()) -> Html:
    right = set(numbers)
    kind = {index: "number" for index in right}
    titles = list(titles)
    head = element("thead", element("tr", [element("th", title, class_=kind.get(i)) for i, title in enumerate(titles)]))
    lines = [element("tr", [element("th" if i == 0 else "td", cell, class_=kind.get(i), **({"scope": "row"} if i == 0
                                                                                             else {}))
                            for i, cell in enumerate(row)]) for row in rows]
    return element("table", head if any(titles) else None, element("tbody", lines))


def _missing(what: str | None, fix: str | None) -> Html:
    return element("p", what, f" {fix}" if fix else None, class_="missing")


def _feature(name: str | list[float] | None) -> str:
    if isinstance(name, list):
        return f"({name[0]:g}, {name[1]:g}) mm"
    shown = marking_name(name or "–")
    return f"{shown[:1].upper()}{shown[1:]}"


def _place(point: list[float] | None) -> str:
    return "–" if point is None else f"({point[0]:.0f}, {point[1]:.0f})".replace("-", "−")


def _mm(ends: list[float]) -> str:
    return f"{ends[0]:g} to {ends[1]:g} mm".replace("-", "−")


def _json(given: object) -> str:
    return json.dumps(given, ensure_ascii=False, allow_nan=False)


def _size(size: list[int]) -> str:
    return f"{size[0]} × {size[1]} px"
