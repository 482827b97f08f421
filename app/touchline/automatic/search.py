"""The best cameras above an area of a field, and which of several fields a picture shows.

The fields are matched with the same lines, and the best few of all are refined.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from touchline.automatic.hypotheses import cameras_from_corners, outline_about
from touchline.automatic.matching import (
    MIN_GOOD_SCORE,
    MIN_RELATIVE_SCORE,
    NO_PRIOR,
    CameraCandidate,
    FieldMatcher,
    Match,
    PosePrior,
    Scored,
    by_value,
    compared,
)
from touchline.automatic.seen_lines import SeenLines
from touchline.core.field import Field, Region
from touchline.core.geometry import Array
from touchline.core.jobs import Progress, no_progress, subprogress
from touchline.core.statements import say

# value of a field, below which three lines are tried too: a wrong field of few lines can reach 0.8
CERTAIN = 0.9
# value of a field's best match: less is not refined to a field that explains the picture
MIN_MATCH = 0.5
MAX_FIELDS = 6  # fields of which cameras are refined
MAX_REFINED_FIRST, MAX_REFINED_NEXT = 3, 2  # cameras of the most likely field, and of each other
MAX_REFINED_POOR = 5  # likewise, where no field is certain


@dataclass(frozen=True, eq=False)
class SearchResult:
    """The candidates, best first, and the lines that they were made from."""

    candidates: tuple[CameraCandidate, ...] = ()
    lines: tuple[Array, ...] = ()


def search(
    seen: SeenLines,
    field: Field,
    region: Region,
    prior: PosePrior = NO_PRIOR,
    progress: Progress = no_progress,
) -> SearchResult:
    """Search for cameras above an area of a field; by its corners alone, where given ones lead to its lines."""
    if not len(seen.points):
        return SearchResult()
    found: list[CameraCandidate] = []
    if prior.corners is not None:
        corners = np.array(prior.corners)
        near_corners = FieldMatcher.over_region(
            seen.within(outline_about(corners)), field, region, prior
        )
        found = near_corners.refined_from_any(cameras_from_corners(corners, region, seen.size))
    if not found or found[0].value < MIN_GOOD_SCORE:
        found = FieldMatcher.over_region(seen, field, region, prior).candidates(progress)
    return SearchResult(tuple(found), tuple(seen.lines))


@dataclass(frozen=True, eq=False)
class RecognisedField:
    """A field, and the cameras above it that the picture allows, the best first."""

    field: Field
    candidates: tuple[CameraCandidate, ...]


def recognise(
    seen: SeenLines,
    areas: Sequence[tuple[Field, Sequence[Region]]],
    prior: PosePrior = NO_PRIOR,
    progress: Progress = no_progress,
) -> tuple[RecognisedField, ...]:
    """Return the fields that the lines may be of, the best first. areas: each field with those to look for.

    Of two cameras above a field that looks alike when it is turned by 180°, just one is returned.
    """
    if not len(seen.points):
        return ()
    by_name = {field.name: field for field, _ in areas}
    matchers = {
        field.name: FieldMatcher.over_any(seen, field, regions, prior) for field, regions in areas
    }
    found: dict[str, list[CameraCandidate]] = {}
    ranked: list[tuple[str, list[CameraCandidate]]] = []
    for is_three_lines in (False, True):
        part = subprogress(progress, 0.5 * is_three_lines, 0.5 + 0.5 * is_three_lines)
        matches: dict[str, list[Match]] = {}
        for number, (name, matcher) in enumerate(matchers.items()):
            part(
                0.5 * number / len(matchers),
                say("progress.matching-field", "Comparing with {field}", field=by_name[name].title),
            )
            matches[name] = matcher.three_line_matches() if is_three_lines else matcher.matches()
        best = {name: of_field[0].value for name, of_field in _by_field(matches).items()}
        for name in sorted(best, key=lambda name: -best[name])[:MAX_FIELDS]:
            part(
                0.5 + 0.1 * len(found) / len(best),
                say("progress.fitting-field", "Fitting {field}", field=by_name[name].title),
            )
            best_so_far = ranked[0][1][0].value if ranked else 0.0
            # The second one is refined however far behind it is: recognition.py says how far.
            if best[name] >= MIN_MATCH and (
                len(ranked) < 2 or best[name] >= MIN_RELATIVE_SCORE * best_so_far
            ):
                most = (
                    MAX_REFINED_POOR
                    if is_three_lines
                    else MAX_REFINED_NEXT
                    if ranked
                    else MAX_REFINED_FIRST
                )
                found[name] = found.get(name, []) + matchers[name].refined(matches[name], most)
                ranked = _ranked(found, matchers)
        if ranked and ranked[0][1][0].value >= CERTAIN:
            break
    return tuple(RecognisedField(by_name[name], tuple(candidates)) for name, candidates in ranked)


def _by_field(of_fields: Mapping[str, Sequence[Scored]]) -> dict[str, list[Scored]]:
    """Return the cameras of each field, best first, all compared with each other; no field without one."""
    every = iter(compared([one for of in of_fields.values() for one in of]))
    return {name: by_value([next(every) for _ in of]) for name, of in of_fields.items() if of}


def _ranked(
    found: Mapping[str, list[CameraCandidate]],
    matchers: Mapping[str, FieldMatcher],
) -> list[tuple[str, list[CameraCandidate]]]:
    """Return the fields with their cameras, best first and each once."""
    of_field = {name: matchers[name].distinct(of) for name, of in _by_field(found).items()}
    return sorted(of_field.items(), key=lambda one: -one[1][0].value)
