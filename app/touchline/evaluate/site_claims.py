"""Claims of all cameras before a match: live, calibrated, in place, and each with its own image.

Where two cables are exchanged on a symmetric rig, each half still looks calibrated. What differs is what is not
symmetric: vision/picture_print.py.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any, Literal

from touchline.core.errors import ProblemJson
from touchline.core.geometry import ImageSize
from touchline.core.statements import Sentence, format_mm, join, say, sentence_in
from touchline.evaluate.claims import Case, Claim
from touchline.vision.picture_print import PicturePrint, likeness, nearer

# likeness of one stream, sent in two ways, 0.65 to 0.99; of cameras of a rig up to 0.7
SAME, DIFFERENT = 0.8, 0.65
SURE = 0.3  # nearer one of two: robots and people in a quarter gave 0.38
CODE = "cameras-own-images"
TRIED = ("addresses", "live-images", "calibration-images")
EXCHANGE = say(
    "claim.images.exchanged.fix", "Exchange the cables or the addresses of the two cameras."
)

Shown = Literal["own", "other", "unknown"]
# the last two: it shows the other's
Found = Literal["apart", "unknown", "address", "image", "first", "second"]

BROKEN = ("offline", "stalled", "mismatch")
STEADY = "steady"


@dataclass(frozen=True)
class CameraImage:
    """now: a camera's newest picture. then, size: of the image that its active version came from, None without one.

    source: the device that its address names, "" where unknown. area: field and region, where known; two cameras over
    the same one may well see the same.
    """

    source: str = ""
    now: PicturePrint | None = None
    then: PicturePrint | None = None
    size: ImageSize | None = None
    area: tuple[str | None, str | None] = (None, None)


def whose(now: PicturePrint, own: PicturePrint | None, other: PicturePrint) -> Shown:
    """Return whose picture it is, by the images that two cameras were calibrated from; own: None where it is gone."""
    side = 0.0 if own is None else nearer(now, own, other)
    like = likeness(now, other)
    if side >= SURE or (side > -SURE and like < DIFFERENT):
        return "own"
    return "other" if like >= (DIFFERENT if side <= -SURE else SAME) else "unknown"


def compare(a: CameraImage, b: CameraImage) -> Found:
    """Return what two cameras show."""
    if a.source and a.source == b.source:
        return "address"
    if _is_same(a.now, b.now) or _is_same(a.then, b.then):
        return "unknown" if None not in a.area and a.area == b.area else "image"
    if a.now is None or b.now is None:
        return "unknown"
    like = likeness(a.now, b.now)
    if a.size is None or a.size != b.size:  # exchanged, they would be of another size
        return "apart" if like < DIFFERENT else "unknown"
    shown = _shown(a.now, a.then, b.then), _shown(b.now, b.then, a.then)
    if "other" in shown:
        return "first" if shown[0] == "other" else "second"
    return (
        "apart" if shown == ("own", "own") or ("own" in shown and like < DIFFERENT) else "unknown"
    )


def _is_same(one: PicturePrint | None, other: PicturePrint | None) -> bool:
    return one is not None and other is not None and likeness(one, other) >= SAME


def _shown(now: PicturePrint, own: PicturePrint | None, other: PicturePrint | None) -> Shown:
    if other is not None:
        return whose(now, own, other)
    return "own" if _is_same(now, own) else "unknown"


def own_images_claim(
    titles: Mapping[str, str], images: Mapping[str, CameraImage]
) -> Iterator[Claim]:
    """Yield what is claimed of several cameras, by id; nothing where there are fewer than two."""
    pairs = [(a, b, compare(images[a], images[b])) for a, b in combinations(images, 2)]
    if not pairs:
        return
    for a, b, found in pairs:
        named = {"a": titles[a], "b": titles[b]}
        if found in ("first", "second"):
            a, b = (a, b) if found == "first" else (b, a)
            yield _refuted(
                say("claim.images.exchanged", "The images of two cameras are exchanged"),
                shows(titles[a], titles[b]),
                EXCHANGE,
                a,
            )
        elif found == "address":
            yield _refuted(
                say("claim.images.address", "Two cameras have the same address"),
                say("claim.images.two", "{a} and {b}.", **named),
                say("claim.images.address.fix", "Enter the second camera's own address."),
                b,
            )
        elif found == "image":
            yield _refuted(
                say("claim.images.same", "Two cameras show the same image"),
                say("claim.images.two", "{a} and {b}.", **named),
                say(
                    "claim.images.same.fix",
                    "Check both addresses and cables: one camera is shown twice.",
                ),
                b,
            )
        else:
            continue
        return
    without = [titles[id] for id, image in images.items() if image.now is None]
    untold = [(titles[a], titles[b]) for a, b, found in pairs if found == "unknown"]
    if without:
        yield Claim(
            CODE,
            "not-tested",
            say("claim.images.not-compared", "Images of cameras not compared"),
            say(
                "claim.images.without",
                "No image, or nothing visible in it: {cameras}.",
                cameras=without,
            ),
        )
    elif untold:
        yield Claim(
            CODE,
            "not-tested",
            say("claim.images.untold", "Images of cameras look alike"),
            say("claim.images.two", "{a} and {b}.", a=untold[0][0], b=untold[0][1]),
            say(
                "claim.images.untold.fix",
                "Cover one lens after the other, and check which image becomes dark.",
            ),
        )
    else:
        yield Claim(
            CODE, "held", say("claim.images.own", "Each camera shows its own image"), tried=TRIED
        )


def shows(a: str, b: str) -> Sentence:
    return say("claim.images.shows", "{a} shows the image of {b}.", a=a, b=b)


def _refuted(title: Sentence, evidence: Sentence, fix: Sentence, camera: str) -> Claim:
    return Claim(CODE, "refuted", title, evidence, fix, TRIED, True, cure="camera", camera=camera)


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
    own_images = own_images_claim(
        {one.id: one.title for one in cameras}, {one.id: one.image for one in cameras}
    )
    return [
        _live(cameras),
        *own_images,
        _calibrated(cameras),
        *_wrong_field(cameras),
        _in_place(cameras),
    ]


def _live(cameras: Sequence[SiteCamera]) -> Claim:
    live = [camera for camera in cameras if camera.state == "live"]
    down = [camera for camera in cameras if camera.state in BROKEN]
    title = say(
        "claim.live-cameras", "{live} of {count} cameras live", live=len(live), count=len(cameras)
    )
    if down:
        cases = [
            _case(one, sentence_in(one.problem, "what"), sentence_in(one.problem, "fix"))
            for one in down
            if one.problem is not None
        ]
        return Claim(
            "cameras-live",
            "refuted",
            title,
            _names(down),
            join(*(one.text for one in cases[:1])),
            ("frames",),
            True,
            cure="camera",
            camera=down[0].id,
            cases=tuple(cases),
        )
    if len(live) < len(cameras) or not cameras:
        return Claim(
            "cameras-live",
            "not-tested",
            title,
            say(
                "claim.live-cameras.starting",
                "Not live yet: {cameras}.",
                cameras=_titles([one for one in cameras if one not in live]),
            )
            if cameras
            else "",
        )
    return Claim("cameras-live", "held", title, tried=("frames",))


def _calibrated(cameras: Sequence[SiteCamera]) -> Claim:
    without = [camera for camera in cameras if not camera.active]
    calibrated = len(cameras) - len(without)
    title = say(
        "claim.calibrated",
        "{calibrated} of {count} cameras calibrated",
        calibrated=calibrated,
        count=len(cameras),
    )
    if without or not cameras:
        return Claim(
            "cameras-calibrated",
            "refuted" if cameras else "not-tested",
            title,
            say(
                "claim.calibrated.without",
                "Without an active version: {cameras}.",
                cameras=_titles(without),
            )
            if cameras
            else "",
            tried=("active-versions",) if cameras else (),
            gates=bool(cameras),
            cure="images",
            camera=without[0].id if without else None,
        )
    if poor := [camera for camera in cameras if camera.level == "poor"]:
        named = [
            say(
                "claim.calibrated.camera-mm",
                "{camera} ({mm})",
                camera=one.title,
                mm=format_mm(one.length_mm),
            )
            if one.length_mm is not None
            else one.title
            for one in poor
        ]
        return Claim(
            "cameras-calibrated",
            "refuted",
            say("claim.calibrated.poor", "A calibration is not accurate enough"),
            say("claim.calibrated.poor.text", "Not accurate enough: {cameras}.", cameras=named),
            tried=("own-verdict",),
            gates=True,
            cure="versions",
            camera=poor[0].id,
            cases=tuple(
                _case(
                    one,
                    say("claim.calibrated.poor.case", "Its calibration is not accurate enough."),
                    say("claim.calibrated.poor.fix", "Calibrate it again."),
                )
                for one in poor
            ),
        )
    if unknown := [camera for camera in cameras if camera.level not in ("good", "fair")]:
        return Claim(
            "cameras-calibrated",
            "not-tested",
            title,
            say(
                "claim.calibrated.unknown", "Accuracy unknown: {cameras}.", cameras=_titles(unknown)
            ),
            cure="versions",
            camera=unknown[0].id,
        )
    return Claim("cameras-calibrated", "held", title, tried=("active-versions", "own-verdict"))


def _wrong_field(cameras: Sequence[SiteCamera]) -> Iterator[Claim]:
    for code in ("field", "camera-field", "region"):
        if found := [
            (one, claim) for one in cameras for claim in one.against if claim.code == code
        ]:
            camera, claim = found[0]
            yield Claim(
                f"cameras-{code}",
                "refuted",
                claim.title,
                _names([one for one, _ in found]),
                claim.fix,
                claim.tried,
                True,
                cure=claim.cure,
                camera=camera.id,
                cases=tuple(_case(one, each.evidence, each.fix) for one, each in found),
            )


def _in_place(cameras: Sequence[SiteCamera]) -> Claim:
    """Return whether the cameras stand as they did: only those that are watched can tell."""
    moved = [
        (camera, camera.drift)
        for camera in cameras
        if camera.drift is not None and camera.drift["alarm"]
    ]
    if moved:
        first, drift = moved[0]
        return Claim(
            "cameras-in-place",
            "refuted",
            say(
                "claim.moved", "{count} of {all} cameras moved", count=len(moved), all=len(cameras)
            ),
            join(_names([one for one, _ in moved]), sentence_in(drift, "sentence")),
            sentence_in(drift, "fix"),
            ("field-lines",),
            True,
            cure="drift",
            camera=first.id,
            cases=tuple(
                _case(one, sentence_in(its, "sentence"), sentence_in(its, "fix"))
                for one, its in moved
            ),
        )
    watched = [
        camera for camera in cameras if camera.drift is not None and camera.drift["state"] == STEADY
    ]
    if len(watched) < len(cameras) or not cameras:
        rest = [camera for camera in cameras if camera not in watched]
        why = [sentence_in(one.drift, "sentence") for one in rest if one.drift is not None][:1]
        return Claim(
            "cameras-in-place",
            "not-tested",
            say("claim.not-watched", "Movement cannot be detected"),
            join(
                say("claim.not-watched.text", "Not monitored: {cameras}.", cameras=_titles(rest)),
                *why,
            )
            if cameras
            else "",
            cure="drift" if rest else "",
            camera=rest[0].id if rest else None,
        )
    return Claim(
        "cameras-in-place",
        "held",
        say("claim.none-moved", "No camera has moved"),
        tried=("field-lines",),
    )


def _case(camera: SiteCamera, text: str, fix: str) -> Case:
    return Case(join(f"{camera.title}:", text), fix, camera.id)


def _titles(cameras: Sequence[SiteCamera]) -> list[str]:
    return [camera.title for camera in cameras]


def _names(cameras: Sequence[SiteCamera]) -> Sentence:
    return Sentence(", ".join(_titles(cameras)))
