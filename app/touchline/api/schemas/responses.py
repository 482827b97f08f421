"""What responses look like, one entry each, by resource."""

from typing import Annotated, Any, Literal

from pydantic import Field

from touchline import jobs
from touchline.api.schemas.base import JsonObject, Texts, list_of, page_of, response
from touchline.api.schemas.media import Responses
from touchline.core.json_values import PointsJson, SizeJson
from touchline.core.options import OptionJson
from touchline.core.records import ObservationJson
from touchline.evaluate.claims.claim import ClaimJson, Gate
from touchline.evaluate.fit.report_types import SavedReport
from touchline.league.config import PublishingConfig
from touchline.live.status_types import ListedCameraStatus
from touchline.services import events
from touchline.services.fields import PlayingField
from touchline.services.rigs import RigJson
from touchline.services.snapping import SnappedPoint
from touchline.store import backup_restore, snapshots
from touchline.workflows.calibration_types import ModelParameters, Polyline


def described(type: Any, description: str) -> Any:
    return Annotated[type, Field(description=description)]


# --- the server
# without the access token: status alone
Health = response("Health", status=Literal["ok"], version=str, uptime_s=float, warnings=list[JsonObject],
    damaged=list[JsonObject])
# lost: changes that only the database has; file: where that is now, null before it was replaced
Restoration = response("Restoration", record=backup_restore.Restoration, lost=int)
Job = response("Job", says=True, record=jobs.Job, without=("spec",))
Jobs = page_of("Jobs", Job)
ACCEPTED: Responses = {202: {"model": Job, "description": "a job: ?job=true"}}
# value: as it is now, "set" or null of a secret. change: null where only the settings file decides it
SettingView = response("SettingView", name=str, value=Any, default=Any, help=str, secret=bool, change=str | None)
SettingsView = response("SettingsView", version=str, items=list_of(SettingView), storage=JsonObject)

# --- what a fit starts from, and what it finds
PlayingFields = response("PlayingFields", page_of("PlayingFieldsPage", PlayingField), revision=str)
Model = response("Model", name=str, title=str, help=str, points_needed=str, options=list[OptionJson],
    is_fitted=bool)
Models = page_of("Models", Model)
Draft = response("Draft", says=True, field=str | None, region=str | None, rotate=int | None, model=str | None,
    options=JsonObject, observations=list[ObservationJson], updated_at=str | None)
Overlay = response("Overlay", features=list[Polyline])
SnappedPoints = response("SnappedPoints", points=list[SnappedPoint])

# --- calibrations
Calibration = response("Calibration", id=str, version=int, camera=str | None, field=str, region=str, rotate=int,
    model=ModelParameters, image_size=SizeJson, corrected_size=SizeJson, observations=list[ObservationJson],
    options=JsonObject, report=SavedReport, created_at=str, software=str, snapshot=str | None, image_sha256=str | None,
    parent=str | None, note=str, made_by=str, active=bool, field_definition=JsonObject)
Calibrations = page_of("Calibrations", Calibration)
# version: null where the version was deleted since; despite: the claims that stood against it
Activation = response("Activation", calibration=str, version=int | None, at=str, by=str, despite=list[str])
Activations = response("Activations", items=list_of(Activation))
Claims = response("Claims", calibration=str, gate=Gate, items=list[ClaimJson])
Readiness = response("Readiness", gate=Gate, items=list[ClaimJson])
# what an export can hold, whether it holds this calibration exactly, else what the nearest costs
Format = response("Format", format=str, title=str, holds=str, suffix=str, reads=bool, exact=bool,
    loss=JsonObject | None, problem=JsonObject | None)
Formats = response("Formats", items=list_of(Format))
Transformed = response("Transformed", points=PointsJson)
CalibrationReport = response("CalibrationReport", format=Literal["touchline-report"], format_version=Literal[1],
    calibration=JsonObject, field=JsonObject, model=JsonObject, picture=JsonObject, verdict=JsonObject,
    claims=list[ClaimJson], figures=dict[str, JsonObject], distortion=JsonObject, per_feature=list[JsonObject],
    outliers=list[JsonObject], uncertainty=JsonObject, warnings=list[JsonObject])

# --- lenses without a field: from boards, straight edges, or two cameras that see the same
LensSummary = response("LensSummary", id=str, created_at=str, camera=str | None, note=str, model=str,
    board=JsonObject | None, image_size=list[int])
