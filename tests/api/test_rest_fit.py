"""Fits that save nothing: one border at once, and the preview of a whole calibration."""

from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from threading import Event

import numpy as np
import pytest

from tests.support.refusals import API, refusal, without_size
from tests.support.rest_jobs import finished
from tests.support.waiting import LONG_S, until
from touchline.core.errors import Cancelled

BORDER = f"{API}/fit/border"


def bowed(count=9, bow_px=12.0):
    """A left border down a picture of 640 × 480, bowed outwards in its middle."""
    y = np.linspace(20, 460, count)
    return np.stack([60 - bow_px * (1 - ((y - 239.5) / 240) ** 2), y], axis=1).tolist()


def test_a_border_is_answered_with_its_curve_residuals_and_signed_distortion(standing):
    body = {"points": bowed(), "axis": "x_of_y", "degree": 2, "image_size": [640, 480]}
    found = standing.post(BORDER, json=body).json()
    assert found["degree"] == 2 and len(found["coefficients"]) == 3
    assert (
        found["rms_px"] < 1e-9
        and max(map(abs, found["residuals_px"])) < 1e-9
        and found["outliers"] == []
    )
    assert found["kind"] == "barrel" and found["distortion_pct"] < 0
    curve = np.array(found["curve"])
    assert curve[0, 1] == -0.5 and curve[-1, 1] == 479.5
    assert np.allclose(
        np.polynomial.polynomial.polyval(curve[:, 1], found["coefficients"]), curve[:, 0], atol=1e-6
    )


def test_an_automatic_degree_says_why(standing):
    found = standing.post(
        BORDER, json={"points": bowed(), "axis": "x_of_y", "degree": "auto"}
    ).json()
    assert found["degree"] == 2 and "Degree 1 is worse" in found["degree_reason"]


def test_a_stray_point_is_named_by_its_index(standing):
    points = bowed(15)
    points[7][0] += 30
    assert standing.post(BORDER, json={"points": points, "axis": "x_of_y", "degree": 2}).json()[
        "outliers"
    ] == [7]


def test_a_border_across_the_picture_is_the_same_with_x_and_y_exchanged(standing):
    down = standing.post(BORDER, json={"points": bowed(), "axis": "x_of_y", "degree": 3}).json()
    across = standing.post(
        BORDER, json={"points": [p[::-1] for p in bowed()], "axis": "y_of_x", "degree": 3}
    ).json()
    assert down["coefficients"] == across["coefficients"]


def test_many_points_give_the_same_as_numpy(standing):
    rng = np.random.default_rng(3)
    y = np.linspace(20, 4000, 2000)
    points = np.stack([60 + y * 0.05 - (y / 1000) ** 2 + rng.normal(0, 0.3, 2000), y], axis=1)
    found = standing.post(
        BORDER, json={"points": points.tolist(), "axis": "x_of_y", "degree": 3}
    ).json()
    kept = np.delete(np.arange(2000), found["outliers"])
    expected = np.polynomial.Polynomial.fit(points[kept, 1], points[kept, 0], 3).convert().coef
    assert np.allclose(found["coefficients"], expected, rtol=1e-6)


def test_whole_numbers_are_numbers(standing):
    body = {"points": [[60, 20], [50, 240], [60, 460], [52, 130]], "axis": "x_of_y", "degree": 2}
    assert standing.post(BORDER, json=body).status_code == 200


@pytest.mark.parametrize("quick", [False, True])
def test_the_preview_is_what_would_be_saved_and_saves_nothing(client, snapshot, task, quick):
    body = {**without_size(task), "snapshot": snapshot["id"]}
    shown = client.post(f"{API}/fit/preview", params={"quick": quick}, json=body).json()
    assert client.get(f"{API}/calibrations").json()["items"] == []
    kept = client.post(f"{API}/calibrations", json=body).json()
    assert shown["model"] == kept["model"] and shown["corrected_size"] == kept["corrected_size"]
    assert (shown["report"]["cv_rms_mm"] is None) == quick
    if not quick:
        assert shown["report"] == kept["report"]
    assert (
        shown["overlay"]
        == client.get(f"{API}/calibrations/{kept['id']}/overlay.json").json()["features"]
    )


