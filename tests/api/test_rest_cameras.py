"""Cameras over REST: added, changed, tried, watched; passwords and wrong calibrations stay where they are."""

import base64
import contextlib
import io
import json
import sqlite3
import struct
import time
import zipfile

import cv2
import numpy as np
import pytest
from starlette.testclient import TestClient

from tests.support.activation import activate_despite
from tests.support.mjpeg_camera import MjpegCamera
from tests.support.paths import CLICKS
from tests.support.pictures import encoded
from tests.support.refusals import API, refusal
from tests.support.waiting import until
from touchline.api.routes import streams
from touchline.main import create_app
from touchline.settings import Settings, SourceSettings
from touchline.store.cameras import FILE
from touchline.store.store import Store

CAMERAS = (
    {
        "id": "north",
        "name": "North half",
        "source": "sim://table?size=320x256&fps=200",
        "field": "table",
        "region": "full",
    },
)
SOUTH = {
    "id": "south",
    "name": "South half",
    "source": "sim://table?size=320x256&seed=4",
    "field": "table",
    "region": "full",
}


def pixels_of(data) -> np.ndarray:
    return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)


def status_of(client, id="north"):
    return client.get(f"{API}/cameras/{id}/status").json()


def watched(client, path):
    """A WebSocket; starlette's client names another host unless told."""
    return client.websocket_connect(f"{API}/{path}", headers={"host": "127.0.0.1:8000"})


def alive(client, id="north"):
    return until(lambda: (s := status_of(client, id))["state"] == "live" and s)


@pytest.fixture
def shared(standing):
    """The server of all tests of this file; the camera that a test adds is gone afterwards."""
    yield standing
    standing.delete(f"{API}/cameras/south")


@pytest.fixture(scope="module")
def in_use(tmp_path_factory):
    """Another server, whose camera has an active version that is applied to its frames: its client, that version."""
    settings = Settings(data=tmp_path_factory.mktemp("data"), cameras=CAMERAS)
    with TestClient(create_app(settings), base_url="http://127.0.0.1:8000") as client:
        yield client, activated(client)


def activated(client, id="north"):
    """A version that the camera's frames are corrected with."""
    made = calibrated(client, id)
    activate_despite(client, made["id"])
    until(lambda: status_of(client, id)["calibration_applied"])
    return made


def calibrated(client, id="north"):
    alive(client, id)
    snapshot = client.post(f"{API}/snapshots", json={"camera": id}).json()
    task = json.loads((CLICKS / "ssl_2008_half.json").read_text())
    task |= {"snapshot": snapshot["id"], "camera": id, "model": "homography", "options": {}}
    task.pop("image_size", None)
    task["observations"] = [
        {**o, "points": [[x * 0.2 + 20, y * 0.2 + 20] for x, y in o["points"]]}
        for o in task["observations"]
    ]
    answer = client.post(f"{API}/calibrations", json=task)
    assert answer.status_code == 201, answer.text
    return answer.json()


def test_a_camera_is_added_changed_and_removed(shared):
    added = shared.post(f"{API}/cameras", json=SOUTH)
    assert added.status_code == 201 and added.headers["location"] == f"{API}/cameras/south"
    told = added.json()
    assert told.pop("updated_at") and told.pop("updated_by") == "testclient"
    assert told == {**SOUTH, "editable": True, "active_calibration": None, "active": None}
    assert [camera["id"] for camera in shared.get(f"{API}/cameras").json()["items"]] == [
        "north",
        "south",
    ]
    etag = shared.get(f"{API}/cameras/south").headers["etag"]
    changed = shared.patch(
        f"{API}/cameras/south", json={"name": "South"}, headers={"If-Match": etag}
    )
    assert changed.status_code == 200 and changed.json() == {
        **added.json(),
        "name": "South",
        "updated_at": changed.json()["updated_at"],
    }
    assert changed.headers["etag"] != etag
    stale = shared.patch(
        f"{API}/cameras/south", json={"name": "slower"}, headers={"If-Match": etag}
    )
    assert refusal(stale, 412, "stale-camera")["current"]["name"] == "South"
    refusal(shared.patch(f"{API}/cameras/south", json={"name": "x"}), 428)
    refusal(shared.delete(f"{API}/cameras/south", headers={"If-Match": etag}), 412)
    assert (
        shared.delete(
            f"{API}/cameras/south", headers={"If-Match": changed.headers["etag"]}
        ).status_code
        == 204
    )
    refusal(shared.get(f"{API}/cameras/south"), 404, "unknown-camera")
    refusal(shared.get(f"{API}/cameras/south/status"), 404, "unknown-camera")


