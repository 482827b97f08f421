"""A camera's named values through Aravis."""

from collections.abc import Callable
from typing import Any

from touchline.core.errors import BadInput
from touchline.sources.industrial.aravis_library import Aravis, AravisError, text
from touchline.sources.industrial.features import Node, finite_range

READ_ONLY = 0  # of Aravis' access modes; it calls some "write only" that can be read very well

SETTERS: dict[str, tuple[str, Callable[..., object]]] = {  # by kind: type in the function's name, and its conversion
    "choice": ("string", lambda value: str(value).encode()), "bool": ("boolean", bool), "int": ("integer", int),
    "float": ("float", float)}


class AravisNodes:
    """Nodes over an ArvDevice."""

    def __init__(self, library: Aravis, device: Any) -> None:
        self._library, self._device = library, device

    def get(self, name: str) -> Node | None:
        raw = name.encode()
        try:
            kind = self._kind(raw)
            return None if kind in (None, "command") else self._described(kind, raw)
        except AravisError:  # the camera cannot say it now, or is gone
            return None

    def set(self, name: str, value: Any) -> None:
        raw, call, device = name.encode(), self._library.call, self._device
        kind = self._kind(raw)
        try:
            if kind == "command":
                call("device_execute_command", device, raw)
            elif kind in SETTERS:
                type_name, convert = SETTERS[kind]
                call(f"device_set_{type_name}_feature_value", device, raw, convert(value))
            else:
                raise AravisError("none")
        except AravisError as error:
            raise BadInput(f"The camera refuses {name} = {value}.", f"Camera message: {str(error).rstrip('.')}.",
                           reason="bad-control") from None

    def _kind(self, raw: bytes) -> str | None:
        try:
            if not self._library.call("device_is_feature_available", self._device, raw):
                return None
        except AravisError:
            return None
        node = self._library.call("device_get_feature", self._device, raw)
        return self._library.kind(node) if node else None

    def _described(self, kind: str, raw: bytes) -> Node:
        call, device = self._library.call, self._device
        writable = call("device_get_feature_access_mode", device, raw) != READ_ONLY
        if kind == "choice":
            value = text(call("device_get_string_feature_value", device, raw))
            return Node(kind, value, writable, choices=self._library.choices(device, raw))
        if kind == "bool":
            return Node(kind, bool(call("device_get_boolean_feature_value", device, raw)), writable)
        called = "integer" if kind == "int" else "float"
        value = call(f"device_get_{called}_feature_value", device, raw)
        low, high = self._library.bounds(kind, device, raw)
        step = call("device_get_integer_feature_increment", device, raw) if kind == "int" else 0.0
        unit = text(call(f"gc_{called}_get_unit", call("device_get_feature", device, raw)))
        return Node(kind, value, writable, finite_range(low, high), step, unit)
