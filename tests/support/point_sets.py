"""Unusual sets of points over a field that a known camera sees: what a hand, a script or a detector may send."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import strategies as st

from touchline.core.field import BORDERS, Region
from touchline.core.geometry import MAX_COORDINATE, ImageSize
from touchline.core.options import Option
from touchline.fitting import FITTERS
from touchline.models.ray_camera import BrownConrady
from touchline.models.rotation import vector_from_matrix
from touchline.store.fields import FieldRepository
from touchline.workflows.model_choice import AUTO

FIELD = FieldRepository(Path("no-fields-of-our-own"))["ssl-2008"]
SIZE = ImageSize(780, 580)
REGIONS = ("full", "half", "half-left", "quarter-top-right")
TURNS = (0, 90, 180, 270)
HEIGHT_MM, FOCAL_PX, TILT = 4000.0, 520.0, 0.06
LENS_TERMS = (-0.2, 0.05, 0.001, -0.001, 0.0, 0.0, 0.0, 0.0)
ROBOT_TOP_MM = FIELD.hat_height_mm
SPOTS = (
    "corner-top-right",
    "halfway-bottom",
    "penalty-mark-right",
    (1200.0, -340.5),
    (-9000.0, 12_000.0),
)
LANDMARKS = tuple(FIELD.landmarks)
MARKINGS = (*BORDERS, *FIELD.lines, *FIELD.arcs)

Feature = str | tuple[float, float]
Observations = list[dict[str, Any]]


@dataclass(frozen=True)
class View:
    """A region of the field, turned, as a tilted camera with a barrel lens above its middle sees it."""

    region_name: str
    rotate: int = 0

    @property
    def region(self) -> Region:
        return FIELD.region(self.region_name, self.rotate)

    @property
    def camera(self) -> BrownConrady:
        return _camera(self.region_name, self.rotate)

    def pixels(self, places_mm: Any, z_mm: float = 0.0) -> list[list[float]]:
        """Field mm (n, 2) at a height to pixels of the raw picture, to a hundredth."""
        places = np.asarray(places_mm, float).reshape(-1, 2)
        found = self.camera.project(np.column_stack([places, np.full(len(places), z_mm)]))
        return np.round(found[np.isfinite(found).all(axis=1)], 2).tolist()

    def along(
        self, name: str, count: int = 9, *, start: float = 0.03, end: float = 0.97
    ) -> dict[str, Any]:
        """A border, line or arc, marked so many times between two shares of its length."""
        feature = FIELD.feature(name, self.region)
        t = np.linspace(start, end, count)
        places = feature.sample(1001)[np.round(t * 1000).astype(int)]  # type: ignore[union-attr]
        return {"feature": name, "kind": "line", "points": self.pixels(places)}

    def spot(
        self, u: float, v: float, z_mm: float = 0.0, name: Feature | None = None
    ) -> dict[str, Any]:
        """A landmark at shares of the region's width and height."""
        region = self.region
        place = region.field_from_region(np.array([u * region.width_mm, v * region.height_mm]))
        return {
            "feature": list(map(float, place)) if name is None else name,
            "kind": "landmark",
            "points": self.pixels(place, z_mm),
            **({"z_mm": z_mm} if z_mm else {}),
        }

    def corners(self, z_mm: float = 0.0) -> Observations:
        return [self.spot(u, v, z_mm) for u in (0, 1) for v in (0, 1)]

    def borders(self, *names: str, count: int = 9) -> Observations:
        return [self.along(name, count) for name in names or BORDERS]

    def body(
        self, observations: Observations, model: str = "polynomial", **more: Any
    ) -> dict[str, Any]:
        """The body of a request for a fit."""
        return {
            "field": FIELD.name,
            "region": self.region_name,
            "rotate": self.rotate,
            "image_size": list(SIZE),
            "observations": observations,
            "model": model,
            **more,
        }


@cache
def _camera(region_name: str, rotate: int) -> BrownConrady:
    region = FIELD.region(region_name, rotate)
    at = region.field_from_region
    right, down = (at(np.array(unit, float)) - at(np.zeros(2)) for unit in ((1, 0), (0, 1)))
    rows = np.array([[*right, 0], [*down, 0], [0, 0, -1]], float)
    tilt = np.array([[1, 0, 0], [0, np.cos(TILT), -np.sin(TILT)], [0, np.sin(TILT), np.cos(TILT)]])
    middle = at(np.array([region.width_mm / 2, region.height_mm / 2]))
    share = max(region.width_mm / 6050, region.height_mm / 4050)
    return BrownConrady(
        LENS_TERMS,
        FOCAL_PX * 0.85,
        1.0,
        SIZE.centre,
        tuple(vector_from_matrix(tilt @ rows)),
        (float(middle[0]), float(middle[1]), HEIGHT_MM * share),
        700.0,
        700.0 * region.height_mm / region.width_mm,
        8,
        6,
        region,
        SIZE,
    )


def _with_points(
    change: Callable[[list[list[float]]], list[list[float]]],
) -> Callable[[View], Observations]:
    return lambda view: [{**o, "points": change(o["points"])} for o in view.borders()]


