"""Verifies a camera that was found without clicks: what it expects to see against what the picture shows.

A wrong camera can lie exactly on the lines that led to it. It is wrong elsewhere: whole markings that it
expects in the picture are not there, or long lines on the carpet lie where it has none, or another camera draws the
field just as well.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from typing_extensions import TypedDict

from touchline.core.errors import ProblemJson
from touchline.core.sentences import marking_name
from touchline.core.statements import Sentence, Stated, join, say, stated
from touchline.evaluate.report_types import Verdict

# Tuned on simulated scenes and on true pictures matched with fields that they do not show (see the manual's figures).
MIN_FOUND = 0.68  # of the expected length; a fifth may be hidden
MARKING_FOUND = 0.3  # of a marking: below it, it counts as missing
MAX_MISSING = 0.2  # of the expected length, in markings that are missing
MAX_UNEXPLAINED = 0.13  # of the length that was seen on the field
MIN_AHEAD = 0.05  # of the next best camera's share
# of the diagonal, of the points about the drawn field: 1.5 px of 640 × 480; fields are made by hand
MAX_RMS = 0.002
MIN_MARKINGS = 4
CLEARLY = 0.05  # more of the expected length
MISSING_SHOWN = 4


class ProvenMarking(TypedDict):
    feature: str
    expected_px: float
    found_px: float


class Proof(TypedDict):
    """Shares: of the expected length in the picture; rival: the next best camera's, of this one's."""

    found_share: float
    missing_share: float
    missing: list[str]
    unexplained_share: float
    rms_px: float
    rival: float
    markings: list[ProvenMarking]


@dataclass(frozen=True, eq=False)
class Verification:
    """Lengths in px. found and expected by marking; unexplained: of long lines on the field that lie on no marking.

    rival: how well the next best camera explains the picture, as a share of how well this one does. is_rectangle:
    whether no more than the four sides of one were found.
    """

    names: tuple[str, ...]
    expected_px: NDArray[np.float64]
    found_px: NDArray[np.float64]
    explained_px: float
    unexplained_px: float
    rms_px: float
    rival: float
    diagonal_px: float
    is_rectangle: bool = False

    @property
    def share(self) -> float:
        return float(self.found_px.sum() / max(self.expected_px.sum(), 1e-9))

    @property
    def missing(self) -> tuple[str, ...]:
        """Markings that should be in the picture and are not, the longest first."""
        gone = (self.expected_px > 0) & (self.found_px < MARKING_FOUND * self.expected_px)
        return tuple(self.names[i] for i in np.argsort(-self.expected_px) if gone[i])

    @property
    def missing_share(self) -> float:
        gone = self.found_px < MARKING_FOUND * self.expected_px
        return float(self.expected_px[gone].sum() / max(self.expected_px.sum(), 1e-9))

    @property
    def unexplained_share(self) -> float:
        return self.unexplained_px / max(self.unexplained_px + self.explained_px, 1e-9)

    def is_better_than(self, other: Self | None) -> bool:
        """Whether it is without doubt, and explains the picture clearly better than another camera, if there is one."""
        if other is None:
            return not self.doubts()
        more = self.share - other.share
        return (
            more > CLEARLY or (more > -CLEARLY and self.rms_px < other.rms_px / 2)
        ) and not self.doubts()

    def doubts(self, is_chosen: bool = True) -> tuple[ProblemJson, ...]:
        """Return why it may be wrong; empty where there is no doubt.

        is_chosen: whether somebody chose the field; if not, one rectangle is too little to know it by.
        """
        doubts: list[tuple[str, Sentence, Sentence]] = []
        markings = int(
            (self.found_px >= MARKING_FOUND * self.expected_px)[self.expected_px > 0].sum()
        )
        if self.share < MIN_FOUND or self.missing_share > MAX_MISSING:
            named = [marking_name(name) for name in self.missing[:MISSING_SHOWN]]
            doubts.append(
                (
                    "lines-missing",
                    say(
                        "lines.missing",
                        "Only {share:.0f} % of the expected lines were detected; not detected: {lines}.",
                        share=100 * self.share,
                        lines=named,
                    )
                    if named
                    else say(
                        "lines.few",
                        "Only {share:.0f} % of the expected lines were detected.",
                        share=100 * self.share,
                    ),
                    say(
                        "lines.missing.fix",
                        "Check the field type and the covered area. Uncover the lines, improve the "
                        "lighting, or take several images.",
                    ),
                )
            )
        if self.unexplained_share > MAX_UNEXPLAINED:
            doubts.append(
                (
                    "lines-unexplained",
                    say(
                        "lines.unexplained",
                        "{share:.0f} % of the lines detected on the carpet are not part of the field.",
                        share=100 * self.unexplained_share,
                    ),
                    say("lines.unexplained.fix", "Check the field type and the covered area."),
                )
            )
        if self.rival > 1 - MIN_AHEAD:
            doubts.append(
                (
                    "ambiguous",
                    say("lines.ambiguous", "The image matches the field in two orientations."),
                    say(
                        "lines.ambiguous.fix",
                        "Choose the covered area, or enter its approximate orientation or the camera height.",
                    ),
                )
            )
        if markings < MIN_MARKINGS or (self.is_rectangle and not is_chosen):
            doubts.append(
                (
                    "too-few-lines",
                    say("lines.too-few", "Lines of only {n} markings were detected.", n=markings),
                    say("lines.too-few.fix", "Show more of the field, or mark points."),
                )
            )
        if self.rms_px > MAX_RMS * self.diagonal_px:
            doubts.append(
                (
                    "loose",
                    say(
                        "lines.loose",
                        "The field model is {px:px} px from the detected lines.",
                        px=self.rms_px,
                    ),
                    say(
                        "lines.loose.fix",
                        "Check the field type. If it is correct, try another lens model.",
                    ),
                )
            )
        return tuple(stated(ProblemJson(reason=r, what=w, fix=f)) for r, w, f in doubts)

    def to_json(self) -> Proof:
        return {
            "found_share": self.share,
            "missing_share": self.missing_share,
            "missing": list(self.missing),
            "unexplained_share": self.unexplained_share,
            "rms_px": self.rms_px,
            "rival": self.rival,
            "markings": [
                {"feature": n, "expected_px": float(e), "found_px": float(f)}
                for n, e, f in zip(self.names, self.expected_px, self.found_px, strict=True)
                if e > 0
            ],
        }


class AutomaticVerdict(Stated):
    """level: the calibration's own without doubts, else "unsure" or "nothing"."""

    level: str
    sentence: str
    fix: str
    reason: str


def verdict_of(
    doubts: Sequence[ProblemJson],
    proof: Verification | None,
    calibrated: Verdict | None,
    remark: Sentence | str = "",
) -> AutomaticVerdict:
    """remark: what else was seen, where there is no doubt."""
    if doubts:
        first = doubts[0]
        look = say("lines.check-overlay", "Check the overlay before you continue.") if proof else ""
        return stated(
            AutomaticVerdict(
                level="unsure" if proof else "nothing",
                sentence=join(first["what"], look),
                fix=first["fix"],
                reason=first["reason"],
            )
        )
    level, own = (calibrated["level"], calibrated["sentence"]) if calibrated else ("unknown", "")
    found = (
        say(
            "lines.found",
            "{share:.0f} % of the expected lines were detected, with an average offset of "
            "{px:px} px from the field model.",
            share=100 * proof.share,
            px=proof.rms_px,
        )
        if proof
        else ""
    )
    return stated(
        AutomaticVerdict(level=level, sentence=join(found, remark, own), fix="", reason="found")
    )
