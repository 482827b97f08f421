"""A claim: what the program says of a calibration or of a site, and what came of trying to refute it.

A claim is held only where something was tried that would have refuted it. What was not tried, or could not be, is not
tested: it is neither right nor wrong, and nothing that rests on it is ready.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from typing_extensions import TypedDict

from touchline.core.statements import Stated, stated
from touchline.evaluate.fit.report_types import Level

State = Literal["held", "refuted", "not-tested"]
Gate = Literal["ready", "not-tested", "problems"]
Cure = Literal["points", "model", "camera", "versions", "pair", "drift", "images", "rig", "publishing", ""]


class ClaimFigure(TypedDict):
    """A length that a claim is about; at_most: whether it is a bound."""

    value: float
    unit: Literal["mm", "px"]
    at_most: bool


class CaseJson(Stated):
    text: str
    fix: str
    camera: str | None


class ClaimJson(Stated):
    """state: held only if something was tried that would have refuted it; gates: whether activation is refused while
    it is not held, unless `despite` names its code; tried: what was looked at; cure: where its fix is done; cases: what
    refutes it one by one, where each has its own fix."""

    code: str
    state: State
    gates: bool
    title: str
    evidence: str
    fix: str
    tried: list[str]
    figure: ClaimFigure | None
    cure: Cure
    camera: str | None
    cases: list[CaseJson]


@dataclass(frozen=True)
class Case:
    """One of several things that refute a claim. camera: whose it is, None where it is of none."""

    text: str
    fix: str
    camera: str | None = None

    def to_json(self) -> CaseJson:
        return stated(CaseJson(text=self.text, fix=self.fix, camera=self.camera))


@dataclass(frozen=True)
class Claim:
    """One claim. camera: whose it is, where it is not of the calibration itself."""

    code: str
    state: State
    title: str
    evidence: str = ""
    fix: str = ""
    tried: tuple[str, ...] = ()
    gates: bool = False
    figure: ClaimFigure | None = None
    cure: Cure = ""
    camera: str | None = None
    cases: tuple[Case, ...] = ()

    def __post_init__(self) -> None:
        assert self.state != "held" or self.tried, f"{self.code} is held by nothing"

    @property
    def is_problem(self) -> bool:
        """Whether it stands against activation."""
        return self.gates and self.state != "held"

    def to_json(self) -> ClaimJson:
        return stated(ClaimJson(
            code=self.code, state=self.state, gates=self.gates, title=self.title, evidence=self.evidence,
            fix=self.fix, tried=list(self.tried), figure=self.figure, cure=self.cure, camera=self.camera,
            cases=[one.to_json() for one in self.cases]))


def mm(value: float, at_most: bool = False) -> ClaimFigure:
    return {"value": value, "unit": "mm", "at_most": at_most}


def state_of_level(level: Level) -> State:
    """Return held for good, refuted for less: fair is told, poor gates."""
    return "held" if level == "good" else "refuted"


def gate_of(claims: Sequence[Claim]) -> Gate:
    """Return what stands against relying on all of them: problems, something that was not tested, or nothing."""
    if problems(claims):
        return "problems"
    return "not-tested" if any(claim.state == "not-tested" for claim in claims) else "ready"


def problems(claims: Iterable[Claim], despite: Iterable[str] = ()) -> tuple[Claim, ...]:
    """Return the claims that stand against activation, without those that somebody accepts by their code."""
    accepted = set(despite)
    return tuple(claim for claim in claims if claim.is_problem and claim.code not in accepted)
