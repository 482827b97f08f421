"""From a picture, or lines clicked in it, to how straight it shows straight edges, and the lens that undoes the bend.

    report = straightness([edge_chains(frame.pixels), …], (), size)    edges of pictures
    report = straightness((), [[[x, y], …], …], size)                  each a clicked line
    pixels = undistort(frame.pixels, lens)                             the picture without the bend
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.core.common_sentences import PROGRESS_DONE
from touchline.core.errors import Conflict, FitFailed
from touchline.core.geometry import ImageSize, Points, as_points
from touchline.core.json_values import nullable, nullable_points
from touchline.core.progress import Progress, no_progress
from touchline.core.statements import Sentence, say, stated
from touchline.core.text_format import format_with_sigma
from touchline.fitting.plumb_line.common_bow import CommonBow, both_sides_seen, common_bow
from touchline.fitting.plumb_line.fit import PlumbLineFit, fit_plumb_lines
from touchline.fitting.plumb_line.line_sag import LineSag, SagVerdict, sag_verdict
from touchline.fitting.plumb_line.search import PlumbLineProblem
from touchline.imaging.correction import CorrectedView, correction_map
from touchline.imaging.undistorted_view import UndistortedView
from touchline.models.distortion import LINE_LENSES, Distortion

LADDER = ("division", "division-even")  # what "auto" tries, simplest first
MUCH_STRAIGHTER = 0.95  # of the simpler lens' misfit: less is no reason for another term
LOOKING = 0.5  # of the work: edges take about as long as the lens
MAX_DRAWN = 40_000  # points of all chains together that the report repeats, for drawing
MAX_DRAWN_OF_ONE = 33
SIDES = (say("straight.side.left", "left"), say("straight.side.right", "right"), say("straight.side.top", "top"),
         say("straight.side.bottom", "bottom"))


def straightness(edges: Sequence[Sequence[Points]], lines: Sequence[Any], size: ImageSize, *, lens: str = "auto",
                 centre_sigma_px: float | None = None, progress: Progress = no_progress) -> dict[str, Any]:
    """Fit one lens to all pictures of one camera; how straight edges are before and after, as plain JSON.

    edges: of each picture, as edge_chains found them. lines: clicked points [[x, y], …] of one straight edge each, in
    the first picture.
    """
    chains: list[Points] = [as_points(line, f"The points of line {i + 1}").reshape(-1, 2)
                            for i, line in enumerate(lines)]
    clicked = len(chains)
    where = [0] * clicked + [number for number, found in enumerate(edges) for _ in found]
    chains += [chain for found in edges for chain in found]
    progress(LOOKING, say("progress.straightening-edges", "Straightening the edges"))
    fit = _fit(chains, size, lens, where, centre_sigma_px)
    progress(1.0, PROGRESS_DONE)
    return _report(fit, chains, clicked, centre_sigma_px)


def check_choice(lens: str, centre_sigma_px: float | None) -> None:
    """Refuse an impossible lens or σ before edges are looked for."""
    PlumbLineProblem.of(LADDER[0] if lens == "auto" else lens, None, centre_sigma_px, ImageSize(2, 2))


def undistort(pixels: NDArray[np.uint8], lens: Distortion, width: int | None = None) -> NDArray[np.uint8]:
    """Undo a lens' distortion of a picture (h, w, 3), at its own size or `width` px wide; Conflict for another size."""
    seen = ImageSize(pixels.shape[1], pixels.shape[0])
    if seen != lens.image_size:
        raise Conflict(say("lens.other-image-size", "The image is {size}; the lens is for images of {wanted}.",
                           size=seen, wanted=lens.image_size),
                       say("lens.same-camera", "Use an image from the camera and at the resolution that the lens was "
                           "measured with."), reason="size-mismatch")
    return correction_map(UndistortedView(lens), CorrectedView(width=width)).apply_finely(pixels)


def _fit(chains: list[Points], size: ImageSize, lens: str, where: list[int],
         centre_sigma_px: float | None) -> PlumbLineFit:
    if lens != "auto":
        return fit_plumb_lines(chains, size, lens, pictures=where, centre_sigma_px=centre_sigma_px)
    fits: list[PlumbLineFit] = []
    refusals: list[FitFailed] = []
    for name in LADDER:
        try:
            fits.append(fit_plumb_lines(chains, size, name, pictures=where, centre_sigma_px=centre_sigma_px))
        except FitFailed as refusal:
            refusals.append(refusal)
    if not fits:
        raise refusals[0]
    best = fits[0]
    for fit in fits[1:]:
        if fit.misfit < MUCH_STRAIGHTER * best.misfit:
            best = fit
    return best


