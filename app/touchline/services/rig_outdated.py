"""What has become of a rig's newest check: an agreement holds as long as its cameras stand where they stood."""

from collections.abc import Iterator, Mapping
from datetime import datetime, timedelta
from typing import Literal, final

from typing_extensions import TypedDict

from touchline.core.statements import Stated, join, say, sentence_in, stated
from touchline.evaluate.cameras.rig_verdict import RigVerdict
from touchline.live.status_types import CameraStatus

MAX_AGE = timedelta(hours=24)  # a warm hall and a cold one are a day apart
CHECK_AGAIN = say("rig.check-again.fix", "Then check the rig again.")

Reason = Literal["moved", "misplaced", "out-of-focus", "not-monitored", "old"]
VOID: tuple[Reason, ...] = ("moved", "misplaced", "out-of-focus")  # the others only date an agreement
REASONS: dict[str, Reason] = {"knocked": "moved", "replaced": "moved", "misplaced": "misplaced",
                              "out-of-focus": "out-of-focus"}


class OutdatedCheck(Stated):
    """Why a check says less than it did; camera: whose fault that is, null where it is nobody's."""

    camera: str | None
    reason: Reason
    text: str
    fix: str


class NewestCheck(TypedDict):
    """p95_mm: on the carpet or at hat height, whichever is more, of the two cameras that are farthest apart; null where
    none could be compared."""

    at: str
    verdict: RigVerdict
    p95_mm: float | None


@final
class CheckedRig(NewestCheck):
    """A check, and what it says now: the verdict's level is null where a camera has moved since."""

    outdated: list[OutdatedCheck]


def as_of_now(check: NewestCheck, titles: Mapping[str, str], statuses: Mapping[str, CameraStatus],
              now: datetime) -> CheckedRig:
    """Return a check with what outdates it, what makes it void first.

    titles, statuses: of the rig's cameras that have a calibration, by id; now: with a time zone.
    """
    outdated = [*(one for camera, title in titles.items() if (one := _of_camera(camera, title, statuses[camera]))),
                *_of_age(check["at"], now)]
    outdated.sort(key=lambda one: one["reason"] not in VOID)
    void = [one for one in outdated if one["reason"] in VOID]
    verdict = check["verdict"]
    if void and verdict["level"] is not None:
        verdict = stated(RigVerdict(
            level=None, reason="outdated", fix=sentence_in(void[0], "fix"),
            sentence=join(say("rig.void", "The last check is no longer valid."),
                          *(sentence_in(one, "text") for one in void))))
    return {**check, "verdict": verdict, "outdated": outdated}


def _of_camera(camera: str, title: str, status: CameraStatus) -> OutdatedCheck | None:
    drift, named = status["drift"], say("rig.of-camera", "{camera}:", camera=title)
    if drift is None:
        return stated(OutdatedCheck(
            camera=camera, reason="not-monitored", text=say("rig.not-live", "{camera} is not monitored for movement: "
                                                            "it is not live.", camera=title),
            fix=join(say("rig.not-live.fix", "Check its connection."), CHECK_AGAIN)))
    if not drift["alarm"] and drift["monitored"]:
        return None
    reason = REASONS[drift["state"]] if drift["alarm"] else "not-monitored"
    return stated(OutdatedCheck(camera=camera, reason=reason, text=join(named, sentence_in(drift, "sentence")),
                                fix=join(sentence_in(drift, "fix"), CHECK_AGAIN)))


def _of_age(at: str, now: datetime) -> Iterator[OutdatedCheck]:
    age = now - datetime.fromisoformat(at.replace("Z", "+00:00"))
    if age > MAX_AGE:
        yield stated(OutdatedCheck(camera=None, reason="old", text=say(
            "rig.old-check", "The last check is {hours} hours old.", hours=int(age / timedelta(hours=1))),
            fix=say("rig.old-check.fix", "Check the rig again.")))