def test_added_cameras_are_there_after_a_restart(settings):
    with TestClient(create_app(settings), base_url="http://127.0.0.1:8000") as client:
        client.post(f"{API}/cameras", json=SOUTH)
    with TestClient(create_app(settings), base_url="http://127.0.0.1:8000") as client:
        assert client.get(f"{API}/cameras/south").json()["name"] == "South half"
        assert alive(client, "south")["width"] == 320


def test_a_changed_source_is_shown_at_once(shared):
    shared.post(f"{API}/cameras", json=SOUTH)
    assert alive(shared, "south")["width"] == 320
    etag = shared.get(f"{API}/cameras/south").headers["etag"]
    shared.patch(
        f"{API}/cameras/south",
        json={"source": "sim://table?size=160x128"},
        headers={"If-Match": etag},
    )
    until(lambda: status_of(shared, "south")["width"] == 160)


def test_all_statuses_come_at_once_and_wake_nobody(shared):
    shared.post(f"{API}/cameras", json=SOUTH)
    north = alive(shared)
    for _ in range(2):  # the first call has not started what the second one would then show
        listed = {
            status["id"]: status for status in shared.get(f"{API}/cameras/status").json()["items"]
        }
        assert list(listed) == ["north", "south"]
        assert listed["north"].keys() == {"id", *north} and listed["north"]["state"] == "live"
        assert listed["south"]["state"] == "idle" and listed["south"]["frame_age_s"] is None
    alive(shared, "south")
    assert shared.get(f"{API}/cameras/status").json()["items"][1]["state"] == "live"


def test_a_calibrated_camera_runs_though_nobody_looks_at_it(in_use, task):
    client, _ = in_use

    def state():
        return {
            one["id"]: one["state"] for one in client.get(f"{API}/cameras/status").json()["items"]
        }["unseen"]

    client.post(f"{API}/cameras", json={**SOUTH, "id": "unseen"})
    made = client.post(
        f"{API}/calibrations", json={**task, "camera": "unseen", "model": "homography"}
    ).json()
    assert state() == "idle"
    activate_despite(client, made["id"])
    until(state, lambda now: now == "mismatch")  # its version is of another size
    etag = client.get(f"{API}/cameras/unseen").headers["etag"]
    client.patch(
        f"{API}/cameras/unseen",
        json={"source": "sim://table?size=780x580"},
        headers={"If-Match": etag},
    )
    until(state, lambda now: now == "live")
    client.delete(f"{API}/cameras/unseen")


def test_passwords_in_addresses_are_never_told(shared):
    secret = {**SOUTH, "source": "rtsp://operator:s3cret@10.255.255.1:554/live"}
    answers = [
        shared.post(f"{API}/cameras", json=secret),
        shared.get(f"{API}/cameras"),
        shared.get(f"{API}/cameras/south"),
        shared.get(f"{API}/cameras/south/status"),
    ]
    assert all(answer.status_code < 300 for answer in answers)
    assert "operator@10.255.255.1" in answers[0].text
    slower = shared.patch(f"{API}/cameras/south", json={"name": "x"}, headers={"If-Match": "0-0"})
    refusal(slower, 412, "stale-camera")
    assert all("s3cret" not in answer.text for answer in (*answers, slower))


@pytest.mark.parametrize(
    ("asked", "has"), [("", False), ("?passwords=0", False), ("?passwords=1", True)]
)
def test_passwords_are_in_an_archive_only_where_they_are_asked_for(shared, asked, has):
    shared.post(
        f"{API}/cameras", json={**SOUTH, "source": "rtsp://operator:s3cret@10.255.255.1:554/live"}
    )
    with zipfile.ZipFile(io.BytesIO(shared.get(f"{API}/archive{asked}").content)) as found:
        assert (b"s3cret" in found.read("tables/cameras.jsonl")) is has


