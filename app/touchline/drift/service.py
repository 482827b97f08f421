"""Save a registered pose; and what is claimed of a version by the field's lines.

The lines are looked at in its own image and in its camera's image now; and which end of the field is which.
"""

import asyncio
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

from touchline.core.errors import Conflict, TouchlineError
from touchline.core.field_json import field_from_json
from touchline.core.geometry import ImageSize
from touchline.core.json_values import JsonObject
from touchline.core.records import Calibration, Frame
from touchline.core.sentences import marking_names
from touchline.core.statements import Sentence, join, say, sentence_in
from touchline.drift.check import check
from touchline.evaluate.claims import Claim, mm, state_of_level
from touchline.evaluate.field_lines.orientation import Orientation, OrientationReference, Way
from touchline.evaluate.report_types import Level
from touchline.evaluate.site_claims import EXCHANGE, whose
from touchline.evaluate.verdict import GOOD_MM
from touchline.fitting.field_pattern import is_half_turn_symmetric
from touchline.live.camera import SEEN
from touchline.models import Restored, model_of
from touchline.services.claims import camera_of
from touchline.services.container import IsAbandoned, Services
from touchline.services.live import take_frame
from touchline.services.result_savers import save_draft_of
from touchline.vision.picture_print import PicturePrint

FRAME_S = 4.0  # for a frame of a camera that is live
OWN, LIVE, ENDS = "lines", "live-image", "ends"
CHECK_AREA = say("claim.lines.elsewhere.fix", "Check the field type and the covered area.")
LIVE_TITLES = {
    "good": say("claim.live.ok", "Matches the live image"),
    "fair": say("claim.live.fair", "The live image differs slightly"),
    "poor": say("claim.live.poor", "Does not match the live image"),
}

ENDS_REFUTED: dict[Way, Sentence] = {
    "turned": say("claim.ends.turned", "The field is turned by 180°"),
    "mirrored": say("claim.ends.mirrored", "The field is mirrored"),
}


def save_registered(services: Services, result: JsonObject, about: JsonObject) -> JsonObject:
    """Save the version with the new pose, as the child of the one that it was made from."""
    version = services.store.calibrations.add(Calibration.from_json(result["made"]), about["by"])
    save_draft_of(services.store, version, about["by"])
    return {
        "calibration": version.id,
        "version": version.version,
        "snapshot": version.snapshot,
        **result["told"],
    }


async def line_claims(
    services: Services, calibration: Calibration, is_abandoned: IsAbandoned
) -> list[Claim]:
    """Check the lines in the image that it was made from and in a frame of its camera, taken now; compare the ends."""
    own, live, ends = await asyncio.gather(
        _own_picture(services, calibration, is_abandoned),
        _live_picture(services, calibration, is_abandoned),
        services.run_in_thread(_ends, services, calibration),
    )
    return [*own, *live, *ends]


async def _own_picture(
    services: Services, calibration: Calibration, is_abandoned: IsAbandoned
) -> Sequence[Claim]:
    """Check the field's lines in the picture that it was made from; once, for neither ever changes."""
    key = (OWN, calibration.id)
    if (kept := services.claims_kept.get(key)) is not None:
        return kept
    if calibration.snapshot is None:
        return [no_picture()]
    try:
        frame = await services.run_in_thread(services.frame, calibration.snapshot)
        found = await services.process_picture(
            frame.size, lambda progress: check(calibration, frame.pixels, progress), is_abandoned
        )
    except TouchlineError as error:  # the picture was deleted or is damaged
        return [no_picture(error.what, error.fix)]
    return services.claims_kept.put(key, [lines_claim(found)])


async def _live_picture(
    services: Services, calibration: Calibration, is_abandoned: IsAbandoned
) -> list[Claim]:
    """Look at a frame of its camera now; nothing is claimed of a version that belongs to no camera."""
    if (
        calibration.camera is None
        or await services.run_in_thread(camera_of, services, calibration) is None
    ):
        return []
    camera = services.live.get_running(calibration.camera)
    if camera is None or camera.status()["state"] not in SEEN:
        return [not_live()]
    try:
        taken = await take_frame(camera, FRAME_S)
        frame = await services.run_in_thread(services.decoder.frame_from_bytes, taken.png)
        size = ImageSize(taken.head["width"], taken.head["height"])
        before = await services.run_in_thread(_own_frame, services, calibration)
        found = await services.process_picture(
            size,
            lambda progress: check(
                calibration, frame.pixels, progress, None if before is None else before.pixels
            ),
            is_abandoned,
        )
    except Conflict as error:
        return [other_size(error.what, error.fix)]
    except TouchlineError as error:
        return [not_live(error.what)]
    other = await services.run_in_thread(_whose_picture, services, calibration, frame)
    return [live_claim(found) if other is None else another_cameras(calibration.camera, other)]


