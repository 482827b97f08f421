"""Wheel and source archive, as somebody else builds and installs them: without a network, a home or rights to write."""

import email
import os
import re
import shutil
import socket
import subprocess
import sys
import tarfile
import tempfile
import tomllib
import zipfile
from pathlib import Path
from types import SimpleNamespace
from urllib.request import urlopen

import pytest
import yaml

from tests.support.installed import python_with_pip
from tests.support.page_build import page_build
from tests.support.paths import ROOT, STATIC
from tests.support.waiting import LONG_S

NOWHERE = "http://127.0.0.1:9"  # nobody listens there
NO_HOME = "/dev/null/home"  # nobody can make it, not even root
PROJECT = (
    "app",
    "configs",
    "static",
    "pyproject.toml",
    "hatch_build.py",
    "README.md",
    "LICENSE",
    ".gitignore",
)
BUILD_STEP = "import sys; from hatchling import build; getattr(build, sys.argv[1])(sys.argv[2])"
ANOTHER_USER = {"user": 65534, "group": 65534, "extra_groups": []} if os.geteuid() == 0 else {}


@pytest.fixture(scope="module")
def build():
    return page_build()


def test_links_of_the_readme_lead_to_the_repository_where_it_has_an_address(build):
    readme = "![Field](static/a.webp) [manual](static/help/api.md#calls) [other](https://example.org/) [below](#below)"
    assert build.addresses(readme, "") == {
        "readme": {"content-type": "text/markdown", "text": readme},
        "urls": {},
    }
    made = build.addresses(readme, "https://example.org/t")
    assert made["readme"]["text"] == (
        "![Field](https://example.org/t/raw/HEAD/static/a.webp) [manual](https://example.org/t/blob/HEAD/static/help/"
        "api.md#calls) [other](https://example.org/) [below](#below)"
    )
    pages = {name: url.partition("/blob/HEAD/")[2] for name, url in made["urls"].items()}
    assert set(pages) == {"Homepage", "Documentation", "Changelog", "Issues"}
    assert all((ROOT / page).exists() for page in pages.values())
    targets = [link[3] for link in build.RELATIVE_LINK.finditer((ROOT / "README.md").read_text())]
    assert len(targets) > 5
    assert [target for target in targets if not (ROOT / target.partition("#")[0]).exists()] == []


def test_npm_writes_into_the_build_where_there_is_no_home(build, tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", NO_HOME)
    monkeypatch.delenv("npm_config_cache", raising=False)
    for name, there in (("cache", tmp_path / "cache"), ("userconfig", tmp_path / ".npmrc")):
        assert build.run_npm(["config", "get", name], cwd=tmp_path).stdout.strip() == str(there)
    monkeypatch.setenv("npm_config_cache", "/var/somewhere")
    assert (
        build.run_npm(["config", "get", "cache"], cwd=tmp_path).stdout.strip() == "/var/somewhere"
    )


def test_a_registry_that_never_answers_is_told_as_that(build, tmp_path, monkeypatch):
    static = tmp_path / "static"
    static.mkdir()
    for name in ("package.json", "package-lock.json", ".npmrc"):
        shutil.copyfile(STATIC / name, static / name)
    monkeypatch.setattr(build, "NPM_LIMIT_S", 1.0)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        monkeypatch.setenv("npm_config_registry", f"http://127.0.0.1:{silent.getsockname()[1]}")
        monkeypatch.setenv("npm_config_cache", str(tmp_path / "cache"))
        with pytest.raises(
            SystemExit, match="stopped after 1 s: the registry answers slowly or not at all"
        ):
            build.bring_vendor(static)


def test_the_pythons_that_are_named_are_the_ones_that_are_tested():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    named = [
        line.rpartition(" ")[2]
        for line in project["classifiers"]
        if re.search(r"Python :: 3\.\d+$", line)
    ]
    jobs = yaml.safe_load((ROOT / ".github" / "workflows" / "ci.yml").read_text())["jobs"]
    matrix = jobs["tests"]["strategy"]["matrix"]
    assert named == matrix["python"] and project["requires-python"] == f">={named[0]}"
    lowest = [leg["python"] for leg in matrix["include"] if leg["libraries"] == "lowest"]
    assert lowest == jobs["package"]["strategy"]["matrix"]["python"] == [named[0], named[-1]]


def test_links_of_the_repository_s_own_pages_lead_somewhere():
    links = [
        page.parent / target
        for page in (ROOT / ".github").rglob("*.md")
        for target in re.findall(r"\]\(([^)#]+)[^)]*\)", page.read_text())
    ]
    assert len(links) > 5
    assert [link for link in links if not link.exists()] == []


def test_the_container_is_built_of_all_that_the_build_reads():
    recipe = (ROOT / "configs" / "service" / "Containerfile").read_text()
    copied = re.findall(r"^COPY (?!--from)(.+) \S+$", recipe, re.MULTILINE)
    assert sorted(" ".join(copied).split()) == sorted({*PROJECT} - {".gitignore"})


@pytest.fixture(scope="module")
def open_folder():
    """A folder that everybody may enter, under a name with a space and an umlaut."""
    with tempfile.TemporaryDirectory(prefix="touchline Süd ") as name:
        os.chmod(name, 0o755)
        yield Path(name)


def bare_environment() -> dict[str, str]:
    """Of a user without a home, whose system speaks no language."""
    return {
        "PATH": os.environ["PATH"],
        "LANG": "C",
        "HOME": NO_HOME,
        "npm_config_registry": NOWHERE,
    }


def run(*words: object, cwd: Path, env: dict[str, str] | None = None, **user: object) -> str:
    done = subprocess.run(
        [*map(str, words)], cwd=cwd, env=env, capture_output=True, text=True, **user
    )
    assert done.returncode == 0, f"{words}\n{done.stdout[-2000:]}\n{done.stderr[-4000:]}"
    return done.stdout


@pytest.fixture(scope="module")
def built(open_folder):
    """Source archive and wheel; the wheel is built from the archive alone, where there is no npm nor registry."""
    checkout, out, unpacked = (open_folder / name for name in ("Größe", "out", "unpacked"))
    checkout.mkdir()
    without = shutil.ignore_patterns("__pycache__", "built", ".built-*")
    for name in PROJECT:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, checkout / name, ignore=without)
        else:
            shutil.copyfile(ROOT / name, checkout / name)
    # The bundle is made anew here, in a folder with such a name: npm brings esbuild
    environment = {**os.environ, "TOUCHLINE_REPOSITORY": "https://example.org/touchline"}
    run(sys.executable, "-c", BUILD_STEP, "build_sdist", out, cwd=checkout, env=environment)
    (archive,) = out.glob("*.tar.gz")
    with tarfile.open(archive) as packed:
        packed.extractall(unpacked, filter="data")
    (source,) = unpacked.iterdir()
    run(sys.executable, "-c", BUILD_STEP, "build_wheel", out, cwd=source, env=bare_environment())
    (wheel,) = out.glob("*.whl")
    return SimpleNamespace(archive=archive, source=source, wheel=wheel)


