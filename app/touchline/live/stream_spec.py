"""What a viewer watches: a view at a size and a quality. Equal streams are encoded once for all who watch."""

from dataclasses import dataclass
from typing import Self

from touchline.core.errors import BadInput

VIEWS = ("raw", "corrected", "side")
STEP_PX = 160  # widths are rounded up to its multiples, qualities to tens: viewers who differ little share an encoding
MAX_WIDTH = 3840


@dataclass(frozen=True)
class StreamSpec:
    """view: raw, corrected, both side by side, or one that a part of the camera's process draws. width: of the whole
    picture, px; 0 for what the source gives.
    """

    view: str = "raw"
    width: int = 0
    quality: int = 80

    @classmethod
    def requested(cls, view: str = "raw", width: int = 0, quality: int = 80) -> Self:
        """Return the stream that serves such a request; BadInput for a size or quality that none can have."""
        if not (width == 0 or 16 <= width <= MAX_WIDTH):
            raise BadInput(f"A width of {width} px cannot be streamed.",
                           f"Use 16 to {MAX_WIDTH}, or 0 for the camera's own.", reason="bad-width")
        if not 10 <= quality <= 100:
            raise BadInput(f"A quality of {quality} cannot be streamed.", "Use 10 to 100.", reason="bad-quality")
        return cls(view, -(-width // STEP_PX) * STEP_PX if width > STEP_PX else width and STEP_PX,
                   min(95, -(-quality // 10) * 10))

    @property
    def is_of_part(self) -> bool:
        """Whether a part of the camera's process draws it, not the encoder."""
        return self.view not in VIEWS
