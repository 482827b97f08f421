"""Whether each camera shows its own image: no stream under two cameras, no two cables exchanged.

On a symmetric rig each half looks calibrated then. What tells is what is not symmetric: cameras/picture_print.py.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

from touchline.core.geometry import ImageSize
from touchline.core.statements import Sentence, say
from touchline.evaluate.claims.claim import Claim
from touchline.vision.picture_print import PicturePrint, likeness, nearer

SAME, DIFFERENT = 0.8, 0.65  # likeness of one stream, sent in two ways, 0.65 to 0.99; of cameras of a rig up to 0.7
SURE = 0.3  # nearer one of two: robots and people in a quarter gave 0.38
CODE = "cameras-own-images"
TRIED = ("addresses", "live-images", "calibration-images")
EXCHANGE = say("claim.images.exchanged.fix", "Exchange the cables or the addresses of the two cameras.")

Shown = Literal["own", "other", "unknown"]
Found = Literal["apart", "unknown", "address", "image", "first", "second"]  # the last two: it shows the other's


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
    return "apart" if shown == ("own", "own") or ("own" in shown and like < DIFFERENT) else "unknown"


def _is_same(one: PicturePrint | None, other: PicturePrint | None) -> bool:
    return one is not None and other is not None and likeness(one, other) >= SAME


def _shown(now: PicturePrint, own: PicturePrint | None, other: PicturePrint | None) -> Shown:
    if other is not None:
        return whose(now, own, other)
    return "own" if _is_same(now, own) else "unknown"


def own_images_claim(titles: Mapping[str, str], images: Mapping[str, CameraImage]) -> Iterator[Claim]:
    """Yield what is claimed of several cameras, by id; nothing where there are fewer than two."""
    pairs = [(a, b, compare(images[a], images[b])) for a, b in combinations(images, 2)]
    if not pairs:
        return
    for a, b, found in pairs:
        named = {"a": titles[a], "b": titles[b]}
        if found in ("first", "second"):
            a, b = (a, b) if found == "first" else (b, a)
            yield _refuted(say("claim.images.exchanged", "The images of two cameras are exchanged"), shows(
                titles[a], titles[b]), EXCHANGE, a)
        elif found == "address":
            yield _refuted(say("claim.images.address", "Two cameras have the same address"), say(
                "claim.images.two", "{a} and {b}.", **named), say(
                "claim.images.address.fix", "Enter the second camera's own address."), b)
        elif found == "image":
            yield _refuted(say("claim.images.same", "Two cameras show the same image"), say(
                "claim.images.two", "{a} and {b}.", **named), say(
                "claim.images.same.fix", "Check both addresses and cables: one camera is shown twice."), b)
        else:
            continue
        return
    without = [titles[id] for id, image in images.items() if image.now is None]
    untold = [(titles[a], titles[b]) for a, b, found in pairs if found == "unknown"]
    if without:
        yield Claim(CODE, "not-tested", say("claim.images.not-compared", "Images of cameras not compared"), say(
            "claim.images.without", "No image, or nothing visible in it: {cameras}.", cameras=without))
    elif untold:
        yield Claim(CODE, "not-tested", say("claim.images.untold", "Images of cameras look alike"), say(
            "claim.images.two", "{a} and {b}.", a=untold[0][0], b=untold[0][1]), say(
            "claim.images.untold.fix", "Cover one lens after the other, and check which image becomes dark."))
    else:
        yield Claim(CODE, "held", say("claim.images.own", "Each camera shows its own image"), tried=TRIED)


def shows(a: str, b: str) -> Sentence:
    return say("claim.images.shows", "{a} shows the image of {b}.", a=a, b=b)


def _refuted(title: Sentence, evidence: Sentence, fix: Sentence, camera: str) -> Claim:
    return Claim(CODE, "refuted", title, evidence, fix, TRIED, True, cure="camera", camera=camera)
