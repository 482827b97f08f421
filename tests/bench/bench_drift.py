"""Does a camera that nobody touched ever raise an alarm, is a knock always found, and what does a look cost?

Run: python tests/bench/bench_drift.py [frames in all]. Simulated cameras over several fields, with robots and people
that move, flicker, and light that comes and goes by half; each frame is one second after the one before.
"""

import sys
import time
from pathlib import Path

import cv2
import numpy as np

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from tests.support.drifting_cameras import followed, knocked  # noqa: E402
from touchline.drift.alarm import ALARMS, DriftWatch  # noqa: E402

SCENES = (
    "sim://ssl-div-b?size=1280x1024&robots=12&people=2&k1=-0.2",
    "sim://ssl-div-b?cameras=2&camera=0&size=1224x1024&robots=12&people=3&flicker=0.1&tilt=12&k1=-0.35",
    "sim://ssl-div-a?cameras=4&camera=1&size=1280x960&robots=16&people=2&drift=0.5&noise=3&k1=-0.1",
    "sim://ssl-div-a?size=1280x960&robots=22&people=4&drift=0.3&flicker=0.05",
    "sim://vsss-3v3?size=640x480&robots=6&people=1&drift=0.5&noise=4",
    "sim://table?size=1280x1024&robots=8&people=4&noise=6&flicker=0.2&glare=0.5",
    "sim://ssl-div-b?size=640x480&robots=12&people=3&noise=3&blur=0.9",
    "sim://ssl-div-b?cameras=2&camera=1&size=1224x1024&robots=12&people=8&drift=0.4&tilt=-15",
)
KNOCKS = ("1 px", "3 mm")


def main() -> None:
    cv2.setNumThreads(1)
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
    rng = np.random.default_rng(7)
    every, took = frames // len(SCENES), []
    alarms = looks = 0
    print(f"{'scene':96s} places seen   px: median    max   mm: median    max  alarms covered")
    for scene in SCENES:
        rendering, reference = followed(scene)
        watch, sample, px, mm, seen, raised, covered = DriftWatch(0.0), None, [], [], [], 0, 0
        for index in range(1, every + 1):
            picture = rendering.frame_at(index, float(index))
            begun = time.thread_time()
            sample = reference.look(picture, sample)
            took.append(time.thread_time() - begun)
            told = watch.add(sample, float(index))
            raised += told.state in ALARMS
            covered += told.state not in (*ALARMS, "steady")
            if sample.moved:
                px.append(sample.moved.px)
                mm.append(sample.moved.mm)
                seen.append(sample.seen)
        alarms, looks = alarms + raised, looks + every
        print(
            f"{scene:96s} {len(reference.across):6d} {np.median(seen):4.0f} {np.median(px):12.3f} {max(px):6.3f} "
            f"{np.median(mm):12.2f} {max(mm):6.2f} {raised:7d} {covered:7d}",
            flush=True,
        )
    print(
        f"{alarms} alarms in {looks} frames; a look takes {1e3 * np.median(took):.1f} ms in the middle, "
        f"{1e3 * np.percentile(took, 99):.1f} ms in 99 %, of one core"
    )
    for kind in KNOCKS:
        found, asked, late = 0, 0, []
        for scene in SCENES:
            rendering, reference = followed(scene)
            for trial in range(5):
                other, _ = knocked(rendering, kind, rng)
                watch, sample = DriftWatch(0.0), None
                for index in range(1, 4):
                    sample = reference.look(rendering.frame_at(index, 5.0 * trial + index), sample)
                    watch.add(sample, float(index))
                for index in range(4, 8):
                    sample = reference.look(other.frame_at(index, 5.0 * trial + index), sample)
                    if watch.add(sample, float(index)).state == "knocked":
                        found += 1
                        late.append(index - 3)
                        break
                asked += 1
        print(
            f"knocked by {kind}: {found} of {asked} found, after {np.mean(late):.1f} looks, {max(late)} at most"
        )


if __name__ == "__main__":
    main()
