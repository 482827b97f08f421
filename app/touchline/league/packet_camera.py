"""The best camera that the league's packet can hold for a calibration, and what teams can expect of it, in mm.

A packet has square pixels, a principal point and one lens term. Fitted to the points themselves, such a lens gives way
where points happen to be many; so it is fitted to a lens that bends freely and fits the same points, evenly over the
area, at the carpet and at robot tops. Its error is that lens's expected error and the known distance from it.
"""

from dataclasses import dataclass, replace

import numpy as np

from touchline.core.errors import TouchlineError
from touchline.core.field import Field, Region
from touchline.core.field_json import field_from_json
from touchline.core.geometry import inside_picture, with_z
from touchline.core.json_values import JsonObject
from touchline.core.records import Calibration, Fit, Warning, observations_from_json
from touchline.core.statements import say
from touchline.evaluate.approximation import ApproximationError, approximation_error
from touchline.evaluate.difference import MIN_TERMS, explains, fit_rms_px, freer_lens
from touchline.evaluate.next_click import observability_warnings
from touchline.evaluate.report_types import Level, SigmaReport
from touchline.evaluate.uncertainty import fit_from_json, grid_over, sigma_report
from touchline.evaluate.verdict import GOOD_MM, LEVELS, level_expected, worst_level
from touchline.formats.approximation import exact_camera, nearest_camera
from touchline.formats.ssl_vision import FORMAT as SSL_VISION
from touchline.formats.ssl_vision import camera_from_wire, camera_number, camera_to_wire
from touchline.models import CameraModel, Restored
from touchline.models.contract import RECTANGLE_FIELDS
from touchline.models.ray_camera import RayCamera
from touchline.ssl_protocol.protobuf import decode, encode
from touchline.ssl_protocol.ssl_vision_pb2 import SSL_GeometryCameraCalibration

# of a negative term, from which operators are warned of readers that ignore it
MIN_IGNORED_PX = 0.5


@dataclass(frozen=True)
class PacketCamera:
    """A calibration as the league's message, under its region's number.

    loss: of that message, decoded as a listener does, against the calibration. exact: whether it is the calibration's
    own camera, so that only the rounding to four bytes is lost. expected: the error of what teams receive, None where
    neither the calibration nor its points tell it. fit: the calibration's own, likewise. ignored_px: the largest error
    of a reader that ignores a negative term. own_level: of the calibration, where the packet's camera is made of that.
    """

    sent: SSL_GeometryCameraCalibration
    loss: ApproximationError
    exact: bool
    expected: SigmaReport | None = None
    fit: SigmaReport | None = None
    ignored_px: float = 0.0
    own_level: Level = "good"

    @property
    def level(self) -> Level | None:
        """The level of what teams receive: no better than the calibration's own."""
        return (
            None
            if self.expected is None
            else worst_level(level_expected(self.expected), self.own_level)
        )

    @property
    def judged_mm(self) -> float:
        """The error by which it is published, mm: the expected one, also at robot tops where that is no guess; else
        the largest loss."""
        if self.expected is None:
            return self.loss.worst_at_any_height_mm
        hat = self.expected.get("hat")
        return max(self.expected["rms"], hat["rms"] if hat and hat.get("known", True) else 0.0)

    def warnings(self, name: str) -> list[Warning]:
        """Say what teams should know of the camera of that name."""
        found = []
        if self.expected is not None and self.level != "good":
            found.append(
                Warning(
                    "packet-error",
                    _expected_error_in_words(name, self.expected, self.fit),
                    say(
                        "publishing.packet-error.fix",
                        "A packet has one lens term. A lens with less distortion, or a "
                        "smaller area for each camera, reduces the error.",
                    )
                    if not self.exact
                    else say(
                        "publishing.calibrate-again",
                        "Add points, or calibrate again with a better image.",
                    ),
                )
            )
        if self.ignored_px > MIN_IGNORED_PX:
            found.append(
                Warning(
                    "negative-term",
                    say(
                        "publishing.negative-term",
                        "The lens term of {camera} is negative (pincushion). SSL-Vision ignores "
                        "negative terms when it maps field positions to pixels: it is up to {px:.0f} px off there. Its "
                        "positions on the field are not affected.",
                        camera=name,
                        px=self.ignored_px,
                    ),
                    say(
                        "publishing.negative-term.fix",
                        "Do not judge this calibration by the lines that SSL-Vision draws.",
                    ),
                )
            )
        return found

    def to_json(self) -> JsonObject:
        """Return the figures as JSON; None for what is not known."""
        return {
            "exact": self.exact,
            "loss": self.loss.to_json(),
            "level": self.level,
            "expected": self.expected,
            "fit_expected": self.fit,
        }


class PacketCameraCache:
    """Fits each calibration's packet camera once: a version never changes, and fitting takes a while."""

    MAX_CAMERAS = 64

    def __init__(self) -> None:
        self._cache: dict[str, PacketCamera | TouchlineError] = {}

    def __call__(self, calibration: Calibration) -> PacketCamera | TouchlineError:
        """Return the message, or why the league's lens cannot represent the calibration."""
        if calibration.id not in self._cache:
            while len(self._cache) >= self.MAX_CAMERAS:
                self._cache.pop(next(iter(self._cache)), None)
            self._cache[calibration.id] = packet_camera(calibration)
        return self._cache[calibration.id]


