"""Bad input, one line each: refused with a named reason and a fix, and nothing is saved."""

import copy
import json

import pytest

from tests.support.refusals import API, refusal, without_size

JSON = {"Content-Type": "application/json"}


def border(task, name):
    return next(o for o in task["observations"] if o["feature"] == name)["points"]


def changed(change):
    """A change of a good task, in place."""

    def build(task):
        task = copy.deepcopy(task)
        return change(task) or task

    return build


def set_points(name, points):
    return changed(
        lambda task: border(task, name).__setitem__(slice(None), points(border(task, name)))
    )


def put(**entries):
    return changed(lambda task: task.update(entries))


def without(*names):
    return changed(lambda task: {k: v for k, v in task.items() if k not in names})


def swapped(a, b):
    def swap(task):
        first, second = border(task, a), border(task, b)
        first[:], second[:] = list(second), list(first)

    return changed(swap)


def one_too_few_for_degree_8(task):
    task["options"] = {"degree": 8}
    del border(task, "left")[8:]


def on_one_line(task):
    for i, observation in enumerate(task["observations"]):
        observation["points"] = [[100 + 60 * k + i, 100 + 40 * k + i] for k in range(9)]


def crossed(task):
    border(task, "left")[:] = [[100 + 60 * k, 80 + 50 * k] for k in range(9)]
    border(task, "right")[:] = [[600 - 60 * k, 80 + 50 * k] for k in range(9)]


BAD = {
    # name: (change of the good task, status, reason or None where pydantic names it)
    "two points": (set_points("left", lambda p: p[:2]), 422, "too-few-points"),
    "a border without points": (set_points("top", lambda p: []), 422, "too-few-points"),
    "a border left out": (
        changed(lambda t: t.update(observations=t["observations"][:3])),
        422,
        "too-few-points",
    ),
    "no observations": (put(observations=[]), 422, "too-few-points"),
    "too few for the degree": (changed(one_too_few_for_degree_8), 422, "too-few-points"),
    "one point many times": (set_points("left", lambda p: [p[0]] * 9), 422, "too-few-points"),
    "points in a heap": (
        set_points("left", lambda p: [[100 + i, 100 + i] for i in range(6)]),
        422,
        "collinear-points",
    ),
    "a border across its own direction": (
        set_points("left", lambda p: [[100 + 20 * i, 100] for i in range(9)]),
        422,
        "collinear-points",
    ),
    "all on one line": (changed(on_one_line), 422, "collinear-points"),
    "outside the picture": (
        set_points("left", lambda p: [*p[:-1], [-50, 500]]),
        422,
        "outside-picture",
    ),
    "far outside the picture": (
        set_points("bottom", lambda p: [*p[:-1], [700, 58_000]]),
        422,
        "outside-picture",
    ),
    "left and right swapped": (swapped("left", "right"), 422, "borders-swapped"),
    "top and bottom swapped": (swapped("top", "bottom"), 422, "borders-swapped"),
    "crossed borders": (changed(crossed), 422, "borders-cross"),
    "NaN": (set_points("left", lambda p: [*p, [float("nan"), 1]]), 422, "non-finite-number"),
    "infinity": (set_points("left", lambda p: [*p, [1, float("inf")]]), 422, "non-finite-number"),
    "minus infinity": (
        set_points("left", lambda p: [*p, [1, float("-inf")]]),
        422,
        "non-finite-number",
    ),
    "1e308": (set_points("left", lambda p: [*p, [1e308, 1e308]]), 422, "out-of-range"),
    "-1e308": (set_points("left", lambda p: [*p, [-1e308, 0]]), 422, "out-of-range"),
    "a number in words": (set_points("left", lambda p: [*p, ["1", "2"]]), 422, "bad-request"),
    "true for a number": (set_points("left", lambda p: [*p, [True, 2]]), 422, "bad-request"),
    "three coordinates": (set_points("left", lambda p: [*p, [1, 2, 3]]), 422, "too-many"),
    "null": (set_points("left", lambda p: [*p, None]), 422, "bad-request"),
    "too many points": (
        set_points("left", lambda p: [[i / 30, i / 40] for i in range(20_001)]),
        422,
        "too-many",
    ),
    "too many points in all": (
        changed(
            lambda t: t["observations"].extend(
                [{"feature": "centre-circle", "points": [[5.0, i / 40] for i in range(12_000)]}] * 2
            )
        ),
        422,
        "too-many-points",
    ),
    "an unknown field": (put(field="no-such-field"), 404, "unknown-field"),
    "no field": (without("field"), 422, "bad-request"),
    "a field that is a path": (put(field="../../configs/fields/ssl-2008"), 404, "unknown-field"),
    "a wrong region": (put(region="no-such-region"), 404, "unknown-region"),
    "no region": (without("region"), 422, "bad-request"),
    "a wrong turn": (put(rotate=45), 422, "bad-request"),
    "an unknown model": (put(model="no-such-model"), 404, "unknown-camera-model"),
    "an unknown option": (put(options={"degre": 3}), 422, "unknown-option"),
    "degree 0": (put(options={"degree": 0}), 422, "bad-option"),
    "degree 99": (put(options={"degree": 99}), 422, "bad-option"),
    "degree 2.5": (put(options={"degree": 2.5}), 422, "bad-option"),
    "a NaN option": (put(options={"w_max_rectangle_px": float("nan")}), 422, None),
    "a huge rectangle": (put(options={"w_max_rectangle_px": 1e9}), 422, "bad-option"),
    "an unknown feature": (
        changed(lambda t: t["observations"].append({"feature": "moon", "points": [[1, 1]]})),
        422,
        "unknown-feature",
    ),
    "an empty feature": (changed(lambda t: t["observations"][0].update(feature="")), 422, None),
    "an unknown kind": (
        changed(lambda t: t["observations"][0].update(kind="circle")),
        422,
        "bad-request",
    ),
    "an unknown entry": (put(observation=[]), 422, "bad-request"),
    "half a surrogate": (put(field="\ud800"), 422, "bad-request"),
    "a very long name": (put(field="x" * 100_000), 422, "too-long"),
    "a NUL": (put(field="ssl\0"), 404, "unknown-field"),
    "no picture size": (without("image_size"), 422, "no-image-size"),
    "a size of one pixel": (put(image_size=[1, 1]), 422, "out-of-range"),
    "a size of a thousand miles": (put(image_size=[10**9, 10]), 422, "out-of-range"),
    "a size in words": (put(image_size="780x580"), 422, "bad-request"),
    "a snapshot that nobody knows": (put(snapshot="0123456789abcdef"), 404, "unknown-snapshot"),
    "a note without end": (put(note="x" * 5000), 422, "too-long"),
}


