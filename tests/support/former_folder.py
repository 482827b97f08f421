"""A data folder as it was before there was a database: every record a file with its checksum."""

from hashlib import sha256

from app.store.quarantine import Quarantine
from app.store.records import Records

PICTURE = b"the bytes of a picture"
SNAPSHOT = {"id": "a" * 16, "width": 640, "height": 480, "camera": "north", "taken_at": "2026-01-01T00:00:00.000Z",
            "sha256": sha256(PICTURE).hexdigest(), "format": "png"}  # from before there were purposes
DRAFT = {"field": "ssl-2008", "region": "half-left", "rotate": None, "model": None, "options": {}, "observations":
         [{"feature": "left", "kind": "line", "points": [[1.25, 0.1 + 0.2]]}]}


def former_folder(folder, calibration):
    """Build it. calibration: (id, camera, version) → a Calibration."""
    quarantine = Quarantine(folder / "quarantine")

    def write(kind, name, record):
        Records(folder / kind, quarantine).write(name, record, kind)

    (folder / "pictures").mkdir(parents=True)
    (folder / "pictures" / f"{SNAPSHOT['sha256']}.png").write_bytes(PICTURE)
    write("snapshots", f"{3:010d}.{SNAPSHOT['id']}.json", SNAPSHOT)
    write("drafts", f"{SNAPSHOT['id']}.json", {"revision": 7, "updated_at": "2026-01-02T00:00:00.000Z", "draft": DRAFT})
    kept = [calibration(f"{number:016x}", camera, version)
            for number, (camera, version) in enumerate([("north", 1), ("north", 2), (None, 1), ("north", 3)], 1)]
    for sequence, one in enumerate(kept, 1):
        write("deleted" if sequence == 2 else "calibrations", name_of(sequence, one), one.to_json())
    write("active", "active.json", {"active": {key_of("north"): kept[3].id, key_of(None): kept[2].id}})
    lens = {"model": "brown-conrady", "lens": {"focal_px": 500}, "id": "b" * 16,
            "created_at": "2026-01-03T00:00:00.000Z"}
    write("lenses", f"{1:010d}.{lens['id']}.json", lens)
    write("cameras", "west.json", {"sequence": 2, "revision": 4, "updated_at": "2026-01-04T00:00:00.000Z",
                                   "camera": {"name": "West", "source": "sim://table"}})
    write("identities", "west.json", {"confirmed_at": "2026-01-05T00:00:00.000Z", "evidence": {"serial": "A1"}})
    return kept, lens


def key_of(camera):
    return sha256(b"" if camera is None else b"camera " + camera.encode()).hexdigest()[:12]


def name_of(sequence, one):
    return f"{sequence:010d}.{key_of(one.camera)}.{one.version:06d}.{one.id}.json"
