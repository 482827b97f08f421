"""What is known of a lens without a field: from boards, straight edges, or two cameras that see the same."""

from typing import Any, Literal

from app.api.schemas.responses.base import Answer, Page, Point, Points


class LensInShort(Answer):
    id: str
    created_at: str
    camera: str | None
    note: str
    model: str
    board: dict[str, Any] | None
    image_size: list[int]


class Lens(LensInShort):
    lens: dict[str, Any]
    report: dict[str, Any]
    snapshots: list[str] | None
    software: str


class Lenses(Page):
    items: list[LensInShort]


class Straightness(Answer):
    lens: dict[str, Any]
    sigma: dict[str, float]
    straightness_px: dict[str, float]
    bow: dict[str, Any]
    distortion: Literal["significant", "none", "unknown"]
    sentence: str
    lines: list[dict[str, Any]]
    lines_used: int
    objects: int
    pictures: list[str]
    cannot_see: str


class Pair(Answer):
    fundamental: dict[str, Any] | None
    pose: dict[str, Any] | None
    calibrated: dict[str, Any] | None
    agreement: dict[str, Any] | None
    matches: int
    failed: list[dict[str, Any]]


class PairLines(Answer):
    in_a: list[list[Point | None] | None] | None
    in_b: list[list[Point | None] | None] | None
    place_in_a: Points | None
    place_in_b: Points | None
