"""A request for a calibration: everything it rests on, looked up and checked; and fits made again from saved points."""

import secrets
from base64 import b64encode
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from dataclasses import field as member
from datetime import UTC, datetime
from typing import Any, Self

from touchline.core.errors import BadInput, Conflict, FitFailed
from touchline.core.field import BORDERS, Field, Region
from touchline.core.field_json import field_from_json
from touchline.core.geometry import ImageSize
from touchline.core.jobs import Progress, no_progress, subprogress
from touchline.core.records import Calibration, Observations, Warning, observations_from_json
from touchline.core.statements import say
from touchline.evaluate.report_types import FitReport, SavedReport
from touchline.fitting import FITTERS, known_options
from touchline.imaging.correction import correction_mesh
from touchline.installation import __version__
from touchline.models import MODELS, CameraModel, parameters_json
from touchline.workflows import calibration, model_choice
from touchline.workflows.calibration import (
    Attempt,
    CalibrationResult,
    ModelParameters,
    Preview,
    PreviewMesh,
)
from touchline.workflows.model_choice import AUTO, is_removed

MAX_POINTS = 20_000  # of all observations together: a minute or two


def run_fit(spec: Any, progress: Progress) -> dict[str, Any]:
    """A job: fit and evaluate spec["task"]; return the calibration as JSON, not yet stored.

    spec["compare"]: whether "auto" compares all models; absent in jobs that a former version queued.
    """
    request = CalibrationRequest.from_json(spec["task"])
    if request.chooses and not spec.get("compare", True):
        return request.record_preview(request.preview_json(False, None, progress)).to_json()
    return request.record(request.run(progress)).to_json()


def run_compare(spec: Any, progress: Progress) -> model_choice.Ranking:
    """A job: rank the models spec["models"] (all where none are named) on spec["task"]."""
    return CalibrationRequest.from_json(spec["task"]).compare(spec["models"], progress)


def run_preview(spec: Any, progress: Progress) -> Preview:
    """A job: the preview of spec["task"], cross-validated unless spec["quick"]."""
    return CalibrationRequest.from_json(spec["task"]).preview_json(
        spec["quick"], spec["mesh_margin_px"], progress
    )


def run_attempt(spec: Any, progress: Progress) -> Attempt:
    """A job: the same, or why there is none yet."""
    return CalibrationRequest.from_json(spec["task"]).attempt_json(
        spec["quick"], spec["mesh_margin_px"], progress
    )


