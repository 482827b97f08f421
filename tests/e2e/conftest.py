"""The real thing: a server with the demo's cameras on a free port and a data folder of its own, and a real Chromium."""

import json
import os
import queue
import re
import subprocess
import sys
import threading
from pathlib import Path
from urllib.parse import urlsplit

import pytest
import requests
from playwright.sync_api import Page, expect

from tests.support.chromium import ARGUMENTS, FIX, chromium_path
from tests.support.demo_cameras import CAMERAS
from tests.support.paths import CLICKS, ROOT
from tests.support.sim_clicks import border_clicks
from tests.support.waiting import until
from tests.support.words import like
from touchline.core.field_json import field_from_json
from touchline.sources import SourceContext, source_from_url

SOON_MS = 60_000  # what is there at once on a quiet machine
LONG_MS = 180_000  # what has to be computed, or fetched from a camera that is only starting
START_S = 120  # a loaded machine imports OpenCV for many seconds
ANSWER_S = 90
# Where the picture's corner is on the screen, and how large one of its pixels is there.
WHERE = """async (picture) => {
  if (!picture.naturalWidth) await picture.decode();
  const { left, top, width, height } = picture.getBoundingClientRect();
  return [left, top, width / picture.naturalWidth, height / picture.naturalHeight];
}"""
expect.set_options(timeout=SOON_MS)


@pytest.fixture(scope="session")
def browser_type_launch_args(browser_type_launch_args, browser_type):
    path = chromium_path()
    if path is None and not Path(browser_type.executable_path).exists():
        pytest.fail(FIX, pytrace=False)
    return {
        **browser_type_launch_args,
        "args": ARGUMENTS,
        **({"executable_path": path} if path else {}),
    }


@pytest.fixture(scope="session")
def browser_context_args(browser_context_args):
    return {
        **browser_context_args,
        "viewport": {"width": 1280, "height": 800},
        "color_scheme": "dark",
    }


@pytest.fixture(scope="session")
def standing_context(browser, browser_context_args):
    """One for all tests of a worker, since its cache keeps the page's two hundred modules."""
    context = browser.new_context(**browser_context_args)
    yield context
    context.close()


@pytest.fixture
def page(standing_context):
    """A tab, with nothing that another test has stored."""
    page = standing_context.new_page()
    yield page
    standing_context.set_offline(False)
    for tab in standing_context.pages:
        origin = urlsplit(tab.url)._replace(path="", query="", fragment="").geturl()
        stored = {"origin": origin, "storageTypes": "cookies,indexeddb,local_storage"}
        standing_context.new_cdp_session(tab).send("Storage.clearDataForOrigin", stored)
        tab.close()


