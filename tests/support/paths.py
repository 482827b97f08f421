"""Where tests find things: the project, its manual, data of the tests' own, and real data beside the project."""

from pathlib import Path

TESTS = Path(__file__).parents[1]
ROOT = TESTS.parent
PACKAGE = ROOT / "app" / "touchline"
STATIC = ROOT / "static"
NOT_OURS = {"vendor", "built", "node_modules"}  # folders of static/: fetched or made
HELP = ROOT / "static" / "help"
CLICKS = TESTS / "clicks"
LABELS = TESTS / "labels"
SHARED_DATA = ROOT.parent / "shared" / "data"
