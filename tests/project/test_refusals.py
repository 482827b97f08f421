"""Each refusal that the page can show has a row in the manual, and no row names one that is gone.

A refusal of the server is named by its reason, the last part of a problem's type. It can reach the page unless it is
made by the shell or the Python client, or is one of ELSEWHERE, with the cause. A refusal that the page makes itself is
named by the key of its sentence.
"""

import ast
import re
from collections.abc import Iterator
from functools import cache
from itertools import chain
from typing import NamedTuple

import pytest

from tests.support.paths import HELP, PACKAGE
from tests.support.words import CATALOGUES, ENTRY, VALUE, t
from touchline.api.middleware.problems import FRAMEWORK, VALUE_REASONS

NOT_THE_PAGE = ("cli", "client")  # folders of the package
ELSEWHERE = {
    "at the start of a server, or by `touchline restore`": """
        archive-form bad-archive bad-settings bad-token data-folder data-folder-in-use database-missing
        database-not-empty folder-not-empty newer-database no-archive no-dask no-fields no-settings-file no-stages
        pictures-missing restore-unfinished
    """,
    "to requests that the page does not make: it offers what is there, and sends it in the right form": """
        bad-axis bad-background bad-clicks bad-corners bad-cursor bad-detections bad-eye bad-fps bad-json bad-mesh
        bad-observation bad-outline bad-points bad-quality bad-range bad-rotation bad-size bad-stages bad-width
        camera-twice click-outside docs-not-built headers-too-large if-match-needed method-not-allowed no-file
        no-frames no-length no-snapshot no-views non-finite-points not-encodable nothing-given one-sided superseded
        unknown-colour unknown-space unknown-stage unknown-stages unknown-view wrong-content-type
    """,
}
NOT_SHOWN = {reason for reasons in ELSEWHERE.values() for reason in reasons.split()}
VARIABLE = {"turned"}  # chosen by a variable: of a check's sentences
# What fills in a reason that is an f-string; the names of a module's own are read
KINDS = {
    "kind": ("picture", "folder", "video"),
    "self._kind.replace(' ', '-')": ("camera-model", "export-format", "source", "stage"),
}
# What the page says of something done has a second sentence as well, and so have some places
NO_REFUSAL = re.compile(
    r"activated|deleted|kept|made|proposed|refitted|restored|saved|readiness|status|wall"
)


class Code(NamedTuple):
    """A node of the package, with the module that it stands in."""

    module: ast.Module
    node: ast.Call


@cache
def code() -> tuple[dict[str, str], list[Code], dict[str, set[str]]]:
    """The classes of refusals with the reason of those that have none of their own, all calls, and names of records."""
    classes: list[ast.ClassDef] = []
    calls: list[Code] = []
    names: dict[str, set[str]] = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        if path.relative_to(PACKAGE).parts[0] in NOT_THE_PAGE:
            continue
        module = ast.parse(path.read_text(encoding="utf-8"))
        for node in ast.walk(module):
            if isinstance(node, ast.Call):
                calls.append(Code(module, node))
            elif isinstance(node, ast.ClassDef):
                classes.append(node)
                for name, value in constants(node.body):
                    if " " not in value:
                        names.setdefault(name, set()).add(value)
    kinds = {"TouchlineError": "problem"}
    for _ in range(4):  # as deep as the tree of errors
        for node in classes:
            for base in node.bases:
                if getattr(base, "id", "") in kinds:
                    own = dict(constants(node.body)).get("reason")
                    kinds[node.name] = own or kinds[base.id]
    return kinds, calls, names


def constants(body: list[ast.stmt]) -> Iterator[tuple[str, str]]:
    """The names that texts are assigned to, one by one or several at once."""
    for line in body:
        if isinstance(line, ast.AnnAssign) and line.value is not None:
            pairs = [(line.target, line.value)]
        elif isinstance(line, ast.Assign) and isinstance(line.value, ast.Tuple):
            targets = line.targets[0]
            pairs = [*zip(getattr(targets, "elts", []), line.value.elts, strict=False)]
        elif isinstance(line, ast.Assign):
            pairs = [(line.targets[0], line.value)]
        else:
            continue
        for target, value in pairs:
            if isinstance(value, ast.Constant) and isinstance(value.value, str):
                yield ast.unparse(target), value.value


