"""No refusal prints Python or JSON: whatever is sent in whatever entry, the sentence is one for people."""

import re

import pytest

from tests.support.refusals import API

HOSTILE = [
    None,
    True,
    5,
    -1e9,
    1e300,
    "x" * 300,
    "",
    [],
    [1, "a", None],
    {},
    {"value": 5, "sigma": 30},
    [{"a": None}],
]
CODE = re.compile(
    r"\{'|\{\"|\[\{|\[\[|\{\}|\[\]|\bNone\b|\bTrue\b|\bFalse\b|<class|\b\w+(Type|Error)\b|constrained"
    r"|Input should|pydantic"
)
CAMERA = {
    "id": "c1",
    "name": "C",
    "source": "sim://ssl-div-b",
    "field": "ssl-div-b",
    "region": "half",
}
PUBLISHING = {"enabled": False, "interface": "", "numbers": {"a": 1}, "interval_s": 1, "ttl": 1}
BODIES = {
    "POST /cameras": CAMERA,
    "PATCH /cameras/overhead": CAMERA,
    "POST /snapshots": {"camera": "overhead"},
    "PUT /publishing": PUBLISHING,
    "POST /rigs": {"name": "r", "title": "t", "cameras": ["overhead"], "field": "ssl-div-b"},
    "POST /fields/proposed": {"snapshot": "0", "length_mm": 9000},
    "POST /calibrations/auto": {"snapshot": "0", "field": "ssl-div-b", "corners": [[0, 0]]},
    "POST /detections": {"camera": "overhead", "plan": "full"},
    "PUT /colours/abc": {"profile": {}},
    "POST /pairs": {"a": "x", "b": "y", "matches": []},
    "POST /straightness": {"snapshot": "0", "edges": []},
    "POST /motion": {"camera": "overhead", "make": "lens"},
    "PATCH /cameras/overhead/controls": {"controls": {"height": 5}},
}
OPTIONS = ("height_mm", "degree", "lens", "lens_sigma", "unknown")


def bodies(body):
    for value in HOSTILE:
        yield value
        for name in body:
            yield {**body, name: value}


def code_in(client, call, sent):
    """Whatever of code the refusals of these bodies print."""
    method, path = call.split()
    found = set()
    for body in sent:
        answer = client.request(method, API + path, json=body)
        assert answer.status_code < 500, (call, body, answer.text)
        if answer.status_code >= 400 and CODE.search(detail := answer.json()["detail"]):
            found.add(detail)
    return found


@pytest.mark.parametrize("call", BODIES)
def test_a_refusal_is_a_sentence_without_code(client, call):
    assert code_in(client, call, bodies(BODIES[call])) == set()


def test_a_refused_calibration_is_a_sentence_without_code(client, task):
    sent = list(bodies(task))
    first, *others = task["observations"]
    for value in HOSTILE:
        sent += [{**task, "options": {name: value}} for name in OPTIONS]
        sent += [
            {**task, "observations": [{**first, name: value}, *others]}
            for name in ("feature", "points", "kind")
        ]
    assert code_in(client, "POST /calibrations", sent) == set()


def test_a_height_out_of_range_is_named_with_its_unit(client, task):
    options = {"height_mm": {"value": 5, "sigma": 30}}
    refused = client.post(
        f"{API}/calibrations", json={**task, "model": "brown-conrady", "options": options}
    ).json()
    assert refused["detail"] == "The option height cannot be 5 mm."
    assert "100 to 50000 mm" in refused["fix"]
