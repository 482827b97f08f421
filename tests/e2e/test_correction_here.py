"""The browser corrects pictures itself: as OpenCV does, in the frame of a drag, and by the server where it cannot."""

import base64
import re

import cv2
import numpy as np
import pytest
from playwright.sync_api import Route, expect

from tests.e2e.conftest import LONG_MS, Operator
from tests.support.activation import activate_despite
from tests.support.chromium import ARGUMENTS
from tests.support.demo_cameras import CAMERAS
from tests.support.examples import plain_examples
from tests.support.live_cameras import FIELDS
from tests.support.pictures import remapped_exactly
from tests.support.waiting import until
from tests.support.words import like, t
from touchline.imaging.correction import CorrectedView, correction_map, correction_mesh
from touchline.models import MODELS
from touchline.sources import SourceContext, source_from_url

DRAWN = """async ({ png, mesh, data, width, height }) => {
  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const { createWarp } = await import("/canvas/warp.js");
  const picture = await createImageBitmap(new Blob([bytes(png)]), { colorSpaceConversion: "none" });
  const canvas = Object.assign(document.createElement("canvas"), { width, height }), warp = createWarp(canvas);
  warp.setPicture(picture, picture.width, picture.height, true);
  warp.setMesh({ ...mesh, nodes: new Float32Array(bytes(data).buffer) });
  warp.draw({ x: 0, y: 0, scale: 1 });
  const drawn = canvas.toDataURL("image/png");
  warp.end();
  return drawn;
}"""
LOSE = """(canvas) => {
  window.taken = canvas.getContext("webgl2").getExtension("WEBGL_lose_context");
  taken.loseContext();
}"""
KEEP_CONTEXT = """const get = OffscreenCanvas.prototype.getContext;
OffscreenCanvas.prototype.getContext = function (kind, ...how) {
  const context = get.call(this, kind, ...how);
  if (kind === "webgl2") self.taken = context;
  return context;
};
"""
EXAMPLES = [(name, i) for name in MODELS for i, _ in enumerate(plain_examples(name))]


