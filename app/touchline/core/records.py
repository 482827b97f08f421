"""The records that flow through the program: Frame → Observations → Fit → Report → Calibration.

Each is frozen; a better fit is a new Calibration that keeps its inputs and names its parent. Arrays inside
are read-only. Stored records are written to and read from JSON.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from dataclasses import field as member
from typing import Any, ClassVar, Literal, NotRequired, Self

import numpy as np
from numpy.typing import NDArray
from typing_extensions import TypedDict

from touchline.core.errors import BadInput
from touchline.core.field_json import field_changes
from touchline.core.geometry import ImageSize, Points, as_points
from touchline.core.json_values import PointJson, number, read_report
from touchline.core.sentences import marking_name
from touchline.core.statements import Sentence, Stated, stated

Kind = Literal["line", "landmark"]
MAX_POINTS = 20_000  # an operator clicks dozens and a detector finds thousands; more is a mistake


@dataclass(frozen=True, eq=False)
class Frame:
    """A picture: pixels (height, width, 3) BGR uint8. jpeg: as its camera compressed it; empty where it did not."""

    pixels: NDArray[np.uint8]
    sha256: str = ""  # of the bytes it was decoded from
    camera: str | None = None
    jpeg: ClassVar[bytes] = b""

    @property
    def size(self) -> ImageSize:
        return ImageSize(self.pixels.shape[1], self.pixels.shape[0])

    def reduced(self, width: int, height: int = 1) -> NDArray[np.uint8]:
        """Return the picture at least so large, px: smaller than it is only where that costs less."""
        return self.pixels


class ObservationJson(TypedDict):
    feature: str | PointJson
    kind: Kind
    points: list[PointJson]
    z_mm: NotRequired[float]  # 0 where it is absent


@dataclass(frozen=True, eq=False)
class Observation:
    """Where one feature of the field was seen: points (n, 2) px, raw.

    feature: a border, line, arc or landmark by name, or a field position (x, y) mm.
    kind: "line", anywhere along that line or arc; "landmark", that very spot.
    z_mm: height of the observed points above the carpet.
    """

    feature: str | tuple[float, float]
    kind: Kind
    points: Points
    z_mm: float = 0.0

    def __post_init__(self) -> None:
        points = as_points(self.points, f"The points on {self.label}").reshape(-1, 2)
        points.setflags(write=False)
        object.__setattr__(self, "points", points)

    @property
    def label(self) -> Sentence:
        """Its name in messages: "the left border", "the centre line", "my line", "(0, 500) mm"."""
        if not isinstance(self.feature, str):
            return Sentence(f"({self.feature[0]:g}, {self.feature[1]:g}) mm")
        name = marking_name(self.feature)
        return Sentence(f"the {name}", name.statements) if name.statements else name

    @property
    def feature_json(self) -> str | PointJson:
        return self.feature if isinstance(self.feature, str) else list(self.feature)

    def to_json(self) -> ObservationJson:
        json = ObservationJson(
            feature=self.feature_json, kind=self.kind, points=self.points.tolist()
        )
        if self.z_mm != 0:
            json["z_mm"] = self.z_mm
        return json

    @classmethod
    def from_json(cls, value: Any) -> Self:
        """Read one observation; refuse what is not of its form."""
        form = 'Send {"feature": …, "kind": "line" or "landmark", "points": [[x, y], …]}.'
        if not isinstance(value, Mapping):
            raise BadInput("An observation is not an object.", form, reason="bad-observation")
        unknown = set(value) - {"feature", "kind", "points", "z_mm"}
        if unknown:
            raise BadInput(
                f"Unknown entry of an observation: {sorted(unknown)[0]!r}.",
                form,
                reason="bad-observation",
            )
        feature, kind, z_mm = (
            value.get("feature"),
            value.get("kind", "line"),
            value.get("z_mm", 0.0),
        )
        if isinstance(feature, (list, tuple)):
            spot = as_points(feature, "The field position of a landmark")
            if spot.shape != (2,):
                raise BadInput(
                    "The field position of a landmark is not a pair of numbers.",
                    form,
                    reason="bad-observation",
                )
            feature = (float(spot[0]), float(spot[1]))
        elif not isinstance(feature, str):
            raise BadInput("An observation has no feature.", form, reason="bad-observation")
        if kind not in ("line", "landmark"):
            raise BadInput(
                f"Unknown kind of observation: {kind!r}.", form, reason="bad-observation"
            )
        if number(z_mm) is None or abs(z_mm) > 10_000:
            raise BadInput(
                "The z_mm of an observation is not a valid height.",
                "Give millimetres above the carpet.",
                reason="bad-observation",
            )
        return cls(
            feature,
            kind,
            as_points(value.get("points", ()), "The points of an observation"),
            float(z_mm),
        )


Observations = tuple[Observation, ...]


def observations_from_json(value: Any) -> Observations:
    """Read a list of observations, refusing more points than anybody can mean."""
    if not isinstance(value, (list, tuple)):
        raise BadInput(
            "The observations are not a list.",
            "Send a list of observations.",
            reason="bad-observation",
        )
    observations = tuple(Observation.from_json(item) for item in value)
    count = sum(len(o.points) for o in observations)
    if count > MAX_POINTS:
        raise BadInput(
            f"{count} points were sent; a fit accepts at most {MAX_POINTS}.",
            "Send fewer points.",
            reason="too-many-points",
        )
    return observations


class WarningJson(Stated):
    reason: str
    text: str
    fix: str
    feature: str | None
    index: int | None


@dataclass(frozen=True)
class Warning:
    """Something the operator should know, with a fix. reason: kebab-case, for scripts."""

    reason: str
    text: str
    fix: str
    feature: str | None = None
    index: int | None = None  # of the point within its observation, from 0

    def to_json(self) -> WarningJson:
        return stated(
            WarningJson(
                reason=self.reason,
                text=self.text,
                fix=self.fix,
                feature=self.feature,
                index=self.index,
            )
        )


@dataclass(frozen=True, eq=False)
class Fit:
    """A model and how it came about.

    inliers: for each observation a bool array, false where a point was rejected as an outlier.
    used: for each observation, whether the model rests on it; the others only check it.
    covariance (n, n) of the parameters named by parameter_names, where the fit knows it.
    alternative: what the points say without something that was entered, where they contradict it.
    """

    model: Any  # a CameraModel; touchline.models imports this module
    inliers: tuple[NDArray[np.bool_], ...]
    used: tuple[bool, ...]
    warnings: tuple[Warning, ...] = ()
    # how choices were made, e.g. {"degree": {…}}
    notes: Mapping[str, Any] = member(default_factory=dict)
    covariance: NDArray[np.float64] | None = None
    parameter_names: tuple[str, ...] = ()
    alternative: "Fit | None" = None


@dataclass(frozen=True)
class Calibration:
    """One immutable version: the model, what it was made from, and its report. All plain JSON inside."""

    id: str
    version: int
    camera: str | None
    field: Mapping[str, Any]  # the field as it was then, Field.to_json()
    region: str
    rotate: int
    model_name: str
    model_parameters: Mapping[str, Any]
    image_size: ImageSize
    corrected_size: ImageSize
    observations: tuple[Mapping[str, Any], ...]
    options: Mapping[str, Any]
    report: Mapping[str, Any]
    created_at: str  # ISO 8601, UTC
    software: str
    snapshot: str | None = None
    image_sha256: str | None = None
    parent: str | None = None
    note: str = ""
    made_by: str = ""  # who saved it: a name that the operator gave, or an address
    active: bool = False

    def to_json(self) -> dict[str, Any]:
        return {
            "id": self.id,
            "version": self.version,
            "camera": self.camera,
            "field": self.field["name"],
            "region": self.region,
            "rotate": self.rotate,
            "model": {"name": self.model_name, "parameters": dict(self.model_parameters)},
            "image_size": list(self.image_size),
            "corrected_size": list(self.corrected_size),
            "observations": [dict(o) for o in self.observations],
            "options": dict(self.options),
            "report": dict(self.report),
            "created_at": self.created_at,
            "software": self.software,
            "snapshot": self.snapshot,
            "image_sha256": self.image_sha256,
            "parent": self.parent,
            "note": self.note,
            "made_by": self.made_by,
            "active": self.active,
            "field_definition": dict(self.field),
        }

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> Self:
        """Read what to_json wrote; refuse anything else."""
        try:
            return cls(
                id=str(value["id"]),
                version=int(value["version"]),
                camera=value["camera"],
                field=value["field_definition"],
                region=value["region"],
                rotate=int(value["rotate"]),
                model_name=value["model"]["name"],
                model_parameters=value["model"]["parameters"],
                image_size=ImageSize.of(value["image_size"]),
                corrected_size=ImageSize.of(value["corrected_size"]),
                observations=tuple(value["observations"]),
                options=value["options"],
                report=read_report(value["report"]),
                created_at=value["created_at"],
                software=value["software"],
                snapshot=value.get("snapshot"),
                image_sha256=value.get("image_sha256"),
                parent=value.get("parent"),
                note=value.get("note", ""),
                made_by=value.get("made_by", ""),
                active=bool(value.get("active", False)),
            )
        except (KeyError, TypeError, ValueError, OverflowError):
            raise BadInput(
                "This is not a calibration: an entry is missing or cannot be read.",
                "Send a JSON file that Touchline exported.",
                reason="bad-calibration",
            ) from None

    def draft(self) -> dict[str, object]:
        """Return what an operator would enter to make it: its lens by id, as a draft has it."""
        made = self.to_json()
        options = {
            name: value.get("id") if name == "lens" and isinstance(value, Mapping) else value
            for name, value in self.options.items()
        }
        names = ("field", "region", "rotate", "observations")
        return {
            **{name: made[name] for name in names},
            "model": self.model_name,
            "options": options,
        }

    def lens_option(self) -> dict[str, Any]:
        """Return the value of the option "lens" of another fit: the camera, and its covariance where it is known."""
        known = self.covariance
        own = (
            {name: entry for name, entry in known.items() if name != "freer"}
            if isinstance(known, Mapping)
            else known
        )
        return {
            "name": self.model_name,
            "parameters": dict(self.model_parameters),
            **({} if own is None else {"covariance": own}),
        }

    @property
    def covariance(self) -> Any:
        """The report's covariance, if any."""
        return self.report.get("covariance")

    def outliers(self, observations: Observations) -> list[NDArray[np.bool_]]:
        """Return for each observation which of its points (n,) the report calls outliers; none where it has no rows."""
        rows = self.report.get("per_feature", ())
        masks = [np.zeros(len(observation.points), bool) for observation in observations]
        for mask, row in zip(masks, rows, strict=False):
            flags = [residual.get("outlier") is True for residual in row.get("residuals", ())][
                : len(mask)
            ]
            mask[: len(flags)] = flags
        return masks

    def field_changes(self, now: Mapping[str, Any]) -> tuple[str, ...]:
        """Name what of the field, as it is now, lies elsewhere than when this was made, and makes it wrong."""
        return field_changes(
            self.field, now, self.region, (o["feature"] for o in self.observations)
        )

    def activated(self, active: bool) -> Self:
        return replace(self, active=active)