def reasons_of(call: Code) -> set[str]:
    """The reasons that a call may give; none where they are those of another refusal."""
    kinds, _, names = code()
    node = call.node
    called = getattr(node.func, "id", getattr(node.func, "attr", ""))
    if called in kinds:
        given = next((word.value for word in node.keywords if word.arg == "reason"), None)
        if given is None:
            return {kinds[called]}
    elif called == "camera_problem":
        given = node.args[0]
    elif called == "check_etag" and len(node.args) > 3:
        given = node.args[3]
    elif called == "problem" and len(node.args) > 2:
        given = node.args[1]
    else:
        return set()
    if isinstance(given, ast.JoinedStr):
        found = {""}
        for part in given.values:
            if isinstance(part, ast.Constant):
                fills = {part.value}
            else:
                name = ast.unparse(part.value)
                fills = {*KINDS.get(name, names.get(name.removeprefix("self."), ()))}
            found = {start + fill for start in found for fill in fills}
        return found
    if isinstance(given, ast.Name):
        return {value for name, value in constants(call.module.body) if name == given.id}
    return {given.value} if isinstance(given, ast.Constant) else set()


@cache
def made() -> set[str]:
    """Every reason of the server outside the shell."""
    called = chain.from_iterable(reasons_of(call) for call in code()[1])
    framework = {reason for reason, _ in FRAMEWORK.values()}
    return {*called, *framework, *VALUE_REASONS.values(), *VARIABLE}


@cache
def rows() -> list[tuple[str, str, str]]:
    """The rows of the manual's refusals: its words and reasons, the cause, and what to do."""
    text = (HELP / "troubleshooting.md").read_text(encoding="utf-8")
    found = re.search(r"^## Refusals\n(.*?)^## ", text, re.MULTILINE | re.DOTALL)
    assert found
    lines = re.findall(r"^\| (.+) \| (.+) \| (.+) \|$", found[1], re.MULTILINE)
    return [line for line in lines if line[0] != "refusal"]


def named() -> set[str]:
    return {reason for row in rows() for reason in re.findall(r"`([\w-]+)`", row[0])}


def test_every_refusal_of_the_server_that_the_page_can_show_has_a_row():
    assert len(made()) > 200
    assert sorted(made() - NOT_SHOWN - named()) == []


def test_no_row_names_a_refusal_that_is_gone():
    assert sorted(named() - made()) == []


def test_what_the_page_never_shows_is_refused_all_the_same_and_has_no_row():
    assert sorted(NOT_SHOWN - made()) == []
    assert sorted(NOT_SHOWN & named()) == []


def own_refusals() -> list[str]:
    """The keys of the page's sentences that say what is wrong: another entry says what to do."""
    keys = {key for path in CATALOGUES for key, _ in ENTRY.findall(path.read_text("utf-8"))}
    return [
        *sorted(key for key in keys if f"{key}.fix" in keys or f"{key}-fix" in keys),
        "common.server-silent",
        "core.api.answered",
    ]


@pytest.mark.parametrize("key", [key for key in own_refusals() if not NO_REFUSAL.search(key)])
def test_every_refusal_of_the_page_itself_has_a_row(key):
    raw = dict(pair for path in CATALOGUES for pair in ENTRY.findall(path.read_text("utf-8")))[key]
    values = dict.fromkeys(VALUE.findall(raw), "…")
    words = max(t(key, **values).split("…"), key=len).strip(" :.()")
    assert any(f"*{words}*" in row[0] for row in rows()), words


def test_every_row_has_a_cause_and_says_what_to_do():
    assert [row for row in rows() if min(len(cell.split()) for cell in row[1:]) < 2] == []
