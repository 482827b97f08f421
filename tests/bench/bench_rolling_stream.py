"""A lens from a ball that rolls before a simulated camera, against the truth; and what rolls add to few clicks.

python tests/bench/bench_rolling_stream.py stream     30 s of a rendered stream, four lenses, two seeds each
python tests/bench/bench_rolling_stream.py refined    4 clicks on each border, with and without 30 rolls, 16 seeds
"""

import sys
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from tests.support.sim_clicks import border_observations, known_grid, rms_mm  # noqa: E402
from touchline.core.geometry import ImageSize  # noqa: E402
from touchline.models import field_from_raw, model_from_json  # noqa: E402
from touchline.sources import SourceContext, source_from_url  # noqa: E402
from touchline.sources.sim.camera import LENSES, SimCamera  # noqa: E402
from touchline.store.fields import load_fields  # noqa: E402
from touchline.straight.rolling import RollRecorder, lens_record, refine  # noqa: E402
from touchline.straight.rolls import RecordedRoll  # noqa: E402
from touchline.workflows.calibration_request import CalibrationRequest  # noqa: E402

FIELDS = load_fields()
SIZE = ImageSize(1224, 1024)
SECONDS, FPS = 30, 30


def stream() -> None:
    for lens in ("mild", "half", "strong", "pincushion"):
        for seed in (1, 2):
            source = source_from_url(
                f"sim://ssl-div-b?robots=0&ball=true&lens={lens}&size=1224x1024&fps=30&seed={seed}",
                SourceContext(fields=FIELDS),
            )
            rolling, took = RollRecorder(live=True), []
            for number in range(SECONDS * FPS):
                pixels = source.rendering.frame_at(
                    number, number / FPS, source.settings.shot(source._level)
                )
                begun = time.process_time()
                rolling.add(number / FPS, pixels)
                took.append(time.process_time() - begun)
            rolling.end()
            made = lens_record(rolling.rolls, SIZE, "brown-conrady")
            camera, sigma, terms = source.camera, made["report"]["sigma"], made["lens"]["terms"]
            scale = (np.hypot(*SIZE) / 2 / camera.focal_px[0]) ** 2
            truth = {"k1": camera.lens.k1 * scale, "k2": camera.lens.k2 * scale**2}
            print(
                f"{lens}, seed {seed}: {made['report']['rolls']} rolls; "
                + "; ".join(
                    f"{name} {terms[name]:+.4f} ± {sigma[name]:.4f}, truth {truth[name]:+.4f}"
                    for name in truth
                )
                + f"; {1000 * np.median(took):.1f} ms a frame",
                flush=True,
            )


def refined_by_rolls() -> None:
    field = FIELDS["ssl-div-b"]
    region = field.regions["full"]
    for lens in ("mild", "strong"):
        off = []
        for seed in range(16):
            rng = np.random.default_rng(seed)
            camera = SimCamera.above(region, SIZE, LENSES[lens], height_mm=6500)
            task = CalibrationRequest(
                border_observations(camera, region, 4, 0.5, rng, anywhere=True),
                field,
                region,
                SIZE,
                "brown-conrady",
                {"height_mm": {"value": 6500.0 + rng.normal(0, 30), "sigma": 30.0}},
            )
            made = task.record(task.run(cross_validate=False))
            better = refine(made, lens_record(_rolls(camera, rng, 30), SIZE, "brown-conrady"))
            raw, places = (points.reshape(-1, 2) for points in known_grid(camera, region, 21, 17))
            off.append(
                [
                    rms_mm(
                        field_from_raw(model_from_json(c.model_name, c.model_parameters), raw),
                        places,
                    )
                    for c in (made, better)
                ]
            )
        before, after = np.array(off).T
        print(
            f"{lens}: {np.median(before):.1f} mm by clicks, {np.median(after):.1f} mm with rolls (medians); worst "
            f"{before.max():.1f} and {after.max():.1f} mm",
            flush=True,
        )


def _rolls(camera: SimCamera, rng: np.random.Generator, count: int) -> list[RecordedRoll]:
    rolls: list[RecordedRoll] = []
    while len(rolls) < count:
        start, angle = rng.uniform([-4300, -2900], [4300, 2900]), rng.uniform(0, 2 * np.pi)
        end = start + rng.uniform(1500, 5000) * np.array([np.cos(angle), np.sin(angle)])
        if abs(end[0]) < 4400 and abs(end[1]) < 2950:
            t = np.linspace(0, 1, int(rng.integers(20, 60)))[:, None]
            places = np.concatenate([start * (1 - t) + end * t, np.full((len(t), 1), 21.5)], axis=1)
            raw = camera.raw_from_field(places)
            rolls.append(
                RecordedRoll(raw + rng.normal(0, 0.25, raw.shape), 0.0, len(t) / FPS, 0.25, 0.3)
            )
    return rolls


if __name__ == "__main__":
    {"stream": stream, "refined": refined_by_rolls}[sys.argv[1]]()