@dataclass(frozen=True, eq=False)
class CalibrationRequest:
    """The model (or "auto") and options to fit, to which observations, of which picture."""

    observations: Observations
    field: Field
    region: Region
    image_size: ImageSize
    model: str = "polynomial"
    options: Mapping[str, Any] = member(default_factory=dict)
    camera: str | None = None
    snapshot: str | None = None
    image_sha256: str | None = None
    note: str = ""

    def __post_init__(self) -> None:
        if not self.observations:
            raise BadInput(
                say("points.none", "There are no points."),
                say("points.mark-borders", "Mark points on the four borders."),
                reason="too-few-points",
            )
        if self.n_points > MAX_POINTS:
            raise BadInput(
                say("points.too-many", "There are {points} points.", points=self.n_points),
                say(
                    "points.send-fewer",
                    "Send at most {most}. More points do not improve the fit.",
                    most=MAX_POINTS,
                ),
                reason="too-many-points",
            )

    @property
    def n_points(self) -> int:
        return sum(len(observation.points) for observation in self.observations)

    @classmethod
    def of(cls, calibration: Calibration, options: Mapping[str, Any], note: str) -> Self:
        """Ask for a calibration's own observations again, with other options."""
        field = field_from_json(calibration.field)
        return cls(
            observations_from_json(calibration.observations),
            field,
            field.region(calibration.region, calibration.rotate),
            calibration.image_size,
            calibration.model_name,
            options,
            calibration.camera,
            calibration.snapshot,
            calibration.image_sha256,
            note,
        )

    def check_names(self, models: Iterable[str]) -> None:
        """Refuse models and features that do not exist, before a job starts."""
        for name in models:
            if name != AUTO and not is_removed(name):
                FITTERS[name]
        for observation in self.observations:
            self.field.feature(observation.feature, self.region)

    def to_json(self) -> dict[str, Any]:
        """Return everything, for a job in another process."""
        return {
            "observations": [o.to_json() for o in self.observations],
            "field": self.field.to_json(),
            "region": self.region.name,
            "rotate": self.region.rotate_deg,
            "image_size": list(self.image_size),
            "model": self.model,
            "options": dict(self.options),
            "camera": self.camera,
            "snapshot": self.snapshot,
            "image_sha256": self.image_sha256,
            "note": self.note,
        }

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> Self:
        """Read what to_json wrote."""
        field = field_from_json(value["field"])
        return cls(
            observations_from_json(value["observations"]),
            field,
            field.region(value["region"], value["rotate"]),
            ImageSize.of(value["image_size"]),
            value["model"],
            value["options"],
            value["camera"],
            value["snapshot"],
            value["image_sha256"],
            value["note"],
        )

    def run(
        self, progress: Progress = no_progress, *, cross_validate: bool = True
    ) -> CalibrationResult:
        """Fit and evaluate; nothing is stored. The model "auto" is the one that a comparison of all recommends."""
        if not self.chooses or not cross_validate:
            return self.preview(progress, cross_validate=cross_validate)
        return self._with_note(
            model_choice.calibrate_recommended(
                self.observations, self.field, self.region, self.image_size, self.options, progress
            )
        )

    def preview(
        self, progress: Progress = no_progress, *, cross_validate: bool = True
    ) -> CalibrationResult:
        """Fit and evaluate while points are moved: the model "auto" is the most probable lens, at once."""
        if self.chooses:
            return self._with_note(
                model_choice.calibrate_most_probable(
                    self.observations,
                    self.field,
                    self.region,
                    self.image_size,
                    self.options,
                    progress,
                    cross_validate=cross_validate,
                )
            )
        return calibration.calibrate(
            self.observations,
            self.field,
            self.region,
            self.image_size,
            self.model,
            self.options,
            progress,
            cross_validate=cross_validate,
        )

    @property
    def chooses(self) -> bool:
        """Whether the model is chosen: asked for as "auto", or in place of one that is fitted no more."""
        return self.model == AUTO or is_removed(self.model)

    def _with_note(self, done: CalibrationResult) -> CalibrationResult:
        """Return a result that says so where its model was chosen in place of one that is fitted no more."""
        if self.model == AUTO:
            return done
        note = Warning(
            "model-removed",
            say(
                "warning.model-removed",
                "{model} is no longer fitted. The automatic choice was fitted instead.",
                model=MODELS[self.model].TITLE,
            ),
            say("warning.model-removed.fix", "Choose a lens model, or keep the automatic choice."),
        )
        return replace(
            done, report={**done.report, "warnings": [note.to_json(), *done.report["warnings"]]}
        )

    def preview_json(
        self, quick: bool, mesh_margin_px: int | None = None, progress: Progress = no_progress
    ) -> Preview:
        """Return the preview's model, report and field in the picture as JSON.

        quick: without cross-validation. mesh_margin_px: with the corrected view of that margin, as its mesh and the
        field in it.
        """
        fitted = self.preview(progress, cross_validate=not quick)
        return {
            "model": {"name": fitted.model.NAME, "parameters": parameters_json(fitted.model)},
            "report": fitted.report,
            "corrected_size": list(fitted.model.corrected_size),
            "overlay": calibration.overlay(fitted.model, self.field, self.region),
            "mesh": None
            if mesh_margin_px is None
            else self._mesh_json(fitted.model, mesh_margin_px),
        }

    def _mesh_json(self, model: CameraModel, margin_px: int) -> PreviewMesh:
        mesh = correction_mesh(model, margin_px)
        return {
            **mesh.header(),
            "raw_px": b64encode(mesh.data()).decode("ascii"),
            "overlay": calibration.overlay(model, self.field, self.region, "corrected", mesh.view),
        }

    def attempt_json(
        self, quick: bool, mesh_margin_px: int | None = None, progress: Progress = no_progress
    ) -> Attempt:
        """Return the preview, or why there is none yet, as JSON."""
        try:
            return {"preview": self.preview_json(quick, mesh_margin_px, progress), "refusal": None}
        except FitFailed as refusal:
            return {
                "preview": None,
                "refusal": {**refusal.details, **refusal.to_json(), "title": refusal.title},
            }

    def compare(
        self, models: list[str] | None, progress: Progress = no_progress
    ) -> model_choice.Ranking:
        """Rank several models (all where none are named) on the same observations."""
        return model_choice.compare(
            self.observations,
            self.field,
            self.region,
            self.image_size,
            tuple(models) if models else None,
            self.options,
            progress,
        ).ranking

    def record(
        self, done: CalibrationResult, *, version: int = 1, parent: str | None = None
    ) -> Calibration:
        """Return the result as one immutable version, with all that it came from."""
        return self._version(
            {"name": done.model.NAME, "parameters": parameters_json(done.model)},
            done.model.corrected_size,
            done.report,
            version=version,
            parent=parent,
        )

    def record_preview(self, preview: Preview) -> Calibration:
        """Return a preview as a version: where the model is chosen, the report says that none were compared."""
        report: SavedReport = {**preview["report"]}
        if self.chooses:
            report["model_choice"] = model_choice.not_compared()
        return self._version(preview["model"], ImageSize.of(preview["corrected_size"]), report)

    def _version(
        self,
        model: ModelParameters,
        corrected_size: ImageSize,
        report: FitReport,
        *,
        version: int = 1,
        parent: str | None = None,
    ) -> Calibration:
        return with_new_id(
            Calibration(
                id="",
                version=version,
                camera=self.camera,
                field=self.field.to_json(),
                region=self.region.name,
                rotate=self.region.rotate_deg,
                model_name=model["name"],
                model_parameters=model["parameters"],
                image_size=self.image_size,
                corrected_size=corrected_size,
                observations=tuple(o.to_json() for o in self.observations),
                options=dict(self.options)
                if not self.chooses
                else known_options(model["name"], self.options),
                report=report,
                created_at="",
                software=f"touchline {__version__}",
                snapshot=self.snapshot,
                image_sha256=self.image_sha256,
                parent=parent,
                note=self.note,
            )
        )