def packet_camera(calibration: Calibration) -> PacketCamera | TouchlineError:
    """Return the packet's camera with its expected error, or why the league's lens cannot represent the calibration."""
    try:
        return _nearest_packet_camera(calibration)
    except TouchlineError as refused:
        return refused


def _nearest_packet_camera(calibration: Calibration) -> PacketCamera:
    model, field, region = Restored.of(calibration)
    robot_top_mm = field.hat_height_mm
    fit = _determined_fit(calibration, model, region)
    source = model if fit is None else fit.model
    camera = exact_camera(source, SSL_VISION.lenses, SSL_VISION.square_pixels)
    is_exact = camera is not None and source is model
    if camera is None:
        camera, _ = nearest_camera(
            source, tuple(SSL_VISION.lenses.items()), SSL_VISION.square_pixels, region, robot_top_mm
        )
    sent = camera_to_wire(camera, camera_number(field, region))

    # What teams have is what they decode: the error is that of the camera after rounding to four bytes.
    decoded = camera_from_wire(decode(SSL_GeometryCameraCalibration, encode(sent)), field)
    received = decoded.camera({name: getattr(camera, name) for name in RECTANGLE_FIELDS})
    loss = approximation_error(model, received, region, robot_top_mm)
    expected = None
    if fit is not None:
        is_height_known = _height_is_known(calibration, fit, model, field, region)
        expected = sigma_report(fit, region, robot_top_mm, is_height_known, stand_in=received)
    return PacketCamera(
        sent,
        loss,
        is_exact,
        expected,
        fit=calibration.report.get("sigma_mm"),
        ignored_px=_error_without_negative_term_px(received, region, robot_top_mm),
        own_level=_own_level(calibration) if source is model else "good",
    )


def _own_level(calibration: Calibration) -> Level:
    """Return the level of its verdict, which cross-validation counts in, too; good where it has none."""
    level = (calibration.report.get("verdict") or {}).get("level")
    return next((known for known in LEVELS if known == level), "good")


def _determined_fit(calibration: Calibration, model: CameraModel, region: Region) -> Fit | None:
    """Return a fit that knows its error and bends freely: the calibration's own, else another to the same points.

    None where there are no points, or such a lens does not explain them.
    """
    covariance, options = calibration.covariance, calibration.options
    if isinstance(model, RayCamera) and covariance is not None:
        try:
            known, stand_in = fit_from_json(covariance, model)
            if (
                stand_in is not None
                or len(model.lens_terms) >= MIN_TERMS
                or options.get("lens") is not None
            ):
                return known
        except TouchlineError:
            pass  # an imported one may belong to anything
    if not calibration.observations:
        return None
    field = field_from_json(calibration.field)
    observations = observations_from_json(calibration.observations)
    fit = freer_lens(observations, field, region, calibration.image_size, options)
    if fit is None or not explains(
        fit_rms_px(fit, observations, field, region), calibration.report.get("rms_px")
    ):
        return None
    return fit


def _height_is_known(
    calibration: Calibration, fit: Fit, model: CameraModel, field: Field, region: Region
) -> bool:
    warnings = (
        [w.reason for w in observability_warnings(fit, region, field.hat_height_mm)]
        if fit.model is not model
        else [w.get("reason") for w in calibration.report.get("warnings") or ()]
    )
    return "height-unknown" not in warnings


def _error_without_negative_term_px(
    camera: RayCamera, region: Region, hat_height_mm: float
) -> float:
    """Return how far a reader is off that takes a negative term for none, as SSL-Vision's field-to-pixel does."""
    if camera.lens_terms[0] >= 0:
        return 0.0
    places = grid_over(region).reshape(-1, 2)
    points = np.concatenate([with_z(places), with_z(places, hat_height_mm)])
    pixels = camera.project(points)
    is_seen = inside_picture(pixels, camera.image_size)
    without_term = replace(camera, lens_terms=(0.0,))
    errors_px = np.linalg.norm(without_term.project(points[is_seen]) - pixels[is_seen], axis=1)
    return float(errors_px.max(initial=0.0))


def _expected_error_in_words(name: str, expected: SigmaReport, fit: SigmaReport | None) -> str:
    mm, hat = expected["rms"], expected.get("hat")
    values: JsonObject = {"camera": name, "mm": mm, "fit_mm": fit["rms"] if fit else mm}
    if hat is None or max(mm, hat["rms"]) <= max(mm, GOOD_MM):
        return say(
            "publishing.received",
            "Teams receive {camera} with an expected error of {mm:mm} mm; the "
            "calibration itself has {fit_mm:mm} mm.",
            **values,
        )
    if not hat.get("known", True):
        return say(
            "publishing.received-tops-unknown",
            "Teams receive {camera} with an expected error of {mm:mm} mm "
            "on the carpet; at robot tops it is unknown, because the camera height is unknown. The calibration "
            "itself has {fit_mm:mm} mm.",
            **values,
        )
    return say(
        "publishing.received-tops",
        "Teams receive {camera} with an expected error of {mm:mm} mm on the carpet "
        "and {tops_mm:mm} mm at robot tops; the calibration itself has {fit_mm:mm} mm.",
        **values,
        tops_mm=hat["rms"],
    )
