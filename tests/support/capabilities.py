"""The capabilities that tests can be run by (python -m tests rigs), and the files of each, in app, static and tests."""

from collections.abc import Iterable
from fnmatch import fnmatch

from tests.support.paths import ROOT

CAPABILITIES = {
    "automatic": ("*/auto*", "*_auto*", "*/test_find_lines.py"),
    "boards": ("*/board*", "*_board*", "app/touchline/*/lenses.py", "tests/e2e/test_lenses.py"),
    "detection": (
        "*detection*",
        "*/clips.*",
        "*_clips.*",
        "*seeing*",
        "*/stage*",
        "*_stage*",
        "*colour*",
        "*tracks*",
    ),
    "drift": ("*drift*", "*/check*", "*_check*", "*reregister*"),
    "fields": ("*/fields/*", "*/fields.*", "*_fields.*", "*field_editor*", "*measured*", "*tape*"),
    "league": (
        "*league*",
        "*/ssl_*",
        "*_ssl*",
        "*/ssl.*",
        "*publish*",
        "*packet*",
        "*geometry_listener*",
        "*/network.*",
        "static/features/league/*",
        "tests/*/test_network*.py",
    ),
    "referee": ("*referee*", "static/features/referee/*"),
    "report": ("*report*",),
    "rigs": ("*/rig*", "*_rig*", "*/pair*", "*_pair*"),
    "scene": ("*/scene*", "*_scene*"),
    "straight": ("*straight*", "*plumb*", "*/roll*", "*_roll*"),
}
TESTS = (
    "tests/unit/*test_*.py",
    "tests/api/test_*.py",
    "tests/cli/test_*.py",
    "tests/e2e/test_*.py",
)
# The default tests, and the tests of the project among them, tell what changes of these need.
NO_CODE = (
    "*.md",
    "static/help/*",
    "tests/bench/*",
    "tests/project/*",
    "tests/seconds.tsv",
    ".github/*",
    "LICENSE",
    ".gitignore",
)


def matches(path: str, patterns: Iterable[str]) -> bool:
    return any(fnmatch(path, pattern) for pattern in patterns)


def files_of(*capabilities: str) -> list[str]:
    """Return the test files of these capabilities, relative to the project."""
    files = (str(path.relative_to(ROOT)) for path in sorted(ROOT.glob("tests/**/test_*.py")))
    patterns = [pattern for name in capabilities for pattern in CAPABILITIES[name]]
    return [path for path in files if matches(path, TESTS) and matches(path, patterns)]


def files_touched(changed: Iterable[str]) -> list[str] | None:
    """Return the test files that a change of these files asks for; None, for all, where one is of no capability."""
    found: set[str] = set()
    for path in changed:
        names = [name for name, patterns in CAPABILITIES.items() if matches(path, patterns)]
        if matches(path, TESTS):
            found.add(path)
        elif matches(path, NO_CODE):
            continue
        elif not names:
            return None
        else:
            found.update(files_of(*names))
    return sorted(path for path in found if (ROOT / path).exists())
