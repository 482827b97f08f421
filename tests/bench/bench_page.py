"""The page in a real Chromium. Command: python -m pytest tests/bench/bench_page.py -s

How soon something useful is on the screen, what a page costs that nobody looks at, and whether memory stays flat over
a long live view, shortened by a fast camera. Each prints its figures; the promises are asserted.
"""

import subprocess
import sys
import time
from pathlib import Path
from statistics import median

import pytest
from playwright.sync_api import sync_playwright

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests" / "e2e"))
from tests.support.chromium import ARGUMENTS, chromium_path  # noqa: E402

ROUNDS = 7
IDLE_S = 20.0
LONG_S, SAMPLES = 180.0, 9
CAMERAS = """server: {port: 0}
cameras:
- {id: north, source: 'sim://table?size=1280x1024&fps=30', field: table}
- {id: quick, source: 'sim://table?size=160x128&fps=240&robots=0', field: table}
"""
# When the first camera can be chosen: what an operator came for.
USEFUL = """new MutationObserver((_, watch) => { if (document.querySelector("[data-testid=camera-north]")) {
  window.useful = performance.now(); watch.disconnect(); } }).observe(document, { childList: true, subtree: true });"""
HIDE = """() => { Object.defineProperty(document, "hidden", { get: () => true, configurable: true });
  document.dispatchEvent(new Event("visibilitychange")); }"""


@pytest.fixture(scope="module")
def url(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    (folder / "settings.yaml").write_text(CAMERAS)
    server = subprocess.Popen([sys.executable, "-c", "from app.cli import main; main()", "serve", "--config",
                               str(folder / "settings.yaml"), "--data", str(folder / "data")], cwd=ROOT,
                              stdout=subprocess.PIPE, text=True)
    yield server.stdout.readline().split()[-1].rstrip("/")
    server.terminate()
    server.wait(20)


@pytest.fixture
def browser():
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=chromium_path(), args=ARGUMENTS)
        yield browser
        browser.close()


def cpu_s(session) -> float:
    """Of all processes of the browser."""
    return sum(one["cpuTime"] for one in session.send("SystemInfo.getProcessInfo")["processInfo"])


def status(page, name: str) -> dict:
    return page.request.get(page.url.split("#")[0].rstrip("/") + f"/api/v1/cameras/{name}/status").json()


def test_something_useful_is_on_the_screen_within_a_second(browser, url):
    useful, painted = [], []
    for _ in range(ROUNDS):  # each in a browser profile of its own: nothing is cached
        context = browser.new_context(viewport={"width": 1280, "height": 800})
        context.add_init_script(USEFUL)
        page = context.new_page()
        page.goto(url)
        page.get_by_test_id("camera-north").wait_for()
        useful.append(page.evaluate("window.useful"))
        painted.append(page.evaluate("performance.getEntriesByName('first-contentful-paint')[0]?.startTime ?? null"))
        context.close()
    print(f"\nfirst paint {median(painted):.0f} ms, useful {median(useful):.0f} ms, slowest {max(useful):.0f} ms")
    assert median(useful) <= 1000


def test_a_page_that_nobody_sees_costs_next_to_nothing(browser, url):
    session = browser.new_browser_cdp_session()
    page = browser.new_page()
    page.goto(f"{url}/#/cameras/north/live")
    page.locator("[data-testid=live-north][data-state=live]").wait_for(timeout=60_000)
    seen = cpu_s(session)
    time.sleep(IDLE_S)
    seen = (cpu_s(session) - seen) / IDLE_S
    page.evaluate(HIDE)
    time.sleep(3)
    assert status(page, "north")["viewers"] == 0
    hidden = cpu_s(session)
    time.sleep(IDLE_S)
    hidden = (cpu_s(session) - hidden) / IDLE_S
    print(f"\nbrowser, one live view of 1280 × 1024 at 30 Hz: seen {seen:.1%}, hidden {hidden:.1%} of a core")
    assert hidden <= 0.03


def test_memory_stays_flat_over_a_long_live_view(browser, url):
    session = browser.new_browser_cdp_session()
    page = browser.new_page()
    page.goto(f"{url}/#/cameras/quick/live")
    page.locator("[data-testid=live-quick][data-state=live]").wait_for(timeout=60_000)
    inside = page.context.new_cdp_session(page)
    inside.send("Performance.enable")
    first, heaps, resident = None, [], []
    for _ in range(SAMPLES):
        time.sleep(LONG_S / SAMPLES)
        inside.send("HeapProfiler.collectGarbage")
        metrics = {m["name"]: m["value"] for m in inside.send("Performance.getMetrics")["metrics"]}
        heaps.append(metrics["JSHeapUsedSize"] / 1e6)
        resident.append(max(memory_mb(p["id"]) for p in session.send("SystemInfo.getProcessInfo")["processInfo"]
                            if p["type"] == "renderer"))
        first = first or int(page.get_by_test_id("live-quick").get_attribute("data-seq"))
    frames = int(page.get_by_test_id("live-quick").get_attribute("data-seq")) - first
    print(f"\n{frames} frames ({frames / 36_000:.2f} h at 10 Hz): heap {heaps[1]:.1f} → {heaps[-1]:.1f} MB,"
          f" largest renderer {resident[1]:.0f} → {resident[-1]:.0f} MB")
    assert heaps[-1] - heaps[1] < 2
    assert resident[-1] - resident[1] < 25


def memory_mb(pid: int) -> float:
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * 4096 / 1e6