def _inside(view: View) -> Observations:
    """Lines and arcs alone, of those that the picture shows."""
    names = ("centre-circle", "halfway-line", "defence-right-front", "defence-right-arc-top")
    return [view.along(name) for name in names]


SETS: dict[str, Callable[[View], Observations]] = {
    "nothing": lambda view: [],
    "an observation without points": lambda view: [
        *view.borders(),
        {**view.along("halfway-line"), "points": []},
    ],
    "observations without points": lambda view: [{**o, "points": []} for o in view.borders()],
    "one point": lambda view: [view.along("left", 1)],
    "one landmark": lambda view: view.corners()[:1],
    "two landmarks": lambda view: view.corners()[:2],
    "three landmarks": lambda view: view.corners()[:3],
    "four corners": lambda view: view.corners(),
    "four corners by name": lambda view: [
        {"feature": name, "kind": "landmark", "points": view.pixels(FIELD.landmarks[name].position)}
        for name in (
            "corner-top-left",
            "corner-top-right",
            "corner-bottom-left",
            "corner-bottom-right",
        )
    ],
    "corners and centre": lambda view: [*view.corners(), view.spot(0.5, 0.5)],
    "corners above the carpet": lambda view: view.corners(ROBOT_TOP_MM),
    "corners below the carpet": lambda view: view.corners(-200.0),
    "corners on the carpet and above it": lambda view: [
        *view.corners(),
        *view.corners(ROBOT_TOP_MM),
    ],
    "corners as a line": lambda view: [{**o, "kind": "line"} for o in view.corners()],
    "corners and one border": lambda view: [*view.corners(), view.along("top")],
    "a grid of positions": lambda view: [
        view.spot(u, v) for u in np.linspace(0, 1, 4) for v in np.linspace(0, 1, 4)
    ],
    "a grid above the carpet": lambda view: [
        view.spot(u, v, ROBOT_TOP_MM) for u in np.linspace(0, 1, 4) for v in np.linspace(0, 1, 4)
    ],
    "landmarks on one line": lambda view: [view.spot(u, u) for u in np.linspace(0, 1, 6)],
    "one border": lambda view: view.borders("left"),
    "two parallel borders": lambda view: view.borders("left", "right"),
    "two borders that meet": lambda view: view.borders("left", "top"),
    "three borders": lambda view: view.borders("left", "right", "top"),
    "four borders": lambda view: view.borders(),
    "two points a border": lambda view: view.borders(count=2),
    "three points a border": lambda view: view.borders(count=3),
    "four points a border": lambda view: view.borders(count=4),
    "a short piece of each border": lambda view: [
        view.along(name, 6, start=0.45, end=0.55) for name in BORDERS
    ],
    "no border": _inside,
    "one circle": lambda view: [view.along("centre-circle", 24)],
    "circle and corners": lambda view: [view.along("centre-circle", 24), *view.corners()],
    "borders above the carpet": lambda view: [{**o, "z_mm": ROBOT_TOP_MM} for o in view.borders()],
    "all at one pixel": _with_points(lambda points: [[300.0, 200.0]] * len(points)),
    "corners at one pixel": lambda view: [
        {**o, "points": [[300.0, 200.0]]} for o in view.corners()
    ],
    "on one line of the picture": _with_points(
        lambda points: [[50.0 + 9 * i, 40.0 + 6 * i] for i, _ in enumerate(points)]
    ),
    "outside the picture": _with_points(lambda points: [[x + 2000.0, y] for x, y in points]),
    "corners outside the picture": lambda view: [
        {**o, "points": [[4 * x - 900, 4 * y - 700] for x, y in o["points"]]}
        for o in view.corners()
    ],
    "every point twice": _with_points(lambda points: [p for p in points for _ in "12"]),
    "a corner four times": lambda view: [{**o, "points": o["points"] * 4} for o in view.corners()],
    "every feature twice": lambda view: [*view.borders(), *view.borders()],
    "a corner at two places": lambda view: [
        *view.corners(),
        {**view.corners()[0], "points": [[390.0, 290.0]]},
    ],
    "huge numbers": _with_points(lambda points: [[x * 1e4, y * 1e4] for x, y in points]),
    "huge numbers of corners": lambda view: [
        {**o, "points": [[x * 1e4, y * 1e4] for x, y in o["points"]]} for o in view.corners()
    ],
    "tiny numbers": _with_points(lambda points: [[x * 1e-9, y * 1e-9] for x, y in points]),
    "tiny numbers of corners": lambda view: [
        {**o, "points": [[x * 1e-9, y * 1e-9] for x, y in o["points"]]} for o in view.corners()
    ],
    "corners mirrored": lambda view: [
        {**o, "points": [[SIZE.width - 1 - x, y] for x, y in o["points"]]} for o in view.corners()
    ],
    "corners crossed": lambda view: [
        {**o, "points": p["points"]}
        for o, p in zip(view.corners(), [view.corners()[i] for i in (0, 2, 1, 3)], strict=True)
    ],
    "borders swapped": lambda view: [
        {**view.along(name), "feature": other}
        for name, other in zip(BORDERS, ("right", "left", "bottom", "top"), strict=True)
    ],
    "a position far away": lambda view: [
        *view.corners(),
        {"feature": [1e7, -1e7], "kind": "landmark", "points": [[400.0, 300.0]]},
    ],
    "positions at one place": lambda view: [{**o, "feature": [0.0, 0.0]} for o in view.corners()],
    "positions at one place, pixels too": lambda view: (
        [{"feature": [0.0, 0.0], "kind": "landmark", "points": [[300.0, 200.0]]}] * 5
    ),
}
USUAL = (
    "four corners",
    "corners and centre",
    "a grid of positions",
    "four borders",
    "circle and corners",
    # which most models fit
    "corners and one border",
    "corners on the carpet and above it",
    "no border",
)


