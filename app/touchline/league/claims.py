"""What publishing claims: what teams receive of a version, whether they receive anything, and what keeps it back."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from touchline.core.errors import TouchlineError
from touchline.core.records import Warning
from touchline.core.statements import Sentence, join, say, sentence_in
from touchline.evaluate.claims import Case, Claim, mm
from touchline.evaluate.verdict import GOOD_MM
from touchline.league.packet import PublishedCamera
from touchline.league.received import RemotePublisher, contradictions, doubled_cameras


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


def damaged_settings(file: str) -> Warning:
    """Say that a publication's settings cannot be read. file: its name in the data folder."""
    return Warning(
        "publishing-damaged",
        say(
            "publishing.damaged",
            "{file} in the data folder cannot be read. Nothing is published.",
            file=file,
        ),
        say(
            "publishing.restore-settings",
            "Enter the publishing settings again, or correct the file and restart the server.",
        ),
    )


def of_publisher(
    problem: TouchlineError | None,
    cameras: Sequence[PublishedCamera],
    asking_about: Sequence[RemotePublisher],
) -> Iterator[Warning]:
    """Say why nothing goes out, or less than was calibrated. asking_about: for whom it waits for a decision."""
    if problem is not None:
        yield _failing(
            "publishing",
            say("publishing.not-published", "The geometry is not published:"),
            problem,
        )
    yield from _excluded(cameras)
    if asking_about:
        yield Warning(
            "another-publisher",
            say(
                "publishing.another-publisher",
                "The geometry is not published yet: {others} already publishes geometry.",
                others=[one.address for one in asking_about],
            ),
            say("publishing.decide", "Decide on the page Publishing whether both publish."),
        )


def of_senders(
    senders: Sequence[RemotePublisher], on_air: Sequence[PublishedCamera], now_s: float
) -> Iterator[Warning]:
    """Say which cameras are published twice with different calibrations. on_air: ours; now_s: time.monotonic()."""
    for number, a, b in doubled_cameras(senders, now_s):
        yield Warning(
            "two-publishers",
            say(
                "receiving.doubled-camera",
                "{a} and {b} both publish camera {number}, with different calibrations.",
                a=a.address,
                b=b.address,
                number=number,
            ),
            say(
                "receiving.stop-one-of-them",
                "Only one program may publish a camera: stop one of them.",
            ),
        )
    for other, one in contradictions(senders, on_air, now_s):
        yield Warning(
            "two-publishers",
            say(
                "receiving.two-publishers",
                "{address} also publishes camera {number}, which is {camera}, with another calibration.",
                address=other.address,
                number=one.number,
                camera=one.name,
            ),
            say(
                "receiving.stop-one",
                "Only one program may publish: stop one of them, or import the other calibration.",
            ),
        )


def of_listener(problem: TouchlineError) -> Warning:
    """Say that no geometry is received."""
    return _failing(
        "absorbing", say("receiving.no-geometry-received", "No geometry is received:"), problem
    )


def _failing(reason: str, what: Sentence, problem: TouchlineError) -> Warning:
    return Warning(reason, join(what, problem.what), problem.fix)


def _excluded(cameras: Iterable[PublishedCamera]) -> Iterator[Warning]:
    """Say which cameras teams do not receive, and why: the page of publishing is seldom open."""
    for one in cameras:
        if one.problem is not None:
            yield Warning(
                "camera-not-published",
                join(
                    say(
                        "publishing.camera-left-out", "{camera} is not published:", camera=one.name
                    ),
                    one.problem.what,
                ),
                one.problem.fix,
            )
