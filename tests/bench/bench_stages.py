"""What the stages of seeing find, and how long they take: simulated matches, labelled pictures, milliseconds a stage.

python tests/bench/bench_stages.py match 10000   Div B, 16 robots, light ±40 %, noise 4: places, numbers, fronts
python tests/bench/bench_stages.py small 200     the same with ten small robots on the 5v5 field, 1280 × 1024
python tests/bench/bench_stages.py labels        precision and recall in pictures of real fields
python tests/bench/bench_stages.py speed         1080p on one core, beside a plain OpenCV of the same colours
"""

import sys
import time
from pathlib import Path

import cv2
import numpy as np

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from tests.support.labelled import SETS, read_set, tallies, there  # noqa: E402
from tests.support.sim_truth import truth_at  # noqa: E402
from tests.support.watched_field import Score, colour_clicks, scored, sight_of, world  # noqa: E402
from touchline.core.options import read_options  # noqa: E402
from touchline.detection.stages import STAGES, FrameState  # noqa: E402

SEEDS = (1, 2, 3, 4)
PERIOD_S = 60.0  # of the simulated light


def match(frames: int, small: bool = False) -> None:
    """Each seed another play with other numbers; learned in its first frame from five clicks a colour."""
    total = Score.fresh()
    for seed in SEEDS:
        field = (
            world(
                "vsss-5v5", size=(1280, 1024), robots=10, seed=seed, shuffled=False, speed_mm_s=500
            )
            if small
            else world(seed=seed)
        )
        sight, count = sight_of(field, "vsss" if small else "ssl"), frames // len(SEEDS)
        for i in range(count):
            time_s = i * 3.0 * PERIOD_S / count
            scored(
                total,
                sight.process(field.frame_at(i, time_s)),
                truth_at(field, time_s),
                40.0 if small else 100.0,
            )
        print(
            f"seed {seed}: {total.robots} robots so far, {total.wrong} wrong, {total.missed} missed",
            flush=True,
        )
    print(
        f"{total.robots} robots in {frames // len(SEEDS) * len(SEEDS)} frames: wrong number or team {total.wrong}, "
        f"without a number {total.unnamed}, missed {total.missed}, not there {total.invented}"
    )
    print(f"place: {_spread(total.off_mm)} mm, front: {_spread(total.turned_deg)} degrees")
    print(
        f"{total.balls} balls: missed {total.balls_missed}, not there {total.balls_invented}, "
        f"place {_spread(total.ball_mm)} mm"
    )


def _spread(values: list[float]) -> str:
    return "median {:.2f}, p99 {:.2f}, most {:.2f}".format(*np.quantile(values, [0.5, 0.99, 1.0]))


def labels() -> None:
    print("| set | frames | ball P · R | markers P · R | off, median px |\n|---|---|---|---|---|")
    for path in SETS:
        told = read_set(path)
        if not there(told):
            print(f"| {path.stem} | its pictures are not beside the project |")
            continue
        found = tallies(told)
        ball, rest = found.pop("ball"), list(found.values())
        hit, missed, false = (
            sum(getattr(t, name) for t in rest) for name in ("hit", "missed", "false")
        )
        off = np.concatenate([ball.off_px, *(t.off_px for t in rest)])
        print(
            f"| {told['title']} | {len(told['test'])} | {_rates(ball.hit, ball.missed, ball.false)} | "
            f"{_rates(hit, missed, false)} | {np.median(off):.1f} |"
        )


def _rates(hit: int, missed: int, false: int) -> str:
    if not hit + missed + false:
        return "–"
    if not hit + missed:
        return f"none there, {false} seen"
    return f"{hit / max(1, hit + false):.2f} · {hit / (hit + missed):.2f} ({hit} of {hit + missed}, {false} false)"


