"""Cameras on the page: live, dead, added, confirmed; watched only while somebody looks."""

import pytest
from playwright.sync_api import expect

from tests.e2e.conftest import LONG_MS
from tests.support.activation import activate_despite
from tests.support.manual_pictures import manual_picture
from tests.support.waiting import until
from tests.support.words import t

SMALL = "sim://table?size=320x256&fps=10&robots=2"


def status(server, id):
    return server.api("GET", f"/cameras/{id}/status").json()


def is_live(page, id):
    """One frame is shown, and then a later one."""

    def seq():
        return int(page.get_by_test_id(f"live-{id}").get_attribute("data-seq"))

    expect(page.get_by_test_id(f"live-{id}")).to_have_attribute(
        "data-state", "live", timeout=LONG_MS
    )
    before = until(seq, lambda now: now > 0)
    until(seq, lambda now: now > before)


@pytest.fixture
def added(server):
    """Cameras added over REST, and removed in the end."""
    ids = []

    def add(id, source=SMALL, **more):
        answer = server.api(
            "POST",
            "/cameras",
            json={
                "id": id,
                "name": id.title(),
                "source": source,
                "field": "table",
                "region": "full",
                **more,
            },
        )
        assert answer.status_code == 201, answer.text
        ids.append(id)
        return id

    yield add
    for id in ids:
        server.api("DELETE", f"/cameras/{id}")


def test_cameras_are_live_on_the_start_page_as_long_as_they_are_drawn_and_looked_at(
    operator, server, added, tmp_path
):
    page = operator.page
    added("dead", "picture://none.png")
    page.reload()  # the list of cameras is the page's own
    is_live(page, "overhead")
    shown = page.get_by_test_id("live-overhead").locator("canvas").bounding_box()
    assert shown["width"] > 150 and shown["height"] > 100
    expect(page.get_by_test_id("live-dead")).to_have_attribute(
        "data-state", "offline", timeout=LONG_MS
    )
    expect(page.get_by_test_id("live-dead")).to_contain_text("none.png")
    is_live(page, "overhead")  # the others go on
    page.screenshot(path=tmp_path / "grid.png")
    is_undrawn_without_ink(page)
    operator.take()
    # Still read: the next picture comes at once.
    until(
        lambda: status(server, "overhead"),
        lambda now: now["viewers"] == 0 and now["state"] == "live",
    )


def is_undrawn_without_ink(page):
    """A stream is called live only as long as this browser draws it."""
    for worker in page.workers:
        worker.evaluate("""() => {
          self.pen = OffscreenCanvasRenderingContext2D.prototype;
          pen.kept = pen.drawImage;
          pen.drawImage = () => { throw Error("no ink"); };
        }""")
    stream = page.get_by_test_id("live-overhead")
    expect(stream).to_have_attribute("data-state", "undrawn")
    expect(page.get_by_test_id("state-overhead")).to_have_text(t("live.state.undrawn"))
    expect(stream).to_contain_text("no ink")
    for worker in page.workers:
        worker.evaluate("() => { pen.drawImage = pen.kept; }")
    is_live(page, "overhead")


def test_one_camera_is_looked_at_raw_corrected_and_side_by_side(operator, server, added):
    page, id = operator.page, added("one")
    snapshot = server.api("POST", "/snapshots", json={"camera": id}).json()
    points = {
        "left": [[40, 60], [40, 128], [40, 200]],
        "right": [[280, 60], [280, 128], [280, 200]],
        "top": [[50, 50], [160, 50], [270, 50]],
        "bottom": [[50, 206], [160, 206], [270, 206]],
    }
    made = server.api(
        "POST",
        "/calibrations",
        json={
            "camera": id,
            "snapshot": snapshot["id"],
            "field": "table",
            "region": "full",
            "model": "homography",
            "observations": [
                {"feature": name, "kind": "line", "points": spots} for name, spots in points.items()
            ],
        },
    ).json()
    operator.visit()
    page.get_by_test_id(f"look-at-{id}").click()
    is_live(page, id)
    assert page.url.endswith(f"#/cameras/{id}/live")
    expect(page.get_by_test_id("look-corrected")).to_be_disabled()
    activate_despite(server, made["id"])
    expect(page.get_by_test_id("look-corrected")).to_be_enabled(timeout=LONG_MS)
    for view in ("corrected", "side"):
        page.get_by_test_id(f"look-{view}").click()
        is_live(page, id)
    page.get_by_test_id("look-raw").click()
    page.get_by_test_id("look-lines").click()
    lines = page.get_by_test_id(f"live-{id}").locator("svg path:not(.casing)")
    expect(lines.nth(4)).to_be_attached(timeout=LONG_MS)
    page.reload()
    is_live(page, id)


def test_a_camera_is_tried_kept_changed_and_removed(operator, server):
    page = operator.page
    page.get_by_test_id("add-camera").click()
    expect(page.get_by_test_id("do-keep-camera")).to_be_disabled()
    page.get_by_test_id("camera-source").fill("picture://gone.png")
    page.get_by_test_id("do-try-camera").click()
    expect(page.get_by_test_id("camera-refusal")).to_contain_text("gone.png", timeout=LONG_MS)
    page.get_by_test_id("camera-source").fill(SMALL)
    page.get_by_test_id("do-try-camera").click()
    expect(page.get_by_test_id("tried")).to_be_visible(timeout=LONG_MS)
    page.get_by_test_id("camera-id").fill("second")
    page.get_by_test_id("camera-name").fill("Second camera")
    page.get_by_test_id("camera-field").select_option("table")
    manual_picture(page, "cameras")
    page.get_by_test_id("next").click()
    is_live(page, "second")
    page.get_by_test_id("tab-camera-form").click()
    page.get_by_test_id("camera-name").fill("Camera two")
    page.get_by_test_id("do-try-camera").click()
    page.get_by_test_id("do-keep-camera").click(timeout=LONG_MS)
    expect(page.locator("h1")).to_have_text("Camera two")
    assert server.api("GET", "/cameras/second").json()["name"] == "Camera two"
    page.get_by_test_id("tab-camera-form").click()
    page.get_by_test_id("remove-camera").click()
    back = page.get_by_role("button", name=t("common.put-back"))
    expect(back).to_be_visible()
    # at the list of cameras, of which it is none
    expect(page.get_by_test_id("camera-overhead")).to_be_visible()
    expect(page.get_by_test_id("camera-second")).to_have_count(0)
    back.click()
    expect(page.get_by_test_id("camera-second")).to_be_visible()
    assert server.api("DELETE", "/cameras/second").status_code == 204


