"""Writes what a version of Touchline stores, for the tests of later versions to open.

    python tests/golden/former_version/make.py CHECKOUT      CHECKOUT: of the version that writes

data.zip     a data folder with everything in it, a finished job and one that waits for its turn
archive.zip  an archive of it
answers.json what that version's REST interface answered: {"queued": id of the waiting job, "answers": {path: JSON}}
"""

import json
import sys
import zipfile
from pathlib import Path
from tempfile import TemporaryDirectory

CHECKOUT = Path(sys.argv[1]).resolve()
sys.path.insert(0, str(CHECKOUT / "app"))

import numpy as np  # noqa: E402
from fastapi.testclient import TestClient  # noqa: E402

from touchline.images import encode  # noqa: E402
from touchline.main import create_app  # noqa: E402
from touchline.settings import Settings  # noqa: E402

HERE = Path(__file__).parent
API = "/api/v1"
CLICKS = json.loads((HERE.parents[1] / "clicks" / "ssl_2008_half.json").read_text())
TRACK = [[100.0 + 20 * k, 200.0 + 5 * k + 0.01 * k * k] for k in range(20)]
COLOURS = {"name": "hall", "colours": {"orange": [{"rgb": [250, 112, 30]}]}}
CAMERA = {
    "id": "west",
    "name": "West",
    "source": "sim://ssl-2008?region=half",
    "field": "ssl-2008",
    "region": "half",
}


def main() -> None:
    size = CLICKS["image_size"]
    task = {name: CLICKS[name] for name in ("field", "region", "observations")}
    with TemporaryDirectory() as place:
        settings = Settings(data=Path(place))
        with TestClient(create_app(settings), base_url="http://127.0.0.1:8000") as client:

            def send(method: str, path: str, body: object = None, **headers: str) -> dict:
                answer = client.request(
                    method, API + path, json=body, headers={"X-Operator": "ann", **headers}
                )
                assert answer.status_code < 300, answer.text
                return answer.json() if answer.content else {}

            store = client.app.state.store
            send("POST", "/cameras", CAMERA)
            picture = np.zeros((size[1], size[0], 3), np.uint8)
            picture[::40] = 90
            file = {"file": ("picture.png", encode(picture, "png"), "image/png")}
            taken = client.post(f"{API}/snapshots", files=file, data={"camera": "west"}).json()
            draft = {
                "field": "ssl-2008",
                "region": "half",
                "rotate": None,
                "model": "division",
                "options": {},
                "observations": task["observations"][:2],
            }
            etag = client.get(f"{API}/drafts/{taken['id']}").headers["etag"]
            send("PUT", f"/drafts/{taken['id']}", draft, **{"If-Match": etag})
            made = [
                send("POST", "/calibrations", {**task, "snapshot": taken["id"], "model": model})[
                    "id"
                ]
                for model in ("polynomial", "homography", "homography")
            ]
            for id in made[:2]:
                send("POST", f"/calibrations/{id}/activate")
            send("PATCH", f"/calibrations/{made[0]}", {"note": "before the lens was knocked"})
            send("DELETE", f"/calibrations/{made[2]}")
            store.identities.confirm(made[1], {"address": CAMERA["source"], "serial": "A1"}, "ann")
            store.lenses.add(
                {"model": "brown-conrady", "lens": {"focal_px": 500.5}, "snapshots": [taken["id"]]}
            )
            store.rolls.add(
                "west",
                "ab" * 8,
                {
                    "at": 12.5,
                    "seconds": 1.5,
                    "points": TRACK,
                    "rms_px": 0.25,
                    "straight_px": 0.5,
                    "image_size": size,
                },
            )
            send("PUT", "/rigs/hall", {"field": "ssl-2008", "cameras": [{"camera": "west"}]})
            send("PUT", "/colours/hall", {"profile": COLOURS})
            send(
                "PUT", "/fields/own", {**client.get(f"{API}/fields/ssl-2008").json(), "name": "own"}
            )
            done = send("POST", "/calibrations?job=true", {**task, "snapshot": taken["id"]})["id"]
            while client.get(f"{API}/jobs/{done}").json()["state"] in ("queued", "running"):
                pass
            paths = [
                "/snapshots",
                f"/drafts/{taken['id']}",
                "/calibrations/activations?camera=west",
                *(f"/calibrations/{id}" for id in made[:2]),
                "/cameras/west",
                "/cameras/west/rolls",
                "/rigs/hall",
                "/colours",
                "/fields/own",
                "/jobs",
            ]
            answers = {path: send("GET", path) for path in paths}
            (HERE / "archive.zip").write_bytes(client.get(f"{API}/archive").content)
            first = store.jobs.get(done)
            queued = store.jobs.add(first.kind, first.spec).id
        with zipfile.ZipFile(HERE / "data.zip", "w", zipfile.ZIP_DEFLATED, compresslevel=9) as out:
            for path in sorted(Path(place).rglob("*")):
                if path.is_file() and path.name != "lock" and path.parent.name != "backups":
                    out.write(path, path.relative_to(place))
    text = json.dumps(
        {"queued": queued, "deleted": made[2], "answers": answers}, ensure_ascii=False
    )
    (HERE / "answers.json").write_text(text + "\n")


if __name__ == "__main__":
    main()
