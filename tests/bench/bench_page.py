"""The page in a real Chromium. Command: python -m pytest tests/bench/bench_page.py -s

How soon something useful is on the screen, what a page costs that nobody looks at, what the demo's server needs for its
start page and another for eight cameras, how soon a knock is told elsewhere, and whether memory stays flat over a long
live view, shortened by a fast camera. Each prints its figures; the promises are asserted.
"""

import os
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path
from statistics import median

import pytest
import requests
from playwright.sync_api import sync_playwright

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests" / "e2e"))
from tests.support.activation import activate_despite  # noqa: E402
from tests.support.child_processes import family  # noqa: E402
from tests.support.chromium import ARGUMENTS, chromium_path  # noqa: E402
from tests.support.live_cameras import calibrated  # noqa: E402
from tests.support.waiting import until  # noqa: E402

ROUNDS = 7
IDLE_S = 20.0
# a simulated camera that was opened or looked at gives all its pictures for ten seconds
AWAKE_S = 15.0
LONG_S, SAMPLES = 180.0, 9
NETWORK_MS = 20  # there and back: a tournament's wireless network
EIGHT, KNOCKS, TOLD_S = 8, 5, 5.0
CAMERAS = """server: {port: 0}
cameras:
- {id: north, source: 'sim://table?size=1280x1024&fps=30', field: table}
- {id: quick, source: 'sim://table?size=160x128&fps=240&robots=0', field: table}
"""
# When the first camera can be chosen: what an operator came for.
USEFUL = """new MutationObserver((_, watch) => { if (document.querySelector("[data-testid=camera-north]")) {
  window.useful = performance.now(); watch.disconnect(); } }).observe(document, { childList: true, subtree: true });"""
FRAMES = """() => { let last = performance.now(); window.gaps = []; window.tasks = [];
  const look = (now) => { gaps.push(now - last); last = now; requestAnimationFrame(look); };
  requestAnimationFrame(look);
  new PerformanceObserver((list) => tasks.push(...list.getEntries().map((e) => e.duration)))
    .observe({ type: "longtask" }); }"""
HIDE = """() => { Object.defineProperty(document, "hidden", { get: () => true, configurable: true });
  document.dispatchEvent(new Event("visibilitychange")); }"""


@contextmanager
def serving(*arguments: str):
    """A server of the shell's: its address and its process."""
    server = subprocess.Popen(
        [sys.executable, "-c", "from touchline.cli import main; main()", *arguments],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        text=True,
    )
    yield server.stdout.readline().split()[-1].rstrip("/"), server.pid
    server.terminate()
    server.wait(20)