def _own_frame(services: Services, calibration: Calibration) -> Frame | None:
    with suppress(TouchlineError):  # deleted, or damaged
        return None if calibration.snapshot is None else services.frame(calibration.snapshot)
    return None


def _whose_picture(services: Services, calibration: Calibration, frame: Frame) -> str | None:
    """Return the name of another camera whose calibration image a picture is nearer to; None for no such."""
    if (now := PicturePrint.of(frame.pixels)) is None:
        return None
    own = services.picture_print(calibration.snapshot)
    for camera in services.cameras.all():
        active = (
            None
            if camera.id == calibration.camera
            else services.store.calibrations.active(camera.id)
        )
        if (
            active is not None
            and active.image_size == frame.size
            and not _is_over_same_area(active, calibration)
        ):
            other = services.picture_print(active.snapshot)
            if other is not None and whose(now, own, other) == "other":
                return camera.title
    return None


def _is_over_same_area(one: Calibration, other: Calibration) -> bool:
    return (one.field["name"], one.region) == (other.field["name"], other.region)


def _ends(services: Services, calibration: Calibration) -> Sequence[Claim]:
    """Compare how the field lies in its picture with the active version's; nothing where its lines tell the ends."""
    if not is_half_turn_symmetric(field_from_json(calibration.field)):
        return []
    active = (
        None
        if calibration.camera is None
        else services.store.calibrations.active(calibration.camera)
    )
    if active is None or active.id == calibration.id or not _is_over_same_area(active, calibration):
        return [ends_claim(None, None)]
    return services.claims_kept.get_or_make(
        (ENDS, active.id, calibration.id), lambda: [_ends_against(services, calibration, active)]
    )


def _ends_against(services: Services, calibration: Calibration, active: Calibration) -> Claim:
    own, former = _own_frame(services, calibration), _own_frame(services, active)
    if own is None or former is None:
        return ends_claim(None, None)
    model, _, region = Restored.of(active)
    found = OrientationReference.of(former.pixels, model, region).compare(
        own.pixels, model_of(calibration)
    )
    return ends_claim(found, active.version)


def no_picture(what: str = "", fix: str = "") -> Claim:
    return Claim(
        OWN,
        "not-tested",
        say("claim.lines.no-image", "No image to check the field lines in"),
        what,
        fix,
    )


def not_live(why: str = "") -> Claim:
    """why: what the camera or the check said."""
    return Claim(
        LIVE,
        "not-tested",
        say("claim.live.none", "Not compared with a live image"),
        why or say("claim.live.none.text", "The camera delivers no image now."),
    )


def other_size(what: str, fix: str) -> Claim:
    """The camera sends pictures of another size than the version is for."""
    return Claim(LIVE, "refuted", LIVE_TITLES["poor"], what, fix, (LIVE,), True)


def another_cameras(camera: str, title: str) -> Claim:
    """What the camera shows now is the image of another one, of that name."""
    return Claim(
        LIVE,
        "refuted",
        say("claim.live.another", "The live image is another camera's"),
        say(
            "claim.live.another.text",
            "It is nearer to the calibration image of {camera} than to its own.",
            camera=title,
        ),
        EXCHANGE,
        (LIVE, "calibration-images"),
        True,
        cure="camera",
        camera=camera,
    )


