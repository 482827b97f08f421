"""Every warning that a fit can give, and every refusal of one or of a detection, has its deed in the page's table of
cures; each of them leads out (tests/page/warning_fixes.test.mjs)."""

import ast
import re

from tests.support.paths import PACKAGE, ROOT
from touchline.evaluate.areas import NOT_IN_IMAGE

SOURCE = ROOT / "static" / "features" / "calibrate" / "warning_fixes.js"
CURES = set(re.findall(r'^  "?([a-z-]+)"?: \(', SOURCE.read_text(), re.MULTILINE))

# What fits an operator's clicks on a field, and judges them. Boards, pairs and edges have desks of their own.
FITS = [
    "fitting/border.py",
    "fitting/contract.py",
    "fitting/linear.py",
    "fitting/polynomial.py",
    "fitting/homography.py",
    "fitting/ray_camera/fit.py",
    "fitting/ray_camera/search.py",
    "fitting/ray_camera/lens_prior.py",
    "fitting/ray_camera/camera_prior.py",
    "evaluate/report.py",
    "evaluate/next_click.py",
    "evaluate/uncertainty.py",
    "evaluate/verification.py",
    "workflows/calibration_request.py",
    "fitting/field_pattern.py",
    "automatic/assignment.py",
    "automatic/hypotheses.py",
    "automatic/request.py",
    "automatic/recognition.py",
]
# Of callers of REST and the shell alone: the page sends none of it.
NOT_OF_THE_PAGE = {
    "bad-axis",
    "bad-parameters",
    "bad-corners",
    "too-many-points",
    "not-a-line",
    "bad-lens",
}


def called(tree: ast.AST, names: set[str]):
    return (
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in names
    )


def reasons() -> set[str]:
    found = set()
    for source in FITS:
        tree = ast.parse((PACKAGE / source).read_text())
        for call in called(tree, {"Warning"}):
            found.add(getattr(call.args[0], "value", NOT_IN_IMAGE))
        for call in called(tree, {"FitFailed", "BadInput", "ProblemJson"}):
            found |= {
                k.value.value
                for k in call.keywords
                if k.arg == "reason" and isinstance(k.value, ast.Constant)
            }
        doubts = (
            node.elts
            for node in ast.walk(tree)
            if isinstance(node, ast.Tuple) and len(node.elts) == 3
        )
        found |= {
            code.value
            for code, what, _ in doubts
            if isinstance(code, ast.Constant) and isinstance(what, ast.Call)
        }
    return found


def test_the_search_finds_warnings_and_refusals():
    assert {
        "stray-click",
        "height-unknown",
        "too-few-points",
        "mirrored",
        "no-match",
        "loose",
        "series-moved",
        NOT_IN_IMAGE,
    } <= reasons()


def test_every_reason_has_a_cure_that_the_page_can_do():
    assert reasons() - CURES - NOT_OF_THE_PAGE == set()
