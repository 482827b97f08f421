"""Is a zoom told from a knock when a pose is updated? Command: python tests/bench/bench_zoom.py

Simulated cameras of 1280 × 1024 px over ssl-div-b with people and robots, tilted by 0 to 35°: calibrated from an
operator's clicks alone, and with the lens known, as from a board. Each is zoomed, and knocked with the lens as it was.
"""

import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests.support.drifting_cameras import bumped, zoomed
from tests.support.live_cameras import FIELDS
from tests.support.sim_clicks import border_observations
from tests.support.simulated_source import simulated_source
from touchline.core.errors import FitFailed
from touchline.core.records import Calibration, Frame
from touchline.drift.reregister import reregister
from touchline.models import field_from_raw, model_from_json
from touchline.sources.sim.render import Rendering
from touchline.workflows.calibration_request import CalibrationRequest

SCENE = "sim://ssl-div-b?size=1280x1024&robots=12&people=3&k1=-0.2&tilt={tilt}"
TILTS = (0, 8, 20, 35)
ZOOMS = (0.95, 0.97, 0.98, 0.99, 1.01, 1.02, 1.03, 1.05)
KNOCKS = (
    ((0.0, 0.0, 0.0), (0, 0, 0)),
    ((0.9, -0.7, 1.5), (0, 0, 0)),
    ((0.3, 0.2, -0.4), (0, 0, 0)),
    ((0.5, 0.3, 0.1), (60, 30, -40)),
    ((0.1, 0.1, 0.1), (0, 0, -150)),
    ((-0.2, 0.4, 0.0), (0, 0, 100)),
)
GOOD_MM = 5.0


def calibrated(rendering: Rendering, noise_px: float, options: dict) -> Calibration:
    clicks = border_observations(
        rendering.camera, rendering.region, 9, noise_px=noise_px, rng=np.random.default_rng(1)
    )
    task = CalibrationRequest(
        clicks,
        rendering.field,
        rendering.region,
        rendering.camera.image_size,
        "brown-conrady",
        options,
        "test",
    )
    return replace(task.record(task.run(cross_validate=False)), id="made")


def moved(rendering: Rendering, shift_mm: tuple[int, int, int]) -> Rendering:
    x, y, z = np.add(rendering.camera.position_mm, shift_mm).tolist()
    return Rendering.of(
        replace(rendering.camera, position_mm=(x, y, z)),
        rendering.field,
        rendering.region,
        rendering.motion,
        sensor=rendering.sensor,
        lamps=rendering.lamps,
    )


def outcome(before: Calibration, one: Rendering, other: Rendering) -> tuple[str, float]:
    """What was told, and the true rms in mm of the new pose; NaN where it was refused."""
    try:
        told, made = reregister(
            before, Frame(other.frame_at(1, 1.0)), before=Frame(one.frame_at(0, 0.0))
        )
    except FitFailed as refusal:
        return f"refused: {refusal.reason}", np.nan
    x, y = np.meshgrid(np.linspace(*one.region.x_mm, 13), np.linspace(*one.region.y_mm, 9))
    places = np.stack([x.ravel(), y.ravel()], axis=-1)
    model, raw = (
        model_from_json(made.model_name, made.model_parameters),
        other.camera.raw_from_field(places),
    )
    off = np.linalg.norm(field_from_raw(model, raw) - places, axis=1)[other.camera.sees(raw)]
    return told["zoom"]["state"], float(np.sqrt(np.nanmean(off**2)))


def main() -> None:
    seen: dict[tuple[str, str], list[tuple[str, float]]] = {}
    for tilt in TILTS:
        one = simulated_source(SCENE.format(tilt=tilt), FIELDS).rendering
        exact = calibrated(
            one, 0.0, {"height_mm": {"value": one.camera.position_mm[2], "sigma": 1.0}}
        )
        for lens, before in (
            ("of the clicks alone", calibrated(one, 0.2, {})),
            ("known", calibrated(one, 0.2, {"lens": exact.lens_option(), "lens_sigma": "0"})),
        ):
            for factor in ZOOMS:
                kind = f"zoom of {abs(factor - 1):.0%}"
                seen.setdefault((lens, kind), []).append(outcome(before, one, zoomed(one, factor)))
            for turn, shift in KNOCKS:
                knocked = moved(bumped(one, *turn), shift)
                seen.setdefault((lens, "knock"), []).append(outcome(before, one, knocked))
    for (lens, kind), results in sorted(seen.items()):
        bad = [f"{told} {mm:.0f} mm" for told, mm in results if mm > GOOD_MM]
        print(
            f"lens {lens}, {kind}: {len(results)} cases; {dict(Counter(told for told, _ in results))}; largest error "
            f"{np.nanmax([*(mm for _, mm in results), 0]):.1f} mm; over {GOOD_MM:.0f} mm: {bad or 'none'}"
        )


if __name__ == "__main__":
    main()
