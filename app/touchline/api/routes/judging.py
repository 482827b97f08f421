"""How far to trust a version, how far two are apart, and all that is known of one; two cameras that see the same."""

from contextlib import suppress
from typing import Annotated, Any, NamedTuple

from fastapi import APIRouter, Depends, Query, Request
from pydantic import Field
from starlette.responses import HTMLResponse, Response

from touchline import report
from touchline.api.dependencies import ServicesDep, VersionDep, in_thread
from touchline.api.json_text import json_bytes
from touchline.api.responses import Json, cached_response, disposition, finished_or_queued, picture
from touchline.api.schemas import responses
from touchline.api.schemas.media import HTML, UNCHANGED, files
from touchline.api.schemas.requests import Id
from touchline.core.errors import BadInput, NotFound, TouchlineError
from touchline.core.geometry import ImageSize
from touchline.core.records import Calibration, Frame
from touchline.evaluate.claims.claim import Claim
from touchline.evaluate.fit.difference import Difference
from touchline.models.restored import Restored, model_of
from touchline.report.page import POLICY
from touchline.services.answer_cache import etag_of
from touchline.services.claims import known_claims, packet_json
from touchline.services.container import Services
from touchline.services.forms import HeightForm, Name, Number, Pair, Size, Strict
from touchline.store.calibrations import FoundVersion
from touchline.workflows import calibration as workflow
from touchline.workflows.calibration_types import Uncertainty
from touchline.workflows.pair import lines_by_calibrations, lines_by_matrix, run_pair
from touchline.workflows.pair_types import PairLines, PairReport

router = APIRouter(tags=["judging"])

HeightMm = Annotated[float, Query(ge=0, le=5000, allow_inf_nan=False, description="height of the plane, mm")]
PNG = files("image/png") | UNCHANGED


def _other_of(services: ServicesDep, other: Id) -> FoundVersion:
    return services.store.calibrations.find(other)


OtherDep = Annotated[FoundVersion, Depends(_other_of)]


@router.get("/calibrations/{id}/uncertainty.json", response_model=Uncertainty, responses=UNCHANGED)
@cached_response
@in_thread
def read_uncertainty(services: ServicesDep, version: VersionDep, z_mm: HeightMm = 0.0) -> Json:
    """Return the expected error in mm on a grid over the region, in the plane at z_mm; 409 for a model without it."""
    return Json(_uncertainty(version.calibration, z_mm))


@router.get("/calibrations/{id}/uncertainty.png", response_class=Response, responses=PNG)
@cached_response
@in_thread
def read_uncertainty_image(services: ServicesDep, version: VersionDep, z_mm: HeightMm = 0.0) -> Response:
    """Draw the same as a heat map with a scale in mm and the largest error marked, oriented as the corrected image."""
    calibration = version.calibration
    grid = _uncertainty(calibration, z_mm)["grid"]
    return _heat_map(grid["sigma_mm"], calibration, f"expected error at z = {z_mm:g} mm")


@router.get("/calibrations/{id}/difference/{other}.json", response_model=Difference, responses=UNCHANGED)
@cached_response
@in_thread
def read_difference(services: ServicesDep, version: VersionDep, against: OtherDep) -> Json:
    """Return the difference of two calibrations of one image over the region: mm on the carpet and px in it."""
    return Json(_difference(version.calibration, against.calibration))


@router.get("/calibrations/{id}/difference/{other}.png", response_class=Response, responses=PNG)
@cached_response
@in_thread
def read_difference_image(services: ServicesDep, version: VersionDep, against: OtherDep) -> Response:
    """Draw the same as a heat map with a scale in mm."""
    a, b = version.calibration, against.calibration
    grid = workflow.difference_grid(_difference(a, b))
    return _heat_map(grid["mm"], a, f"version {b.version} from version {a.version}")


@router.get("/calibrations/{id}/packet", response_model=responses.Packet)
@in_thread
def read_packet(services: ServicesDep, id: Id) -> Json:
    """Return what teams receive of a version through the league's packet, whether it is published or not.

    expected: the error of that, on the carpet and at robot tops; fit_expected: the version's own. asked: whether it is
    published only after approval. problem: why a packet cannot hold it.
    """
    return Json(packet_json(services, services.store.calibrations.get(id)))


def _uncertainty(calibration: Calibration, z_mm: float) -> Uncertainty:
    model, _, region = Restored.of(calibration)
    return workflow.uncertainty(model, calibration.covariance, region, z_mm)


def _difference(a: Calibration, b: Calibration) -> Difference:
    model, _, region = Restored.of(a)
    return workflow.difference(model, model_of(b), region)


def _heat_map(values_mm: Any, calibration: Calibration, title: str) -> Response:
    return picture(workflow.error_map_image(values_mm, Restored.of(calibration).region, title), "png")


