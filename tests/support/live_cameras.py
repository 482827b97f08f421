"""Live cameras for tests: what their process must know, and a calibration of a simulated one."""

import sys
import threading
from concurrent.futures import Future
from contextlib import asynccontextmanager, contextmanager, suppress
from dataclasses import asdict

import numpy as np

from tests.support.sim_clicks import border_observations
from tests.support.simulated_source import simulated_source
from tests.support.waiting import LONG_S
from touchline.capabilities import camera_parts
from touchline.core.records import Calibration
from touchline.images import ImageLimits
from touchline.live.camera import LiveCamera
from touchline.live.capture import FrameCapture
from touchline.sources import SourceContext
from touchline.store.fields import load_fields
from touchline.workflows.calibration_request import CalibrationRequest

FIELDS = load_fields()
FIELD_JSON = {name: FIELDS[name].to_json() for name in ("table", "vsss-3v3", "ssl-div-b")}
SIM = "sim://table?size=320x256&fps=25&robots=2"


def spec(url: str, pictures=None, hosts=("127.0.0.1",)) -> dict:
    return {
        "source": url,
        "fields": FIELD_JSON,
        "pictures": str(pictures) if pictures else None,
        "hosts": list(hosts),
        "limits": asdict(ImageLimits()),
        "parts": list(camera_parts()),
    }


def pid_of(camera: LiveCamera) -> int | None:
    """The camera's process; None where none runs now."""
    process = camera._supervisor._process
    return process.pid if process else None


@asynccontextmanager
async def live(url: str, **around):
    """A camera that runs as long as the context lasts."""
    camera = LiveCamera("test", spec(url, **around))
    camera.start()
    try:
        yield camera
    finally:
        await camera.stop()


@contextmanager
def capturing(url: str):
    """A camera read on a thread of its own. In the product that ends with its process; here between two frames."""
    capture = FrameCapture(url, SourceContext(FIELDS))

    def run() -> None:
        with suppress(SystemExit):
            capture.run()

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    try:
        yield capture
    finally:
        with capture._changed:
            capture._actions.append((lambda source: sys.exit(), Future()))
            capture._wake()
        thread.join(LONG_S)


def calibrated(
    url: str, model: str = "polynomial", id: str = "made", region: str = "full"
) -> Calibration:
    """A calibration of a simulated camera, from exact points along its borders."""
    source = simulated_source(url, FIELDS)
    field = source.rendering.field
    covered = field.region(region)
    task = CalibrationRequest(
        observations=border_observations(source.camera, covered, 9, rng=np.random.default_rng(1)),
        field=field,
        region=covered,
        image_size=source.camera.image_size,
        model=model,
        options={},
        camera="test",
    )
    source.close()
    made = task.record(task.run(cross_validate=False))
    return Calibration.from_json({**made.to_json(), "id": id})
