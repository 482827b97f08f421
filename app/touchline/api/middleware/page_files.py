"""Serve the page's own files from memory: its bundle, or the modules it was made of where they have changed since."""

import hashlib
import json
import mimetypes
import os
import posixpath
import re
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from touchline.api.responses import revalidated
from touchline.services.answer_cache import CachedAnswer

IMPORTED = re.compile(r"""^(?:import|export)\b[^;"'(]*?["']([^"']+)["']""", re.MULTILINE)
IMPORT_MAP = re.compile(r'<script type="importmap">(.*?)</script>', re.DOTALL)
MAIN = '<script type="module" src="main.js">'
MODULES, BUNDLE, SOURCES = "/index.html", "/built/index.html", "/built/SOURCES.json"


@dataclass(frozen=True)
class PageFile:
    """One file as it was read."""

    answer: CachedAnswer
    changed_ns: int


class PageFiles:
    """Answer GET and HEAD for the files of the folder; everything else goes on to the application.

    A file is read and compressed at its first request, and again when it has changed. The page is its bundle, as
    long as every source is the one that it was made of: who edits a module sees it at the next load. Browsers may
    cache a file but must revalidate it (no-cache): modules of two versions of the page would not fit together. Names
    that begin with a dot are not served.
    """

    def __init__(self, app: ASGIApp, folder: Path) -> None:
        self.app, self.folder = app, folder
        self._cache: dict[str, PageFile] = {}
        self._digests: dict[str, tuple[int, str]] = {}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        found = (
            self._find(scope["path"])
            if scope["type"] == "http" and scope["method"] in ("GET", "HEAD")
            else None
        )
        if found is None:
            return await self.app(scope, receive, send)
        headers = {"Cache-Control": "no-cache"}
        await revalidated(Headers(scope=scope), found.answer, headers)(scope, receive, send)

    def _find(self, path: str) -> PageFile | None:
        if path == "/":
            path = BUNDLE if self._is_fresh() else MODULES
        parts = path.split("/")[1:]
        if any(not part or part.startswith(".") or "\\" in part or "\0" in part for part in parts):
            return None
        file = self.folder.joinpath(*parts)
        try:
            changed_ns = os.stat(file).st_mtime_ns
            cached = self._cache.get(path)
            if cached is None or cached.changed_ns != changed_ns:
                cached = self._cache[path] = self._read(file, changed_ns)
        except OSError:  # no such file, a folder, a name that is too long
            return None
        return cached

    def _is_fresh(self) -> bool:
        """Whether the bundle was made of the sources as they are."""
        made_of = self._find(SOURCES)
        try:
            sources = json.loads(made_of.answer.content) if made_of is not None else {}
        except ValueError:
            sources = {}
        return bool(sources) and all(
            self._digest(name) == digest for name, digest in sources.items()
        )

    def _digest(self, name: str) -> str:
        try:
            changed_ns = os.stat(file := self.folder / name).st_mtime_ns
            if self._digests.get(name, (0, ""))[0] != changed_ns:
                self._digests[name] = changed_ns, hashlib.sha256(file.read_bytes()).hexdigest()
        except OSError:
            return ""
        return self._digests[name][1]

    def _read(self, file: Path, changed_ns: int) -> PageFile:
        content = file.read_bytes()
        if file.suffix == ".html":
            content = with_preloads(content.decode(), file.parent).encode()
        kind = "text/javascript" if file.suffix == ".js" else mimetypes.guess_type(file.name)[0]
        return PageFile(CachedAnswer.of(content, kind or "application/octet-stream"), changed_ns)


def with_preloads(html: str, folder: Path) -> str:
    """Return the page with a preload link for each module: the browser loads all at once, not level by level."""
    links = "".join(
        f'<link rel="modulepreload" href="{name}">\n' for name in modules_of(html, folder)
    )
    return html.replace(MAIN, links + MAIN, 1)


def modules_of(html: str, folder: Path) -> list[str]:
    """Return what main.js imports, directly or not, relative to the folder; the import map resolves bare names."""
    if MAIN not in html:
        return []
    import_map = IMPORT_MAP.search(html)
    bare = {
        name: target.removeprefix("./")
        for name, target in (json.loads(import_map[1])["imports"] if import_map else {}).items()
    }
    found: list[str] = []
    waiting = ["main.js"]
    while waiting:
        name = waiting.pop(0)
        if name in found or not (folder / name).is_file():
            continue
        found.append(name)
        beside = PurePosixPath(name).parent
        waiting += [
            bare.get(other) or posixpath.normpath(beside / other)
            for other in IMPORTED.findall((folder / name).read_text(encoding="utf-8"))
        ]
    return found
