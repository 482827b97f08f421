"""How exactly a click is drawn to a painted line, how quickly, and where on real pictures.

Command: python tests/bench/bench_snap.py [FOLDER]     (a minute or two; crops of the real pictures are drawn to FOLDER)
"""

import json
import sys
import time
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests.support.rendered import painted, straight
from touchline.core.geometry import ImageSize
from touchline.sources.sim.actors import Motion
from touchline.sources.sim.camera import LENSES, SimCamera
from touchline.sources.sim.ground import Light
from touchline.sources.sim.render import Rendering, Sensor
from touchline.store.fields import load_fields
from touchline.vision.snap import Snapped, snap

SEEDS = 3
PER_SEED = 16
OFF_PX = 4.0
GROUNDS = {
    "white on green": (200, (80, 80)),
    "white on black": (250, (15, 15)),
    "dark on light": (40, (200, 200)),
    "carpet beside wood": (220, (120, 40)),
}
CLICKS = Path(__file__).parents[1] / "clicks"
REAL = {"ssl_2008_half": "ssl_2008/ssl-field-2008.jpg", "unball_full": "unball/unball_path1.png"}


def drawn_lines() -> list[float]:
    """Lines drawn without any model of ours: 2 to 6 px, noise 2 grey levels, clicks 4 px off, any angle."""
    times = []
    print("blur px   " + "  ".join(f"{w} px wide" for w in (2, 3, 4, 6)))
    for where, (paint, ground) in GROUNDS.items():
        for blur_px in (0.5, 1.0, 1.6):
            row = [_seeds(width, blur_px, paint, ground, times) for width in (2, 3, 4, 6)]
            told = ", ".join(
                f"{np.mean(e):.3f} (worst {np.max(e):.2f}, {m} of {n} left)" for e, m, n in row
            )
            print(f"{where}, blur {blur_px}: {told}")
    return times


def _seeds(
    width: float, blur_px: float, paint: float, ground: tuple, times: list
) -> tuple[list, int, int]:
    errors, left = [], 0
    for seed in range(SEEDS):
        rng = np.random.default_rng(seed)
        for _ in range(PER_SEED):
            angle, middle = rng.uniform(0, np.pi), np.array([60, 50]) + rng.uniform(-0.5, 0.5, 2)
            normal = np.array([-np.sin(angle), np.cos(angle)])
            picture = painted(
                [straight(middle, angle, width)],
                paint=paint,
                ground=ground,
                blur_px=blur_px,
                rng=rng,
            )
            start = time.process_time()
            found = snap(picture, middle + rng.choice([-1, 1]) * OFF_PX * normal)
            times.append(time.process_time() - start)
            if isinstance(found, Snapped):
                errors.append(abs((np.array(found.point) - middle) @ normal))
            else:
                left += 1
    return errors, left, SEEDS * PER_SEED


def rendered_fields() -> None:
    """Whole fields through lenses, carpet grain, uneven light: every line and arc, clicks 4 px off."""
    field = load_fields()["ssl-div-b"]
    region = field.regions["full"]
    for lens, tilt in (("mild", 0), ("strong", 0), ("strong", 20)):
        camera = SimCamera.above(
            region, ImageSize(1280, 1024), LENSES[lens], height_mm=6500, tilt_deg=tilt
        )
        errors, left = [], 0
        for seed in range(4):
            sensor = Sensor(blur_px=0.8, noise=2.0)
            shown = Rendering.of(camera, field, region, Motion(robots=0), Light(), sensor).frame(
                seed
            )
            rng = np.random.default_rng(seed)
            for marking in (*field.lines.values(), *field.arcs.values()):
                places = camera.raw_from_field(marking.sample(13)[1:-1])
                fine = camera.raw_from_field(marking.sample(20_001))
                for place in places[np.isfinite(places).all(axis=1)]:
                    turn = rng.uniform(0, 2 * np.pi)
                    found = snap(shown, place + OFF_PX * np.array([np.cos(turn), np.sin(turn)]))
                    if isinstance(found, Snapped):
                        errors.append(np.linalg.norm(fine - found.point, axis=1).min())
                    else:
                        left += 1
        e = np.array(errors)
        own = e < 2  # the others were nearer to another line where lines meet
        print(
            f"Div B, {lens}, {tilt}°: mean {e[own].mean():.3f} px, p95 {np.percentile(e[own], 95):.3f}; "
            f"{(~own).sum()} on another line, {left} left, of {len(e) + left}"
        )


def real_pictures(folder: Path | None) -> None:
    """Clicks of ours on real pictures, moved 4 px off anyhow: crops to look at, and the scatter across the line."""
    data = Path(__file__).parents[3] / "shared" / "data" / "fields"
    for name, file in REAL.items():
        if not (data / file).is_file():
            print(f"{name}: the picture is not beside the project, skipped")
            continue
        picture, rng = cv2.imread(str(data / file)), np.random.default_rng(3)
        apart, tiles, left = [], [], 0
        for observation in json.loads((CLICKS / f"{name}.json").read_text())["observations"]:
            for point in np.array(observation["points"]):
                turns = rng.uniform(0, 2 * np.pi, 4)
                spots = [
                    snap(picture, point + OFF_PX * np.array([np.cos(t), np.sin(t)])) for t in turns
                ]
                found = [s for s in spots if isinstance(s, Snapped)]
                left += len(spots) - len(found)
                if len(found) > 1:
                    normal = np.array([-np.sin(found[0].angle_rad), np.cos(found[0].angle_rad)])
                    apart.append(np.ptp([np.array(s.point) @ normal for s in found]))
                tiles += [_crop(picture, point, found[0])] if found else []
        print(
            f"{name}: four clicks 4 px off land within {np.median(apart):.3f} px of each other across the line "
            f"(median; p90 {np.percentile(apart, 90):.2f}), {left} left"
        )
        if folder:
            tiles += [np.zeros_like(tiles[0])] * (-len(tiles) % 9)
            sheet = np.vstack([np.hstack(tiles[i : i + 9]) for i in range(0, len(tiles), 9)])
            cv2.imwrite(str(folder / f"snap-{name}.png"), sheet)


def _crop(
    picture: np.ndarray, click: np.ndarray, found: Snapped, half: int = 16, scale: int = 8
) -> np.ndarray:
    x0, y0 = np.rint(click).astype(int) - half
    wide = cv2.copyMakeBorder(picture, half, half, half, half, cv2.BORDER_CONSTANT)
    tile = cv2.resize(
        wide[y0 + half : y0 + 3 * half + 1, x0 + half : x0 + 3 * half + 1],
        None,
        fx=scale,
        fy=scale,
        interpolation=cv2.INTER_NEAREST,
    )

    def at(point: np.ndarray) -> tuple[int, int]:
        return tuple(int(v) for v in (point - [x0, y0] + 0.5) * scale)

    middle, along = (
        np.array(found.point),
        np.array([np.cos(found.angle_rad), np.sin(found.angle_rad)]),
    )
    for side in (-0.5, 0.5):
        edge = middle + side * found.width_px * np.array([-along[1], along[0]])
        cv2.line(tile, at(edge - 8 * along), at(edge + 8 * along), (0, 255, 255), 1)
    cv2.circle(tile, at(middle), 3, (0, 0, 255), -1)
    return tile


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else None
    times = np.array(drawn_lines()) * 1e3
    print(
        f"one point: p50 {np.percentile(times, 50):.1f} ms, p95 {np.percentile(times, 95):.1f} ms of processor time"
    )
    rendered_fields()
    real_pictures(folder)


if __name__ == "__main__":
    cv2.setNumThreads(1)
    main()