def with_new_id(calibration: Calibration) -> Calibration:
    """Return it with an id and a date, where no store gives them."""
    return replace(
        calibration,
        id=secrets.token_hex(8),
        created_at=datetime.now(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z"),
    )


def run_refit(spec: Any, progress: Progress) -> dict[str, Any]:
    """A job: each of spec["calibrations"] fitted again, as {"made": [JSON of one not yet stored, …]}.

    spec["rectangles"]: options that replace its own. spec["field"]: the field as it is now, None for that of each; what
    was clicked on markings that it has no more is left out.
    """
    records = []
    for number, one in enumerate(spec["calibrations"]):
        before = Calibration.from_json(one)
        share = subprogress(
            progress,
            number / len(spec["calibrations"]),
            (number + 1) / len(spec["calibrations"]),
            f"{before.camera}:",
        )
        if not before.observations:
            raise Conflict(
                say(
                    "refit.no-points",
                    "The calibration of {camera} has no points.",
                    camera=before.camera,
                ),
                say("refit.calibrate-again", "It was imported. Calibrate the camera again."),
                reason="no-observations",
            )
        request = _request(before, spec["rectangles"], spec.get("field"))
        records.append(request.record(request.run(share), parent=before.id).to_json())
    return {"made": records}


def _request(before: Calibration, rectangles: dict[str, Any], field: Any) -> CalibrationRequest:
    options = {**before.options, **rectangles}
    if field is None:
        return CalibrationRequest.of(
            before, options, "fitted again with the shared calibration grid of its rig"
        )
    now = field_from_json(field)
    known = {*now.lines, *now.arcs, *now.landmarks, *BORDERS}
    kept = tuple(
        o
        for o in observations_from_json(before.observations)
        if not isinstance(o.feature, str) or o.feature in known
    )
    return CalibrationRequest(
        kept,
        now,
        now.region(before.region, before.rotate),
        before.image_size,
        before.model_name,
        options,
        before.camera,
        before.snapshot,
        before.image_sha256,
        "fitted again to its points after the field was changed",
    )
