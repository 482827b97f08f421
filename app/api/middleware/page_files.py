"""Serve the page's own files from memory: a page is some hundred and fifty modules, and loads only with all."""

import hashlib
import json
import mimetypes
import os
import posixpath
import re
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from starlette.responses import Response
from starlette.types import ASGIApp, Receive, Scope, Send

IMPORTED = re.compile(r"""^(?:import|export)\b[^;"']*?["']([^"']+)["']""", re.MULTILINE)
IMPORT_MAP = re.compile(r'<script type="importmap">(.*?)</script>', re.DOTALL)
MAIN = '<script type="module" src="main.js">'
NAMES = {"/": "/index.html"}


@dataclass(frozen=True)
class PageFile:
    """One file as it was read. etag: of its bytes."""

    content: bytes
    kind: str
    etag: str
    changed_ns: int


class PageFiles:
    """Answer GET and HEAD for the files of the folder; everything else goes on to the application.

    A file is read at its first request and again when it has changed. Browsers may cache it but must revalidate it
    (no-cache): modules of two versions of the page would not fit together. Names that begin with a dot are not served.
    """

    def __init__(self, app: ASGIApp, folder: Path) -> None:
        self.app, self.folder = app, folder
        self._cache: dict[str, PageFile] = {}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        found = self._find(scope["path"]) if scope["type"] == "http" and scope["method"] in ("GET", "HEAD") else None
        if found is None:
            return await self.app(scope, receive, send)
        headers = {"ETag": found.etag, "Cache-Control": "no-cache"}
        if dict(scope["headers"]).get(b"if-none-match", b"").decode("latin-1") == found.etag:
            return await Response(status_code=304, headers=headers)(scope, receive, send)
        await Response(found.content, media_type=found.kind, headers=headers)(scope, receive, send)

    def _find(self, path: str) -> PageFile | None:
        path = NAMES.get(path, path)
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

    def _read(self, file: Path, changed_ns: int) -> PageFile:
        content = file.read_bytes()
        if file.suffix == ".html":
            content = with_preloads(content.decode(), file.parent).encode()
        kind = "text/javascript" if file.suffix == ".js" else mimetypes.guess_type(file.name)[0]
        return PageFile(content, kind or "application/octet-stream",
                        f'"{hashlib.sha256(content).hexdigest()[:32]}"', changed_ns)


def with_preloads(html: str, folder: Path) -> str:
    """Return the page with a preload link for each module: the browser loads all at once, not level by level."""
    links = "".join(f'<link rel="modulepreload" href="{name}">\n' for name in modules_of(html, folder))
    return html.replace(MAIN, links + MAIN, 1)


def modules_of(html: str, folder: Path) -> list[str]:
    """Return what main.js imports, directly or not, relative to the folder; the import map resolves bare names."""
    if MAIN not in html:
        return []
    import_map = IMPORT_MAP.search(html)
    bare = {name: target.removeprefix("./") for name, target in
            (json.loads(import_map[1])["imports"] if import_map else {}).items()}
    found: list[str] = []
    waiting = ["main.js"]
    while waiting:
        name = waiting.pop(0)
        if name in found or not (folder / name).is_file():
            continue
        found.append(name)
        beside = PurePosixPath(name).parent
        waiting += [bare.get(other) or posixpath.normpath(beside / other)
                    for other in IMPORTED.findall((folder / name).read_text(encoding="utf-8"))]
    return found
