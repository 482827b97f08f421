"""From images, or lines clicked in them, to how straight they show straight edges, and the lens that undoes the bend.

    report = straightness([edge_chains(frame.pixels), …], (), size)    edges of images
    report = straightness((), [[[x, y], …], …], size)                  each a clicked line
    pixels = undistort(frame.pixels, lens)                             the image without the bend

A barrel lens, undone, sends the picture's edges outwards. The drawing is scaled so that the middle of each of the
four edges is still in it; corners stick out.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from touchline.core.errors import BadInput, Conflict, FitFailed
from touchline.core.geometry import ImageSize, Points, as_points
from touchline.core.jobs import Progress, no_progress
from touchline.core.json_values import JsonObject, nullable, nullable_points
from touchline.core.sentences import ONE_CAMERA, PROGRESS_DONE, image_name, previous_images_differ
from touchline.core.statements import Sentence, format_with_sigma, say, sentence, stated
from touchline.imaging.correction import CorrectedView, correction_map
from touchline.models.contract import Rectification
from touchline.models.distortion import LINE_LENSES, Distortion
from touchline.models.intrinsics import Intrinsics
from touchline.straight.bow import (
    CommonBow,
    LineSag,
    SagVerdict,
    both_sides_seen,
    common_bow,
    sag_verdict,
)
from touchline.straight.fit import PlumbLineFit, fit_plumb_lines
from touchline.straight.search import PlumbLineProblem
from touchline.vision.edges import edge_chains
from touchline.workflows.job_pictures import Pictures, job_pictures

SQUARES = 8  # of the grid over the width of an image that no lens bends
GRID_LINES = 30  # on each side of the axis: what is farther away is crowded anyway
GRID_BGR, PAPER_BGR = (90, 70, 50), (248, 248, 248)
MIN_SCALE = 1 / 3  # a lens that sends its edges further is drawn without them

LADDER = ("division", "division-even")  # what "auto" tries, simplest first
MAX_MISFIT_RATIO = 0.95  # of the simpler lens' misfit: more is no reason for another term
EDGES_SHARE = 0.5  # of the work: edges take about as long as the lens
MAX_DRAWN = 40_000  # points of all chains together that the report repeats, for drawing
MAX_DRAWN_OF_ONE = 33
SIDES = (
    say("straight.side.left", "left"),
    say("straight.side.right", "right"),
    say("straight.side.top", "top"),
    say("straight.side.bottom", "bottom"),
)


@dataclass(frozen=True)
class UndistortedView(Rectification):
    """The rectification that draws it."""

    lens: Distortion | Intrinsics

    @property
    def corrected_size(self) -> ImageSize:
        return self.lens.image_size

    @cached_property
    def scale(self) -> float:
        """Drawn pixels for one straight pixel: 1 at most from a pincushion, less from a barrel."""
        (width, height), (x, y) = self.lens.image_size, self.lens.image_size.centre
        raw = np.array([[0, y], [width - 1, y], [x, 0], [x, height - 1]], float)
        away = np.abs(self.lens.undistorted_from_raw(raw) - (x, y)).max(axis=1) / np.array(
            [x, x, y, y]
        )
        reached = away[np.isfinite(away) & (away > 0)]
        return float(np.clip(1 / reached.max(), MIN_SCALE, 1 / MIN_SCALE)) if reached.size else 1.0

    def corrected_from_raw(self, raw: Points) -> Points:
        """(..., 2) px; NaN beyond the lens' horizon."""
        return (self.lens.undistorted_from_raw(raw) - self._middle) * self.scale + self._middle

    def raw_from_corrected(self, corrected: Points) -> Points:
        return self.lens.raw_from_undistorted(
            (corrected - self._middle) / self.scale + self._middle
        )

    @property
    def _middle(self) -> Points:
        return np.array(self.lens.image_size.centre)


