"""What teams receive through the league's packet, on the second simulator: true and expected. Command:

    python tests/bench/bench_packet.py [SCENES [FIRST_SEED]]

Fields of the Small Size League, calibrated without clicks by the model that the program takes itself; declined pictures
are skipped. Of the fit, its packet and the SSL model on the same points: the true rms error over the region in sight,
on the carpet and at robot height, and the expected one.
"""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT)]

from tests.support.second_simulator import Scene, render, scene_spec  # noqa: E402
from touchline.automatic.request import AutomaticRequest  # noqa: E402
from touchline.core.errors import TouchlineError  # noqa: E402
from touchline.core.field_json import field_from_json  # noqa: E402
from touchline.core.geometry import with_z  # noqa: E402
from touchline.core.records import Calibration, Frame, observations_from_json  # noqa: E402
from touchline.evaluate.uncertainty import grid_over  # noqa: E402
from touchline.formats.ssl_vision import camera_from_wire  # noqa: E402
from touchline.league.packet_camera import packet_camera  # noqa: E402
from touchline.models import Restored  # noqa: E402
from touchline.models.contract import RECTANGLE_FIELDS  # noqa: E402
from touchline.workflows.calibration import calibrate  # noqa: E402

GOOD_MM = 7.5
TURNED_MM = 500.0  # the field seen the other way round: another fault, and no error of a lens
FIGURES = ("carpet", "robot height")


def true_mm(unproject: Callable[[Any, float], Any], scene: Scene, z_mm: float) -> float:
    """Return the rms error over the region in sight; of a whole field turned by 180°, of the turned one."""
    places = grid_over(scene.region).reshape(-1, 2)
    pixels = scene.camera.project(with_z(places, z_mm))
    seen = scene.camera.inside(pixels)
    whole = (
        np.ptp(scene.region.x_mm) == scene.field.length_mm
        and np.ptp(scene.region.y_mm) == scene.field.width_mm
    )
    off = [
        np.linalg.norm(turn * unproject(pixels[seen], z_mm) - places[seen], axis=1)
        for turn in ((1, -1) if whole else (1,))
    ]
    return min(float(np.sqrt(np.mean(np.where(np.isfinite(one), one, 1e6) ** 2))) for one in off)


def row(seed: int) -> dict[str, Any] | None:
    """Return the figures of a scene; None where the picture was declined or is of another field."""
    spec = scene_spec(seed)
    if not spec.field.startswith("ssl"):
        return None
    scene = render(spec)
    _, made = AutomaticRequest(scene.field, scene.region).answer(Frame(scene.pixels))
    if made is None:
        return None
    made = Calibration.from_json(made.to_json())
    model, field, region = Restored.of(made)
    found: dict[str, Any] = {"seed": seed, "lens": spec.lens}
    packet = packet_camera(made)
    if isinstance(packet, TouchlineError) or packet.expected is None:
        return {**found, "refused": str(packet)}
    read = camera_from_wire(packet.sent, field).camera(
        {name: getattr(model, name) for name in RECTANGLE_FIELDS}
    )
    found |= {"level": packet.level, "asked": packet.judged_mm > 30}
    figures = {
        "fit": (model.unproject, made.report["sigma_mm"]),
        "packet": (read.unproject, packet.expected),
    }
    try:
        ssl = calibrate(
            observations_from_json(made.observations),
            field_from_json(made.field),
            region,
            made.image_size,
            "ssl",
        )
        figures["ssl"] = ssl.model.unproject, ssl.report["sigma_mm"]
        found["ssl level"] = ssl.report["verdict"]["level"]
    except TouchlineError:
        pass
    for name, (unproject, sigma) in figures.items():
        found[name] = {
            place: (true_mm(unproject, scene, z_mm), part["rms"])
            for place, z_mm, part in (
                ("carpet", 0.0, sigma),
                ("robot height", field.hat_height_mm, sigma["hat"]),
            )
        }
    return found


def tell(rows: list[dict[str, Any]]) -> None:
    print(
        "| | true, median (p90, worst) mm | expected, median | true over expected, median | over 2 |"
    )
    print(5 * "|---" + "|")
    for name in ("fit", "packet", "ssl"):
        for place in FIGURES:
            true, expected = np.array([one[name][place] for one in rows if name in one]).T
            ratio = true / expected
            print(
                f"| {name}, {place} | {np.median(true):.1f} ({np.quantile(true, 0.9):.1f}, {true.max():.0f}) | "
                f"{np.median(expected):.1f} | {np.median(ratio):.2f} | {(ratio > 2).mean():.0%} |"
            )
    for name, key in (("packet", "level"), ("ssl", "ssl level")):
        good = [one for one in rows if one.get(key) == "good"]
        wrong = [
            one["seed"] for one in good if max(true for true, _ in one[name].values()) > GOOD_MM
        ]
        print(f"{name}: {len(good)} good, of those over {GOOD_MM} mm: {wrong}")
    print(
        f"{len(rows)} scenes; asked before it is published: {[one['seed'] for one in rows if one['asked']]}"
    )


if __name__ == "__main__":
    scenes, seed = (
        (int(sys.argv[1]) if len(sys.argv) > 1 else 40),
        (int(sys.argv[2]) if len(sys.argv) > 2 else 3000),
    )
    rows: list[dict[str, Any]] = []
    while len(rows) < scenes:
        one = row(seed)
        seed += 1
        if one is None:
            continue
        print(one, flush=True)
        if "refused" not in one and one["fit"]["carpet"][0] > TURNED_MM:
            print("turned by 180°: not counted")
        elif "refused" not in one:
            rows.append(one)
    tell(rows)
