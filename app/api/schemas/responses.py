"""What responses look like, one entry each, by resource."""

from typing import Annotated, Any, Literal

from pydantic import Field

from app import jobs
from app.api.schemas.base import JsonObject, Point, Points, Texts, list_of, page_of, response
from app.core.jobs import INTERNAL
from app.evaluate.fit.report_types import SavedReport
from app.league.config import PublishingConfig
from app.live.status_types import ListedCameraStatus
from app.services import events
from app.store import snapshots

Level = Literal["good", "fair", "poor"] | None


def described(type: Any, description: str) -> Any:
    return Annotated[type, Field(description=description)]


# --- the server
Health = response("Health", status=Literal["ok"], version=str, uptime_s=float, warnings=list[JsonObject],
    damaged=list[JsonObject])
Job = response("Job", says=True, record=jobs.Job, without=INTERNAL)
Jobs = page_of("Jobs", Job)
# value: as it is now, "set" or null of a secret. change: null where only the settings file decides it
SettingView = response("SettingView", name=str, value=Any, default=Any, help=str, secret=bool, change=str | None)
SettingsView = response("SettingsView", version=str, items=list_of(SettingView), storage=JsonObject)

# --- what a fit starts from, and what it finds
PlayingField = response("PlayingField", name=str, title=str, length_mm=float, width_mm=float, lines=list[JsonObject],
    arcs=list[JsonObject], landmarks=dict[str, Point], hat_height_mm=float, line_sigma_mm=float,
    regions=dict[str, JsonObject], own=described(bool, "made by an operator; can be changed"))
PlayingFields = response("PlayingFields", page_of("PlayingFieldsPage", PlayingField), revision=str)
# offsets: by line and arc, mm beside its place, and sigma_mm, null where it is not known
MeasuredField = response("MeasuredField", field=JsonObject, offsets=dict[str, JsonObject],
    residuals_mm=described(list[float], "of each distance, measured less adjusted"))
SeenField = response("SeenField", field=JsonObject, added=list[str])
Option = response("Option", name=str, type=str, default=Any, help=str, range=list[float] | None, unit=str | None,
    choices=list[str])
Model = response("Model", name=str, title=str, help=str, points_needed=str, options=list_of(Option))
Models = page_of("Models", Model)
Draft = response("Draft", says=True, field=str | None, region=str | None, rotate=int | None, model=str | None,
    options=JsonObject, observations=list[JsonObject], updated_at=str | None)
Border = response("Border", degree=int, degree_reason=str, coefficients=list[float], rms_px=float,
    loo_rms_px=float | None, residuals_px=list[float], outliers=list[int], curve=list[Point], distortion_pct=float,
    kind=str | None)
FittedModel = response("FittedModel", name=str, parameters=JsonObject)
Polyline = response("Polyline", feature=str, kind=Literal["border", "line", "arc", "landmark"], points=Points)
Overlay = response("Overlay", features=list_of(Polyline))
Arrows = response("Arrows", frame=Literal["raw", "corrected"], mm_per_px=float | None, arrows=list[JsonObject])
Preview = response("Preview", model=FittedModel, report=SavedReport, corrected_size=list[int],
    overlay=list_of(Polyline),
    mesh=described(JsonObject | None, "the corrected view, where mesh_margin_px asks for it"))
Attempt = response("Attempt", preview=Preview | None,
    refusal=described(JsonObject | None, "why it cannot be fitted: reason, title, what, fix, and which"))
SnappedPoint = response("SnappedPoint", state=Literal["snapped", "kept"], point=Point)
SnappedPoints = response("SnappedPoints", points=list_of(SnappedPoint))

# --- calibrations
Calibration = response("Calibration", id=str, version=int, camera=str | None, field=str, region=str, rotate=int,
    model=FittedModel, image_size=list[int], corrected_size=list[int], observations=list[JsonObject],
    options=JsonObject, report=SavedReport, created_at=str, software=str, snapshot=str | None, image_sha256=str | None,
    parent=str | None, note=str, made_by=str, active=bool, field_definition=JsonObject)
Calibrations = page_of("Calibrations", Calibration)
# version: null where the version was deleted since
Activation = response("Activation", calibration=str, version=int | None, at=str, by=str)
Activations = response("Activations", items=list_of(Activation))
# what an export can hold, whether it holds this calibration exactly, else what the nearest costs
Format = response("Format", format=str, title=str, holds=str, suffix=str, reads=bool, exact=bool,
    loss=JsonObject | None, problem=JsonObject | None)