@dataclass(frozen=True, eq=False)
class StraightLinesRequest:
    """The lens to fit. lines: clicked points [[x, y], …] px of one straight edge each, in the first image.

    image_size: needed where there are only lines.
    """

    lens: str = "auto"
    centre_sigma_px: float | None = None
    lines: tuple[Any, ...] = ()
    image_size: ImageSize | None = None

    def __post_init__(self) -> None:
        check_choice(self.lens, self.centre_sigma_px)

    def answer(self, pictures: Pictures = (), progress: Progress = no_progress) -> JsonObject:
        """Return the report, with the images' names. One image is in memory at a time."""
        count = len(pictures)
        self.check_given(count)
        size, edges = self.image_size, []
        names: dict[str, str] = {}
        for number, (name, read) in enumerate(pictures):
            progress(
                EDGES_SHARE * number / count,
                say(
                    "progress.edges",
                    "Detecting edges in {image} ({number} of {count})",
                    image=image_name(name),
                    number=number + 1,
                    count=count,
                ),
            )
            frame = read()
            size = size or frame.size
            if frame.size != size:
                raise Conflict(
                    previous_images_differ(name, frame.size, size),
                    ONE_CAMERA,
                    reason="size-mismatch",
                )
            # counted twice, its edges would pass for twice as many things
            if frame.sha256 in names:
                raise BadInput(
                    say(
                        "straight.same-image",
                        "{image} is the same image as {other}.",
                        image=image_name(sentence(name)),
                        other=image_name(names[frame.sha256]),
                    ),
                    say("straight.remove-one", "Remove one of them."),
                    reason="same-picture",
                )
            names[frame.sha256] = name
            edges.append(edge_chains(frame.pixels))
        assert size is not None  # of the first image, or given: check_given
        report = straightness(
            edges,
            self.lines,
            size,
            lens=self.lens,
            centre_sigma_px=self.centre_sigma_px,
            progress=progress,
        )
        return {**report, "pictures": list(names.values())}

    def check_given(self, count: int) -> None:
        """Refuse a request without images and lines. count: of images."""
        if not count and not self.lines:
            raise BadInput(
                say("straight.nothing-given", "There are no images and no lines."),
                say(
                    "straight.send-images",
                    "Send images from one camera, or lines and their image size.",
                ),
                reason="nothing-given",
            )
        if not count and self.image_size is None:
            raise BadInput(
                say("straight.no-image-size", "The image size is missing."),
                'Send "image_size": [width, height], or the image.',
                reason="no-image-size",
            )

    def to_json(self) -> JsonObject:
        """Return what a job takes as "task"."""
        return {
            "lens": self.lens,
            "centre_sigma_px": self.centre_sigma_px,
            "lines": list(self.lines),
            "image_size": list(self.image_size) if self.image_size else None,
        }

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> Self:
        """Read what to_json returned."""
        size = None if value["image_size"] is None else ImageSize.of(value["image_size"])
        return cls(value["lens"], value["centre_sigma_px"], tuple(value["lines"]), size)


def run_straightness(spec: Any, progress: Progress) -> JsonObject:
    """A job: {"task", "pictures": [{"name", "path", "sha256"}, …]}; untrusted, decoded in a child."""
    with job_pictures(spec["pictures"]) as pictures:
        return StraightLinesRequest.from_json(spec["task"]).answer(pictures, progress)


def check_choice(lens: str, centre_sigma_px: float | None) -> None:
    """Refuse an impossible lens or σ before edges are looked for."""
    PlumbLineProblem.of(
        LADDER[0] if lens == "auto" else lens, None, centre_sigma_px, ImageSize(2, 2)
    )


def undistort(
    pixels: NDArray[np.uint8], lens: Distortion | Intrinsics, width: int | None = None
) -> NDArray[np.uint8]:
    """Undo a lens' distortion of an image (h, w, 3), at its own size or `width` px wide; Conflict for another size.

    Intrinsics are scaled to an image of the same shape.
    """
    seen = ImageSize(pixels.shape[1], pixels.shape[0])
    if isinstance(lens, Intrinsics):
        scaled = lens.scaled_to(seen.width)
        lens = scaled if scaled.image_size == seen else lens
    if seen != lens.image_size:
        raise Conflict(
            say(
                "lens.other-image-size",
                "The image is {size}; the lens is for images of {wanted}.",
                size=seen,
                wanted=lens.image_size,
            ),
            say(
                "lens.same-camera",
                "Use an image from the camera and at the resolution that the lens was "
                "measured with.",
            ),
            reason="size-mismatch",
        )
    return correction_map(UndistortedView(lens), CorrectedView(width=width)).apply_finely(pixels)


