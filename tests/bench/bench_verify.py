"""What the checks before an activation let through, on the second simulator. Command:

    python tests/bench/bench_verify.py FROM TO [MODEL]

Each scene goes through REST as the page does it: the picture is uploaded, lines are detected, the points are fitted
(MODEL: "auto", or a model on the detected borders alone, as an operator would click them), the version is saved and its
claims are tried. Beside the gate that they give stands the true error, rms over the region in sight, on the carpet and
at robot height, and what the version expects itself.
"""

import sys
import tempfile
from collections import defaultdict
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from starlette.testclient import TestClient

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests.support.refusals import API
from tests.support.rest_jobs import accepted, finished
from tests.support.second_simulator import Scene, render, scene_spec
from touchline.core.field import BORDERS
from touchline.evaluate.uncertainty import grid_over
from touchline.main import create_app
from touchline.models import RayModel, field_from_raw, model_from_json
from touchline.settings import Settings

LIMIT_MM = 7.5


def true_mm(made: dict[str, Any], scene: Scene) -> dict[str, float]:
    """Return the rms error on the carpet and at robot height; inf where the model does not reach, NaN without rays."""
    model = model_from_json(made["model"]["name"], made["model"]["parameters"])
    grid, region = grid_over(scene.region).reshape(-1, 2), scene.region
    whole = (
        np.ptp(region.x_mm) == scene.field.length_mm and np.ptp(region.y_mm) == scene.field.width_mm
    )
    found = {}
    for name, z_mm in (("carpet", 0.0), ("hat", scene.field.hat_height_mm)):
        pixels = scene.camera.project(np.column_stack([grid, np.full(len(grid), z_mm)]))
        seen = scene.camera.inside(pixels)
        if z_mm and not isinstance(model, RayModel):
            found[name] = np.nan
            continue
        there = model.unproject(pixels[seen], z_mm) if z_mm else field_from_raw(model, pixels[seen])
        off = [
            np.linalg.norm(turn * there - grid[seen], axis=1)
            for turn in ((1, -1) if whole else (1,))
        ]
        found[name] = min(
            float(np.sqrt(np.mean(np.where(np.isfinite(o), o, np.inf) ** 2))) for o in off
        )
    return found


def row(client: TestClient, seed: int, model: str) -> dict[str, Any]:
    scene = render(scene_spec(seed))
    data = cv2.imencode(".png", scene.pixels)[1].tobytes()
    picture = client.post(f"{API}/snapshots", files={"file": ("a.png", data)}).json()["id"]
    where = {
        "snapshot": picture,
        "field": scene.field.name,
        "region": scene.region.name,
        "rotate": scene.region.rotate_deg,
    }
    told = finished(
        client, accepted(client.post(f"{API}/calibrations/auto", json={**where, "keep": False}))
    )["result"]
    told = told.get("told", told)
    if told["verdict"]["level"] in ("unsure", "nothing"):
        return {"seed": seed, "gate": "declined"}
    points = [o for o in told["observations"] if model == "auto" or o["feature"] in BORDERS]
    made = client.post(
        f"{API}/calibrations", json={**where, "model": model, "observations": points}
    )
    if made.status_code != 201:
        return {"seed": seed, "gate": "refused"}
    made = made.json()
    claims = client.get(f"{API}/calibrations/{made['id']}/claims").json()
    sigma = made["report"]["sigma_mm"] or {}
    return {
        "seed": seed,
        "gate": claims["gate"],
        "model": made["model"]["name"],
        "not held": {c["code"]: c["state"] for c in claims["items"] if c["state"] != "held"},
        **true_mm(made, scene),
        "expected": sigma.get("rms", np.nan),
        "expected_hat": sigma.get("hat", {}).get("rms", np.nan),
    }


if __name__ == "__main__":
    first, last, chosen = (
        int(sys.argv[1]),
        int(sys.argv[2]),
        sys.argv[3] if len(sys.argv) > 3 else "auto",
    )
    by_gate: dict[str, list[dict[str, Any]]] = defaultdict(list)
    with (
        tempfile.TemporaryDirectory() as folder,
        TestClient(
            create_app(Settings(data=Path(folder))), base_url="http://127.0.0.1:8000"
        ) as served,
    ):
        for number in range(first, last):
            by_gate[(one := row(served, number, chosen))["gate"]].append(one)
            print(one, flush=True)
    for name, rows in by_gate.items():
        worst = [float(np.nanmax([r["carpet"], r["hat"]])) for r in rows if "carpet" in r]
        own = [
            float(np.nanmax([r["expected"], r["expected_hat"], LIMIT_MM]))
            for r in rows
            if "carpet" in r
        ]
        over = [r["seed"] for r, mm in zip(rows, worst, strict=False) if mm > LIMIT_MM]
        silent = [r["seed"] for r, mm, told in zip(rows, worst, own, strict=False) if mm > told]
        print(
            f"{name}: {len(rows)}"
            + (
                f"; median {np.median(worst):.1f}, worst {max(worst):.0f} mm; over {LIMIT_MM} "
                f"mm: {over}, and over their own expected error: {silent}"
                if worst
                else ""
            )
        )
