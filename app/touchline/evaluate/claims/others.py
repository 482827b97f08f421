"""Claims that compare a version with others: the active one, and what teams receive of it."""

from collections.abc import Mapping, Sequence
from typing import Any

from touchline.core.records import Warning
from touchline.core.statements import Sentence, join, say, sentence_in
from touchline.evaluate.claims.claim import Case, Claim, ClaimFigure, mm

LENS_SAME_PX = 2.0  # two fits of one lens to other points differ by about a pixel near the image's corners
MIN_LENS_PX, MIN_LENS_SHARE = 0.1, 0.01  # no figure is better than that
SAME_MM = 1.0  # less than what two calibrations from two images of one camera differ by


def difference_claims(found: Mapping[str, Any], former: int) -> list[Claim]:
    """Return how a version differs from the active one. found: a Difference; former: the active one's number."""
    claims, lens = [], found["lens"]
    if lens is not None:
        share = max(MIN_LENS_SHARE, abs(100 * (lens["focal_ratio"] - 1)))
        text = say("claim.lens.focal-length", "Focal length within {share:.2f} %.", share=share)
        if lens["max_px"] is None:
            claims.append(Claim("lens", "not-tested", say("claim.lens", "Lens not compared"), text))
        else:
            is_same = lens["max_px"] <= LENS_SAME_PX
            shown: ClaimFigure = {"value": max(MIN_LENS_PX, lens["max_px"]), "unit": "px", "at_most": False}
            claims.append(Claim("lens", "held" if is_same else "refuted", say(
                "claim.lens.same", "Lens unchanged since version {former}", former=former) if is_same else say(
                "claim.lens.differs", "Lens differs from version {former}", former=former), text,
                tried=("active-version",), figure=shown))
    median, largest = found["median_mm"], found["max_mm"]
    if median is None or largest is None:
        claims.append(Claim("difference", "not-tested", say(
            "claim.difference", "Not compared with version {former}", former=former), say(
            "claim.difference.nothing-common", "The covered areas do not overlap.")))
        return claims
    is_same = largest <= SAME_MM
    claims.append(Claim("difference", "held" if is_same else "refuted", say(
        "claim.difference.same", "Same positions as version {former}", former=former) if is_same else say(
        "claim.difference.differs", "Differs from version {former}", former=former), say(
        "claim.difference.worst", "Median difference. Largest: {mm:.1f} mm.", mm=largest), tried=("active-version",),
        figure=mm(median)))
    return claims


def packet_claim(found: Mapping[str, Any]) -> Claim:
    """Return what teams receive. found: as GET /calibrations/{id}/packet answers."""
    title, problem = say("claim.packet", "Received by teams"), found["problem"]
    if problem is not None:
        return Claim("packet", "refuted", say("claim.packet.none", "Cannot be published as it is"),
                     sentence_in(problem, "what"), sentence_in(problem, "fix"), ("packet",))
    expected, loss = found["expected"], found["loss"]
    told = [sentence_in(one, "text") for one in found["warnings"] if one["reason"] != "packet-error"]
    asked = say("claim.packet.asked", "You are asked before it is published.") if found["asked"] else Sentence("")
    if expected is None:
        return Claim("packet", "not-tested", title, join(say(
            "claim.packet.unknown", "From the calibration, at most. Its own error is unknown."), asked, *told),
            figure=mm(loss["worst_mm"], at_most=True))
    return Claim("packet", "held" if found["level"] == "good" and not told else "refuted", title,
                 join(asked, _tops(expected.get("hat")), *told), tried=("packet-decoded",), figure=mm(expected["rms"]))


def _tops(hat: Mapping[str, Any] | None) -> Sentence:
    if hat is None:
        return Sentence("")
    if hat.get("known") is False:
        return say("claim.packet.tops-unknown", "The error at robot tops is unknown, because the camera height is "
                   "unknown.")
    return say("claim.packet.tops", "Robot tops ({height:.0f} mm): {error:.1f} mm.", height=hat["z_mm"],
               error=hat["rms"])


def publishing_claim(state: str, warnings: Sequence[Warning]) -> Claim:
    """Return whether teams receive anything. state: "on-air" only where packets go out; warnings: what keeps teams from
    what was calibrated."""
    what, tried = say("claim.publishing.geometry", "SSL-Vision geometry"), ("sent-packets",)
    if warnings:
        first = warnings[0]
        title = (say("claim.publishing.failing", "Not publishing") if state == "failing" else
                 say("claim.publishing.problems", "Publishing has problems"))
        return Claim("publishing", "refuted", title, first.text, first.fix, tried, True, cure="publishing",
                     cases=tuple(Case(one.text, one.fix) for one in warnings))
    if state == "on-air":
        return Claim("publishing", "held", say("claim.publishing.on-air", "Publishing"), what, tried=tried,
                     cure="publishing")
    return Claim("publishing", "refuted", say("claim.publishing.off", "Not publishing"), what, tried=tried,
                 cure="publishing")
