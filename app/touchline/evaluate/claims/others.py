"""Claims that compare a version with the active one."""

from collections.abc import Mapping
from typing import Any

from touchline.core.statements import say
from touchline.evaluate.claims.claim import Claim, ClaimFigure, mm

LENS_SAME_PX = 2.0  # two fits of one lens to other points differ by about a pixel near the image's corners
MIN_LENS_PX, MIN_LENS_SHARE = 0.1, 0.01  # no figure is better than that
SAME_MM = 1.0  # less than what two calibrations from two images of one camera differ by


def difference_claims(found: Mapping[str, Any], former: int) -> list[Claim]:
    """Return how a version differs from the active one. found: a Difference; former: the active one's number."""
    claims, lens = [], found["lens"]
    if lens is not None:
        share = max(MIN_LENS_SHARE, abs(100 * (lens["focal_ratio"] - 1)))
        text = say("claim.lens.focal-length", "Focal length within {share:.2f} %.", share=share)
        if lens["max_px"] is None:
            claims.append(Claim("lens", "not-tested", say("claim.lens", "Lens not compared"), text))
        else:
            is_same = lens["max_px"] <= LENS_SAME_PX
            shown: ClaimFigure = {"value": max(MIN_LENS_PX, lens["max_px"]), "unit": "px", "at_most": False}
            claims.append(Claim("lens", "held" if is_same else "refuted", say(
                "claim.lens.same", "Lens unchanged since version {former}", former=former) if is_same else say(
                "claim.lens.differs", "Lens differs from version {former}", former=former), text,
                tried=("active-version",), figure=shown))
    median, largest = found["median_mm"], found["max_mm"]
    if median is None or largest is None:
        claims.append(Claim("difference", "not-tested", say(
            "claim.difference", "Not compared with version {former}", former=former), say(
            "claim.difference.nothing-common", "The covered areas do not overlap.")))
        return claims
    is_same = largest <= SAME_MM
    claims.append(Claim("difference", "held" if is_same else "refuted", say(
        "claim.difference.same", "Same positions as version {former}", former=former) if is_same else say(
        "claim.difference.differs", "Differs from version {former}", former=former), say(
        "claim.difference.worst", "Median difference. Largest: {mm:.1f} mm.", mm=largest), tried=("active-version",),
        figure=mm(median)))
    return claims