def speed(runs: int = 150) -> None:
    cv2.setNumThreads(1)
    field = world()
    sight = sight_of(field)
    frames = [field.frame_at(i, 2.0 * i) for i in range(10)]
    ranges = _ranges(frames[0], colour_clicks(field))
    took: dict[str, list[float]] = {}
    for i in range(runs):
        pixels = frames[i % len(frames)]
        for name, ms in sight.process(pixels, clock=time.perf_counter).took_ms.items():
            took.setdefault(name, []).append(ms)
        began = time.perf_counter()
        _plain(pixels, {name: ranges[name] for name in ("orange", "yellow", "blue")})
        took.setdefault("plain OpenCV, three colours", []).append(
            1000 * (time.perf_counter() - began)
        )
        began = time.perf_counter()
        _plain(pixels, ranges)
        took.setdefault("plain OpenCV, five colours", []).append(
            1000 * (time.perf_counter() - began)
        )
    busy = [
        sight.process(frames[i % len(frames)], clock=time.process_time).took_ms for i in range(runs)
    ]
    print(
        "processor time, which other work beside it does not lengthen much: "
        f"median {np.median([sum(ms.values()) for ms in busy]):.2f}, "
        f"p95 {np.quantile([sum(ms.values()) for ms in busy], 0.95):.2f} ms; of it "
        + ", ".join(f"{name} {np.median([ms[name] for ms in busy]):.2f}" for name in busy[0])
    )
    for name, ms in took.items():
        print(f"{name}: least {min(ms):.2f}, median {np.median(ms):.2f} ms")
    ours = np.sum([ms for name, ms in took.items() if not name.startswith("plain")], axis=0)
    segmented = np.array(took["colours"]) + np.array(took["blobs"])
    print(
        f"all: least {ours.min():.2f}, median {np.median(ours):.2f}, p95 {np.quantile(ours, 0.95):.2f} ms; at 60 "
        "fps a frame has 16.7 ms"
    )
    for count in ("three", "five"):
        plain = np.array(took[f"plain OpenCV, {count} colours"])
        print(
            f"colours and blobs take {np.median(segmented / plain):.2f} of plain OpenCV with {count} colours "
            f"(least {segmented.min() / plain.min():.2f}); all stages {np.median(ours / plain):.2f}"
        )
    _choices(sight, frames)


def _choices(sight, frames: list) -> None:
    """What the stages cost that the plan for this league leaves out."""
    for name, options in (
        ("noise", {"method": "median"}),
        ("noise", {"method": "temporal"}),
        ("noise", {"method": "bilateral"}),
        ("edges", {"channel": "grey"}),
        ("edges", {"channel": "all"}),
    ):
        kind = STAGES[name]
        stage = kind(read_options(kind.OPTIONS, options), sight.context)
        ms = []
        for i in range(30):
            seeing = FrameState.of(frames[i % len(frames)])
            began = time.perf_counter()
            stage.run(seeing)
            ms.append(1000 * (time.perf_counter() - began))
        print(
            f"{name} {next(iter(options.values()))}: least {min(ms):.2f}, median {np.median(ms):.2f} ms"
        )


def _ranges(pixels: np.ndarray, clicks: dict) -> dict:
    """What somebody would set by hand: a box of HSV around the clicked colours."""
    hsv = cv2.cvtColor(pixels, cv2.COLOR_BGR2HSV)
    found = {}
    for name, places in clicks.items():
        seen = np.array([hsv[round(y), round(x)] for x, y in places]).astype(int)
        found[name] = (
            np.clip(seen.min(0) - np.array((8, 50, 70)), 0, 255).tolist(),
            np.clip(seen.max(0) + np.array((8, 50, 70)), 0, 255).tolist(),
        )
    return found


def _plain(pixels: np.ndarray, ranges: dict) -> list:
    """inRange and connectedComponentsWithStats, colour by colour, with the patches' middles."""
    hsv = cv2.cvtColor(pixels, cv2.COLOR_BGR2HSV)
    return [
        cv2.connectedComponentsWithStats(
            cv2.inRange(hsv, np.array(low), np.array(high)), connectivity=8
        )[2:]
        for low, high in ranges.values()
    ]


if __name__ == "__main__":
    asked = sys.argv[1:] or ["speed", "labels", "match", "400"]
    while asked:
        what = asked.pop(0)
        if what in ("match", "small"):
            match(int(asked.pop(0)) if asked and asked[0].isdigit() else 400, what == "small")
        else:
            {"labels": labels, "speed": speed}[what]()
