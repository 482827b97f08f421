"""A camera's nodes as the GenICam standard's own library reads them, for the settings of industrial cameras."""

from itertools import islice
from typing import Any

from genicam import genapi

from touchline.core.errors import BadInput
from touchline.sources.industrial.features import Node, finite_range

MAX_CHOICES = 200
READABLE = (genapi.EAccessMode.RO, genapi.EAccessMode.RW)
WRITABLE = (genapi.EAccessMode.WO, genapi.EAccessMode.RW)


class GenApiNodes:
    """Nodes over a genapi NodeMap."""

    def __init__(self, node_map: Any) -> None:
        self._map = node_map

    def get(self, name: str) -> Node | None:
        node = getattr(self._map, name, None)
        access = node.get_access_mode() if node is not None else None
        return _described(node, access in WRITABLE) if access in READABLE else None

    def set(self, name: str, value: Any) -> None:
        node = getattr(self._map, name, None)
        if node is None:
            raise BadInput(
                f"The camera has no setting {name}.", "Use another setting.", reason="bad-control"
            )
        try:
            if isinstance(node, genapi.ICommand):
                node.execute()
            else:
                node.value = value
        except (genapi.GenericException, TypeError, OverflowError) as error:
            said = " ".join(str(error).split(" : ")[0].split())[:200]
            raise BadInput(
                f"The camera refuses {name} = {value}.",
                f"Camera message: {said.rstrip('.')}.",
                reason="bad-control",
            ) from None


def _described(node: Any, writable: bool) -> Node | None:
    if isinstance(node, genapi.IEnumeration):
        names = (entry.symbolic for entry in node.entries if entry.get_access_mode() in READABLE)
        return Node("choice", node.value, writable, choices=tuple(islice(names, MAX_CHOICES)))
    if isinstance(node, genapi.IBoolean):
        return Node("bool", node.value, writable)
    if isinstance(node, genapi.IInteger):
        return Node(
            "int", node.value, writable, finite_range(node.min, node.max), node.inc, node.unit
        )
    if isinstance(node, genapi.IFloat):
        return Node("float", node.value, writable, finite_range(node.min, node.max), 0.0, node.unit)
    return None