def options_of(option: Option) -> st.SearchStrategy[Any]:
    """Values of an option as a form sends them, its ends among them; a lens has no value of its own."""
    low, high = option.range or (0.0, 1.0)
    numbers = st.sampled_from(
        [low, high, (low * high) ** 0.5 if low > 0 else high / 100, (low + high) / 2]
    )
    whole = st.integers(int(low), int(min(high, low + 12)))
    by_type: dict[str, st.SearchStrategy[Any]] = {
        "bool": st.booleans(),
        "float": numbers | st.floats(low, high),
        "int": whole,
        "int-or-auto": whole | st.just("auto"),
        "choice": st.sampled_from(option.choices or ("",)),
        "value-and-sigma": st.fixed_dictionaries(
            {"value": numbers, "sigma": st.sampled_from([0.1, 30.0, 5000.0])}
        ),
        "terms-or-auto": st.lists(st.sampled_from(option.choices or ("",)), unique=True)
        | st.just("auto"),
    }
    return by_type[option.type]


def option_sets(model: str) -> st.SearchStrategy[dict[str, Any]]:
    """Some of the options of a model."""
    known = [] if model == AUTO else [o for o in FITTERS[model].OPTIONS if o.type != "calibration"]
    mine = {o.name: options_of(o) for o in known if o.name != "lens_sigma"}
    return st.fixed_dictionaries({}, optional=mine)


def _layouts(points: Sequence[Sequence[float]]) -> st.SearchStrategy[list[list[float]]]:
    """The points as they are, or as they should not be."""
    exact = [list(p) for p in points]
    spread = st.floats(0.1, 300)
    return (
        st.just(exact)
        | st.just([*exact, *exact])
        | st.just([[300.0, 200.0]] * len(exact))
        | st.just([])
        | st.just([[123.0 + 20 * i, 321.0] for i, _ in enumerate(exact)])
        | st.builds(
            lambda by, seed: (
                (
                    np.array(exact) + np.random.default_rng(seed).normal(0, by, (len(exact), 2))
                ).tolist()
                if exact
                else []
            ),
            spread,
            st.integers(0, 9),
        )
        | st.builds(
            lambda by: [
                [
                    min(max(x * by, -MAX_COORDINATE), MAX_COORDINATE),
                    min(max(y * by, -MAX_COORDINATE), MAX_COORDINATE),
                ]
                for x, y in exact
            ],
            st.sampled_from([1e-9, 0.01, 0.5, 3.0, 1e4, -1.0, 1e7]),
        )
    )


@st.composite
def observations_seen(draw: st.DrawFn, view: View) -> dict[str, Any]:
    """One observation: any feature, marked as its kind is or not."""
    z_mm = draw(st.sampled_from([0.0] * 6 + [ROBOT_TOP_MM, -300.0, 10_000.0, HEIGHT_MM]))
    height = {"z_mm": z_mm} if z_mm else {}
    if draw(st.booleans()):
        name = draw(st.sampled_from(MARKINGS))
        true = view.along(name, draw(st.integers(1, 14)))
        kind = "line"
    else:
        spot = draw(st.sampled_from((*LANDMARKS, *SPOTS)))
        place = FIELD.landmarks[spot].position if isinstance(spot, str) else spot
        true = {
            "feature": spot if isinstance(spot, str) else list(spot),
            "points": view.pixels(place, z_mm),
        }
        kind = draw(st.sampled_from(["landmark"] * 5 + ["line"]))
    points = draw(_layouts(true["points"])) if draw(st.integers(0, 2)) == 0 else true["points"]
    return {**true, "kind": kind, "points": points, **height}


@st.composite
def bodies(draw: st.DrawFn, models: Sequence[str]) -> dict[str, Any]:
    """The body of a request: a set of the table with a change, or pieces of any kind."""
    view = View(draw(st.sampled_from(REGIONS)), draw(st.sampled_from(TURNS)))
    known = (
        SETS[draw(st.sampled_from([*SETS]) | st.sampled_from(USUAL))](view)
        if draw(st.integers(0, 3))
        else []
    )
    known = [o for o in known if draw(st.integers(0, 15))]
    found = [*known, *draw(st.lists(observations_seen(view), max_size=2 if known else 8))]
    model = draw(st.sampled_from(models))
    return view.body(found, model, options=draw(st.just({}) | option_sets(model)))
