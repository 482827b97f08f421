"""What every answer is built of, and the answers about the server itself: health and jobs."""

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

Point = list[float]
Points = list[Point | None]  # null: out of reach


class Answer(BaseModel):
    """Entries may be added, and are never renamed."""

    model_config = ConfigDict(extra="allow")


class Health(Answer):
    status: Literal["ok"]
    version: str
    uptime_s: float
    warnings: list[dict[str, Any]]
    damaged: list[dict[str, Any]]


class Page(Answer):
    """Newest first; next_cursor asks for the ones after, null at the end."""

    next_cursor: str | None


class Job(Answer):
    id: str
    kind: str
    state: Literal["queued", "running", "done", "failed", "cancelled"]
    progress: float
    message: str
    result: Any
    problem: dict[str, Any] | None
    created_at: str
    ended_at: str | None
    attempt: int


class Jobs(Page):
    items: list[Job]
