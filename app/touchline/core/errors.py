"""Everything that can go wrong, as a tree; each error ends with what to do.

TouchlineError                what happened, and how to cure it
├── BadInput                  what the caller sent cannot be used            (422)
│   ├── FitFailed             the points do not determine a model            (422)
│   └── BadImage              the bytes are no picture that we would decode  (422)
│       └── ImageTooLarge     more bytes or pixels than we would decode      (413)
├── NotFound                  a name or id that is not known                 (404)
├── Conflict                  it exists, but not in the state that is wanted (409)
├── Stale                     changed by another meanwhile                   (412)
├── Cancelled                 the caller asked to stop                       (409)
├── Busy                      more requests at once than can be served         (429)
└── Unavailable               a part that we need is down or busy            (503)
    └── DiskFull              nothing more can be saved                      (507)
"""

from typing import ClassVar

from touchline.core.statements import Stated, stated


class ProblemJson(Stated):
    """A refusal as reports and answers carry it."""

    reason: str
    what: str
    fix: str


class TouchlineError(Exception):
    """What happened, in one sentence, and what to do about it.

    reason: a short kebab-case name that scripts can test, such as "too-few-points". It is the
    last part of a problem's type and never changes once published.
    """

    status: ClassVar[int] = 422
    reason: str = "problem"  # of the class, unless one is given

    def __init__(
        self, what: str, fix: str, *, reason: str | None = None, **details: object
    ) -> None:
        super().__init__(what)
        self.what = what
        self.fix = fix
        self.reason = reason or type(self).reason
        self.details = details

    def __str__(self) -> str:
        return f"{self.what} {self.fix}"

    def to_json(self) -> ProblemJson:
        return stated(ProblemJson(reason=self.reason, what=self.what, fix=self.fix))

    @property
    def title(self) -> str:
        """The reason in words: "too-few-points" reads "Too few points"."""
        return self.reason.replace("-", " ").capitalize()


class BadInput(TouchlineError):
    reason = "bad-input"


class FitFailed(BadInput):
    reason = "fit-failed"


class BadImage(BadInput):
    reason = "bad-image"


class ImageTooLarge(BadImage):
    status = 413
    reason = "image-too-large"


class NotFound(TouchlineError):
    status = 404
    reason = "not-found"


class Conflict(TouchlineError):
    status = 409
    reason = "conflict"


class Stale(TouchlineError):
    status = 412
    reason = "stale"


class Cancelled(TouchlineError):
    status = 409
    reason = "cancelled"


class Busy(TouchlineError):
    status = 429
    reason = "busy"


class Unavailable(TouchlineError):
    status = 503
    reason = "unavailable"


class DiskFull(Unavailable):
    status = 507
    reason = "disk-full"