class Surroundings(NamedTuple):
    """What a report says that its version does not. picture: the name of its file; None if that is gone."""

    camera_name: str | None
    picture: str | None
    claims: list[Claim]

    @property
    def stamp(self) -> tuple[str | None, ...]:
        """Return what is another one as soon as the report says something else."""
        return self.camera_name, self.picture, etag_of(json_bytes([claim.to_json() for claim in self.claims]))


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
def read_report_page(services: ServicesDep, version: VersionDep, around: SurroundingsDep) -> HTMLResponse:
    """Return one self-contained page: verdict, figures, images before and after, error maps, versions and hashes."""
    calibration, shown = version.calibration, _shown(services, version, around)
    contents = report.contents(calibration, shown, around.claims)
    html = report.page(contents, report.draw(calibration, shown, contents))
    name = f"{calibration.camera or calibration.field['name']}-v{calibration.version}-report.html"
    return HTMLResponse(html.encode("utf-8", "replace"), headers={
        "Content-Security-Policy": f"{POLICY}; frame-ancestors 'self'", "Cache-Control": "no-cache",
        "Content-Disposition": disposition("inline", name)})


@router.get("/calibrations/{id}/report.json", response_model=responses.CalibrationReport, responses=UNCHANGED)
@cached_response
@in_thread
def read_report(services: ServicesDep, version: VersionDep, around: SurroundingsDep) -> Json:
    """Return the same numbers and words as JSON, null for what is not known."""
    return Json(report.contents(version.calibration, _shown(services, version, around), around.claims))


def _shown(services: Services, version: FoundVersion, around: Surroundings) -> report.ReportPicture:
    def frame(snapshot: str) -> Frame:
        services.store.snapshots.get(snapshot)  # a deleted one is not shown, though it may be in memory
        return services.frame(snapshot)
    return report.report_picture(version.calibration, frame, around.camera_name)


class PairRequest(Strict):
    """The same points in two images, two calibrations over one field, or both."""

    points_a: Annotated[list[Pair | None], Field(max_length=20_000)] | None = Field(
        None, description="[x, y] px in image a; null for a point that is not marked yet and only counts")
    points_b: Annotated[list[Pair | None], Field(max_length=20_000)] | None = Field(
        None, description="[x, y] px in image b; null: not marked yet")
    calibration_a: Name | None = None
    calibration_b: Name | None = None
    z_mm: HeightForm | Annotated[list[HeightForm | None], Field(max_length=20_000)] = Field(
        0.0, description="height of the matched points, mm: of all, or of each, null where it is unknown")


class PairLinesRequest(Strict):
    """Points in the images of a pair, for their epipolar lines: by a matrix, or by two calibrations."""

    points_a: Annotated[list[Pair], Field(max_length=200)] = Field([], description="[x, y] px in image a")
    points_b: Annotated[list[Pair], Field(max_length=200)] = Field([], description="[x, y] px in image b")
    matrix: Annotated[list[Annotated[list[Number], Field(min_length=3, max_length=3)]],
                      Field(min_length=3, max_length=3)] | None = Field(
                          None, description="the fundamental matrix, 3 × 3, as POST /pairs has it")
    image_size_a: Size | None = Field(None, description="[width, height] px, with a matrix")
    image_size_b: Size | None = None
    calibration_a: Name | None = None
    calibration_b: Name | None = None
    z_mm: HeightForm | None = Field(0.0, description="height of the points, mm; null where it is unknown")


@router.post("/pairs", response_model=PairReport)
async def compare_pair(request: Request, services: ServicesDep, body: PairRequest) -> Response:
    """Return the fundamental matrix of matched points, the pose between two lenses, and the cameras' agreement in mm.

    Each is null where it was not requested; one that cannot be computed is named in `failed`, with what to do.
    """
    a, b = (None if id is None else services.store.calibrations.get(id).to_json()
            for id in (body.calibration_a, body.calibration_b))
    spec = {"points_a": body.points_a, "points_b": body.points_b, "calibration_a": a, "calibration_b": b,
            "z_mm": body.z_mm}
    return await finished_or_queued(request, services, "pair", run_pair, spec, as_job=False)


@router.post("/pairs/lines", response_model=PairLines)
@in_thread
def find_epipolar_lines(services: ServicesDep, body: PairLinesRequest) -> Json:
    """Return epipolar lines of points, each in the other image, and the same position there at `z_mm`.

    By a fundamental `matrix` they are straight; by two calibrations they bend as the lenses do, null without rays.
    """
    a, b, size_a, size_b = body.calibration_a, body.calibration_b, body.image_size_a, body.image_size_b
    if body.matrix is not None and size_a is not None and size_b is not None and a is None and b is None:
        return Json(lines_by_matrix(body.matrix, body.points_a, body.points_b, ImageSize.of(size_a),
                                    ImageSize.of(size_b)))
    if body.matrix is None and a is not None and b is not None:
        get = services.store.calibrations.get
        return Json(lines_by_calibrations(get(a), get(b), body.points_a, body.points_b, body.z_mm))
    raise BadInput("The request has no source for the lines.",
                   "Send a matrix and both image sizes, or two calibrations.", reason="one-sided")
