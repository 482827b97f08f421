"""The build brings the page's libraries: just the files that the lock file pins, whole or not at all."""

import base64
import hashlib
import json
import re
import shutil
import subprocess
import tarfile
import zipfile
from pathlib import Path

import pytest

from tests.support.installed import python_with_pip
from tests.support.page_build import page_build
from tests.support.paths import NOT_OURS, ROOT, STATIC

PINNED = ("package.json", "package-lock.json", ".npmrc")
NOWHERE = "http://127.0.0.1:9"  # nobody listens there


@pytest.fixture(scope="module")
def build():
    return page_build()


def bare(folder: Path) -> Path:
    """A static/ that has only what the build reads."""
    folder.mkdir(parents=True)
    for name in PINNED:
        shutil.copyfile(STATIC / name, folder / name)
    return folder


@pytest.fixture(scope="module")
def built(build, tmp_path_factory):
    """One that the build has filled."""
    static = bare(tmp_path_factory.mktemp("built") / "static")
    build.bring_vendor(static)
    return static


@pytest.fixture
def copy(tmp_path):
    """One that is filled as the page that is served here is."""
    static = bare(tmp_path / "static")
    shutil.copytree(STATIC / "vendor", static / "vendor")
    return static


def files(vendor: Path) -> dict[str, bytes]:
    return {str(p.relative_to(vendor)): p.read_bytes() for p in vendor.rglob("*") if p.is_file()}


def test_the_packages_are_pinned_to_one_version_each():
    lock = json.loads((STATIC / "package-lock.json").read_text())["packages"]
    package = json.loads((STATIC / "package.json").read_text())
    for wanted in ("dependencies", "devDependencies"):
        assert package[wanted] == lock[""][wanted]
        for name, version in package[wanted].items():
            pinned = version.rpartition("@")[2]  # of one that is called otherwise here
            assert lock[f"node_modules/{name}"]["version"] == pinned  # a number, not a range


@pytest.mark.long
def test_every_file_is_byte_for_byte_that_of_the_pinned_package(build, built, tmp_path):
    """Packed anew by `npm pack`, checked against the lock's sum here, and unpacked by us."""
    lock = json.loads((STATIC / "package-lock.json").read_text())["packages"]
    vendor = files(built / "vendor")
    assert set(vendor) == {*build.FILES, "COMPLETE"}
    packages = {
        "/".join(source.split("/")[: 2 if source.startswith("@") else 1])
        for source in build.FILES.values()
    }
    for name in sorted(packages):
        entry = lock[f"node_modules/{name}"]
        done = build.run_npm(
            [
                "pack",
                f"{name}@{entry['version']}",
                "--silent",
                "--ignore-scripts",
                "--pack-destination",
                str(tmp_path),
            ],
            cwd=tmp_path,
        )
        assert done.returncode == 0, done.stderr
        archive = tmp_path / done.stdout.strip().splitlines()[-1]
        kind, _, digest = entry["integrity"].partition("-")
        assert (
            base64.b64encode(hashlib.new(kind, archive.read_bytes()).digest()).decode() == digest
        ), name
        with tarfile.open(archive) as tar:
            for goal, source in build.FILES.items():
                if source.startswith(name + "/"):
                    inside = tar.extractfile(f"package/{source.removeprefix(name + '/')}")
                    assert vendor[goal] == inside.read(), goal


@pytest.mark.long
def test_the_page_that_is_served_here_has_these_very_files(built):
    assert files(STATIC / "vendor") == files(built / "vendor"), (
        "build the package again: pip install -e ."
    )


def test_what_is_complete_is_not_fetched_again(build, copy, monkeypatch):
    monkeypatch.setenv("npm_config_registry", NOWHERE)
    monkeypatch.setenv("npm_config_cache", str(copy.parent / "cache"))
    before = {p: p.stat().st_mtime_ns for p in (copy / "vendor").rglob("*")}
    build.bring_vendor(copy)
    assert {p: p.stat().st_mtime_ns for p in (copy / "vendor").rglob("*")} == before


@pytest.mark.long
@pytest.mark.parametrize("harm", ["lost", "old"])
def test_what_is_not_complete_is_made_whole(build, built, copy, harm):
    if harm == "lost":
        (copy / "vendor" / "preact.js").unlink()
    else:
        (copy / "vendor" / "COMPLETE").write_text("of another lock file\n")
        (copy / "vendor" / "left-over.js").write_text("")
    build.bring_vendor(copy)
    assert files(copy / "vendor") == files(built / "vendor")


def test_without_the_registry_it_says_what_to_do_and_leaves_nothing_by_half(
    build, tmp_path, monkeypatch
):
    static = bare(tmp_path / "static")
    for name, value in (
        ("registry", NOWHERE),
        ("cache", str(tmp_path / "cache")),
        ("fetch_retries", "0"),
    ):
        monkeypatch.setenv(f"npm_config_{name}", value)
    with pytest.raises(SystemExit) as refused:
        build.bring_vendor(static)
    assert "npm_config_registry" in str(refused.value) and str(static / "vendor") in str(
        refused.value
    )
    assert sorted(p.name for p in static.iterdir()) == sorted(PINNED)


def test_a_package_that_is_not_the_pinned_one_is_refused_and_the_old_ones_stay(build, copy):
    """As if somebody had put another package under the same version."""
    before = files(copy / "vendor")
    lock = json.loads((copy / "package-lock.json").read_text())
    other = base64.b64encode(hashlib.sha512(b"another package").digest()).decode()
    lock["packages"]["node_modules/htm"]["integrity"] = f"sha512-{other}"
    (copy / "package-lock.json").write_text(json.dumps(lock))
    with pytest.raises(SystemExit):
        build.bring_vendor(copy)
    assert files(copy / "vendor") == before
    assert sorted(p.name for p in copy.iterdir()) == sorted((*PINNED, "vendor"))