class Server:
    """A server with the demo's cameras that can be stopped and started again on the same port and data."""

    def __init__(self, data: Path, **settings) -> None:
        self.data, self.port = data, 0
        self.settings = {"cameras": CAMERAS, **settings}
        self.start()

    def program(self) -> list[str]:
        late_ms = os.environ.get("TOUCHLINE_LATE_MS")  # see late_answers.py
        return (
            [sys.executable, str(ROOT / "tests" / "support" / "late_answers.py"), late_ms]
            if late_ms
            else [str(Path(sys.executable).parent / "touchline")]
        )

    def start(self) -> None:
        settings = self.data / "e2e.yaml"
        settings.write_text(json.dumps(self.settings))  # JSON is YAML
        command = [
            *self.program(),
            "serve",
            "--config",
            str(settings),
            "--port",
            str(self.port),
            "--data",
            str(self.data),
        ]
        self.process = subprocess.Popen(
            command, cwd=self.data, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        lines: queue.Queue[str] = queue.Queue()
        threading.Thread(
            target=lambda: [lines.put(line) for line in self.process.stdout], daemon=True
        ).start()
        said = ""
        while not (found := re.search(r"http://127\.0\.0\.1:(\d+)", said)):
            try:
                said += lines.get(timeout=START_S)
            except queue.Empty:
                pytest.fail(
                    f"touchline serve did not start within {START_S} s; it said:\n{said}",
                    pytrace=False,
                )
        self.port = int(found[1])
        self.url = found[0]

    def stop(self) -> None:
        self.process.terminate()
        self.process.wait(timeout=START_S)

    def api(self, method: str, path: str, **more) -> requests.Response:
        return requests.request(method, f"{self.url}/api/v1{path}", timeout=ANSWER_S, **more)


def running(data: Path):
    """A server, until whoever asked for it has done."""
    server = Server(data)
    yield server
    server.stop()


@pytest.fixture(scope="session")
def server(tmp_path_factory):
    """Shared by all: every test works on a picture of its own."""
    yield from running(tmp_path_factory.mktemp("data"))


@pytest.fixture
def own_server(tmp_path):
    """For a test that stops it."""
    yield from running(tmp_path)


def press_activate(page, button) -> None:
    """Press what activates a version, and confirm what the page asks, where it asks."""
    with page.expect_response(
        lambda answer: answer.url.endswith("/activate"), timeout=LONG_MS
    ) as answer:
        button.click()
    if answer.value.status == 409:
        page.get_by_test_id("activate-anyway").click()


class Operator:
    """What a person at the page does, by mouse and keyboard."""

    def __init__(self, page: Page, server: Server) -> None:
        self.page, self.server = page, server
        page.set_default_timeout(LONG_MS)  # a button that waits for a fit
        page.set_default_navigation_timeout(LONG_MS)
        self.prefer("snap", "off")  # most tests mean the very pixels that they click
        self.prefer("detect", "off")  # and those points alone

    def prefer(self, what: str, state: str) -> None:
        """Whether clicks are drawn to lines ("snap"), and lines detected ("detect"): "on" or "off", from now on."""
        keep = f"localStorage.setItem('touchline.{what}', '{state}')"
        self.page.add_init_script(
            f"try {{ {keep} }} catch {{ /* a picture of its own has none */ }}"
        )

    def visit(self, snap: bool = False, detect: bool = False, modules: bool = False) -> "Operator":
        """The start page. snap: whether clicks are drawn to lines; detect: whether lines are detected unasked.

        modules: not bundled, for a test that calls them.
        """
        if snap:
            self.prefer("snap", "on")
        if detect:
            self.prefer("detect", "on")
        self.page.goto(f"{self.server.url}{'/index.html' if modules else ''}")
        expect(self.page.get_by_test_id("camera-overhead")).to_be_visible()
        return self

    def open(self, file: Path | dict, field: str, region: str) -> "Operator":
        """Open a picture, and say what it shows."""
        self.page.get_by_test_id("file").set_input_files(file)
        self.page.get_by_test_id("field").select_option(field)
        self.page.get_by_test_id("region").select_option(region)
        return self.next("points")

    def take(self, camera: str = "overhead") -> "Operator":
        """A picture from one of the demo's cameras."""
        self.page.get_by_test_id(f"camera-{camera}").click()
        self.is_at("points")
        self.wait_for_picture()
        return self

    def go_on(self, snapshot: str, draft: dict, step: str) -> "Operator":
        """With a picture whose clicks were made elsewhere; the draft is what REST takes."""
        path = f"/drafts/{snapshot}"
        tag = self.server.api("GET", path).headers["ETag"]
        answer = self.server.api("PUT", path, json=draft, headers={"If-Match": tag})
        assert answer.ok, answer.text
        self.page.goto(f"{self.server.url}/#/calibrate/{snapshot}/{step}")
        self.is_at(step)
        # not the picture that was there before, at the same step
        source = re.compile(rf"/snapshots/{snapshot}/")
        expect(self.page.get_by_test_id("picture")).to_have_attribute(
            "src", source, timeout=LONG_MS
        )
        self.wait_for_picture()
        return self

    def next(self, step: str) -> "Operator":
        """The primary button, and where it must lead; not pressed where the page is there already."""
        if not self.page.url.endswith(f"/{step}"):
            self.page.get_by_test_id("next").click()
        self.is_at(step)
        if step == "points":
            self.wait_for_picture()
        return self

    def activate(self, warned: bool) -> None:
        """Activate the version at the last step. warned: whether the page must warn of it first."""
        primary, anyway = (
            self.page.get_by_test_id("next"),
            self.page.get_by_test_id("activate-anyway"),
        )
        key = "verify.activate-version-anyway" if warned else "common.activate-version"
        label = re.compile("^" + like(key).pattern.replace(".*?", r"\d+") + "$")
        expect(primary).to_have_text(label, timeout=LONG_MS)
        primary.click()
        if warned:
            assert not self.saved()["active"]
            anyway.click()
        self.is_active()

    def is_active(self) -> None:
        """Back at the cameras, and told so."""
        notice = self.page.get_by_test_id("notice").last
        expect(notice).to_contain_text(like("versions.activated"), timeout=LONG_MS)
        expect(self.page).to_have_url(re.compile(r"#/cameras$"), timeout=LONG_MS)

    def is_at(self, step: str) -> None:
        there = self.page.get_by_test_id(f"step-{step}")
        expect(there).to_have_attribute("aria-current", "step", timeout=LONG_MS)

    def open_lens(self) -> "Operator":
        """Unfold the lens models and their options."""
        self.unfold("lens")
        expect(self.page.get_by_test_id("models")).to_be_visible()
        return self

    def unfold(self, part: str) -> "Operator":
        """Open a part of the results that is closed until asked for."""
        fold = self.page.get_by_test_id(f"fold-{part}")
        if fold.get_attribute("open") is None:
            fold.locator("summary").click()
        return self

    def use_model(self, name: str) -> "Operator":
        """Choose a lens model instead of the automatic one."""
        self.open_lens()
        self.page.get_by_test_id(f"model-{name}").click()
        return self

    def wait_for_picture(self) -> None:
        """Until it can be drawn. (wait_for_function would evaluate text, which the page's policy forbids.)"""
        self.page.get_by_test_id("picture").evaluate("picture => picture.decode()")

    def spot(self, x: float, y: float) -> tuple[float, float]:
        """Where a picture pixel is on the screen, once the picture is there."""
        left, top, across, down = self.page.get_by_test_id("picture").evaluate(WHERE)
        return left + (x + 0.5) * across, top + (y + 0.5) * down

    def click(self, feature: str, points) -> "Operator":
        """Points on one border, each with a real click."""
        self.page.get_by_test_id(f"border-{feature}").click()
        for x, y in points:
            self.page.mouse.click(*self.spot(x, y))
        return self

    def click_all(self, observations) -> "Operator":
        for observation in observations:
            self.click(observation["feature"], observation["points"])
        return self

    @property
    def snapshot(self) -> str:
        return re.search(r"#/calibrate/(\w+)/", self.page.url)[1]

    def draft(self) -> dict:
        """As the server keeps it, once the page says that it is saved.

        A click or a key is "unsaved" before it returns; what the page does later by itself (a point that snaps, another
        operator's change, a finger's touch) must be seen before this is asked.
        """
        expect(self.page.get_by_test_id("saved")).to_have_attribute(
            "data-state", "saved", timeout=LONG_MS
        )
        return self.server.api("GET", f"/drafts/{self.snapshot}").json()

    def points(self, feature: str) -> list[list[float]]:
        return next(
            (o["points"] for o in self.draft()["observations"] if o["feature"] == feature), []
        )

    def saved(self) -> dict:
        """The newest calibration of this picture, as REST tells it."""
        listed = self.server.api("GET", "/calibrations").json()["items"]
        return next(c for c in listed if c["snapshot"] == self.snapshot)


@pytest.fixture
def arriving(page, server):
    """Nowhere yet: the address of any place is a way in. An error in the page's own code fails the test."""
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    yield Operator(page, server)
    assert not errors


@pytest.fixture
def operator(arriving):
    """At the start page of the shared server."""
    return arriving.visit()


@pytest.fixture
def clicks():
    """Our clicks on a real picture: {"field", "region", "image_size", "observations"}."""
    return lambda name: json.loads((CLICKS / f"{name}.json").read_text())


@pytest.fixture
def straight_picture(tmp_path):
    """A drawn picture, 640 × 480, with one white frame on green: borders at x 80 and 560, y 60 and 420."""
    import cv2
    import numpy as np

    pixels = np.full((480, 640, 3), (40, 90, 30), np.uint8)
    cv2.rectangle(pixels, (80, 60), (560, 420), (255, 255, 255), 3)
    path = tmp_path / "straight.png"
    cv2.imwrite(str(path), pixels)
    return path


@pytest.fixture
def frame_points():
    """Six clicks on each side of that frame."""
    along_x, along_y = [100, 190, 280, 370, 460, 550], [70, 140, 210, 280, 350, 410]
    return {
        "left": [[80, y] for y in along_y],
        "right": [[560, y] for y in along_y],
        "top": [[x, 60] for x in along_x],
        "bottom": [[x, 420] for x in along_x],
    }


@pytest.fixture(scope="session")
def border_draft(server):
    """A function that takes a picture of the demo's camera and clicks its borders: the picture's id and the draft."""
    settings = CAMERAS[0]
    field = field_from_json(server.api("GET", f"/fields/{settings['field']}").json())
    camera = source_from_url(settings["source"], SourceContext(fields={field.name: field})).camera
    region = field.region(settings["region"])

    def border_draft(
        model: str, noise_px: float = 0.3, painted: str | None = None, **options
    ) -> tuple[str, dict]:
        points = border_clicks(camera, region, 9, noise_px)
        if painted is not None:
            points[painted] = points.pop("bottom")
        taken = until(
            lambda: server.api("POST", "/snapshots", json={"camera": settings["id"]}),
            # until then the camera's process is starting
            lambda answer: answer.status_code != 503,
        )
        return taken.json()["id"], {
            "field": field.name,
            "region": region.name,
            "model": model,
            "options": options,
            "observations": [
                {"feature": name, "kind": "line", "points": found[1:-1].tolist()}
                for name, found in points.items()
            ],
        }

    return border_draft


@pytest.fixture
def clicked(arriving, border_draft):
    """A function that puts the operator before a fresh picture of the demo's camera with its borders clicked.

    change: of the draft, before the page sees it. painted: the name of the line under which the bottom border is
    clicked, where it is not as a border.
    """

    def clicked(model: str, change=lambda draft: None, **how) -> Operator:
        snapshot, draft = border_draft(model, **how)
        change(draft)
        return arriving.go_on(snapshot, draft, "points")

    return clicked


def clicks_left(draft: dict) -> list[list[float]]:
    """The points on the left border, to be changed."""
    return next(o for o in draft["observations"] if o["feature"] == "left")["points"]


def shift_one(draft: dict) -> None:
    """The fifth click on the left border is 30 px off."""
    clicks_left(draft)[4][0] += 30


@pytest.fixture(scope="session")
def versions() -> dict[tuple[str, str], tuple[str, dict]]:
    """The pictures of versions that are saved, and their drafts, by model and options."""
    return {}


@pytest.fixture
def saved(arriving, border_draft, versions, server):
    """A function that puts the operator before a saved version, at the compare step.

    Every test of a worker that asks for the same gets the same version: none may change it.
    """

    def saved(model: str, **options) -> Operator:
        key = model, json.dumps(options)
        if key not in versions:
            snapshot, draft = border_draft(model, **options)
            answer = server.api("POST", "/calibrations", json={**draft, "snapshot": snapshot})
            assert answer.ok, answer.text
            versions[key] = snapshot, draft
        return arriving.go_on(*versions[key], "verify")

    return saved


@pytest.fixture(scope="module")
def field_desk(tmp_path_factory):
    """A server whose own fields, and the cameras over them, are one file's."""
    yield from running(tmp_path_factory.mktemp("fields"))


@pytest.fixture
def editor(page: Page, field_desk):
    """The page; an error in its own code fails the test. Fields that a test has made are gone after it."""
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.set_default_timeout(LONG_MS)
    yield page
    assert not errors
    page.goto("about:blank")
    for camera in field_desk.api("GET", "/cameras").json()["items"]:
        if camera["editable"]:
            field_desk.api("DELETE", f"/cameras/{camera['id']}")
    for field in field_desk.api("GET", "/fields").json()["items"]:
        if field["own"]:
            assert field_desk.api("DELETE", f"/fields/{field['name']}").status_code == 204


@pytest.fixture
def access_rig(server):
    """A rig called access, of which the tests that go through all places see the pages."""
    rig = {"field": "ssl-div-b", "cameras": ["overhead", "east"]}
    assert server.api("PUT", "/rigs/access", json=rig).status_code == 201
    yield
    server.api("DELETE", "/rigs/access")
