"""Which of several fields a picture shows: each is matched with the same lines, and the best few of all are refined."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from touchline.core.field import Field, Region
from touchline.core.jobs import Progress, no_progress, subprogress
from touchline.core.statements import say
from touchline.fitting.field_lines.search import (
    MIN_RELATIVE_SCORE,
    CameraCandidate,
    FieldMatcher,
    Match,
    PosePrior,
    Scored,
    by_value,
    compared,
)
from touchline.fitting.field_lines.seen_lines import SeenLines

CERTAIN = 0.9  # value of a field, below which three lines are tried too: a wrong field of few lines can reach 0.8
MIN_MATCH = 0.5  # value of a field's best match: less is not refined to a field that explains the picture
MAX_FIELDS = 6  # fields of which cameras are refined
REFINED, REFINED_NEXT = 3, 2  # cameras of the most likely field, and of each other
REFINED_POOR = 5


@dataclass(frozen=True, eq=False)
class RecognisedField:
    """A field, and the cameras above it that the picture allows, the best first."""

    field: Field
    candidates: tuple[CameraCandidate, ...]


def recognise(seen: SeenLines, areas: Sequence[tuple[Field, Sequence[Region]]], prior: PosePrior = PosePrior(),  # noqa: B008
              progress: Progress = no_progress) -> tuple[RecognisedField, ...]:
    """Return the fields that the lines may be of, the best first. areas: each field with those to look for.

    Of two cameras above a field that looks alike when it is turned by 180°, just one is returned.
    """
    if not len(seen.points):
        return ()
    by_name = {field.name: field for field, _ in areas}
    matchers = {field.name: FieldMatcher.over_any(seen, field, regions, prior) for field, regions in areas}
    found: dict[str, list[CameraCandidate]] = {}
    ranked: list[tuple[str, list[CameraCandidate]]] = []
    for is_last in (False, True):
        part = subprogress(progress, 0.5 * is_last, 0.5 + 0.5 * is_last)
        matches: dict[str, list[Match]] = {}
        for number, (name, matcher) in enumerate(matchers.items()):
            part(0.5 * number / len(matchers), say("progress.matching-field", "Comparing with {field}",
                                                   field=by_name[name].title))
            matches[name] = matcher.three_line_matches() if is_last else matcher.matches()
        best = {name: of[0].value for name, of in _side_by_side(matches).items()}
        for name in sorted(best, key=lambda name: -best[name])[:MAX_FIELDS]:
            part(0.5 + 0.1 * len(found) / len(best), say("progress.fitting-field", "Fitting {field}",
                                                        field=by_name[name].title))
            so_far = ranked[0][1][0].value if ranked else 0.0
            if best[name] >= MIN_MATCH and (len(ranked) < 2 or best[name] >= MIN_RELATIVE_SCORE * so_far):
                most = REFINED_POOR if is_last else REFINED_NEXT if ranked else REFINED
                found[name] = found.get(name, []) + matchers[name].refined(matches[name], most)
                ranked = _ranked(found, matchers)
        if ranked and ranked[0][1][0].value >= CERTAIN:
            break
    return tuple(RecognisedField(by_name[name], tuple(candidates)) for name, candidates in ranked)


def _side_by_side(of_fields: Mapping[str, Sequence[Scored]]) -> dict[str, list[Scored]]:
    """Return the cameras of each field, best first, all compared with each other; no field without one."""
    every = iter(compared([one for of in of_fields.values() for one in of]))
    return {name: by_value([next(every) for _ in of]) for name, of in of_fields.items() if of}


def _ranked(found: Mapping[str, list[CameraCandidate]], matchers: Mapping[str, FieldMatcher],
            ) -> list[tuple[str, list[CameraCandidate]]]:
    """Return the fields with their cameras, best first and each once."""
    of_field = {name: matchers[name].distinct(of) for name, of in _side_by_side(found).items()}
    return sorted(of_field.items(), key=lambda one: -one[1][0].value)