def text(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")


@pytest.fixture(scope="module")
def raw_picture() -> np.ndarray:
    source = source_from_url(CAMERAS[0]["source"], SourceContext(FIELDS))
    yield source.read().pixels
    source.close()


@pytest.mark.parametrize(
    ("margin_px", "examples"),
    [
        (300, EXAMPLES[::3]),
        *(pytest.param(margin_px, EXAMPLES, marks=pytest.mark.long) for margin_px in (0, 40, 300)),
    ],
)
def test_every_models_picture_is_what_opencv_makes_of_it(
    arriving, raw_picture, margin_px, examples
):
    page = arriving.visit(modules=True).page
    for name, i in examples:
        model = plain_examples(name)[i]
        # sharp edges
        raw = cv2.resize(raw_picture, tuple(model.image_size), interpolation=cv2.INTER_LANCZOS4)
        mesh, table = (
            correction_mesh(model, margin_px),
            correction_map(model, CorrectedView(margin_px)),
        )
        height, width = table.raw_x.shape
        address = page.evaluate(
            DRAWN,
            {
                "png": text(cv2.imencode(".png", raw)[1].tobytes()),
                "mesh": mesh.header(),
                "data": text(mesh.data()),
                "width": width,
                "height": height,
            },
        )
        got = cv2.imdecode(
            np.frombuffer(base64.b64decode(address.partition(",")[2]), np.uint8), cv2.IMREAD_COLOR
        )
        off = np.abs(got.astype(int) - remapped_exactly(table, raw))
        assert got.std() > 5 and np.percentile(off, 99.9) <= 2, (
            name,
            i,
            np.percentile(off, 99.9),
            off.max(),
        )


@pytest.fixture
def correcting(operator, border_draft):
    """A function that puts the operator before clicked borders, in a browser that corrects whatever it draws with."""

    def correcting(model: str, step: str = "points") -> Operator:
        operator.prefer("correction", "browser")
        operator.page.goto("about:blank")
        snapshot, draft = border_draft(model)
        if step == "verify":
            saved = operator.server.api(
                "POST", "/calibrations", json={**draft, "snapshot": snapshot}
            )
            assert saved.ok, saved.text
        return operator.go_on(snapshot, draft, step)

    return correcting


def beside(operator: Operator) -> Operator:
    """With the corrected picture beside the raw one."""
    expect(operator.page.get_by_test_id("do-side")).to_be_enabled(timeout=LONG_MS)
    operator.page.get_by_test_id("do-side").click()
    expect(operator.page.get_by_test_id("side-names")).to_be_visible(timeout=LONG_MS)
    return operator


def drawn(page) -> np.ndarray:
    """The corrected picture as it is on the screen."""
    expect(page.get_by_test_id("corrected")).to_be_visible(timeout=LONG_MS)
    expect(page.locator("canvas[data-testid=corrected][data-drawn]")).to_have_count(1)
    seen = cv2.imdecode(
        np.frombuffer(page.get_by_test_id("corrected").screenshot(), np.uint8), cv2.IMREAD_COLOR
    )
    return seen.astype(int)


def test_beside_the_raw_picture_the_corrected_one_takes_no_click_comes_back_and_follows_a_drag(
    correcting,
):
    operator = beside(correcting("polynomial"))
    nothing_is_clicked_over_it(operator)
    undone(operator)
    its_graphics_come_back_and_no_click_is_lost(operator)
    undone(operator)
    it_follows_a_dragged_point_while_the_server_is_silent(operator)


def undone(operator: Operator) -> None:
    """The last change, and the fit of what there was before it."""
    operator.page.get_by_test_id("stage").focus()
    operator.page.keyboard.press("Control+z")
    operator.draft()
    expect(operator.page.get_by_test_id("verdict")).not_to_have_class(
        re.compile("stale"), timeout=LONG_MS
    )


def nothing_is_clicked_over_it(operator: Operator) -> None:
    page = operator.page
    before, stage = operator.draft(), page.get_by_test_id("stage").bounding_box()
    page.mouse.click(stage["x"] + 0.75 * stage["width"], stage["y"] + 0.5 * stage["height"])
    expect(page.get_by_test_id("read-out")).to_contain_text(t("canvas.stage.no-position"))
    page.mouse.click(stage["x"] + 0.3 * stage["width"], stage["y"] + 0.45 * stage["height"])
    after = until(operator.draft, lambda now: now["observations"] != before["observations"])
    counts = [sum(len(o["points"]) for o in d["observations"]) for d in (before, after)]
    assert counts[1] == counts[0] + 1  # the second press, on the raw one


def its_graphics_come_back_and_no_click_is_lost(operator: Operator) -> None:
    """Though they are taken away in a drag."""
    page = operator.page
    at_rest = until(lambda: drawn(page), lambda picture: picture.std() > 10)
    clicked = operator.points("left")
    x, y = clicked[3]
    page.mouse.move(*operator.spot(x, y))
    page.mouse.down()
    page.mouse.move(*operator.spot(x + 20, y), steps=3)
    page.get_by_test_id("corrected").evaluate(LOSE)
    expect(page.get_by_test_id("side-names")).to_have_count(0)  # the raw picture alone, meanwhile
    page.mouse.move(*operator.spot(x + 10, y), steps=3)
    page.mouse.up()
    page.evaluate("() => taken.restoreContext()")
    expect(page.get_by_test_id("side-names")).to_be_visible()
    until(lambda: np.percentile(np.abs(drawn(page) - at_rest), 90), lambda levels: levels < 30)
    assert len(operator.points("left")) == len(clicked) and operator.points("left")[3][0] > x + 5


def it_follows_a_dragged_point_while_the_server_is_silent(operator: Operator) -> None:
    page = operator.page
    x, y = operator.points("left")[3]
    page.mouse.move(*operator.spot(x, y))
    at_rest = until(lambda: drawn(page), lambda picture: picture.std() > 10)
    page.route("**/api/v1/fit/*", lambda route: None)  # asked, and never answered
    page.mouse.down()
    page.mouse.move(*operator.spot(x + 20, y), steps=3)
    until(lambda: np.percentile(np.abs(drawn(page) - at_rest), 99.5), lambda levels: levels > 10)
    page.mouse.move(*operator.spot(x, y), steps=3)
    until(lambda: np.percentile(np.abs(drawn(page) - at_rest), 99.5), lambda levels: levels < 4)
    page.keyboard.press("Escape")
    page.mouse.up()
    page.unroute_all(behavior="ignoreErrors")


def test_another_picture_is_drawn_from_its_own_pixels_once_they_are_there(
    correcting, straight_picture, frame_points
):
    operator = correcting("polynomial", "verify")
    page, server = operator.page, operator.server
    first = drawn(page)
    with straight_picture.open("rb") as file:
        green = server.api("POST", "/snapshots", files={"file": file}).json()["id"]
    given = {
        "field": "table",
        "region": "full",
        "model": "polynomial",
        "observations": [
            {"feature": name, "kind": "line", "points": points}
            for name, points in frame_points.items()
        ],
    }
    made = server.api("POST", "/calibrations", json={**given, "snapshot": green})
    assert made.ok, made.text
    tag = server.api("GET", f"/drafts/{green}").headers["ETag"]
    server.api("PUT", f"/drafts/{green}", json={**given, "options": {}}, headers={"If-Match": tag})
    held: list[Route] = []
    page.route(f"**/snapshots/{green}/image.png", lambda route: held.append(route))
    with page.expect_response("**/mesh?*"):
        page.evaluate(f"location.hash = '#/calibrate/{green}/verify'")
    page.get_by_test_id("do-corrected").click()
    expect(page.get_by_test_id("corrected")).to_have_count(1)  # all is there but the picture
    assert len(held) == 1
    held[0].continue_()
    until(
        lambda: np.median(drawn(page), axis=(0, 1)),
        lambda colour: np.abs(colour - (40, 90, 30)).max() < 8,
    )
    assert np.abs(np.median(first, axis=(0, 1)) - (40, 90, 30)).max() > 8


def test_every_way_to_compare_is_drawn_without_a_request_and_as_the_server_would(
    operator, correcting
):
    page = operator.page
    with page.expect_response("**/fit/attempt?*"):  # of the draft, however late
        correcting("brown-conrady", "verify")
    asked: list[str] = []
    expect(page.get_by_test_id("wipe")).to_be_visible(timeout=LONG_MS)
    page.keyboard.press("c")
    ours = drawn(page)
    activate = "|".join(
        like(key).pattern for key in ("common.activate-version", "verify.activate-version-anyway")
    )
    # checked
    expect(page.get_by_test_id("next")).to_have_text(re.compile(f"^({activate})"), timeout=LONG_MS)
    page.on("request", lambda request: asked.append(request.url))
    for key in "rwsck":
        page.keyboard.press(key)
        expect(
            page.get_by_test_id(
                {
                    "r": "do-raw",
                    "w": "do-wipe",
                    "s": "do-side",
                    "c": "do-corrected",
                    "k": "do-blink",
                }[key]
            )
        ).to_have_attribute("aria-pressed", "true")
    half = page.get_by_test_id("corrected-half")
    expect(half).to_be_hidden()  # it blinks
    expect(half).to_be_visible()
    page.keyboard.press("w")
    page.get_by_test_id("wipe").press("ArrowRight")
    page.get_by_test_id("do-zoom-in").click()
    page.get_by_test_id("do-zoom-fit").click()
    assert [
        url
        for url in asked
        if not re.search(r"/status|/health|/jobs|/presence|/events|/publishing", url)
    ] == []

    here = page.url
    page.goto("about:blank")
    operator.prefer("correction", "server")
    page.goto(here)
    expect(page.get_by_test_id("wipe")).to_be_visible(timeout=LONG_MS)
    page.keyboard.press("c")
    picture = page.locator("img[data-testid=corrected]")
    expect(picture).to_be_visible()
    picture.evaluate("picture => picture.decode()")
    box, stage = picture.bounding_box(), page.get_by_test_id("stage").bounding_box()
    shot = page.screenshot(clip=stage)
    theirs = cv2.imdecode(np.frombuffer(shot, np.uint8), cv2.IMREAD_COLOR).astype(int)
    inner = (
        slice(int(box["y"] - stage["y"]) + 8, int(box["y"] - stage["y"] + box["height"]) - 8),
        slice(int(box["x"] - stage["x"]) + 8, int(box["x"] - stage["x"] + box["width"]) - 8),
    )
    assert np.abs(ours[inner] - theirs[inner]).mean() < 3


def test_a_browser_without_webgl_leaves_all_to_the_server(
    browser_type, browser_type_launch_args, own_server, border_draft
):
    args = {**browser_type_launch_args, "args": [*ARGUMENTS, "--disable-3d-apis"]}
    browser = browser_type.launch(**args)
    try:
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        errors: list[str] = []
        page.on("pageerror", lambda error: errors.append(str(error)))
        assert page.evaluate("document.createElement('canvas').getContext('webgl2')") is None
        operator = Operator(page, own_server).visit().take().use_model("polynomial")
        operator.click_all(border_draft("polynomial")[1]["observations"])
        expect(page.get_by_test_id("rms-px")).to_be_visible(timeout=LONG_MS)
        expect(page.get_by_test_id("do-side")).to_have_count(0)
        operator.next("verify")
        picture = page.locator("img[data-testid=corrected]")
        expect(picture).to_be_visible(timeout=LONG_MS)
        expect(picture).not_to_have_js_property("naturalWidth", 0)
        operator.activate(warned=True)
        page.goto(f"{own_server.url}/#/system/server")
        expect(page.get_by_test_id("correction-now")).to_contain_text(
            t("canvas.graphics.server.no-webgl")
        )
        assert not errors
    finally:
        browser.close()


@pytest.mark.parametrize(
    ("name", "why"),
    [("Fast GPU 9000", "canvas.graphics.server.slow"), (None, "canvas.graphics.server.software")],
)
def test_graphics_that_do_not_keep_up_leave_it_to_the_server_and_system_says_why(saved, name, why):
    """What renders here is software; under another name, and slow for certain, it has to be measured."""
    operator = saved("polynomial")
    page, here = operator.page, operator.page.url
    if name:
        page.add_init_script(f"""const known = WebGL2RenderingContext.prototype.getParameter;
            WebGL2RenderingContext.prototype.getParameter = function (which) {{
              return which === 0x9246 ? "{name}" : known.call(this, which);
            }};
            const draw = WebGL2RenderingContext.prototype.drawArrays;
            WebGL2RenderingContext.prototype.drawArrays = function (...how) {{
              for (const begun = performance.now(); performance.now() < begun + 30;);
              draw.apply(this, how);
            }};""")
    page.goto("about:blank")
    page.goto(here)
    picture = page.locator("img[data-testid=corrected]")
    expect(picture).to_be_visible(timeout=LONG_MS)
    expect(picture).not_to_have_js_property("naturalWidth", 0)
    page.evaluate("location.hash = '#/system/server'")
    expect(page.get_by_test_id("correction-now")).to_contain_text(like(why))
    page.get_by_test_id("correction").select_option("browser")
    expect(page.get_by_test_id("correction-now")).to_contain_text(like("canvas.graphics.browser"))
    page.goto(here)
    expect(page.locator("canvas[data-testid=corrected][data-drawn]")).to_be_visible(timeout=LONG_MS)


@pytest.fixture
def active(page, own_server, border_draft) -> str:
    """The version that is active at a live camera, before a browser that corrects whatever it draws with."""
    made = own_server.api(
        "POST",
        "/calibrations",
        json={**border_draft("brown-conrady")[1], "camera": "overhead", "image_size": [640, 512]},
    ).json()["id"]
    activate_despite(own_server, made)
    Operator(page, own_server).prefer("correction", "browser")
    return made


def test_a_live_picture_is_corrected_from_the_raw_stream_alone_and_by_the_server_without_graphics(
    page, own_server, active
):
    its_graphics_come_back_and_the_server_helps_out(page, own_server)
    page.unroute_all(behavior="ignoreErrors")
    is_corrected_from_the_raw_stream_alone(page, own_server, active)


def its_graphics_come_back_and_the_server_helps_out(page, own_server):
    page.route(
        "**/stream_worker.js",
        lambda route: route.fulfill(
            response=(told := route.fetch()), body=KEEP_CONTEXT + told.text()
        ),
    )
    page.goto(f"{own_server.url}/#/cameras/overhead/live")
    page.get_by_test_id("look-side").click()
    stage = page.get_by_test_id("live-overhead")
    expect(stage).to_have_attribute("data-compared", "side", timeout=LONG_MS)
    worker = page.workers[-1]
    until(lambda: worker.evaluate("Boolean(self.taken)"), bool)
    with page.expect_websocket(lambda socket: "view=side" in socket.url, timeout=LONG_MS):
        worker.evaluate("self.taken.getExtension('WEBGL_lose_context').loseContext()")
    with page.expect_websocket(lambda socket: "view=raw" in socket.url, timeout=LONG_MS):
        pass  # after some seconds this browser tries again
    expect(stage).to_have_attribute("data-compared", "side")


def is_corrected_from_the_raw_stream_alone(page, own_server, active):
    """One stream for all ways to look at it; with the server's own way, another one."""
    streams: list[str] = []
    page.on("websocket", lambda socket: streams.extend(re.findall(r"view=([\w-]+)", socket.url)))
    page.reload()
    expect(page.get_by_test_id("look-wipe")).to_be_enabled(timeout=LONG_MS)
    for mode in ("side", "wipe", "corrected"):
        page.get_by_test_id(f"look-{mode}").click()
        expect(page.get_by_test_id("live-overhead")).to_have_attribute(
            "data-compared", mode, timeout=LONG_MS
        )
    sheet = page.get_by_test_id("live-corrected")
    until(
        lambda: sheet.locator("canvas").evaluate("c => [c.width, c.height]"),
        lambda size: size[0] == 640,
    )
    assert set(streams) == {"raw"}

    still = own_server.api("POST", "/snapshots", json={"camera": "overhead"}).json()["id"]
    theirs = own_server.api(
        "GET", f"/calibrations/{active}/corrected.png?margin_px=40&snapshot={still}"
    ).content

    def apart() -> float:
        """Of the picture on the screen from the server's; robots have driven a little meanwhile."""
        shown = cv2.imdecode(np.frombuffer(sheet.screenshot(), np.uint8), cv2.IMREAD_COLOR)
        want = cv2.resize(
            cv2.imdecode(np.frombuffer(theirs, np.uint8), cv2.IMREAD_COLOR),
            shown.shape[1::-1],
            interpolation=cv2.INTER_AREA,
        )
        # the badge and the wipe's names stand elsewhere
        inner = (slice(20, shown.shape[0] // 2), slice(20, -20))
        return float(np.median(np.abs(want.astype(int) - shown)[inner]))

    until(apart, lambda levels: levels < 6)

    page.evaluate("location.hash = '#/system/server'")
    page.get_by_test_id("correction").select_option("server")
    page.go_back()
    with page.expect_websocket(lambda socket: "view=side" in socket.url, timeout=LONG_MS):
        page.get_by_test_id("look-side").click()
    expect(page.get_by_test_id("live-overhead")).to_have_attribute(
        "data-compared", "side", timeout=LONG_MS
    )
