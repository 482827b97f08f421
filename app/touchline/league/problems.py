"""What an operator should see on every page of a publication: nothing goes out, or two publishers contradict."""

from collections.abc import Iterable, Iterator, Sequence

from touchline.core.errors import TouchlineError
from touchline.core.records import Warning
from touchline.core.statements import Sentence, join, say
from touchline.league.packet import PublishedCamera
from touchline.league.received import RemotePublisher, contradictions, doubled_cameras


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