Lens = response("Lens", LensSummary, lens=JsonObject, report=JsonObject, snapshots=list[str] | None, software=str)
Lenses = page_of("Lenses", LensSummary)
Straightness = response("Straightness", says=True, lens=JsonObject, sigma=dict[str, float],
    straightness_px=dict[str, float], bow=JsonObject, distortion=Literal["significant", "none", "unknown"],
    sentence=str, lines=list[JsonObject], lines_used=int, objects=int, pictures=list[str], cannot_see=str)

# --- cameras and their pictures
Snapshot = response("Snapshot", record=snapshots.Snapshot)
Snapshots = page_of("Snapshots", Snapshot)
# expected_mm: rms on the carpet, expected_hat_mm at hat_height_mm; null where the model knows none
ActiveVersion = response("ActiveVersion", id=str, version=int, model=str, created_at=str, verdict=JsonObject,
    expected_mm=float | None, expected_hat_mm=float | None, hat_height_mm=float | None,
    field=str, region=str, rotate=int,
    field_changes=described(list[str], "parts of its field whose position has changed since it was made"))
Camera = response("Camera", id=str, name=str, field=str | None, region=str | None, source=str, editable=bool,
    active_calibration=str | None, active=ActiveVersion | None, updated_at=str | None, updated_by=str | None)
Cameras = page_of("Cameras", Camera)
CameraTest = response("CameraTest", width=int, height=int, fps=float, identity=Texts | None, picture=str)
FoundCameras = response("FoundCameras", items=list[JsonObject])
Sources = response("Sources", items=list[JsonObject])
Controls = response("Controls", items=list[JsonObject])
CameraStatuses = response("CameraStatuses", items=list[ListedCameraStatus],
    fields=described(str, "a different revision after each change of a field"),
    restored=described(int, "how many backups were restored since the server started"))
# version, by: of activations, null of others; despite: the claims that stood against one
Event = response("Event", says=True, at=str, kind=events.Kind, camera=described(str | None, "null: images from files"),
    version=int | None, by=str | None, despite=list[str], text=str)
Events = response("Events", items=list_of(Event))
Clip = response("Clip", clip=str, camera=str, frames=int, seconds=float)
Clips = page_of("Clips", Clip)
# items: oldest first, each with what it says raw and corrected; report: what all say together
Rolls = response("Rolls", items=list[JsonObject], report=JsonObject | None, etag=str)

# --- detection
# learned: whether the colours were clicked or found in the camera's picture, null before that
DetectionSettings = response("DetectionSettings", on=bool, plan=JsonObject, colours=str | None,
    profile=JsonObject | None, learned=str | None, health=list[JsonObject], publish=bool, published=JsonObject)
Colours = response("Colours", name=str, profile=JsonObject, health=list[JsonObject], used_by=list[str])
ColoursList = page_of("ColoursList", Colours)
LearnedColours = response("LearnedColours", profile=JsonObject, health=list[JsonObject], notes=list[str])
# one frame. items: what was found; ms: of all stages, of processor time; fps: frames that are looked at
FrameDetections = response("FrameDetections", seq=int, time_s=float, items=list[JsonObject], stages=list[JsonObject],
    ms=float, notes=list[str], fps=float)
# items: the tracks; seams: how far apart cameras see the same things; cameras: what each gives, or why not
Tracks = response("Tracks", time_s=float, items=list[JsonObject], seams=JsonObject, cameras=list[JsonObject])

# --- rigs
Rigs = page_of("Rigs", RigJson)

# --- the network
PublishedCamera = response("PublishedCamera", camera=str, calibration=str, version=int, model=str, field=str,
    region=str, camera_id=int, published=bool, exact=bool, loss=JsonObject | None,
    expected=JsonObject | None, fit_expected=JsonObject | None, level=str | None, warnings=list[JsonObject],
    problem=Texts | None)
Packet = response("Packet", calibration=str, exact=bool, loss=JsonObject | None, expected=JsonObject | None,
    fit_expected=JsonObject | None, level=str | None, asked=bool, warnings=list[JsonObject], problem=Texts | None)
Publishing = response("Publishing", record=PublishingConfig, problem=Texts | None,
    state=Literal["off", "starting", "on-air", "silent", "failing"], said=JsonObject | None,
    passed_on=JsonObject | None, cameras=list_of(PublishedCamera), interfaces=list[JsonObject])
GeometrySender = response("GeometrySender", id=str, address=str, port=int, source=str, age_s=float, packets=int,
    geometries=int, refused=int, refusal=str | None, skipped=int, geometry_age_s=float | None, sha256=str | None,
    field=JsonObject | None, problem=Texts | None, cameras=list[JsonObject],
    differs=list[JsonObject])
GeometrySenders = response("GeometrySenders", listening=bool, problem=Texts | None, datagrams=int, own=int,
    items=list_of(GeometrySender))