def test_a_camera_that_has_lost_its_password_is_told_with_what_to_do(tmp_path):
    with Store(tmp_path / "data") as store:
        store.cameras.add(
            "south",
            {
                "name": "",
                "source": "rtsp://operator:s3cret@127.0.0.1:1/",
                "field": None,
                "region": None,
            },
        )
    (tmp_path / "data" / FILE).unlink()
    with TestClient(
        create_app(Settings(data=tmp_path / "data")), base_url="http://127.0.0.1:8000"
    ) as client:
        told = {one["reason"]: one for one in client.get(f"{API}/health").json()["warnings"]}
        lost = told["camera-password-missing"]
        assert "south" in lost["text"] and set(lost["statements"]) == {"text", "fix"}
        shown = client.get(f"{API}/cameras/south")
        assert shown.json()["source"] == "rtsp://operator@127.0.0.1:1/"
        client.patch(
            f"{API}/cameras/south",
            json={"source": "rtsp://operator:s3cret@127.0.0.1:1/"},
            headers={"If-Match": shown.headers["etag"]},
        )
        reasons = [one["reason"] for one in client.get(f"{API}/health").json()["warnings"]]
    assert "camera-password-missing" not in reasons


def test_the_settings_own_cameras_are_changed_there(shared):
    assert shared.get(f"{API}/cameras/north").json()["editable"] is False
    refusal(
        shared.patch(f"{API}/cameras/north", json={"name": "x"}, headers={"If-Match": "1"}),
        409,
        "camera-in-settings",
    )
    refusal(shared.delete(f"{API}/cameras/north"), 409, "camera-in-settings")
    refusal(shared.post(f"{API}/cameras", json={**SOUTH, "id": "north"}), 409, "camera-exists")


@pytest.mark.parametrize(
    ("changes", "status"),
    [
        ({"source": "carrier-pigeon://coop"}, 404),
        ({"source": "sim://table?wings=2"}, 422),
        ({"source": "nonsense"}, 422),
        ({"source": ""}, 422),
        ({"source": "sim://table?fps=nan"}, 422),
        ({"id": "../etc"}, 422),
        ({"id": ""}, 422),
        ({"field": "moon"}, 404),
        ({"region": "nowhere"}, 404),
        ({"more": 1}, 422),
        ({"source": None}, 422),
        ({"source": "file:///etc/passwd"}, 404),
        ({"name": "x" * 200}, 422),
        ({"field": "a\x05b"}, 422),
        ({"region": "../full"}, 422),
    ],
)
def test_a_camera_that_can_never_be_is_refused_and_not_kept(shared, changes, status):
    refusal(shared.post(f"{API}/cameras", json={**SOUTH, **changes}), status)
    assert len(shared.get(f"{API}/cameras").json()["items"]) == 1


def test_a_source_is_tried_before_it_is_kept(shared):
    answer = shared.post(f"{API}/cameras/test", json={"source": SOUTH["source"]})
    tried = answer.json()
    assert answer.status_code == 200 and (tried["width"], tried["height"]) == (320, 256)
    picture = pixels_of(base64.b64decode(tried["picture"].partition(",")[2]))
    assert (
        picture.shape == (256, 320, 3)
        and picture.std() > 5
        and tried["identity"]["address"].startswith("sim://table")
    )
    assert len(shared.get(f"{API}/cameras").json()["items"]) == 1
    refusal(
        shared.post(f"{API}/cameras/test", json={"source": "picture://none.png"}),
        404,
        "unknown-picture",
    )
    refusal(shared.post(f"{API}/cameras/test", json={"source": "sim://moon"}), 404, "unknown-field")


def test_the_kinds_of_source_are_listed_with_their_options(shared):
    kinds = {kind["scheme"]: kind for kind in shared.get(f"{API}/cameras/sources").json()["items"]}
    assert {"sim", "picture"} <= set(kinds)
    assert any(option["name"] == "lens" and option["choices"] for option in kinds["sim"]["options"])


