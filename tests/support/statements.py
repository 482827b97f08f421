"""What the server can state, read off its sources: the code and the template of every call of say()."""

import ast
from functools import cache
from string import Formatter

from tests.support.paths import ROOT


@cache
def statements() -> dict[str, str | None]:
    """Return the template of each code, None where it is put together; a code that is put together ends in "*"."""
    found: dict[str, str | None] = {}
    for path in sorted((ROOT / "app").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "say" \
                    and len(node.args) == 2:
                code, template = (_text(argument) for argument in node.args)
                if code is None:
                    continue
                if code in found and found[code] != template:
                    raise AssertionError(f"{path}: {code} has two templates")
                found[code] = template
    return found


def values_of(template: str) -> set[str]:
    """Return the names of the values in a template of say(), or of the page's catalogue."""
    return {name for _, name, _, _ in Formatter().parse(template) if name}


def _text(node: ast.expr) -> str | None:
    """Return a text; of one that is put together, its beginning with "*" behind it; None where it has none."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr) and isinstance(node.values[0], ast.Constant):
        return f"{node.values[0].value}*"
    return None
