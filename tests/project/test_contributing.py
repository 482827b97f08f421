"""static/help/contributing.md, followed word for word in a copy of the project: every recipe ends with a green run.

Always the files and lines of each recipe, and that the program finds what they add; its own commands with -m long.
"""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.recipe import copy_project, edit_files, recipes, write_files

MODELS_SECTION = """
## Inverse division

A pinhole camera behind a lens with a single number, counted on the ray and not on the image. Choose it where the
division model's horizon lies inside the image, or to compare the two; it knows rays, and so heights above the carpet,
and its expected error is known as for every physical lens model.
"""


@pytest.fixture
def copy(tmp_path) -> Path:
    """A copy of the project beside nothing: what a contributor has."""
    return copy_project(tmp_path / "touchline")


@pytest.fixture
def done(copy):
    """Runs a command of a contributor."""

    def run(*words: str) -> str:
        environment = {**os.environ, "PYTHONPATH": f"{copy}{os.pathsep}{copy / 'app'}"}
        done = subprocess.run(words, cwd=copy, env=environment, text=True, capture_output=True)
        assert done.returncode == 0, f"{words}\n{done.stdout[-4000:]}\n{done.stderr[-2000:]}"
        return done.stdout

    return run


def follow(copy: Path, text: str) -> list[tuple[str, str, str]]:
    """Write a recipe's files and its lines in tables; those: table, file, line."""
    if "```diff" in text:
        write_files(copy, text)
        edit_files(copy, text)
        return []
    files = re.findall(r"in\s+`(app/[\w/]+\.py)`[^`]*?:\n\n```python\n(.*?)```", text, re.DOTALL)
    assert files, "no file to write"
    for name, source in files:
        (copy / name).write_text(source)
    tables = re.findall(r"`([A-Z_]+)`\s+of\s+`([\w/]+\.py)`", text)
    lines = re.findall(r"```python\n(    \".*?\n)```", text)
    assert len(tables) == len(lines) > 0
    for (table, name), line in zip(tables, lines, strict=True):
        code, count = re.subn(
            rf"^({table}(?:: \S+)? = .*?)^( *\}})",
            rf"\1{line}\2",
            (copy / name).read_text(),
            count=1,
            flags=re.MULTILINE | re.DOTALL,
        )
        assert count == 1
        (copy / name).write_text(code)
    return [(table, name, line) for (table, name), line in zip(tables, lines, strict=True)]


def test_what_the_recipes_add_is_found_in_its_table(copy, done):
    script = ""
    for title, text in recipes().items():
        for table, name, line in follow(copy, text):
            module = (
                name.removeprefix("app/")
                .removesuffix(".py")
                .removesuffix("/__init__")
                .replace("/", ".")
            )
            script += f"from {module} import {table}; print({title!r}, {table}[{line.split(chr(34))[1]!r}])\n"
    found = done(sys.executable, "-c", script)
    for added in (
        "InverseDivision'",
        "InverseDivisionFitter'",
        "GreySource'",
        "grey://128",
        "Corners (text)",
        "Dim'",
    ):
        assert added in found


@pytest.mark.long
@pytest.mark.parametrize("title", recipes())
def test_whoever_follows_a_recipe_ends_with_a_green_run(copy, done, title):
    text = recipes()[title]
    follow(copy, text)
    if "models.md" in text:
        with open(copy / "static" / "help" / "models.md", "a") as page:
            page.write(MODELS_SECTION)
    done(sys.executable, "-m", "mypy")
    commands = re.findall(r"```sh\n(.*?)```", text, re.DOTALL)
    assert commands, "no command to run"
    for command in "".join(commands).splitlines():
        told = done(*command.replace(".venv/bin/python", sys.executable).split())
        if "pytest" in command:
            assert re.search(r"\d+ passed", told)