HOLD = """
const listen = Worker.prototype.addEventListener;
Worker.prototype.addEventListener = function (kind, take) {
  listen.call(this, kind, (event) => {
    if (self.isReleased || !event.data.head) take(event);
  });
};
"""  # what a worker says of the frames that it has drawn is not heard until then


def test_a_stream_is_called_live_only_once_this_browser_has_drawn_it(arriving, server):
    page = arriving.page

    def asked() -> list[str]:
        """The cameras that are live for the server, as the page is told it next."""
        answer = page.wait_for_event(
            "response", lambda answer: answer.url.endswith("/cameras/status"), timeout=LONG_MS
        )
        return [one["id"] for one in answer.json()["items"] if one["state"] == "live"]

    page.add_init_script(HOLD)
    page.goto(f"{server.url}/#/cameras")
    until(asked, lambda live: "overhead" in live)
    asked()  # which it does once it has shown what it was told
    assert page.get_by_test_id("live-overhead").get_attribute("data-state") == "connecting"
    page.evaluate("self.isReleased = true")
    is_live(page, "overhead")


@pytest.mark.long
def test_a_camera_that_may_be_another_is_confirmed_by_one_click(operator, server, added, tmp_path):
    page, id = operator.page, added("swap")
    snapshot = server.api("POST", "/snapshots", json={"camera": id}).json()
    marks = {
        (-1370, 762.5): [40, 50],
        (1370, 762.5): [280, 50],
        (1370, -762.5): [280, 200],
        (-1370, -762.5): [40, 200],
    }
    seen = [
        {"feature": list(place), "kind": "landmark", "points": [spot]}
        for place, spot in marks.items()
    ]
    made = server.api(
        "POST",
        "/calibrations",
        json={
            "camera": id,
            "snapshot": snapshot["id"],
            "field": "table",
            "region": "full",
            "model": "homography",
            "observations": seen,
        },
    )
    assert made.status_code == 201, made.text
    activate_despite(server, made.json()["id"])
    etag = server.api("GET", f"/cameras/{id}").headers["ETag"]
    other = {"source": SMALL.replace("table", "vsss-3v3")}
    assert server.api("PATCH", f"/cameras/{id}", json=other, headers={"If-Match": etag}).ok
    page.goto(f"{server.url}/#/cameras/{id}/live")
    page.reload()
    expect(page.get_by_test_id("camera-problem")).to_contain_text("another camera", timeout=LONG_MS)
    expect(page.get_by_test_id("look-corrected")).to_be_disabled()
    page.screenshot(path=tmp_path / "mismatch.png")
    page.get_by_test_id("confirm").click()
    expect(page.get_by_test_id("look-corrected")).to_be_enabled(timeout=LONG_MS)


@pytest.mark.long
def test_eight_live_cameras_leave_the_page_room_to_ask(operator, server, added):
    page = operator.page
    for number in range(7):
        added(f"eight-{number}", SMALL + f"&seed={number}")
    operator.visit()
    page.reload()
    for number in range(7):
        page.get_by_test_id(f"live-eight-{number}").scroll_into_view_if_needed()
        expect(page.get_by_test_id(f"live-eight-{number}")).to_have_attribute(
            "data-state", "live", timeout=LONG_MS
        )
    page.set_viewport_size({"width": 1280, "height": 3000})  # all in view
    until(
        lambda: [status(server, f"eight-{number}")["viewers"] for number in range(7)],
        lambda n: n == [1] * 7,
    )
    # It answers at all: six streams of another kind would block it for ever. How soon is told by the benchmark.
    assert (
        page.evaluate(
            """async (ms) => { const answers = [];
        for (let i = 0; i < 10; i++)
            answers.push((await fetch("/api/v1/models", { signal: AbortSignal.timeout(ms) })).ok);
        return answers; }""",
            LONG_MS,
        )
        == [True] * 10
    )


@pytest.mark.long
def test_streams_go_on_by_themselves_when_the_server_is_back(page, own_server):
    page.goto(own_server.url)
    is_live(page, "overhead")
    own_server.stop()
    expect(page.get_by_test_id("live-overhead")).to_have_attribute(
        "data-state", "offline", timeout=LONG_MS
    )
    own_server.start()
    is_live(page, "overhead")


@pytest.mark.long
def test_a_picture_is_taken_without_what_moves(operator, server, added):
    page, id = operator.page, added("still", SMALL + "&seed=9")
    page.goto(f"{server.url}/#/cameras/{id}/live")
    page.reload()
    is_live(page, id)
    page.get_by_test_id("do-take-still").click()
    expect(page.get_by_test_id("watching")).to_be_visible()
    page.get_by_test_id("do-stop-watching").click()
    expect(page.get_by_test_id("watching")).to_have_count(0)
    page.get_by_test_id("do-take-still").click()
    operator.is_at("points")
    assert server.api("GET", f"/snapshots/{operator.snapshot}").json()["camera"] == id