Formats = response("Formats", items=list_of(Format))
Transformed = response("Transformed", points=Points)
Uncertainty = response("Uncertainty", z_mm=float, median=float, rms=float, max=float, worst_place=Point,
    grid=JsonObject)
Difference = response("Difference", rms_mm=float | None, median_mm=float | None, max_mm=float | None,
    worst_place=Point | None, rms_px=float | None, max_px=float | None,
    grid=described(JsonObject | None, "places, mm, px, and mm_vector"),
    lens=described(JsonObject | None, "focal_ratio; max_px: how far pixels move where the lenses may be turned"))
CalibrationReport = response("CalibrationReport", format=Literal["touchline-report"], format_version=Literal[1],
    calibration=JsonObject, field=JsonObject, model=JsonObject, picture=JsonObject, verdict=JsonObject,
    figures=dict[str, JsonObject], distortion=JsonObject, per_feature=list[JsonObject], outliers=list[JsonObject],
    uncertainty=JsonObject, warnings=list[JsonObject])
CheckVerdict = response("CheckVerdict", says=True, level=described(Level, "null: inconclusive"), sentence=str,
    fix=str, reason=described(str, "`holds`, `moved`, `lens`, `lines-missing`, `as-made`, `elsewhere` or `not-seen`"))
# mm is across the marking on the carpet, and null where nothing was found
CheckedLine = response("CheckedLine", feature=str, places=int, found=int, found_share=float, mean_mm=float | None,
    rms_mm=float | None, worst_mm=float | None, rms_px=float | None)
CheckedPlace = response("CheckedPlace", feature=str, expected=described(Point, "raw px, where the calibration has it"),
    found=described(Point, "raw px"), off_mm=float)
# how far the field's lines are today from where the calibration has them
CalibrationCheck = response("CalibrationCheck", calibration=str, version=int | None, camera=str | None, snapshot=str,
    model=str, field=str, region=str, image_size=list[int], verdict=CheckVerdict, lines=list_of(CheckedLine),
    found_share=described(float, "of the length of the lines that should be visible"), lines_found=int,
    others_share=described(float, "length of other long lines, as a share of the visible length; 0 if most of that "
                                  "was detected"),
    missing=described(list[str], "markings that should be visible, are not covered, and were not detected"),
    missing_share=described(float, "of the expected length"),
    missing_inside=described(float, "of the expected length inside the region's borders"),
    own_mm=described(float | None, "the largest error of its own report when it was made"), rms_mm=float | None,
    p95_mm=float | None, rms_px=float | None,
    left_mm=described(float | None, "rms that no camera movement explains"),
    carpet=described(JsonObject | None, "z_mm, mean_mm, p95_mm, max_mm, where, and the map"), hat=JsonObject | None,
    points=list_of(CheckedPlace))

# --- lenses without a field: from boards, straight edges, or two cameras that see the same
LensSummary = response("LensSummary", id=str, created_at=str, camera=str | None, note=str, model=str,
    board=JsonObject | None, image_size=list[int])
Lens = response("Lens", LensSummary, lens=JsonObject, report=JsonObject, snapshots=list[str] | None, software=str)
Lenses = page_of("Lenses", LensSummary)
Straightness = response("Straightness", says=True, lens=JsonObject, sigma=dict[str, float],
    straightness_px=dict[str, float], bow=JsonObject, distortion=Literal["significant", "none", "unknown"],
    sentence=str, lines=list[JsonObject], lines_used=int, objects=int, pictures=list[str], cannot_see=str)
Pair = response("Pair", fundamental=JsonObject | None, pose=JsonObject | None, calibrated=JsonObject | None,
    agreement=JsonObject | None, matches=int, failed=list[JsonObject])
PairLines = response("PairLines", in_a=list[Points | None] | None, in_b=list[Points | None] | None,
    place_in_a=Points | None, place_in_b=Points | None)

# --- cameras and their pictures
Snapshot = response("Snapshot", record=snapshots.Snapshot)
Snapshots = page_of("Snapshots", Snapshot)
# expected_mm: rms on the carpet, expected_hat_mm at hat_height_mm; null where the model knows none
ActiveVersion = response("ActiveVersion", id=str, version=int, model=str, created_at=str, verdict=JsonObject,
    expected_mm=float | None, expected_hat_mm=float | None, hat_height_mm=float | None, field=str,
    field_changes=described(list[str], "parts of its field whose position has changed since it was made"))