def lines_claim(found: Mapping[str, Any]) -> Claim:
    """Return what the check of a version in its own picture says of it. found: as drift.check.check() returns it."""
    verdict = found["verdict"]
    level, reason = verdict["lines_level"], verdict["reason"]
    length = say(
        "claim.lines.found",
        "{found} of {count} lines, {share:.0f} % of their length.",
        found=found["lines_found"],
        count=len(found["lines"]),
        share=100 * found["found_share"],
    )
    if level is None:
        return Claim(
            OWN,
            "not-tested",
            say("claim.lines.too-few", "Too few field lines detected to judge"),
            length,
        )
    state, gates, tried = state_of_level(level), level == "poor", ("own-image",)
    own_fix = sentence_in(verdict, "fix") if reason == "never-right" else ""
    if reason == "elsewhere":
        return Claim(
            OWN,
            state,
            say("claim.lines.elsewhere", "The field lines are elsewhere in the image"),
            length,
            CHECK_AREA,
            tried,
            gates,
            cure="points",
        )
    if found["missing"]:
        return Claim(
            OWN,
            "refuted",
            say("claim.lines.missing", "Field lines not detected"),
            join(
                length,
                say(
                    "claim.lines.not-detected",
                    "Not detected: {lines}.",
                    lines=marking_names(found["missing"]),
                ),
            ),
            own_fix
            or say(
                "claim.lines.missing.fix", "Add points on these lines, or check the field type."
            ),
            tried,
            gates,
            cure="points",
        )
    if level == "good":
        return Claim(
            OWN, "held", say("claim.lines.ok", "Field lines detected"), length, tried=tried
        )
    worst = max(
        (line for line in found["lines"] if line["worst_mm"] is not None),
        key=lambda line: line["worst_mm"],
        default=None,
    )
    farthest = (
        Sentence("")
        if worst is None
        else say(
            "claim.lines.largest",
            "Largest error: {line}.",
            line=marking_names([worst["feature"]])[0],
        )
    )
    title = (
        say("claim.lines.misplaced", "Field lines are misplaced")
        if gates
        else say("claim.lines.slightly-misplaced", "Field lines are slightly misplaced")
    )
    return Claim(
        OWN,
        state,
        title,
        join(length, farthest),
        own_fix
        or say("claim.lines.misplaced.fix", "Add points on this line, or use another lens model."),
        tried,
        gates,
        None if worst is None else mm(worst["worst_mm"]),
        "points",
    )


def live_claim(found: Mapping[str, Any]) -> Claim:
    """Return what a frame taken now says of a version."""
    verdict = found["verdict"]
    is_turned = found["orientation"] == "contradicted"
    level: Level | None = "poor" if is_turned else verdict["lines_level"]
    if level is None:
        return not_live(sentence_in(verdict, "sentence"))
    # how far the lines of a turned picture are from others means nothing
    moved = None if is_turned else found["change"]["mm"] if found["change"] else found["p95_mm"]
    shown = mm(moved) if moved is not None and (level != "good" or moved > GOOD_MM) else None
    return Claim(
        LIVE,
        state_of_level(level),
        LIVE_TITLES[level],
        "" if level == "good" else sentence_in(verdict, "sentence"),
        "" if level == "good" else sentence_in(verdict, "fix"),
        (LIVE,),
        level == "poor",
        shown,
        "images" if level != "good" else "",
    )


def ends_claim(found: Orientation | None, former: int | None) -> Claim:
    """Return whether each goal is at its own end, on a field whose lines look alike from both.

    found: how the field lies in the version's picture against the active version's, of that number; None without one.
    """
    if found is None or former is None or found.state == "unknown":
        return Claim(
            ENDS,
            "not-tested",
            say("claim.ends.unknown", "The ends of the field are not tested"),
            say("claim.ends.alike", "Both ends of the field look alike."),
            say(
                "claim.ends.look",
                "Check in the corrected image that the two ends are not swapped.",
            ),
        )
    tried = ("active-version", "calibration-images")
    if found.way is None:
        return Claim(
            ENDS,
            "held",
            say(
                "claim.ends.same", "The ends of the field are as in version {former}", former=former
            ),
            tried=tried,
        )
    return Claim(
        ENDS,
        "refuted",
        ENDS_REFUTED[found.way],
        say(
            "claim.ends.against",
            "What is between and around the lines is on the other side than in version {former}.",
            former=former,
        ),
        say(
            "claim.ends.fix",
            "Rotate the field by 180°, or flip a mirrored image; unless version {former} is wrong.",
            former=former,
        ),
        tried,
        True,
        cure="points",
    )
