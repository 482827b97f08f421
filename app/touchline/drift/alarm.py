"""The drift status of a camera that is sampled each second: steady, or an alarm that two samples in a row confirm."""

from dataclasses import dataclass, replace

from touchline.core.drift_status import DriftJson, DriftState
from touchline.core.statements import Sentence, join, say, stated
from touchline.evaluate.field_lines import orientation
from touchline.evaluate.field_lines.motion import MotionSample

ALARMS = ("misplaced", "knocked", "out-of-focus", "replaced")
UNMOVED = ("steady", "misplaced")
PASSING = ("covered", "dark", "replaced")
MONITORED = (*ALARMS, "steady")

BACK_SHARE = 0.7  # of what is a knock: nearer than that, a knocked camera is back
MIN_REWORDED = 0.15  # of the millimetres: a smaller change does not repeat an alarm's sentence
MIN_SAMPLES = 2  # in a row
# for what may pass by itself: people in the way, a lamp that warms up, a hand before the lens
MIN_PASSING_SAMPLES = 4

FIXES: dict[DriftState, str] = {
    "learning": say("drift.learning.fix", "Wait a few seconds."),
    "unfollowed": say(
        "drift.unfollowed.fix", "Calibrate it with an image that shows the field lines."
    ),
    "steady": "",
    "misplaced": say(
        "drift.misplaced.fix",
        "Calibrate it again with a physical lens model, or with points on lines inside the field.",
    ),
    "knocked": say(
        "drift.moved.fix",
        "Move the camera back, or update its pose. The lens calibration remains valid.",
    ),
    "out-of-focus": say(
        "drift.focus.fix",
        "Focus the camera again and lock the ring. If the new focus stays, "
        "calibrate the lens again.",
    ),
    "replaced": say(
        "drift.replaced.fix", "Check its image. Move the camera back, or calibrate it again."
    ),
    "covered": say("drift.covered.fix", "Uncover the lines, or wait until they are visible again."),
    "dark": say("drift.dark.fix", "Switch on the lights, or increase the exposure time."),
}
SENTENCES: dict[DriftState, Sentence] = {
    "learning": say("drift.learning", "Checking the camera position…"),
    "unfollowed": say(
        "drift.unfollowed",
        "Too few field lines are at their calibrated position. Movement of the "
        "camera cannot be detected.",
    ),
    "covered": say(
        "drift.covered",
        "Too many field lines are covered. Movement of the camera cannot be detected.",
    ),
    "dark": say("drift.dark", "The image is too dark. Movement of the camera cannot be detected."),
    "replaced": say(
        "drift.replaced",
        "No field lines were detected near their calibrated position. The camera was "
        "rotated far, or replaced.",
    ),
}


STATES: dict[str, DriftState] = {
    "soft": "out-of-focus",
    "gone": "replaced",
    "covered": "covered",
    "dark": "dark",
    "turned": "replaced",
    "mirrored": "replaced",
}


def state_of(sample: MotionSample, was_knocked: bool = False) -> DriftState:
    """Return the state that one sample alone shows."""
    if sample.kind == "seen":
        return "knocked" if sample.has_moved(BACK_SHARE if was_knocked else 1.0) else "steady"
    return STATES[sample.kind]


@dataclass(frozen=True)
class DriftStatus:
    """The state, since when (unix, s), and the newest sample that showed it.

    worded: the sample that the sentence is about; an alarm's sentence changes only with its figures.
    misplaced: what is wrong with the calibration itself, in a sentence; empty for nothing. doubt: likewise what makes
    it only fair. hidden: why an alarm's camera cannot be seen now, None where it can.
    """

    state: DriftState
    since: float
    sample: MotionSample | None = None
    worded: MotionSample | None = None
    misplaced: str = ""
    doubt: str = ""
    hidden: DriftState | None = None

    def with_sample(self, sample: MotionSample) -> "DriftStatus":
        """Return the same state with a newer sample that shows it."""
        worded = self.worded if self.alarm and self._is_worded_alike(sample) else sample
        return replace(self, hidden=None, sample=sample, worded=worded)

    def _is_worded_alike(self, sample: MotionSample) -> bool:
        before, now = self.worded.moved if self.worded else None, sample.moved
        if self.worded is None or before is None or now is None:
            return before is now
        return (
            abs(now.mm - before.mm) < MIN_REWORDED * before.mm
            and self.worded.softer_px == sample.softer_px
        )

    @property
    def alarm(self) -> bool:
        return self.state in ALARMS

    def outlasts(self, state: DriftState) -> bool:
        """Return whether it is an alarm that a look like that does not disprove.

        A covered camera is one whose scene is recognised: that disproves that it was replaced.
        """
        return self.alarm and (state == "dark" or (state == "covered" and self.state != "replaced"))

    @property
    def sentence(self) -> str:
        own = self.misplaced if self.state == "misplaced" else sentence(self.state, self.worded)
        return own if self.hidden is None else join(own, SENTENCES[self.hidden])

    def to_json(self) -> DriftJson:
        px, mm, sigma_px, sigma_mm = (
            [None] * 4
            if self.sample is None or (moved := self.sample.moved) is None
            else [round(value, 4) for value in (moved.px, moved.mm, moved.sigma_px, moved.sigma_mm)]
        )
        return stated(
            DriftJson(
                state=self.state,
                alarm=self.alarm,
                monitored=self.state in MONITORED and self.hidden is None,
                since=round(self.since, 3),
                px=px,
                mm=mm,
                sigma_px=sigma_px,
                sigma_mm=sigma_mm,
                softer_px=self.sample.softer_px if self.sample else None,
                seen=self.sample.seen if self.sample else 0,
                sentence=self.sentence,
                fix=FIXES[self.state],
                doubt=self.doubt,
            )
        )


