"""What the server can state, read off its sources: the code and the template of every call of say() and named()."""

import ast
from functools import cache
from string import Formatter

from tests.support.paths import PACKAGE


@cache
def statements() -> dict[str, str | None]:
    """Return the template of each code, None where it is put together; what varies of a code reads "*"."""
    found: dict[str, str | None] = {}
    for tree in _trees():
        for node in ast.walk(tree):
            if (
                isinstance(node, ast.Call)
                and isinstance(node.func, ast.Name)
                and node.func.id in ("say", "named")
                and len(node.args) == 2
            ):
                code, template = (_text(argument) for argument in node.args)
                if code is None:
                    continue
                if code in found and found[code] != template:
                    raise AssertionError(f"line {node.lineno}: {code} has two templates")
                found[code] = template
    return found


def values_of(template: str) -> set[str]:
    """Return the names of the values in a template of say(), or of the page's catalogue."""
    return {name for _, name, _, _ in Formatter().parse(template) if name}


@cache
def texts() -> set[str]:
    """Return every text in the sources: codes that a table names are among them."""
    return {
        node.value
        for tree in _trees()
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    }


@cache
def _trees() -> list[ast.Module]:
    return [ast.parse(path.read_text(encoding="utf-8")) for path in sorted((PACKAGE).rglob("*.py"))]


def _text(node: ast.expr) -> str | None:
    """Return a text, with "*" for what is put into it; None where it is no literal."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(
            str(part.value) if isinstance(part, ast.Constant) else "*" for part in node.values
        )
    return None
