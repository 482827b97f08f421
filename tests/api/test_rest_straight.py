"""REST of straight edges: from pictures, from clicked lines, at once and as a job; and the picture without its bend."""

import json

import cv2
import numpy as np
import pytest

from tests.support.bar_pictures import BENT, SIZE, STRAIGHT, bars_behind
from tests.support.pictures import encoded, gradient
from tests.support.refusals import API, refusal
from tests.support.rest_jobs import accepted, finished
from tests.support.straight_edges import lens_of, lines_seen

STRAIGHTNESS = f"{API}/straightness"
WORLD = lens_of("division", (-0.25,))
JSON = {"Content-Type": "application/json"}


def lines_request(seed=0, **more):
    """The body of a question about clicked lines."""
    return {
        "lines": [line.tolist() for line in lines_seen(WORLD, seed)],
        "image_size": [1280, 1024],
        **more,
    }


def kept(client, pixels):
    return client.post(f"{API}/snapshots", files={"file": encoded("png", pixels)}).json()["id"]


def judged(client, **body):
    answer = client.post(STRAIGHTNESS, json=body)
    assert answer.status_code == 200, answer.text
    return answer.json()


def off_line(points):
    """rms px of points about their best line."""
    about = np.array(points) - np.mean(points, axis=0)
    return np.sqrt(np.mean((about @ np.linalg.svd(about)[2][1]) ** 2))


def way(points):
    """Along all of them, px: far more where the order leaps to and fro."""
    return np.linalg.norm(np.diff(points, axis=0), axis=1).sum()


@pytest.fixture(scope="module")
def bars(standing):
    """The drawn picture, kept, and what is said of it."""
    id = kept(standing, bars_behind())
    return id, judged(standing, snapshots=[id])


def test_a_bent_picture_is_told_with_its_lens_and_its_bow(bars):
    found = bars[1]
    assert found["distortion"] == "significant" and found["sentence"].startswith(
        "The lens bows an edge of"
    )
    assert found["lens"]["name"] == "division" and found["pictures"] == ["image 1"]
    assert found["lens"]["terms"]["k"] == pytest.approx(BENT.terms[0], abs=0.01)
    assert found["straightness_px"]["after"] < 0.15 < 2 < found["straightness_px"]["before"]
    most = found["bow"]["most"]
    assert most["px"] > 5 and most["pct"] == pytest.approx(100 * most["px"] / most["length_px"])


def test_each_edge_is_drawn_where_it_is_and_straight_where_the_bend_is_gone(bars):
    used = [line for line in bars[1]["lines"] if line["used"]]
    assert len(used) >= 8
    for line in used:
        assert 2 <= len(line["chain"]) == len(line["straight"]) <= 33
        assert line["chain"][0] == pytest.approx(line["ends"][0], abs=0.006)
        assert off_line(line["straight"]) < 0.3
    assert max(off_line(line["chain"]) for line in used) > 3


def test_the_straightened_picture_shows_no_bend_any_more(standing, bars):
    id, found = bars
    answer = standing.post(
        f"{STRAIGHTNESS}/picture.png", json={"snapshot": id, "lens": found["lens"]}
    )
    assert answer.status_code == 200 and answer.headers["content-type"] == "image/png"
    pixels = cv2.imdecode(np.frombuffer(answer.content, np.uint8), 1)
    assert pixels.shape[1::-1] == tuple(SIZE)
    again = judged(standing, snapshots=[kept(standing, pixels)])
    assert again["bow"]["most"]["px"] < 0.5 < found["bow"]["most"]["px"]
    small = standing.post(
        f"{STRAIGHTNESS}/picture.jpg?width=320", json={"snapshot": id, "lens": found["lens"]}
    )
    assert cv2.imdecode(np.frombuffer(small.content, np.uint8), 1).shape[:2] == (240, 320)


def test_a_straight_picture_has_no_significant_distortion(standing):
    found = judged(standing, snapshots=[kept(standing, bars_behind(STRAIGHT))])
    assert found["distortion"] == "none" and "No significant distortion" in found["sentence"]


def test_clicked_lines_need_no_picture_and_come_in_any_order(standing):
    body = lines_request()
    found = judged(standing, **body)
    assert (
        found["lens"]["terms"]["k"] == pytest.approx(-0.25, abs=0.02) and found["lines_used"] == 14
    )
    assert [line["name"] for line in found["lines"]] == [
        f"line {n}" for n in range(1, 15)
    ] and not found["pictures"]
    rng = np.random.default_rng(0)
    shuffled = {**body, "lines": [rng.permutation(line).tolist() for line in body["lines"]]}
    again = judged(standing, **shuffled)
    assert again["lens"]["terms"]["k"] == pytest.approx(found["lens"]["terms"]["k"], abs=1e-4)
    for one, other in zip(found["lines"], again["lines"], strict=True):
        assert way(one["chain"]) == pytest.approx(way(other["chain"]), rel=0.01)


