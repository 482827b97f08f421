"""axe-core in a real page: what keeps people out who do not see, or do not use a mouse."""

from pathlib import Path

from tests.support.npm import PACKAGES, install_packages

GRAVE = ("serious", "critical")


def axe_path() -> Path:
    """Return axe.min.js as static/package-lock.json pins it; fetched from npm once."""
    install_packages()
    return PACKAGES / "axe-core" / "axe.min.js"


def grave(page) -> list[str]:
    """What axe calls serious or critical on the page as it stands, one line each."""
    found = page.evaluate("() => axe.run({ resultTypes: ['violations'] })")["violations"]
    return [
        f"{v['impact']} {v['id']}: {node['html'][:160]} ({node['failureSummary'].splitlines()[-1].strip()[:120]})"
        for v in found
        if v["impact"] in GRAVE
        for node in v["nodes"]
    ]
