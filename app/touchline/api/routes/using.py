"""/calibrations/{id}/correct, mesh, transform, overlay.json, residuals.json: pictures and points between frames."""

from functools import partial
from typing import Annotated, Literal

from fastapi import APIRouter, Query, Request
from starlette.responses import Response

from touchline.api.bodies import binary_points, content_type, json_body, uploaded_file
from touchline.api.dependencies import ServicesDep, VersionDep, in_thread
from touchline.api.requests import Format, FrameName, IdQuery, MarginPx, TransformRequest, WidthPx
from touchline.api.responses import Json, cached_response, picture
from touchline.api.schemas import BINARY, PICTURE, UNCHANGED, bytes_of, files, response, upload
from touchline.core.errors import BadInput
from touchline.core.geometry import ImageSize, as_points
from touchline.core.jobs import Progress
from touchline.core.json_values import PointsJson, nullable_points
from touchline.core.records import Calibration, Frame, observations_from_json
from touchline.core.statements import say
from touchline.imaging.correction import MAX_NODES, CorrectedView, correction_mesh
from touchline.models import Restored, model_of
from touchline.processes.framing import encode_body
from touchline.services.container import Services
from touchline.workflows import calibration as workflow
from touchline.workflows.calibration import Polyline, ResidualArrows

router = APIRouter(prefix="/calibrations/{id}", tags=["using a calibration"])

Overlay = response("Overlay", features=list[Polyline])
Transformed = response("Transformed", points=PointsJson)

Nodes = Annotated[
    int | None, Query(ge=2, le=MAX_NODES, description="of the mesh; by default chosen by its error")
]
FEW_POINTS = 1000  # as many are through before a thread has been found for them
BODY = {
    "requestBody": {
        "required": True,
        "content": {
            "application/json": {
                "schema": TransformRequest.model_json_schema(
                    ref_template="#/components/schemas/{model}"
                )
            },
            BINARY: bytes_of(BINARY),
        },
    }
}


@router.post(
    "/correct",
    response_class=Response,
    responses=PICTURE,
    openapi_extra={"requestBody": upload(required=False)},
)
async def correct_image(
    request: Request,
    services: ServicesDep,
    version: VersionDep,
    snapshot: Annotated[IdQuery | None, Query()] = None,
    margin_px: MarginPx = 0,
    width: WidthPx = None,
    format: Format = "png",
) -> Response:
    """Correct an uploaded image (multipart, `file`), or a snapshot named in the query."""
    if snapshot is not None:
        frame = await services.run_in_thread(services.frame, snapshot)
    else:
        data, _ = await uploaded_file(request, services.decoder.limits.max_bytes)
        frame = await services.run_in_thread(services.decoder.frame_from_bytes, data)
    return await _draw(
        request, services, version.calibration, frame, CorrectedView(margin_px, width), format
    )


@router.get("/corrected.{format}", response_class=Response, responses=PICTURE)
async def read_corrected_image(
    request: Request,
    services: ServicesDep,
    version: VersionDep,
    format: Format,
    snapshot: Annotated[IdQuery | None, Query()] = None,
    margin_px: MarginPx = 0,
    width: WidthPx = None,
) -> Response:
    """Return the corrected image of the calibration's own snapshot, or of another one of the same size."""
    calibration = version.calibration
    shown = snapshot or calibration.snapshot
    if shown is None:
        raise BadInput(
            say("calibration.no-snapshot", "The calibration was made without a snapshot."),
            "Select one: ?snapshot=ID.",
            reason="no-snapshot",
        )
    frame = await services.run_in_thread(services.frame, shown)
    return await _draw(
        request, services, calibration, frame, CorrectedView(margin_px, width), format
    )


async def _draw(
    request: Request,
    services: Services,
    calibration: Calibration,
    frame: Frame,
    view: CorrectedView,
    format: str,
) -> Response:
    def draw(progress: Progress) -> Response:
        pixels = workflow.correct(
            frame.pixels, model_of(calibration), calibration.image_size, view, progress
        )
        return picture(pixels, format)

    return await services.process_picture(view.size(calibration), draw, request.is_disconnected)


