"""What every refusal of the REST door looks like, for the tests that provoke one."""

import json

import pytest

API = "/api/v1"


def without_size(task: dict) -> dict:
    return {key: value for key, value in task.items() if key != "image_size"}


def refusal(answer, status=None, reason=None) -> dict:
    """The problem in an answer, checked for its form."""
    assert answer.headers["content-type"] == "application/problem+json", answer.text
    problem = json.loads(
        answer.text, parse_constant=lambda constant: pytest.fail(f"{constant} in an answer")
    )
    assert {"type", "title", "status", "detail", "fix"} <= problem.keys()
    assert problem["status"] == answer.status_code and 400 <= answer.status_code < 500, problem
    assert problem["type"].startswith("/problems/") and problem["fix"].endswith("."), problem
    assert status is None or answer.status_code == status, problem
    assert reason is None or problem["type"] == f"/problems/{reason}", problem
    return problem
