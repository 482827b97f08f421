"""The lens that an address selects: a preset, with any of its terms replaced by name."""

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

from app.core.errors import BadInput
from app.core.options import Option
from app.sources.sim.lens import LENSES, Lens

TERMS = ("k", "a", "k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2")
LENS_OPTIONS = (
    Option("lens", "choice", "strong", "What the lens does to straight lines; each model's name is one as well.",
           choices=tuple(LENSES)),
    *(Option(term, "float", None, f"The lens's term {term}; the preset's if left out.", (-5, 5)) for term in TERMS),
)


def select_lens(options: Mapping[str, Any]) -> Lens:
    """Return the preset with the given terms; BadInput for a term that it does not have."""
    preset = LENSES[options["lens"]]
    given = {term: options[term] for term in TERMS if options[term] is not None}
    known = [member.name for member in fields(preset)]
    for term in given:
        if term not in known:
            raise BadInput(f"The lens {options['lens']!r} has no term {term}.", f"It has {', '.join(known)}.",
                           reason="bad-option")
    return replace(preset, **given)
