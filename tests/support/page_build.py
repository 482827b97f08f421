"""The hook that brings and bundles the page, as a module: it lies beside the project's own packages."""

import importlib.util
from types import ModuleType

from tests.support.paths import ROOT


def page_build() -> ModuleType:
    spec = importlib.util.spec_from_file_location("hatch_build", ROOT / "hatch_build.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