def square_grid(lens: Distortion | Intrinsics, width: int | None = None) -> NDArray[np.uint8]:
    """Draw the squares of a plane across the lens's axis as its images show them, (h, w, 3), as large as undistort."""
    size = CorrectedView(width=width).drawn_size(UndistortedView(lens))
    side = lens.image_size.width / SQUARES
    across = np.arange(-GRID_LINES, GRID_LINES + 1) * side
    along = np.sinh(np.linspace(-5, 5, 401)) / np.sinh(5) * across[-1]  # closer at the axis
    lines = np.stack(np.meshgrid(along, across), axis=-1)
    raw = lens.raw_from_undistorted(np.concatenate([lines, lines[..., ::-1]]) + lens.centre_px)
    drawn = (raw + 0.5) * (size.width / lens.image_size.width) - 0.5
    with np.errstate(invalid="ignore"):
        is_near = np.asarray(np.abs(drawn).max(axis=-1) < 4 * max(size))
    picture = np.full((size.height, size.width, 3), PAPER_BGR, np.uint8)
    for line, near in zip(drawn, is_near, strict=True):
        parts = np.split(np.arange(len(line)), np.flatnonzero(~near))
        seen = [np.round(line[part[near[part]]] * 16).astype(np.int32) for part in parts]
        cv2.polylines(picture, seen, False, GRID_BGR, 1, cv2.LINE_AA, 4)
    return picture


def straightness(
    edges: Sequence[Sequence[Points]],
    lines: Sequence[Any],
    size: ImageSize,
    *,
    lens: str = "auto",
    centre_sigma_px: float | None = None,
    progress: Progress = no_progress,
) -> JsonObject:
    """Fit one lens to all images of one camera; how straight edges are before and after, as plain JSON.

    edges: of each image, as edge_chains found them. lines: clicked points [[x, y], …] of one straight edge each, in
    the first image.
    """
    chains: list[Points] = [
        as_points(line, f"The points of line {i + 1}").reshape(-1, 2)
        for i, line in enumerate(lines)
    ]
    clicked = len(chains)
    pictures = [0] * clicked + [number for number, found in enumerate(edges) for _ in found]
    chains += [chain for found in edges for chain in found]
    progress(EDGES_SHARE, say("progress.straightening-edges", "Straightening the edges"))
    fit = _fit(chains, size, lens, pictures, centre_sigma_px)
    progress(1.0, PROGRESS_DONE)
    return _report(fit, chains, clicked, centre_sigma_px)


def _fit(
    chains: list[Points],
    size: ImageSize,
    lens: str,
    pictures: list[int],
    centre_sigma_px: float | None,
) -> PlumbLineFit:
    """Fit the lens, or for "auto" the simplest one beside which no other makes edges much straighter."""
    fits: list[PlumbLineFit] = []
    refusals: list[FitFailed] = []
    for name in LADDER if lens == "auto" else (lens,):
        try:
            fits.append(
                fit_plumb_lines(
                    chains, size, name, pictures=pictures, centre_sigma_px=centre_sigma_px
                )
            )
        except FitFailed as refusal:
            refusals.append(refusal)
    if not fits:
        raise refusals[0]
    best = fits[0]
    for fit in fits[1:]:
        if fit.misfit < MAX_MISFIT_RATIO * best.misfit:
            best = fit
    return best


def _report(
    fit: PlumbLineFit, chains: list[Points], clicked: int, centre_sigma_px: float | None
) -> JsonObject:
    verdict = sag_verdict(fit, chains)
    answer, conclusion, edges_bow = verdict.answer, _sentence(fit, verdict), None
    if answer == "significant":  # unless the edges themselves are bowed, or may be
        edges_bow = common_bow(fit, verdict, chains, centre_sigma_px=centre_sigma_px)
        if edges_bow is not None or not both_sides_seen(fit, verdict, chains):
            answer, conclusion = "unknown", _doubt(verdict, edges_bow)
    chance = np.sqrt(np.diag(fit.statistical_covariance))
    return stated(
        {
            "lens": fit.lens.to_json(),
            "sigma": {name: float(s) for name, s in zip(fit.names, fit.sigma, strict=True)},
            "sigma_chance": dict(zip(fit.names, map(float, chance), strict=True)),
            "names": list(fit.names),
            "covariance": fit.covariance.tolist(),
            "straightness_px": {"before": fit.before_px, "after": fit.after_px},
            "bow": {
                "most": _sag_json(verdict.most),
                "longest": _sag_json(verdict.longest),
                "border": _sag_json(verdict.border),
                "noise_px": verdict.noise_px,
            },
            "distortion": answer,
            "edges_bow": _common_bow_json(edges_bow),
            "sentence": conclusion,
            "lines_used": sum(c.used for c in fit.chains),
            "objects": fit.groups,
            "lines": _lines_json(fit, chains, clicked),
            "lenses": list(LINE_LENSES),
            "cannot_see": say(
                "straight.cannot-see",
                "Straight edges measure the distortion. They do not give the focal "
                "length, and hardly the centre.",
            ),
        }
    )


