"""What publishing claims: what teams receive of a version, and whether they receive anything."""

from collections.abc import Mapping, Sequence
from typing import Any

from touchline.core.records import Warning
from touchline.core.statements import Sentence, join, say, sentence_in
from touchline.evaluate.claims import Case, Claim, mm
from touchline.evaluate.verdict import GOOD_MM


def packet_claim(found: Mapping[str, Any], own_mm: float | None = None) -> Claim:
    """Return what teams receive.

    found: as GET /calibrations/{id}/packet answers. own_mm: the error inside the field by the version's verdict.
    """
    title, problem = say("claim.packet", "Error as received by teams"), found["problem"]
    if problem is not None:
        return Claim(
            "packet",
            "refuted",
            say("claim.packet.none", "Cannot be published as it is"),
            sentence_in(problem, "what"),
            sentence_in(problem, "fix"),
            ("packet",),
        )
    expected, loss = found["expected"], found["loss"]
    notes = [
        sentence_in(one, "text") for one in found["warnings"] if one["reason"] != "packet-error"
    ]
    asked = (
        say("claim.packet.asked", "You are asked before it is published.")
        if found["asked"]
        else Sentence("")
    )
    if expected is None:
        return Claim(
            "packet",
            "not-tested",
            title,
            join(
                say(
                    "claim.packet.unknown",
                    "From the calibration, at most. Its own error is unknown.",
                ),
                asked,
                *notes,
            ),
            figure=mm(loss["worst_mm"], at_most=True),
        )
    more = (
        say(
            "claim.packet.points-only",
            "By the uncertainty of the points alone; the version itself is off by {mm:mm} mm.",
            mm=own_mm,
        )
        if own_mm is not None and own_mm > max(expected["rms"], GOOD_MM)
        else Sentence("")
    )
    return Claim(
        "packet",
        "held" if found["level"] == "good" and not notes else "refuted",
        title,
        join(asked, more, _tops(expected.get("hat")), *notes),
        tried=("packet-decoded",),
        figure=mm(expected["rms"]),
    )


def publishing_claim(
    state: str, warnings: Sequence[Warning], rig: str = "", title: str = ""
) -> Claim:
    """Return whether teams receive anything. state: "on-air" only where packets go out; warnings: what keeps teams from
    what was calibrated; rig, title: whose cameras, where a rig is published separately."""
    code, tried = f"publishing-{rig}" if rig else "publishing", ("sent-packets",)
    what = (
        say("claim.publishing.geometry-of-rig", "SSL-Vision geometry of {rig}", rig=title)
        if rig
        else say("claim.publishing.geometry", "SSL-Vision geometry")
    )
    if warnings:
        first = warnings[0]
        title = (
            say("claim.publishing.failing", "Not publishing")
            if state in ("failing", "asking")
            else say("claim.publishing.problems", "Publishing has problems")
        )
        return Claim(
            code,
            "refuted",
            title,
            first.text,
            first.fix,
            tried,
            True,
            cure="publishing",
            cases=tuple(Case(one.text, one.fix) for one in warnings),
        )
    if state == "on-air":
        return Claim(
            code,
            "held",
            say("claim.publishing.on-air", "Publishing"),
            what,
            tried=tried,
            cure="publishing",
        )
    return Claim(
        code,
        "refuted",
        say("claim.publishing.off", "Not publishing"),
        what,
        tried=tried,
        cure="publishing",
    )


def _tops(hat: Mapping[str, Any] | None) -> Sentence:
    if hat is None:
        return Sentence("")
    if hat.get("known") is False:
        return say(
            "claim.packet.tops-unknown",
            "The error at robot tops is unknown, because the camera height is unknown.",
        )
    return say(
        "claim.packet.tops",
        "Robot tops ({height:.0f} mm): {error:mm} mm.",
        height=hat["z_mm"],
        error=hat["rms"],
    )
