"""REST of calibration without clicks: a job; a version where the lines prove it, and the points in any case."""

import cv2
import numpy as np
import pytest

from tests.support.auto_scenes import SceneSpec, scene_of
from tests.support.pictures import encoded, gradient
from tests.support.refusals import API, refusal
from tests.support.rest_jobs import accepted, finished

AUTO = f"{API}/calibrations/auto"
CORNERS = [[10, 10], [800, 10], [800, 600], [10, 600]]
SPEC = SceneSpec(
    3, "ssl-div-b", "full", "mild", (816, 682), 5500.0, 12.0, 0.0, 3.0, 0.7, 2.0, 0.1, 4, 0
)


@pytest.fixture(scope="module")
def seen():
    return scene_of(SPEC)


@pytest.fixture(scope="module")
def picture(standing, seen):
    return kept(standing, seen.pixels)


def kept(client, pixels):
    return client.post(f"{API}/snapshots", files={"file": encoded("png", pixels)}).json()["id"]


def found(client, **body):
    return finished(client, accepted(client.post(AUTO, json=body)))


@pytest.fixture(scope="module")
def made(standing, picture):
    return found(standing, snapshot=picture, field="ssl-div-b", note="by itself")


def test_a_version_is_made_without_a_click(standing, made, picture):
    assert made["state"] == "done" and made["kind"] == "auto", made
    result = made["result"]
    version = standing.get(f"{API}/calibrations/{result['calibration']}").json()
    assert version["snapshot"] == picture and version["note"] == "by itself"
    assert (
        version["observations"] == result["observations"]
        and version["report"]["verdict"]["level"] == "good"
    )
    assert result["proof"]["found_share"] > 0.9 and not result["doubts"] and result["candidates"]


def test_a_version_is_made_of_a_field_that_nobody_named(standing, picture):
    result = found(standing, snapshot=picture)["result"]
    version = standing.get(f"{API}/calibrations/{result['calibration']}").json()
    assert (result["field"], result["region"], result["rotate"]) == ("ssl-div-b", "full", 0)
    assert version["snapshot"] == picture and version["report"]["verdict"]["level"] == "good"
    assert [choice["field"] for choice in result["recognised"]["choices"]] == ["ssl-div-b"]
    assert result["recognised"]["runner_up"]["share"] < 0.9


def test_what_was_found_fits_as_clicks_do(standing, made, picture):
    result = made["result"]
    answer = standing.post(
        f"{API}/fit/preview",
        json={
            "snapshot": picture,
            "field": "ssl-div-b",
            "region": "full",
            "model": "division",
            "observations": result["observations"],
        },
    )
    assert answer.status_code == 200 and answer.json()["report"]["rms_px"] < 0.5


def test_nothing_is_kept_where_only_the_lines_are_wanted(standing, picture):
    before = standing.get(f"{API}/calibrations").json()["items"]
    result = found(standing, snapshot=picture, field="ssl-div-b", keep=False)["result"]
    assert (
        result["calibration"] is None
        and result["observations"]
        and result["verdict"]["level"] == "good"
    )
    assert standing.get(f"{API}/calibrations").json()["items"] == before


def test_a_picture_without_lines_is_declined_with_the_reason_and_no_version(standing):
    result = found(standing, snapshot=kept(standing, gradient(640, 480)), field="ssl-div-b")[
        "result"
    ]
    assert result["calibration"] is None and result["verdict"]["level"] in ("nothing", "unsure")
    assert result["doubts"][0]["reason"] and result["doubts"][0]["fix"]


def test_several_pictures_of_one_size_are_wanted(standing, picture, seen):
    small = kept(standing, cv2.resize(seen.pixels, (408, 341)))
    job = found(standing, snapshots=[picture, small], field="ssl-div-b")
    assert job["state"] == "failed" and job["problem"]["type"].endswith("size-mismatch")