def test_pictures_and_lines_are_judged_together_and_each_edge_names_its_picture(standing, bars):
    other = kept(standing, bars_behind(shade=120))
    found = judged(
        standing, snapshots=[bars[0], other], lines=[[[100, 100], [200, 102], [300, 103]]]
    )
    assert found["pictures"] == ["image 1", "image 2"]
    assert {line["picture"] for line in found["lines"]} == {0, 1}
    assert found["lines"][0]["name"] == "line 1" and found["lines"][1]["name"] == "image 1, edge 1"
    assert found["objects"] > bars[1]["objects"]


@pytest.mark.parametrize("lens", ["division", "division-even", "brown-conrady"])
def test_the_lens_is_the_one_that_was_asked_for_and_its_centre_can_be_held(standing, lens):
    found = judged(standing, **lines_request(lens=lens, centre_sigma_px=0))
    assert found["lens"]["name"] == lens and found["lens"]["centre_px"] == [639.5, 511.5]
    assert "centre_x" not in found["names"] and found["straightness_px"]["after"] < 0.5


def test_a_job_answers_the_same_and_says_how_far_it_is(standing, bars):
    told = finished(
        standing, accepted(standing.post(f"{STRAIGHTNESS}?job=true", json={"snapshots": [bars[0]]}))
    )
    assert (told["state"], told["kind"], told["progress"]) == ("done", "straightness", 1)
    assert told["result"] == bars[1]


def test_a_job_is_cancelled_and_one_that_finds_nothing_fails_with_a_fix(standing, bars):
    others = [kept(standing, bars_behind(shade=100 + n)) for n in range(3)]
    job = accepted(
        standing.post(f"{STRAIGHTNESS}?job=true", json={"snapshots": [bars[0], *others]})
    )
    assert standing.delete(f"{API}/jobs/{job['id']}").json()["state"] == "cancelled"
    assert finished(standing, job)["result"] is None
    body = {"snapshots": [kept(standing, gradient(640, 480))]}
    told = finished(standing, accepted(standing.post(f"{STRAIGHTNESS}?job=true", json=body)))
    assert told["state"] == "failed" and told["problem"]["type"] == "/problems/too-few-lines"
    assert told["problem"] == refusal(standing.post(STRAIGHTNESS, json=body), 422, "too-few-lines")


def arcs(count=12):
    """Circles all over the picture, bent to every side."""
    angle = np.linspace(0, np.pi, 40)
    return [
        (
            np.array([200 + 80 * n, 200 + 50 * n])
            + (60 + 8 * n) * np.stack([np.cos(angle + n), np.sin(angle + n)], axis=1)
        ).tolist()
        for n in range(count)
    ]