@pytest.mark.long
def test_a_wheel_of_the_source_archive_has_libraries_bundle_and_licences_and_no_build_files(built):
    with zipfile.ZipFile(built.wheel) as packed:
        inside = set(packed.namelist())
        (name,) = (name for name in inside if name.endswith(".dist-info/METADATA"))
        metadata = email.message_from_bytes(packed.read(name))
    page = {
        name.removeprefix("touchline/_static/")
        for name in inside
        if name.startswith("touchline/_static/")
    }
    assert {"index.html", "built/page/main.js", "built/SOURCES.json", "vendor/preact.js"} <= page
    assert not [
        name for name in page if re.search(r"(^|/)\.|\.d\.ts$|package.*\.json$|tsconfig", name)
    ]
    licences = {
        f"static/vendor/licences/{file.name}" for file in (STATIC / "vendor" / "licences").iterdir()
    }
    assert {"LICENSE", *licences} == set(metadata.get_all("License-File"))
    assert {
        f"{name.rpartition('/')[0]}/licenses/{file}" for file in ("LICENSE", *licences)
    } <= inside
    # Kept by the archive: the wheel was built without the address
    assert "Issues, https://example.org/touchline/issues" in metadata.get_all("Project-URL")
    assert "(https://example.org/touchline/raw/HEAD/static/help/img/" in metadata.get_payload()


def reachable_python() -> Path:
    """Return one that another user may start too."""
    for python in (Path(sys.base_prefix, "bin", "python3"), Path("/usr/bin/python3")):
        try:
            run(
                python,
                "-c",
                "import sys; assert sys.version_info >= (3, 11)",
                cwd=Path("/"),
                **ANOTHER_USER,
            )
            return python
        except (OSError, AssertionError):
            continue
    pytest.fail("no Python that another user may start: install the package python3")


@pytest.mark.long
def test_it_runs_from_a_wheelhouse_for_a_user_without_home_or_rights(built, open_folder):
    house, room, data = (open_folder / name for name in ("house", "room", "data"))
    run(reachable_python(), "-m", "venv", "--without-pip", room, cwd=open_folder)
    run(
        python_with_pip(),
        "-m",
        "pip",
        "--python",
        room,
        "wheel",
        "-q",
        "-w",
        house,
        built.wheel,
        cwd=open_folder,
    )
    run(
        python_with_pip(),
        "-m",
        "pip",
        "--python",
        room,
        "install",
        "-q",
        "--no-index",
        "--find-links",
        house,
        "touchline",
        cwd=open_folder,
        env=bare_environment(),
    )
    for path in (room, *room.rglob("*")):
        if not path.is_symlink():
            path.chmod(path.stat().st_mode & ~0o222)
    data.mkdir()
    data.chmod(0o777)
    options = {"cwd": data, "env": bare_environment(), **ANOTHER_USER}
    program = room / "bin" / "touchline"
    assert re.fullmatch(r"touchline \d+\.\d+\.\d+\n", run(program, "--version", **options))
    server = subprocess.Popen(
        [program, "demo", "--port", "0", "--data", data / "demo"],
        **options,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        url = re.search(r"http://127\.0\.0\.1:\d+", server.stdout.readline())[0]
        with urlopen(f"{url}/", timeout=LONG_S) as page:
            assert b"built/page/main.js" in page.read()  # the bundle
        with urlopen(f"{url}/api/v1/cameras", timeout=LONG_S) as cameras:
            assert b"Overhead camera" in cameras.read()
    finally:
        server.terminate()
        server.wait(timeout=LONG_S)
        server.stdout.close()
