"""What something names does not go: neither asked for alone nor in a race with whoever begins to name it."""

from concurrent.futures import ThreadPoolExecutor
from functools import partial
from itertools import count
from threading import Barrier

import pytest

from tests.support.refusals import API, refusal

RACES = 12
FIELD = {
    "name": "mine",
    "length_mm": 3000,
    "width_mm": 2000,
    "lines": [{"name": "middle", "from": [0, -1000], "to": [0, 1000], "width_mm": 20}],
    "regions": {
        "full": {"x": [-1500, 1500], "y": [-1000, 1000]},
        "left": {"x": [-1500, 0], "y": [-1000, 1000]},
    },
}
WITHOUT_LEFT = {**FIELD, "regions": {"full": FIELD["regions"]["full"]}}
COLOURS = {
    "name": "hall",
    "colours": {"orange": [{"rgb": [250, 112, 30]}], "green": [{"rgb": [10, 120, 30]}]},
}
CAMERA = {"name": "Camera", "source": "sim://table"}
NUMBERS = count()
other = "none"  # a camera that is there and names nothing; another one each time


def put_field(client):
    return client.put(f"{API}/fields/mine", json=FIELD)


def delete_field(client):
    return client.delete(f"{API}/fields/mine")


def remove_region(client):
    return client.put(f"{API}/fields/mine", json=WITHOUT_LEFT)


def add_camera(client):
    return client.post(
        f"{API}/cameras",
        json={**CAMERA, "id": f"camera-{next(NUMBERS)}", "field": "mine", "region": "left"},
    )


def change_camera(client):
    etag = client.get(f"{API}/cameras/{other}").headers["ETag"]
    return client.patch(
        f"{API}/cameras/{other}",
        json={"field": "mine", "region": "left"},
        headers={"If-Match": etag},
    )


def save_rig(client):
    return client.put(
        f"{API}/rigs/rig-{next(NUMBERS)}",
        json={
            "title": "Rig",
            "field": "mine",
            "cameras": [{"camera": other, "region": "left", "rotate": None}],
        },
    )


def publish(client):
    return client.put(f"{API}/publishing", json={"field": "mine"})


def put_colours(client):
    return client.put(f"{API}/colours/hall", json={"profile": COLOURS})


def delete_colours(client):
    return client.delete(f"{API}/colours/hall")


def name_colours(client):
    answer = client.get(f"{API}/cameras/{other}/seeing")
    body = {key: answer.json()[key] for key in ("on", "plan", "profile", "publish")} | {
        "colours": "hall"
    }
    return client.put(
        f"{API}/cameras/{other}/seeing", json=body, headers={"If-Match": answer.headers["ETag"]}
    )


def clear(client):
    """Nothing names anything any more."""
    global other
    for rig in client.get(f"{API}/rigs").json()["items"]:
        client.delete(f"{API}/rigs/{rig['name']}")
    for camera in client.get(f"{API}/cameras").json()["items"]:
        if camera["editable"]:
            client.delete(f"{API}/cameras/{camera['id']}")
    client.put(f"{API}/publishing", json={"field": None})
    other = f"other-{next(NUMBERS)}"
    assert client.post(f"{API}/cameras", json={**CAMERA, "id": other}).status_code == 201


# What is there first, what would take it away, who names it, and the reason of the refusal.
TABLE = [
    *(
        (put_field, delete_field, name, "field-used")
        for name in (add_camera, change_camera, save_rig, publish)
    ),
    *(
        (put_field, remove_region, name, "region-used")
        for name in (add_camera, change_camera, save_rig)
    ),
    (put_colours, delete_colours, name_colours, "colours-used"),
]
NAMED = pytest.mark.parametrize(
    "put, take, name, reason", TABLE, ids=lambda part: getattr(part, "__name__", None)
)


@NAMED
def test_what_something_names_does_not_go_until_nothing_does(standing, put, take, name, reason):
    clear(standing)
    assert put(standing).status_code in (200, 201, 428)
    assert name(standing).status_code in (200, 201)
    assert refusal(take(standing), 409, reason)["fix"]
    clear(standing)
    assert take(standing).status_code in (200, 204)


@NAMED
def test_of_two_at_once_what_is_named_stays_or_nobody_names_it(standing, put, take, name, reason):
    for _ in range(RACES):
        clear(standing)
        put(standing)
        with ThreadPoolExecutor(2) as both:
            gone, named = both.map(partial(at_the_same_time, Barrier(2), standing), (take, name))
        assert sorted((gone < 300, named < 300)) == [False, True], (gone, named)


def at_the_same_time(all_there, client, call):
    """The status of a call that is made once all are there."""
    all_there.wait()
    return call(client).status_code