def _report(fit: PlumbLineFit, chains: list[Points], clicked: int, centre_sigma_px: float | None) -> dict[str, Any]:
    verdict = sag_verdict(fit, chains)
    answer, sentence, bowed = verdict.answer, _sentence(fit, verdict), None
    if answer == "significant":  # unless the edges themselves are bowed, or may be
        bowed = common_bow(fit, verdict, chains, centre_sigma_px=centre_sigma_px)
        if bowed is not None or not both_sides_seen(fit, verdict, chains):
            answer, sentence = "unknown", _doubt(verdict, bowed)
    used = sum(c.used for c in fit.chains)
    most = int(np.clip(MAX_DRAWN // max(len(chains), 1), 2, MAX_DRAWN_OF_ONE))
    straight = UndistortedView(fit.lens)
    drawn = [_drawn(chain, most, ordered=i >= clicked) for i, chain in enumerate(chains)]
    return stated({
        "lens": fit.lens.to_json(),
        "sigma": {name: float(s) for name, s in zip(fit.names, fit.sigma, strict=True)},
        "sigma_chance": dict(zip(fit.names, map(float, np.sqrt(np.diag(fit.statistical_covariance))), strict=True)),
        "names": list(fit.names), "covariance": fit.covariance.tolist(),
        "straightness_px": {"before": fit.before_px, "after": fit.after_px},
        "bow": {"most": _bow(verdict.most), "longest": _bow(verdict.longest),
                "border": _bow(verdict.border), "noise_px": verdict.noise_px},
        "distortion": answer,
        "edges_bow": _common(bowed),
        "sentence": sentence,
        "lines_used": used, "objects": fit.groups,
        "lines": [{"name": _name(c.index, c.picture, clicked), "picture": c.picture, "points": c.count,
                   "length_px": c.length_px, "before_px": nullable(c.before_px), "after_px": nullable(c.after_px),
                   "used": c.used, "reason": c.reason or None,
                   "ends": [chains[c.index][i].tolist() for i in (0, -1)] if c.count else [],
                   "chain": nullable_points(drawn[c.index].round(2)),
                   "straight": nullable_points(straight.corrected_from_raw(drawn[c.index]).round(2))}
                  for c in fit.chains],
        "lenses": list(LINE_LENSES),
        "cannot_see": say("straight.cannot-see", "Straight edges measure the distortion. They do not give the focal "
                          "length, and hardly the centre."),
    })


def _sentence(fit: PlumbLineFit, verdict: SagVerdict) -> Sentence:
    bow = verdict.most
    if verdict.answer == "none":
        return say("straight.none", "No significant distortion. The largest bow of an edge is {bow_px:.2f} ± "
                   "{sigma_px:.2f} px. Without correction, edges are straight within {straight_px:.2f} px.",
                   bow_px=bow.px, sigma_px=bow.sigma_px, straight_px=fit.before_px)
    if verdict.answer == "unknown":
        return say("straight.inconclusive", "Inconclusive: these edges do not show whether the image is distorted. "
                   "Mark or show more long straight edges, near the edge of the image and across it.")
    digits = 2 if bow.sigma_px < 0.095 else 1
    return say("straight.bows", "The lens bows an edge of {length_px:.0f} px by {bow_px} ± {sigma_px} px. After "
               "correction, edges are straight within {straight_px:.2f} px.", length_px=bow.length_px,
               bow_px=f"{bow.px:.{digits}f}", sigma_px=f"{bow.sigma_px:.{digits}f}", straight_px=fit.after_px)


def _doubt(verdict: SagVerdict, bowed: CommonBow | None) -> Sentence:
    """Why a bow that stands out is not put down to the lens."""
    if bowed is None:
        return say("straight.one-side", "The edges bow by up to {bow_px:.1f} px, but none bows the opposite way on the "
                   "other side of the image centre. It cannot be tested whether the lens or the edges themselves are "
                   "bowed. Add straight edges on the other side.", bow_px=verdict.most.px)
    pct, sigma = (100 * float(values[bowed.axis]) for values in (bowed.share, bowed.sigma))
    side = SIDES[2 * bowed.axis + (pct > 0)]
    return say("straight.edges-bowed", "The edges themselves are bowed: all towards the {side} of the image, by "
               "{pct} % of their length. A lens bows edges on opposite sides of the image centre in "
               "opposite directions. Use edges that are straight: ropes sag, and boards bend.", side=side,
               pct=format_with_sigma(abs(pct), sigma))


def _common(bowed: CommonBow | None) -> dict[str, Any] | None:
    return None if bowed is None else {"pct": (100 * bowed.share).tolist(), "sigma_pct": (100 * bowed.sigma).tolist()}


def _bow(bow: LineSag) -> dict[str, float | None]:
    return {"line": bow.index if bow.index >= 0 else None, "length_px": bow.length_px, "px": nullable(bow.px),
            "sigma_px": nullable(bow.sigma_px), "pct": nullable(100 * bow.px / bow.length_px)}


def _drawn(chain: Points, most: int, ordered: bool) -> Points:
    """At most so many points of a chain, one after the other along it: clicks come in any order."""
    if not ordered and len(chain) > 2:
        about = chain - chain.mean(axis=0)
        chain = chain[np.argsort(about @ np.linalg.svd(about, full_matrices=False)[2][0], kind="stable")]
    return chain[np.unique(np.linspace(0, len(chain) - 1, most).round().astype(int))] if len(chain) else chain


def _name(index: int, picture: int, clicked: int) -> str:
    return f"line {index + 1}" if index < clicked else f"image {picture + 1}, edge {index - clicked + 1}"