@pytest.mark.parametrize(
    "change, status",
    [
        ({"snapshot": None}, 422),
        ({"camera": "north"}, 422),
        ({"snapshots": []}, 422),
        ({"field": "moon"}, 404),
        ({"field": "auto", "region": "nowhere"}, 404),
        ({"field": "moon", "region": "auto"}, 404),
        ({"region": "nowhere"}, 404),
        ({"model": "magic"}, 422),
        ({"rotate": 45}, 422),
        ({"rough": {"height_mm": 0}}, 422),
        ({"rough": {"colour": 1}}, 422),
        ({"frames": 1000}, 422),
        ({"surprise": 1}, 422),
        ({"snapshot": "none-such"}, 404),
        ({"options": {"lens": "none-such"}}, 404),
        ({"rough": {"turn_deg": "left"}}, 422),
        ({"corners": [[0, 0]]}, 422),
        ({"corners": [[0, 0], [1e9, 0], [1e9, 1e9], [0, 1e9]], "region": "full"}, 422),
        ({"corners": CORNERS}, 422),
        ({"corners": CORNERS[::-1], "region": "full"}, 422),
    ],
)
def test_what_cannot_be_meant_is_refused_at_once(standing, picture, change, status):
    answer = standing.post(AUTO, json={"snapshot": picture, "field": "ssl-div-b", **change})
    assert answer.status_code in (status, 404, 422), answer.text
    assert refusal(answer)["fix"]


def test_a_camera_takes_the_pictures_itself(standing):
    job = found(standing, camera="north", frames=2, field="table")
    assert job["state"] == "done", job
    assert job["result"]["image_size"] == [320, 256]
    taken = standing.get(f"{API}/snapshots").json()["items"]
    assert any(s["camera"] == "north" for s in taken)


def test_numbers_are_plain_json(made):
    assert np.isfinite(made["result"]["proof"]["rms_px"])


def test_a_version_is_checked_against_today_and_nothing_is_made_or_activated_by_it(
    standing, made, seen
):
    id, knocked = made["result"]["calibration"], kept(standing, np.roll(seen.pixels, 3, axis=1))
    before = standing.get(f"{API}/calibrations").json()
    same = standing.post(
        f"{API}/calibrations/{id}/check", json={"snapshot": kept(standing, seen.pixels)}
    )
    assert same.status_code == 200 and same.json()["verdict"]["level"] == "good", same.text
    asked = standing.post(f"{API}/calibrations/{id}/check?job=true", json={"snapshots": [knocked]})
    job = finished(standing, accepted(asked))
    assert job["result"]["verdict"]["reason"] == "moved" and job["result"]["snapshot"] == knocked
    assert (
        job["result"]["lines"]
        and job["result"]["points"]
        and job["result"]["carpet"]["mean_mm"] > 15
    )
    assert standing.get(f"{API}/calibrations").json() == before


def test_a_foreign_calibration_that_was_never_right_is_not_said_to_have_moved(standing, made, seen):
    id, knocked = made["result"]["calibration"], kept(standing, np.roll(seen.pixels, 5, axis=1))
    file = standing.get(f"{API}/calibrations/{id}/export/ssl-vision?approximate=true").content
    theirs = standing.post(
        f"{API}/calibrations/import",
        data={"field": "ssl-div-b", "region": "full", "image_size": "816x682"},
        files={"file": ("camera.txt", file)},
    )
    assert theirs.status_code == 201, theirs.text
    told = standing.post(
        f"{API}/calibrations/{theirs.json()['id']}/check", json={"snapshot": knocked}
    ).json()
    assert (told["verdict"]["reason"], told["verdict"]["level"]) == ("never-right", "poor")
    assert (
        told["change"] is None
        and told["own_level"] == "unknown"
        and told["verdict"]["lines_level"] == "poor"
    )


@pytest.mark.parametrize(
    "body, status, reason",
    [
        ({"snapshot": "none"}, 404, None),
        ({"snapshot": "a", "camera": "b"}, 422, "bad-request"),
        ({}, 422, "no-camera"),
        ({"camera": "nobody"}, 404, None),
        ({"frames": 0}, 422, None),
    ],
)
def test_a_check_that_cannot_be_done_is_refused(standing, made, body, status, reason):
    answer = standing.post(f"{API}/calibrations/{made['result']['calibration']}/check", json=body)
    assert answer.status_code == status and answer.json()["fix"]
    assert reason is None or answer.json()["type"].endswith(reason)
