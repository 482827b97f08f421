"""A recipe of static/help/contributing.md, followed in a copy of the project: its files written, its lines added."""

import re
import shutil
from collections.abc import Iterator
from pathlib import Path

from tests.support.paths import HELP, ROOT

COPIED = (
    "app",
    "configs",
    "static",
    "tests",
    "pyproject.toml",
    "README.md",
    ".oxlintrc.json",
    ".oxfmtrc.json",
)
BLOCK = re.compile(r"^((?:[^\n]+\n)*[^\n]+):\n\n```(\w+)\n(.*?)^```", re.DOTALL | re.MULTILINE)
NAME = re.compile(r"`([\w.]+/[\w/.]+\.(?:py|js))`")


def recipes() -> dict[str, str]:
    """Return each "## Add …" section of the page by its title."""
    parts = re.split(
        r"^## (Add .+?)\n|^## .+\n", (HELP / "contributing.md").read_text(), flags=re.MULTILINE
    )
    return {title: text for title, text in zip(parts[1::2], parts[2::2], strict=True) if title}


def copy_project(folder: Path, names: tuple[str, ...] = COPIED) -> Path:
    """Copy what a contributor has, which is beside nothing."""
    folder.mkdir()
    for name in names:
        if (ROOT / name).is_dir():
            shutil.copytree(
                ROOT / name,
                folder / name,
                ignore=shutil.ignore_patterns("__pycache__", "node_modules"),
            )
        else:
            shutil.copy(ROOT / name, folder / name)
    return folder


def blocks(text: str) -> Iterator[tuple[str, str, str]]:
    """Yield the file, the language and the code of each block whose sentence names a file first."""
    for sentence, language, code in BLOCK.findall(text):
        if named := NAME.search(sentence):
            yield named[1], language, code


def write_files(folder: Path, text: str) -> list[str]:
    """Write the files that a recipe gives in full; returns their names."""
    files = {name: code for name, language, code in blocks(text) if language != "diff"}
    for name, code in files.items():
        assert not (folder / name).exists(), name
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(code, encoding="utf-8")
    return [*files]


def edit_files(folder: Path, text: str) -> list[str]:
    """Add the lines that a recipe has with + below a line that is in the file once; returns the files' names."""
    edits = {name: code for name, language, code in blocks(text) if language == "diff"}
    for name, diff in edits.items():
        code = (folder / name).read_text(encoding="utf-8")
        for hunk in diff.split("@@\n"):
            lines = hunk.splitlines(keepends=True)
            before = "".join(line[1:] for line in lines if not line.startswith("+"))
            assert code.count(before) == 1, f"{name} has not once:\n{before}"
            code = code.replace(before, "".join(line[1:] for line in lines))
        (folder / name).write_text(code, encoding="utf-8")
    return [*edits]
