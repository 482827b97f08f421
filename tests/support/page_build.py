"""The hook that brings and bundles the page, as a module: it lies beside the project's own packages."""

import importlib.util
import sys
from types import ModuleType

from tests.support.paths import ROOT


def page_build() -> ModuleType:
    """hatch_build.py. The builder it is called by lives in pip's own room; here only its base classes are wanted."""
    if "hatchling" not in sys.modules and importlib.util.find_spec("hatchling") is None:  # nor stands in for it yet
        for base, interface in (("BuildHookInterface", "hatchling.builders.hooks.plugin.interface"),
                                ("MetadataHookInterface", "hatchling.metadata.plugin.interface")):
            parts = interface.split(".")
            for end in range(1, len(parts) + 1):
                sys.modules.setdefault(name := ".".join(parts[:end]), ModuleType(name))
            vars(sys.modules[interface])[base] = object
    spec = importlib.util.spec_from_file_location("hatch_build", ROOT / "hatch_build.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
