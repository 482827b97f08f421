"""The story of a client that openapi-python-client has made: upload, detect, wait, transform, export.

PYTHON python_story.py FOLDER URL TOKEN IMAGE      FOLDER: where the generated package `generated` lies
"""

import json
import sys
import time
from importlib import import_module
from pathlib import Path
from typing import Any

folder, url, token, image = sys.argv[1:]
sys.path.insert(0, folder)
models, types = import_module("generated.models"), import_module("generated.types")


def call(name: str, *values: Any, **more: Any) -> Any:
    """What the server answered; its problem, with the fix, as an error."""
    answer = import_module(f"generated.api.{name}").sync(*values, client=client, **more)
    if isinstance(answer, models.Problem):
        raise SystemExit(f"{answer.detail} {answer.fix}")
    return answer


with import_module("generated.client").AuthenticatedClient(base_url=url, token=token) as client:
    with Path(image).open("rb") as pixels:
        file = types.File(payload=pixels, file_name="field.png", mime_type="image/png")
        snapshot = call("snapshots.create_snapshot", body=models.CreateSnapshotFilesBody(file))
    job = call(
        "calibrations.detect_calibration",
        body=models.AutoRequest(snapshot=snapshot.id, field="ssl-div-b", region="full"),
    )
    while job.state in ("queued", "running"):
        time.sleep(0.1)
        job = call("jobs.read_job", job.id)
    id = job.result["calibration"]
    points = call(
        "using_a_calibration.transform_points",
        id,
        body=models.TransformRequest(
            from_=models.TransformRequestFrom.IMAGE,
            to=models.TransformRequestTo.FIELD,
            points=[[320.0, 240.0], [-90_000.0, 0.0]],
        ),
    ).points
    exported = call("calibrations.export_calibration", id, "opencv").payload.read()
    png = call("using_a_calibration.read_corrected_image", id, "png", width=320).payload.read()
    refusal = import_module("generated.api.calibrations.read_calibration").sync(
        "none", client=client
    )
print(
    json.dumps(
        {"points": points, "exported": exported.decode(), "png": len(png), "fix": refusal.fix}
    )
)
