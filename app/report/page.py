"""The page: one file that asks for nothing else, to print on A4 or to keep beside the match."""

import json
from collections.abc import Iterable, Mapping
from typing import Any

from app.report.drawing import ReportDrawings
from app.report.figures import HEAD
from app.report.markup import Html, element, joined
from app.report.style import CSS

# also in the file itself: once downloaded it has no server that could say so
POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"
SCENE = "scene.html"  # as REST and `touchline scene` call it
LEVEL = {"good": "Good", "fair": "Fair", "poor": "Poor", "unknown": "Not known"}
MAX_PARAMETER_CHARACTERS = 12_000  # characters; a spline through thousands of clicks is told by its hash alone


def page(contents: Mapping[str, Any], drawn: ReportDrawings) -> str:
    """The report as HTML, from its contents and its pictures."""
    it = contents["calibration"]
    camera = it["camera_name"] or it["camera"] or "a picture without a camera"
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
    turned = f", turned by {field['rotate']}°" if field["rotate"] else ""
    length = [": ", value(verdict["mm"], "mm", 1)] if verdict["mm"] is not None else None
    return joined([
        element("h1", title),
        element("p", f"{contents['model']['title']} on {field['title']}, region {field['region']}{turned}. Made "
                f"{it['created_at']}{', the active one of its camera' if it['active'] else ''}.", class_="dim"),
        element("p", "Note: ", it["note"]) if it["note"] else None,
        element("p", "Where the camera hangs and where its rays miss: ", element("a", "the scene in 3-D", href=SCENE),
                f", where a server shows this report or {SCENE} lies beside it.", class_="screen dim"),
        element("div", element("p", element("b", LEVEL[verdict["level"]], length)),
                element("p", verdict["sentence"]), class_=f"verdict {verdict['level']}")])


def _figures(contents: Mapping[str, Any]) -> Html:
    rows = [(it["title"], value(it["value"], it["unit"], HEAD[key].digits), element("span", it["reading"],
                                                                                      class_="reading"))
            for key, it in contents["figures"].items()]
    return joined([element("h2", "The numbers"), _table(("", "", "how to read it"), rows, numbers={1})])


def _warnings(contents: Mapping[str, Any]) -> Html:
    items = [element("li", element("b", warning["text"]), " ", warning["fix"]) for warning in contents["warnings"]]
    best = contents["next_click"]
    if best and best["worst_mm_then"] is not None and best["point"]:
        items.append(element("li", "The next best click: ", _feature(best["feature"]), " at ", _place(best["point"]),
                             " px would lower the worst expected error from ", value(best["worst_mm"], "mm", 1), " to ",
                             value(best["worst_mm_then"], "mm", 1), "."))
    return joined([element("h2", "What to mind, and its cure"),
                   element("ul", items) if items else element("p", "Nothing.")])


def _pictures(contents: Mapping[str, Any], drawn: ReportDrawings) -> Html:
    section, it = contents["picture"], contents["calibration"]
    if drawn.before is None:
        return joined([element("h2", "Before and after"), _missing(section["why_not"], None)])
    other = [element("p", element("b", "This is not the picture that was clicked"), ": its sha256 is another one. Its "
                     "lines may lie elsewhere.")] if section["same"] is False else None
    before = element("figure", drawn.before, element(
        "figcaption", f"Before: as the camera took it, {_size(it['image_size'])}. Lines: the field as the model sees "
        "it. Dots: clicks, in their border's colour (left blue, right orange, top pink, bottom yellow, others white). "
        "Red crosses: strays. The lines must lie on the painted ones."))
    after = _missing(drawn.after_why, None) if drawn.after is None else element("figure", drawn.after, element(
        "figcaption", f"After: corrected, {_size(it['corrected_size'])} within the borders. What is painted straight "
        "must be straight here, and lie under the lines."))
    return joined([element("h2", "Before and after"), other, before, after])


def _distortion(contents: Mapping[str, Any]) -> Html:
    section = contents["distortion"]
    kind = {"barrel": "Barrel distortion: borders bow outwards.", "none": "No clear bend.",
            "pincushion": "Pincushion distortion: borders bow inwards."}.get(section["kind"] or "")
    rows = [(name.capitalize(), value(it["before_pct"], "%", 2), value(it["after_pct"], "%", 2))
            for name, it in section["per_border"].items()]
    return joined([element("h2", "Distortion of each border"), element("p", kind) if kind else None,
                   _table(("border", "before", "after"), rows, numbers={1, 2}),
                   element("p", "How far a border bows from its chord, in parts of its length, negative outwards; "
                           "after: of the clicks in the corrected picture. It cannot see what leaves borders straight.",
                           class_="dim")])


