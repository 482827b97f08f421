"""The page's files: all there, asked for at once, never out of a folder of their own, new as soon as they are."""

import hashlib
import json
import re

import pytest
from starlette.applications import Starlette
from starlette.responses import PlainTextResponse
from starlette.routing import Route
from starlette.testclient import TestClient

from tests.support.paths import NOT_OURS
from touchline.api.middleware.page_files import PageFiles, modules_of
from touchline.installation import shipped

STATIC = shipped("static")


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "own").mkdir()
    (tmp_path / "secret.js").write_text("secret")
    (tmp_path / "own" / ".hidden.js").write_text("hidden")
    (tmp_path / "own" / "main.js").write_text("one();")
    return tmp_path / "own"


@pytest.fixture
def shelf(folder):
    app = Starlette(
        routes=[Route("/{rest:path}", lambda request: PlainTextResponse("the application"))]
    )
    return TestClient(PageFiles(app, folder))


def test_the_page_asks_for_every_module_that_it_loads_at_once_and_gets_it(standing):
    page = standing.get("/index.html")
    asked = re.findall(r'<link rel="modulepreload" href="([^"]+)">', page.text)
    assert (
        asked[0] == "main.js"
        and "vendor/preact.js" in asked
        and "features/league/panels/network.js" in asked
    )
    assert len(asked) == len(set(asked)) > 100
    for name in asked:
        answer = standing.get(f"/{name}")
        assert answer.status_code == 200 and answer.headers["content-type"].startswith(
            "text/javascript"
        ), name
        assert answer.content == (STATIC / name).read_bytes()
    assert (
        page.text.index("importmap")
        < page.text.index("modulepreload")
        < page.text.index('src="main.js"')
    )


LATER = {"features/live/stream_worker.js", "features/help/panels/help.js", "ui/plot.js"}


def test_what_is_preloaded_is_what_is_imported():
    """Counted another way: every module of ours but other languages and those loaded when first needed."""
    html = (STATIC / "index.html").read_text()
    ours = {
        p.relative_to(STATIC).as_posix()
        for p in STATIC.rglob("*.js")
        if not NOT_OURS & {*p.relative_to(STATIC).parts}
    }
    languages = {
        name
        for name in ours
        if name.startswith("core/words/") and not name.startswith("core/words/en")
    }
    assert len(languages) > 30
    assert ours - set(modules_of(html, STATIC)) == {*languages, *LATER}


def test_a_file_that_has_changed_is_sent_anew_and_one_that_has_not_is_not_sent_again(shelf, folder):
    first = shelf.get("/main.js")
    assert (first.text, first.headers["cache-control"]) == ("one();", "no-cache")
    again = shelf.get("/main.js", headers={"If-None-Match": first.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")
    (folder / "main.js").write_text("two();")
    changed = shelf.get("/main.js", headers={"If-None-Match": first.headers["etag"]})
    assert (changed.status_code, changed.text) == (200, "two();")


def test_the_bundle_is_the_page_until_a_source_of_it_changes(shelf, folder):
    (folder / "index.html").write_text("modules")
    assert shelf.get("/").text == "modules"  # nothing is built yet
    (folder / "built").mkdir()
    (folder / "built" / "index.html").write_text("bundle")
    (folder / "built" / "SOURCES.json").write_text(
        json.dumps({"main.js": hashlib.sha256(b"one();").hexdigest()})
    )
    assert shelf.get("/").text == "bundle"
    assert shelf.get("/index.html").text == "modules"
    (folder / "main.js").write_text("two();")
    assert shelf.get("/").text == "modules"
    (folder / "main.js").write_text("one();")
    assert shelf.get("/").text == "bundle"
    (folder / "main.js").unlink()
    assert shelf.get("/").text == "modules"
    (folder / "built" / "SOURCES.json").write_text("{ torn")
    assert shelf.get("/").text == "modules"


def test_texts_are_compressed_for_who_takes_it_and_are_other_things_to_a_cache(shelf, folder):
    script = b"two();" * 1000
    (folder / "long.js").write_bytes(script)
    plain = shelf.get("/long.js", headers={"Accept-Encoding": "identity"})
    packed = shelf.get("/long.js", headers={"Accept-Encoding": "br, gzip"})
    assert plain.content == packed.content == script
    assert "content-encoding" not in plain.headers and packed.headers["content-encoding"] == "gzip"
    assert int(packed.headers["content-length"]) < len(script) / 10
    assert plain.headers["etag"] != packed.headers["etag"]
    assert plain.headers["vary"] == packed.headers["vary"] == "Accept-Encoding"
    again = shelf.get(
        "/long.js", headers={"Accept-Encoding": "gzip", "If-None-Match": packed.headers["etag"]}
    )
    assert (again.status_code, again.content) == (304, b"")
    other = shelf.get(
        "/long.js", headers={"Accept-Encoding": "identity", "If-None-Match": packed.headers["etag"]}
    )
    assert (other.status_code, other.content) == (200, script)
    refused = shelf.get("/long.js", headers={"Accept-Encoding": "gzip;q=0"})
    assert "content-encoding" not in refused.headers
    # too short
    assert (
        "content-encoding" not in shelf.get("/main.js", headers={"Accept-Encoding": "gzip"}).headers
    )


def test_a_head_has_the_length_and_no_body(shelf):
    answer = shelf.head("/main.js")
    assert (answer.content, answer.headers["content-length"]) == (b"", "6")


@pytest.mark.parametrize(
    "path",
    [
        "/../secret.js",
        "/%2e%2e/secret.js",
        "/..%2fsecret.js",
        "//secret.js",
        "/%2fetc/passwd",
        "/.hidden.js",
        "/main.js/",
        "/gone.js",
        "/main.js%00",
        "/..%5csecret.js",
        f"/{'a' * 5000}",
        "/%ff.js",
    ],
)
def test_nothing_else_is_to_be_had(shelf, path):
    assert shelf.get(path).text == "the application"


def test_what_is_sent_to_a_file_goes_on_to_the_application(shelf):
    assert shelf.post("/main.js").status_code == 405  # as the application says