@pytest.fixture(scope="module")
def url(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    (folder / "settings.yaml").write_text(CAMERAS)
    with serving(
        "serve", "--config", str(folder / "settings.yaml"), "--data", str(folder / "data")
    ) as (address, _):
        yield address


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
    return page.request.get(
        page.url.split("#")[0].rstrip("/") + f"/api/v1/cameras/{name}/status"
    ).json()


@pytest.mark.parametrize(
    ("path", "latency_ms"),
    [("", 0), ("", NETWORK_MS), ("/index.html", NETWORK_MS)],
    ids=["here", "over a network", "over a network, as modules"],
)
def test_something_useful_is_on_the_screen_within_a_second(browser, url, path, latency_ms):
    useful, painted = [], []
    for _ in range(ROUNDS):  # each in a browser profile of its own: nothing is cached
        context = browser.new_context(viewport={"width": 1280, "height": 800})
        context.add_init_script(USEFUL)
        page = context.new_page()
        page.context.new_cdp_session(page).send(
            "Network.emulateNetworkConditions",
            {
                "offline": False,
                "latency": latency_ms,
                "downloadThroughput": -1,
                "uploadThroughput": -1,
            },
        )
        page.goto(f"{url}{path}")
        page.get_by_test_id("camera-north").wait_for()
        useful.append(page.evaluate("window.useful"))
        painted.append(
            page.evaluate(
                "performance.getEntriesByName('first-contentful-paint')[0]?.startTime ?? null"
            )
        )
        context.close()
    print(
        f"\nfirst paint {median(painted):.0f} ms, useful {median(useful):.0f} ms, slowest {max(useful):.0f} ms"
    )
    assert path or median(useful) <= 1000 + 10 * latency_ms


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
    print(
        f"\nbrowser, one live view of 1280 × 1024 at 30 Hz: seen {seen:.1%}, hidden {hidden:.1%} of a core"
    )
    assert hidden <= 0.03


def test_the_demo_with_its_start_page_costs_little(browser, tmp_path):
    with serving("demo", "--port", "0", "--data", str(tmp_path)) as (address, pid):
        page = browser.new_page(viewport={"width": 1440, "height": 900})
        page.goto(address)
        for name in ("overhead", "east", "table"):
            page.locator(f"[data-testid=live-{name}][data-state=live]").wait_for(timeout=60_000)
        time.sleep(AWAKE_S)
        watched = [status(page, name)["fps"] for name in ("overhead", "east", "table")]
        seen, resident, shared = cost(pid)
        page.goto("about:blank")
        time.sleep(3)
        unseen, *_ = cost(pid)
    print(
        f"\nthe demo's server, its start page in sight at {watched} Hz: {seen:.2f} cores, {shared:.0f} MB "
        f"(PSS; RSS {resident:.0f}); nobody there: {unseen:.2f} cores"
    )
    assert seen < 0.6 and shared < 500 and min(watched) > 3


def test_eight_cameras_on_the_wall(browser, tmp_path):
    (tmp_path / "settings.yaml").write_text(
        "server: {port: 0}\ncameras:\n"
        + "".join(
            f"- {{id: c{i}, source: 'sim://table?size=1280x1024&fps=30', field: table}}\n"
            for i in range(EIGHT)
        )
    )
    with serving(
        "serve", "--config", str(tmp_path / "settings.yaml"), "--data", str(tmp_path / "data")
    ) as it:
        address, pid = it
        page, session = (
            browser.new_page(viewport={"width": 1440, "height": 900}),
            browser.new_browser_cdp_session(),
        )
        page.goto(address)
        for i in range(EIGHT):
            page.locator(f"[data-testid=live-c{i}][data-state=live]").wait_for(timeout=60_000)
        time.sleep(AWAKE_S)
        page.evaluate(FRAMES)
        seen = cpu_s(session)
        cores, _, shared = cost(pid)
        seen = (cpu_s(session) - seen) / IDLE_S
        gaps, tasks = page.evaluate("[gaps.slice(1), tasks]")
        fps = sorted(status(page, f"c{i}")["fps"] for i in range(EIGHT))
        page.goto("about:blank")
        time.sleep(AWAKE_S)
        unseen, *_ = cost(pid)
    gaps.sort()
    print(
        f"\n{EIGHT} cameras at {fps[0]:.1f}–{fps[-1]:.1f} Hz: frames of the page {median(gaps):.1f} ms, p95 "
        f"{gaps[int(len(gaps) * 0.95)]:.1f}, worst {gaps[-1]:.0f}; long tasks {len(tasks)}, {sum(tasks):.0f} ms; "
        f"browser {seen:.2f} cores, server {cores:.2f}, {shared:.0f} MB (PSS); nobody there: {unseen:.2f} cores"
    )
    assert fps[0] > 1 and unseen < 0.3


def test_a_knock_is_told_on_another_page_within_five_seconds(browser, tmp_path):
    source, told = "sim://table?size=480x384&fps=10&robots=3", []
    (tmp_path / "settings.yaml").write_text(f"""server: {{port: 0}}
cameras:
- {{id: north, source: '{source}', field: table, region: full}}
""")
    with serving(
        "serve", "--config", str(tmp_path / "settings.yaml"), "--data", str(tmp_path / "data")
    ) as it:
        address, _ = it
        page, api = browser.new_page(), f"{it[0]}/api/v1"
        taken = until(
            lambda: requests.post(f"{api}/snapshots", json={"camera": "north"}),
            lambda said: said.ok,
        ).json()
        made = requests.post(
            f"{api}/calibrations",
            json={
                "camera": "north",
                "snapshot": taken["id"],
                "field": "table",
                "region": "full",
                "model": "brown-conrady",
                "observations": [dict(o) for o in calibrated(source, "brown-conrady").observations],
            },
        ).json()
        activate_despite(address, made["id"])
        page.goto(f"{address}/#/system/jobs")
        for _ in range(KNOCKS):
            until(
                lambda: requests.get(f"{api}/cameras/status").json()["items"][0]["drift"]["state"],
                "steady".__eq__,
            )
            page.locator("[data-testid=status][data-level=ok]").wait_for(timeout=60_000)
            knock(api, 4)
            begun = time.monotonic()
            page.locator("[data-testid=status][data-level=bad]").wait_for(timeout=60_000)
            told.append(time.monotonic() - begun)
            knock(api, 0)
    print(f"\na knock is told after {', '.join(f'{t:.1f}' for t in told)} s")
    assert max(told) <= TOLD_S


def knock(api: str, mm: int) -> None:
    requests.patch(
        f"{api}/cameras/north/controls", json={"controls": {"knock": mm}}
    ).raise_for_status()


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
        resident.append(
            max(
                memory_mb(p["id"])
                for p in session.send("SystemInfo.getProcessInfo")["processInfo"]
                if p["type"] == "renderer"
            )
        )
        first = first or int(page.get_by_test_id("live-quick").get_attribute("data-seq"))
    frames = int(page.get_by_test_id("live-quick").get_attribute("data-seq")) - first
    print(
        f"\n{frames} frames ({frames / 36_000:.2f} h at 10 Hz): heap {heaps[1]:.1f} → {heaps[-1]:.1f} MB,"
        f" largest renderer {resident[1]:.0f} → {resident[-1]:.0f} MB"
    )
    assert heaps[-1] - heaps[1] < 2
    assert resident[-1] - resident[1] < 25


def cost(pid: int) -> tuple[float, float, float]:
    """Cores that a process and all below it need over IDLE_S; their RSS and PSS, MB."""

    def spent_s() -> float:
        fields = [
            Path(f"/proc/{one}/stat").read_text().rpartition(")")[2].split() for one in family(pid)
        ]
        return sum(int(one[11]) + int(one[12]) for one in fields) / os.sysconf("SC_CLK_TCK")

    before, begun = spent_s(), time.monotonic()
    time.sleep(IDLE_S)
    cores = (spent_s() - before) / (time.monotonic() - begun)
    told = [
        line.split()
        for one in family(pid)
        for line in Path(f"/proc/{one}/smaps_rollup").read_text().splitlines()
    ]
    return cores, *(
        sum(int(line[1]) for line in told if line[0] == name) / 1000 for name in ("Rss:", "Pss:")
    )


def memory_mb(pid: int) -> float:
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * 4096 / 1e6
