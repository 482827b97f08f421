"""The scene in 3-D by the page, with WebGL in software: what stands in it, and what a click on the carpet tells."""

import re

import cv2
import numpy as np
import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.demo_cameras import CAMERAS
from tests.support.manual_pictures import manual_picture
from tests.support.scene_calibrations import border_and_circle_clicks
from tests.support.waiting import until

FOV_DEG, ROOM = 50, 1.12  # app/touchline/scene/frustum.py
CARPET = (36, 100, 56)  # RGB about as it is drawn in the dark
NEAR, STILL = 40, 0.5  # of 255


@pytest.fixture(scope="module")
def kept(server):
    """Two versions from one picture of the demo's tilted camera: one with rays, one of a model that knows no camera."""
    source = next(camera["source"] for camera in CAMERAS if camera["id"] == "east")
    taken = until(
        lambda: server.api("POST", "/snapshots", json={"camera": "east"}), lambda answer: answer.ok
    )
    picture = taken.json()["id"]
    observations = border_and_circle_clicks(source, "half-right")
    ids = []
    for model in ("brown-conrady", "polynomial"):
        made = server.api(
            "POST",
            "/calibrations",
            json={
                "snapshot": picture,
                "field": "ssl-div-b",
                "region": "half-right",
                "model": model,
                "observations": observations,
            },
        )
        assert made.ok, made.text
        ids.append(made.json()["id"])
    return ids


def plain(text: str) -> list[float]:
    """Numbers as the page prints them: −1 001, 982 mm."""
    return [
        float(re.sub(r"\s", "", part).replace("−", "-"))
        for part in text.removesuffix(" mm").split(", ")
    ]


def seen(page) -> np.ndarray:
    """What the scene's window shows, RGB."""
    picture = page.get_by_test_id("scene-frame").screenshot(timeout=LONG_MS)
    return cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR)[..., ::-1]


def until_drawn(page) -> None:
    """From above the carpet is in the middle of the window, once all has faded in and nothing moves any more."""
    last = np.zeros(1)

    def look() -> tuple[list[float], float]:
        """The colour there, and how far the window differs from what it was half a second ago."""
        nonlocal last
        page.wait_for_timeout(500)
        before, last = last, seen(page).astype(float)
        height, width = last.shape[:2]
        patch = last[int(0.42 * height) : int(0.46 * height), int(0.55 * width) : int(0.6 * width)]
        moved = np.abs(last - before).mean() if before.shape == last.shape else np.inf
        return patch.reshape(-1, 3).mean(axis=0).tolist(), float(moved)

    until(
        look,
        lambda told: np.abs(np.subtract(told[0], CARPET)).max() < NEAR and told[1] < STILL,
        seconds=LONG_MS / 1000,
    )


@pytest.mark.long
def test_a_click_on_the_carpet_tells_its_pixel_and_expected_error(operator, kept):
    page, server = operator.page, operator.server
    page.set_viewport_size({"width": 1100, "height": 560})  # fewer pixels for a processor to shade
    page.goto(f"{server.url}/#/field/scene/{kept[0]}")
    expect(page.get_by_test_id("scene-page")).to_have_attribute(
        "data-ready", "true", timeout=LONG_MS
    )
    expect(page.get_by_test_id("scene-height")).to_contain_text("m")
    page.get_by_test_id("scene-above").click()
    until_drawn(page)

    box = page.get_by_test_id("scene-frame").bounding_box()
    across, down = 0.62, 0.40
    page.mouse.click(box["x"] + across * box["width"], box["y"] + down * box["height"])
    expect(page.get_by_test_id("scene-place")).to_be_visible(timeout=LONG_MS)
    half_mm = ROOM * max(9000 * box["height"] / box["width"], 6000) / 2
    wanted = [(2 * across - 1) * half_mm * box["width"] / box["height"], (1 - 2 * down) * half_mm]
    manual_picture(page, "scene")
    numbers = plain(page.get_by_test_id("scene-place").locator("h2").inner_text())
    assert numbers == pytest.approx(wanted, abs=60)  # mm: three pixels of the window

    answer = server.api(
        "POST",
        f"/calibrations/{kept[0]}/transform",
        json={"from": "field", "to": "image", "points": [numbers]},
    ).json()["points"][0]
    pixel = plain(page.get_by_test_id("place-pixel").inner_text())
    assert pixel == pytest.approx(answer, abs=1.0)  # the heading is in whole mm
    assert float(page.get_by_test_id("place-sigma").inner_text().split()[0]) > 0

    page.get_by_test_id("sheet-carpet").click()
    expect(page.locator(".scene-scale")).to_be_visible()
    through = page.get_by_test_id("through-East camera, tilted")
    through.click()
    expect(through).to_have_attribute("aria-pressed", "true")

    page.get_by_test_id("place-show").click()
    expect(page.get_by_test_id("step-points")).to_have_attribute(
        "aria-current", "step", timeout=LONG_MS
    )
    stage = page.get_by_test_id("stage").bounding_box()
    middle = stage["x"] + stage["width"] / 2, stage["y"] + stage["height"] / 2
    operator.wait_for_picture()
    near = pytest.approx(middle, abs=8)  # screen px
    # its versions are looked for before
    until(lambda: operator.spot(*pixel), lambda at: at == near)


def test_a_model_without_rays_says_why_there_is_no_camera(operator, kept):
    page = operator.page
    page.goto(f"{operator.server.url}/#/field/scene/{kept[1]}")
    expect(page.get_by_test_id("no-frustum")).to_contain_text("no frustum", timeout=LONG_MS)
    expect(page.get_by_test_id("scene-height")).to_have_count(0)
    expect(page.get_by_test_id("sheet-carpet")).to_be_disabled()
    page.goto(f"{operator.server.url}/#/field/scene/{'0' * 16}")
    expect(page.get_by_test_id("scene-refusal")).to_be_visible(timeout=LONG_MS)
