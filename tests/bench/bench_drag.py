"""From a drag to what it changes on the screen, in a real Chromium with 130 points clicked.

Command: python tests/bench/bench_drag.py [--way side|wipe] [--width PX] [MODEL …]     (half a minute for each model)

Each move of the mouse counts, also those that no request was sent for: from its event to the frame in which a curve was
drawn anew after it, and to the one in which the verdict was drawn from a question that was asked at this move or later.
Frames are those of the drag itself; a long task holds the page for more than 50 ms. With a way to compare, the browser
corrects the picture too, by whatever draws here: from a move to the frame in which it was drawn with a mesh that knows
of it.
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from playwright.sync_api import sync_playwright

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests.e2e.conftest import Operator, Server
from tests.support.chromium import ARGUMENTS, chromium_path
from tests.support.demo_cameras import CAMERAS
from tests.support.sim_clicks import border_clicks
from touchline.core.field_json import field_from_json
from touchline.sources import SourceContext, source_from_url

MOVES = 150
PACE_S = 1 / 60
PER_BORDER = 34  # and without the corners 128, with the model's own 32 a border
WATCH = """
window.watched = { moves: [], curve: [], preview: [], corrected: [], frames: [], long: [] };
const frame = (at) => { watched.frames.push(at); requestAnimationFrame(frame); };
requestAnimationFrame(frame);
new PerformanceObserver((list) => watched.long.push(...list.getEntries().map((entry) => entry.duration)))
  .observe({ type: "longtask" });
addEventListener("pointermove", (e) => watched.moves.push(e.timeStamp), { capture: true });
const drawn = (kind, at) => setTimeout(() => watched[kind].push([at, performance.now()]));
const painted = (kind, at) => requestAnimationFrame(() => drawn(kind, at));
// The page handles a move before it draws: a curve that is drawn anew knows of every move until now.
new MutationObserver((all) => {
  if (all.some((one) => one.target.dataset?.testid === "curve-left")) painted("curve", watched.moves.length - 1);
}).observe(document, { subtree: true, attributes: true, attributeFilter: ["d"] });
const draw = WebGL2RenderingContext.prototype.drawArrays;
WebGL2RenderingContext.prototype.drawArrays = function (...how) {
  draw.apply(this, how);
  painted("corrected", watched.moves.length - 1);
};
const original = window.fetch;
window.fetch = async (...asked) => {
  if (!String(asked[0]).includes("/fit/attempt")) return original(...asked);
  const at = watched.moves.length - 1, response = await original(...asked), json = response.json.bind(response);
  response.json = async () => {
    const answer = await json();
    painted("preview", at);
    return answer;
  };
  return response;
};
"""


def late(watched: dict, kind: str) -> np.ndarray:
    """ms from each move to the first frame that knows of it."""
    draws = watched[kind]
    found = []
    for i, moved in enumerate(watched["moves"]):
        known = [drawn for at, drawn in draws if at >= i]
        if known:
            found.append(min(known) - moved)
    return np.array(found)


def told(ms: np.ndarray, draws: int) -> str:
    return (
        (
            f"p50 {np.percentile(ms, 50):.0f}, p95 {np.percentile(ms, 95):.0f}, worst {ms.max():.0f} ms "
            f"({len(ms)} moves, {draws} times drawn)"
        )
        if len(ms)
        else "never drawn"
    )


def dragged(operator: Operator, server: Server, model: str, way: str | None) -> dict:
    """Drag the middle point of the left border about for a while."""
    settings = CAMERAS[0]
    field = field_from_json(server.api("GET", f"/fields/{settings['field']}").json())
    camera = source_from_url(settings["source"], SourceContext(fields={field.name: field})).camera
    region = field.region(settings["region"])
    clicks = border_clicks(camera, region, PER_BORDER, 0.3)
    snapshot = server.api("POST", "/snapshots", json={"camera": settings["id"]}).json()["id"]
    seen = [{"feature": n, "kind": "line", "points": p[1:-1].tolist()} for n, p in clicks.items()]
    operator.go_on(
        snapshot,
        {
            "field": field.name,
            "region": region.name,
            "model": model,
            "options": {},
            "observations": seen,
        },
        "points",
    )
    page = operator.page
    page.get_by_test_id("curve-left").wait_for(state="attached", timeout=60_000)
    page.get_by_test_id("rms-px").wait_for(timeout=60_000)
    page.keyboard.press("v")  # arrows are drawn too
    if way:
        page.keyboard.press("w") if way == "wipe" else page.get_by_test_id("do-side").click()
        page.locator("canvas[data-testid=corrected][data-drawn]").wait_for(timeout=60_000)
        print(
            f"  canvas {page.get_by_test_id('corrected').evaluate('it => [it.width, it.height]')} px"
        )
    page.wait_for_timeout(1500)
    x, y = operator.spot(*clicks["left"][PER_BORDER // 2])
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 8, y)
    page.mouse.move(x, y)
    page.wait_for_timeout(500)
    page.evaluate(
        "() => { for (const list of ['moves', 'curve', 'preview', 'corrected', 'frames', 'long'])"
        " watched[list].length = 0; }"
    )
    for i in range(MOVES):
        begun = time.perf_counter()
        # no stray: those bend no curve
        page.mouse.move(x + 0.6 * np.sin(i / 8), y + 2 * np.cos(i / 8))
        time.sleep(max(0.0, PACE_S - (time.perf_counter() - begun)))
    watched = page.evaluate("watched")
    page.wait_for_timeout(1000)
    watched |= {
        kind: page.evaluate(f"watched.{kind}") for kind in ("curve", "preview", "corrected")
    }
    page.mouse.up()
    return {**watched, "points": sum(len(p) - 2 for p in clicks.values())}


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("models", nargs="*", default=["polynomial", "division", "brown-conrady"])
    parser.add_argument("--way", choices=("side", "wipe"))
    parser.add_argument("--width", type=int, default=1280, help="of the page, px")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        server = Server(Path(folder))
        browser = playwright.chromium.launch(executable_path=chromium_path(), args=ARGUMENTS)
        try:
            for model in asked.models:
                page = browser.new_page(viewport={"width": asked.width, "height": 800})
                page.add_init_script(WATCH)
                operator = Operator(page, server)
                operator.prefer("correction", "browser")
                watched = dragged(operator.visit(), server, model, asked.way)
                print(f"{model}, {watched['points']} points")
                for kind, what in (
                    ("curve", "curve"),
                    ("corrected", "corrected picture"),
                    ("preview", "arrows, distortion and verdict"),
                ):
                    print(f"  {what}: {told(late(watched, kind), len(watched[kind]))}")
                frames = np.diff(watched["frames"])
                print(
                    f"  frames: p50 {np.percentile(frames, 50):.0f}, p95 {np.percentile(frames, 95):.0f}, worst "
                    f"{frames.max():.0f} ms; long tasks: {len(watched['long'])}, the longest "
                    f"{max(watched['long'], default=0):.0f} ms"
                )
                page.close()
        finally:
            browser.close()
            server.stop()


if __name__ == "__main__":
    main()
