"""A file that does not state its lens: both lenses with the refusal, and what each makes of an image."""

import json
from itertools import pairwise

import cv2
import numpy as np
import pytest

from tests.support.bar_pictures import SIZE, bars_behind
from tests.support.pictures import encoded, gradient
from tests.support.refusals import API, refusal
from touchline.core.geometry import ImageSize
from touchline.models.intrinsics import Intrinsics

IMPORT, PICTURE = f"{API}/calibrations/import", f"{API}/lenses/picture"
FISHEYE = (0.05, 0.012, -0.004, 0.0006)
ORDINARY = (-0.21, 0.05, 0.002, -0.001)
JSON = {"Content-Type": "application/json"}


def file_of(terms, size=SIZE, **more):
    numbers = {"fx": 400, "fy": 396, "cx": 322, "cy": 238, "D": terms, **more}
    return json.dumps(numbers if size is None else {**numbers, "image_size": [*size]})


def imported(client, text, **stated):
    return client.post(IMPORT, files={"file": ("lens.json", text)}, data=stated)


def lenses_of(client, text, **stated):
    """Both readings, by model."""
    found = refusal(imported(client, text, **stated), 422, "unstated-lens")["lenses"]
    assert [each["model"] for each in found] == ["brown-conrady", "fisheye"]
    return {each["model"]: each for each in found}


def kept(client, pixels):
    return client.post(f"{API}/snapshots", files={"file": encoded("png", pixels)}).json()["id"]


def drawn(client, **body):
    answer = client.post(f"{PICTURE}.png?width=320", json=body)
    assert answer.status_code == 200, answer.text
    return cv2.imdecode(np.frombuffer(answer.content, np.uint8), 1)


def bow_px(client, lens, snapshot):
    """How far edges bend in the picture that a lens has straightened."""
    answer = client.post(f"{PICTURE}.png", json={"lens": lens, "snapshot": snapshot})
    pixels = cv2.imdecode(np.frombuffer(answer.content, np.uint8), 1)
    assert pixels.shape[1::-1] == tuple(SIZE)
    found = client.post(f"{API}/straightness", json={"snapshots": [kept(client, pixels)]}).json()
    return found["bow"]["most"]["px"]


@pytest.mark.parametrize("model, terms", [("fisheye", FISHEYE), ("brown-conrady", ORDINARY)])
def test_the_right_lens_straightens_the_camera_s_image_and_the_other_does_not(
    standing, model, terms
):
    lenses = lenses_of(standing, file_of(terms))
    truth = Intrinsics.from_json(lenses[model]["lens"])
    snapshot = kept(standing, bars_behind(truth))
    bows = {name: bow_px(standing, each["lens"], snapshot) for name, each in lenses.items()}
    assert bows.pop(model) < 0.7 and max(bows.values()) > 5
    made = imported(standing, file_of(terms), model=model)
    assert made.status_code == 201 and made.json()["lens"] == lenses[model]["lens"]


def test_both_angles_of_view_are_said_from_corner_to_corner(standing):
    lenses = lenses_of(standing, file_of((0.0, 0.0, 0.0, 0.0), fy=400, cx=319.5, cy=239.5))
    half = np.hypot(320, 240) / 400  # the diagonal's, in focal lengths
    assert lenses["brown-conrady"]["view_deg"] == pytest.approx(2 * np.degrees(np.arctan(half)))
    assert lenses["fisheye"]["view_deg"] == pytest.approx(2 * np.degrees(half))
    told = refusal(imported(standing, file_of((0.0, 0.0, 0.0, 0.0), fy=400, cx=319.5, cy=239.5)))
    assert "it sees 90° as an ordinary lens, 115° as a fisheye" in told["detail"]


def test_a_size_that_is_not_known_is_asked_for_before_the_lens(standing):
    text = file_of(FISHEYE, size=None)
    assert "image_size" in refusal(imported(standing, text), 422, "no-image-size")["fix"]
    lens = lenses_of(standing, text, image_size="640x480")["fisheye"]["lens"]
    assert lens["image_size"] == {"width": 640, "height": 480}
    other = lenses_of(standing, file_of(FISHEYE), image_size="320x240")["fisheye"]["lens"]
    assert other["focal_px"] == 200
    refusal(imported(standing, file_of(FISHEYE), image_size="320x320"), 409, "size-mismatch")


def test_a_lens_is_scaled_to_an_image_of_the_same_shape(standing):
    lens = lenses_of(standing, file_of(FISHEYE))["fisheye"]["lens"]
    pixels = bars_behind(Intrinsics.from_json(lens))
    whole = drawn(standing, lens=lens, snapshot=kept(standing, pixels))
    half = kept(standing, cv2.resize(pixels, (320, 240), interpolation=cv2.INTER_AREA))
    assert np.abs(drawn(standing, lens=lens, snapshot=half).astype(int) - whole).mean() < 4
    square = kept(standing, gradient(480, 480))
    answer = standing.post(f"{PICTURE}.png", json={"lens": lens, "snapshot": square})
    refusal(answer, 409, "size-mismatch")


