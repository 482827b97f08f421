"""Clients that others' generators make of the OpenAPI document upload, calibrate, wait, transform and export.

In Python openapi-python-client, which must read all of it without a warning; in TypeScript openapi-typescript, whose
types the type checker holds the story to.
"""

import json
import shutil
import subprocess
from contextlib import closing
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.support.folder_pictures import camera, picture
from tests.support.installed import clean_environment, generator_python
from tests.support.node import node_path
from tests.support.npm import PACKAGES, WORK, install_packages
from tests.support.paths import TESTS
from tests.support.servers import Line, served
from tests.support.waiting import LONG_S

pytestmark = pytest.mark.long

STORIES = TESTS / "generated_clients"
TOKEN = "a secret of the hall"
POINT = [320.0, 240.0]
BYTES = (
    "image/png",
    "image/jpeg",
    "application/zip",
    "multipart/x-mixed-replace; boundary=touchline-frame",
)
NODE_TYPES = """declare module "node:fs/promises" {
  export function readFile(path: string): Promise<Uint8Array<ArrayBuffer>>;
}
declare const process: { argv: string[] };
"""


@pytest.fixture(scope="module")
def hall(tmp_path_factory):
    """A server with a token, its document, and an image of a field."""
    folder = tmp_path_factory.mktemp("hall")
    (folder / "touchline.yaml").write_text(f"token: {TOKEN}\n")
    with (
        served(folder / "data", "--config", str(folder / "touchline.yaml")) as url,
        closing(Line(url)) as line,
    ):
        status, _, document = line.json(
            "GET", "/openapi.json", headers={"Authorization": f"Bearer {TOKEN}"}
        )
        assert status == 200
        (folder / "openapi.json").write_text(json.dumps(document))
        yield SimpleNamespace(
            url=url, document=folder / "openapi.json", image=picture(folder / "field.png")
        )


def run(*words: Any, **more: Any) -> str:
    """Run a command that must succeed; return what it has printed."""
    done = subprocess.run(words, capture_output=True, text=True, timeout=LONG_S, **more)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def check_story(printed: str) -> None:
    """The first point lies where the camera has it, the other one is out of reach; files and the refusal's fix came."""
    story = json.loads(printed)
    assert np.abs(camera().raw_from_field(np.array([story["points"][0]])) - POINT).max() < 1.0
    assert story["points"][1] is None
    assert story["exported"].startswith("%YAML") and story["png"] > 1000 and story["fix"]


def test_a_generated_python_client_calibrates(hall, tmp_path):
    python = generator_python()
    settings = tmp_path / "settings.yaml"
    settings.write_text(
        json.dumps(
            {
                "content_type_overrides": dict.fromkeys(BYTES, "application/octet-stream"),
                "post_hooks": [],
            }
        )
    )
    run(
        python.with_name("openapi-python-client"),
        "generate",
        "--path",
        hall.document,
        "--output-path",
        tmp_path / "generated",
        "--meta",
        "none",
        "--config",
        settings,
        "--fail-on-warning",
        env=clean_environment(),
    )
    check_story(
        run(
            python,
            STORIES / "python_story.py",
            tmp_path,
            hall.url,
            TOKEN,
            hall.image,
            cwd=tmp_path,
            env=clean_environment(),
        )
    )


def test_a_generated_typescript_client_calibrates(hall):
    install_packages()
    folder = WORK / "generated_client"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    node = node_path()
    run(
        node,
        PACKAGES / "openapi-typescript" / "bin" / "cli.js",
        hall.document,
        "-o",
        folder / "rest.d.ts",
        "--default-non-nullable=false",
        cwd=WORK,
    )
    shutil.copyfile(STORIES / "typescript_story.ts", folder / "story.ts")
    (folder / "node.d.ts").write_text(NODE_TYPES)
    (folder / "package.json").write_text('{"type": "module"}')
    (folder / "tsconfig.json").write_text(
        json.dumps(
            {
                "files": ["node.d.ts", "story.ts"],
                "compilerOptions": {
                    "strict": True,
                    "noEmit": True,
                    "target": "esnext",
                    "module": "esnext",
                    "moduleResolution": "bundler",
                    "lib": ["esnext", "dom"],
                    "types": [],
                    "skipLibCheck": True,
                },
            }
        )
    )
    run(node, PACKAGES / "typescript-7" / "bin" / "tsc", "-p", folder)
    check_story(run(node, folder / "story.ts", hall.url, TOKEN, hall.image, cwd=folder))
