"""A request about straight edges, from pictures or from lines clicked in them."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

from touchline.core.common_sentences import ONE_CAMERA, image_name, previous_images_differ
from touchline.core.errors import BadInput, Conflict
from touchline.core.geometry import ImageSize
from touchline.core.progress import Progress, no_progress
from touchline.core.statements import say
from touchline.core.text_format import sentence
from touchline.vision.lines.edges import edge_chains
from touchline.workflows import straight_lines
from touchline.workflows.job_pictures import Pictures, job_pictures


@dataclass(frozen=True, eq=False)
class StraightLinesRequest:
    """The lens to fit. lines: clicked points [[x, y], …] px of one straight edge each, in the first picture.

    image_size: needed where there are only lines.
    """

    lens: str = "auto"
    centre_sigma_px: float | None = None
    lines: tuple[Any, ...] = ()
    image_size: ImageSize | None = None

    def __post_init__(self) -> None:
        straight_lines.check_choice(self.lens, self.centre_sigma_px)

    def answer(self, pictures: Pictures = (), progress: Progress = no_progress) -> dict[str, Any]:
        """Return the report, with the pictures' names. One picture is in memory at a time."""
        count = len(pictures)
        self.check_given(count)
        size, edges = self.image_size, []
        names: dict[str, str] = {}
        for number, (name, read) in enumerate(pictures):
            progress(straight_lines.LOOKING * number / count,
                     say("progress.edges", "Detecting edges in {image} ({number} of {count})",
                         image=image_name(name), number=number + 1, count=count))
            frame = read()
            size = size or frame.size
            if frame.size != size:
                raise Conflict(previous_images_differ(name, frame.size, size), ONE_CAMERA,
                               reason="size-mismatch")
            if frame.sha256 in names:  # counted twice, its edges would pass for twice as many things
                raise BadInput(say("straight.same-image", "{image} is the same image as {other}.",
                                   image=image_name(sentence(name)), other=image_name(names[frame.sha256])),
                               say("straight.remove-one", "Remove one of them."), reason="same-picture")
            names[frame.sha256] = name
            edges.append(edge_chains(frame.pixels))
        assert size is not None  # of the first picture, or given: check_given
        found = straight_lines.straightness(edges, self.lines, size, lens=self.lens,
                                            centre_sigma_px=self.centre_sigma_px, progress=progress)
        return {**found, "pictures": list(names.values())}

    def check_given(self, count: int) -> None:
        """Refuse a request without pictures and lines. count: of pictures."""
        if not count and not self.lines:
            raise BadInput(say("straight.nothing-given", "There are no images and no lines."),
                           say("straight.send-images", "Send images from one camera, or lines and their image size."),
                           reason="nothing-given")
        if not count and self.image_size is None:
            raise BadInput(say("straight.no-image-size", "The image size is missing."),
                           'Send "image_size": [width, height], or the image.', reason="no-image-size")

    def to_json(self) -> dict[str, Any]:
        return {"lens": self.lens, "centre_sigma_px": self.centre_sigma_px, "lines": list(self.lines),
                "image_size": list(self.image_size) if self.image_size else None}

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> Self:
        size = None if value["image_size"] is None else ImageSize.of(value["image_size"])
        return cls(value["lens"], value["centre_sigma_px"], tuple(value["lines"]), size)


def run_straightness(spec: Any, progress: Progress) -> dict[str, Any]:
    """A job: {"task", "pictures": [{"name", "path", "sha256"}, …]}; untrusted, decoded in a child."""
    with job_pictures(spec["pictures"]) as pictures:
        return StraightLinesRequest.from_json(spec["task"]).answer(pictures, progress)
