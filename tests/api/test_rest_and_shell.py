"""The two doors give the same numbers for the same clicks, to the last digit; and the demo is ready to calibrate."""

import io
import json
import sys

import cv2
import numpy as np
import pytest
from starlette.testclient import TestClient

from tests.support.refusals import API, without_size
from tests.support.sim_clicks import border_observations
from tests.support.tiers import long
from touchline.cli import main
from touchline.cli.server import DEMO_CAMERAS
from touchline.main import create_app
from touchline.settings import Settings
from touchline.sources import SourceContext, source_from_url
from touchline.store.fields import FieldRepository

PICTURES = {
    "ssl_2008_half": "fields/ssl_2008/ssl-field-2008.jpg",
    "unball_full": "fields/unball/unball_path1.png",
}


@pytest.mark.parametrize("name", ["ssl_2008_half", long("unball_full")])
def test_rest_and_shell_give_the_same_numbers_on_a_real_picture(
    client, clicks, real_data, tmp_path, monkeypatch, capsys, name
):
    image, task = real_data(PICTURES[name]), clicks(name)

    def touchline(*words, stdin=""):
        monkeypatch.setattr(sys, "argv", ["touchline", *map(str, words)])
        monkeypatch.setattr(sys, "stdin", io.StringIO(stdin))
        with pytest.raises(SystemExit) as ended:
            main()
        assert ended.value.code == 0
        return capsys.readouterr().out

    (tmp_path / "points.json").write_text(json.dumps(task))
    touchline("calibrate", image, "--points", tmp_path / "points.json", "-o", tmp_path / "cal.json")
    by_shell = json.loads((tmp_path / "cal.json").read_text())

    kept = client.post(f"{API}/snapshots", files={"file": image.read_bytes()}).json()
    by_rest = client.post(
        f"{API}/calibrations", json={**without_size(task), "snapshot": kept["id"]}
    ).json()
    same = (
        "model",
        "report",
        "observations",
        "corrected_size",
        "image_size",
        "image_sha256",
        "field_definition",
        "region",
        "rotate",
        "options",
        "software",
    )
    assert {key: by_rest[key] for key in same} == {key: by_shell[key] for key in same}

    pixels = np.random.default_rng(0).uniform(50, 450, (200, 2)).tolist()
    url = f"{API}/calibrations/{by_rest['id']}"
    rest = client.post(
        f"{url}/transform", json={"from": "image", "to": "field", "points": pixels}
    ).json()
    shell = touchline(
        "transform",
        "-c",
        tmp_path / "cal.json",
        "--from",
        "image",
        "--to",
        "field",
        "--json",
        stdin=json.dumps(pixels),
    )
    assert json.loads(shell) == rest

    touchline(
        "correct", image, "-c", tmp_path / "cal.json", "-o", tmp_path / "out.png", "--margin", 20
    )
    picture = client.get(f"{url}/corrected.png", params={"margin_px": 20}).content
    assert np.array_equal(
        cv2.imread(str(tmp_path / "out.png")), cv2.imdecode(np.frombuffer(picture, np.uint8), 1)
    )


@pytest.mark.parametrize("cameras", [DEMO_CAMERAS[-1:], long(DEMO_CAMERAS)], ids=["one", "all"])
def test_every_camera_of_the_demo_can_be_calibrated_on_its_region(tmp_path, cameras):
    fields = FieldRepository(tmp_path / "fields")
    settings = Settings(data=tmp_path, cameras=cameras)
    with TestClient(create_app(settings), base_url="http://127.0.0.1:8000") as client:
        for camera in settings.cameras:
            kept = client.post(f"{API}/snapshots", json={"camera": camera.id}).json()
            source = source_from_url(camera.source, SourceContext(fields))
            region = fields[camera.field].region(camera.region)
            seen = border_observations(source.camera, region, 12)
            body = {
                "camera": camera.id,
                "snapshot": kept["id"],
                "field": camera.field,
                "region": camera.region,
                "observations": [o.to_json() for o in seen],
            }
            made = client.post(f"{API}/calibrations", json=body)
            assert made.status_code == 201, made.text
            assert made.json()["report"]["rms_mm"] < 5