class DriftWatch:
    """Turns samples into a status. An alarm, of one kind or another, begins once MIN_SAMPLES in a row gave one."""

    def __init__(self, now: float) -> None:
        self.status = DriftStatus("learning", now)
        # states and times of the last samples, of one kind
        self._alike: list[tuple[DriftState, float]] = []

    @property
    def doubtful(self) -> bool:
        """Whether the last sample differs from the status: then the next should not wait."""
        return bool(self._alike) and self._alike[-1][0] not in (
            self.status.state,
            self.status.hidden,
        )

    def misplaced(self, sentence: str, doubt: str = "") -> None:
        """Note what is wrong with the calibration itself: a camera that stays is then as wrong as one knocked.

        doubt: what makes it only fair, which is no alarm.
        """
        self.status = replace(self.status, misplaced=sentence, doubt=doubt)

    def add(self, sample: MotionSample, now: float) -> DriftStatus:
        """Return the status after a sample of a picture that was taken at now, unix, s."""
        state = state_of(sample, self.status.state == "knocked")
        if state == "steady" and self.status.misplaced:
            state = "misplaced"
        if self._alike and not _same_kind(self._alike[-1][0], state):
            self._alike = []
        self._alike = [*self._alike, (state, now)][-MIN_PASSING_SAMPLES:]
        needed = self._needed_samples(state)
        if state == self.status.state:
            self.status = self.status.with_sample(sample)
        elif len(self._alike) >= needed and self.status.outlasts(state):
            self.status = replace(self.status, hidden=state)
        elif len(self._alike) >= needed:
            self.status = replace(
                self.status,
                state=state,
                since=self._alike[-needed][1],
                sample=sample,
                worded=sample,
                hidden=None,
            )
        return self.status

    def _needed_samples(self, state: DriftState) -> int:
        """Return how many samples in a row make it the status."""
        if state in PASSING:
            return MIN_PASSING_SAMPLES
        return 1 if self.status.state == "learning" and state in UNMOVED else MIN_SAMPLES

    def unfollowed(self, now: float) -> DriftStatus:
        """Set the status of a camera without a usable reference."""
        self._alike = []
        if self.status.state != "unfollowed":
            self.status = DriftStatus("unfollowed", now)
        return self.status


def _same_kind(before: DriftState, state: DriftState) -> bool:
    return before == state or (before in ALARMS and state in ALARMS)


def sentence(state: DriftState, sample: MotionSample | None) -> Sentence:
    """Describe the status for the operator."""
    if (
        state == "replaced"
        and sample is not None
        and (sample.kind == "turned" or sample.kind == "mirrored")
    ):
        return orientation.SENTENCES[sample.kind]
    if state in SENTENCES or sample is None or (moved := sample.moved) is None:
        return SENTENCES.get(state, SENTENCES["learning"])
    if state == "out-of-focus":
        px = _px(abs(sample.softer_px))
        return (
            say("drift.softer", "The focus has changed: the lines are softer by {px} px.", px=px)
            if sample.softer_px > 0
            else say(
                "drift.sharper", "The focus has changed: the lines are sharper by {px} px.", px=px
            )
        )
    if state == "knocked":
        return say(
            "drift.moved",
            "The camera has moved. Positions are off by about {mm} mm ({px} px).",
            mm=_mm(moved.mm),
            px=_px(moved.px),
        )
    return say(
        "drift.steady",
        "No movement detected ({px} px, {mm} mm).",
        px=_px(moved.px),
        mm=_mm(moved.mm),
    )


def _px(px: float) -> str:
    if px < 0.01:
        return say("under", "under {value}", value="0.01")
    return f"{px:.2f}" if px < 1 else f"{px:.1f}" if px < 10 else f"{px:.0f}"


def _mm(mm: float) -> str:
    if mm < 0.1:
        return say("under", "under {value}", value="0.1")
    return f"{mm:.1f}" if mm < 10 else f"{mm:.0f}"
