"""Snapshots: what was sent is what comes back, pixel for pixel; what is no picture is not kept."""

import json

import cv2
import numpy as np
import pytest

from tests.support.pictures import (
    apng,
    encoded,
    gradient,
    jpeg_of_many_scans,
    jpeg_with_size,
    png_bomb,
)
from tests.support.refusals import API, refusal


def pixels_of(answer):
    return cv2.imdecode(np.frombuffer(answer.content, np.uint8), cv2.IMREAD_COLOR)


@pytest.mark.parametrize("suffix", ["png", "jpg", "bmp", "webp"])
def test_an_uploaded_picture_comes_back_pixel_for_pixel(standing, suffix):
    sent = encoded(suffix, gradient(64, 48))
    answer = standing.post(f"{API}/snapshots", files={"file": ("a.bin", sent)})
    kept = answer.json()
    assert answer.status_code == 201 and (kept["width"], kept["height"], kept["camera"]) == (
        64,
        48,
        None,
    )
    assert answer.headers["location"] == f"{API}/snapshots/{kept['id']}"
    shown = standing.get(f"{API}/snapshots/{kept['id']}/image.png")
    assert (
        shown.headers["content-type"] == "image/png"
        and "immutable" in shown.headers["cache-control"]
    )
    assert np.array_equal(
        pixels_of(shown), cv2.imdecode(np.frombuffer(sent, np.uint8), cv2.IMREAD_COLOR)
    )
    jpeg = standing.get(f"{API}/snapshots/{kept['id']}/image.jpg")
    assert jpeg.headers["content-type"] == "image/jpeg" and pixels_of(jpeg).shape == (48, 64, 3)


def test_an_uploaded_picture_has_the_name_of_its_file_and_one_of_a_camera_none(standing):
    sent = encoded("png", gradient(64, 48))
    kept = standing.post(f"{API}/snapshots", files={"file": ("Halle Süd.png", sent)}).json()
    assert kept["name"] == "Halle Süd.png"
    assert standing.get(f"{API}/snapshots/{kept['id']}").json() == kept
    long = standing.post(f"{API}/snapshots", files={"file": ("x" * 300, sent)}).json()
    assert long["name"] == "x" * 200
    taken = standing.post(f"{API}/snapshots", json={"camera": "north"}).json()
    assert taken["name"] == ""


def test_a_turning_note_in_a_jpeg_reaches_no_viewer(standing):
    exif = b"Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0"
    jpeg = encoded("jpg", gradient(64, 48))
    turned = jpeg[:2] + b"\xff\xe1" + (len(exif) + 2).to_bytes(2) + exif + jpeg[2:]
    kept = standing.post(f"{API}/snapshots", files={"file": turned}).json()
    assert (kept["width"], kept["height"]) == (64, 48)
    for format in ("png", "jpg"):
        shown = standing.get(f"{API}/snapshots/{kept['id']}/image.{format}")
        assert b"Exif" not in shown.content and pixels_of(shown).shape == (48, 64, 3)


def test_a_camera_gives_a_frame_when_asked(standing):
    kept = standing.post(f"{API}/snapshots", json={"camera": "north"}).json()
    assert (kept["width"], kept["height"], kept["camera"], kept["format"]) == (
        320,
        256,
        "north",
        "png",
    )
    assert pixels_of(standing.get(f"{API}/snapshots/{kept['id']}/image.png")).std() > 5
    again = standing.post(f"{API}/snapshots", json={"camera": "north"}).json()
    assert again["id"] != kept["id"]


def test_an_upload_may_say_which_camera_it_is_from(standing, picture):
    kept = standing.post(
        f"{API}/snapshots", files={"file": picture}, data={"camera": "north"}
    ).json()
    assert kept["camera"] == "north"
    refusal(
        standing.post(f"{API}/snapshots", files={"file": picture}, data={"camera": "south"}),
        404,
        "unknown-camera",
    )


