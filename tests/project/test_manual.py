"""The manual explains what the page shows: every model, option and warning; no link of it leads nowhere."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

from tests.support.manual_pictures import PICTURES
from tests.support.paths import HELP, PACKAGE, ROOT, STATIC, TESTS
from tests.support.words import CATALOGUES
from touchline.fitting import FITTERS
from touchline.models import MODELS

PAGES = sorted(HELP.glob("*.md"))
WITHOUT_A_PICTURE = {"industrial-cameras.md"}  # the tests have no such camera to take one of
LINK = re.compile(r"\]\(([\w-]+\.md)(?:#([\w-]+))?\)")
PICTURE = re.compile(r"!\[([^\]]*)\]\(((?:static/help/)?img/[\w.-]+)\)")
README_PICTURE_BYTES = 90_000
ITALICS = re.compile(r"(?<![*\w])\*([^*]+)\*(?![*\w])")
# read when there is little time: what to press must be there as it is written
IN_A_HURRY = [
    "accuracy.md",
    "calibrating.md",
    "drift.md",
    "fields.md",
    "rigs.md",
    "troubleshooting.md",
]
TARGET = re.compile(r'"([\w-]+\.md)(?:#([\w-]+))?"')


def slug(heading: str) -> str:
    """As static/core/manual.js makes it, so that links lead to headings."""
    return re.sub(r"[^\w]+|_", "-", re.sub(r"[`*]", "", heading).lower()).strip("-")


def headings(page: str) -> set[str]:
    return {
        slug(text)
        for text in re.findall(r"^#{1,4} +(.+)$", (HELP / page).read_text(), re.MULTILINE)
    }


def section(page: str, title: str) -> str:
    found = re.search(
        rf"^## {re.escape(title)}\n(.*?)(?=^## |\Z)",
        (HELP / page).read_text(),
        re.MULTILINE | re.DOTALL,
    )
    assert found, f"{page} has no section called {title}"
    return found[1]


@cache
def calls() -> list[tuple[Path, ast.Call]]:
    """Each call in app/, with the file that it stands in."""
    return [
        (source, node)
        for source in sorted((PACKAGE).rglob("*.py"))
        for node in ast.walk(ast.parse(source.read_text()))
        if isinstance(node, ast.Call)
    ]


def warnings_made() -> set[str]:
    return {
        node.args[0].value
        for _, node in calls()
        if getattr(node.func, "id", "") == "Warning"
        and node.args
        and isinstance(node.args[0], ast.Constant)
    }


@pytest.mark.parametrize("name", MODELS)
def test_every_model_has_a_section_of_its_own(name):
    assert len(section("models.md", MODELS[name].TITLE).split()) > 30


@pytest.mark.parametrize("name", FITTERS)
def test_every_option_is_explained(name):
    explained = section("models.md", "Options")
    assert [
        option.name for option in FITTERS[name].OPTIONS if f"`{option.name}`" not in explained
    ] == []


def test_every_warning_is_explained():
    text = (HELP / "warnings.md").read_text()
    reasons = sorted(warnings_made())
    assert len(reasons) > 20
    for reason in reasons:
        row = re.search(rf"^\|[^|\n]*`{reason}`[^|\n]*\|(.+)\|(.+)\|$", text, re.MULTILINE)
        assert row, f"{reason} stands in no table of warnings.md"
        assert all(
            len(cell.split()) > 1 or cell.strip() in ("tape it",) for cell in row.groups()
        ), reason


@pytest.mark.parametrize(
    "title", ["Verdict", "Expected error", "Distortion", "Residual", "Models", "Live"]
)
def test_every_kind_of_number_is_explained(title):
    assert section("numbers.md", title).strip()


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_links_lead_to_pages_and_headings_that_are_there(page):
    for target, heading in LINK.findall(page.read_text()):
        assert (HELP / target).is_file(), target
        assert not heading or heading in headings(target), f"{target}#{heading}"


def test_what_panels_and_the_tour_point_at_is_there():
    sources = [STATIC / "core" / "manual.js", STATIC / "features" / "help" / "tour.js"]
    found = [one for source in sources for one in TARGET.findall(source.read_text())]
    assert len(found) > 30
    for target, heading in found:
        assert (HELP / target).is_file(), target
        assert not heading or heading in headings(target), f"{target}#{heading}"


def test_every_panel_that_asks_for_an_explanation_has_one():
    explained = set(re.findall(r"(\w+): \"[\w-]+\.md", (STATIC / "core" / "manual.js").read_text()))
    asked = {
        of
        for source in STATIC.glob("features/*/panels/*.js")
        for of in re.findall(r'\$\{Title\} of="(\w+)"', source.read_text())
    }
    assert asked and asked <= explained, asked - explained


@cache
def said() -> str:
    """All texts of the page's catalogue and of the server, broken lines joined."""
    sources = [*CATALOGUES, *sorted(PACKAGE.rglob("*.py"))]
    text = "\n".join(path.read_text(encoding="utf-8") for path in sources)
    return re.sub(r'"\s*\n\s*f?"|</?b>', "", text)


@pytest.mark.parametrize("page", IN_A_HURRY)
def test_what_a_page_puts_in_italics_is_said_by_the_page_or_the_server(page):
    text = re.sub(r"```.*?```|`[^`]*`", "", (HELP / page).read_text(), flags=re.DOTALL)
    names = [" ".join(name.split()) for name in ITALICS.findall(text)]
    assert len(names) > 10
    # … and numbers are what differs each time
    parts = [part.strip(" ,.") for name in names for part in re.split(r"[…→]|[\d.]+", name)]
    assert [part for part in parts if part not in said()] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_every_page_is_in_the_contents(page):
    assert page.name == "contents.md" or f"]({page.name})" in (HELP / "contents.md").read_text()


def task_pages() -> list[str]:
    """The pages that help with a job, before a match or at any other time."""
    tasks = (HELP / "contents.md").read_text().split("## Reference")[0]
    return [page for page, _ in LINK.findall(tasks)]


@pytest.mark.parametrize("page", sorted({*task_pages()} - WITHOUT_A_PICTURE))
def test_every_task_has_a_picture_before_its_first_heading(page):
    start = (HELP / page).read_text().split("\n## ")[0]
    ((alternative, file),) = PICTURE.findall(start)
    assert len(alternative.split()) > 4, "what can be seen, for whoever cannot see it"
    assert (HELP / file).is_file(), file


def test_the_readme_shows_the_page():
    """By a picture of the manual: those are compared with the page."""
    ((alternative, file),) = PICTURE.findall((ROOT / "README.md").read_text(encoding="utf-8"))
    assert len(alternative.split()) > 4 and (ROOT / file).parent == PICTURES
    assert (ROOT / file).stat().st_size < README_PICTURE_BYTES


def test_every_picture_is_shown_by_a_page_and_taken_by_a_test():
    shown = {file for page in PAGES for _, file in PICTURE.findall(page.read_text())}
    taken = {
        name
        for test in (TESTS / "e2e").glob("test_*.py")
        for name in re.findall(r'manual_picture\(.+, "([\w-]+)"\)', test.read_text())
    }
    assert (
        {f"img/{name}.webp" for name in taken}
        == shown
        == {f"img/{file.name}" for file in PICTURES.iterdir()}
    )


def test_every_benchmark_has_its_figures_and_its_command():
    quoted = (HELP / "figures.md").read_text()
    assert [
        path.name
        for path in sorted((TESTS / "bench").glob("bench_*.py"))
        if path.name not in quoted
    ] == []
