"""A table of a family's members: name → "module:Class", imported when first asked for."""

from collections.abc import Iterator, Mapping
from importlib import import_module
from typing import Any, Generic, TypeVar

from touchline.core.errors import NotFound

Member = TypeVar("Member")


def load(target: str) -> Any:
    """Import what "module:attribute" names."""
    module, _, attribute = target.partition(":")
    return getattr(import_module(module), attribute)


class Registry(Mapping[str, Member], Generic[Member]):
    """A read-only mapping from a member's name to its class.

    kind: what a member is called in an error, such as "camera model". An unknown name lists the
    known ones. Members are imported one by one, so an optional dependency of one of them is no
    burden for the others.
    """

    def __init__(self, kind: str, table: dict[str, str]) -> None:
        self._kind = kind
        self._table = dict(table)

    def __getitem__(self, name: str) -> Member:
        try:
            target = self._table[name]
        except (KeyError, TypeError):
            raise NotFound(
                f"Unknown {self._kind}: {name!r}.",
                f"Use one of: {', '.join(self._table)}.",
                reason=f"unknown-{self._kind.replace(' ', '-')}",
            ) from None
        member: Member = load(target)
        return member

    def find(self, name: str) -> Member | None:
        """Return a member; None where there is none of that name."""
        if name in self:
            return self[name]
        return None

    def __contains__(self, name: object) -> bool:
        return name in self._table

    def __iter__(self) -> Iterator[str]:
        return iter(self._table)

    def __len__(self) -> int:
        return len(self._table)