ONE_EDGE = [
    [[100.0 + 25 * k, 200 + 12 * j + 0.01 * (k - 20) ** 2] for k in range(40)] for j in range(6)
]
REFUSED = {  # what is asked: (its body, or what makes it; the answer)
    "nothing": ({}, 422, "nothing-given"),
    "no lines": ({"lines": [], "image_size": [640, 480]}, 422, "nothing-given"),
    "lines without a size": ({"lines": [[[1, 2], [3, 4], [5, 6]]]}, 422, "no-image-size"),
    "one line": (
        lambda: lines_request(lines=[[[0, 0], [500, 5], [1000, 0]]]),
        422,
        "too-few-lines",
    ),
    "lines of two points": (
        lambda: lines_request(lines=[[[0, 100 * k], [1000, 90 * k]] for k in range(10)]),
        422,
        "too-few-lines",
    ),
    "lines without points": (lambda: lines_request(lines=[[]] * 10), 422, "too-few-lines"),
    "one point many times": (lambda: lines_request(lines=[[[5, 5]] * 9] * 9), 422, "too-few-lines"),
    "circles": (lambda: lines_request(lines=arcs()), 422, "no-straight-lines"),
    "sides of one bar": (lambda: lines_request(lines=ONE_EDGE), 422, "one-edge"),
    "an unknown lens": (lambda: lines_request(lens="fisheye"), 422, "unknown-lens"),
    "a lens in numbers": (lambda: lines_request(lens=3), 422, "bad-request"),
    "a negative σ": (lambda: lines_request(centre_sigma_px=-1), 422, None),
    "an infinite σ": (lambda: lines_request(centre_sigma_px=float("inf")), 422, None),
    "NaN": (lambda: lines_request(lines=[[[0, float("nan")], [1, 2]]]), 422, None),
    "a number in words": (lambda: lines_request(lines=[[["1", "2"]]]), 422, "bad-request"),
    "three coordinates": (lambda: lines_request(lines=[[[1, 2, 3]]]), 422, None),
    "a point of 1e308": (lambda: lines_request(lines=[[[1e308, 2]]]), 422, None),
    "null": (lambda: lines_request(lines=None), 422, "bad-request"),
    "a size of one pixel": (lambda: lines_request(image_size=[1, 1]), 422, "out-of-range"),
    "a size in words": (lambda: lines_request(image_size="640x480"), 422, "bad-request"),
    "too many pictures": ({"snapshots": ["a"] * 51}, 422, None),
    "an unknown picture": ({"snapshots": ["0123456789abcdef"]}, 404, "unknown-snapshot"),
    "a path": ({"snapshots": ["../../etc/passwd"]}, 404, "unknown-snapshot"),
    "an unknown entry": (lambda: lines_request(pictures=[]), 422, "bad-request"),
    "no object": ([], 422, "bad-request"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_tells_nothing_is_refused_by_name_with_a_fix(standing, name):
    ask, status, reason = REFUSED[name]
    body = ask() if callable(ask) else ask
    refusal(standing.post(STRAIGHTNESS, content=json.dumps(body), headers=JSON), status, reason)


def test_what_can_be_refused_at_once_is_refused_before_a_job_is_begun(standing, bars):
    small, before = kept(standing, gradient()), standing.get(f"{API}/jobs").json()["items"]
    for body in (
        {},
        {"lines": [[[1, 2], [3, 4], [5, 6]]]},
        {"snapshots": [bars[0]], "lens": "fisheye"},
        {"snapshots": [bars[0], small]},
        {"snapshots": ["nobody"]},
    ):
        refusal(standing.post(f"{STRAIGHTNESS}?job=true", json=body))
    assert standing.get(f"{API}/jobs").json()["items"] == before


def test_pictures_that_differ_in_size_or_not_at_all_are_refused(standing, bars):
    small = kept(standing, gradient())
    refusal(standing.post(STRAIGHTNESS, json={"snapshots": [bars[0], small]}), 409, "size-mismatch")
    refusal(
        standing.post(STRAIGHTNESS, json={"snapshots": [small], "image_size": [640, 480]}),
        409,
        "size-mismatch",
    )
    refusal(standing.post(STRAIGHTNESS, json={"snapshots": [bars[0]] * 2}), 422, "same-picture")
    refusal(standing.post(STRAIGHTNESS, json={"snapshots": [small]}), 422, "too-few-lines")


def test_a_picture_damaged_on_disk_is_said_so(standing):
    id = kept(standing, bars_behind(shade=99))
    snapshots = standing.app.state.services.store.snapshots
    path = snapshots.path(snapshots.get(id))
    path.write_bytes(path.read_bytes()[:-1] + b"x")
    told = finished(
        standing, accepted(standing.post(f"{STRAIGHTNESS}?job=true", json={"snapshots": [id]}))
    )
    assert (
        told["problem"]["type"] == "/problems/damaged-file"
        and "Image 1" in told["problem"]["detail"]
    )


GOOD = BENT.to_json()
NO_LENS = {
    "another kind": ({**GOOD, "name": "fisheye"}, 422, "bad-lens"),
    "an infinite term": ({**GOOD, "terms": {"k": float("inf")}}, 422, None),
    "terms in a list": ({**GOOD, "terms": [0.1]}, 422, "bad-request"),
    "no centre": ({k: v for k, v in GOOD.items() if k != "centre_px"}, 422, "bad-request"),
    "other units": ({**GOOD, "unit": "focal-length"}, 422, "bad-request"),
    "of other pictures": ({**GOOD, "image_size": [1280, 960]}, 409, "size-mismatch"),
    "nothing": (None, 422, "bad-request"),
}


@pytest.mark.parametrize("name", NO_LENS)
def test_a_lens_that_is_none_straightens_nothing(standing, bars, name):
    lens, status, reason = NO_LENS[name]
    body = json.dumps({"snapshot": bars[0], "lens": lens})
    refusal(
        standing.post(f"{STRAIGHTNESS}/picture.png", content=body, headers=JSON), status, reason
    )


@pytest.mark.parametrize("name", ["division", "division-even", "brown-conrady"])
@pytest.mark.parametrize("term", [-1e6, -3, 3, 1e6])
def test_a_lens_that_bends_beyond_measure_still_draws_a_picture(standing, bars, name, term):
    """Mostly of what the raw picture does not show."""
    lens = {
        **GOOD,
        "name": name,
        "terms": {"k" if name == "division" else "k2": term},
        "centre_px": [-1e5, 1e5],
    }
    for centre in (GOOD["centre_px"], [-1e5, 1e5]):
        answer = standing.post(
            f"{STRAIGHTNESS}/picture.jpg?width=64",
            json={"snapshot": bars[0], "lens": {**lens, "centre_px": centre}},
        )
        assert answer.status_code == 200, answer.text


def test_an_unknown_picture_and_a_wrong_format_are_not_straightened(standing, bars):
    call = f"{STRAIGHTNESS}/picture"
    refusal(
        standing.post(f"{call}.png", json={"snapshot": "nobody", "lens": GOOD}),
        404,
        "unknown-snapshot",
    )
    refusal(standing.post(f"{call}.gif", json={"snapshot": bars[0], "lens": GOOD}))
    refusal(standing.post(f"{call}.png?width=1", json={"snapshot": bars[0], "lens": GOOD}), 422)


@pytest.mark.long
def test_the_facade_by_its_own_picture(standing, real_data):
    data = real_data("lines/ipol_alvarez/building.png").read_bytes()
    id = standing.post(f"{API}/snapshots", files={"file": data}).json()["id"]
    found = judged(standing, snapshots=[id])
    assert found["distortion"] == "significant" and found["straightness_px"]["after"] <= 0.20