def test_a_frame_is_shown_as_jpeg_and_exactly_as_png(shared):
    alive(shared)
    jpeg = shared.get(f"{API}/cameras/north/frame.jpg", params={"width": 160})
    assert jpeg.status_code == 200 and pixels_of(jpeg.content).shape == (128, 160, 3)
    assert (
        int(jpeg.headers["x-frame-seq"]) > 0
        and abs(float(jpeg.headers["x-frame-time"]) - time.time()) < 60
    )
    png = shared.get(f"{API}/cameras/north/frame.png")
    assert png.headers["content-type"] == "image/png" and pixels_of(png.content).shape == (
        256,
        320,
        3,
    )
    assert png.headers["cache-control"] == "no-store"
    for params in ({"view": "upside"}, {"width": 5}, {"quality": 0}, {"width": 1e9}):
        refusal(shared.get(f"{API}/cameras/north/frame.jpg", params=params), 422)
    refusal(shared.get(f"{API}/cameras/north/frame.png", params={"view": "side"}), 422)


def test_the_corrected_view_comes_with_the_active_calibration(in_use):
    client, made = in_use
    assert status_of(client)["active_calibration"] == made["id"]
    shown = client.get(f"{API}/cameras/north/frame.jpg", params={"view": "corrected", "width": 320})
    assert shown.status_code == 200 and pixels_of(shown.content).shape[1] == 320
    exact = client.get(f"{API}/cameras/north/frame.png", params={"view": "corrected"})
    assert list(pixels_of(exact.content).shape[1::-1]) == made["corrected_size"]


def test_a_camera_says_how_good_its_active_version_is(in_use, task):
    client, made = in_use
    client.post(f"{API}/cameras", json={**SOUTH, "id": "judged"})
    data = {**client.get(f"{API}/calibrations/{made['id']}/export/json").json(), "camera": "judged"}
    imported = {**data, "report": {"verdict": "splendid", "sigma_mm": {"rms": "small"}}}
    rays = client.post(
        f"{API}/calibrations", json={**task, "camera": "judged", "model": "brown-conrady"}
    ).json()
    strange = client.post(
        f"{API}/calibrations/import", files={"file": json.dumps(imported).encode()}
    ).json()
    for made in (rays, strange):
        activate_despite(client, made["id"])
        camera = client.get(f"{API}/cameras/judged").json()
        assert camera in client.get(f"{API}/cameras").json()["items"]
        shown = camera["active"]
        assert (shown["id"], shown["version"], shown["created_at"]) == (
            made["id"],
            made["version"],
            made["created_at"],
        )
        assert shown["model"] == made["model"]["name"] and shown["verdict"] == (
            made["report"]["verdict"] or {}
        )
        sigma = made["report"]["sigma_mm"]
        figures = (
            [sigma["rms"], *(sigma["hat"][name] for name in ("rms", "z_mm"))]
            if made is rays
            else [None] * 3
        )
        assert [
            shown[name] for name in ("expected_mm", "expected_hat_mm", "hat_height_mm")
        ] == figures


def test_a_calibration_stays_with_the_camera_whose_picture_it_was_made_on(in_use):
    client, _ = in_use
    client.post(f"{API}/cameras", json={**SOUTH, "id": "moved"})
    activated(client, "moved")
    etag = client.get(f"{API}/cameras/moved").headers["etag"]
    client.patch(
        f"{API}/cameras/moved",
        json={"source": "sim://vsss-3v3?size=320x256"},
        headers={"If-Match": etag},
    )
    wrong = until(lambda: (s := status_of(client, "moved"))["state"] == "mismatch" and s)
    assert wrong["problem"]["reason"] == "other-camera" and not wrong["calibration_applied"]
    refusal(
        client.get(f"{API}/cameras/moved/frame.jpg", params={"view": "corrected"}),
        409,
        "other-camera",
    )
    assert client.post(f"{API}/cameras/moved/confirm").status_code == 200
    until(lambda: (s := status_of(client, "moved"))["calibration_applied"] and s["state"] == "live")