@pytest.mark.parametrize("camera", ["../configs", "a\0b", "../../" + "x" * 50])
def test_a_camera_by_a_name_that_means_another_file_is_unknown(standing, camera):
    refusal(
        standing.post(
            f"{API}/snapshots",
            content=json.dumps({"camera": camera}),
            headers={"Content-Type": "application/json"},
        ),
        404,
        "unknown-camera",
    )


@pytest.fixture
def small() -> bytes:
    return encoded("png", gradient(64, 48))


def test_what_a_picture_was_taken_for_is_kept_and_sorts_the_list(client, small):
    def send(**told):
        return client.post(f"{API}/snapshots", files={"file": small}, data=told).json()

    field, board = send(), send(purpose="board")
    taken = client.post(f"{API}/snapshots", json={"camera": "north", "purpose": "straight"}).json()
    assert [s["purpose"] for s in (field, board, taken)] == ["picture", "board", "straight"]
    for purpose, kept in (("picture", field), ("board", board), ("straight", taken)):
        assert [
            s["id"] for s in client.get(f"{API}/snapshots?purpose={purpose}").json()["items"]
        ] == [kept["id"]]
    assert len(client.get(f"{API}/snapshots").json()["items"]) == 3
    refusal(client.get(f"{API}/snapshots?purpose=party"), 422)
    refusal(client.post(f"{API}/snapshots", files={"file": small}, data={"purpose": "party"}), 422)
    refusal(client.post(f"{API}/snapshots", json={"camera": "north", "purpose": "party"}), 422)
    refusal(client.post(f"{API}/snapshots", files={"file": small, "purpose": small}))
    assert len(client.get(f"{API}/snapshots").json()["items"]) == 3


def test_the_pictures_of_one_camera_are_listed(standing, small):
    client = standing
    for camera in ("east", "EAST", "ea_t"):
        client.post(f"{API}/cameras", json={"id": camera, "source": "sim://table"})
    ids = {
        camera: [
            client.post(
                f"{API}/snapshots",
                files={"file": small},
                data={"camera": camera, "purpose": purpose},
            ).json()["id"]
            for purpose in ("picture", "board")
        ]
        for camera in ("east", "EAST", "ea_t")
    }
    client.post(f"{API}/snapshots", files={"file": small})
    for camera, of_it in ids.items():
        listed = client.get(f"{API}/snapshots", params={"camera": camera}).json()["items"]
        assert [one["id"] for one in listed] == of_it[::-1]
        both = client.get(f"{API}/snapshots", params={"camera": camera, "purpose": "board"}).json()[
            "items"
        ]
        assert [one["id"] for one in both] == of_it[1:]
    assert client.get(f"{API}/snapshots", params={"camera": "nobody"}).json()["items"] == []
    refusal(client.get(f"{API}/snapshots", params={"camera": "../etc"}), 422)


def test_a_picture_comes_small_when_a_width_is_named(standing):
    id = standing.post(f"{API}/snapshots", files={"file": encoded("png", gradient(64, 48))}).json()[
        "id"
    ]
    for width, shape in ((32, (24, 32, 3)), (64, (48, 64, 3)), (8192, (48, 64, 3))):
        shown = standing.get(f"{API}/snapshots/{id}/image.jpg", params={"width": width})
        assert pixels_of(shown).shape == shape and "immutable" in shown.headers["cache-control"]
    for width in (15, 8193, "wide"):
        refusal(standing.get(f"{API}/snapshots/{id}/image.jpg", params={"width": width}), 422)


def test_snapshots_are_listed_newest_first_in_pages(standing, small):
    client = standing
    ids = [client.post(f"{API}/snapshots", files={"file": small}).json()["id"] for _ in range(5)]
    seen, cursor = [], ""
    while cursor is not None:
        page = client.get(
            f"{API}/snapshots", params={"limit": 2, **({"cursor": cursor} if cursor else {})}
        ).json()
        assert 1 <= len(page["items"]) <= 2
        seen += [item["id"] for item in page["items"]]
        cursor = page["next_cursor"]
    assert seen[:5] == ids[::-1]
    assert seen == [item["id"] for item in client.get(f"{API}/snapshots?limit=200").json()["items"]]