def _uncertainty(contents: Mapping[str, Any], drawn: ReportDrawings) -> Html:
    parts, whys = [], []
    for name, it in contents["uncertainty"].items():
        where = "on the carpet" if name == "carpet" else f"at hat height, {it['z_mm']:g} mm"
        if it["map"] is None:
            whys.append(_missing(f"Expected error {where}: {it['why']}", it["fix"]))
            continue
        found = it["map"]
        parts.append(element("figure", element("img", src=drawn.maps[name], alt=f"Map of the expected error {where}"),
                             element("figcaption", f"Expected error {where}: ", value(found["rms"], "mm", 2), " rms, ",
                                     value(found["median"], "mm", 2), " median, ", value(found["max"], "mm", 2),
                                     " at the worst place, ringed, at ", _place(found["worst_place"]),
                                     " mm from the field's centre.")))
    return joined([element("h2", "Where the error is"), element("div", parts, class_="maps") if parts else None, whys,
                   element("p", "The region as it stands in the corrected picture; both maps have one scale. What the "
                           "clicks' noise leaves uncertain, and not what the model cannot bend to.", class_="dim")
                   if parts else None])


def _residuals(contents: Mapping[str, Any]) -> Html:
    lengths = (("rms_px", "px"), ("rms_mm", "mm"), ("max_mm", "mm"))
    rows = [(_feature(it["feature"]) + ("" if it["used"] else ", only checked"), it["kind"] or "–",
             value(it["n"], "", 0), value(it["outliers"], "", 0), *(value(it[key], unit, 2) for key, unit in lengths))
            for it in contents["per_feature"]]
    strays = [(_feature(it["feature"]), it["index"] + 1, _place(it["point"]), value(it["px"], "px", 2),
               value(it["mm"], "mm", 1)) for it in contents["outliers"]]
    more = contents["outliers_not_listed"]
    return joined([
        element("h2", "Residuals, feature by feature"),
        _table(("feature", "kind", "points", "strays", "rms", "rms", "largest"), rows, numbers={2, 3, 4, 5, 6})
        if rows else element("p", "The calibration came without residuals."),
        element("p", "How far the clicks lie from where the model sees their line or landmark, strays left out.",
                class_="dim") if rows else None,
        [element("h2", "Strays"), _table(("feature", "point", "at, px", "off", "off"), strays, numbers={1, 2, 3, 4}),
         element("p", f"{more} more are not listed.") if more else None] if strays else None])


def _provenance(contents: Mapping[str, Any]) -> Html:
    it, field, model, picture = contents["calibration"], contents["field"], contents["model"], contents["picture"]
    x, y = field["region_x_mm"], field["region_y_mm"]
    parameters = "\n".join(f"{name}: {_json(given)}" for name, given in model["parameters"].items())
    if len(parameters) > MAX_PARAMETER_CHARACTERS:
        parameters = f"{len(parameters)} characters: export the calibration as JSON for them."
    rows = [("Calibration", element("code", it["id"])), ("Version", it["version"]),
            ("Parent", element("code", it["parent"]) if it["parent"] else "none"),
            ("Camera", [it["camera_name"], " ", element("code", it["camera"])] if it["camera"] else "none"),
            ("Made", [it["created_at"], f", {it['software']}"]), ("This report", f"by {contents['written_by']}"),
            ("Field", f"{field['title']} ({field['name']}), {field['length_mm']:g} × {field['width_mm']:g} mm"),
            ("Region", f"{field['region']}, x {_mm(x)}, y {_mm(y)}, turned by {field['rotate']}°"),
            ("Raw picture", _size(it["image_size"])), ("Corrected picture", _size(it["corrected_size"])),
            ("sha256 of the clicked picture", element("code", it["image_sha256"] or "not known")),
            ("sha256 of the picture shown", element("code", picture["sha256"])) if picture["sha256"] else None,
            ("Model", f"{model['title']} ({model['name']})"),
            ("Options", element("code", _json(it["options"])[:2000])),
            ("sha256 of the parameters", element("code", model["parameters_sha256"]))]
    return joined([element("h2", "Where it comes from"), _table(("", ""), [row for row in rows if row]),
                   element("h2", "Parameters of the model"), element("pre", parameters)])


def value(number: float | None, unit: str, digits: int) -> Html:
    """A number as it is read, with the exact one beside it for machines."""
    if number is None:
        return element("span", "not known", class_="dim")
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
    return name.replace("-", " ").capitalize() if name else "–"


def _place(point: list[float] | None) -> str:
    return "–" if point is None else f"({point[0]:.0f}, {point[1]:.0f})".replace("-", "−")


def _mm(ends: list[float]) -> str:
    return f"{ends[0]:g} to {ends[1]:g} mm".replace("-", "−")


def _json(given: object) -> str:
    return json.dumps(given, ensure_ascii=False, allow_nan=False)


def _size(size: list[int]) -> str:
    return f"{size[0]} × {size[1]} px"
