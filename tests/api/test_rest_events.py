"""REST of what has happened: activations over all cameras, and what cameras did by themselves."""

from datetime import UTC, datetime

import pytest

from tests.support import store_writer
from tests.support.activation import activate_despite
from tests.support.pictures import encoded
from tests.support.refusals import API, refusal
from tests.support.waiting import until
from touchline.services.activity import MAX_NOTED, CameraEvents, newest_events

CAL = f"{API}/calibrations"
STEADY = {"calibration": "a", "state": "steady", "alarm": False, "mm": 0.1}
KNOCKED = {"calibration": "a", "state": "knocked", "alarm": True, "mm": 49.2}


def events(client, **params):
    return client.get(f"{API}/events", params=params).json()["items"]


def noted(*story):
    """What is noted of a camera, oldest first, that is in these states one after the other."""
    log = CameraEvents()
    for state, drift in story:
        log.note({"east": {"state": state, "drift": drift}})
    return [(event.kind, event.text("{}")) for event in reversed(log.noted)]


def test_activations_of_all_cameras_are_listed_newest_first(client, task, calibration):
    body = {**task, "model": "homography", "options": {}}
    north, removed = (
        client.post(CAL, json={**body, "camera": camera}).json() for camera in ("north", "removed")
    )
    against = [
        len(activate_despite(client, made["id"], headers={"X-Operator": who}))
        for made, who in ((calibration, "Ada"), (north, "Bo"), (removed, "Cy"))
    ]

    def told(camera, problems):
        return f"Version 1 of {camera} was activated. Known problems: {problems}."

    found = events(client)
    assert [
        (one["kind"], one["camera"], one["version"], one["by"], one["text"]) for one in found
    ] == [
        ("activated", "removed", 1, "Cy", told("removed", against[2])),
        ("activated", "north", 1, "Bo", told("North half", against[1])),
        ("activated", None, 1, "Ada", told("the images from files", against[0])),
    ]
    assert [one["at"] for one in found] == sorted((one["at"] for one in found), reverse=True)
    assert found[2]["statements"] == {
        "text": [
            {
                "code": "event.activated-despite",
                "values": {
                    "version": 1,
                    "camera": {"code": "event.images-from-files", "values": {}},
                    "problems": against[0],
                },
            }
        ]
    }
    assert events(client, limit=1) == found[:1]
    for limit in (0, 201, "many"):
        refusal(client.get(f"{API}/events", params={"limit": limit}), 422)


def test_what_happened_last_comes_first_after_the_clock_was_set_back(client, monkeypatch):
    services = client.app.state.services
    made = services.store.calibrations.add(store_writer.calibration("north", ""))
    hours = iter(range(23, 0, -1))

    def set_back():
        return datetime(2026, 1, 1, next(hours), tzinfo=UTC)

    monkeypatch.setattr(services.store.calibrations, "_clock", set_back)
    monkeypatch.setattr("touchline.services.activity.utc_now", set_back)
    log = CameraEvents()
    for state, by in (("live", "Ada"), ("offline", "Bo"), ("live", "Cy")):
        log.note({"north": {"state": state, "drift": None}})
        services.store.calibrations.activate(made.id, by)

    def told(limit):
        return [
            one["by"] or one["kind"]
            for one in newest_events(log.noted, services.store, services.cameras, limit)
        ]

    assert told(9) == ["Cy", "back", "Bo", "offline", "Ada"] and told(2) == ["Cy", "back"]


def test_a_camera_that_goes_offline_and_comes_back_is_told(client):
    client.post(
        f"{API}/cameras",
        json={"id": "east", "name": "East", "source": "picture://field.png?fps=20"},
    )
    client.get(f"{API}/cameras/east/status")
    until(lambda: [one["text"] for one in events(client)] == ["East went offline."])
    folder = client.app.state.services.settings.shown_pictures
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "field.png").write_bytes(encoded("png"))
    until(
        lambda: (
            [(one["kind"], one["text"]) for one in events(client)][-2:]
            == [("back", "East is back."), ("offline", "East went offline.")]
        )
    )


@pytest.mark.parametrize(
    ("story", "told"),
    [
        ([("connecting", None), ("live", None), ("live", STEADY)], []),
        (
            [
                ("live", None),
                ("stalled", None),
                ("connecting", None),
                ("offline", None),
                ("connecting", None),
                ("live", None),
            ],
            [("offline", "{} went offline."), ("back", "{} is back.")],
        ),
        (
            [
                ("live", STEADY),
                ("live", KNOCKED),
                ("live", {**KNOCKED, "mm": 50}),
                ("stalled", None),
                ("live", KNOCKED),
            ],
            [
                ("moved", "{} moved by 49 mm."),
                ("offline", "{} went offline."),
                ("back", "{} is back."),
            ],
        ),
        (
            [
                ("live", KNOCKED),
                ("live", {**STEADY, "state": "covered"}),
                ("live", KNOCKED),
                ("live", STEADY),
            ],
            [
                ("moved", "{} moved by 49 mm."),
                ("cleared", "{} is in its calibrated position again."),
            ],
        ),
        (
            [("live", KNOCKED), ("live", {**KNOCKED, "state": "out-of-focus"})],
            [("moved", "{} moved by 49 mm."), ("moved", "The focus of {} has changed.")],
        ),
        (
            [("live", KNOCKED), ("live", {**STEADY, "calibration": "b"})],
            [("moved", "{} moved by 49 mm.")],
        ),
    ],
)
def test_only_what_changes_is_noted(story, told):
    assert noted(*story) == told


def test_what_is_noted_is_bounded():
    story = [("live", None), ("offline", None)] * MAX_NOTED
    assert len(noted(*story)) == MAX_NOTED


def test_a_camera_whose_process_was_ended_is_forgotten():
    log = CameraEvents()
    for statuses in (
        {"east": {"state": "offline", "drift": None}},
        {},
        {"east": {"state": "live", "drift": None}},
    ):
        log.note(statuses)
    assert [event.kind for event in log.noted] == ["offline"]
