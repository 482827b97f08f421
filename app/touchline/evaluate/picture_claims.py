"""Claims that rest on where the field's lines are in a picture: the version's own, and one of its camera now."""

from collections.abc import Mapping
from typing import Any

from touchline.core.sentences import marking_names
from touchline.core.statements import Sentence, join, say, sentence_in
from touchline.evaluate.claims import Claim, mm, state_of_level
from touchline.evaluate.drift.orientation import Orientation, Way
from touchline.evaluate.report_types import Level
from touchline.evaluate.site_claims import EXCHANGE
from touchline.evaluate.verdict import GOOD_MM

OWN, LIVE, ENDS = "lines", "live-image", "ends"
CHECK_AREA = say("claim.lines.elsewhere.fix", "Check the field type and the covered area.")
LIVE_TITLES = {"good": say("claim.live.ok", "Matches the live image"),
               "fair": say("claim.live.fair", "The live image differs slightly"),
               "poor": say("claim.live.poor", "Does not match the live image")}

ENDS_REFUTED: dict[Way, Sentence] = {"turned": say("claim.ends.turned", "The field is turned by 180°"),
                                     "mirrored": say("claim.ends.mirrored", "The field is mirrored")}


def no_picture() -> Claim:
    return Claim(OWN, "not-tested", say("claim.lines.no-image", "No image to check the field lines in"))


def not_live(why: str = "") -> Claim:
    """why: what the camera or the check said."""
    return Claim(LIVE, "not-tested", say("claim.live.none", "Not compared with a live image"),
                 why or say("claim.live.none.text", "The camera delivers no image now."))


def other_size(what: str, fix: str) -> Claim:
    """The camera sends pictures of another size than the version is for."""
    return Claim(LIVE, "refuted", LIVE_TITLES["poor"], what, fix, (LIVE,), True)


def another_cameras(camera: str, title: str) -> Claim:
    """What the camera shows now is the image of another one, of that name."""
    return Claim(LIVE, "refuted", say("claim.live.another", "The live image is another camera's"), say(
        "claim.live.another.text", "It is nearer to the calibration image of {camera} than to its own.", camera=title),
        EXCHANGE, (LIVE, "calibration-images"), True, cure="camera", camera=camera)


def lines_claim(found: Mapping[str, Any]) -> Claim:
    """Return what the check of a version in its own picture says of it. found: as workflows.check returns it."""
    verdict = found["verdict"]
    level, reason = verdict["lines_level"], verdict["reason"]
    length = say("claim.lines.found", "{found} of {count} lines, {share:.0f} % of their length.",
                 found=found["lines_found"], count=len(found["lines"]), share=100 * found["found_share"])
    if level is None:
        return Claim(OWN, "not-tested", say("claim.lines.too-few", "Too few field lines detected to judge"), length)
    state, gates, tried = state_of_level(level), level == "poor", ("own-image",)
    own_fix = sentence_in(verdict, "fix") if reason == "never-right" else ""
    if reason == "elsewhere":
        return Claim(OWN, state, say("claim.lines.elsewhere", "The field lines are elsewhere in the image"), length,
                     CHECK_AREA, tried, gates, cure="points")
    if found["missing"]:
        return Claim(OWN, "refuted", say("claim.lines.missing", "Field lines not detected"), join(length, say(
            "claim.lines.not-detected", "Not detected: {lines}.", lines=marking_names(found["missing"]))),
            own_fix or say("claim.lines.missing.fix", "Add points on these lines, or check the field type."), tried,
            gates, cure="points")
    if level == "good":
        return Claim(OWN, "held", say("claim.lines.ok", "Field lines detected"), length, tried=tried)
    worst = max((line for line in found["lines"] if line["worst_mm"] is not None), key=lambda line: line["worst_mm"],
                default=None)
    farthest = Sentence("") if worst is None else say("claim.lines.largest", "Largest error: {line}.",
                                                      line=marking_names([worst["feature"]])[0])
    title = (say("claim.lines.misplaced", "Field lines are misplaced") if gates else
             say("claim.lines.slightly-misplaced", "Field lines are slightly misplaced"))
    return Claim(OWN, state, title, join(length, farthest), own_fix or say(
        "claim.lines.misplaced.fix", "Add points on this line, or use another lens model."), tried, gates,
        None if worst is None else mm(worst["worst_mm"]), "points")


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
    return Claim(LIVE, state_of_level(level), LIVE_TITLES[level], "" if level == "good" else sentence_in(
        verdict, "sentence"), "" if level == "good" else sentence_in(verdict, "fix"), (LIVE,), level == "poor", shown,
        "images" if level != "good" else "")


def ends_claim(found: Orientation | None, former: int | None) -> Claim:
    """Return whether each goal is at its own end, on a field whose lines look alike from both.

    found: how the field lies in the version's picture against the active version's, of that number; None without one.
    """
    if found is None or former is None or found.state == "unknown":
        return Claim(ENDS, "not-tested", say("claim.ends.unknown", "The ends of the field are not tested"), say(
            "claim.ends.alike", "The lines look the same from both ends."), say(
            "claim.ends.look", "Check in the corrected image that each goal is at its own end."))
    tried = ("active-version", "calibration-images")
    if found.way is None:
        return Claim(ENDS, "held", say("claim.ends.same", "The ends of the field are as in version {former}",
                                       former=former), tried=tried)
    return Claim(ENDS, "refuted", ENDS_REFUTED[found.way], say(
        "claim.ends.against", "What is between and around the lines is on the other side than in version {former}.",
        former=former), say("claim.ends.fix", "Rotate the field by 180°, or flip a mirrored image; unless version "
                            "{former} is wrong.", former=former), tried, True, cure="points")