BAD = {
    "text": (lambda: b"no picture at all", 422),
    "nothing": (lambda: b"", 422),
    "gif": (lambda: b"GIF89a" + bytes(30), 422),
    "half a jpeg": (lambda: encoded("jpg", gradient())[:200], 422),
    "half a png": (lambda: encoded("png", gradient())[:-300], 422),
    "a bomb": (lambda: png_bomb(16000, 16000), 413),
    "an animation": (apng, 422),
    "endless scans": (lambda: jpeg_of_many_scans(200, 64, 64), 422),
    "a giant": (lambda: jpeg_with_size(65500, 65500), 413),
    "a page": (lambda: b"<svg onload=alert(1)>", 422),
}


@pytest.mark.parametrize(("make", "status"), BAD.values(), ids=BAD.keys())
def test_what_is_no_picture_is_refused_and_not_kept(standing, make, status):
    before = standing.get(f"{API}/snapshots").json()
    refusal(
        standing.post(f"{API}/snapshots", files={"file": ("x.png", make(), "image/png")}), status
    )
    assert standing.get(f"{API}/snapshots").json() == before


def test_a_form_without_a_picture_is_told_what_to_send(standing, picture):
    before = standing.get(f"{API}/snapshots").json()
    assert (
        "file"
        in refusal(standing.post(f"{API}/snapshots", files={"fil": picture}), 422, "no-file")["fix"]
    )
    refusal(standing.post(f"{API}/snapshots", files={"file": picture, "file2": picture}))
    refusal(standing.post(f"{API}/snapshots", data={"file": "text"}), 422)
    refusal(
        standing.post(f"{API}/snapshots", content=picture, headers={"Content-Type": "image/png"}),
        422,
    )
    refusal(
        standing.post(
            f"{API}/snapshots", content=b"--x", headers={"Content-Type": "multipart/form-data"}
        )
    )
    refusal(
        standing.post(
            f"{API}/snapshots",
            content=b"--x\r\n\xff",
            headers={"Content-Type": "multipart/form-data; boundary=x"},
        )
    )
    refusal(standing.post(f"{API}/snapshots", json={"camera": "north", "more": 1}), 422)
    refusal(standing.post(f"{API}/snapshots", json={"camera": "no-such"}), 404, "unknown-camera")
    assert standing.get(f"{API}/snapshots").json() == before


@pytest.mark.parametrize(
    "id", ["0123456789abcdef", "nope", "..", "%2e%2e", "a%00b", "é", "x" * 300, "%ff"]
)
def test_an_unknown_snapshot_is_said_to_be_unknown(standing, id):
    for path in ("", "/image.png"):
        refusal(standing.get(f"{API}/snapshots/{id}{path}"))


@pytest.mark.parametrize(
    "query", ["limit=0", "limit=201", "limit=x", "limit=1e3", "cursor=x", "cursor=-1", "cursor=%00"]
)
def test_a_page_that_cannot_be_is_refused(standing, query):
    refusal(standing.get(f"{API}/snapshots?{query}"), 422)


@pytest.mark.long
def test_every_hostile_picture_beside_the_project_is_answered(client, real_data):
    files = sorted(
        path for path in real_data("hostile_images").iterdir() if path.name != "SOURCE.txt"
    )
    decoded = 0
    for path in files:
        answer = client.post(f"{API}/snapshots", files={"file": path.read_bytes()})
        assert answer.status_code in (201, 413, 422), (path.name, answer.text)
        decoded += answer.status_code == 201
    assert 0 < decoded < len(files)
    assert client.get(f"{API}/health").status_code == 200