def test_a_camera_s_live_image_is_corrected_as_its_snapshot_is(standing):
    camera = standing.get(f"{API}/cameras").json()["items"][0]["id"]
    taken = standing.post(f"{API}/snapshots", json={"camera": camera}).json()
    size = ImageSize(taken["width"], taken["height"])
    lens = lenses_of(standing, file_of(FISHEYE, size, cx=size.centre[0], cy=size.centre[1]))
    asked = {"lens": lens["fisheye"]["lens"]}
    live = drawn(standing, **asked, camera=camera)
    assert live.std() > 5
    assert np.abs(live.astype(int) - drawn(standing, **asked, snapshot=taken["id"])).mean() < 12


def straight_rows(picture):
    """How many pixel rows and columns are a line from end to end."""
    ink = picture.min(axis=2) < 200
    return sum((ink.mean(axis=axis) > 0.95).sum() for axis in (0, 1))


def test_without_an_image_squares_are_drawn_as_the_lens_shows_them(standing):
    lenses = lenses_of(standing, file_of(FISHEYE, fx=200, fy=200))
    pinhole = lenses_of(standing, file_of((0.0,) * 4))["brown-conrady"]["lens"]
    straight = drawn(standing, lens=pinhole)
    assert straight.shape == (240, 320, 3)
    assert straight_rows(straight) >= 12
    bent = [drawn(standing, lens=each["lens"]) for each in lenses.values()]
    assert max(straight_rows(each) for each in bent) <= 5  # those through the axis
    for one, other in pairwise([straight, *bent]):
        assert np.abs(one.astype(int) - other).mean() > 5


GOOD = {
    "model": "fisheye",
    "terms": [*FISHEYE],
    "focal_px": 400.0,
    "aspect": 1.0,
    "centre_px": [320.0, 240.0],
    "image_size": {"width": 640, "height": 480},
}
WRONG = {
    "an unknown model": ({"model": "omni"}, 404),
    "a model without a lens": ({"model": "polynomial"}, 422),
    "too few terms": ({"terms": [0.1]}, 422),
    "no terms": ({"terms": None}, 422),
    "a size in a list": ({"image_size": [640, 480]}, 422),
    "an infinite term": ({"terms": [float("inf"), 0, 0, 0]}, 422),
    "no focal length": ({"focal_px": 0}, 422),
    "a size of one pixel": ({"image_size": {"width": 1, "height": 1}}, 422),
    "giant images": ({"image_size": {"width": 65536, "height": 65536}}, 422),
    "an unknown entry": ({"fov": 3}, 422),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_no_lens_is_refused(standing, name):
    changes, status = WRONG[name]
    body = json.dumps({"lens": {**GOOD, **changes}})
    refusal(standing.post(f"{PICTURE}.png", content=body, headers=JSON), status)


BEYOND = {
    "a radius that swings": {"terms": [1e6, -1e6, 1e6, -1e6]},
    "a radius that falls": {"terms": [-1e6, 0, 0, 0]},
    "a centre far away": {"centre_px": [-1e5, 1e5]},
    "a long lens": {"focal_px": 64_000},
    "a short lens": {"focal_px": 32.0},
    "tangential terms": {"model": "brown-conrady", "terms": [-3, 1e6, 1e3, -1e3, 0, 0, 0, 0]},
    "a divisor of 0": {"model": "brown-conrady", "terms": [1, 2, 0, 0, 3, -1e6, 1e6, -1e6]},
    "a division lens": {"model": "division", "terms": [-1e6]},
}


@pytest.mark.parametrize("name", BEYOND)
def test_a_lens_beyond_measure_still_draws_a_picture(standing, name):
    snapshot = kept(standing, gradient(640, 480))
    for image in ({}, {"snapshot": snapshot}):
        answer = standing.post(
            f"{PICTURE}.jpg?width=64", json={"lens": {**GOOD, **BEYOND[name]}, **image}
        )
        if answer.status_code != 200:
            refusal(answer, 422)


def test_images_that_are_none_are_refused_by_name(standing):
    for image, status, reason in (
        ({"snapshot": "nobody"}, 404, "unknown-snapshot"),
        ({"camera": "nobody"}, 404, "unknown-camera"),
        ({"camera": "nobody", "snapshot": "nobody"}, 422, "bad-request"),
    ):
        answer = standing.post(f"{PICTURE}.png", json={"lens": GOOD, **image})
        refusal(answer, status, reason)
    for width in (1, 9000):
        refusal(standing.post(f"{PICTURE}.png?width={width}", json={"lens": GOOD}), 422)
    tall = {**GOOD, "focal_px": 10.0, "image_size": {"width": 16, "height": 60_000}}
    refusal(standing.post(f"{PICTURE}.png?width=8192", json={"lens": tall}), 422, "bad-view")
