"""Every refusal has one form, names its reason and says what to do."""

import re

import pytest

from tests.support.refusals import refusal
from touchline.api.middleware.problems import problem_of
from touchline.core.errors import Busy, NotFound

BORDER = "/api/v1/fit/border"
JSON = {"Content-Type": "application/json"}


@pytest.mark.parametrize(
    "path",
    [
        "/api/v1/nowhere",
        "/api/nowhere",
        "/api",
        "/nowhere.html",
        "/vendor",
        "/..%2f..%2fpyproject.toml",
        "/vendor/../../pyproject.toml",
        "/%2e%2e/pyproject.toml",
        "/a%00b",
    ],
)
def test_an_unknown_path_is_404(standing, path):
    refusal(standing.get(path, headers={"Accept": "text/html"}), 404)


def test_a_wrong_method_is_405_and_names_the_right_ones(standing):
    answer = standing.delete("/api/v1/health")
    refusal(answer, 405)
    assert "GET" in answer.headers["allow"]


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ('{"points": [[1, NaN], [2, 3]], "axis": "x_of_y"}', "non-finite-number"),
        ('{"points": [[1, Infinity], [2, 3]], "axis": "x_of_y"}', "non-finite-number"),
        ('{"points": [[1, -1e999], [2, 3]], "axis": "x_of_y"}', "non-finite-number"),
        ('{"points": [[1, 1e308], [2, 3]], "axis": "x_of_y"}', "out-of-range"),
        ('{"points": [["nan", 2]], "axis": "x_of_y"}', "bad-request"),
        ('{"points": [["1", "2"]], "axis": "x_of_y"}', "bad-request"),
        ('{"points": [[true, false]], "axis": "x_of_y"}', "bad-request"),
        ('{"points": [[1, 2, 3]], "axis": "x_of_y"}', "too-many"),
        ('{"points": [], "axis": "x_of_y"}', "too-few-points"),
        ('{"points": [[1, 2]], "axis": "\\ud800"}', "bad-request"),
        ('{"points": [[1, 2]], "axis": "x_of_y", "\\udfff": 1}', "bad-request"),
        ('{"points": [[1, 2]], "axis": "x_of_y", "degre": 1}', "bad-request"),
        ('{"points": [[1, 2]], "axis": "x_of_y", "degree": 9}', "out-of-range"),
        ('{"points": [[1, 2]], "axis": "x_of_y", "degree": true}', "bad-request"),
        ('{"points": [[1, 2]], "axis": "x_of_y", "image_size": [1, 1]}', "out-of-range"),
        ('{"points": [[1, 2]]', "bad-json"),
        ('{"points": ' + "[" * 100_000, "bad-request"),
        ('{"points": [[' + "9" * 5000 + ', 1]], "axis": "x_of_y"}', "bad-request"),
        ('{"points": [' + "[1,2]," * 5000 + '[1,2]], "axis": "x_of_y"}', "too-many"),
        ("null", "bad-request"),
        ("[]", "bad-request"),
        ('"x"', "bad-request"),
        ("", "bad-request"),
        ("\0", "bad-json"),
    ],
)
def test_a_body_that_is_none_is_refused_by_name(standing, body, reason):
    problem = refusal(
        standing.post(BORDER, content=body.encode("utf-8", "surrogatepass"), headers=JSON)
    )
    assert problem["type"] == f"/problems/{reason}", problem


def test_bytes_that_are_no_text_are_refused(standing):
    refusal(standing.post(BORDER, content=b"\xff\xfe\x00", headers=JSON))


@pytest.mark.parametrize(
    "type", ["text/plain", "application/x-www-form-urlencoded", "", "application/json; charset=x"]
)
def test_another_content_type_is_refused(standing, type):
    refusal(
        standing.post(
            BORDER, content=b'{"points": [], "axis": "x_of_y"}', headers={"Content-Type": type}
        )
    )


def test_the_place_of_a_mistake_is_named(standing):
    problem = refusal(
        standing.post(BORDER, json={"points": [[1, 2], [3, None]], "axis": "x_of_y"}), 422
    )
    assert problem["errors"][0]["at"] == "points[1][1]"


def test_who_is_one_too_many_is_told_when_to_try_again():
    answer = problem_of(Busy("20 of your jobs are already waiting.", "Wait until some have ended."))
    assert answer.status_code == 429 and int(answer.headers["retry-after"]) > 0
    assert "retry-after" not in problem_of(NotFound("There is no job.", "List them.")).headers


def test_what_the_caller_sent_is_not_sent_back(standing):
    answer = standing.post(BORDER, json={"points": "<script>" * 100, "axis": "x_of_y"})
    assert "<script>" not in answer.text


def test_a_body_that_is_too_large_is_413_with_and_without_its_length(standing):
    too_much = int(standing.app.state.services.settings.server.max_json_mb * 2**20) + 1
    refusal(standing.post(BORDER, content=b" " * too_much, headers=JSON), 413)
    pieces = (b" " * 1_000_000 for _ in range(too_much // 1_000_000 + 1))
    refusal(standing.post(BORDER, content=pieces, headers=JSON), 413)


def test_an_error_that_nobody_foresaw_is_a_problem_with_an_id_that_the_log_knows(
    standing, caplog, monkeypatch
):
    def broken():
        raise RuntimeError("as if")

    monkeypatch.setattr("touchline.fitting.polynomial.PolynomialFitter.points_needed", broken)
    answer = standing.get("/api/v1/models")
    problem = answer.json()
    assert (
        answer.status_code == 500 and answer.headers["content-type"] == "application/problem+json"
    )
    id = re.search(r"error ([0-9a-f]{8})", problem["detail"])[1]
    assert id in caplog.text and "as if" in caplog.text and "as if" not in answer.text