@router.get("/mesh", response_class=Response, responses=files(BINARY) | UNCHANGED)
@cached_response
@in_thread
def read_mesh(
    services: ServicesDep,
    version: VersionDep,
    view: Literal["corrected"] = "corrected",
    columns: Nodes = None,
    rows: Nodes = None,
    margin_px: MarginPx = 0,
) -> Response:
    """Return the correction as a coarse mesh, for clients that correct raw images themselves: a graphics processor.

    A little-endian uint32 length, that many bytes of JSON (columns, rows, corrected_size, image_size, margin_px; first
    and step: the nodes' corrected pixels; error_px: the most that interpolating between them is off), then raw x and y
    of each node, row by row, as little-endian float32; NaN out of reach. Without columns and rows as many nodes as keep
    the error under 0.025 px, at most 513 a row.
    """
    mesh = correction_mesh(model_of(version.calibration), margin_px, columns, rows)
    return Response(encode_body(mesh.header(), mesh.data()), media_type=BINARY)


@router.post("/transform", response_model=Transformed, openapi_extra=BODY, responses=files(BINARY))
async def transform_points(
    request: Request,
    services: ServicesDep,
    version: VersionDep,
    source: Annotated[FrameName | None, Query(alias="from")] = None,
    target: Annotated[FrameName | None, Query(alias="to")] = None,
    z_mm: Annotated[float, Query(ge=-10_000, le=10_000, allow_inf_nan=False)] = 0.0,
) -> Response:
    """Transform points from one frame to another.

    JSON, answered with null for a point out of reach. Or, for millions, application/octet-stream: little-endian
    float64 pairs with `from`, `to` and `z_mm` in the query, answered in kind, NaN for a point out of reach.
    """
    binary = content_type(request) == BINARY
    if binary:
        if source is None or target is None:
            raise BadInput(
                "The request has no source frame or no target frame.",
                "Add ?from=image&to=field (image, corrected or field).",
                reason="no-frames",
            )
        points = await binary_points(request)
    else:
        body = await json_body(request, TransformRequest)
        source, target, z_mm, points = body.source, body.target, body.z_mm, as_points(body.points)
        if body.image_size is not None:
            workflow.check_size(ImageSize.of(body.image_size), version.calibration.image_size)
    model = services.models.get_or_make(version.sha256, lambda: model_of(version.calibration))
    transform = partial(workflow.transform, model, points, source, target, z_mm)
    result = transform() if len(points) <= FEW_POINTS else await services.run_in_thread(transform)
    if binary:
        return Response(result.astype("<f8").tobytes(), media_type=BINARY)
    return Json({"points": nullable_points(result)})


@router.get("/overlay.json", response_model=Overlay, responses=UNCHANGED)
@cached_response
def read_overlay(
    services: ServicesDep,
    version: VersionDep,
    frame: Literal["raw", "corrected"] = "raw",
    margin_px: MarginPx = 0,
    width: WidthPx = None,
) -> Json:
    """Return the region's borders and the field's markings as polylines; null where out of reach."""
    described = Restored.of(version.calibration)
    return Json({"features": workflow.overlay(*described, frame, CorrectedView(margin_px, width))})


@router.get("/residuals.json", response_model=ResidualArrows, responses=UNCHANGED)
@cached_response
@in_thread
def read_residuals(
    services: ServicesDep,
    version: VersionDep,
    frame: Literal["raw", "corrected"] = "raw",
    margin_px: MarginPx = 0,
    width: WidthPx = None,
) -> Json:
    """Return vectors from points to their predicted positions: the nearest position on a line, or the landmark."""
    calibration = version.calibration
    model, field, region = Restored.of(calibration)
    observations = observations_from_json(calibration.observations)
    return Json(
        workflow.residual_vectors(
            model,
            observations,
            field,
            region,
            calibration.outliers(observations),
            frame,
            CorrectedView(margin_px, width),
        )
    )
