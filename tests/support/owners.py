"""Which capability a module belongs to, as long as its files lie apart; and the imports that break the rule.

The kernel imports no capability, and a capability no other one, but for the pairs that ALLOWED names.
"""

from collections.abc import Iterator, Mapping
from fnmatch import fnmatchcase

OWNERS: dict[str, tuple[str, ...]] = {
    "fields": ("fields", "fields.*"),
    "automatic": ("automatic", "automatic.*"),
    "boards": ("boards", "boards.*"),
    "detection": ("detection", "detection.*"),
    "drift": ("drift", "drift.*"),
    "league": ("league", "league.*"),
    "referee": ("referee", "referee.*"),
    "report": ("report", "report.*"),
    "rigs": ("rigs", "rigs.*"),
    "scene": ("scene", "scene.*"),
    "straight": ("straight", "straight.*"),
}
ALLOWED = {
    ("rigs", "drift"),
    ("fields", "automatic"),
    ("detection", "league"),
    ("detection", "referee"),
    ("referee", "league"),
}


def owner(module: str, owners: Mapping[str, tuple[str, ...]] = OWNERS) -> str | None:
    """Return the capability of a module, named from the package on; None for the kernel."""
    name = module.removeprefix("touchline.")
    return next(
        (
            owner
            for owner, patterns in owners.items()
            if any(fnmatchcase(name, pattern) for pattern in patterns)
        ),
        None,
    )


def breaks(graph: Mapping[str, set[str]]) -> Iterator[tuple[str, str]]:
    """Yield each module and one that it imports against the rule. graph: of python_graph."""
    for module, imported in graph.items():
        for other in sorted(imported):
            mine, theirs = owner(module), owner(other)
            if theirs not in (None, mine) and (mine, theirs) not in ALLOWED:
                yield module, other
