"""Listing, opening and saving with 100,000 stored calibrations, beside the same with 100; and what a start takes.

    python tests/bench/bench_store.py        COUNT=100000 by default

Over the store itself and over HTTP. The calibrations are as large as real ones of 36 clicks.
"""

import json
import os
import shutil
import sys
import tempfile
import time
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from tests.support.servers import Line, an_export, form, served  # noqa: E402
from touchline.core.records import Calibration  # noqa: E402
from touchline.store.calibrations import calibration_row  # noqa: E402
from touchline.store.store import Store  # noqa: E402

COUNT = int(os.environ.get("COUNT", "100000"))
CAMERAS = [f"camera-{k}" for k in range(10)]
TASK = json.loads((ROOT / "tests" / "clicks" / "ssl_2008_half.json").read_text())


def fill(store: Store, one: Calibration, count: int) -> None:
    """So many versions, a thousand in each transaction."""
    for start in range(0, count, 1000):
        with store._database.writing("The bench") as rows:
            for number in range(start, min(start + 1000, count)):
                kept = replace(
                    one, id=f"{number:016x}", camera=CAMERAS[number % 10], version=1 + number // 10
                )
                rows.add(calibration_row(kept))


def p(seconds: list[tuple[float, float]]) -> str:
    wall, busy = np.transpose(seconds) * 1e3
    return (
        f"p50 {np.percentile(wall, 50):6.1f} ms   p95 {np.percentile(wall, 95):6.1f} ms   "
        f"processor time of this thread p95 {np.percentile(busy, 95):5.1f} ms"
    )


def timed(call, times: int = 200) -> list[tuple[float, float]]:
    """(wall, processor time of this thread) of each call, s: on a machine with other work only the second is ours."""
    taken = []
    for number in range(times):
        began, busy = time.perf_counter(), time.thread_time()
        call(number)
        taken.append((time.perf_counter() - began, time.thread_time() - busy))
    return taken


def measure(folder: Path, one: Calibration, count: int, export: dict) -> None:
    with Store(folder) as store:
        fill(store, one, count)
    size = (folder / "touchline.db").stat().st_size
    began = time.perf_counter()
    store = Store(folder)
    print(f"\nload average {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors")
    print(
        f"{count} calibrations, {size / 1e6:.0f} MB; opening the store with all its checks "
        f"{time.perf_counter() - began:.1f} s"
    )
    with store:

        def any_id(number: int) -> str:
            return f"{number * 7919 % count:016x}"

        # copies of so large a database are made now and then, not in these milliseconds
        store._backups.close()
        print("list 20 of all       ", p(timed(lambda n: store.calibrations.found(limit=20))))
        print(
            "list 20 of a camera  ",
            p(timed(lambda n: store.calibrations.found(CAMERAS[n % 10], limit=20))),
        )
        print(
            "list 20 far back     ",
            p(timed(lambda n: store.calibrations.found(None, 20, str(count // 2 + n)))),
        )
        print("open one             ", p(timed(lambda n: store.calibrations.get(any_id(n)))))
        print(
            "save                 ",
            p(timed(lambda n: store.calibrations.add(replace(one, camera=CAMERAS[n % 10])))),
        )
        print("activate             ", p(timed(lambda n: store.calibrations.activate(any_id(n)))))
    with served(folder) as url, closing(Line(url)) as line:

        def asked(path: str) -> None:
            assert line.ask("GET", path)[0] == 200

        data, headers = form(json.dumps({**export, "camera": None}).encode())
        asked("/calibrations?limit=20")
        print("HTTP list 20         ", p(timed(lambda n: asked("/calibrations?limit=20"))))
        print(
            "HTTP list 20, camera ",
            p(timed(lambda n: asked(f"/calibrations?limit=20&camera={CAMERAS[n % 10]}"))),
        )
        print("HTTP open one        ", p(timed(lambda n: asked(f"/calibrations/{any_id(n)}"))))
        print(
            "HTTP save (import)   ",
            p(timed(lambda n: line.ask("POST", "/calibrations/import", data, headers), 60)),
        )


def main() -> None:
    place = Path(tempfile.mkdtemp())
    try:
        with served(place / "elsewhere") as url:
            export = an_export(url, TASK)
        one = Calibration.from_json(export)
        print(f"one calibration: {len(json.dumps(one.to_json())) / 1000:.0f} kB of JSON")
        for count in (100, COUNT):
            measure(place / str(count), one, count, export)
    finally:
        shutil.rmtree(place)


if __name__ == "__main__":
    main()
