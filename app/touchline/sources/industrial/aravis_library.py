"""Aravis from Python: libaravis-0.8 through ctypes, so that any Python does; and a camera's named values through it.

Only calls, errors, references, texts and named values; aravis.py makes cameras of them.
"""

import ctypes
from collections.abc import Callable
from ctypes import (
    POINTER,
    byref,
    c_bool,
    c_char_p,
    c_double,
    c_int,
    c_int64,
    c_size_t,
    c_uint,
    c_uint32,
    c_uint64,
)
from ctypes import c_void_p as pointer
from functools import lru_cache
from typing import Any

from touchline.core.errors import BadInput, Unavailable
from touchline.core.statements import say
from touchline.sources.industrial.features import Node, finite_range

NAME = "libaravis-0.8.so.0"
FIX = say("industrial.install-aravis", "Install it: apt install libaravis-0.8-0.")

# (result, arguments, whether a GError** comes last) → the functions with that signature, without "arv_"
SIGNATURES: dict[tuple[Any, tuple[Any, ...], bool], str] = {
    (None, (c_char_p,), False): "enable_interface disable_interface",
    (c_uint, (), False): "get_n_interfaces get_n_devices",
    (
        c_char_p,
        (c_uint,),
        False,
    ): "get_interface_id get_device_id get_device_physical_id get_device_address "
    "get_device_protocol get_device_vendor get_device_model get_device_serial_nbr",
    (None, (), False): "update_device_list",
    (pointer, (c_char_p,), True): "camera_new",
    (pointer, (pointer,), False): "camera_get_device",
    (
        c_char_p,
        (pointer,),
        True,
    ): "camera_get_vendor_name camera_get_model_name camera_get_device_serial_number "
    "gc_float_get_unit gc_integer_get_unit",
    (c_uint, (pointer,), True): "camera_get_payload",
    (pointer, (pointer, pointer, pointer, pointer), True): "camera_create_stream",
    (None, (pointer,), True): "camera_start_acquisition camera_stop_acquisition",
    (None, (pointer, pointer), False): "stream_push_buffer",
    (pointer, (pointer, c_uint64), False): "stream_timeout_pop_buffer",
    (pointer, (c_size_t,), False): "buffer_new_allocate",
    (c_int, (pointer,), False): "buffer_get_status buffer_get_payload_type buffer_get_image_width "
    "buffer_get_image_height",
    (pointer, (pointer, POINTER(c_size_t)), False): "buffer_get_image_data",
    (c_uint32, (pointer,), False): "buffer_get_image_pixel_format",
    (None, (pointer, POINTER(c_int), POINTER(c_int)), False): "buffer_get_image_padding",
    (pointer, (pointer, c_char_p), False): "device_get_feature",
    (
        c_bool,
        (pointer, c_char_p),
        True,
    ): "device_is_feature_available device_get_boolean_feature_value",
    (None, (pointer, c_char_p), True): "device_execute_command",
    (None, (pointer, c_char_p, c_bool), True): "device_set_boolean_feature_value",
    (c_char_p, (pointer, c_char_p), True): "device_get_string_feature_value",
    (None, (pointer, c_char_p, c_char_p), True): "device_set_string_feature_value",
    (
        c_int64,
        (pointer, c_char_p),
        True,
    ): "device_get_integer_feature_value device_get_integer_feature_increment",
    (None, (pointer, c_char_p, c_int64), True): "device_set_integer_feature_value",
    (
        None,
        (pointer, c_char_p, POINTER(c_int64), POINTER(c_int64)),
        True,
    ): "device_get_integer_feature_bounds",
    (c_double, (pointer, c_char_p), True): "device_get_float_feature_value",
    (None, (pointer, c_char_p, c_double), True): "device_set_float_feature_value",
    (
        None,
        (pointer, c_char_p, POINTER(c_double), POINTER(c_double)),
        True,
    ): "device_get_float_feature_bounds",
    (
        POINTER(c_char_p),
        (pointer, c_char_p, POINTER(c_uint)),
        True,
    ): "device_dup_available_enumeration_feature_values_as_strings",
    (c_int, (pointer, c_char_p), False): "device_get_feature_access_mode",
}
CALLS = {name: signature for signature, names in SIGNATURES.items() for name in names.split()}
# not in every 0.8; call() then answers None
NEWER = {"buffer_get_image_padding", "device_get_feature_access_mode"}
KINDS = {
    "choice": "enumeration",
    "bool": "boolean",
    "command": "command",
    "float": "float",
    "int": "integer",
}
READ_ONLY = 0  # of Aravis' access modes; it calls some "write only" that can be read very well