@pytest.mark.long
def test_it_stays_with_that_camera_after_a_restart(settings):
    with TestClient(create_app(settings), base_url="http://127.0.0.1:8000") as client:
        activated(client)
    other = {**settings.cameras[0].model_dump(), "source": "sim://vsss-3v3?size=320x256&fps=200"}
    with TestClient(
        create_app(settings.model_copy(update={"cameras": (type(settings.cameras[0])(**other),)})),
        base_url="http://127.0.0.1:8000",
    ) as client:
        wrong = until(lambda: (s := status_of(client))["state"] == "mismatch" and s)
        assert wrong["problem"]["reason"] == "other-camera" and not wrong["calibration_applied"]


def test_who_added_changed_and_confirmed_a_camera_is_kept(in_use):
    client, made = in_use
    asked = f"{API}/cameras/kept"
    added = client.post(
        f"{API}/cameras", json={**SOUTH, "id": "kept"}, headers={"X-Operator": "Ada"}
    )
    assert added.json()["updated_by"] == "Ada"
    first = client.get(asked)
    assert first.json()["updated_by"] == "Ada"
    seen = {"If-Match": first.headers["etag"], "X-Operator": "Bo"}
    changed = client.patch(asked, json={"name": "South"}, headers=seen)
    assert (
        changed.json()["updated_by"] == "Bo"
        and changed.json()["updated_at"] >= first.json()["updated_at"]
    )
    settled = client.get(f"{API}/cameras/north").json()
    assert settled["updated_by"] is None and settled["updated_at"] is None
    assert (
        client.post(f"{API}/cameras/north/confirm", headers={"X-Operator": "Cy"}).status_code == 200
    )
    with sqlite3.connect(next(client.app.state.services.settings.data.glob("*.db"))) as rows:
        (body,) = rows.execute(
            "SELECT body FROM identities WHERE camera = ?", (made["id"],)
        ).fetchone()
    rows.close()
    assert json.loads(body)["confirmed_by"] == "Cy"


def test_a_file_that_is_imported_says_who_brought_it(in_use):
    client, made = in_use
    data = client.get(f"{API}/calibrations/{made['id']}/export/json").content
    brought = client.post(
        f"{API}/calibrations/import",
        files={"file": ("c.json", data)},
        headers={"X-Operator": "Ada"},
    )
    assert brought.json()["made_by"] == "Ada"


def test_without_a_calibration_nothing_is_corrected_or_confirmed(shared):
    alive(shared)
    refusal(
        shared.get(f"{API}/cameras/north/frame.jpg", params={"view": "corrected"}),
        409,
        "not-calibrated",
    )
    refusal(shared.post(f"{API}/cameras/north/confirm"), 409, "not-calibrated")


def test_a_websocket_sends_a_message_a_frame(shared):
    with watched(shared, "cameras/north/stream?view=raw&width=160&fps=50&ack=true") as socket:
        seen = []
        for _ in range(5):
            message = socket.receive_bytes()
            socket.send_text("")
            (length,) = struct.unpack_from("<I", message)
            head = json.loads(message[4 : 4 + length])
            assert pixels_of(message[4 + length :]).shape == (128, 160, 3)
            seen.append(head["seq"])
    assert seen == sorted(set(seen))
    until(lambda: status_of(shared)["viewers"] == 0)


@pytest.mark.parametrize(
    ("path", "reason"),
    [
        ("cameras/nobody/stream", "unknown-camera"),
        ("cameras/north/stream?view=corrected", "not-calibrated"),
        ("cameras/north/stream?view=x", "unknown-view"),
        ("cameras/north/stream?width=5", "bad-width"),
        ("cameras/north/stream?fps=nan", "bad-fps"),
        ("cameras/north/stream?fps=-1", "bad-fps"),
        ("cameras/north/stream?quality=0", "bad-quality"),
    ],
)
def test_a_websocket_that_cannot_be_served_says_why(shared, path, reason):
    with watched(shared, path) as socket:
        told = json.loads(socket.receive_text())
        assert told["type"].endswith(reason) and told["fix"] and 400 <= told["status"] < 500
        assert socket.receive()["type"] == "websocket.close"