@pytest.fixture(scope="module")
def bundled(build, tmp_path_factory):
    """The page's own sources and libraries, bundled."""
    static = tmp_path_factory.mktemp("bundled") / "static"
    shutil.copytree(STATIC, static, ignore=shutil.ignore_patterns("built", ".built-*", ".vendor-*"))
    build.build_page(static)
    return static


def test_the_bundle_is_made_of_every_module_and_sheet_and_of_nothing_else(build, bundled):
    assert build.is_fresh(bundled)
    made_of = json.loads((bundled / "built" / "SOURCES.json").read_text())
    ours = {
        p.relative_to(STATIC).as_posix()
        for p in STATIC.rglob("*")
        if p.suffix in (".js", ".css")
        and not NOT_OURS & {*p.relative_to(STATIC).parts}
        and not p.relative_to(STATIC).parts[0].startswith(".")
    }
    assert set(made_of) == {*ours, "index.html", "vendor/COMPLETE"}
    page = (bundled / "built" / "index.html").read_text()
    for asked in ("built/page/main.js", "built/page/main.css"):
        assert f'"{asked}"' in page and (bundled / asked).stat().st_size > 40_000
    assert page.count("stylesheet") == page.count("<script type=") == 1 and "importmap" not in page
    script = (bundled / "built" / "page" / "main.js").read_text()
    chunks = sorted((bundled / "built" / "page").glob("*-*.js"))
    for part in (script, *(chunk.read_text() for chunk in chunks)):
        assert not re.search(r'\}from"(?!\./)', part)  # nothing that the map would have to find
    assert "../stream_worker.js" in script  # beside the folder that it lies in
    assert "Kameragruppe" not in script and any(
        "Kameragruppe" in chunk.read_text() for chunk in chunks
    )
    assert (bundled / "built" / "stream_worker.js").stat().st_size < 10_000
    assert sorted(p.name for p in (bundled / "built").iterdir()) == [
        "SOURCES.json",
        "index.html",
        "page",
        "stream_worker.js",
    ]


def test_a_changed_source_makes_another_bundle_and_a_broken_one_leaves_the_old(
    build, bundled, tmp_path
):
    static = tmp_path / "static"
    shutil.copytree(bundled, static)
    before = files(static / "built")
    with (static / "css" / "base.css").open("a") as sheet:
        sheet.write(".never-seen { color: #123456; }\n")
    assert not build.is_fresh(static)
    build.build_page(static)
    assert build.is_fresh(static)
    assert "#123456" in (static / "built" / "page" / "main.css").read_text()
    changed = files(static / "built")
    assert changed != before
    (static / "main.js").write_text("import from nowhere")
    with pytest.raises(build.NotBuilt, match=r"main\.js"):
        build.build_page(static)
    assert files(static / "built") == changed
    assert not [p for p in static.iterdir() if p.name.startswith(".built-")]


def test_a_bundle_that_does_not_name_its_libraries_is_made_again(build, bundled, tmp_path):
    """As earlier builds made it: with the lock file, which is not installed, so it would never be served."""
    static = tmp_path / "static"
    shutil.copytree(bundled, static)
    named = static / "built" / "SOURCES.json"
    sources = json.loads(named.read_text())
    del sources["vendor/COMPLETE"]
    named.write_text(
        json.dumps({**sources, "package-lock.json": build.digest_of(static / "package-lock.json")})
    )
    assert not build.is_fresh(static)


@pytest.mark.long
def test_the_wheel_carries_the_page_with_its_libraries_and_the_configs(built, tmp_path):
    """The whole way: a checkout without libraries, built by pip in its own room."""
    checkout = tmp_path / "checkout"
    checkout.mkdir()
    for name in ("pyproject.toml", "hatch_build.py", "README.md", "LICENSE"):
        shutil.copyfile(ROOT / name, checkout / name)
    for name in ("app", "static", "configs"):
        shutil.copytree(
            ROOT / name,
            checkout / name,
            ignore=shutil.ignore_patterns(
                "vendor", "built", ".vendor-*", ".built-*", "__pycache__"
            ),
        )
    done = subprocess.run(
        [
            python_with_pip(),
            "-m",
            "pip",
            "wheel",
            "--no-deps",
            "--quiet",
            "--disable-pip-version-check",
            "-w",
            tmp_path / "out",
            checkout,
        ],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    (wheel,) = (tmp_path / "out").glob("touchline-*.whl")
    with zipfile.ZipFile(wheel) as packed:
        inside = set(packed.namelist())
        for name, content in files(built / "vendor").items():
            assert packed.read(f"touchline/_static/vendor/{name}") == content, name
    assert {
        f"touchline/_static/{name}"
        for name in ("built/index.html", "built/page/main.js", "built/SOURCES.json")
    } <= inside
    assert {
        "touchline/_static/index.html",
        "touchline/_static/main.js",
        "touchline/_configs/touchline.yaml",
        "touchline/_configs/fields/ssl-div-b.yaml",
        "touchline/workflows/calibration.py",
        "touchline/api/templates/login.html",
        "touchline/report/templates/report.html",
        "touchline/report/templates/report.css",
    } <= inside
    assert not any("node_modules" in name or "/tests/" in name for name in inside)
