"""The words of the server and of the manual: REST, shell and report say what the page says, in the same terms."""

import ast
import re
from collections.abc import Iterator
from functools import cache

import pytest

from tests.support.paths import PACKAGE, ROOT, STATIC
from tests.support.words import BANNED

# tells of old words
PAGES = [page for page in sorted((STATIC / "help").glob("*.md")) if page.name != "changelog.md"]
CODE = re.compile(r"```.*?```|`[^`]*`|\]\([^)]*\)|\{[a-z_]+[:!}]", re.DOTALL)  # values too
SENTENCE = re.compile(r"[a-z] [a-z]")


@pytest.mark.parametrize(("word", "instead"), BANNED.items())
def test_no_sentence_uses_a_word_that_a_stranger_does_not_understand(word, instead):
    banned = re.compile(rf"\b({word})\b", re.IGNORECASE)
    found = [(place, text) for place, text in of_server() if banned.search(text)]
    assert not found, f"use {instead}"
    pages = [
        f"{page.name}: {line}"
        for page in PAGES
        for line in CODE.sub("", page.read_text(encoding="utf-8")).splitlines()
        if banned.search(line)
    ]
    assert not pages, f"use {instead}"


@cache
def of_server() -> list[tuple[str, str]]:
    """Return the sentences of all modules without code in them, each with its place."""
    return [
        (f"{path.relative_to(ROOT)}:{line}", CODE.sub("", text))
        for path in sorted((PACKAGE).rglob("*.py"))
        for line, text in sentences(path.read_text(encoding="utf-8"))
    ]


def sentences(source: str) -> Iterator[tuple[int, str]]:
    """Yield the texts of a module that are more than one word, with their lines; its docstrings are not shown."""
    tree = ast.parse(source)
    described = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef))
        and isinstance(node.body[0], ast.Expr)
    }
    for node in ast.walk(tree):
        if (
            isinstance(node, ast.Constant)
            and isinstance(node.value, str)
            and id(node) not in described
            and SENTENCE.search(node.value)
        ):
            yield node.lineno, node.value


def test_a_sentence_of_the_server_is_noticed_and_a_docstring_is_not():
    source = '"""Hats are fine here."""\ndef f(x):\n    """A hat."""\n    return f"Of {x} a hat is off.", "hats"\n'
    assert [*sentences(source)] == [(4, " a hat is off.")]
