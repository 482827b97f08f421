"""What a viewer watches: a view at a size and a quality. Equal streams are encoded once for all who watch."""

from dataclasses import dataclass
from typing import Self

from touchline.core.errors import BadInput
from touchline.vision.stages import STAGES

VIEWS = ("raw", "corrected", "side")
DETECTIONS, STAGE = "detections", "stage-"  # raw with marks; what one detection stage made of it
STEP_PX = 160  # widths are rounded up to its multiples, qualities to tens: viewers who differ little share an encoding
MAX_WIDTH = 3840


@dataclass(frozen=True)
class StreamSpec:
    """view: raw, corrected, both side by side, "detections" or "stage-NAME". width: of the whole picture, px; 0 for
    what the source gives.
    """

    view: str = "raw"
    width: int = 0
    quality: int = 80

    @classmethod
    def requested(cls, view: str = "raw", width: int = 0, quality: int = 80) -> Self:
        """Return the stream that serves such a request; BadInput for one that none can."""
        if not (view in (*VIEWS, DETECTIONS) or (view.startswith(STAGE) and view.removeprefix(STAGE) in list(STAGES))):
            raise BadInput(f"There is no view called {view[:40]!r}.", f"Use one of: {', '.join(VIEWS)}, {DETECTIONS}, "
                           "or stage- and the name of a stage, as stage-colours.", reason="unknown-view")
        if not (width == 0 or 16 <= width <= MAX_WIDTH):
            raise BadInput(f"A width of {width} px cannot be streamed.",
                           f"Use 16 to {MAX_WIDTH}, or 0 for the camera's own.", reason="bad-width")
        if not 10 <= quality <= 100:
            raise BadInput(f"A quality of {quality} cannot be streamed.", "Use 10 to 100.", reason="bad-quality")
        return cls(view, -(-width // STEP_PX) * STEP_PX if width > STEP_PX else width and STEP_PX,
                   min(95, -(-quality // 10) * 10))

    @property
    def is_detection(self) -> bool:
        """Whether the detector draws it, not the encoder."""
        return self.view not in VIEWS

    @property
    def stage(self) -> str | None:
        """The stage whose picture it is."""
        return self.view.removeprefix(STAGE) if self.view.startswith(STAGE) else None
