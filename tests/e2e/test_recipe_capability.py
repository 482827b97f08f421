"""The manual's recipe of a capability, followed word for word: its route, its job and its view are there."""

import os
import shutil
import subprocess
import sys

import cv2
import numpy as np
import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.recipe import copy_project, edit_files, recipes, write_files
from tests.support.servers import API, served
from touchline import Client
from touchline.core.errors import BadInput

RECIPE = recipes()["Add a capability"]
MAX_FILES = 5


@pytest.fixture(autouse=True)
def started(browser):
    """The browser, before the first test and until after the last one."""


@pytest.fixture(scope="module")
def changed(tmp_path_factory):
    """A copy of the program in which the recipe was followed, and the files that it names."""
    place = tmp_path_factory.mktemp("recipe") / "touchline"
    folder = copy_project(place, ("app", "configs", "static", "pyproject.toml"))
    return folder, [*write_files(folder, RECIPE), *edit_files(folder, RECIPE)]


@pytest.fixture(scope="module")
def images():
    """Of a grey hall: one as it should be, one that is saturated at the top, and large ones that take their time."""
    grey = np.full((480, 640, 3), 120, np.uint8)
    bright = grey.copy()
    bright[:48] = 255
    large = np.random.default_rng(1).integers(60, 180, (2400, 3200, 3), np.uint8)
    return [cv2.imencode(".jpg", pixels)[1].tobytes() for pixels in (grey, bright, large)]


@pytest.fixture(scope="module")
def client(changed, tmp_path_factory):
    """Of a server of that copy."""
    folder, _ = changed
    with served(tmp_path_factory.mktemp("data"), project=folder) as url, Client(url) as client:
        client.url = url
        yield client


def upload(client, image: bytes) -> str:
    return client.call("POST", "/snapshots", files={"file": ("image.jpg", image)}).json()["id"]


def test_it_is_five_files_that_pass_the_linter_and_the_import_rules(changed):
    folder, names = changed
    assert len({*names}) <= MAX_FILES
    assert not [
        line
        for name in names
        for line in (folder / name).read_text().splitlines()
        if len(line) > 120
    ]
    environment = {**os.environ, "PYTHONPATH": str(folder / "app")}
    for command in (
        ["ruff", "check", "--no-cache", *(name for name in names if name.endswith(".py"))],
        ["lint-imports", "--no-cache"],
        ["oxlint", *(name for name in names if name.endswith(".js"))],
    ):
        program = shutil.which(command[0], path=os.path.dirname(sys.executable))
        done = subprocess.run(
            [program, *command[1:]], cwd=folder, env=environment, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stdout + done.stderr


def test_its_route_starts_a_job_whose_result_is_right(client, images):
    ids = [upload(client, image) for image in images[:2]]
    job = client.call("POST", "/exposure", json={"snapshots": ids}).json()
    seen = []
    good, bright = client.wait(job, lambda share, message: seen.append(message))["images"]
    assert (good["saturated"], good["black"]) == (0, 0) and bright["saturated"] == pytest.approx(
        0.1, abs=0.01
    )
    assert "overexposed" in bright["advice"][0]["text"] and bright["advice"][0]["fix"]
    assert f"{API}/exposure" in client.call("GET", "/openapi.json").json()["paths"]
    with pytest.raises(BadInput, match="snapshots"):
        client.call("POST", "/exposure", json={"snapshots": []})


def test_its_view_shows_progress_and_the_result_and_stops(client, images, page):
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    upload(client, images[1])
    page.goto(client.url)
    page.get_by_test_id("rail-library").click()
    page.get_by_role("link", name="Exposure", exact=True).click()
    expect(page.get_by_role("heading", name="Exposure")).to_be_visible()
    page.get_by_test_id("do-measure-exposure").click()
    expect(page.get_by_test_id("exposure").first).to_contain_text(
        "10.0 % saturated, 0.0 % black", timeout=LONG_MS
    )
    expect(page.get_by_test_id("exposure").first).to_contain_text("Shorten the exposure")

    for _ in range(12):
        upload(client, images[2])
    page.reload()
    page.get_by_test_id("do-measure-exposure").click()
    expect(page.get_by_test_id("finding")).to_contain_text("of 12", timeout=LONG_MS)
    page.get_by_test_id("do-stop-exposure").click()
    expect(page.get_by_test_id("do-measure-exposure")).to_be_enabled()
    expect(page.get_by_test_id("finding")).to_have_count(0)
    expect(page.get_by_test_id("exposure")).to_have_count(0)
    page.goto(f"{client.url}/#/system/jobs")
    stopped = page.get_by_test_id("job").first
    expect(stopped).to_contain_text("Exposure")
    expect(stopped).to_have_attribute("data-state", "cancelled")
    assert not errors


def test_its_view_is_german_where_the_page_is(client, page):
    page.add_init_script("localStorage.setItem('touchline-language', 'de')")
    page.goto(f"{client.url}/#/library/exposure")
    expect(page.get_by_role("heading", name="Belichtung")).to_be_visible()
    expect(page.get_by_test_id("do-measure-exposure")).to_have_text("Belichtung messen")
