"""The page's logic without a browser: each file of tests/page by node's own test runner."""

import re

import pytest

from tests.support.node import PAGE_TESTS, run_node

FILES = sorted(PAGE_TESTS.glob("*.test.mjs"))


def test_node_sees_the_page_as_a_browser_does_and_says_what_failed(tmp_path):
    failing = tmp_path / "failing.test.mjs"
    failing.write_text(
        'import test from "node:test";\nimport htm from "htm";\n'
        'test("the page is made of paper", () => { throw new Error(`of a ${typeof htm}`); });\n'
    )
    done = run_node("--test", str(failing))
    assert done.returncode != 0
    assert "the page is made of paper" in done.stdout and "of a function" in done.stdout


@pytest.mark.parametrize("file", FILES, ids=lambda path: path.name.removesuffix(".test.mjs"))
def test_the_page_works_as_its_tests_say(file):
    done = run_node("--test", "--test-isolation=none", str(file))
    assert done.returncode == 0, done.stdout + done.stderr
    assert int(re.search(r"tests (\d+)", done.stdout)[1]) > 0, "no test in it"