# by kind: type in the function's name, and its conversion
SETTERS: dict[str, tuple[str, Callable[..., object]]] = {
    "choice": ("string", lambda value: str(value).encode()),
    "bool": ("boolean", bool),
    "int": ("integer", int),
    "float": ("float", float),
}


class _GError(ctypes.Structure):
    _fields_ = (("domain", c_uint32), ("code", c_int), ("message", c_char_p))


class AravisError(Exception):
    """An error that the library reports."""


class Aravis:
    """The library. call() raises AravisError; the rest is GLib's bookkeeping."""

    def __init__(self) -> None:
        self._aravis = ctypes.CDLL(NAME)
        self._glib, self._gobject = (
            ctypes.CDLL("libglib-2.0.so.0"),
            ctypes.CDLL("libgobject-2.0.so.0"),
        )
        self._glib.g_error_free.argtypes = self._glib.g_free.argtypes = (pointer,)
        self._gobject.g_object_unref.argtypes = (pointer,)
        self._gobject.g_type_check_instance_is_a.argtypes = (pointer, c_size_t)
        self._missing = {name for name in NEWER if not hasattr(self._aravis, f"arv_{name}")}
        for name, (result, arguments, fails) in CALLS.items():
            if name in self._missing:
                continue
            function = getattr(self._aravis, f"arv_{name}")
            function.restype = result
            function.argtypes = (*arguments, POINTER(POINTER(_GError))) if fails else arguments
        # Newer ones speak to makers' producers as well, which are others' code.
        for i in range(self.call("get_n_interfaces")):
            if self.call("get_interface_id", i) == b"GenTL":
                self.call("disable_interface", b"GenTL")
        self._types = {kind: self._type(name) for kind, name in KINDS.items()}

    def call(self, name: str, *arguments: Any) -> Any:
        if name in self._missing:
            return None
        function = getattr(self._aravis, f"arv_{name}")
        if not CALLS[name][2]:
            return function(*arguments)
        error = POINTER(_GError)()
        result = function(*arguments, byref(error))
        if error:
            message = text(error.contents.message)
            self._glib.g_error_free(error)
            raise AravisError(message)
        return result

    def kind(self, node: Any) -> str | None:
        """Return a camera node's kind: "choice", "bool", "command", "float" or "int"; None for another kind."""
        is_a = self._gobject.g_type_check_instance_is_a
        return next((kind for kind, type_id in self._types.items() if is_a(node, type_id)), None)

    def choices(self, device: Any, name: bytes) -> tuple[str, ...]:
        count = c_uint()
        found = self.call(
            "device_dup_available_enumeration_feature_values_as_strings", device, name, byref(count)
        )
        try:
            return tuple(text(found[i]) for i in range(min(count.value, 200)))
        finally:
            self._glib.g_free(found)

    def bounds(self, kind: str, device: Any, name: bytes) -> tuple[Any, Any]:
        low, high = (c_double(), c_double()) if kind == "float" else (c_int64(), c_int64())
        called = "float" if kind == "float" else "integer"
        self.call(f"device_get_{called}_feature_bounds", device, name, byref(low), byref(high))
        return low.value, high.value

    def unref(self, thing: Any) -> None:
        self._gobject.g_object_unref(thing)

    def _type(self, name: str) -> int:
        function = getattr(self._aravis, f"arv_gc_{name}_get_type")
        function.restype = c_size_t
        return function()


@lru_cache(1)
def aravis() -> Aravis:
    """Load the library once; Unavailable where it is not installed, or too old."""
    try:
        return Aravis()
    except (OSError, AttributeError):
        raise Unavailable(
            say("industrial.no-aravis", "Cameras of this kind need the library Aravis 0.8."),
            FIX,
            reason="no-aravis",
        ) from None


def text(raw: bytes | None) -> str:
    """Return a camera's own text, printable."""
    return "".join(c for c in (raw or b"").decode("utf-8", "replace") if c.isprintable())[
        :200
    ].strip()


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
            raise BadInput(
                f"The camera refuses {name} = {value}.",
                f"Camera message: {str(error).rstrip('.')}.",
                reason="bad-control",
            ) from None

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
