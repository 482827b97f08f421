"""What fitters say of single clicks: which are refused, which were left out, and why."""

import numpy as np

from touchline.core.errors import FitFailed
from touchline.core.geometry import Array, ImageSize, Indices, Mask, Points, inside_picture
from touchline.core.records import Observations, Warning
from touchline.core.statements import Sentence, say

SAME_PLACE_PX = 0.5  # two clicks closer than this are one
MAX_CLICKED = 1000  # more come from a detector, whose spacing is its own


def first_of_each_place(points: Points) -> Indices:
    """Return for each point (n, 2) px the number of the first one at its place, its own in most cases.

    A second click on one place says nothing new: it neither counts in a fit nor harms it.
    """
    first = np.arange(len(points))
    if len(points) > MAX_CLICKED:
        return first
    apart = points[:, None] - points
    near = np.tril(np.einsum("ijk,ijk->ij", apart, apart) < SAME_PLACE_PX**2, -1)
    for k in np.flatnonzero(near.any(axis=1)):
        firsts = np.flatnonzero(near[k] & (first == np.arange(len(points))))
        first[k] = firsts[0] if firsts.size else k
    return first


def check_inside_picture(observations: Observations, image_size: ImageSize) -> None:
    """Raise FitFailed for a click that no picture of that size can have."""
    for o in observations:
        outside = np.flatnonzero(~inside_picture(o.points, image_size, -1))
        if outside.size:
            x, y = o.points[outside[0]]
            raise FitFailed(say("refused.outside", "Point {n} of {line}, ({x:.6g}, {y:.6g}), is outside the image of "
                                "{size}.", n=int(outside[0]) + 1, line=o.label, x=x, y=y, size=str(image_size)),
                            say("refused.outside.fix", "Remove it, or choose the image that it belongs to."),
                            reason="outside-picture", feature=str(o.feature), index=int(outside[0]))


def inlier_masks(observations: Observations, owners: Indices, inliers: Mask) -> tuple[Mask, ...]:
    """Return a mask of the points of each observation; owners (n, 2): observation and point of each of the inliers.

    A second click on one place is what the first one is.
    """
    masks = tuple(np.ones(len(o.points), bool) for o in observations)
    for (i, k), fine in zip(owners, inliers, strict=True):
        masks[i][k] = fine
    return tuple(mask[first_of_each_place(o.points)] for mask, o in zip(masks, observations, strict=True))


def outlier_warnings(observations: Observations, owners: Indices, inliers: Mask, pixels: Array) -> list[Warning]:
    """Return a warning for each click that was left out; pixels: how far off it is."""
    return [outlier_warning(observations, i, k, say("outlier.predicted", "is {px:.1f} px from its predicted position",
                                                    px=abs(px)))
            for (i, k), fine, px in zip(owners, inliers, pixels, strict=True) if not fine]


DRAG = say("warning.outlier.fix", "Drag it onto the line, or remove it.")


def outlier_warning(observations: Observations, i: int, k: int, where: Sentence, fix: Sentence = DRAG) -> Warning:
    """Return the warning for point k of observation i; where: what is wrong with it, as a verb."""
    observation = observations[i]
    return Warning("stray-click", say("warning.outlier", "Point {n} of {line} {where} and was excluded from the fit.",
                                      n=int(k) + 1, line=observation.label, where=where), fix,
                   str(observation.feature), int(k))


def elevated_point_warnings(observations: Observations, who: Sentence) -> list[Warning]:
    """Return a warning for each observation that a model without rays cannot use; who: "a homography"."""
    return [Warning("above-the-carpet", say(
        "warning.above-carpet", "The points on {line} are {mm:g} mm above the carpet. {who} describes only the carpet, "
        "so they were excluded.", line=o.label, mm=o.z_mm, who=who), say(
        "warning.above-carpet.fix", "Fit a physical lens model to use them."), str(o.feature))
            for o in observations if o.z_mm != 0 and len(o.points)]