def _sentence(fit: PlumbLineFit, verdict: SagVerdict) -> Sentence:
    sag = verdict.most
    if verdict.answer == "none":
        return say(
            "straight.none",
            "No significant distortion. The largest bow of an edge is {bow_px:.2f} ± "
            "{sigma_px:.2f} px. Without correction, edges are straight within {straight_px:px} px.",
            bow_px=sag.px,
            sigma_px=sag.sigma_px,
            straight_px=fit.before_px,
        )
    if verdict.answer == "unknown":
        return say(
            "straight.inconclusive",
            "Inconclusive: these edges do not show whether the image is distorted. "
            "Mark or show more long straight edges, near the edge of the image and across it.",
        )
    digits = 2 if sag.sigma_px < 0.095 else 1
    return say(
        "straight.bows",
        "The lens bows an edge of {length_px:.0f} px by {bow_px} ± {sigma_px} px. After "
        "correction, edges are straight within {straight_px:px} px.",
        length_px=sag.length_px,
        bow_px=f"{sag.px:.{digits}f}",
        sigma_px=f"{sag.sigma_px:.{digits}f}",
        straight_px=fit.after_px,
    )


def _doubt(verdict: SagVerdict, edges_bow: CommonBow | None) -> Sentence:
    """Say why a bow that stands out is not put down to the lens."""
    if edges_bow is None:
        return say(
            "straight.one-side",
            "The edges bow by up to {bow_px:px} px, but none bows the opposite way on the "
            "other side of the image centre. It cannot be tested whether the lens or the edges themselves are "
            "bowed. Add straight edges on the other side.",
            bow_px=verdict.most.px,
        )
    pct, sigma = (
        100 * float(values[edges_bow.axis]) for values in (edges_bow.share, edges_bow.sigma)
    )
    side = SIDES[2 * edges_bow.axis + (pct > 0)]
    return say(
        "straight.edges-bowed",
        "The edges themselves are bowed: all towards the {side} of the image, by "
        "{pct} % of their length. A lens bows edges on opposite sides of the image centre in "
        "opposite directions. Use edges that are straight: ropes sag, and boards bend.",
        side=side,
        pct=format_with_sigma(abs(pct), sigma),
    )


def _common_bow_json(bow: CommonBow | None) -> JsonObject | None:
    return (
        None
        if bow is None
        else {"pct": (100 * bow.share).tolist(), "sigma_pct": (100 * bow.sigma).tolist()}
    )


def _sag_json(sag: LineSag) -> dict[str, float | None]:
    return {
        "line": sag.index if sag.index >= 0 else None,
        "length_px": sag.length_px,
        "px": nullable(sag.px),
        "sigma_px": nullable(sag.sigma_px),
        "pct": nullable(100 * sag.px / sag.length_px),
    }


def _lines_json(fit: PlumbLineFit, chains: list[Points], clicked: int) -> list[JsonObject]:
    max_drawn = int(np.clip(MAX_DRAWN // max(len(chains), 1), 2, MAX_DRAWN_OF_ONE))
    undistorted = UndistortedView(fit.lens)
    drawn = [_drawn(chain, max_drawn, ordered=i >= clicked) for i, chain in enumerate(chains)]
    return [
        {
            "name": _name(c.index, c.picture, clicked),
            "picture": c.picture,
            "points": c.count,
            "length_px": c.length_px,
            "before_px": nullable(c.before_px),
            "after_px": nullable(c.after_px),
            "used": c.used,
            "reason": c.reason or None,
            "ends": [chains[c.index][i].tolist() for i in (0, -1)] if c.count else [],
            "chain": nullable_points(drawn[c.index].round(2)),
            "straight": nullable_points(undistorted.corrected_from_raw(drawn[c.index]).round(2)),
        }
        for c in fit.chains
    ]


def _drawn(chain: Points, max_points: int, ordered: bool) -> Points:
    """Return at most so many points of a chain, one after the other along it: clicks come in any order."""
    if not ordered and len(chain) > 2:
        about = chain - chain.mean(axis=0)
        chain = chain[
            np.argsort(about @ np.linalg.svd(about, full_matrices=False)[2][0], kind="stable")
        ]
    return (
        chain[np.unique(np.linspace(0, len(chain) - 1, max_points).round().astype(int))]
        if len(chain)
        else chain
    )


def _name(index: int, picture: int, clicked: int) -> str:
    return (
        f"line {index + 1}"
        if index < clicked
        else f"image {picture + 1}, edge {index - clicked + 1}"
    )
