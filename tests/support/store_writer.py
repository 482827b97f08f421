"""A process that saves without pause and says what was acknowledged, to be killed at any moment.

For each line `SEED` on standard input a forked child opens the store and works until it is killed; then a line `end`
follows. The child says `start PID`, before each call `begin CALL`, and after it `done CALL`, as JSON.
"""

import json
import os
import random
import sys
import tempfile
from hashlib import sha256
from pathlib import Path

from touchline.core.geometry import ImageSize
from touchline.core.records import Calibration
from touchline.store.snapshots import EMPTY
from touchline.store.store import Store

SIZE = ImageSize(640, 480)
CAMERAS = (None, "north", "south")


def calibration(camera, note):
    """As large as a real one: 500 clicks and a report about them."""
    points = [[k + 0.1, k / 3] for k in range(500)]
    return Calibration(
        id="",
        version=0,
        camera=camera,
        field={"name": "f"},
        region="full",
        rotate=0,
        model_name="m",
        model_parameters={},
        image_size=SIZE,
        corrected_size=SIZE,
        observations=({"feature": "left", "kind": "line", "points": points},),
        options={},
        report={"residuals": points},
        created_at="",
        software="0",
        note=note,
    )


def digest(kept):
    return sha256(
        json.dumps({**kept.to_json(), "active": False}, sort_keys=True).encode()
    ).hexdigest()


def say(*words):
    os.write(1, (" ".join(words) + "\n").encode())


def work(folder, seed):
    chance = random.Random(seed)
    store = Store(folder)
    snapshots = [s.id for s in store.snapshots.list(limit=20).items]
    kept = [c.id for c in store.calibrations.list(limit=20).items]
    say("start", str(os.getpid()))
    while True:
        kind = chance.choice(["snapshot", "draft", "draft", "save", "save", "activate", "delete"])
        tag = f"{seed}-{chance.getrandbits(40):x}"
        if kind == "snapshot" or not snapshots:
            data = chance.randbytes(chance.choice([100, 20_000, 1_000_000]))
            say("begin", json.dumps({"kind": "snapshot", "sha256": sha256(data).hexdigest()}))
            snapshot = store.snapshots.add(data, SIZE, "png", camera=tag)
            snapshots.append(snapshot.id)
            say(
                "done",
                json.dumps(
                    {
                        "kind": "snapshot",
                        "id": snapshot.id,
                        "sha256": snapshot.sha256,
                        "camera": tag,
                    }
                ),
            )
        elif kind == "draft":
            id = chance.choice(snapshots)
            body = {**EMPTY, "field": tag, "options": {f"o{k}": k / 7 for k in range(200)}}
            say("begin", json.dumps({"kind": "draft", "id": id, "field": tag}))
            draft = store.drafts.save(id, body, store.drafts.get(id).etag)
            say("done", json.dumps({"kind": "draft", "id": id, "field": tag, "etag": draft.etag}))
        elif kind == "save" or not kept:
            camera = chance.choice(CAMERAS)
            say("begin", json.dumps({"kind": "save"}))
            one = store.calibrations.add(calibration(camera, tag))
            kept.append(one.id)
            say(
                "done",
                json.dumps(
                    {
                        "kind": "save",
                        "id": one.id,
                        "camera": camera,
                        "version": one.version,
                        "sha256": digest(one),
                    }
                ),
            )
        elif kind == "activate":
            one = store.calibrations.get(chance.choice(kept))
            say("begin", json.dumps({"kind": "activate", "id": one.id, "camera": one.camera}))
            store.calibrations.activate(one.id)
            say("done", json.dumps({"kind": "activate", "id": one.id, "camera": one.camera}))
        else:
            one = store.calibrations.get(chance.choice(kept))
            if not one.active and len(kept) > 10:
                say("begin", json.dumps({"kind": "delete", "id": one.id}))
                store.calibrations.delete(one.id)
                kept.remove(one.id)
                say("done", json.dumps({"kind": "delete", "id": one.id}))


def main():
    folder = Path(sys.argv[1])
    with tempfile.TemporaryDirectory() as elsewhere, Store(Path(elsewhere)) as store:
        # What is imported on use is imported before the forks.
        store.calibrations.activate(store.calibrations.add(calibration(None, "")).id)
    for line in sys.stdin:
        child = os.fork()
        if child == 0:
            try:
                work(folder, int(line))
            finally:
                # a child ends by being killed; anything else is an error that its parent tells
                os._exit(1)
        _, status = os.waitpid(child, 0)
        say("end", str(os.waitstatus_to_exitcode(status)))


if __name__ == "__main__":
    main()