Camera = response("Camera", id=str, name=str, field=str | None, region=str | None, source=str, editable=bool,
    active_calibration=str | None, active=ActiveVersion | None, updated_at=str | None, updated_by=str | None)
Cameras = page_of("Cameras", Camera)
CameraTest = response("CameraTest", width=int, height=int, fps=float, identity=Texts | None, picture=str)
FoundCameras = response("FoundCameras", items=list[JsonObject])
Sources = response("Sources", items=list[JsonObject])
Controls = response("Controls", items=list[JsonObject])
CameraStatuses = response("CameraStatuses", items=list[ListedCameraStatus],
    fields=described(str, "a different revision after each change of a field"))
# version, by: of activations, null of others
Event = response("Event", says=True, at=str, kind=events.Kind, camera=described(str | None, "null: images from files"),
    version=int | None, by=str | None, text=str)
Events = response("Events", items=list_of(Event))
Clip = response("Clip", clip=str, camera=str, frames=int, seconds=float)
Clips = page_of("Clips", Clip)
# items: oldest first, each with what it says raw and corrected; report: what all say together
Rolls = response("Rolls", items=list[JsonObject], report=JsonObject | None)

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
RigTrouble = response("RigTrouble", says=True, camera=str, reason=str, text=str, fix=str,
    level=described(Level, "lower limit of the error of the rig; null if the accuracy is unknown"))
CameraOfRig = response("CameraOfRig", camera=str, title=str, region=str | None, rotate=int | None,
    calibration=described(str | None, "its active one"), version=int | None, model=str | None,
    rectangles=JsonObject | None, troubles=list_of(RigTrouble))
RigVerdict = response("RigVerdict", says=True, level=Level, sentence=str, fix=str)
CheckedRig = response("CheckedRig", at=str, verdict=RigVerdict,
    p95_mm=described(float | None, "of the two cameras that are farthest apart; null where none could be compared"))
Rig = response("Rig", name=str, title=str, field=str, w_max_rectangle_px=float | None, h_max_rectangle_px=float | None,
    n_rectangles_x=int | None, n_rectangles_y=int | None, rectangles=described(JsonObject | None, "the common ones"),
    rectangles_from=Literal["rig", "cameras"] | None, cameras=list_of(CameraOfRig),
    checked=described(CheckedRig | None, "newest check since the server start; null if there is none, or the rig or a "
                                         "calibration has changed since then"),
    updated_at=str, updated_by=str)
Rigs = page_of("Rigs", Rig)
# fundamental: predicted by the calibrations, in ideal pixels
RigPair = response("RigPair", a=str, b=str, agreement=JsonObject | None, fundamental=JsonObject | None,
    matches=JsonObject | None, verdict=RigVerdict | None, notes=list[str], failed=Texts | None)
RigCheck = response("RigCheck", cameras=list_of(CameraOfRig), rectangles=JsonObject | None, pairs=list_of(RigPair),
    verdict=RigVerdict, missing=described(list_of(RigTrouble), "cameras that delivered no image"))
# where things lie in stitched.jpg of that width
StitchedView = response("StitchedView", width=int, height=int, px_per_mm=float, overlay=list[JsonObject], corner=Points,
    unseen=JsonObject, cameras=list[JsonObject])

# --- the network
PublishedCamera = response("PublishedCamera", camera=str, calibration=str, version=int, model=str, field=str,
    region=str, camera_id=int, published=bool, exact=bool, loss=JsonObject | None, problem=Texts | None)
Publishing = response("Publishing", record=PublishingConfig, problem=Texts | None,
    state=Literal["off", "starting", "on-air", "silent", "failing"], said=JsonObject | None,
    cameras=list_of(PublishedCamera), interfaces=list[JsonObject])
GeometrySender = response("GeometrySender", id=str, address=str, port=int, source=str, age_s=float, packets=int,
    geometries=int, refused=int, refusal=str | None, skipped=int, geometry_age_s=float | None, sha256=str | None,
    field=JsonObject | None, problem=Texts | None, cameras=list[JsonObject])
GeometrySenders = response("GeometrySenders", listening=bool, problem=Texts | None, datagrams=int, own=int,
    items=list_of(GeometrySender))