def test_the_preview_draws_the_borders_through_the_clicks(standing, task):
    overlay = standing.post(f"{API}/fit/preview", json=task).json()["overlay"]
    drawn = {shape["feature"]: shape["points"] for shape in overlay if shape["kind"] == "border"}
    assert set(drawn) == {"left", "right", "top", "bottom"}
    for observation in task["observations"]:
        curve = np.array([p for p in drawn[observation["feature"]] if p])
        for point in observation["points"]:
            # the polyline's corners are 50 mm apart
            assert np.linalg.norm(curve - point, axis=1).min() < 12


def test_what_cannot_be_fitted_yet_is_an_answer_of_an_attempt_and_a_refusal_of_a_preview(
    standing, task
):
    few = {
        **task,
        "observations": [{**o, "points": o["points"][:1]} for o in task["observations"][:4]],
    }
    refused, attempted = (
        standing.post(f"{API}/fit/{way}", json=few) for way in ("preview", "attempt")
    )
    assert refused.status_code == 422 and attempted.status_code == 200
    told = attempted.json()["refusal"]
    assert (told["what"], told["fix"]) == (refused.json()["detail"], refused.json()["fix"])
    assert told["reason"] and told["title"] and attempted.json()["preview"] is None
    assert standing.post(f"{API}/fit/attempt", json={**few, "model": "no-such"}).status_code == 404
    enough = standing.post(f"{API}/fit/attempt", json=task).json()
    assert enough == {
        "preview": standing.post(f"{API}/fit/preview", json=task).json(),
        "refusal": None,
    }


def test_the_model_auto_is_a_lens_in_the_preview_and_saved_as_the_recommended_one(client, task):
    body = {**task, "model": "auto"}
    shown = client.post(f"{API}/fit/preview?quick=true", json=body).json()
    assert shown["model"]["name"] in ("brown-conrady", "fisheye")
    assert (
        shown["report"]["camera"]["height_mm"] > 1000
        and 0 <= shown["report"]["camera"]["tilt_deg"] < 90
    )
    made = client.post(f"{API}/calibrations", json=body).json()
    choice = made["report"]["model_choice"]
    assert (
        made["model"]["name"] == choice["recommended"]
        and choice["reason"]
        and len(choice["ranking"]) > 3
    )


def test_a_version_is_saved_as_the_preview_shows_it_where_no_models_are_to_be_compared(
    client, task
):
    body = {**task, "model": "auto"}
    shown = client.post(f"{API}/fit/attempt", json=body).json()["preview"]
    made = client.post(f"{API}/calibrations", json={**body, "compare": False}).json()
    assert made["model"] == shown["model"]
    assert made["corrected_size"] == shown["corrected_size"]
    choice = made["report"].pop("model_choice")
    assert made["report"] == shown["report"]
    assert choice["recommended"] is None and choice["ranking"] == [] and choice["reason"]
    assert client.get(f"{API}/calibrations/{made['id']}").json()["model"] == shown["model"]
    few = {**body, "compare": False, "observations": body["observations"][:1]}
    refused = client.post(f"{API}/calibrations", json=few)
    assert refused.status_code == 422 and refused.json()["fix"]


def test_a_job_saves_without_comparing_where_it_is_not_wanted(client, task):
    body = {**task, "model": "auto", "compare": False}
    job = client.post(f"{API}/calibrations?job=true", json=body).json()
    made = finished(client, job)["result"]["calibration"]
    made = client.get(f"{API}/calibrations/{made}").json()
    assert made["report"]["model_choice"]["ranking"] == []


@pytest.fixture
def many(task):
    """Every click eighteen times, each a little beside the others: more points than are fitted at once."""
    rng = np.random.default_rng(1)
    return {
        **task,
        "observations": [
            {
                **o,
                "points": (
                    np.repeat(o["points"], 18, axis=0)
                    + rng.normal(0, 0.1, (18 * len(o["points"]), 2))
                ).tolist(),
            }
            for o in task["observations"]
        ],
    }


