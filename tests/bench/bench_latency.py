"""From the camera to the browser's canvas. Command: python -m pytest tests/bench/bench_latency.py -s

The simulated camera paints the time of each picture into it; the page's own worker draws the picture, and a worker
around it (latency/worker.js) reads that back. The corrected picture is told by its time stamp, which the raw one proves
right. Needs Chromium.
"""

import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import requests
from playwright.sync_api import sync_playwright

from tests.support.activation import activate_despite
from tests.support.chromium import ARGUMENTS, chromium_path
from tests.support.live_cameras import calibrated

ROOT = Path(__file__).parents[2]
SCRIPTS = [
    (Path(__file__).parent / "latency" / name).read_text() for name in ("worker.js", "timecode.js")
]
SOURCE = "sim://table?size=1920x1080&fps=30&robots=6&timecode=true"
MEASURE = """([address, count, around, timecode]) => new Promise((done) => {
  const url = (text) => URL.createObjectURL(new Blob([text], { type: "text/javascript" }));
  const script = around.replace("./timecode.js", url(timecode)).replace("/features", `${location.origin}/features`);
  const canvas = document.createElement("canvas"), off = canvas.transferControlToOffscreen(), told = [];
  const worker = new Worker(url(script), { type: "module" });
  worker.onmessage = ({ data }) => {
    const { head, shown_ms: shown, taken_ms: taken } = data;
    if (data.isReady) {
      worker.postMessage({ canvases: [off] }, [off]);
      worker.postMessage({ address });
    }
    if (head) told.push([shown - 1000 * head.time, taken === null ? null : shown - taken]);
    if (told.length >= count) { worker.terminate(); done(told); }
  };
})"""


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    folder = tmp_path_factory.mktemp("latency")
    (folder / "settings.yaml").write_text(
        f"server: {{port: 0}}\ncameras:\n- {{id: north, source: '{SOURCE}', field: table, region: full}}\n"
    )
    server = subprocess.Popen(
        [
            sys.executable,
            "-c",
            "from touchline.cli import main; main()",
            "serve",
            "--config",
            str(folder / "settings.yaml"),
            "--data",
            str(folder / "data"),
        ],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        text=True,
    )
    url = server.stdout.readline().split()[-1]
    yield url
    server.terminate()
    server.wait(20)


@pytest.fixture(scope="module")
def page(served):
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium_path(), args=ARGUMENTS)
        page = browser.new_page(bypass_csp=True)  # the worker around the page's own comes as a blob
        page.goto(served + "#/cameras/nobody/live")  # a page that watches nothing itself
        yield page
        browser.close()


def measured(page, url, view, width, count=150):
    address = (
        url.replace("http", "ws")
        + f"api/v1/cameras/north/stream?view={view}&width={width}&ack=true"
    )
    told = page.evaluate(MEASURE, [address, count, *SCRIPTS])[30:]
    by_stamp = np.array([one[0] for one in told])
    by_picture = np.array([one[1] for one in told if one[1] is not None])
    return by_stamp, by_picture


def test_from_the_camera_to_the_canvas(page, served):
    while (
        requests.get(f"{served}api/v1/cameras/north/status", timeout=10).json()["state"] != "live"
    ):
        time.sleep(0.2)
    stamps, pictures = measured(page, served, "raw", 960)
    print(
        f"\nraw, 960 wide: p50 {np.median(pictures):.0f} ms, p95 {np.percentile(pictures, 95):.0f} ms by the time "
        f"in the picture; {np.median(stamps):.0f} ms by its stamp; read in {len(pictures)} of {len(stamps)}"
    )
    assert len(pictures) > 0.9 * len(stamps)
    made = calibrated(SOURCE).to_json()
    task = {
        name: made[name] for name in ("field", "region", "rotate", "observations", "image_size")
    }
    kept = requests.post(
        f"{served}api/v1/calibrations", json={**task, "camera": "north"}, timeout=30
    )
    assert kept.status_code == 201, kept.text
    activate_despite(served, kept.json()["id"])
    time.sleep(1.0)
    stamps, _ = measured(page, served, "corrected", 960)
    offset = np.median(pictures) - np.median(stamps)
    print(
        f"corrected, 960 wide: p50 {np.median(stamps):.0f} ms, p95 {np.percentile(stamps, 95):.0f} ms by its stamp "
        f"(raw: the picture says {offset:+.0f} ms more or less)"
    )
    assert np.median(stamps) < 30


def test_eight_cameras_on_one_page_leave_room_to_ask(page, served):
    for number in range(7):
        source = f"sim://table?size=640x512&fps=15&seed={number}"
        camera = {"id": f"more-{number}", "source": source, "field": "table", "region": "full"}
        assert requests.post(f"{served}api/v1/cameras", json=camera, timeout=10).status_code == 201
    page.set_viewport_size({"width": 1400, "height": 3000})
    page.goto(served)
    page.reload()
    watched = [f"more-{number}" for number in range(7)] + ["north"]
    end = time.monotonic() + 60
    while not all(
        requests.get(f"{served}api/v1/cameras/{id}/status", timeout=10).json()["viewers"]
        for id in watched
    ):
        assert time.monotonic() < end
        time.sleep(0.2)
    time.sleep(5)
    times = page.evaluate("""async () => {
      const times = [];
      for (let i = 0; i < 40; i++) {
        const start = performance.now();
        await (await fetch("/api/v1/models")).json();
        times.push(performance.now() - start);
      }
      return times;
    }""")
    print(
        f"\neight live cameras on one page: an API call answers in {np.median(times):.0f} ms, p95 "
        f"{np.percentile(times, 95):.0f} ms, at most {max(times):.0f} ms"
    )
    assert np.percentile(times, 95) < 500
