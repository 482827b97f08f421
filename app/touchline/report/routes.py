"""/calibrations/{id}/report: all that is known of one version, as a page and as JSON."""

from contextlib import suppress
from typing import Annotated, Literal, NamedTuple

from fastapi import APIRouter, Depends
from starlette.responses import HTMLResponse

from touchline.api.dependencies import ServicesDep, VersionDep, in_thread
from touchline.api.middleware.problems import json_bytes
from touchline.api.responses import Json, cached_response, disposition
from touchline.api.schemas import HTML, UNCHANGED, JsonObject, response
from touchline.core.errors import NotFound, TouchlineError
from touchline.core.records import Frame
from touchline.evaluate.claims import Claim, ClaimJson
from touchline.report.contents import ReportPicture, contents, report_picture
from touchline.report.page import POLICY, draw, page
from touchline.services.answer_cache import etag_of
from touchline.services.claims import known_claims
from touchline.services.container import Services
from touchline.store.calibrations import FoundVersion

router = APIRouter(tags=["judging"])

CalibrationReport = response(
    "CalibrationReport",
    format=Literal["touchline-report"],
    format_version=Literal[1],
    calibration=JsonObject,
    field=JsonObject,
    model=JsonObject,
    picture=JsonObject,
    verdict=JsonObject,
    claims=list[ClaimJson],
    figures=dict[str, JsonObject],
    distortion=JsonObject,
    per_feature=list[JsonObject],
    outliers=list[JsonObject],
    uncertainty=JsonObject,
    warnings=list[JsonObject],
)


class Surroundings(NamedTuple):
    """What a report says that its version does not. picture: the name of its file; None if that is gone."""

    camera_name: str | None
    picture: str | None
    claims: list[Claim]

    @property
    def stamp(self) -> tuple[str | None, ...]:
        """Return what is another one as soon as the report says something else."""
        return (
            self.camera_name,
            self.picture,
            etag_of(json_bytes([claim.to_json() for claim in self.claims])),
        )


def _surroundings_of(services: ServicesDep, version: VersionDep) -> Surroundings:
    calibration, name, file = version.calibration, None, None
    if calibration.camera is not None:
        with suppress(NotFound):  # its camera was removed, or belongs to another server
            name = services.cameras.get(calibration.camera).name
    if calibration.snapshot is not None:
        with suppress(TouchlineError):
            path = services.store.snapshots.path(services.store.snapshots.get(calibration.snapshot))
            file = path.name if path.exists() else None
    return Surroundings(name, file, known_claims(services, calibration))


SurroundingsDep = Annotated[Surroundings, Depends(_surroundings_of)]


@router.get("/calibrations/{id}/report.html", response_class=HTMLResponse, responses=HTML)
@in_thread
def read_report_page(
    services: ServicesDep, version: VersionDep, around: SurroundingsDep
) -> HTMLResponse:
    """Return one self-contained page: verdict, figures, images before and after, error maps, versions and hashes."""
    calibration, picture = version.calibration, _picture(services, version, around)
    shown = contents(calibration, picture, around.claims)
    html = page(shown, draw(calibration, picture, shown))
    name = f"{calibration.camera or calibration.field['name']}-v{calibration.version}-report.html"
    return HTMLResponse(
        html.encode("utf-8", "replace"),
        headers={
            "Content-Security-Policy": f"{POLICY}; frame-ancestors 'self'",
            "Cache-Control": "no-cache",
            "Content-Disposition": disposition("inline", name),
        },
    )


@router.get("/calibrations/{id}/report.json", response_model=CalibrationReport, responses=UNCHANGED)
@cached_response
@in_thread
def read_report(services: ServicesDep, version: VersionDep, around: SurroundingsDep) -> Json:
    """Return the same numbers and words as JSON, null for what is not known."""
    return Json(contents(version.calibration, _picture(services, version, around), around.claims))


def _picture(services: Services, version: FoundVersion, around: Surroundings) -> ReportPicture:
    def frame(snapshot: str) -> Frame:
        # a deleted one is not shown, though it may be in memory
        services.store.snapshots.get(snapshot)
        return services.frame(snapshot)

    return report_picture(version.calibration, frame, around.camera_name)
