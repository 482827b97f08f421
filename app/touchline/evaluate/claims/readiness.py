"""Claims of all cameras before a match: they are live, calibrated and in place."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from touchline.core.errors import ProblemJson
from touchline.core.statements import Sentence, format_mm, join, say, sentence_in
from touchline.evaluate.claims.claim import Case, Claim
from touchline.evaluate.claims.own_images import CameraImage, own_images_claim

BROKEN = ("offline", "stalled", "mismatch")
STEADY = "steady"


@dataclass(frozen=True)
class SiteCamera:
    """What is known of one camera now. problem: why it gives nothing of use, None where it does; level, length_mm: of
    its active version's own verdict; active: whether it has one; against: claims about its field and area that stand
    against that; drift: as its process tells it, None where nothing watches it; image: what tells whether it shows its
    own."""

    id: str
    title: str
    state: str
    problem: ProblemJson | None
    active: bool
    level: str
    length_mm: float | None
    against: tuple[Claim, ...]
    drift: Mapping[str, Any] | None
    image: CameraImage = field(default_factory=CameraImage)


def camera_claims(cameras: Sequence[SiteCamera]) -> list[Claim]:
    """Return the claims in the order in which an operator works them off."""
    own_images = own_images_claim({one.id: one.title for one in cameras}, {one.id: one.image for one in cameras})
    return [_live(cameras), *own_images, _calibrated(cameras), *_wrong_field(cameras), _in_place(cameras)]


def _live(cameras: Sequence[SiteCamera]) -> Claim:
    live = [camera for camera in cameras if camera.state == "live"]
    down = [camera for camera in cameras if camera.state in BROKEN]
    title = say("claim.live-cameras", "{live} of {count} cameras live", live=len(live), count=len(cameras))
    if down:
        cases = [_case(one, sentence_in(one.problem, "what"), sentence_in(one.problem, "fix")) for one in down
                 if one.problem is not None]
        return Claim("cameras-live", "refuted", title, _names(down), join(*(one.text for one in cases[:1])),
                     ("frames",), True, cure="camera", camera=down[0].id, cases=tuple(cases))
    if len(live) < len(cameras) or not cameras:
        return Claim("cameras-live", "not-tested", title, say("claim.live-cameras.starting", "Not live yet: {cameras}.",
                     cameras=_titles([one for one in cameras if one not in live])) if cameras else "")
    return Claim("cameras-live", "held", title, tried=("frames",))


def _calibrated(cameras: Sequence[SiteCamera]) -> Claim:
    without = [camera for camera in cameras if not camera.active]
    calibrated = len(cameras) - len(without)
    title = say("claim.calibrated", "{calibrated} of {count} cameras calibrated", calibrated=calibrated,
                count=len(cameras))
    if without or not cameras:
        return Claim("cameras-calibrated", "refuted" if cameras else "not-tested", title, say(
            "claim.calibrated.without", "Without an active version: {cameras}.", cameras=_titles(without))
            if cameras else "", tried=("active-versions",) if cameras else (), gates=bool(cameras), cure="images",
            camera=without[0].id if without else None)
    if poor := [camera for camera in cameras if camera.level == "poor"]:
        named = [say("claim.calibrated.camera-mm", "{camera} ({mm})", camera=one.title, mm=format_mm(one.length_mm))
                 if one.length_mm is not None else one.title for one in poor]
        return Claim("cameras-calibrated", "refuted", say("claim.calibrated.poor", "A calibration is not accurate "
                     "enough"), say("claim.calibrated.poor.text", "Not accurate enough: {cameras}.", cameras=named),
                     tried=("own-verdict",), gates=True, cure="versions", camera=poor[0].id, cases=tuple(
                         _case(one, say("claim.calibrated.poor.case", "Its calibration is not accurate enough."),
                               say("claim.calibrated.poor.fix", "Calibrate it again.")) for one in poor))
    if unknown := [camera for camera in cameras if camera.level not in ("good", "fair")]:
        return Claim("cameras-calibrated", "not-tested", title, say(
            "claim.calibrated.unknown", "Accuracy unknown: {cameras}.", cameras=_titles(unknown)), cure="versions",
            camera=unknown[0].id)
    return Claim("cameras-calibrated", "held", title, tried=("active-versions", "own-verdict"))


def _wrong_field(cameras: Sequence[SiteCamera]) -> Iterator[Claim]:
    for code in ("field", "camera-field", "region"):
        if found := [(one, claim) for one in cameras for claim in one.against if claim.code == code]:
            camera, claim = found[0]
            yield Claim(f"cameras-{code}", "refuted", claim.title, _names([one for one, _ in found]), claim.fix,
                        claim.tried, True, cure=claim.cure, camera=camera.id, cases=tuple(
                            _case(one, each.evidence, each.fix) for one, each in found))


def _in_place(cameras: Sequence[SiteCamera]) -> Claim:
    """Return whether the cameras stand as they did: only those that are watched can tell."""
    moved = [(camera, camera.drift) for camera in cameras if camera.drift is not None and camera.drift["alarm"]]
    if moved:
        first, drift = moved[0]
        return Claim("cameras-in-place", "refuted", say("claim.moved", "{count} of {all} cameras moved",
                     count=len(moved), all=len(cameras)), join(_names([one for one, _ in moved]),
                     sentence_in(drift, "sentence")), sentence_in(drift, "fix"), ("field-lines",), True, cure="drift",
                     camera=first.id, cases=tuple(_case(one, sentence_in(its, "sentence"), sentence_in(its, "fix"))
                                                  for one, its in moved))
    watched = [camera for camera in cameras if camera.drift is not None and camera.drift["state"] == STEADY]
    if len(watched) < len(cameras) or not cameras:
        rest = [camera for camera in cameras if camera not in watched]
        why = [sentence_in(one.drift, "sentence") for one in rest if one.drift is not None][:1]
        return Claim("cameras-in-place", "not-tested", say(
            "claim.not-watched", "Movement cannot be detected"), join(say(
                "claim.not-watched.text", "Not monitored: {cameras}.", cameras=_titles(rest)), *why) if cameras else "",
            cure="drift" if rest else "", camera=rest[0].id if rest else None)
    return Claim("cameras-in-place", "held", say("claim.none-moved", "No camera has moved"), tried=("field-lines",))


def _case(camera: SiteCamera, text: str, fix: str) -> Case:
    return Case(join(f"{camera.title}:", text), fix, camera.id)


def _titles(cameras: Sequence[SiteCamera]) -> list[str]:
    return [camera.title for camera in cameras]


def _names(cameras: Sequence[SiteCamera]) -> Sentence:
    return Sentence(", ".join(_titles(cameras)))