def test_a_stream_ends_when_its_camera_is_removed(shared):
    shared.post(f"{API}/cameras", json=SOUTH)
    with watched(shared, "cameras/south/stream?width=160") as socket:
        socket.receive_bytes()
        assert shared.delete(f"{API}/cameras/south").status_code == 204
        while (message := socket.receive())["type"] == "websocket.send":
            last = message
    assert json.loads(last["text"])["type"].endswith("camera-gone")


def test_a_dead_camera_hides_no_other_and_says_what_to_do(shared):
    shared.post(f"{API}/cameras", json={**SOUTH, "source": "picture://gone.png"})
    told = until(lambda: (s := status_of(shared, "south"))["state"] == "offline" and s)
    assert told["problem"]["reason"] == "unknown-picture" and told["problem"]["fix"]
    start = time.monotonic()
    for answer in (
        shared.get(f"{API}/cameras/south/frame.jpg"),
        shared.post(f"{API}/snapshots", json={"camera": "south"}),
    ):
        assert (
            answer.status_code == 503
            and answer.json()["type"].endswith("unknown-picture")
            and answer.json()["fix"]
        )
    assert time.monotonic() - start < 20
    assert alive(shared)["problem"] is None


@pytest.mark.parametrize(
    "fails",
    [MjpegCamera.close, lambda camera: setattr(camera, "stalled", True)],
    ids=["offline", "stalled"],
)
def test_the_last_frame_of_a_camera_that_delivers_none_is_shown_only_if_asked_for(
    tmp_path, monkeypatch, fails
):
    monkeypatch.setattr(streams, "FIRST_FRAME_S", 0.2)
    with contextlib.closing(MjpegCamera()) as camera:
        settings = Settings(
            data=tmp_path,
            cameras=({**SOUTH, "source": camera.url},),
            sources=SourceSettings(allowed_hosts=("127.0.0.1",)),
        )
        with TestClient(create_app(settings), base_url="http://127.0.0.1:8000") as client:
            alive(client, "south")
            with watched(client, "cameras/south/stream") as socket:  # somebody has it on the screen
                socket.receive_bytes()
                fails(camera)
                until(lambda: status_of(client, "south")["state"] not in ("live", "mismatch"))
                answer = client.get(f"{API}/cameras/south/frame.jpg?quality=80")
                assert answer.status_code == 503 and answer.json()["fix"]
                last = client.get(f"{API}/cameras/south/frame.jpg?quality=80&stale=1")
                assert last.status_code == 200 and pixels_of(last.content).shape == (240, 320, 3)


def test_uploads_are_still_pictures_of_a_camera_that_was_added(shared):
    shared.post(f"{API}/cameras", json=SOUTH)
    kept = shared.post(
        f"{API}/snapshots", files={"file": encoded("png")}, data={"camera": "south"}
    ).json()
    assert kept["camera"] == "south"


def test_a_picture_of_many_frames_is_without_what_moves(shared):
    shared.post(
        f"{API}/cameras",
        json={**SOUTH, "source": "sim://table?size=320x256&fps=30&robots=8&speed=2500&noise=4"},
    )
    alive(shared, "south")
    one, many = (
        pixels_of(
            shared.get(
                f"{API}/snapshots/{shared.post(f'{API}/snapshots', json=body).json()['id']}/"
                "image.png"
            ).content
        ).astype(float)
        for body in ({"camera": "south"}, {"camera": "south", "frames": 8, "over_s": 0.5})
    )
    # less noise on the carpet
    assert many[40:60, :].std(axis=1).mean() < one[40:60, :].std(axis=1).mean()
    refusal(shared.post(f"{API}/snapshots", json={"camera": "south", "frames": 0}), 422)
    refusal(
        shared.post(f"{API}/snapshots", json={"camera": "south", "frames": 5, "over_s": 1e9}), 422
    )


def test_what_is_plugged_in_is_listed_with_its_address(shared):
    answer = shared.get(f"{API}/cameras/found")
    assert answer.status_code == 200
    for camera in answer.json()["items"]:
        assert "://" in camera["address"] and camera["title"] and "address" in camera["identity"]
