"""What the page computes by itself is what the server answers, and what it sends of a field is what it was told."""

import base64
import json

import numpy as np
import pytest

from tests.support.demo_cameras import CAMERAS, HEIGHT, WIDTH
from tests.support.live_cameras import FIELDS
from tests.support.node import run_node
from tests.support.refusals import API
from tests.support.sim_clicks import border_observations
from touchline.sources import SourceContext, source_from_url

CURVE = """import { curveThrough } from "./static/features/calibrate/live_curve.js";
import { readFileSync } from "node:fs";
const { curve, points, run } = JSON.parse(readFileSync(0, "utf8"));
console.log(JSON.stringify(curveThrough(curve, points, run)));"""
MESH = """import { bentMesh } from "./static/features/calibrate/live_mesh.js";
import { readFileSync } from "node:fs";
const { mesh, model, points } = JSON.parse(readFileSync(0, "utf8"));
const nodes = new Float32Array(Uint8Array.from(atob(mesh.raw_px), (letter) => letter.charCodeAt(0)).buffer);
console.log(JSON.stringify([...bentMesh({ ...mesh, nodes }, model, points).nodes]));"""

FIELDS_SENT = """import { docOf, sentOf } from "./static/features/fields/document.js";
import { readFileSync } from "node:fs";
const { fields } = JSON.parse(readFileSync(0, "utf8"));
console.log(JSON.stringify(fields.map((field) => sentOf(docOf(field)))));"""


def by_page(script: str, **given):
    """What a script of the page's modules makes of its input."""
    done = run_node("--input-type=module", "--eval", script, given=json.dumps(given))
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def observations() -> list[dict]:
    """The borders of the demo's first camera, clicked by a hand."""
    camera = source_from_url(CAMERAS[0]["source"], SourceContext(FIELDS)).camera
    region = FIELDS[CAMERAS[0]["field"]].region(CAMERAS[0]["region"])
    return [o.to_json() for o in border_observations(camera, region, 9, 0.3)]


@pytest.mark.parametrize(("border", "axis", "run"), [("left", "x_of_y", 1), ("top", "y_of_x", 0)])
def test_a_borders_curve_bends_to_a_point_as_the_server_does(
    standing, observations, border, axis, run
):
    points = next(o["points"] for o in observations if o["feature"] == border)

    def told(points, degree) -> dict:
        return standing.post(
            f"{API}/fit/border",
            json={"axis": axis, "image_size": [WIDTH, HEIGHT], "points": points, "degree": degree},
        ).json()

    before = told(points, 3)
    moved = [
        [x + 1.2 * (i == 2) * run, y + 1.2 * (i == 2) * (1 - run)]
        for i, (x, y) in enumerate(points)
    ]
    want, got = told(moved, 3), by_page(CURVE, curve=before, points=moved, run=run)
    assert (
        want["outliers"] == [] and np.abs(np.subtract(want["curve"], before["curve"])).max() > 0.2
    )
    np.testing.assert_allclose(got["curve"], want["curve"], atol=1e-6)
    np.testing.assert_allclose(got["residuals_px"], want["residuals_px"], atol=1e-6)
    assert got["rms_px"] == pytest.approx(want["rms_px"], abs=1e-6)


def test_the_papers_correction_bends_as_the_server_does(standing, observations):
    def told(observations) -> dict:
        return standing.post(
            f"{API}/fit/preview",
            params={"quick": True, "mesh_margin_px": 40},
            json={
                "field": CAMERAS[0]["field"],
                "region": CAMERAS[0]["region"],
                "image_size": [WIDTH, HEIGHT],
                "model": "polynomial",
                "options": {"degree": 3},
                "observations": observations,
            },
        ).json()

    before = told(observations)
    moved = [
        {
            **o,
            "points": [
                [x + 1.5 * (i == 3), y - 2 * (i == 4)] for i, (x, y) in enumerate(o["points"])
            ],
        }
        for o in observations
    ]
    after = told(moved)
    assert not any(r["outlier"] for f in after["report"]["per_feature"] for r in f["residuals"])
    want, was = (
        np.frombuffer(base64.b64decode(it["mesh"]["raw_px"]), "<f4") for it in (after, before)
    )
    got = by_page(
        MESH,
        mesh=after["mesh"],
        model=before["model"]["parameters"],
        points={o["feature"]: o["points"] for o in moved},
    )
    assert want.shape != was.shape or np.abs(want - was).max() > 0.5  # it was bent at all
    np.testing.assert_allclose(np.array(got, float), want, atol=2e-3)


def test_every_field_that_comes_with_touchline_passes_through_the_editor_unchanged(client):
    told = client.get(f"{API}/fields").json()["items"]
    assert len(told) >= 6
    for field, sent in zip(told, by_page(FIELDS_SENT, fields=told), strict=True):
        name = f"{field['name']}-again"
        kept = client.put(f"{API}/fields/{name}", json={**sent, "name": name})
        assert kept.is_success, kept.text
        made, shipped = (
            client.get(f"{API}/fields/{one}/export/json").text for one in (name, field["name"])
        )
        assert made.replace(f'"name": "{name}"', f'"name": "{field["name"]}"') == shipped