@pytest.mark.parametrize("call", ["/calibrations", "/fit/preview"])
@pytest.mark.parametrize(("change", "status", "reason"), BAD.values(), ids=BAD.keys())
def test_bad_input_is_refused_by_name_with_a_fix_and_nothing_is_saved(
    standing, task, call, change, status, reason
):
    body = json.dumps(change(task))  # allow_nan, as a careless script sends it
    problem = refusal(standing.post(API + call, content=body, headers=JSON), status, reason)
    assert len(problem["detail"]) < 500
    assert standing.get(f"{API}/calibrations").json()["items"] == []


def test_the_good_task_that_they_spoil_is_good(client, task):
    assert client.post(f"{API}/calibrations", json=task).status_code == 201


def test_a_stray_point_is_named_and_not_refused(client, task):
    border(task, "left")[4][0] += 25
    report = client.post(f"{API}/fit/preview", json=task).json()["report"]
    assert report["outliers"] == 1
    assert any(w["feature"] == "left" and w["index"] == 4 for w in report["warnings"]), report[
        "warnings"
    ]


def test_a_size_that_is_not_the_snapshots_is_a_conflict(client, snapshot, task):
    wrong = {**task, "snapshot": snapshot["id"], "image_size": [640, 480]}
    refusal(client.post(f"{API}/calibrations", json=wrong), 409, "size-mismatch")
    right = {**without_size(task), "snapshot": snapshot["id"]}
    assert client.post(f"{API}/calibrations", json=right).status_code == 201