def test_many_points_are_fitted_where_the_fit_can_be_ended_and_answered_as_few_are(
    client, task, many
):
    few = client.post(f"{API}/fit/attempt?quick=true", json=task).json()["preview"]
    for path, told in (
        ("attempt", lambda answer: answer["preview"]),
        ("preview", lambda answer: answer),
    ):
        found = told(client.post(f"{API}/fit/{path}?quick=true", json=many).json())
        assert found.keys() == few.keys() and found["report"]["inliers"] > 600
    made = client.post(f"{API}/calibrations", json=many)
    assert (
        made.status_code == 201
        and made.json()["version"] == 1
        and made.headers["location"].endswith(made.json()["id"])
    )
    assert [job["kind"] for job in client.get(f"{API}/jobs").json()["items"]] == [
        "calibration",
        "preview",
        "preview",
    ]


def test_many_points_that_cannot_be_fitted_yet_are_told_as_few_are(client, many):
    left = {**many, "observations": [o for o in many["observations"] if o["feature"] == "left"]}
    answer = client.post(f"{API}/fit/attempt", json=left)
    assert answer.status_code == 200 and answer.json()["refusal"]["reason"] == "too-few-points"


def test_more_points_than_a_fit_has_time_for_are_refused(standing, many):
    much = {
        **many,
        "observations": [
            {**o, "points": (np.round(o["points"], 1).tolist() * 40)[:6000]}
            for o in many["observations"]
        ],
    }
    for path in (
        "fit/preview",
        "fit/attempt",
        "calibrations",
        "calibrations?job=true",
        "calibrations/compare",
    ):
        refusal(standing.post(f"{API}/{path}", json=much), 422, "too-many-points")


@contextmanager
def fits_held(client, bodies, query=""):
    """Previews of these bodies, all asked for, of which none ends within the context: futures of empty answers."""
    fits, let_go, asked = client.app.state.services.fits, Event(), []
    take, in_queue = fits._turns.take, []

    def held(*_):
        assert let_go.wait(LONG_S)
        return b"{}"

    def taken(place):
        in_queue.append(place)
        return take(place)

    with pytest.MonkeyPatch.context() as patch, ThreadPoolExecutor(len(bodies)) as crowd:
        patch.setattr(fits, "_attempt", held)
        patch.setattr(fits._turns, "take", taken)
        try:
            for body in bodies:
                asked.append(crowd.submit(client.post, f"{API}/fit/preview{query}", json=body))
                until(lambda: len(in_queue) == len(asked))
            yield asked
        finally:
            let_go.set()


def different(task, count):
    """Bodies of which none is answered by the answer to another."""
    return [{**task, "note": f"{number}"} for number in range(count)]


def test_other_answers_do_not_wait_for_fits(client, calibration, task):
    version = f"/calibrations/{calibration['id']}"
    with fits_held(client, different(task, 6)) as asked:
        for path in (
            f"{version}/mesh",
            f"{version}/report.json",
            f"{version}/overlay.json",
            f"/snapshots/{calibration['snapshot']}/image.png",
            "/health",
        ):
            assert client.get(API + path).status_code == 200
        quick = client.post(f"{API}/fit/preview?quick=true", json=task)
        assert quick.status_code == 200 and not any(answer.done() for answer in asked)
    assert {answer.result().status_code for answer in asked} == {200}


def test_of_a_series_the_newest_is_answered_and_who_waited_is_told(client, task):
    with fits_held(client, different(task, 3), "?series=window") as asked:
        told = until(lambda: next((answer.result() for answer in asked if answer.done()), None))
        assert refusal(told, 409, "superseded")
    assert [answer.result().status_code for answer in asked] == [200, 409, 200]


def test_a_quick_fit_is_not_made_for_who_has_left(client, task):
    services, made = client.app.state.services, []

    async def left():
        return True

    async def ask():
        with pytest.raises(Cancelled):
            await services.fit_quickly(lambda: made.append(1), left)

    client.portal.call(ask)
    assert not made
