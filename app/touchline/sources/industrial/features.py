"""What can be set on an industrial camera: exposure, gain, white balance, size and rate, by their standard names.

Every such camera describes itself by named nodes (GenICam), and a convention says what the nodes are called (SFNC,
Standard Features Naming Convention), with older names beside the newer. Whoever talks to cameras hands in the nodes;
here they become Controls and back.
"""

from dataclasses import dataclass
from typing import Any, Protocol

from touchline.sources import Control
from touchline.sources.lifecycle import is_number, refused_value, unknown_control

UNBOUNDED = 1e18  # no camera counts so far; NaN and infinity are not below it either


@dataclass(frozen=True)
class Node:
    """One named value of a camera, as it is now. range, step: of a number; choices: of a choice."""

    kind: str  # "int", "float", "bool", "choice" or "command"
    value: Any
    writable: bool = True
    range: tuple[float, float] | None = None
    step: float = 0.0
    unit: str = ""
    choices: tuple[str, ...] = ()


class NodeMap(Protocol):
    """A camera's named values."""

    def get(self, name: str) -> Node | None:
        """None where the camera has no such node, or cannot say its value now."""

    def set(self, name: str, value: Any) -> None:
        """BadInput when the camera refuses; a command is run, whatever the value."""


@dataclass(frozen=True)
class Feature:
    """One control. names: its node, the newest name first. auto: the node that hands it to the camera.

    enable: must be true for the node to count. which: (selector, entry) that the node speaks of. resizes: changes the
    picture's size, which no camera allows while it sends pictures.
    """

    name: str
    label: str
    names: tuple[str, ...]
    unit: str = ""
    auto: str = ""
    enable: tuple[str, ...] = ()
    which: tuple[str, str] | None = None
    resizes: bool = False


FEATURES = {
    one.name: one
    for one in (
        Feature(
            "exposure",
            "Exposure time",
            ("ExposureTime", "ExposureTimeAbs", "ExposureTimeRaw"),
            "µs",
            "ExposureAuto",
        ),
        Feature("gain", "Gain", ("Gain", "GainRaw"), "", "GainAuto"),
        Feature(
            "white_balance_red",
            "White balance, red",
            ("BalanceRatio", "BalanceRatioAbs"),
            "",
            "BalanceWhiteAuto",
            which=("BalanceRatioSelector", "Red"),
        ),
        Feature(
            "white_balance_blue",
            "White balance, blue",
            ("BalanceRatio", "BalanceRatioAbs"),
            "",
            "BalanceWhiteAuto",
            which=("BalanceRatioSelector", "Blue"),
        ),
        Feature("width", "Width", ("Width",), "px", resizes=True),
        Feature("height", "Height", ("Height",), "px", resizes=True),
        Feature(
            "frame_rate",
            "Frame rate",
            ("AcquisitionFrameRate", "AcquisitionFrameRateAbs"),
            "Hz",
            "AcquisitionFrameRateAuto",
            ("AcquisitionFrameRateEnable", "AcquisitionFrameRateEnabled"),
        ),
    )
}


def controls_of(nodes: NodeMap) -> tuple[Control, ...]:
    """Everything that can be set on this camera, read back from it."""
    found = (read_control(nodes, feature) for feature in FEATURES.values())
    return tuple(control for control in found if control is not None)


def finite_range(low: float, high: float) -> tuple[float, float] | None:
    """(least, most); None where the camera has no bound, for which some give the largest number there is."""
    return (low, high) if abs(low) < UNBOUNDED and abs(high) < UNBOUNDED else None


def read_control(nodes: NodeMap, feature: Feature) -> Control | None:
    """One control as it is now; None where this camera has none of that kind, or none that can be set."""
    found = _node_of(nodes, feature)
    if found is None:
        return None
    _, node = found
    automatic = _automatic(nodes, feature)
    settable = (
        node.writable
        or automatic is not None
        or feature.resizes
        or _enable_of(nodes, feature) is not None
    )
    if not settable or not abs(node.value) < UNBOUNDED:
        return None
    unit = "µs" if node.unit == "us" else node.unit or feature.unit
    return Control(
        feature.name, feature.label, node.kind, node.value, unit, node.range, (), automatic
    )


def write_control(nodes: NodeMap, name: str, value: Any) -> Control:
    """Set one, and what it is then; NotFound where the camera lacks it, BadInput for a value it cannot have.

    Numbers between the camera's steps go to the nearest step.
    """
    feature = FEATURES.get(name)
    found = _node_of(nodes, feature) if feature else None
    if feature is None or found is None:
        raise unknown_control(name, (control.name for control in controls_of(nodes)))
    place, node = found
    automatic = _automatic(nodes, feature)
    if value == "auto":
        if automatic is None:
            raise refused_value(feature.label, repr(value)[:40], _allowed(node))
        nodes.set(feature.auto, "Continuous")
    else:
        number = _number(feature, node, value)
        if automatic:
            nodes.set(feature.auto, "Off")
        if enable := _enable_of(nodes, feature):
            nodes.set(enable, True)
        nodes.set(place, number)
    control = read_control(nodes, feature)
    if control is None:
        raise unknown_control(name, (control.name for control in controls_of(nodes)))
    return control


def _node_of(nodes: NodeMap, feature: Feature) -> tuple[str, Node] | None:
    if feature.which:
        selector, entry = feature.which
        node = nodes.get(selector)
        if node is None or entry not in node.choices:
            return None
        if node.value != entry:
            nodes.set(selector, entry)
    for name in feature.names:
        node = nodes.get(name)
        if node is not None and node.kind in ("int", "float"):
            return name, node
    return None


def _automatic(nodes: NodeMap, feature: Feature) -> bool | None:
    node = nodes.get(feature.auto) if feature.auto else None
    if node is None or not {"Off", "Continuous"} <= set(node.choices):
        return None
    return node.value != "Off"


def _enable_of(nodes: NodeMap, feature: Feature) -> str | None:
    return next(
        (name for name in feature.enable if (node := nodes.get(name)) and node.kind == "bool"), None
    )


def _number(feature: Feature, node: Node, value: Any) -> float | int:
    low, high = node.range or (-UNBOUNDED, UNBOUNDED)
    if not is_number(value, low, high) or not abs(value) < UNBOUNDED:
        raise refused_value(feature.label, repr(value)[:40], _allowed(node))
    if node.kind == "float":
        return float(value)
    if not node.range or node.step <= 1:
        return round(value)
    steps = min(round((value - low) / node.step), int((high - low) // node.step))
    return int(low + steps * node.step)


def _allowed(node: Node) -> str:
    return (
        f"a number from {node.range[0]:.10g} to {node.range[1]:.10g}" if node.range else "a number"
    )
